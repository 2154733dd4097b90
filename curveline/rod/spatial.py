"""The discrete elastic rod in space: its energy, gradient and exact Hessian (Bergou et al. 2008 and 2010).

n straight edges, each with a material frame that follows its edge by parallel transport in time and spins about it. The
bending and twisting energy of a vertex depends only on the rotation q between the frames of its two edges. Clamps are
frames too: a clamped end is half a vertex, whose other edge would mirror the rod, so that q is twice the rotation from
clamp to edge; errors then have even powers of the edge length only, as extrapolation needs. Degrees of freedom are
interleaved, x_0, theta_0, x_1, theta_1, ..., x_n, so that the Hessian has eleven diagonals on and below the main one.

Derivatives are taken where the frames are. An edge that changes by de and spins by dtheta turns its frame by

    phi = t x u + dtheta t - (t . de / l) t x u + dtheta u / 2 + O(3),    u = (de across t) / l

which parallel transport gives up to second order, and the rotation between frames e and f changes by phi_f - phi_e -
phi_e x phi_f / 2 + O(3) (Baker, Campbell and Hausdorff). With slope and curvature of the energy along rotations, both
from its slope and curvature by q, that is the whole Hessian.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.rod._jit import njit
from curveline.rod.problem import Array
from curveline.rod.rotations import between, exponential, matrix_of, multiply, normalise
from curveline.rod.terms import bend, loads, stretch, twist

BAND = 11
"""Rows of the Hessian's band: the main diagonal and those below it."""


class SpatialRod(NamedTuple):
    """A rod from vertex 0, at the origin, to vertex n, in units of its free length L and its bending stiffness EI.

    `edges (n,)` rest lengths; `stiffness (4,)` of bending about m1 and about m2, of twist (GJ / EI) and of stretch
    (EA L^2 / EI); `natural (3,)` rest curvatures about m1 and m2 and rest twist, per length; `forces (n+1, 3)` dead
    loads on the vertices; `chord (3,)` to vertex n; `frames (2, 4)` of the clamps; `held (3,)` 1 where first frame,
    last vertex and last frame are imposed, else 0.
    """

    edges: Array
    stiffness: Array
    natural: Array
    forces: Array
    chord: Array
    frames: Array
    held: Array


class Shape(NamedTuple):
    """A state of a spatial rod: axial `strain (n,)` and material `frames (n, 4)` of its edges."""

    strain: Array
    frames: Array


@njit
def positions(rod, shape):
    """Positions of the vertices, (n+1, 3), by summing the edges."""
    n = rod.edges.size
    out = np.zeros((n + 1, 3))
    matrix = np.empty((3, 3))
    for j in range(n):
        matrix_of(shape.frames[j], matrix)
        length = rod.edges[j] * (1.0 + shape.strain[j])
        for axis in range(3):
            out[j + 1, axis] = out[j, axis] + length * matrix[axis, 2]
    return out


@njit
def cell_of(rod, i):
    """Length over which vertex `i` bends, and the share of it that is rod: half at a clamp, none at a free end."""
    n = rod.edges.size
    if i == 0:
        return rod.edges[0], 0.5 * rod.held[0]
    if i == n:
        return rod.edges[n - 1], 0.5 * rod.held[2]
    return 0.5 * (rod.edges[i - 1] + rod.edges[i]), 1.0


@njit
def relative(rod, shape, i, single, q):
    """Overwrite `single (4,)` with the rotation between the frames at vertex `i`, of edges or of edge and clamp.

    `q (4,)` becomes what the vertex bends and twists by: that rotation, or at an end twice that.
    """
    n = rod.edges.size
    before = rod.frames[0] if i == 0 else shape.frames[i - 1]
    after = rod.frames[1] if i == n else shape.frames[i]
    between(before, after, single)
    if i == 0 or i == n:
        multiply(single, single, q)
    else:
        for r in range(4):
            q[r] = single[r]


@njit
def vertex_energy(rod, i, q):
    """Energy of bending and twist of vertex `i`, which turns by `q (4,)`."""
    cell, share = cell_of(rod, i)
    if share == 0.0:
        return 0.0
    return share * (
        bend.energy(q, cell, rod.stiffness, rod.natural) + twist.energy(q, cell, rod.stiffness, rod.natural)
    )


@njit
def vertex_slopes(rod, i, single, q, force, curvature):
    """Overwrite slope `force (3,)` and `curvature (3, 3)` of the energy of vertex `i` by rotations of its frames.

    `single` and `q` as `relative` gives them. Returns False, and nothing, for a free end.
    """
    cell, share = cell_of(rod, i)
    if share == 0.0:
        return False
    slope, bending = np.zeros(4), np.zeros((4, 4))
    bend.add_derivatives(q, cell, rod.stiffness, rod.natural, slope, bending)
    twist.add_derivatives(q, cell, rod.stiffness, rod.natural, slope, bending)
    if share < 1.0:
        halve_rotation(single, slope, bending)
        for r in range(4):
            slope[r] *= share
            for c in range(r + 1):
                bending[r, c] *= share
    along_rotations(single, slope, bending, force, curvature)
    return True


@njit
def halve_rotation(single, slope, bending):
    """Turn slope (4,) and Hessian (4, 4), lower triangle, by the square of `single (4,)` into those by itself."""
    w, x, y, z = single[0], single[1], single[2], single[3]
    ways = 2.0 * np.array([[w, x, y, z], [-x, w, 0.0, 0.0], [-y, 0.0, w, 0.0], [-z, 0.0, 0.0, w]])
    outer = slope.copy()
    inner = bending.copy()
    for a in range(4):
        slope[a] = 0.0
        for r in range(4):
            slope[a] += ways[a, r] * outer[r]
        for b in range(a + 1):
            total = 0.0
            for r in range(4):
                for c in range(4):
                    total += ways[a, r] * ways[b, c] * (inner[r, c] if r >= c else inner[c, r])
            bending[a, b] = total
    # The square is (w^2 - x^2 - y^2 - z^2, 2 w x, 2 w y, 2 w z).
    bending[0, 0] += 2.0 * outer[0]
    for a in range(1, 4):
        bending[a, a] -= 2.0 * outer[0]
        bending[a, 0] += 2.0 * outer[a]


@njit
def energy(rod, shape):
    """Energy of bending, twist and stretch plus the potential of the loads."""
    n = rod.edges.size
    single, q = np.empty(4), np.empty(4)
    total = loads.energy(positions(rod, shape), rod.forces)
    for i in range(n + 1):
        relative(rod, shape, i, single, q)
        total += vertex_energy(rod, i, q)
    for j in range(n):
        total += stretch.energy(shape.strain[j], rod.edges[j], rod.stiffness)
    return total


@njit
def along_rotations(q, slope, bending, force, curvature):
    """Slope `force (3,)` and curvature (3, 3) along rotations, from `slope (4,)` and `bending (4, 4)` by q.

    The energy does not change with the length of q, so the second-order part of a rotation's quaternion, which points
    along q, adds nothing. The lower triangle of `bending` is read.
    """
    w, x, y, z = q[0], q[1], q[2], q[3]
    ways = np.array([[-x, w, -z, y], [-y, z, w, -x], [-z, -y, x, w]])
    for a in range(3):
        force[a] = 0.0
        for r in range(4):
            force[a] += 0.5 * ways[a, r] * slope[r]
        for b in range(a + 1):
            total = 0.0
            for r in range(4):
                for c in range(4):
                    total += ways[a, r] * ways[b, c] * (bending[r, c] if r >= c else bending[c, r])
            curvature[a, b] = 0.25 * total
            curvature[b, a] = curvature[a, b]


@njit
def vertex_blocks(turned, force, curvature, before, after, gradient, hessian):
    """Overwrite slope (8,) and Hessian (8, 8) of a vertex by the change along m1, m2, t and the spin of both edges.

    `turned (3, 3)` is the rotation between the frames, `force (3,)` and `curvature (3, 3)` come from `along_rotations`,
    `before` and `after` are the edges' lengths.
    """
    ways = np.zeros((8, 3))
    ways[0, 1] = -1.0 / before
    ways[1, 0] = 1.0 / before
    ways[3, 2] = -1.0
    for a in range(3):
        ways[4, a] = turned[a, 1] / after
        ways[5, a] = -turned[a, 0] / after
        ways[7, a] = turned[a, 2]
    for r in range(8):
        gradient[r] = ways[r, 0] * force[0] + ways[r, 1] * force[1] + ways[r, 2] * force[2]
        for c in range(r + 1):
            total = 0.0
            for a in range(3):
                for b in range(3):
                    total += ways[r, a] * curvature[a, b] * ways[c, b]
            if r > 3 and c < 4:
                # From phi_e x phi_f; the rows of the edge before have the sign of -phi_e.
                total += 0.5 * (
                    ways[c, 0] * (ways[r, 1] * force[2] - ways[r, 2] * force[1])
                    + ways[c, 1] * (ways[r, 2] * force[0] - ways[r, 0] * force[2])
                    + ways[c, 2] * (ways[r, 0] * force[1] - ways[r, 1] * force[0])
                )
            hessian[r, c] = total
    for at in (0, 4):
        # The second-order part of either edge's own turn: a longer edge turns less, a spinning one sideways.
        length = after if at else before
        hessian[at + 2, at] -= gradient[at] / length
        hessian[at + 2, at + 1] -= gradient[at + 1] / length
        hessian[at + 3, at] -= 0.5 * gradient[at + 1]
        hessian[at + 3, at + 1] += 0.5 * gradient[at]


@njit
def moments(rod, shape):
    """Moments (2, 3) of the clamps on the rod: the slope of the energy as a clamp turns; none at a free end."""
    n = rod.edges.size
    out = np.zeros((2, 3))
    single, q = np.empty(4), np.empty(4)
    force, curvature, matrix = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    for end in range(2):
        i = n * end
        relative(rod, shape, i, single, q)
        if vertex_slopes(rod, i, single, q, force, curvature):
            matrix_of(shape.frames[n - 1] if end else rod.frames[0], matrix)
            for axis in range(3):
                total = matrix[axis, 0] * force[0] + matrix[axis, 1] * force[1] + matrix[axis, 2] * force[2]
                out[end, axis] = total if end else -total
    return out


@njit
def rotated(block, left, right, out):
    """Overwrite `out (4, 4)` with `block` turned from directors to space; the last row and column are spins."""
    half = np.zeros((4, 4))
    for r in range(3):
        for c in range(4):
            half[r, c] = left[r, 0] * block[0, c] + left[r, 1] * block[1, c] + left[r, 2] * block[2, c]
    for c in range(4):
        half[3, c] = block[3, c]
    for r in range(4):
        for c in range(3):
            out[r, c] = half[r, 0] * right[c, 0] + half[r, 1] * right[c, 1] + half[r, 2] * right[c, 2]
        out[r, 3] = half[r, 3]


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
def assemble(rod, shape):
    """Gradient (4n+3,) and lower band (4n+3, 11) of the Hessian by vertex positions and spins, nothing held."""
    n = rod.edges.size
    gradient = np.zeros(4 * n + 3)
    band = np.zeros((4 * n + 3, BAND))
    loads.add_derivatives(rod.forces, gradient)
    single, q = np.empty(4), np.empty(4)
    force, curvature = np.empty(3), np.empty((3, 3))
    turned, matrix, previous = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    slope8, hessian8, block = np.zeros(8), np.zeros((8, 8)), np.empty((4, 4))
    own_slope, own = np.zeros(4), np.zeros((4, 4))
    for i in range(n + 1):
        before = rod.edges[i - 1] * (1.0 + shape.strain[i - 1]) if i > 0 else 1.0
        after = rod.edges[i] * (1.0 + shape.strain[i]) if i < n else 1.0
        hessian8[:] = 0.0
        slope8[:] = 0.0
        relative(rod, shape, i, single, q)
        if vertex_slopes(rod, i, single, q, force, curvature):
            matrix_of(single, turned)
            vertex_blocks(turned, force, curvature, before, after, slope8, hessian8)
        if i > 0:
            # Edge i - 1 now has all that acts on it: from its first vertex, from its stretch, from this vertex.
            stretch.add_derivatives(shape.strain[i - 1], rod.edges[i - 1], rod.stiffness, own_slope, own)
            for r in range(4):
                own_slope[r] += slope8[r]
                for c in range(r + 1):
                    own[r, c] += hessian8[r, c]
                    own[c, r] = own[r, c]
            rotated(own, previous, previous, block)
            scatter(block, i - 1, i - 1, band)
            for axis in range(3):
                total = previous[axis, 0] * own_slope[0] + previous[axis, 1] * own_slope[1]
                total += previous[axis, 2] * own_slope[2]
                gradient[4 * i + axis] += total
                gradient[4 * i - 4 + axis] -= total
            gradient[4 * i - 1] += own_slope[3]
        if i < n:
            matrix_of(shape.frames[i], matrix)
            if i > 0:
                rotated(hessian8[4:, :4], matrix, previous, block)
                scatter(block, i, i - 1, band)
            own_slope[:] = slope8[4:]
            own[:] = hessian8[4:, 4:]
            previous[:] = matrix
    return gradient, band


@njit
def moved(rod, shape, step, scale):
    """The shape after `scale` times `step (4n+3,)`, and the largest turn of an edge [rad].

    Edges turn and stretch by what the step's linear part says, instead of moving their vertices straight: so they don't
    lengthen as they turn, and a stiff rod can take long steps. The ends then miss their places by the step's square.
    """
    n = rod.edges.size
    strain, frames = np.empty(n), np.empty((n, 4))
    matrix, vector, turn = np.empty((3, 3)), np.empty(3), np.empty(4)
    largest = 0.0
    for j in range(n):
        matrix_of(shape.frames[j], matrix)
        length = rod.edges[j] * (1.0 + shape.strain[j])
        first = second = along = 0.0
        for axis in range(3):
            change = scale * (step[4 * j + 4 + axis] - step[4 * j + axis])
            first += matrix[axis, 0] * change
            second += matrix[axis, 1] * change
            along += matrix[axis, 2] * change
        vector[0] = -second / length
        vector[1] = first / length
        vector[2] = scale * step[4 * j + 3]
        largest = max(largest, np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2))
        exponential(vector, turn)
        multiply(shape.frames[j], turn, frames[j])
        normalise(frames[j])
        strain[j] = shape.strain[j] + along / rod.edges[j]
    return Shape(strain, frames), largest


@njit
def metric(rod):
    """Band (4n+3, 11) of the squared L2 norm of the edges' turns, spins and strains: what a Hessian is measured by."""
    n = rod.edges.size
    band = np.zeros((4 * n + 3, BAND))
    for j in range(n):
        for axis in range(3):
            band[4 * j + axis, 0] += 1.0 / rod.edges[j]
            band[4 * j + 4 + axis, 0] += 1.0 / rod.edges[j]
            band[4 * j + axis, 4] -= 1.0 / rod.edges[j]
        band[4 * j + 3, 0] += rod.edges[j]
    return band
