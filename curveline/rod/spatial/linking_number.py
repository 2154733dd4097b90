"""How many turns a rod in space holds, which no bending and twisting changes unless it passes through itself.

The frames of two clamps do not tell a rod with a full turn of twist from one without; only the way there does. What
the twist loses the curve gains as writhe: their sum, the linking number, stays (Calugareanu 1961; White 1969). It is
the measure of whether a relaxation kept the turns that were asked for: a rod without contact can pass through itself,
and then loses two of them at once.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.kernel import njit, shipped
from curveline.rod.geometry.rotations import matrix_of
from curveline.rod.spatial.energy import Shape, SpatialRod, positions, relative
from curveline.rod.spatial.mouths import copy_mouth

TAIL = 0.3
"""Of the free length: straight rod behind the clamps, around which nothing can pass."""
FAR = 30.0
"""Of the free length: how far behind the display the closing line runs."""
MOST_POINTS = 64
"""Of the curve whose writhe is taken, which costs the square of their number; of fewer it is off by hundredths."""


@shipped(SpatialRod, Shape)
def turns(rod, shape):
    """Twist and writhe together, in turns: the roll of the last clamp less that of the first, or even numbers off it.

    Clamps that point out of the plane add what is below half a turn.
    """
    return twist(rod, shape) + writhe(_closed(rod, shape))


@njit
def twist(rod, shape):
    """How often the material frame turns about the curve, from frame to frame, the clamps' among them.

    `twisting.total_twist` is what the rod resists; at a clamp where it bends, the two differ by the cube of the edge.
    """
    single, whole = np.empty(4), np.empty(4)
    angle = 0.0
    for vertex in range(rod.edges.size + 1):
        relative(rod, shape, vertex, single, whole)
        angle += 2.0 * np.arctan2(single[3], single[0])
    return angle / (2.0 * np.pi)


@njit
def writhe(points):
    """Writhe of the closed polygon through `points (n, 3)`: crossings by sign, averaged over all views.

    Gauss's integral over pairs of edges, each the solid angle of a spherical quadrangle (Klenin and Langowski 2000,
    method 1), which is convex: two triangles (Van Oosterom and Strackee 1983).
    """
    n = points.shape[0]
    a, b, c, d = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    total = 0.0
    for i in range(n):
        after = (i + 1) % n
        for j in range(i + 2, n):
            # Edges that meet lie in one plane and count nothing.
            if (j + 1) % n != i:
                end = (j + 1) % n
                for axis in range(3):
                    a[axis], b[axis] = points[j, axis] - points[i, axis], points[end, axis] - points[i, axis]
                    c[axis], d[axis] = points[end, axis] - points[after, axis], points[j, axis] - points[after, axis]
                p, q, r, s = np.sqrt(_dot(a, a)), np.sqrt(_dot(b, b)), np.sqrt(_dot(c, c)), np.sqrt(_dot(d, d))
                across = _dot(a, c)
                one, two = _triple(a, c, b), _triple(a, d, c)
                beside = p * q * r + _dot(a, b) * r + across * q + _dot(b, c) * p
                other = p * r * s + across * s + _dot(a, d) * r + _dot(c, d) * p
                total += np.arctan2(one * other + two * beside, beside * other - one * two)
    return total / np.pi


@njit
def _dot(a, b):
    """Scalar product of two vectors (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit
def _triple(a, b, c):
    """Volume that three vectors (3,) span, by sign."""
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])


@njit
def _closed(rod, shape):
    """The rod's vertices, thinned, with its tails and a line far behind the display that closes it."""
    curve = positions(rod, shape)
    n = rod.edges.size
    step = 1 + n // MOST_POINTS
    kept = 1 + (n - 1) // step
    out, matrix, mouth = np.empty((kept + 5, 3)), np.empty((3, 3)), np.empty(4)
    for axis in range(3):
        for k in range(kept):
            out[1 + k, axis] = curve[k * step, axis]
        out[kept + 1, axis] = curve[n, axis]
    for clamp in range(2):
        copy_mouth(rod, shape, clamp, mouth)
        matrix_of(mouth, matrix)
        end, side, row = (curve[n], TAIL, kept + 2) if clamp else (curve[0], -TAIL, 0)
        for axis in range(3):
            out[row, axis] = end[axis] + side * matrix[axis, 2]
            out[kept + 3 + (1 - clamp), axis] = out[row, axis]
        out[kept + 3 + (1 - clamp), 2] -= FAR
    return out
