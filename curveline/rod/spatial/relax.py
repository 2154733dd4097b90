"""Static equilibria of the spatial rod: descent to a stable one, Newton to any, and the lowest mode of the Hessian.

The kernels are in `descent`.
"""

from __future__ import annotations

import math
from enum import Enum
from typing import NamedTuple

import numpy as np

from curveline.rod.problem import Array
from curveline.rod.spatial.bands import solve_factored, times
from curveline.rod.spatial.descent import NEUTRAL as NEUTRAL
from curveline.rod.spatial.descent import RESIDUAL as RESIDUAL
from curveline.rod.spatial.descent import definite, descend_from, free_of, neutral_of, newton_from
from curveline.rod.spatial.energy import Shape, SpatialRod, assemble, metric
from curveline.rod.spatial.stability import is_minimum

BESIDE = 0.2
"""Largest turn of an edge [rad] that leads to an equilibrium beside a start, and steps to find it in."""
FEW = 20
KRYLOV = 120
"""Most vectors for the lowest mode; some twenty are the rule."""
CLOSE = 1e-7
"""What is left over of the lowest mode, relative; its eigenvalue is exact to the square of that."""


class RelaxEnding(Enum):
    """How a relaxation ended; the value is the sentence shown to the user."""

    SETTLED = "in equilibrium"
    EXHAUSTED = (
        "no equilibrium was reached in the iterations allowed: start nearer, or change the scene in smaller steps"
    )
    BROKEN = "the numbers left the range of floating point: stiffnesses or loads of the scene differ by too much"


class Relaxed(NamedTuple):
    """Where a relaxation ended: the shape, how, after how many iterations, and the force left over, relative."""

    shape: Shape
    ending: RelaxEnding
    iterations: int
    residual: float


def at_rest(shape: Shape) -> Relaxed:
    """A shape that is known to be in equilibrium, as a relaxation that took nothing."""
    return Relaxed(shape, RelaxEnding.SETTLED, 0, 0.0)


ENDINGS = (RelaxEnding.SETTLED, RelaxEnding.EXHAUSTED, RelaxEnding.BROKEN)
"""By the numbers that a descent ends with."""


def descend(rod: SpatialRod, shape: Shape, iterations: int = 200) -> Relaxed:
    """Go downhill from `shape` to a stable equilibrium.

    Newton steps with the Hessian shifted by the metric until it is positive definite, shortened to turn no edge by more
    than `descent.TURN` and by a line search on an augmented Lagrangian (Nocedal and Wright 2006, ch. 3.4 and 17.3).
    """
    shape, ending, taken, residual = descend_from(rod, shape, iterations)
    return Relaxed(shape, ENDINGS[ending], taken, residual)


def newton(rod: SpatialRod, shape: Shape, iterations: int = 60) -> Relaxed:
    """Find an equilibrium near `shape`, stable or not, by Newton steps that turn no edge by more than `descent.TURN`.

    The Hessian is shifted by next to nothing, which keeps motions that cost nothing from running away.
    """
    shape, ending, taken, residual = newton_from(rod, shape, iterations)
    return Relaxed(shape, ENDINGS[ending], taken, residual)


def settle(rod: SpatialRod, shape: Shape, iterations: int = 200) -> Relaxed:
    """Go downhill from `shape`, or, if that leads far, to a stable equilibrium beside it that Newton's method finds.

    Near a fold the Hessian at a good start may be indefinite, although the equilibrium beside it is stable; and on very
    many edges a descent may take hundreds of steps where Newton's method takes five.
    """
    below = descend(rod, shape, min(FEW, iterations))
    if below.ending is RelaxEnding.SETTLED and largest_turn(below.shape, shape) <= BESIDE:
        return below
    beside = newton(rod, shape, FEW)
    taken = below.iterations + beside.iterations
    is_beside = beside.ending is RelaxEnding.SETTLED and largest_turn(beside.shape, shape) <= BESIDE
    if is_beside and is_stable(rod, beside.shape):
        return beside._replace(iterations=taken)
    if below.ending is RelaxEnding.EXHAUSTED and iterations > FEW:
        below = descend(rod, below.shape, iterations - FEW)
    return below._replace(iterations=taken + below.iterations)


def largest_turn(after: Shape, before: Shape) -> float:
    """Largest angle [rad] by which an edge's frame turned."""
    alike = np.abs(np.sum(after.frames * before.frames, axis=1))
    return float(2.0 * np.max(np.arccos(np.minimum(alike, 1.0)))) if np.all(np.isfinite(alike)) else math.inf


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
    gradient, band = assemble(rod, shape)
    free = slice(*free_of(rod))
    from scipy.linalg import eigh_tridiagonal

    weights = metric(rod)
    modes = np.zeros((count, gradient.size))
    factor, shift, is_definite = definite(band, weights, neutral_of(rod), free_of(rod))
    if not is_definite:
        return np.full(count, -np.inf), modes
    weights = weights[free]
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
    """True if the second variation at an equilibrium is positive definite, but for motions that cost nothing."""
    return bool(is_minimum(rod, shape))
