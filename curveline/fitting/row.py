"""The row of nodes that lays its rod along a drawn curve: Gauss and Newton's steps in what nodes can do.

The unknowns are the heights and angles of all nodes, and of each segment the root of its excess, in which a rod that is
nearly straight answers evenly: length = chord + span q^2. Distances are two-sided, of the rod's points from the drawing and
of the drawing's from the rod, along the normals of the one they are taken from; a segment that comes near the loss of its
stability is held off by a further row. Levenberg and Marquardt's damping keeps steps where they lead downhill
(Nocedal and Wright 2006, section 10.3); numbers at their limits are held there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from curveline.rod.branches.continuation import STIFFEST
from curveline.rod.branches.drawn import NUMBERS, laid, misfits
from curveline.rod.problem import Bearing, Pose
from curveline.scene import Display

Array = npt.NDArray[np.float64]
Held = tuple[Array, Array]
"""Angles (n,) [rad] and multipliers (2,) of a segment's state."""

EDGES = 48
LEAST_EXCESS = 6e-4
"""Over the span: what is straighter is no curve that a plan can hold."""
WATCHED = 2.0
"""How often the margin an eigenvalue is below which its slopes are asked."""
HOLDING_OFF = 0.05, 0.5, 5.0
"""What a margin that is missed by 1 counts for [m]: first, and where that does not do."""
MET = 0.98
"""Part of a margin that is as good as all of it."""
ITERATIONS = 60
SMALL = 1e-7
"""Largest change of a number, in m or rad, that ends a search."""
LITTLE_GAIN = 1e-7
"""As a part of the mean square, by which it ends, too."""


class Wanted(NamedTuple):
    """A drawing cut at the rails, and the margin that its states are to keep: of `STIFFEST`."""

    display: Display
    bearing: Bearing
    pieces: tuple[Array, ...]  # (k, 2) of each segment [m], seen from the foot of its left rail
    margin: float


@dataclass(frozen=True)
class Row:
    """Where the nodes stand: `numbers (3 n - 1,)`, heights [m], angles [rad], roots of the excess; the states, and how
    far the rod is from the drawing: the root `rms` of the mean square [m], the least `margin`."""

    numbers: Array
    held: tuple[Held, ...]
    rms: float
    margin: float


class _Look(NamedTuple):
    """The rows of a row of segments: what is off (m,), its slopes (m, p), the mean square of the distances alone."""

    off: Array
    slopes: Array
    square: float
    margin: float
    held: tuple[Held, ...]


def pose_of(wanted: Wanted, numbers: Array, segment: int) -> Pose:
    """What the nodes of a segment impose."""
    count = len(wanted.pieces) + 1
    heights, angles, roots = np.split(numbers, [count, 2 * count])
    span, y = wanted.display.span, float(heights[segment + 1] - heights[segment])
    length = math.hypot(span, y) + span * float(roots[segment]) ** 2
    return Pose(span, y, float(angles[segment]), float(angles[segment + 1]), length)


def within(wanted: Wanted, numbers: Array) -> Array:
    """The numbers within the display's limits: those of the lengths bear on the roots."""
    limits, span, count = wanted.display.limits, wanted.display.span, len(wanted.pieces) + 1
    out = numbers.copy()
    out[:count] = np.clip(out[:count], limits.height.low, limits.height.high)
    out[count : 2 * count] = np.clip(out[count : 2 * count], limits.angle.low, limits.angle.high)
    chords = np.hypot(span, np.diff(out[:count]))
    least = np.maximum((limits.length.low - chords) / span, LEAST_EXCESS)
    most = np.maximum((limits.length.high - chords) / span, least)
    out[2 * count :] = np.clip(out[2 * count :], np.sqrt(least), np.sqrt(most))
    return out


def polish(wanted: Wanted, numbers: Array, held: Sequence[Held]) -> Row | None:
    """The nearest row to a drawing that steps downhill lead to from one, and that keeps the margin; None if none does."""
    for holding_off in HOLDING_OFF:
        row = _downhill(wanted, numbers, held, holding_off)
        if row is None or row.margin >= MET * wanted.margin:
            return row
        numbers, held = row.numbers, row.held
    return None


def _downhill(wanted: Wanted, numbers: Array, held: Sequence[Held], holding_off: float) -> Row | None:
    """Where steps downhill lead to; None if there are no such states where they begin."""
    here = within(wanted, numbers)
    look = _look(wanted, here, held, holding_off)
    if look is None:
        return None
    damping = 1e-3
    for _ in range(ITERATIONS):
        there = within(wanted, here + _step(wanted, here, look, damping))
        change = float(np.max(np.abs(there - here)))
        if change < SMALL:
            break
        trial = _look(wanted, there, look.held, holding_off)
        before = float(look.off @ look.off)
        if trial is None or not float(trial.off @ trial.off) < before:
            damping = 6.0 * max(damping, 1e-6)
            if damping > 1e6:
                break
            continue
        gained = before - float(trial.off @ trial.off)
        here, look, damping = there, trial, 0.2 * damping
        if gained < LITTLE_GAIN * before:
            break
    return Row(here, look.held, math.sqrt(look.square), look.margin)


def _look(wanted: Wanted, numbers: Array, held: Sequence[Held], holding_off: float) -> _Look | None:
    """What a row of segments is off by; None where one of them has no state near the one that was held."""
    count, size = len(wanted.pieces) + 1, numbers.size
    blocks, rows, squares, margins, found = [], [], 0.0, [], []
    for segment, piece in enumerate(wanted.pieces):
        phi, multipliers = held[segment][0].copy(), held[segment][1].copy()
        pose = pose_of(wanted, numbers, segment)
        watched = WATCHED * wanted.margin * STIFFEST
        is_there, points, by_pose, lowest, rates = laid(pose, wanted.bearing, phi, multipliers, watched)
        if not is_there:
            return None
        places, chain = _chain(wanted, numbers, segment)
        slopes = np.tensordot(chain, by_pose, axes=1)
        slopes[0, :, 1] += 1.0
        points[:, 1] += numbers[segment]
        moved = np.empty((points.shape[0] + piece.shape[0], places.size))
        off = misfits(points, piece, slopes, moved)
        ways = np.concatenate([np.full(each.shape[0], 1.0 / math.sqrt(each.shape[0])) for each in (points, piece)])
        ways /= math.sqrt(2.0 * len(wanted.pieces))
        squares += float(np.sum((ways * off) ** 2))
        missing = wanted.margin - lowest / STIFFEST
        if missing > 0.0:
            off = np.append(ways * off, holding_off * missing)
            moved = np.vstack([ways[:, None] * moved, -holding_off * (chain @ rates) / STIFFEST])
        else:
            off, moved = ways * off, ways[:, None] * moved
        block = np.zeros((off.size, size))
        block[:, places] = moved
        blocks.append(block)
        rows.append(off)
        margins.append(lowest / STIFFEST)
        found.append((phi, multipliers))
    return _Look(np.concatenate(rows), np.vstack(blocks), squares, min(margins), tuple(found))


def _chain(wanted: Wanted, numbers: Array, segment: int) -> tuple[npt.NDArray[np.int64], Array]:
    """Which numbers a segment has to do with, (5,), and the slopes (5, NUMBERS) of its pose by them."""
    count, span = len(wanted.pieces) + 1, wanted.display.span
    places = np.array([segment, segment + 1, count + segment, count + segment + 1, 2 * count + segment])
    y, root = numbers[segment + 1] - numbers[segment], numbers[places[4]]
    slope = y / math.hypot(span, y)
    chain = np.zeros((5, NUMBERS))
    chain[0, 0], chain[0, 3] = -1.0, -slope
    chain[1, 0], chain[1, 3] = 1.0, slope
    chain[2, 1] = chain[3, 2] = 1.0
    chain[4, 3] = 2.0 * span * root
    return places, chain


def _step(wanted: Wanted, numbers: Array, look: _Look, damping: float) -> Array:
    """A damped step; numbers that it would take beyond their limits go there and no farther."""
    matrix = look.slopes.T @ look.slopes
    matrix[np.diag_indices_from(matrix)] += damping * (np.diag(matrix) + 1e-9)
    gradient = look.slopes.T @ look.off
    step, free = np.zeros(numbers.size), np.ones(numbers.size, dtype=bool)
    for _ in range(numbers.size):
        inner, held = matrix[np.ix_(free, free)], matrix[np.ix_(free, ~free)] @ step[~free]
        step[free] = -np.linalg.solve(inner, gradient[free] + held)
        reached = within(wanted, numbers + step) - numbers
        beyond = free & (np.abs(reached - step) > 1e-12)
        if not np.any(beyond):
            break
        step[beyond] = reached[beyond]
        free &= ~beyond
        if not np.any(free):
            break
    return step
