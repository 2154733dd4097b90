"""What `curveline bench` measured, as people read it: conditions, figures, ratios, what changed since another run."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

from curveline.cli.printing import screen
from curveline.phrases import counted, local_time, wrapped
from curveline.units import told_apart

if TYPE_CHECKING:
    from curveline.bench.comparison import BenchComparison, ComparedRow
    from curveline.bench.machine import Conditions, MachineLoad
    from curveline.bench.measurement import Measurement

HOW = 23
"""Columns that are left for how a figure was taken."""
COMMIT = 12
"""Characters of a commit that are shown."""
KERNELS = {
    "shipped": "shipped as machine code",
    "numba": "compiled by numba",
    "interpreted": "interpreted, some hundred times slower",
}
RATIOS = ("one rod's solution, time over that of", "", "bare Newton", "solve_bvp")
COMPARED = ("", "now", "then", "ratio", "noise", "")
BUSY = "the machine is busy: distrust the figures, and ratios less; measure again when it is idle"


def conditions(found: Conditions) -> list[str]:
    """Machine, load and versions."""
    machine = found.machine
    memory = f", {machine.memory_MB / 1000:.1f} GB" if machine.memory_MB else ""
    others = [f"{name} {each}" for name, each in asdict(found.versions).items() if name != "python" and each]
    lines = {
        "machine": f"{machine.processor[:40]}, {counted(machine.cores, 'core')}{memory}, "
        f"{machine.system} {machine.architecture}",
        "load": load(found.load),
        "curveline": f"{release(found)}, Python {found.versions.python}",
        "kernels": KERNELS.get(found.kernels, found.kernels),
        "with": ", ".join(others),
    }
    return [line for key, text in lines.items() for line in wrapped(f"{key:<9}  {text}", hang=11)]


def load(found: MachineLoad) -> str:
    """How busy the machine was, as far as is known."""
    parts = []
    if found.average is not None:
        parts.append(f"{found.average:.2f} over the last minute")
    if found.before is not None:
        parts.append(f"{100.0 * found.before:.0f} % of the processors at work just before")
    if found.during is not None:
        parts.append(f"{100.0 * found.during:.0f} % of them used by others during it")
    return ", ".join(parts) or "unknown"


def was_busy(found: MachineLoad) -> str:
    """A word for the end."""
    return f"the machine was busy, so distrust these figures; load: {load(found)}"


def release(found: Conditions) -> str:
    """Version of curveline, and the commit of a clone."""
    if found.commit is None:
        return found.curveline[:COMMIT]
    changed = " with changes" if found.commit.endswith("+") else ""
    return f"{found.curveline[:COMMIT]}, commit {found.commit[:COMMIT]}{changed}"


def measured(row: Measurement) -> list[str]:
    """A figure in 80 columns: one line, or two if it takes many words; `!` marks a goal that it misses."""
    mark = "!" if row.is_missed else " "
    line = f"{mark} {row.name:<33}{_beside_goal(row):>8} {row.unit:<3}{row.goal:>8}"
    if row.is_missed:
        line = screen.paint(line, screen.BOLD, sys.stdout)
    return [f"{line}  {row.how}".rstrip()] if len(row.how) <= HOW else [line.rstrip(), f"    {row.how}"]


def missed(rows: Sequence[Measurement]) -> str:
    """How many goals are missed, and which, as a sentence."""
    goals = sum(bool(row.goal) for row in rows)
    names = [row.name for row in rows if row.is_missed]
    if not names:
        return f"all {goals} goals met"
    return f"{len(names)} of {goals} goals missed, marked !: {'; '.join(names)}"


def ratios(rows: Sequence[Measurement]) -> list[str]:
    """A table of what each solution of a rod takes over the yardsticks; nothing if there is none."""
    found = [
        (row.name, f"{_number(row.value)} {row.unit}", _number(row.over_bare_newton), _number(row.over_solve_bvp))
        for row in rows
        if row.over_bare_newton is not None
    ]
    return ["", *screen.table([RATIOS, *found])] if found else []


def compared(found: BenchComparison) -> Iterator[str]:
    """A table of what is slower and faster than in another run, and what to keep in mind."""
    yield f"compared with {local_time(found.then.at)}, curveline {release(found.then)}"
    for sentence in (*found.differences, *found.remarks):
        yield f"  {sentence}"
    if found.differences:
        yield "  so times are compared over those of bare Newton in their own runs (x bare), others not at all"
    head, *lines = screen.table([COMPARED, *map(_cells, found.rows)], frozenset({0, 5}))
    yield screen.paint(head, screen.DIM, sys.stdout)
    for row, line in zip(found.rows, lines, strict=True):
        yield screen.paint(line, screen.BOLD, sys.stdout) if row.name in found.slower else line
    for names, which in ((found.only_now, "only now"), (found.only_then, "only then")):
        if names:
            yield f"{which}: {counted(len(names), 'figure')}"
    yield _changed(found)


def _cells(row: ComparedRow) -> tuple[str, ...]:
    ratio = "" if row.ratio is None else f"{row.ratio:.2f}"
    now = "-" if row.now is None else f"{_number(row.now)} {row.unit}".rstrip()
    return row.name, now, _number(row.then), ratio, f"{100.0 * row.noise:.0f} %", row.verdict


def _changed(found: BenchComparison) -> str:
    """How many figures changed by more than the noise, and which are slower."""
    slower = f": {'; '.join(found.slower)}" if found.slower else ""
    counts = f"{len(found.faster)} faster or better, {len(found.slower)} slower or worse{slower}"
    return f"of {counted(len(found.rows), 'figure')} by more than the noise: {counts}"


def _beside_goal(row: Measurement) -> str:
    """The value, with so many digits that it reads on the side of its goal on which it is."""
    shown, bound = _number(row.value), row.goal.rpartition(" ")[2]
    if row.value is None or not bound or float(shown) != float(bound):
        return shown
    return told_apart(row.value, float(bound), 3)[0]


def _number(value: float | None) -> str:
    """Three digits, or all of those before the point."""
    if value is None:
        return "-"
    return f"{value:.0f}" if abs(value) >= 100 or value == int(value) else f"{value:.3g}"
