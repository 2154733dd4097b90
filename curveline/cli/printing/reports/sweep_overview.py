"""A sweep on one screen: which states exist at how many of its points, how stable, how exact."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Mapping

from curveline.cli.printing import screen
from curveline.cli.printing.manner import MANNER
from curveline.cli.printing.tables import fitting
from curveline.scene import Scene
from curveline.simulation.results import Settings
from curveline.simulation.sweep import Group, Sweep, SweepTally
from curveline.units import to_mm

MOST_ROWS = 12
STATES_WIDTH = 34


def describe(sweep: Sweep, tally: SweepTally, settings: Settings) -> Iterator[str]:
    """Lines on what was asked for and what every segment came to."""
    scene: Scene = sweep.file.scene
    if MANNER.is_brief:
        for number, (segment, unwanted) in enumerate(zip(scene.segments, tally.unwanted, strict=True), start=1):
            share = f"{len(sweep) - unwanted:,} of {len(sweep):,} points have the {segment.state}"
            yield f"{scene.name}, segment {number}: {share}"
        return
    yield screen.paint(scene.name, screen.BOLD, sys.stdout)
    yield f"display {scene.display.name}, tolerance {to_mm(settings.tolerance):g} mm, {len(sweep):,} points"
    for axis in sweep.axes:
        yield f"  {axis}"
    for number, segment in enumerate(scene.segments, start=1):
        length = (
            ""
            if any(axis.path[:2] == ("segments", number - 1) for axis in sweep.axes)
            else (f"{to_mm(segment.length):g} mm of rod, ")
        )
        yield f"segment {number}: {length}{segment.state} wanted"
        yield from _rows(tally.groups[number - 1])
        if tally.unwanted[number - 1]:
            yield f"without {segment.state}: {tally.unwanted[number - 1]:,} points"


def _rows(groups: Mapping[str, Group]) -> Iterator[str]:
    """The table of a segment, the most frequent states first."""
    often = sorted(groups.items(), key=lambda item: (-item[1].points, item[0]))
    total = sum(group.points for group in groups.values())
    head = ("  stable states", "points", "%", "stability in EI/L^2", "error mm")
    rows = [_cells(states, group, total) for states, group in often[:MOST_ROWS]]
    yield from screen.headed(fitting([head, *rows]), head, rows)
    if len(often) > MOST_ROWS:
        yield f"  and {len(often) - MOST_ROWS} rarer combinations"


def _cells(states: str, group: Group, total: int) -> tuple[str, ...]:
    name = states if len(states) <= STATES_WIDTH else f"{states[: STATES_WIDTH - 3]}..."
    values = f"{group.lowest:.3g} to {group.highest:.3g}" if math.isfinite(group.highest) else "-"
    return (f"  {name}", f"{group.points:,}", f"{100 * group.points / total:.1f}", values, f"{to_mm(group.error):.1g}")
