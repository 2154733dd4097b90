"""The row of nodes that is sought: its numbers, the limits of the display on them, and how far its rod is off.

The numbers are the heights and angles of all nodes, and of each segment the root of its excess, in which a rod that is
nearly straight answers evenly: length = chord + span q^2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from curveline.planning.actuator_loads import LEFT, RIGHT
from curveline.rod.branches.continuation import STIFFEST
from curveline.rod.branches.drawn import LOADS, LOWEST, NUMBERS, SHARPEST, laid, misfits
from curveline.rod.problem import Bearing, Pose
from curveline.scene import Display

Array = npt.NDArray[np.float64]
Held = tuple[Array, Array]
"""Angles (n,) [rad] and multipliers (2,) of a segment's state."""

EDGES = 48
LEAST_EXCESS = 6e-4
"""Over the span: what is straighter is no curve that a plan can hold."""
PART = 0.92
"""Of what rod and motors can give, that a shape asks for at most: the way there asks for more."""


class Wanted(NamedTuple):
    """A drawing cut at the rails, and the margin that its states are to keep: of `STIFFEST`."""

    display: Display
    bearing: Bearing
    pieces: tuple[Array, ...]  # (k, 2) of each segment [m], seen from the foot of its left rail: see `cutting.Cut`
    fine: tuple[Array, ...]
    margin: float

    @property
    def nodes(self) -> int:
        """How many nodes there are."""
        return len(self.pieces) + 1


@dataclass(frozen=True, eq=False)
class Row:
    """Where nodes stand, by `numbers (3 n - 1,)`: heights [m], angles [rad], roots of the excess; and what comes of it.

    `off (m,)` are the distances, two-sided [m], each over the root of how many there are, so that the sum of their
    squares is the mean square; `slopes (m, 3 n - 1)` by the numbers. `asks (c,)` are above 0 where a state, the rod or
    a motor does not do, in the order of `asked`, with their slopes `by_numbers (c, 3 n - 1)`.
    """

    numbers: Array
    held: tuple[Held, ...]
    off: Array
    slopes: Array
    asks: Array
    by_numbers: Array

    @property
    def rms(self) -> float:
        """The root of the mean square distance [m]."""
        return math.sqrt(float(self.off @ self.off))


class Ask(NamedTuple):
    """What a limit is about: stability or strain of a segment, a motor of a node, from 1; or all of the rod."""

    kind: str
    segment: int = 0
    node: int = 0


STABILITY, STRAIN, ROD = "stability", "strain", "rod"
MOTORS = "force of extruding", "force of lifting", "moment of biasing"


def asked(wanted: Wanted) -> list[Ask]:
    """What the `asks` of a row are about, in their order."""
    asks = [Ask(kind, segment=each) for each in range(1, wanted.nodes) for kind in (STABILITY, STRAIN)]
    asks += [Ask(kind, node=each) for each in range(1, wanted.nodes + 1) for kind in MOTORS]
    return [*asks, Ask(ROD)]


def lengths_of(wanted: Wanted, numbers: Array) -> Array:
    """Rod between the pivots of every segment [m]."""
    heights, _, roots = np.split(numbers, [wanted.nodes, 2 * wanted.nodes])
    lengths: Array = np.hypot(wanted.display.span, np.diff(heights)) + wanted.display.span * roots**2
    return lengths


def pose_of(wanted: Wanted, numbers: Array, segment: int) -> Pose:
    """What the nodes of a segment impose."""
    display, count = wanted.display, wanted.nodes
    lengths, begin = lengths_of(wanted, numbers), 0.0
    if display.rod.profile is not None:
        # As in `simulation.begin_of`: with equal tails.
        feed = 0.5 * (lengths.sum() - display.span * lengths.size) - np.sum(lengths[:segment] - display.span)
        begin = display.material_at(segment, float(feed))
    y = float(numbers[segment + 1] - numbers[segment])
    angles = float(numbers[count + segment]), float(numbers[count + segment + 1])
    return Pose(display.span, y, *angles, float(lengths[segment]), begin)


def limits_of(wanted: Wanted, heights: Array) -> tuple[Array, Array]:
    """The least and the most of every number, (3 n - 1,): of the roots as these heights of the nodes have them."""
    limits, span, count = wanted.display.limits, wanted.display.span, wanted.nodes
    chords = np.hypot(span, np.diff(heights))
    least = np.maximum((limits.length.low - chords) / span, LEAST_EXCESS)
    most = np.maximum((limits.length.high - chords) / span, least)
    sides = [(limits.height.low, limits.height.high), (limits.angle.low, limits.angle.high)]
    low, high = (np.repeat([sides[0][end], sides[1][end]], count) for end in range(2))
    return np.concatenate([low, np.sqrt(least)]), np.concatenate([high, np.sqrt(most)])


def within(wanted: Wanted, numbers: Array) -> Array:
    """The numbers within the display's limits."""
    limits = wanted.display.limits.height
    heights = np.clip(numbers[: wanted.nodes], limits.low, limits.high)
    clipped: Array = np.clip(numbers, *limits_of(wanted, heights))
    return clipped


def row_at(wanted: Wanted, numbers: Array, held: Sequence[Held]) -> Row | None:
    """The row of such numbers, in states near those held; None where one of its segments has none."""
    size, found = numbers.size, []
    offs, slopes, states, by_pose = [], [], [], []
    for segment, piece in enumerate(wanted.pieces):
        phi, multipliers = held[segment][0].copy(), held[segment][1].copy()
        is_there, points, asks, moves, rates = laid(pose_of(wanted, numbers, segment), wanted.bearing, phi, multipliers)
        if not is_there:
            return None
        places, chain = _chain(wanted, numbers, segment)
        moves = np.tensordot(chain, moves, axes=1)
        moves[0, :, 1] += 1.0
        points[:, 1] += numbers[segment]
        moved = np.empty((points.shape[0] + piece.shape[0], places.size))
        off = misfits(points, piece, moves, moved)
        share = _parts(points.shape[0], piece.shape[0]) / math.sqrt(len(wanted.pieces))
        block = np.zeros((off.size, size))
        block[:, places] = share[:, None] * moved
        offs.append(share * off)
        slopes.append(block)
        states.append(asks)
        turned = np.zeros((asks.size, size))
        turned[:, places] = (chain @ rates).T
        by_pose.append(turned)
        found.append((phi, multipliers))
    asks, by_numbers = _asks(wanted, numbers, np.array(states), np.array(by_pose))
    return Row(numbers, tuple(found), np.concatenate(offs), np.vstack(slopes), asks, by_numbers)


@lru_cache(64)
def _parts(*counts: int) -> Array:
    """Roots of what part of the mean square each of equally spaced points has, of two curves of so many: a half each."""
    parts = []
    for count in counts:
        part = np.full(count, 0.5 / (count - 1))
        part[0] = part[-1] = 0.5 * part[0]
        parts.append(np.sqrt(part))
    return np.concatenate(parts)


def parts_of(wanted: Wanted) -> Array:
    """What the distances of a row are multiplied by to make `Row.off` (m,)."""
    pieces = wanted.pieces
    return np.concatenate([_parts(EDGES + 3, piece.shape[0]) for piece in pieces]) / math.sqrt(len(pieces))


def _asks(wanted: Wanted, numbers: Array, states: Array, rates: Array) -> tuple[Array, Array]:
    """What states (s, ASKED), their slopes (s, ASKED, p), come to: `Row.asks` and their slopes."""
    display, segments = wanted.display, len(wanted.pieces)
    own = np.empty((segments, 2))
    own[:, 0] = wanted.margin - states[:, LOWEST] / STIFFEST
    own[:, 1] = states[:, SHARPEST] / display.rod.max_curvature - PART
    by_own = np.stack([-rates[:, LOWEST] / STIFFEST, rates[:, SHARPEST] / display.rod.max_curvature], axis=1)
    needs, by_needs = np.zeros((segments + 1, 3)), np.zeros((segments + 1, 3, numbers.size))
    loads, by_loads = states[:, LOADS:], rates[:, LOADS:]
    for side, nodes in ((LEFT, slice(0, -1)), (RIGHT, slice(1, None))):
        needs[nodes] += loads[:, side]
        by_needs[nodes] += by_loads[:, side]
    gives = np.array([display.drive.max_force, display.drive.max_force, display.drive.max_moment])
    motors, signs = np.abs(needs) / gives - PART, np.sign(needs) / gives
    spare = (float(lengths_of(wanted, numbers).sum()) + display.clamp - display.rod.total_length) / display.span
    by_spare = np.zeros((1, numbers.size))
    for segment in range(segments):
        places, chain = _chain(wanted, numbers, segment)
        by_spare[0, places] += chain[:, NUMBERS - 1] / display.span
    asks = np.concatenate([own.ravel(), motors.ravel(), [spare]])
    slopes = (by_own.reshape(2 * segments, -1), (signs[:, :, None] * by_needs).reshape(3 * segments + 3, -1), by_spare)
    return asks, np.vstack(slopes)


def _chain(wanted: Wanted, numbers: Array, segment: int) -> tuple[npt.NDArray[np.int64], Array]:
    """Which numbers a segment has to do with, (5,), and the slopes (5, NUMBERS) of its pose by them."""
    count, span = wanted.nodes, wanted.display.span
    places = np.array([segment, segment + 1, count + segment, count + segment + 1, 2 * count + segment])
    y, root = numbers[segment + 1] - numbers[segment], numbers[places[4]]
    slope = y / math.hypot(span, y)
    chain = np.zeros((5, NUMBERS))
    chain[0, 0], chain[0, 3] = -1.0, -slope
    chain[1, 0], chain[1, 3] = 1.0, slope
    chain[2, 1] = chain[3, 2] = 1.0
    chain[4, 3] = 2.0 * span * root
    return places, chain
