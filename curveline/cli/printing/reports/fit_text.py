"""What a fit found, in text for terminals of 80 columns."""

from __future__ import annotations

import sys
from collections.abc import Iterator

from curveline.cli.printing import screen
from curveline.cli.printing.manner import MANNER
from curveline.cli.printing.tables import fitting
from curveline.fitting.fit import RMS, Fit
from curveline.fitting.reasons import ActiveLimit
from curveline.phrases import counted, in_words, spans, wrapped
from curveline.units import deg, plain, to_deg, to_mm

NODE_HEAD = ("node", "height mm", "angle deg", "length mm", "state")
LEAST_SHARE = 0.3
"""Of the largest distance, that a place has to be listed."""
LEAST_COST = 0.01
"""Part of the distance that a limit must cost for that to be told."""


def describe(found: Fit) -> Iterator[str]:
    """Lines of text on what was found."""
    if MANNER.is_brief:
        yield _briefly(found)
        return
    yield screen.paint(found.scene.name, screen.BOLD, sys.stdout)
    if found.drawing.understood:
        yield from wrapped(f"read: {found.drawing.understood}")
    rows = list(_rows(found))
    yield from screen.headed(fitting([NODE_HEAD, *rows], frozenset({4})), NODE_HEAD, rows)
    yield f"off the drawing: {_mm(found.rms)} mm RMS, {_mm(found.max)} mm at most"
    yield from _misses(found)
    if found.least_possible.max > 0.0:
        least = f"{_mm(found.least_possible.rms)} mm RMS and {_mm(found.least_possible.max)} mm at most"
        yield from wrapped(f"no shape of this display comes nearer than {least}: that is proven")
    for limit in found.limits:
        yield from wrapped(_limit(limit, found.rms))
    yield from wrapped(_search(found))
    sense = found.sensitivity
    yield from wrapped(
        f"a node that errs moves the curve by up to {sense.feed:.3g} mm per mm of rod, "
        f"{to_mm(sense.angle) * deg(1.0):.2g} mm per degree, {sense.height:.2g} mm per mm of height"
    )
    yield from wrapped(_plan(found))
    yield f"{found.seconds:.2g} s"


def _briefly(found: Fit) -> str:
    states = in_words([segment.state for segment in found.scene.segments])
    plan = "" if found.plan else ", no plan" if found.refusal else ""
    return f"{found.scene.name}: {_mm(found.rms)} mm RMS, {_mm(found.max)} mm at most, {states}{plan}"


def _mm(length: float) -> str:
    return f"{to_mm(length):.3g}"


def _rows(found: Fit) -> Iterator[tuple[str, ...]]:
    scene = found.scene
    for number, node in enumerate(scene.nodes, start=1):
        length, state = "", ""
        if number <= len(scene.segments):
            length, state = f"{to_mm(scene.segments[number - 1].length):.2f}", scene.segments[number - 1].state
        height, angle = screen.decimal(to_mm(node.height), 2), screen.decimal(to_deg(node.angle), 2)
        yield str(number), height, angle, length, state


def _misses(found: Fit) -> Iterator[str]:
    """Where it is farthest off, and why; places with one reason together."""
    worst = [miss for miss in found.worst if miss.off >= LEAST_SHARE * found.worst[0].off]
    for why in dict.fromkeys(miss.why for miss in worst):
        places = ", ".join(f"{_mm(miss.off)} mm at x {to_mm(miss.x):.0f}" for miss in worst if miss.why == why)
        yield from wrapped(f"{places}: {why}", indent=2)


def _limit(limit: ActiveLimit, rms: float) -> str:
    where = [
        f"{noun} {spans(numbers)}" for noun, numbers in (("node", limit.nodes), ("segment", limit.segments)) if numbers
    ]
    text = f"at its limit: {limit.name} = {plain(round(limit.value, 6))}{', ' if where else ''}{' and '.join(where)}"
    if limit.costs is None or limit.costs < LEAST_COST * rms:
        return text
    return f"{text}; without it {_mm(rms - limit.costs)} mm RMS"


def _search(found: Fit) -> str:
    kind = "RMS off" if found.request.minimise == RMS else "at most"
    best = "the best" if found.without_plan is None else "the nearest with a plan"
    text = f"{best} of {counted(found.starts, 'start')}, {found.hits} of which led to it"
    if found.second_best is not None:
        text += f"; the next best is {_mm(found.second_best)} mm {kind}"
    if found.without_plan is not None:
        text += f"; the nearest of all, {_mm(found.without_plan)} mm {kind}, has no plan"
    return text


def _plan(found: Fit) -> str:
    if found.plan is not None:
        return f"plan: {counted(len(found.plan.steps), 'step')} from home, {found.plan.seconds:.0f} s"
    return f"no plan: {found.refusal}" if found.refusal else "not planned"
