"""Spatial rods for the tests of their kernels: random ones far from equilibrium, straight moves, dense matrices."""

from __future__ import annotations

import numpy as np

from curveline.rod.geometry.rotations import exponential, matrix_of, multiply
from curveline.rod.problem import Array
from curveline.rod.spatial.energy import Shape, SpatialRod, positions
from curveline.rod.spatial.lifting import frame

STIFFNESS = np.array([3.0, 1.0, 0.8, 2e3])
"""Bending about m1 and m2, twist, stretch."""


def turned(q: Array, vector: Array) -> Array:
    """The quaternion `q (4,)` turned about its own axes by `vector (3,)`."""
    turn, out = np.empty(4), np.empty(4)
    exponential(np.asarray(vector, dtype=float), turn)
    multiply(q, turn, out)
    return out


def matrix(q: Array) -> Array:
    out = np.empty((3, 3))
    matrix_of(q, out)
    return out


def between_vectors(before: Array, after: Array) -> Array:
    """The smallest rotation (3, 3) that turns one unit vector into the other."""
    axis, cosine = np.cross(before, after), before @ after
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    out: Array = np.eye(3) + cross + cross @ cross / (1.0 + cosine)
    return out


def quaternion(rotation: Array) -> Array:
    """Quaternion (4,) of a rotation's matrix, by the largest of its components (Shepperd 1978)."""
    trace = np.trace(rotation)
    squares = np.array([trace, *(2.0 * np.diag(rotation) - trace)])
    k = int(np.argmax(squares))
    out = np.empty(4)
    out[0] = 1.0 + trace if k == 0 else 0.0
    skew = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    if k == 0:
        out[1:] = skew
    else:
        out[0] = skew[k - 1]
        out[1:] = rotation[k - 1] + rotation[:, k - 1]
        out[k] = 1.0 + squares[k]
    return np.asarray(out / np.linalg.norm(out))


def random_rod(seed: int, n: int = 5, stiffness: Array = STIFFNESS) -> tuple[SpatialRod, Shape]:
    """A rod with uneven edges, natural curvature and loads between any clamps, and a shape that balances nothing."""
    rng = np.random.default_rng(seed)
    edges = rng.uniform(0.5, 1.5, n)
    edges /= edges.sum()
    frames = np.empty((n + 2, 4))
    frames[0] = turned(np.array([1.0, 0.0, 0.0, 0.0]), rng.normal(size=3))
    for j in range(n + 1):
        frames[j + 1] = turned(frames[j], rng.normal(0.0, 0.3, 3))
    rod = SpatialRod(
        edges,
        stiffness,
        rng.normal(0.0, 2.0, (n + 1, 3)),
        rng.normal(0.0, 5.0, (n + 1, 3)),
        rng.normal(0.0, 0.4, 3),
        frames[[0, -1]],
        np.ones(3),
    )
    return rod, Shape(rng.uniform(-0.05, 0.05, n), frames[1:-1].copy())


def straight_move(rod: SpatialRod, shape: Shape, step: Array) -> Shape:
    """The shape after moving its vertices straight by `step (4n+3,)`, frames transported in parallel, then spun."""
    n = rod.edges.size
    strain, frames = np.empty(n), np.empty((n, 4))
    for j in range(n):
        own = matrix(shape.frames[j])
        before = rod.edges[j] * (1.0 + shape.strain[j]) * own[:, 2]
        after = before + step[4 * j + 4 : 4 * j + 7] - step[4 * j : 4 * j + 3]
        length = np.linalg.norm(after)
        strain[j] = length / rod.edges[j] - 1.0
        moved = quaternion(between_vectors(own[:, 2], after / length) @ own)
        frames[j] = turned(moved, np.array([0.0, 0.0, step[4 * j + 3]]))
    return Shape(strain, frames)


def dense(band: Array) -> Array:
    """The symmetric matrix (N, N) with the lower `band (N, k)`."""
    size, width = band.shape
    out = np.zeros((size, size))
    for k in range(width):
        for column in range(size - k):
            out[column + k, column] = out[column, column + k] = band[column, k]
    return out


def arch(
    n: int, angle: float = 0.8, reach: float = 0.8, stiffness: tuple[float, ...] = (17.0, 1.0, 0.9, 1e6)
) -> tuple[SpatialRod, Shape]:
    """A rod between clamps in the plane that lean by `angle` and are `reach` apart, and a circular arc as a start."""
    edges = np.full(n, 1.0 / n)
    middles = (np.arange(n) + 0.5) / n
    rod = SpatialRod(
        edges,
        np.array(stiffness),
        np.zeros((n + 1, 3)),
        np.zeros((n + 1, 3)),
        np.array([reach, 0.0, 0.0]),
        np.array([frame(angle), frame(-angle)]),
        np.ones(3),
    )
    return rod, Shape(np.zeros(n), np.array([frame(angle * (1.0 - 2.0 * s)) for s in middles]))


def vertex_positions(rod: SpatialRod, shape: Shape) -> Array:
    return np.asarray(positions(rod, shape))
