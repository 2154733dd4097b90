"""Static equilibria of the spatial rod: descent to a stable one, Newton to any, and the lowest mode of the Hessian.

numba assembles, LAPACK solves, Python iterates. An edge turns and stretches by what a step says to first order, see
`spatial.moved`, so that even a rod that hardly stretches takes long steps; the last vertex then misses its place by the
step's square, which the next step takes into account.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh

from curveline.rod.bands import cholesky, solve_factored, solve_indefinite, times
from curveline.rod.problem import Array
from curveline.rod.spatial import Shape, SpatialRod, assemble, energy, metric, moved, positions

RESIDUAL = 1e-10
"""Largest force that is left over, relative to the largest of the forces that balance."""
CLOSE = 1e-9
"""Turn of an edge [rad] in a step of Newton's below which only rounding is left to be gained."""
ROUNDING = 2e-15
"""Of the strain's force, what rounding leaves over."""
PENALTY = 1000.0
LEAST_SHIFT = 0.05
TURN = 0.5
"""Largest turn of an edge in a step [rad]."""
SHORTENINGS = 14
BLOCK = 4
"""Vectors iterated together for the lowest mode: its neighbours converge with it."""


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
    weights = metric(rod)
    shift = 0.0
    residual = np.inf
    for iteration in range(1, iterations + 1):
        system = _system(rod, shape)
        before, (residual, floor) = residual, _residual(rod, shape, system)
        if not np.isfinite(residual):
            return Relaxed(shape, Ending.BROKEN, iteration, residual)
        shift = 0.0 if shift < LEAST_SHIFT else 0.25 * shift
        factor, shift = _factor(system, weights, shift)
        if factor is None:
            return Relaxed(shape, Ending.BROKEN, iteration, residual)
        if shift == 0.0 and _settled(residual, before, floor):
            return Relaxed(shape, Ending.SETTLED, iteration, residual)
        step = _complete(system, solve_factored(factor, _right(system)))
        shape, turn = _searched(rod, shape, system, step)
        if shift == 0.0 and turn < CLOSE:
            return Relaxed(shape, Ending.SETTLED, iteration, residual)
    return Relaxed(shape, Ending.EXHAUSTED, iterations, residual)


def newton(rod: SpatialRod, shape: Shape, iterations: int = 40) -> Relaxed:
    """Find an equilibrium near `shape`, stable or not, by Newton steps that turn no edge by more than `TURN`."""
    residual = np.inf
    for iteration in range(1, iterations + 1):
        system = _system(rod, shape)
        before, (residual, floor) = residual, _residual(rod, shape, system)
        if _settled(residual, before, floor):
            return Relaxed(shape, Ending.SETTLED, iteration, residual)
        solution = solve_indefinite(system.band[system.free], _right(system)) if np.isfinite(residual) else None
        if solution is None:
            return Relaxed(shape, Ending.BROKEN, iteration, residual)
        step = _complete(system, solution)
        _, turn = moved(rod, shape, step, 1.0)
        shape, _ = moved(rod, shape, step, min(1.0, TURN / turn) if turn > 0.0 else 1.0)
    return Relaxed(shape, Ending.EXHAUSTED, iterations, residual)


def lowest_mode(rod: SpatialRod, shape: Shape) -> tuple[float, Array]:
    """Smallest eigenvalue of the second variation at `shape` and its mode (4n+3,), by inverse iteration on a block.

    The eigenvalue is measured by the metric of turns, spins and strains, in units of EI / L^2, so that in the plane and
    for a stiff rod it is that of `planar.lowest_eigenvalue`.
    """
    system = _system(rod, shape)
    band, weights = system.band[system.free], metric(rod)[system.free]
    factor, _ = _factor(system, metric(rod), 0.0)
    size = band.shape[0]
    if factor is None:
        return -np.inf, np.zeros(system.gradient.size)
    vectors = np.random.default_rng(1).normal(size=(size, min(BLOCK, size)))
    lowest = np.inf
    for _ in range(100):
        vectors = solve_factored(factor, times(weights, vectors))
        vectors, _ = np.linalg.qr(vectors)
        values, mixes = eigh(vectors.T @ times(band, vectors), vectors.T @ times(weights, vectors))
        vectors = np.ascontiguousarray(vectors @ mixes)
        if abs(values[0] - lowest) <= 1e-9 * max(abs(values[0]), 1e-3):
            break
        lowest = values[0]
    mode = np.zeros(system.gradient.size)
    mode[system.free] = vectors[:, 0]
    return float(values[0]), mode


def is_stable(rod: SpatialRod, shape: Shape) -> bool:
    """True if the second variation at `shape` is positive definite, by its Cholesky factor."""
    system = _system(rod, shape)
    return cholesky(system.band[system.free]) is not None


def _system(rod: SpatialRod, shape: Shape) -> _System:
    """What Newton's method needs at `shape`; the first vertex is held, the last one as the rod says."""
    gradient, band = assemble(rod, shape)
    holds = rod.held[1] > 0.0
    free = slice(3, gradient.size - 3 if holds else gradient.size)
    gap = rod.chord - positions(rod, shape)[-1] if holds else np.zeros(0)
    return _System(gradient, band, free, gap)


def _right(system: _System) -> Array:
    """Right-hand side: minus the gradient, and what moving the last vertex to its place asks of the others."""
    right = -system.gradient[system.free]
    if system.gap.size:
        last = np.zeros((system.gradient.size, 1))
        last[-3:, 0] = system.gap
        right -= times(system.band, last)[system.free, 0]
    return right


def _complete(system: _System, solution: Array) -> Array:
    """The step of all degrees of freedom, (4n+3,)."""
    step = np.zeros(system.gradient.size)
    step[system.free] = solution
    if system.gap.size:
        step[-3:] = system.gap
    return step


def _residual(rod: SpatialRod, shape: Shape, system: _System) -> tuple[float, float]:
    """Largest force left over, over the largest force that an edge passes on, and what rounding alone may leave."""
    n = rod.edges.size
    passed = np.cumsum(system.gradient.reshape(-1)[: 4 * n].reshape(n, 4)[:, :3], axis=0)
    scale = max(float(np.max(np.abs(passed))), float(np.max(np.abs(rod.forces))), 1.0)
    left = float(np.max(np.abs(system.gradient[system.free])))
    if system.gap.size:
        left = max(left, float(np.max(np.abs(system.gap))) * scale)
    floor = ROUNDING * float(rod.stiffness[3]) / scale
    return left / scale, floor


def _settled(residual: float, before: float, floor: float) -> bool:
    """True if the residual is small, or as small as rounding lets it become."""
    return residual <= RESIDUAL or (residual <= floor and residual > 0.1 * before)


def _factor(system: _System, weights: Array, shift: float) -> tuple[Array | None, float]:
    """Cholesky factor of the free Hessian, shifted by the least multiple of the metric that makes it definite."""
    for _ in range(40):
        factor = cholesky(system.band[system.free] + shift * weights[system.free])
        if factor is not None:
            return factor, shift
        shift = max(LEAST_SHIFT, 4.0 * shift)
    return None, shift


def _searched(rod: SpatialRod, shape: Shape, system: _System, step: Array) -> tuple[Shape, float]:
    """The shape after as much of the step as lowers the augmented Lagrangian, and the whole step's largest turn."""
    whole, turn = moved(rod, shape, step, 1.0)
    scale = 1.0 if turn <= TURN else TURN / turn
    trial = whole if scale == 1.0 else moved(rod, shape, step, scale)[0]
    if turn < 0.02:
        return trial, turn
    # The force on the last vertex after the step, to first order, is the multiplier of its place.
    force = (system.gradient + times(system.band, step[:, None])[:, 0])[-3:] if system.gap.size else np.zeros(0)
    start = _merit(rod, shape, force)
    for _ in range(SHORTENINGS):
        if _merit(rod, trial, force) < start:
            break
        scale *= 0.5
        trial, _ = moved(rod, shape, step, scale)
    return trial, turn


def _merit(rod: SpatialRod, shape: Shape, force: Array) -> float:
    """Energy, plus the `force (3,)` on the last vertex times how far it is from its place, plus a penalty on that."""
    total = float(energy(rod, shape))
    if force.size:
        gap = rod.chord - positions(rod, shape)[-1]
        total += float(force @ gap) + 0.5 * PENALTY * float(gap @ gap)
    return total
