"""The states of a shape as a table and as a small drawing for terminals of 80 columns."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence

from curveline.cli.printing import screen
from curveline.cli.printing.canvas import Canvas
from curveline.cli.printing.manner import MANNER
from curveline.cli.printing.tables import Columns, Heading, fitting
from curveline.material.history import duration_text, history_text
from curveline.material.past import FLAT, Past
from curveline.phrases import wrapped
from curveline.rod.states.equilibrium import SPATIAL, Equilibrium
from curveline.simulation.explanation import deepest, explain
from curveline.simulation.results import ShapeReport, curve_mm
from curveline.simulation.simulate import SegmentStates
from curveline.units import to_mj, to_mm, to_nmm

HEAD = ("  state", "mean", "middle", "mJ", "mm", "stability", "left", "right", "left", "right")
GROUPS = (
    Heading("height mm", 1, 2),
    Heading("energy", 3, 3),
    Heading("error", 4, 4),
    Heading("force N", 6, 7),
    Heading("moment N mm", 8, 9),
)
IN_SPACE = "depth"
"""Head of the column that states in space have in place of the height in the middle."""
MIDDLE_COLUMN = 2
LEGEND = "stability: lowest eigenvalue of the second variation, in EI/L^2"
MARK = "*"
UNKNOWN = "?"
DOTTED = 3
"""Of the dots of a curve that is not wanted, every third is drawn."""


def describe(report: ShapeReport) -> Iterator[str]:
    """Lines of text on every segment of a shape."""
    if MANNER.is_brief:
        yield from _briefly(report)
        return
    scene, milliseconds = report.scene, 1e3 * report.seconds
    yield screen.paint(scene.name, screen.BOLD, sys.stdout)
    yield (
        f"display {scene.display.name}, tolerance {to_mm(report.settings.tolerance):g} mm, "
        f"{len(report.segments)} segment{'s' if len(report.segments) > 1 else ''} in {milliseconds:.1f} ms"
    )
    if scene.past is not None:
        yield from wrapped(_past_words(scene.past))
    rows = {
        number: [_cells(state, segment.model) for state in segment.states]
        for number, segment in enumerate(report.segments)
    }
    table = fitting([HEAD, *(row for some in rows.values() for row in some)], groups=GROUPS)
    for number, segment in enumerate(report.segments):
        wanted = f"{to_mm(segment.length):g} mm of rod, {segment.wanted_name} wanted"
        yield f"segment {number + 1}: {wanted}, {segment.model} model"
        yield from _state_lines(segment, table, rows[number])
        if segment.states and segment.left_out:
            yield f"left out, at most: {', '.join(_left_out(segment))}"
        if report.settings.explained:
            for sentence in explain(segment):
                yield from wrapped(sentence)
    if any(rows.values()):
        yield LEGEND


def _past_words(past: Past) -> str:
    """What a rod went through, the set that it has, and how soon that is gone."""
    law = " (acetal's estimate: the display file says nothing)" if past.is_estimate else ""
    after = history_text(past.history)
    return f"after {after} the rod has a set of up to {past.largest_set:.2g} 1/m{law}; {set_words(past)}"


def set_words(past: Past) -> str:
    """How soon the set of a rod is gone."""
    seconds = past.flat_after
    flat = f"it lies flat to {to_mm(FLAT):g} mm"
    if seconds > 0.0:
        wait = "for years" if math.isinf(seconds) else f"for {duration_text(seconds, rounded=True)}"
        flat = f"held straight {wait} {flat}"
    return f"{flat} over {to_mm(past.span):g} mm"


def _briefly(report: ShapeReport) -> Iterator[str]:
    """A line per segment: whether it is as wanted, how exact, and what else there is."""
    for number, segment in enumerate(report.segments, start=1):
        wanted = [state for state in segment.states if state.wanted]
        found = (
            f"{segment.wanted_name}, as wanted, to {_error(wanted[0])} mm" if wanted else f"no {segment.wanted_name}"
        )
        others = [state.name for state in segment.states if not state.wanted]
        also = f"; also {', '.join(others)}" if others else ""
        yield f"{report.scene.name}, segment {number}: {found}{also}"


def _state_lines(segment: SegmentStates, table: Columns, rows: Sequence[tuple[str, ...]]) -> Iterator[str]:
    """The table of a segment's states, the wanted one marked."""
    if not segment.states:
        yield "no stable state was found"
        return
    is_spatial = segment.model == SPATIAL
    head = (*HEAD[:MIDDLE_COLUMN], IN_SPACE, *HEAD[MIDDLE_COLUMN + 1 :]) if is_spatial else HEAD
    lines = list(screen.headed(table, head, rows))
    yield from lines[: -len(rows)]
    for state, line in zip(segment.states, lines[-len(rows) :], strict=True):
        colour = screen.BOLD if state.wanted else "" if state.simple else screen.DIM
        yield screen.paint(line, colour, sys.stdout) if colour else line
    if not all(state.is_untangled for state in segment.states):
        yield from wrapped("loops, crossings and wrapped curves are stable, but a planar display cannot show them")
    leaving = [state.name for state in segment.states if state.leaves_plane]
    if leaving:
        yield from wrapped(f"unstable in the plane, which the rod leaves: {', '.join(leaving)}")


def _cells(state: Equilibrium, model: str) -> tuple[str, ...]:
    forces = state.clamp_force if state.space is None else state.space.forces
    middle = deepest(state) if model == SPATIAL else _height_at_middle(state)
    return (
        f"{MARK if state.wanted else ' '} {state.name}",
        f"{to_mm(state.mean_height):.2f}",
        f"{to_mm(float(middle)):.2f}",
        f"{to_mj(state.energy):.2f}",
        _error(state),
        f"{state.lowest_eigenvalue:.3g}" if math.isfinite(state.lowest_eigenvalue) else UNKNOWN,
        *(f"{math.hypot(*force):.2f}" for force in forces.tolist()),
        *(f"{to_nmm(float(moment)):.0f}" for moment in state.clamp_moment),
    )


def _error(state: Equilibrium) -> str:
    return f"{to_mm(state.error):.1g}" if math.isfinite(state.error) else UNKNOWN


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
