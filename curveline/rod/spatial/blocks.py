"""Kernels that carry the derivatives of a vertex's energy from the rotation between two frames to the band of a rod.

Derivatives are taken where the frames are. An edge that changes by de and spins by dtheta turns its frame by

    phi = t x u + dtheta t - (t . de / l) t x u + dtheta u / 2 + O(3),    u = (de across t) / l

which parallel transport gives up to second order, and the rotation between frames e and f changes by phi_f - phi_e -
phi_e x phi_f / 2 + O(3) (Baker, Campbell and Hausdorff). With slope and curvature of the energy along rotations, both
from its slope and curvature by q, that is the whole Hessian.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.kernel import njit


@njit
def along_rotations(q, slope, bending, force, curvature):
    """Slope `force (3,)` and curvature (3, 3) along rotations, from `slope (4,)` and `bending (4, 4)` by q.

    The energy does not change with the length of q, so the second-order part of a rotation's quaternion, which points
    along q, adds nothing. The lower triangle of `bending` is read.
    """
    # Twice the changes of q by turns about m1, m2, t: (-x, w, -z, y), (-y, z, w, -x), (-z, -y, x, w).
    slopes = np.empty((3, 4))
    for a in range(3):
        slopes[a, 0] = -q[1 + a]
        slopes[a, 1 + a] = q[0]
        slopes[a, 1 + (a + 1) % 3] = -q[1 + (a + 2) % 3]
        slopes[a, 1 + (a + 2) % 3] = q[1 + (a + 1) % 3]
    half = np.empty(4)
    for a in range(3):
        force[a] = 0.0
        for r in range(4):
            force[a] += 0.5 * slopes[a, r] * slope[r]
            half[r] = 0.0
            for c in range(4):
                half[r] += slopes[a, c] * (bending[r, c] if r >= c else bending[c, r])
        for b in range(a + 1):
            total = 0.0
            for r in range(4):
                total += slopes[b, r] * half[r]
            curvature[a, b] = 0.25 * total
            curvature[b, a] = curvature[a, b]


@njit
def halve_rotation(single, slope, bending):
    """Turn slope (4,) and Hessian (4, 4), lower triangle, by the square of `single (4,)` into those by itself."""
    # The square is (w^2 - x^2 - y^2 - z^2, 2 w x, 2 w y, 2 w z); its slopes are the rows below.
    slopes, inner, half, outer = np.zeros((4, 4)), np.empty((4, 4)), np.empty(4), np.empty(4)
    for a in range(4):
        slopes[a, a] = 2.0 * single[0]
        if a > 0:
            slopes[0, a] = 2.0 * single[a]
            slopes[a, 0] = -2.0 * single[a]
        outer[a] = slope[a]
        for b in range(a + 1):
            inner[a, b] = inner[b, a] = bending[a, b]
    for a in range(4):
        slope[a] = 0.0
        for r in range(4):
            slope[a] += slopes[a, r] * outer[r]
            half[r] = 0.0
            for c in range(4):
                half[r] += slopes[a, c] * inner[r, c]
        for b in range(a + 1):
            bending[a, b] = 0.0
            for r in range(4):
                bending[a, b] += slopes[b, r] * half[r]
    bending[0, 0] += 2.0 * outer[0]
    for a in range(1, 4):
        bending[a, a] -= 2.0 * outer[0]
        bending[a, 0] += 2.0 * outer[a]


@njit
def vertex_blocks(turned, force, curvature, before, after, gradient, hessian):
    """Overwrite slope (8,) and Hessian (8, 8) of a vertex by the change along m1, m2, t and the spin of both edges.

    `turned (3, 3)` is the rotation between the frames, `force (3,)` and `curvature (3, 3)` come from `along_rotations`,
    `before` and `after` are the edges' lengths. The lower triangle of the Hessian is filled.
    """
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


@njit
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


@njit
def clear(array):
    """Set `array (m, k)` to zero; compiles in a fraction of the time of a slice assignment."""
    for r in range(array.shape[0]):
        for c in range(array.shape[1]):
            array[r, c] = 0.0
