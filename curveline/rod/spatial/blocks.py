"""Kernels that carry the derivatives of a vertex's energy from the rotation between two frames to the band of a rod.

Derivatives are taken where the frames are. An edge that changes by de and spins by dtheta turns its frame by

    phi = t x u + dtheta t - (t . de / l) t x u + dtheta u / 2 + O(3),    u = (de across t) / l

which parallel transport gives up to second order, and the rotation between frames e and f changes by phi_f - phi_e -
phi_e x phi_f / 2 + O(3) (Baker, Campbell and Hausdorff). With slope and curvature of the energy along rotations, both
from its slope and curvature by q, that is the whole Hessian.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.kernel import leaf, njit


@leaf
def along_rotations(q, slope, bending):
    """Slope (3) and curvature (6), lower triangle by rows, along rotations, from `slope` (4) and `bending` (10) by q.

    The energy does not change with the length of q, so the second-order part of a rotation's quaternion, which points
    along q, adds nothing.
    """
    w, x, y, z = q[0], q[1], q[2], q[3]
    # Half the changes of q by turns about m1, m2, t.
    first, second, third = (-x, w, -z, y), (-y, z, w, -x), (-z, -y, x, w)
    force = 0.5 * _dot(first, slope), 0.5 * _dot(second, slope), 0.5 * _dot(third, slope)
    one, two, three = _product(bending, first), _product(bending, second), _product(bending, third)
    return force, (
        0.25 * _dot(one, first),
        0.25 * _dot(one, second),
        0.25 * _dot(two, second),
        0.25 * _dot(one, third),
        0.25 * _dot(two, third),
        0.25 * _dot(three, third),
    )


@leaf
def turned_vertex(q, moment, rates):
    """Slope (3) and curvature (6), as `along_rotations` gives them, of a vertex that bends and twists by `q` itself.

    `moment (3)` and `rates (3)` are slope and curvature of its energy by both components of its turn and its twist. The
    turn is u + v, in the complex plane of the directors, with u = (x + i y) / (w + i z) and v = (x + i y) / (w - i z);
    rotations by (a, b, c) change them by e (a + i b) and (a + i b) / 2 + v^2 (a - i b) / 2 + i c v, e being 1 / 2 (w +
    i z)^2, and the twist by Im v a - Re v b + c.
    """
    w, x, y, z = q[0], q[1], q[2], q[3]
    per = 1.0 / (w * w + z * z)
    v, vi = (x * w - y * z) * per, (y * w + x * z) * per
    e, ei = 0.5 * (w * w - z * z) * per * per, -w * z * per * per
    s, si = 0.5 * (v * v - vi * vi), v * vi
    g, gi, h, hi = e * v + ei * vi, ei * v - e * vi, v * s - vi * si, v * si + vi * s
    a0, a1, a2 = e + 0.5 + s, si - ei, -vi
    b0, b1, b2 = ei + si, e + 0.5 - s, v
    m, n, t = moment
    k, o, r = rates
    ka0, ka1, ob0, ob1 = k * a0, k * a1, o * b0, o * b1
    steady, swing, twisted = 0.5 * (m * v + n * vi), m * (g + h) + n * (gi + hi), t * si
    return (m * a0 + n * b0 + t * vi, m * a1 + n * b1 - t * v, m * a2 + n * b2 + t), (
        ka0 * a0 + ob0 * b0 + r * vi * vi + steady + swing + twisted,
        ka0 * a1 + ob0 * b1 - r * v * vi - m * (gi - hi) + n * (g - h) - t * s,
        ka1 * a1 + ob1 * b1 + r * v * v + steady - swing - twisted,
        ka0 * a2 + ob0 * b2 + r * vi + m * (0.5 * ei - 1.5 * si) + n * (0.25 + 1.5 * s - 0.5 * e) + 0.5 * t * v,
        ka1 * a2 + ob1 * b2 - r * v + m * (1.5 * s - 0.25 + 0.5 * e) + n * (1.5 * si + 0.5 * ei) + 0.5 * t * vi,
        k * a2 * a2 + o * b2 * b2 + r - 2.0 * steady,
    )


@leaf
def halved_rotation(single, slope, bending):
    """Slope (4) and Hessian (10), lower triangle by rows, by the components of `single (4,)`, from those by its square.

    The square is (w^2 - x^2 - y^2 - z^2, 2 w x, 2 w y, 2 w z).
    """
    w, x, y, z = single[0], single[1], single[2], single[3]
    rows = (2.0 * w, 2.0 * x, 2.0 * y, 2.0 * z), (-2.0 * x, 2.0 * w, 0.0, 0.0)
    more = (-2.0 * y, 0.0, 2.0 * w, 0.0), (-2.0 * z, 0.0, 0.0, 2.0 * w)
    one, two = _product(bending, rows[0]), _product(bending, rows[1])
    three, four = _product(bending, more[0]), _product(bending, more[1])
    inner = (_dot(rows[0], slope), _dot(rows[1], slope), _dot(more[0], slope), _dot(more[1], slope))
    return inner, (
        _dot(rows[0], one) + 2.0 * slope[0],
        _dot(rows[0], two) + 2.0 * slope[1],
        _dot(rows[1], two) - 2.0 * slope[0],
        _dot(rows[0], three) + 2.0 * slope[2],
        _dot(rows[1], three),
        _dot(more[0], three) - 2.0 * slope[0],
        _dot(rows[0], four) + 2.0 * slope[3],
        _dot(rows[1], four),
        _dot(more[0], four),
        _dot(more[1], four) - 2.0 * slope[0],
    )


@leaf
def _dot(a, b):
    """Scalar product of two of four components."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]


@leaf
def _product(matrix, vector):
    """Product of a symmetric matrix of four rows, lower triangle by rows (10), and a vector (4)."""
    a00, a10, a11, a20, a21, a22, a30, a31, a32, a33 = matrix
    w, x, y, z = vector
    return (
        a00 * w + a10 * x + a20 * y + a30 * z,
        a10 * w + a11 * x + a21 * y + a31 * z,
        a20 * w + a21 * x + a22 * y + a32 * z,
        a30 * w + a31 * x + a32 * y + a33 * z,
    )


@njit
def vertex_blocks(turned, derivatives, before, after, gradient, hessian):
    """Overwrite slope (8,) and Hessian (8, 8) of a vertex by the change along m1, m2, t and the spin of both edges.

    `turned (3, 3)` is the rotation between the frames, `derivatives` come from `along_rotations`, `before` and `after`
    are the edges' lengths. The lower triangle of the Hessian is filled.
    """
    force, curvature = np.empty(3), np.empty((3, 3))
    force[0], force[1], force[2] = derivatives[0]
    curvature[0, 0], curvature[1, 0], curvature[1, 1], curvature[2, 0], curvature[2, 1], curvature[2, 2] = derivatives[
        1
    ]
    for r in range(3):
        for c in range(r):
            curvature[c, r] = curvature[r, c]
    slopes = np.zeros((8, 3))
    slopes[0, 1] = -1.0 / before
    slopes[1, 0] = 1.0 / before
    slopes[3, 2] = -1.0
    for a in range(3):
        slopes[4, a] = turned[a, 1] / after
        slopes[5, a] = -turned[a, 0] / after
        slopes[7, a] = turned[a, 2]
    half = np.empty(3)
    for r in range(8):
        gradient[r] = 0.0
        for a in range(3):
            gradient[r] += slopes[r, a] * force[a]
            half[a] = 0.0
            for b in range(3):
                half[a] += slopes[r, b] * curvature[a, b]
            if r > 3:
                # From -phi_e x phi_f / 2; the rows of the edge before have the sign of -phi_e.
                b, c = (a + 1) % 3, (a + 2) % 3
                half[a] += 0.5 * (slopes[r, b] * force[c] - slopes[r, c] * force[b])
        for c in range(min(r, 3) + 1):
            hessian[r, c] = slopes[c, 0] * half[0] + slopes[c, 1] * half[1] + slopes[c, 2] * half[2]
        for a in range(3):
            half[a] = slopes[r, 0] * curvature[0, a] + slopes[r, 1] * curvature[1, a] + slopes[r, 2] * curvature[2, a]
        for c in range(4, r + 1):
            hessian[r, c] = slopes[c, 0] * half[0] + slopes[c, 1] * half[1] + slopes[c, 2] * half[2]
    for at in range(0, 8, 4):
        # The second-order part of either edge's own turn: a longer edge turns less, a spinning one sideways.
        length = after if at else before
        hessian[at + 2, at] -= gradient[at] / length
        hessian[at + 2, at + 1] -= gradient[at + 1] / length
        hessian[at + 3, at] -= 0.5 * gradient[at + 1]
        hessian[at + 3, at + 1] += 0.5 * gradient[at]


@njit
def rotated(block, left, right, out):
    """Overwrite `out (4, 4)` with `block` turned from directors to space; the last row and column are spins."""
    half = np.empty((4, 4))
    for c in range(4):
        half[3, c] = block[3, c]
        for r in range(3):
            half[r, c] = 0.0
            for a in range(3):
                half[r, c] += left[r, a] * block[a, c]
    for r in range(4):
        out[r, 3] = half[r, 3]
        for c in range(3):
            out[r, c] = 0.0
            for a in range(3):
                out[r, c] += half[r, a] * right[c, a]


@leaf
def scatter(block, row_edge, column_edge, band):
    """Add a block (4, 4) of two edges' changes and spins to the `band (4n+3, 11)` of the vertices and spins.

    The rows belong to the later edge, or to the same one. An edge's change is its second vertex minus its first.
    """
    for r in range(7):
        row_sign = -1.0 if r < 3 else 1.0
        row = 4 * row_edge + r
        for c in range(7):
            column = 4 * column_edge + c
            sign = row_sign * (-1.0 if c < 3 else 1.0)
            value = sign * block[r % 4, c % 4]
            if row >= column:
                band[column, row - column] += value
            if row_edge != column_edge and column >= row:
                # The mirrored entry; on the diagonal both halves of the symmetric matrix meet.
                band[row, column - row] += value
