"""The elastic curves around a state, of the rod with its nodes a little elsewhere, and the one that fits best."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from curveline.rod.branches.drawn import laid, misfits
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.problem import Bearing, mesh
from curveline.rod.states.equilibrium import Equilibrium
from curveline.scene import STRAIGHT
from curveline.units import deg, mm

Array = npt.NDArray[np.float64]

EDGES = 160
LIKELY = np.array([mm(1.0), mm(1.0), deg(2.5), deg(2.5), mm(2.0), mm(0.7), 0.25, mm(8.0)])
"""How far a display is off what its files say, standard deviations: heights of the left and the right node, angles of
both clamps, length, place along the row, logarithm of the weight over the stiffness, and how much rod clamps give."""
BOUNDS = 3.5
"""No more of those."""
NUMBERS = len(LIKELY)
HEAVIER, GIVING = 6, 7
LITTLE = 0.01
"""Of a standard deviation, by which the last two numbers are changed to see what moves."""
ROUNDS = 12
CLOSE = 1e-3
"""Of a standard deviation, by which the last step changes a number."""
TUKEY = 4.685
BENT = mm(4.0)
"""How far a wave of a loose curve bends it, over its standard deviation."""


class Targets(NamedTuple):
    """Points that a curve should go through."""

    points: Array  # (k, 2) [m]
    sigmas: Array  # (k,) [m]


@dataclass(frozen=True, eq=False)
class ElasticCurve:
    """A curve of a family, by its numbers, and what it is near."""

    numbers: Array  # (NUMBERS,) over LIKELY
    points: Array  # (n, 2) [m] from pivot to pivot
    angles: Array  # what the next one is begun from
    multipliers: Array  # as well
    slopes: Array  # (NUMBERS, n, 2) of the points by the numbers


@dataclass(frozen=True, eq=False)
class Family:
    """Elastic curves around a state of a segment whose left pivot is at `origin` in the display's frame."""

    rod: ClampedRod
    state: Equilibrium
    origin: tuple[float, float]

    def first(self) -> ElasticCurve | None:
        """The state itself; None if it is no state of a planar rod with rod to spare."""
        angles, multipliers = self.state.start_on(mesh(np.zeros(0), EDGES))
        return self.moved(np.zeros(NUMBERS), angles, multipliers)

    def moved(self, numbers: Array, angles: Array, multipliers: Array) -> ElasticCurve | None:
        """The curve with such numbers near one with `angles` and `multipliers`; None if there is none."""
        left, right, start, end, longer, aside, *_ = numbers * LIKELY
        pose = self.rod.pose._replace(
            y=self.rod.pose.y + right - left,
            start=self.rod.pose.start + start,
            end=self.rod.pose.end + end,
            length=self.rod.pose.length + longer,
        )
        bearing = self._bearing(numbers)
        angles, multipliers = angles.copy(), multipliers.copy()
        is_there, points, _, by_pose, _ = laid(pose, bearing, angles, multipliers)
        if not is_there:
            return None
        slopes = np.zeros((NUMBERS, *points.shape))
        slopes[0], slopes[1:5] = -by_pose[0], by_pose
        slopes[0, :, 1] += 1.0
        slopes[5, :, 0] = 1.0
        slopes *= LIKELY[:, None, None]
        for number in (HEAVIER, GIVING):
            other = numbers.copy()
            other[number] += LITTLE
            is_there, changed, *_ = laid(pose, self._bearing(other), angles.copy(), multipliers.copy())
            if is_there:
                slopes[number] = (changed - points) / LITTLE
        moved = points + np.array([self.origin[0] + aside, self.origin[1] + left])
        return ElasticCurve(numbers, moved, angles, multipliers, slopes)

    def _bearing(self, numbers: Array) -> Bearing:
        """What stays the same along the row, with such numbers."""
        own = self.rod.bearing
        heavier, giving = numbers[HEAVIER:] * LIKELY[HEAVIER:]
        return own._replace(weight=own.weight * float(np.exp(heavier)), give=float(max(own.give + giving, 0.0)))

    @property
    def least(self) -> Array:
        """The least of every number: no clamp gives less than nothing."""
        least = np.full(NUMBERS, -BOUNDS)
        least[GIVING] = max(-BOUNDS, -self.rod.bearing.give / LIKELY[GIVING])
        return least

    def fitted(self, curve: ElasticCurve, targets: Targets, scale: float = TUKEY) -> ElasticCurve:
        """The curve that is nearest to what targets say and a display is likely to be; far ones are left out.

        `scale` says by how many of its standard deviations a target is off that says nothing more.
        """
        best, value = curve, np.inf
        step = np.zeros(NUMBERS)
        for _ in range(ROUNDS):
            off, by = distances(best, targets)
            now = _loss(off, best.numbers, scale)
            weights = np.maximum(1.0 - (off / scale) ** 2, 0.0) ** 2
            matrix = (by * weights[:, None]).T @ by + np.eye(NUMBERS)
            step = self._step(best.numbers, matrix, by.T @ (weights * off) + best.numbers)
            value = now
            found = self._along(best, step, targets, scale, value)
            if found is None:
                break
            best = found
            if np.max(np.abs(step)) < CLOSE:
                break
        return best

    def _step(self, numbers: Array, matrix: Array, gradient: Array) -> Array:
        """The step to where a gradient vanishes; a number that would leave its bounds stays."""
        step, free = np.zeros(NUMBERS), np.ones(NUMBERS, dtype=bool)
        for _ in range(NUMBERS):
            step[:] = 0.0
            step[free] = -np.linalg.solve(matrix[np.ix_(free, free)], gradient[free])
            stuck = ((numbers >= BOUNDS) & (step > 0.0)) | ((numbers <= self.least) & (step < 0.0))
            if not stuck.any():
                break
            free &= ~stuck
        return step

    def _along(
        self, curve: ElasticCurve, step: Array, targets: Targets, scale: float, value: float
    ) -> ElasticCurve | None:
        """The first curve along a step, or a part of it, that is nearer."""
        for part in (1.0, 0.4, 0.1):
            numbers = np.clip(curve.numbers + part * step, self.least, BOUNDS)
            found = self.moved(numbers, curve.angles, curve.multipliers)
            if found is not None and _loss(distances(found, targets)[0], numbers, scale) < value - 1e-9:
                return found
        return None


class LooseFamily(Family):
    """Curves around a state that no planar rod with rod to spare is in: its own, its ends moved and turned, and bent.

    Its numbers are those of a `Family`, but for the last ones: a bow in place of more rod, a wave in place of weight.
    """

    def first(self) -> ElasticCurve | None:
        """The state itself."""
        return self.moved(np.zeros(NUMBERS), np.zeros(0), np.zeros(0))

    def moved(self, numbers: Array, angles: Array, multipliers: Array) -> ElasticCurve | None:
        """The curve with such numbers; the others tell nothing."""
        points = self.state.curve(EDGES + 3) + np.array(self.origin)
        part, wide = np.linspace(0.0, 1.0, len(points)), float(np.ptp(points[:, 0]))
        bow = 16.0 * (part * (1.0 - part)) ** 2
        slopes = np.zeros((NUMBERS, *points.shape))
        slopes[0, :, 1] = (2.0 * part - 3.0) * part**2 + 1.0
        slopes[1, :, 1] = (3.0 - 2.0 * part) * part**2
        slopes[2, :, 1] = wide * part * (1.0 - part) ** 2
        slopes[3, :, 1] = -wide * part**2 * (1.0 - part)
        slopes[4, :, 1] = bow
        slopes[5, :, 0] = 1.0
        slopes[HEAVIER, :, 1] = BENT * bow * (2.0 * part - 1.0)
        slopes *= LIKELY[:, None, None]
        return ElasticCurve(numbers, points + np.tensordot(numbers, slopes, axes=1), angles, multipliers, slopes)


def family_of(rod: ClampedRod, state: Equilibrium, origin: tuple[float, float]) -> Family:
    """The elastic curves around a state, or what stands for them where there are none."""
    is_loose = state.name == STRAIGHT or state.space is not None or rod.needs_space
    return LooseFamily(rod, state, origin) if is_loose else Family(rod, state, origin)


def distances(curve: ElasticCurve, targets: Targets) -> tuple[Array, Array]:
    """How far targets are from a curve (k,), in their standard deviations, and the slopes of that (k, NUMBERS)."""
    moved = np.empty((len(curve.points) + len(targets.points), NUMBERS))
    off = misfits(curve.points, np.ascontiguousarray(targets.points), curve.slopes, moved)
    own = slice(len(curve.points), None)
    return off[own] / targets.sigmas, moved[own] / targets.sigmas[:, None]


def _loss(off: Array, numbers: Array, scale: float) -> float:
    """What is to be small: Tukey's loss of the distances, and how unlikely the display is."""
    inside = np.minimum((off / scale) ** 2, 1.0)
    return float(scale**2 / 3.0 * np.sum(1.0 - (1.0 - inside) ** 3) + numbers @ numbers)
