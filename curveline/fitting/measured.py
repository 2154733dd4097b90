"""A row as a shape of a display, and its distance from a drawing on the curve that is simulated."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from curveline.fitting.row import Array, FittedRow, Wanted, lengths_of
from curveline.rod.branches.drawn import misfits
from curveline.rod.states.equilibrium import Equilibrium
from curveline.scene import PEAK, WANTABLE, Node, Scene, Segment
from curveline.simulation.simulate import simulate
from curveline.units import deg, mm, to_deg, to_mm

POINTS = 401
"""Of each segment's curve, with which its distance is measured."""
DIGITS = 4
"""Behind the point, of numbers in mm and degrees: less than motors can tell."""
NOTHING = 1e-9
"""By how much a number in mm or degrees may be beyond a limit: floats are."""
TOLERANCE = mm(0.02)
"""Of the curves that are measured."""


class Gaps(NamedTuple):
    """How far a curve is from a drawing: distances [m] at points of the curve, `there`, and of the drawing, `back`.

    `mean_square` [m^2] is that along both, half of it the curve's.
    """

    there: Array
    back: Array
    mean_square: float

    @classmethod
    def between(cls, curve: Array, drawn: Array) -> Gaps:
        """Between a curve `(m, 2)` and a drawing `(k, 2)`, both polylines [m]."""
        nothing = np.zeros((0, curve.shape[0], 2))
        off = np.abs(misfits(curve, drawn, nothing, np.empty((curve.shape[0] + drawn.shape[0], 0))))
        there, back = off[: curve.shape[0]], off[curve.shape[0] :]
        return cls(there, back, 0.5 * (mean_square(curve, there) + mean_square(drawn, back)))


def mean_square(points: Array, off: Array) -> float:
    """The mean along a polyline of the squares of what is known at its points."""
    lengths = np.hypot(*np.diff(points, axis=0).T)
    return float(np.sum(lengths * 0.5 * (off[1:] ** 2 + off[:-1] ** 2)) / np.sum(lengths))


@dataclass(frozen=True, eq=False)
class MeasuredShape:
    """A row as a shape, with the curves (POINTS, 2) [m] of its wanted states in the display's frame, by segments."""

    row: FittedRow
    scene: Scene
    states: tuple[Equilibrium, ...]
    curves: tuple[Array, ...]
    gaps: tuple[Gaps, ...]

    @property
    def rms(self) -> float:
        """The root of the mean square distance, both ways [m]."""
        return math.sqrt(float(np.mean([gaps.mean_square for gaps in self.gaps])))

    @property
    def max(self) -> float:
        """The largest distance, either way [m]."""
        return max(float(max(gaps.there.max(), gaps.back.max())) for gaps in self.gaps)


def measured(wanted: Wanted, name: str, row: FittedRow) -> MeasuredShape | None:
    """A row as a shape of a name, in the states whose simulated curves are nearest; None if one has none."""
    scene, span = _scene(wanted, name, row), wanted.display.span
    segments, states, curves, gaps = [], [], [], []
    for place, found in enumerate(simulate(scene, TOLERANCE)):
        piece, foot = wanted.fine[place], np.array([0.0, scene.nodes[place].height])
        meant = [state for state in found.states if state.stable and state.name in WANTABLE and state.space is None]
        if not meant:
            return None
        seen = [state.curve(POINTS) + foot for state in meant]
        off = [Gaps.between(curve, piece) for curve in seen]
        nearest = int(np.argmin([each.mean_square for each in off]))
        segments.append(replace(scene.segments[place], state=meant[nearest].name))
        states.append(meant[nearest])
        curves.append(seen[nearest] + np.array([place * span, 0.0]))
        gaps.append(off[nearest])
    return MeasuredShape(row, replace(scene, segments=tuple(segments)), tuple(states), tuple(curves), tuple(gaps))


def _scene(wanted: Wanted, name: str, row: FittedRow) -> Scene:
    """A row as a shape, its numbers as a file has them: as nodes are told them. The states have no names yet."""
    count, offsets = wanted.nodes, wanted.display.offsets
    heights = row.numbers[:count]
    angles = row.numbers[count : 2 * count] - [offsets.angle(node) for node in range(count)]
    limits = wanted.display.limits
    lifted = [mm(_rounded(to_mm(each), to_mm(limits.height.low), to_mm(limits.height.high))) for each in heights]
    turned = [deg(_rounded(to_deg(each), to_deg(limits.angle.low), to_deg(limits.angle.high))) for each in angles]
    lengths = lengths_of(wanted, row.numbers) - [offsets.length(segment) for segment in range(count - 1)]
    fed = [mm(_rounded(to_mm(each), to_mm(limits.length.low), to_mm(limits.length.high))) for each in lengths]
    nodes, segments = tuple(map(Node, lifted, turned)), tuple(Segment(each, PEAK) for each in fed)
    return Scene(name, wanted.display, nodes, segments)


def _rounded(value: float, low: float, high: float) -> float:
    """A number as a file has it, not rounded beyond limits that have more digits."""
    step, near = 10.0**-DIGITS, round(float(value), DIGITS)
    if near > high + NOTHING:
        near = round(near - step, DIGITS)
    elif near < low - NOTHING:
        near = round(near + step, DIGITS)
    return near + 0.0


def in_frame(pieces: Sequence[Array], span: float) -> tuple[Array, ...]:
    """The pieces of a drawing in the frame of the display."""
    return tuple(piece + np.array([place * span, 0.0]) for place, piece in enumerate(pieces))
