"""How many turns a rod in space holds, which no bending and twisting changes unless it passes through itself.

The frames of two clamps do not tell a rod with a full turn of twist from one without; only the way there does. What
the twist loses the curve gains as writhe: their sum, the linking number, stays (Calugareanu 1961; White 1969). It is
the measure of whether a relaxation kept the turns that were asked for: a rod without contact can pass through itself,
and then loses two of them at once.
"""

from __future__ import annotations

import math

import numpy as np

from curveline.rod.geometry.rotations import matrix_of
from curveline.rod.problem import Array
from curveline.rod.spatial.energy import Shape, SpatialRod, positions, relative

TAIL = 0.3
"""Of the free length: straight rod behind the clamps, around which nothing can pass."""
FAR = 30.0
"""Of the free length: how far behind the display the closing line runs."""
MOST_POINTS = 200
"""Of the curve whose writhe is taken, which costs the square of their number."""


def turns(rod: SpatialRod, shape: Shape) -> float:
    """Twist and writhe together, in turns: the roll of the last clamp less that of the first, or even numbers off it.

    Clamps that point out of the plane add what is below half a turn.
    """
    return twist(rod, shape) + writhe(_closed(rod, shape))


def twist(rod: SpatialRod, shape: Shape) -> float:
    """How often the material frame turns about the curve, from frame to frame, the clamps' among them.

    `twisting.total_twist` is what the rod resists; at a clamp where it bends, the two differ by the cube of the edge.
    """
    single, whole = np.empty(4), np.empty(4)
    angle = 0.0
    for vertex in range(rod.edges.size + 1):
        relative(rod, shape, vertex, single, whole)
        angle += 2.0 * math.atan2(single[3], single[0])
    return angle / (2.0 * math.pi)


def writhe(points: Array) -> float:
    """Writhe of the closed polygon through `points (n, 3)`: crossings by sign, averaged over all views.

    Gauss's integral over pairs of edges, each the solid angle of a spherical quadrangle (Klenin and Langowski 2000,
    method 1a).
    """
    start, end = points, np.roll(points, -1, axis=0)
    corners = [to[None, :] - of[:, None] for of, to in ((start, start), (start, end), (end, end), (end, start))]
    normals = [_unit(np.cross(corners[k], corners[(k + 1) % 4])) for k in range(4)]
    cosines = [np.sum(normals[k] * normals[(k + 1) % 4], axis=-1) for k in range(4)]
    area = sum(np.arcsin(np.clip(cosine, -1.0, 1.0)) for cosine in cosines)
    edges = end - start
    side = np.sum(np.cross(edges[None, :], edges[:, None]) * corners[0], axis=-1)
    pairs = np.sign(side) * area
    # Edges that meet lie in one plane and count nothing, up to rounding.
    number = np.arange(len(points))
    for neighbour in (number, np.roll(number, 1), np.roll(number, -1)):
        pairs[number, neighbour] = 0.0
    return float(np.sum(pairs)) / (4.0 * math.pi)


def _unit(vectors: Array) -> Array:
    """The same directions, of length 1 or, where there is none, 0."""
    size = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(size > 0.0, size, 1.0))


def _closed(rod: SpatialRod, shape: Shape) -> Array:
    """The rod's vertices, thinned, with its tails and a line far behind the display that closes it."""
    curve = positions(rod, shape)
    step = -(-len(curve) // MOST_POINTS)
    matrix, tails = np.empty((3, 3)), []
    for clamp, end, side in ((0, curve[0], -TAIL), (1, curve[-1], TAIL)):
        matrix_of(rod.frames[clamp], matrix)
        tails.append(end + side * matrix[:, 2])
    behind = np.array([0.0, 0.0, -FAR])
    return np.vstack([tails[0], curve[:-1:step], curve[-1], tails[1], tails[1] + behind, tails[0] + behind])
