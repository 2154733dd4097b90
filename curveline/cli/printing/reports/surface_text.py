"""What was fitted to a surface, in text for terminals of 80 columns."""

from __future__ import annotations

import sys
from collections.abc import Iterator

from curveline.cli.printing import screen
from curveline.cli.printing.manner import MANNER
from curveline.cli.printing.tables import fitting
from curveline.phrases import counted, spans, wrapped
from curveline.surfaces.budget import STALL_A, STALL_SOURCE, SurfaceBudget
from curveline.surfaces.fit_surface import FittedLine, FittedSurface
from curveline.system.files import printable
from curveline.units import plain, to_mm, to_ms

LINE_HEAD = ("line", "y mm", "RMS mm", "max mm", "at x", "steps", "time s", "across mm")
LEAST_SHARE = 0.5
"""Of the largest distance of all lines, that the largest of a line has to be told with its reason."""


def describe(found: FittedSurface) -> Iterator[str]:
    """Lines of text on what was found."""
    if MANNER.is_brief:
        yield _briefly(found)
        return
    yield screen.paint(printable(found.name), screen.BOLD, sys.stdout)
    yield from wrapped(f"read: {printable(found.understood)}")
    rows = [_row(found, line) for line in found.lines]
    yield from screen.headed(fitting([LINE_HEAD, *rows]), LINE_HEAD, rows)
    yield from _reasons(found)
    if found.across:
        worst = max(found.across, key=lambda pair: pair.max)
        yield from wrapped(
            f"across: the step from line {worst.line} to line {worst.line + 1} is up to {_mm(worst.max)} mm off, at x "
            f"{to_mm(worst.x):.0f} mm"
        )
    yield from _budget(found.budget)
    for line in found.unplanned:
        yield from wrapped(f"line {line.number} has no plan: {line.fit.refusal}")
    yield f"{found.seconds:.2g} s"


def _briefly(found: FittedSurface) -> str:
    rms, most = (max(getattr(line.fit, which) for line in found.lines) for which in ("rms", "max"))
    missing = f", {counted(len(found.unplanned), 'line')} without a plan" if found.unplanned else ""
    told = f"{counted(len(found.lines), 'line')}, up to {_mm(rms)} mm RMS, {_mm(most)} mm at most"
    return f"{printable(found.name)}: {told}{missing}"


def _mm(length: float) -> str:
    return f"{to_mm(length):.3g}"


def _row(found: FittedSurface, line: FittedLine) -> tuple[str, ...]:
    fit = line.fit
    steps, seconds = ("none" if fit.refusal else "-", "")
    if fit.plan is not None:
        steps, seconds = str(len(fit.plan.steps)), f"{fit.plan.seconds:.1f}"
    across = next((_mm(pair.rms) for pair in found.across if pair.line == line.number), "")
    y = screen.decimal(to_mm(line.y), 1)
    return str(line.number), y, _mm(fit.rms), _mm(fit.max), f"{to_mm(fit.worst[0].x):.0f}", steps, seconds, across


def _reasons(found: FittedSurface) -> Iterator[str]:
    """Why lines are off most where they are; lines with one reason together."""
    largest = max(line.fit.worst[0].off for line in found.lines)
    told = [line for line in found.lines if line.fit.worst[0].off >= LEAST_SHARE * largest]
    for why in dict.fromkeys(line.fit.worst[0].why for line in told):
        numbers = [line.number for line in told if line.fit.worst[0].why == why]
        yield from wrapped(f"line{'s' if len(numbers) > 1 else ''} {spans(numbers)}: {why}", indent=2)


def _budget(budget: SurfaceBudget) -> Iterator[str]:
    yield from wrapped(
        f"rod: {budget.rod:.2f} m between the nodes, {budget.rod_to_have:.4g} m to have; "
        f"{counted(budget.nodes, 'node')}, {counted(budget.motors, 'motor')}"
    )
    source = STALL_SOURCE if budget.current_per_motor == STALL_A else "as given"
    yield from wrapped(
        f"current at worst: {plain(round(budget.current, 3))} A, {plain(round(budget.current_per_line, 3))} A a line, "
        f"{plain(budget.current_per_motor)} A a motor ({source})"
    )
    every = to_ms(budget.nodes / budget.most_polls_per_s)
    is_much = budget.polls_per_s > budget.most_polls_per_s
    air = f": nodes are asked every {every:.0f} ms then, unless there are more" if is_much else ""
    yield from wrapped(
        f"radio: {budget.polls_per_s:.0f} polls a second on {counted(budget.channels, 'channel')}, which carries "
        f"{budget.most_polls_per_s:.0f}{air}"
    )
    if budget.seconds_together is not None and budget.seconds_in_turn is not None:
        yield f"time: {budget.seconds_together:.0f} s all at once, {budget.seconds_in_turn:.0f} s one after another"
