"""Where the search for a row begins: as the drawing has it at the rails, and around that."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from curveline.atlases.entries import POINTS
from curveline.atlases.nearest import nearest_curves
from curveline.fitting.cutting import resampled
from curveline.fitting.row import EDGES, Array, HeldState, Wanted, is_straight, lengths_of, pose_of, within
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.straight import straight_state
from curveline.rod.problem import mesh
from curveline.rod.states.equilibrium import Equilibrium
from curveline.rod.states.identity import GONE
from curveline.rod.states.planar_states import find_states
from curveline.rod.states.slack import is_slack
from curveline.scene import Display, Node
from curveline.simulation.simulate import clamped_rod
from curveline.units import deg, mm

AT_RAIL = 0.1
"""Part of a segment of a drawing whose mean direction is that at its rail."""
SIZES = mm(30.0), deg(25.0), 0.08
"""How far other starts lie around: heights [m], angles [rad], roots of the excess."""
ROUGH = 1e-3
"""To what states are found that are only begun with [m]."""
NO_LOADS: Array = np.zeros(0)
NEARLY_STRAIGHT = mm(15.0)
"""Drawings of segments that are nearer to the line between their ends are tried with a straight rod, too."""
MORE_ROD = 0.05
"""By which the root of an excess grows until its rod is not straight, or has a stable state."""
ATTEMPTS = 4


class RowStart(NamedTuple):
    """Numbers of a row, and states of its segments, from which to descend."""

    numbers: Array
    held: tuple[HeldState, ...]


def level_rod(display: Display) -> ClampedRod:
    """The rod between two nodes of a display, to be moved to any pose."""
    return clamped_rod(display, (Node(0.0, 0.0), Node(0.0, 0.0)), display.span)


def first_numbers(wanted: Wanted) -> Array:
    """Heights and angles where the drawing crosses the rails, and its lengths between: see `row.FittedRow`."""
    pieces, span = wanted.pieces, wanted.display.span
    heights = [piece[0, 1] for piece in pieces] + [pieces[-1][-1, 1]]
    sides = [_directions(piece) for piece in pieces]
    angles = [sides[0][0]]
    angles += [0.5 * (before[1] + after[0]) for before, after in pairwise(sides)]
    angles.append(sides[-1][1])
    lengths = np.array([np.sum(np.hypot(*np.diff(piece, axis=0).T)) for piece in pieces])
    excess = np.maximum((lengths - np.hypot(span, np.diff(heights))) / span, 0.0)
    return within(wanted, np.concatenate([heights, angles, np.sqrt(excess)]))


def _directions(piece: Array) -> tuple[float, float]:
    """The mean directions of a piece of a drawing at both its ends [rad]."""
    count = max(2, round(AT_RAIL * piece.shape[0]))
    (x, y), (u, v) = piece[count] - piece[0], piece[-1] - piece[-1 - count]
    return float(np.arctan2(y, x)), float(np.arctan2(v, u))


def around(wanted: Wanted, numbers: Array, source: np.random.Generator) -> Array:
    """Other numbers that lie around some."""
    nodes = wanted.nodes
    sizes = np.repeat(SIZES, [nodes, nodes, nodes - 1])
    return within(wanted, numbers + sizes * source.standard_normal(sizes.size))


def nearest_starts(wanted: Wanted, count: int) -> list[RowStart]:
    """At most so many starts of a lone segment: the stable curves of the display that are nearest to the drawing."""
    drawn, span = resampled(wanted.pieces[0], POINTS), wanted.display.span
    starts = []
    for pose, height, angles, multipliers in nearest_curves(wanted.display, drawn, count, *wanted.reserve):
        root = math.sqrt(max(pose.length - math.hypot(span, pose.y), 0.0) / span)
        numbers = within(wanted, np.array([height, height + pose.y, pose.start, pose.end, root]))
        starts.append(RowStart(numbers, ((angles, multipliers),)))
    return starts


def straightened(wanted: Wanted, numbers: Array) -> Array | None:
    """The numbers with every segment straight whose drawing nearly is, its nodes along it; None if there is none."""
    flat = [segment for segment, piece in enumerate(wanted.pieces) if _bow(piece) < NEARLY_STRAIGHT]
    if not flat or wanted.display.limits.length.low > wanted.display.span:
        return None
    out, count = numbers.copy(), wanted.nodes
    out[[2 * count + segment for segment in flat]] = 0.0
    return within(wanted, out)


def _bow(piece: Array) -> float:
    """How far a piece of a drawing is from the straight line between its ends at most [m]."""
    way = piece[-1] - piece[0]
    off = (piece - piece[0]) @ np.array([-way[1], way[0]]) / np.hypot(*way)
    return float(np.max(np.abs(off)))


def starts_at(wanted: Wanted, rod: ClampedRod, numbers: Array) -> list[RowStart]:
    """Starts at some numbers, or with a little more rod: in the states nearest to the drawing, then in each other."""
    for _ in range(ATTEMPTS):
        lengths = lengths_of(wanted, numbers)
        poses = [pose_of(wanted, numbers, lengths, segment) for segment in range(len(wanted.pieces))]
        found = [_states(wanted, rod.moved_to(pose), numbers, place) for place, pose in enumerate(poses)]
        if all(found):
            nearest = [each[0] for each in found]
            starts = [RowStart(numbers, tuple(nearest))]
            for place, states in enumerate(found):
                for other in states[1:]:
                    starts.append(RowStart(numbers, (*nearest[:place], other, *nearest[place + 1 :])))
            return starts
        straight = is_straight(wanted, numbers)
        short = [2 * wanted.nodes + place for place, each in enumerate(found) if not each and not straight[place]]
        numbers = numbers.copy()
        numbers[short] += MORE_ROD
        numbers = within(wanted, numbers)
    return []


def _states(wanted: Wanted, there: ClampedRod, numbers: Array, segment: int) -> list[HeldState]:
    """The states of a segment, that nearest to the drawing first; none if it has none, or is straight by chance."""
    if is_straight(wanted, numbers)[segment]:
        state = straight_state(there, ROUGH)
        return [] if state.outcome in GONE else [state.start_on(mesh(NO_LOADS, EDGES))]
    if not is_slack(there):
        return []
    states = [state for state in find_states(there, ROUGH) if state.simple and state.stable]
    height = float(numbers[segment])
    states.sort(key=lambda state: _off(state, wanted.pieces[segment], height))
    return [state.start_on(mesh(NO_LOADS, EDGES)) for state in states]


def _off(state: Equilibrium, piece: Array, height: float) -> float:
    """How far a state is from a piece of a drawing, point by point along both."""
    gaps: npt.NDArray[np.float64] = state.curve(piece.shape[0]) + np.array([0.0, height]) - piece
    return float(np.sum(gaps**2))
