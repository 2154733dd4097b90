"""How far trials are from the curves that numbers predict, weighed by what makes trials of one shape differ.

Nodes that turn and lift a little otherwise each time, and rod that is fed a little otherwise, move a whole curve: its
distances are not independent, and how it is bent is known much better than where it is. So the distances of a curve
are taken as errors of its two nodes and its feed, of sizes that motors and gears have, and as a rest that is alike only
over a short way. In units of that, `white`, they are independent (generalised least squares). Whole curves that are
farther off than the others count less, as Huber has it (Robust Statistics, 1981).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from curveline.calibrating.bent_rod import Bent, BentSegment, states_of
from curveline.calibrating.unknowns import FRAME, LIKELY, Unknowns
from curveline.rod.branches.drawn import misfits
from curveline.trial import Array
from curveline.units import deg, mm

POINTS = 41
"""Of a trial, equally spaced along it."""
HUBER = 1.5
"""A curve that is so often as far off as half of them counts by its distance from there on, not by its square."""
ERRORS = np.array([deg(0.5), deg(0.5), mm(0.5), mm(0.5), mm(0.5)])
"""Standard deviations of what nodes do otherwise each time: the left and the right one turned, fed, lifted."""
REST, ALIKE, FINE = mm(0.15), mm(100.0), mm(0.1)
"""Of what else a curve is off at least, the way over which that is alike, and of what each point is by itself [m]."""


@dataclass(frozen=True, eq=False)
class SeenSegment:
    """A segment of a shape with what trials saw of it in one state."""

    bent: BentSegment  # which segment
    shape: int  # its number, from 0: all that was seen of it goes together
    state: str  # its name
    seen: tuple[Array, ...]  # (POINTS, 2) [m] of each curve

    def off_by(self, numbers: Array, near: Bent | None = None) -> float | None:
        """Root mean square distance [m] of the curves by some numbers, in a state near one; None if there is none."""
        start = near or states_of(self.bent, numbers).get(self.state)
        state = start and self.bent.bent(numbers, (start.angles, start.multipliers))
        if not state:
            return None
        off = [_off(self.bent, numbers, state, (None, points))[0] for points in self.seen]
        return math.sqrt(float(np.mean(np.square(off))))


@dataclass(frozen=True, eq=False)
class Misfit:
    """Distances of trials from the curves that numbers predict.

    `off (c, POINTS)` [m] of each of c curves, `slopes (c, POINTS, size)` by all numbers, `moved (c, POINTS, 5)` by
    what nodes may do otherwise each time: see `ERRORS`; both are empty unless asked for. `apart (c,)` [m] is the way
    from point to point, `shapes (c,)` says of which shape a curve is. `held` are the states.
    """

    numbers: Array
    held: tuple[Bent, ...]
    off: Array
    slopes: Array
    moved: Array
    apart: Array
    shapes: Array

    @property
    def rms(self) -> float:
        """The root of the mean square distance [m]."""
        return math.sqrt(float(np.mean(self.off**2)))

    def whiteners(self, rest: float) -> Array:
        """What makes distances independent and of size 1 whose `rest` [m] no node makes, (c, POINTS, POINTS)."""
        sizes = self.moved * ERRORS
        between = np.abs(np.subtract.outer(np.arange(POINTS), np.arange(POINTS))) * self.apart[:, None, None]
        spread = np.einsum("cim,cjm->cij", sizes, sizes) + rest**2 * np.exp(-between / ALIKE)
        spread += FINE**2 * np.eye(POINTS)
        whiteners: Array = np.linalg.inv(np.linalg.cholesky(spread))
        return whiteners

    def rest(self, weights: Array) -> float:
        """Root mean square [m] of what is left of the distances if nodes err as they may, curves counting so (c,)."""
        sizes = 3.0 * self.moved * ERRORS
        matrix = np.einsum("cim,cin->cmn", sizes, sizes) + FINE**2 * np.eye(len(ERRORS))
        shares = np.linalg.solve(matrix, np.einsum("cim,ci->cm", sizes, self.off)[:, :, None])
        left = self.off - np.einsum("cim,cm->ci", sizes, shares[:, :, 0])
        square = float(weights @ np.mean(left**2, axis=1) / weights.sum())
        return math.sqrt(square * POINTS / (POINTS - len(ERRORS)))


def whitened(misfit: Misfit, whiteners: Array) -> Array:
    """Distances made independent, (c, POINTS)."""
    return np.asarray(np.einsum("cij,cj->ci", whiteners, misfit.off), dtype=np.float64)


def weights_of(white: Array) -> Array:
    """What each curve counts (c,) whose distances were made independent: 1 unless it is far beyond the others."""
    sizes = np.sqrt(np.mean(white**2, axis=1))
    weights: Array = np.minimum(1.0, HUBER * max(float(np.median(sizes)), 1e-9) / np.maximum(sizes, 1e-12))
    return weights


def resampled(points: Array) -> Array:
    """`POINTS` of the points `(n, 2)`, as equally spaced along them as may be: between them nothing is known."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    places = np.linspace(0.0, along[-1], POINTS)
    nearest = np.argmin(np.abs(np.subtract.outer(places, along)), axis=1)
    return np.ascontiguousarray(points[nearest])


def misfit_at(seen: Sequence[SeenSegment], numbers: Array, held: Sequence[Bent], *, sloped: bool) -> Misfit | None:
    """The distances for some numbers, in states near those held; None where one is lost."""
    states, off, slopes, moved, apart = [], [], [], [], []
    for segment, before in zip(seen, held, strict=True):
        state = segment.bent.bent(numbers, (before.angles, before.multipliers))
        moves = segment.bent.moves(numbers, state) if state is not None and sloped else None
        if state is None or (sloped and moves is None):
            return None
        states.append(state)
        for points in segment.seen:
            away, by, erring = _off(segment.bent, numbers, state, (moves, points))
            off.append(away)
            slopes.append(by)
            moved.append(erring)
            apart.append(float(np.hypot(*np.diff(points, axis=0).T).mean()))
    shapes = np.array([segment.shape for segment in seen for _ in segment.seen])
    return Misfit(numbers, tuple(states), np.array(off), np.array(slopes), np.array(moved), np.array(apart), shapes)


def _off(bent: BentSegment, numbers: Array, state: Bent, given: tuple[Array | None, Array]) -> tuple[Array, ...]:
    """Distances (k,) of points (k, 2) from a curve as a camera sees it, slopes (k, size), those by `ERRORS` (k, 5)."""
    moves, points = given
    unknowns = bent.unknowns
    seen, turned = as_seen(unknowns, numbers, state.points)
    if moves is None:
        off = misfits(seen, points, np.zeros((0, *seen.shape)), np.empty((len(seen) + len(points), 0)))
        return off[len(seen) :], np.zeros((0, 0)), np.zeros((0, 0))
    count = len(moves)
    local = np.zeros((count + len(FRAME), *seen.shape))
    local[:count] = moves @ turned.T
    local[-4, :, 0] = local[-3, :, 1] = 1.0
    local[-2] = np.column_stack([-seen[:, 1] + numbers[-3], seen[:, 0] - numbers[-4]])
    local[-1] = state.points @ turned.T / (1.0 + numbers[-1])
    by = np.zeros((len(seen) + len(points), len(local)))
    off = misfits(seen, points, local, by)[len(seen) :]
    by = by[len(seen) :]
    slopes = np.zeros((len(points), unknowns.size))
    places = unknowns.places(bent.index)
    slopes[:, places] = by[:, : len(places)]
    slopes[:, unknowns.frame] = by[:, -len(FRAME) :]
    # Both nodes lifted shift the whole curve.
    right = by[:, count - 1]
    return off, slopes, np.column_stack([by[:, 3:6], by[:, -3] - right, right])


def as_seen(unknowns: Unknowns, numbers: Array, points: Array) -> tuple[Array, Array]:
    """Points (n, 2) of the display where a camera sees them whose frame is off; the matrix of its turn and scale."""
    x, y, turn, scale = numbers[unknowns.frame].tolist()
    cosine, sine = (1.0 + scale) * math.cos(turn), (1.0 + scale) * math.sin(turn)
    turned = np.array([[cosine, -sine], [sine, cosine]])
    return points @ turned.T + np.array([x, y]), turned


def likely(unknowns: Unknowns) -> Array:
    """One over the variance of what is likely of each number by itself, (size,): of a camera's frame, and of others a
    wide one, by which every fit has an end."""
    return np.array([1.0 / LIKELY[each.kind] ** 2 for each in unknowns.all])
