"""Static equilibria of the spatial rod: descent to a stable one, Newton to any, and the lowest mode of the Hessian.

numba assembles, LAPACK solves, Python iterates. An edge turns and stretches by what a step says to first order, see
`spatial.moved`, so that even a rod that hardly stretches takes long steps; the last vertex then misses its place by the
step's square, which the next step takes into account.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh_tridiagonal

from curveline.rod.bands import cholesky, solve_factored, solve_indefinite, times
from curveline.rod.problem import Array
from curveline.rod.spatial import Shape, SpatialRod, assemble, energy, follow_turns, metric, moved, positions

RESIDUAL = 1e-10
"""Largest force that is left over, relative to the largest of the forces that balance."""
ROUNDING = 1e-15
"""Of the moments' force on a vertex, what rounding leaves over."""
PENALTY = 1000.0
NEUTRAL = 1e-6
"""Eigenvalues [EI / L^2] no further below zero are of motions that cost nothing, such as turning a round rod's arch."""
CANCELLED = 2e-17
"""Of the Hessian's entries, what rounding makes of the lowest eigenvalue."""
LEAST_SHIFT = 0.05
TURN = 0.5
"""Largest turn of an edge in a step [rad]."""
SMOOTHING = 1000.0
"""Shift at which half of the last vertex's gap is closed in a step."""
SMALL = 0.02
"""Turn [rad] below which a step needs no line search."""
SHORTENINGS = 14
KRYLOV = 120
"""Most vectors for the lowest mode; some twenty are the rule."""
CLOSE = 1e-7
"""What is left over of the lowest mode, relative; its eigenvalue is exact to the square of that."""


class Ending(Enum):
    """How a relaxation ended; the value is the sentence shown to the user."""

    SETTLED = "in equilibrium"
    EXHAUSTED = (
        "no equilibrium was reached in the iterations allowed: start nearer, or change the scene in smaller steps"
    )
    BROKEN = "the numbers left the range of floating point: stiffnesses or loads of the scene differ by too much"


class Relaxed(NamedTuple):
    """Where a relaxation ended: the shape, how, after how many iterations, and the force left over, relative."""

    shape: Shape
    ending: Ending
    iterations: int
    residual: float


class _System(NamedTuple):
    """Newton's linear system at a shape: what is free, and how far the last vertex is from its place."""

    gradient: Array
    band: Array
    free: slice
    gap: Array


def descend(rod: SpatialRod, shape: Shape, iterations: int = 200) -> Relaxed:
    """Go downhill from `shape` to a stable equilibrium.

    Newton steps with the Hessian shifted by the metric until it is positive definite, shortened to turn no edge by more
    than `TURN` and by a line search on an augmented Lagrangian (Nocedal and Wright 2006, ch. 3.4 and 17.3).
    """
    weights, least = metric(rod), _neutral(rod)
    shift = least
    residual = np.inf
    for iteration in range(1, iterations + 1):
        system = _turning(rod, _system(rod, shape), shape)
        residual, floor = _residual(rod, system)
        factor, shift = _factor(system, weights, shift) if np.isfinite(residual) else (None, shift)
        if factor is None:
            return Relaxed(shape, Ending.BROKEN, iteration, residual)
        if shift == least and residual <= max(RESIDUAL, floor):
            return Relaxed(shape, Ending.SETTLED, iteration, residual)
        # While kinks make the rod unstable, they are smoothed first: a stiffened rod closes its gap by a new kink.
        system = system._replace(gap=system.gap / (1.0 + shift / SMOOTHING))
        step = _joined(rod, shape, system, solve_factored(factor, _right_sides(system)))
        shape, found = _searched(rod, shape, system, step)
        relief = 0.25 * shift if shift > LEAST_SHIFT else least
        shift = relief if found else 4.0 * max(shift, LEAST_SHIFT)
    return Relaxed(shape, Ending.EXHAUSTED, iterations, residual)


def newton(rod: SpatialRod, shape: Shape, iterations: int = 60) -> Relaxed:
    """Find an equilibrium near `shape`, stable or not, by Newton steps that turn no edge by more than `TURN`.

    The Hessian is shifted by next to nothing, which keeps motions that cost nothing from running away.
    """
    weights, least = metric(rod), _neutral(rod)
    residual = np.inf
    for iteration in range(1, iterations + 1):
        system = _turning(rod, _system(rod, shape), shape)
        residual, floor = _residual(rod, system)
        if residual <= max(RESIDUAL, floor):
            return Relaxed(shape, Ending.SETTLED, iteration, residual)
        shifted = system.band[system.free] + least * weights[system.free]
        solution = solve_indefinite(shifted, _right_sides(system)) if np.isfinite(residual) else None
        if solution is None:
            return Relaxed(shape, Ending.BROKEN, iteration, residual)
        shape = _bounded(rod, shape, _joined(rod, shape, system, solution))[0]
    return Relaxed(shape, Ending.EXHAUSTED, iterations, residual)


def lowest_mode(rod: SpatialRod, shape: Shape) -> tuple[float, Array]:
    """Smallest eigenvalue of the second variation at `shape` and its mode (4n+3,), of length 1 in the metric.

    The eigenvalue is measured by the metric of turns, spins and strains, in units of EI / L^2, so that in the plane and
    for a stiff rod it is that of `modes.lowest_eigenvalue`.
    """
    values, modes = lowest_modes(rod, shape, 1)
    return float(values[0]), modes[0]


def lowest_modes(rod: SpatialRod, shape: Shape, count: int) -> tuple[Array, Array]:
    """The `count` smallest eigenvalues of the second variation, rising, and their modes (count, 4n+3).

    By the Lanczos method on the inverse, shifted until it is positive definite, with full orthogonalisation (Golub and
    Van Loan 2013, section 10.3). Of an eigenvalue that occurs twice one mode is found.
    """
    system = _system(rod, shape)
    free, weights = system.free, metric(rod)[system.free]
    modes = np.zeros((count, system.gradient.size))
    factor, shift = _factor(system, metric(rod), _neutral(rod))
    if factor is None:
        return np.full(count, -np.inf), modes
    size = weights.shape[0]
    vector = np.random.default_rng(1).normal(size=size)
    basis, images = np.empty((KRYLOV, size)), np.empty((KRYLOV, size))
    diagonal, beside = np.empty(KRYLOV), np.empty(KRYLOV)
    image = times(weights, vector)
    length = np.sqrt(vector @ image)
    most = min(KRYLOV, size)
    for k in range(most):
        basis[k], images[k] = vector / length, image / length
        vector = solve_factored(factor, images[k])
        diagonal[k] = vector @ images[k]
        for _ in range(2):
            vector -= (images[: k + 1] @ vector) @ basis[: k + 1]
        image = times(weights, vector)
        beside[k] = length = np.sqrt(max(vector @ image, 0.0))
        if k + 1 == most or (k >= count and k % 4 == 3):
            values, mixes = eigh_tridiagonal(diagonal[: k + 1], beside[:k], select="i", select_range=(k + 1 - count, k))
            if np.all(length * np.abs(mixes[-1]) <= CLOSE * values):
                break
    modes[:, free] = mixes.T[::-1] @ basis[: k + 1]
    return 1.0 / values[::-1] - shift, modes


def is_stable(rod: SpatialRod, shape: Shape) -> bool:
    """True if the second variation at `shape` is positive definite, but for motions that cost nothing."""
    system = _system(rod, shape)
    return cholesky(system.band[system.free] + _neutral(rod) * metric(rod)[system.free]) is not None


def _neutral(rod: SpatialRod) -> float:
    """How far below zero an eigenvalue may be to count as zero."""
    n = rod.edges.size
    return NEUTRAL + CANCELLED * n * float(rod.stiffness[3] + 10.0 * n**2 * np.max(rod.stiffness[:2]))


def _system(rod: SpatialRod, shape: Shape) -> _System:
    """What Newton's method needs at `shape`; the first vertex is held, the last one as the rod says."""
    gradient, band = assemble(rod, shape)
    holds = rod.held[1] > 0.0
    free = slice(3, gradient.size - 3 if holds else gradient.size)
    gap = rod.chord - positions(rod, shape)[-1] if holds else np.zeros(0)
    return _System(gradient, band, free, gap)


def _turning(rod: SpatialRod, system: _System, shape: Shape) -> _System:
    """The system with the Hessian of `moved`, at the reaction of the last vertex that most of the rod asks for.

    At equilibrium every edge asks for the same. Before, the median is least disturbed by kinks, whose forces are of the
    order of the number of vertices squared.
    """
    reaction = np.median(_beyond(system.gradient), axis=0) if system.gap.size else np.zeros(3)
    follow_turns(rod, shape, system.gradient, reaction, system.band)
    return system


def _beyond(gradient: Array) -> Array:
    """For every edge, (n, 3), what the gradient is for moving all that lies beyond it."""
    by_vertex = np.concatenate([gradient, [0.0]]).reshape(-1, 4)[:, :3]
    return np.cumsum(by_vertex[:0:-1], axis=0)[::-1]


def _right_sides(system: _System) -> Array:
    """Right-hand sides (N, 2): minus the gradient, and what moving the last vertex to its place asks of the others."""
    right = np.zeros((system.gradient.size, 2), order="F")
    right[:, 0] = -system.gradient
    if system.gap.size:
        last = np.zeros(system.gradient.size)
        last[-3:] = system.gap
        right[:, 1] = -times(system.band, last)
    return right[system.free]


def _joined(rod: SpatialRod, shape: Shape, system: _System, solutions: Array) -> Array:
    """The step (4n+3,) from both solutions (N, 2): of the second, as much as turns no edge by more than `TURN`."""
    step = np.zeros(system.gradient.size)
    if system.gap.size:
        step[system.free] = solutions[:, 1]
        step[-3:] = system.gap
        _, turn = moved(rod, shape, step, 1.0)
        if turn > TURN:
            step *= TURN / turn
    step[system.free] += solutions[:, 0]
    return step


def _bounded(rod: SpatialRod, shape: Shape, step: Array) -> tuple[Shape, float, float]:
    """The shape after as much of the step as turns no edge by more than `TURN`, how much, and the whole step's turn."""
    whole, turn = moved(rod, shape, step, 1.0)
    if turn <= TURN:
        return whole, 1.0, turn
    return moved(rod, shape, step, TURN / turn)[0], TURN / turn, turn


def _residual(rod: SpatialRod, system: _System) -> tuple[float, float]:
    """Largest force left over, over the largest force that an edge passes on, and what rounding alone may leave."""
    n = rod.edges.size
    forces = np.zeros((n + 1, 4))
    forces[:, :3] = rod.forces
    with np.errstate(invalid="ignore"):
        passed = _beyond(system.gradient + forces.reshape(-1)[:-1])
    scale = max(float(np.max(np.abs(passed))), 1.0)
    left = float(np.max(np.abs(system.gradient[system.free])))
    if system.gap.size:
        left = max(left, float(np.max(np.abs(system.gap))) * scale)
    return left / scale, ROUNDING * n * float(np.max(rod.stiffness[:3])) / scale


def _factor(system: _System, weights: Array, shift: float) -> tuple[Array | None, float]:
    """Cholesky factor of the free Hessian, shifted by the least multiple of the metric that makes it definite."""
    for _ in range(40):
        factor = cholesky(system.band[system.free] + shift * weights[system.free])
        if factor is not None:
            return factor, shift
        shift = max(LEAST_SHIFT, 4.0 * shift)
    return None, shift


def _searched(rod: SpatialRod, shape: Shape, system: _System, step: Array) -> tuple[Shape, bool]:
    """The shape after as much of the step as lowers the augmented Lagrangian, and if any of it did."""
    trial, scale, turn = _bounded(rod, shape, step)
    if turn < SMALL:
        return trial, True
    # The force on the last vertex after the step, to first order, is the multiplier of its place.
    force = (system.gradient + times(system.band, step))[-3:] if system.gap.size else np.zeros(0)
    start = _merit(rod, shape, force)
    for _ in range(SHORTENINGS):
        if _merit(rod, trial, force) < start:
            return trial, True
        scale *= 0.5
        trial, _ = moved(rod, shape, step, scale)
    return trial, False


def _merit(rod: SpatialRod, shape: Shape, force: Array) -> float:
    """Energy, plus the `force (3,)` on the last vertex times how far it is from its place, plus a penalty on that."""
    total = float(energy(rod, shape))
    if force.size:
        gap = rod.chord - positions(rod, shape)[-1]
        total += float(force @ gap) + 0.5 * PENALTY * float(gap @ gap)
    return total
