"""The states of a shape as a table and as a small drawing for terminals of 80 columns."""

from __future__ import annotations

import math
import sys
import textwrap
from collections.abc import Iterator, Sequence

from curveline.cli.printing import screen
from curveline.cli.printing.canvas import Canvas
from curveline.rod.states.equilibrium import SPATIAL, Equilibrium
from curveline.simulation.explanation import deepest, explain
from curveline.simulation.results import ShapeReport, curve_mm
from curveline.simulation.simulate import SegmentStates
from curveline.units import to_mj, to_mm, to_nmm

HEAD = ("  state", "mean mm", "mid mm", "energy mJ", "err mm", "eigen", "clamps N", "N mm")
DEPTH = "out mm"
"""Head of the column that states in space have in place of the height in the middle."""
DEPTH_COLUMN = 2
WIDTH = 80
MARK = "*"
UNKNOWN = "?"
DOTTED = 3
"""Of the dots of a curve that is not wanted, every third is drawn."""


def describe(report: ShapeReport) -> Iterator[str]:
    """Lines of text on every segment of a shape."""
    scene, milliseconds = report.scene, 1e3 * report.seconds
    yield screen.paint(scene.name, screen.BOLD, sys.stdout)
    yield (
        f"display {scene.display.name}, tolerance {to_mm(report.settings.tolerance):g} mm, "
        f"{len(report.segments)} segment{'s' if len(report.segments) > 1 else ''} in {milliseconds:.1f} ms"
    )
    for number, segment in enumerate(report.segments, start=1):
        wanted = f"{to_mm(segment.length):g} mm of rod, {segment.wanted_name} wanted"
        yield f"segment {number}: {wanted}, {segment.model} model"
        yield from _state_lines(segment)
        if segment.states and segment.left_out:
            yield f"left out, at most: {', '.join(_left_out(segment))}"
        if report.settings.explained:
            for sentence in explain(segment):
                yield from textwrap.wrap(sentence, WIDTH, subsequent_indent="  ")


def _state_lines(segment: SegmentStates) -> Iterator[str]:
    """The table of a segment's states, the wanted one marked."""
    if not segment.states:
        yield "no stable state was found"
        return
    rows = [HEAD, *map(_cells, segment.states)]
    if segment.model == SPATIAL:
        depths = (DEPTH, *(f"{to_mm(deepest(state)):.2f}" for state in segment.states))
        rows = [(*row[:DEPTH_COLUMN], depth, *row[DEPTH_COLUMN + 1 :]) for row, depth in zip(rows, depths, strict=True)]
    lines = screen.table(rows)
    yield screen.paint(lines[0], screen.DIM, sys.stdout)
    for state, line in zip(segment.states, lines[1:], strict=True):
        colour = screen.BOLD if state.wanted else "" if state.simple else screen.DIM
        yield screen.paint(line, colour, sys.stdout) if colour else line
    if not all(state.is_untangled for state in segment.states):
        yield "loops, crossings and wrapped curves are stable, but a planar display cannot show them"
    leaving = [state.name for state in segment.states if state.leaves_plane]
    if leaving:
        yield from textwrap.wrap(f"unstable in the plane, which the rod leaves: {', '.join(leaving)}", WIDTH)


def _cells(state: Equilibrium) -> tuple[str, ...]:
    forces = state.clamp_force if state.space is None else state.space.forces
    left, right = (math.hypot(*force) for force in forces.tolist())
    start, end = (to_nmm(float(moment)) for moment in state.clamp_moment)
    return (
        f"{MARK if state.wanted else ' '} {state.name}",
        f"{to_mm(state.mean_height):.2f}",
        f"{to_mm(float(_height_at_middle(state))):.2f}",
        f"{to_mj(state.energy):.2f}",
        f"{to_mm(state.error):.1g}" if math.isfinite(state.error) else UNKNOWN,
        f"{state.lowest_eigenvalue:.3g}" if math.isfinite(state.lowest_eigenvalue) else UNKNOWN,
        f"{left:.2f} {right:.2f}",
        f"{start:.0f} {end:.0f}",
    )


def _height_at_middle(state: Equilibrium) -> float:
    """Distance of the middle of the rod from the chord [m], upwards positive."""
    x, y = state.curve(3)[1]
    across, up = state.rod.chord
    return float((across * y - up * x) / max((across**2 + up**2) ** 0.5, 1e-300))


def _left_out(segment: SegmentStates) -> Iterator[str]:
    for name, bound in segment.left_out.items():
        amount = to_mm(bound.bound)
        yield f"{name} {amount:.1g} mm" if amount < 1.0 else f"{name} {amount:.0f} mm"


def sketch(report: ShapeReport) -> Iterator[str]:
    """A drawing, from the front, of all states but loops and crossings: the wanted ones solid, the others dotted."""
    curves = [
        (state, curve_mm(report, index, state))
        for index, segment in enumerate(report.segments)
        for state in segment.states
        if state.is_untangled
    ]
    canvas = Canvas([curve.tolist() for _, curve in curves], sys.stdout.encoding or "ascii")
    # The wanted curve comes last, so that it lies on top where curves meet.
    for state, curve in sorted(curves, key=lambda item: item[0].wanted):
        canvas.draw(curve.tolist(), gap=1 if state.wanted else DOTTED)
    for index, node in enumerate(report.scene.nodes):
        canvas.mark(to_mm(index * report.scene.display.span), to_mm(node.height))
    for line in canvas.lines():
        yield f"  {line}".rstrip()
    yield f"  {'; '.join(_legend([state for state, _ in curves]))}"


def _legend(states: Sequence[Equilibrium]) -> Iterator[str]:
    """Which curves of a drawing are which."""
    wanted = sorted({state.name for state in states if state.wanted})
    others = sorted({state.name for state in states if not state.wanted})
    if wanted:
        yield f"solid: {' and '.join(wanted)}, as wanted"
    if others:
        yield f"dotted: {' and '.join(others)}"
    if any(deepest(state) > state.error for state in states):
        yield "seen from the front"
