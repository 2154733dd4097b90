"""The row of nodes that is sought: its numbers, the limits of the display on them, and how far its rod is off.

The numbers are the heights and angles of all nodes, and of each segment the root of its excess, in which a rod that is
nearly straight answers evenly: length = chord + span q^2. A root of 0 stands for a straight segment, whose length is
what its clamps leave between them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from curveline.planning.actuator_loads import LEFT, RIGHT
from curveline.rod.branches.continuation import STIFFEST
from curveline.rod.branches.drawn import LOADS, LOWEST, NUMBERS, SHARPEST, laid, misfits
from curveline.rod.problem import Bearing, Pose
from curveline.scene import Display
from curveline.units import deg

Array = npt.NDArray[np.float64]
HeldState = tuple[Array, Array]
"""Angles (n,) [rad] and multipliers (2,) of a segment's state."""

EDGES = 48
LEAST_EXCESS = 6e-4
"""Of the free rod over the line between its clamps, as a part of the span: what is straighter is no curve that a plan
can hold."""
IN_LINE = deg(4.0)
"""By how much the clamps of a straight segment may point beside it: less than `slack.OUT_OF_LINE`."""


class Reserve(NamedTuple):
    """What a shape leaves for the way there: the `margin` of its states, of `STIFFEST`; the `part` of what rod and
    motors can give that it asks for at most."""

    margin: float
    part: float


class Wanted(NamedTuple):
    """A drawing cut at the rails, and the reserve that its shape is to leave."""

    display: Display
    bearing: Bearing
    pieces: tuple[Array, ...]  # (k, 2) of each segment [m], seen from the foot of its left rail: see `cutting.Cut`
    fine: tuple[Array, ...]
    reserve: Reserve

    @property
    def nodes(self) -> int:
        """How many nodes there are."""
        return len(self.pieces) + 1


@dataclass(frozen=True, eq=False)
class FittedRow:
    """Where nodes stand, by `numbers (3 n - 1,)`: heights [m], angles [rad], roots of the excess; and what comes of it.

    `off (m,)` are the distances, two-sided [m], each over the root of how many there are, so that the sum of their
    squares is the mean square; `blocks` are their slopes, those of each segment by the numbers that it has to do with,
    see `places_of`. `asks (c,)` are above 0 where a state, the rod or a motor does not do, in the order of `asked`,
    with their slopes `by_numbers (c, 3 n - 1)`.
    """

    numbers: Array
    held: tuple[HeldState, ...]
    off: Array
    blocks: tuple[Array, ...]
    asks: Array
    by_numbers: Array

    @property
    def rms(self) -> float:
        """The root of the mean square distance [m]."""
        return math.sqrt(float(self.off @ self.off))

    @cached_property
    def curvature(self) -> Array:
        """Slopes of the distances times themselves, (3 n - 1, 3 n - 1): half of how the mean square is bent."""
        matrix = np.zeros((self.numbers.size, self.numbers.size))
        for segment, block in enumerate(self.blocks):
            places = places_of(len(self.blocks), segment)
            matrix[np.ix_(places, places)] += block.T @ block
        return matrix

    @cached_property
    def gradient(self) -> Array:
        """Half of the slopes of the mean square, (3 n - 1,)."""
        gradient, begin = np.zeros(self.numbers.size), 0
        for segment, block in enumerate(self.blocks):
            end = begin + block.shape[0]
            gradient[places_of(len(self.blocks), segment)] += self.off[begin:end] @ block
            begin = end
        return gradient

    def slopes(self) -> Array:
        """Slopes of all distances by all numbers, (m, 3 n - 1)."""
        slopes, begin = np.zeros((self.off.size, self.numbers.size)), 0
        for segment, block in enumerate(self.blocks):
            end = begin + block.shape[0]
            slopes[begin:end, places_of(len(self.blocks), segment)] = block
            begin = end
        return slopes

    def asks_of(self, wanted: Wanted, kind: str) -> list[float]:
        """Those of a kind."""
        return [missed for ask, missed in zip(asked(wanted), self.asks.tolist(), strict=True) if ask.kind == kind]


class RowAsk(NamedTuple):
    """What a limit is about: stability, strain or length of a segment, a motor of a node, from 1; or all the rod."""

    kind: str
    segment: int = 0
    node: int = 0


STABILITY, STRAIN, LENGTH, ROD = "stability", "strain", "length", "rod"
MET = 0.004
"""A limit that is missed by no more is met."""
MOTORS = "force of extruding", "force of lifting", "moment of biasing"


def asked(wanted: Wanted) -> list[RowAsk]:
    """What the `asks` of a row are about, in their order."""
    asks = [RowAsk(kind, segment=each) for each in range(1, wanted.nodes) for kind in (STABILITY, STRAIN)]
    asks += [RowAsk(kind, node=each) for each in range(1, wanted.nodes + 1) for kind in MOTORS]
    asks += [RowAsk(LENGTH, segment=each) for each in range(1, wanted.nodes)]
    return [*asks, RowAsk(ROD)]


def is_straight(wanted: Wanted, numbers: Array) -> npt.NDArray[np.bool_]:
    """Which segments (n - 1,) are straight."""
    straight: npt.NDArray[np.bool_] = numbers[2 * wanted.nodes :] == 0.0
    return straight


def lengths_of(wanted: Wanted, numbers: Array) -> Array:
    """Rod between the pivots of every segment [m]."""
    heights, roots = numbers[: wanted.nodes], numbers[2 * wanted.nodes :]
    curved = np.hypot(wanted.display.span, np.diff(heights)) + wanted.display.span * roots**2
    x, y = _mouth_to_mouth(wanted, numbers)
    least = wanted.display.limits.length.low
    lengths: Array = np.where(roots == 0.0, np.maximum(np.hypot(x, y) + wanted.display.clamp, least), curved)
    return lengths


def _mouth_to_mouth(wanted: Wanted, numbers: Array) -> tuple[Array, Array]:
    """From where the free rod of every segment begins to where it ends, across and up [m]."""
    heights, angles = numbers[: wanted.nodes], numbers[wanted.nodes : 2 * wanted.nodes]
    half, cosines, sines = 0.5 * wanted.display.clamp, np.cos(angles), np.sin(angles)
    rises = heights[1:] - heights[:-1]
    return wanted.display.span - half * (cosines[1:] + cosines[:-1]), rises - half * (sines[1:] + sines[:-1])


def pose_of(wanted: Wanted, numbers: Array, lengths: Array, segment: int) -> Pose:
    """What the nodes of a segment impose, with the `lengths_of` all."""
    display, count, begin = wanted.display, wanted.nodes, 0.0
    if display.rod.profile is not None:
        # As in `simulation.begin_of`: with equal tails.
        feed = 0.5 * (lengths.sum() - display.span * lengths.size) - np.sum(lengths[:segment] - display.span)
        begin = display.material_at(segment, float(feed))
    y = float(numbers[segment + 1] - numbers[segment])
    angles = float(numbers[count + segment]), float(numbers[count + segment + 1])
    return Pose(display.span, y, *angles, float(lengths[segment]), begin)


def limits_of(wanted: Wanted, numbers: Array) -> tuple[Array, Array]:
    """The least and the most of every number, (3 n - 1,): of the others as the heights of the nodes have them."""
    limits, span, count = wanted.display.limits, wanted.display.span, wanted.nodes
    rises, straight = np.diff(numbers[:count]), is_straight(wanted, numbers)
    chords, mouths = np.hypot(span, rises), np.hypot(*_mouth_to_mouth(wanted, numbers))
    slack = (mouths - chords + wanted.display.clamp) / span + LEAST_EXCESS
    least = np.maximum((limits.length.low - chords) / span, slack)
    most = np.maximum((limits.length.high - chords) / span, least)
    low, high = np.empty(numbers.size), np.empty(numbers.size)
    low[:count], high[:count] = limits.height.low, limits.height.high
    low[count : 2 * count], high[count : 2 * count] = limits.angle.low, limits.angle.high
    for segment in np.flatnonzero(straight):
        line = math.atan2(float(rises[segment]), span)
        both = slice(count + segment, count + segment + 2)
        # Where two straight segments meet at an angle that no node has, it stands along the right one.
        low[both] = np.maximum(np.minimum(low[both], line), line - IN_LINE)
        high[both] = np.minimum(np.maximum(high[both], line), line + IN_LINE)
    low[2 * count :], high[2 * count :] = (
        np.where(straight, 0.0, np.sqrt(least)),
        np.where(straight, 0.0, np.sqrt(most)),
    )
    return low, high


def within(wanted: Wanted, numbers: Array) -> Array:
    """The numbers within the display's limits."""
    limits, count = wanted.display.limits.height, wanted.nodes
    heights = np.clip(numbers[:count], limits.low, limits.high)
    clipped: Array = np.clip(numbers, *limits_of(wanted, np.concatenate([heights, numbers[count:]])))
    return clipped


@lru_cache(512)
def places_of(segments: int, segment: int) -> npt.NDArray[np.int64]:
    """Which numbers one of some segments has to do with, (5,): heights, angles, its root."""
    count = segments + 1
    return np.array([segment, segment + 1, count + segment, count + segment + 1, 2 * count + segment])


class _Part(NamedTuple):
    """What comes of a segment: its state; distances (m,), what it asks (ASKED,), and slopes of both by 5 numbers."""

    held: HeldState
    off: Array
    block: Array
    asks: Array
    rates: Array


def row_at(wanted: Wanted, numbers: Array, held: Sequence[HeldState]) -> FittedRow | None:
    """The row of such numbers, in states near those held; None where one of its segments has none."""
    lengths, parts = lengths_of(wanted, numbers), []
    for segment in range(len(wanted.pieces)):
        pose, state = pose_of(wanted, numbers, lengths, segment), (held[segment][0].copy(), held[segment][1].copy())
        is_there, *laid_out = laid(pose, wanted.bearing, *state)
        if not is_there:
            return None
        parts.append(_part_of(wanted, numbers, segment, state, laid_out))
    asks, by_numbers = _asks(wanted, numbers, parts)
    off, blocks = np.concatenate([part.off for part in parts]), tuple(part.block for part in parts)
    return FittedRow(numbers, tuple(part.held for part in parts), off, blocks, asks, by_numbers)


def _part_of(wanted: Wanted, numbers: Array, segment: int, held: HeldState, laid_out: Sequence[Array]) -> _Part:
    """What comes of a segment in a state, from what `laid` said of it."""
    points, asks, moves, rates = laid_out
    piece, chain = wanted.pieces[segment], _chain(wanted, numbers, segment)
    moves = np.tensordot(chain, moves, axes=1)
    moves[0, :, 1] += 1.0
    points[:, 1] += numbers[segment]
    moved = np.empty((points.shape[0] + piece.shape[0], chain.shape[0]))
    off = misfits(points, piece, moves, moved)
    share = _parts(points.shape[0], piece.shape[0]) / math.sqrt(len(wanted.pieces))
    return _Part(held, share * off, share[:, None] * moved, asks, (chain @ rates).T)


@lru_cache(64)
def _parts(*counts: int) -> Array:
    """Roots of the part of the mean square that each of equally spaced points has, of two curves of so many."""
    parts = []
    for count in counts:
        part = np.full(count, 0.5 / (count - 1))
        part[0] = part[-1] = 0.5 * part[0]
        parts.append(np.sqrt(part))
    return np.concatenate(parts)


def parts_of(wanted: Wanted) -> Array:
    """What the distances of a row are multiplied by to make `FittedRow.off` (m,)."""
    pieces = wanted.pieces
    return np.concatenate([_parts(EDGES + 3, piece.shape[0]) for piece in pieces]) / math.sqrt(len(pieces))


def _asks(wanted: Wanted, numbers: Array, parts: Sequence[_Part]) -> tuple[Array, Array]:
    """What the states of segments ask together: `FittedRow.asks` and their slopes."""
    display, segments, size = wanted.display, len(parts), numbers.size
    own, by_own = np.empty((segments, 2)), np.zeros((segments, 2, size))
    needs, by_needs = np.zeros((segments + 1, 3)), np.zeros((segments + 1, 3, size))
    by_least, by_spare = np.zeros((segments, size)), np.zeros((1, size))
    for segment, part in enumerate(parts):
        places, strained = places_of(segments, segment), 1.0 / display.rod.max_curvature
        own[segment, 0] = wanted.reserve.margin - part.asks[LOWEST] / STIFFEST
        own[segment, 1] = strained * part.asks[SHARPEST] - wanted.reserve.part
        by_own[segment, 0, places] = -part.rates[LOWEST] / STIFFEST
        by_own[segment, 1, places] = strained * part.rates[SHARPEST]
        loads, by_loads = part.asks[LOADS:], part.rates[LOADS:]
        for node, side in ((segment, LEFT), (segment + 1, RIGHT)):
            needs[node] += loads[side]
            by_needs[node][:, places] += by_loads[side]
        by_length = _chain(wanted, numbers, segment)[:, NUMBERS - 1] / display.span
        by_spare[0, places] += by_length
        by_least[segment, places[:-1]] = by_length[:-1]
    gives = np.array([display.drive.max_force, display.drive.max_force, display.drive.max_moment])
    motors, signs = np.abs(needs) / gives - wanted.reserve.part, np.sign(needs) / gives
    # What is missed by so little as counts as met is no rod that there is not.
    taken = float(lengths_of(wanted, numbers).sum()) + display.clamp
    spare = (taken - display.rod.total_length) / display.span + MET
    asks = np.concatenate([own.ravel(), motors.ravel(), _too_far_apart(wanted, numbers), [spare]])
    by_motors = (signs[:, :, None] * by_needs).reshape(3 * segments + 3, -1)
    return asks, np.vstack((by_own.reshape(2 * segments, -1), by_motors, by_least, by_spare))


def _too_far_apart(wanted: Wanted, numbers: Array) -> Array:
    """By how much (n - 1,), as a part of the span, nodes are farther apart than the longest rod between them reaches.

    No length that is met is longer than the display allows, so that nothing is left to be missed.
    """
    curved = numbers.copy()
    curved[2 * wanted.nodes :][~is_straight(wanted, numbers)] = math.sqrt(LEAST_EXCESS)
    least = lengths_of(wanted, curved)
    too_far: Array = (least - wanted.display.limits.length.high) / wanted.display.span + MET
    return too_far


def _chain(wanted: Wanted, numbers: Array, segment: int) -> Array:
    """The slopes (5, NUMBERS) of a segment's pose by the numbers that it has to do with: see `places_of`.

    The last of a straight segment, which is held, is not its root but its length.
    """
    span, places = wanted.display.span, places_of(len(wanted.pieces), segment)
    chain = np.zeros((5, NUMBERS))
    chain[0, 0], chain[1, 0] = -1.0, 1.0
    chain[2, 1] = chain[3, 2] = 1.0
    root = float(numbers[places[4]])
    if root == 0.0:
        x, y = (float(each[segment]) for each in _mouth_to_mouth(wanted, numbers))
        half, free = 0.5 * wanted.display.clamp, math.hypot(x, y)
        chain[4, 3] = 1.0
        if free + wanted.display.clamp < wanted.display.limits.length.low:
            return chain
        chain[0, 3], chain[1, 3] = -y / free, y / free
        for place in (2, 3):
            angle = float(numbers[places[place]])
            chain[place, 3] = half * (x * math.sin(angle) - y * math.cos(angle)) / free
        return chain
    y = float(numbers[segment + 1] - numbers[segment])
    slope = y / math.hypot(span, y)
    chain[0, 3], chain[1, 3], chain[4, 3] = -slope, slope, 2.0 * span * root
    return chain
