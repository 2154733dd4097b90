"""The discrete elastic rod in space: its energy, gradient and exact Hessian (Bergou et al. 2008 and 2010).

n straight edges, each with a material frame that follows its edge by parallel transport in time and spins about it. The
bending and twisting energy of a vertex depends only on the rotation q between the frames of its two edges. Clamps are
frames too: a clamped end is half a vertex, whose other edge would mirror the rod, so that q is twice the rotation from
clamp to edge; errors then have even powers of the edge length only, as extrapolation needs. Degrees of freedom are
interleaved, x_0, theta_0, x_1, theta_1, ..., x_n, so that the Hessian has eleven diagonals on and below the main one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.kernels.forms import Matrix, Vector
from curveline.kernels.kernel import leaf, njit, shipped
from curveline.rod.geometry.rotations import between, exponential, matrix_of, multiply, normalise
from curveline.rod.planar.clamps import spring_energy
from curveline.rod.problem import Array
from curveline.rod.spatial.blocks import (
    along_rotations,
    halved_rotation,
    rotated,
    scatter,
    turned_vertex,
    vertex_blocks,
)
from curveline.rod.spatial.mouths import copy_mouth, gives, mouth_shift, seen_from_mouth
from curveline.rod.spatial.terms import bend, loads, stretch, twist

BAND = 11
"""Rows of the Hessian's band: the main diagonal and those below it."""
STRAIN_WEIGHT = 5.0
"""What turn [rad] the stretching of an edge by its length counts for in the size of a step."""
SAME_TURN = 1e-13
"""How far rotations may differ that only rounding tells apart."""
NO_TURNS: Array = np.empty((0, 4))


class SpatialRod(NamedTuple):
    """A rod from vertex 0, at the origin, to vertex n, in units of its free length L and its bending stiffness EI.

    `edges (n,)` rest lengths; `stiffness (4,)` of bending about m1 and about m2, of twist (GJ / EI) and of stretch
    (EA L^2 / EI); `natural (n+1, 3)` rest curvatures about m1 and m2 and rest twist, per length, of the vertices, means
    over their cells; `forces (n+1, 3)` dead loads on the vertices; `chord (3,)` to vertex n; `frames (2, 4)` of the
    clamps; `held (3,)` 1 where first frame, last vertex and last frame are imposed, else 0. `bearings` are the
    give, the play [rad] and the reach of bearings that may tilt, see `planar.clamps`: `chord` and `frames` are then
    where the motors hold the mouths.
    """

    edges: Vector
    stiffness: Vector
    natural: Matrix
    forces: Matrix
    chord: Vector
    frames: Matrix
    held: Vector
    bearings: tuple[float, float, float] = (0.0, 0.0, 0.0)


class Shape(NamedTuple):
    """A state of a spatial rod: axial `strain (n,)` and material `frames (n, 4)` of its edges.

    `turns (n+1, 4)` are the rotations from frame to frame, clamps among them. They follow from the frames, but moments
    are differences of neighbours, of which n edges leave n^2 times the rounding in the forces; so `moved` carries them
    along. Without them they are computed. `tilts` [rad] are those of bearings that give: see `mouths`.
    """

    strain: Vector
    frames: Matrix
    turns: Matrix = NO_TURNS
    tilts: tuple[float, float] = (0.0, 0.0)


@njit
def with_frames(rod, frames):
    """The same rod between other clamps."""
    return SpatialRod(rod.edges, rod.stiffness, rod.natural, rod.forces, rod.chord, frames, rod.held, rod.bearings)


@shipped(SpatialRod, Shape)
def positions(rod, shape):
    """Positions of the vertices, (n+1, 3), by summing the edges; seen from where the motor holds the first mouth."""
    n = rod.edges.size
    out = np.zeros((n + 1, 3))
    matrix = np.empty((3, 3))
    out[0, 0], out[0, 1] = mouth_shift(rod, shape.tilts[0], 0)
    for j in range(n):
        matrix_of(shape.frames[j], matrix)
        length = rod.edges[j] * (1.0 + shape.strain[j])
        for axis in range(3):
            out[j + 1, axis] = out[j, axis] + length * matrix[axis, 2]
    return out


@leaf
def cell_of(rod, i):
    """Length over which vertex `i` bends, and the share of it that is rod: half at a clamp, none at a free end."""
    n = rod.edges.size
    if i == 0:
        return rod.edges[0], 0.5 * rod.held[0]
    if i == n:
        return rod.edges[n - 1], 0.5 * rod.held[2]
    return 0.5 * (rod.edges[i - 1] + rod.edges[i]), 1.0


@leaf
def turned_at(rod, shape, i, single):
    """Overwrite `single (4,)` with the rotation between the frames at vertex `i`, of edges or of edge and motor.

    None if the end is free. What the shape carries along is taken where it agrees with the frames: they may have been
    changed since.
    """
    n = rod.edges.size
    if (i == 0 and rod.held[0] == 0.0) or (i == n and rod.held[2] == 0.0):
        single[0] = 1.0
        for r in range(1, 4):
            single[r] = 0.0
        return
    between(rod.frames[0] if i == 0 else shape.frames[i - 1], rod.frames[1] if i == n else shape.frames[i], single)
    if shape.turns.size > 0:
        apart = 0.0
        for r in range(4):
            apart = max(apart, abs(single[r] - shape.turns[i, r]))
        if apart < SAME_TURN:
            for r in range(4):
                single[r] = shape.turns[i, r]


@leaf
def relative(rod, shape, i, single, q):
    """Overwrite `single (4,)` with the rotation between the frames at vertex `i`, of edges or of edge and clamp.

    `q (4,)` becomes what the vertex bends and twists by: that rotation, or at an end twice that; none if the end is
    free.
    """
    n = rod.edges.size
    turned_at(rod, shape, i, single)
    if i == 0 or i == n:
        end = 1 if i == n else 0
        single[0], single[1], single[2], single[3] = seen_from_mouth(rod.frames, single, shape.tilts[end], end)
        multiply(single, single, q)
    else:
        for r in range(4):
            q[r] = single[r]


@leaf
def natural_at(rod, i):
    """Rest curvatures about m1 and m2 and rest twist of vertex `i`, per length."""
    return rod.natural[i, 0], rod.natural[i, 1], rod.natural[i, 2]


@leaf
def stiffnesses(rod):
    """Stiffnesses of bending about m1 and m2 and of twist."""
    return rod.stiffness[0], rod.stiffness[1], rod.stiffness[2]


@leaf
def inner_energy(stiffness, natural, cell, q):
    """Energy of bending and twist of a vertex between two edges, of `stiffnesses`, `natural_at` and a length `cell`."""
    return bend.energy(q, cell, stiffness, natural) + twist.energy(q, cell, stiffness[2], natural[2])


@leaf
def vertex_energy(rod, i, q):
    """Energy of bending and twist of vertex `i`, which turns by `q (4,)`."""
    cell, share = cell_of(rod, i)
    if share == 0.0:
        return 0.0
    return share * inner_energy(stiffnesses(rod), natural_at(rod, i), cell, q)


@leaf
def inner_slopes(stiffness, natural, cell, q):
    """As `vertex_slopes`, of a vertex between two edges, of `stiffnesses`, `natural_at` and a length `cell`."""
    per = 1.0 / cell
    rates = per * stiffness[0], per * stiffness[1], per * stiffness[2]
    first, second = bend.turns(q)
    moment = (
        rates[0] * (first - cell * natural[0]),
        rates[1] * (second - cell * natural[1]),
        rates[2] * (twist.angle(q) - cell * natural[2]),
    )
    return turned_vertex(q, moment, rates)


@leaf
def vertex_slopes(rod, i, single, q):
    """Slope (3) and curvature (6), lower triangle by rows, of the energy of vertex `i` by rotations of its frames.

    `single` and `q` as `relative` gives them; nothing but zeros for a free end.
    """
    cell, share = cell_of(rod, i)
    if share == 0.0:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if share == 1.0:
        return inner_slopes(stiffnesses(rod), natural_at(rod, i), cell, q)
    natural, stiffness = natural_at(rod, i), stiffnesses(rod)
    (s0, s1, s2, s3), (a0, a1, a2, a3, a4, a5, a6, a7, a8, a9) = bend.derivatives(q, cell, stiffness, natural)
    (t0, _, _, t3), (b0, _, _, _, _, _, b6, _, _, b9) = twist.derivatives(q, cell, stiffness[2], natural[2])
    slope, bending = (s0 + t0, s1, s2, s3 + t3), (a0 + b0, a1, a2, a3, a4, a5, a6 + b6, a7, a8, a9 + b9)
    if share < 1.0:
        (s0, s1, s2, s3), (a0, a1, a2, a3, a4, a5, a6, a7, a8, a9) = halved_rotation(single, slope, bending)
        slope = share * s0, share * s1, share * s2, share * s3
        bending = (
            share * a0,
            share * a1,
            share * a2,
            share * a3,
            share * a4,
            share * a5,
            share * a6,
            share * a7,
            share * a8,
            share * a9,
        )
    return along_rotations(single, slope, bending)


@shipped(SpatialRod, Shape)
def energy(rod, shape):
    """Energy of bending, twist and stretch, and of bearings that give, plus the potential of the loads."""
    n = rod.edges.size
    single, q = np.empty(4), np.empty(4)
    total = loads.energy(positions(rod, shape), rod.forces)
    if gives(rod):
        total += spring_energy(rod.bearings, shape.tilts[0]) + spring_energy(rod.bearings, shape.tilts[1])
    stiffness = stiffnesses(rod)
    for i in range(1, n):
        turned_at(rod, shape, i, single)
        total += inner_energy(stiffness, natural_at(rod, i), 0.5 * (rod.edges[i - 1] + rod.edges[i]), single)
    for end in range(2):
        relative(rod, shape, end * n, single, q)
        total += vertex_energy(rod, end * n, q)
    for j in range(n):
        total += stretch.energy(shape.strain[j], rod.edges[j], rod.stiffness)
    return total


@shipped(SpatialRod, Shape)
def moments(rod, shape):
    """Moments (2, 3) of the clamps on the rod: the slope of the energy as a clamp turns; none at a free end."""
    n = rod.edges.size
    out = np.zeros((2, 3))
    single, q = np.empty(4), np.empty(4)
    matrix, mouth = np.empty((3, 3)), np.empty(4)
    copy_mouth(rod, shape, 0, mouth)
    for end in range(2):
        i = n * end
        relative(rod, shape, i, single, q)
        (first, second, third), _ = vertex_slopes(rod, i, single, q)
        matrix_of(shape.frames[n - 1] if end else mouth, matrix)
        for axis in range(3):
            total = matrix[axis, 0] * first + matrix[axis, 1] * second + matrix[axis, 2] * third
            out[end, axis] = total if end else -total
    return out


@shipped(SpatialRod, Shape)
def assemble(rod, shape):
    """Gradient (4n+3,) and lower band (4n+3, 11) of the Hessian by vertex positions and spins, nothing held."""
    n = rod.edges.size
    gradient = np.zeros(4 * n + 3)
    band = np.zeros((4 * n + 3, BAND))
    loads.add_derivatives(rod.forces, gradient)
    single, q = np.empty(4), np.empty(4)
    turned, matrix, previous = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    slope8, hessian8, block = np.zeros(8), np.zeros((8, 8)), np.empty((4, 4))
    own_slope, own, cross = np.zeros(4), np.zeros((4, 4)), np.empty((4, 4))
    for i in range(n + 1):
        before = rod.edges[i - 1] * (1.0 + shape.strain[i - 1]) if i > 0 else 1.0
        after = rod.edges[i] * (1.0 + shape.strain[i]) if i < n else 1.0
        relative(rod, shape, i, single, q)
        matrix_of(single, turned)
        vertex_blocks(turned, vertex_slopes(rod, i, single, q), before, after, slope8, hessian8)
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
            for r in range(3):
                total = 0.0
                for a in range(3):
                    total += previous[r, a] * own_slope[a]
                gradient[4 * i + r] += total
                gradient[4 * i - 4 + r] -= total
            gradient[4 * i - 1] += own_slope[3]
        if i < n:
            matrix_of(shape.frames[i], matrix)
            for r in range(4):
                own_slope[r] = slope8[4 + r]
                for c in range(4):
                    cross[r, c] = hessian8[4 + r, c]
                    own[r, c] = hessian8[4 + r, 4 + c]
            if i > 0:
                rotated(cross, matrix, previous, block)
                scatter(block, i, i - 1, band)
            matrix, previous = previous, matrix
    return gradient, band


@shipped(SpatialRod, Shape, Vector, float)
def moved(rod, shape, step, scale):
    """The shape after `scale` times `step (4n+3,)`, and the largest turn [rad] or weighted stretch of an edge.

    Edges turn and stretch by what the step's linear part says, instead of moving their vertices straight: so they don't
    lengthen as they turn, and a stiff rod can take long steps. The ends then miss their places by the step's square.
    """
    n = rod.edges.size
    strain, frames, turns = np.empty(n), np.empty((n, 4)), np.empty((n + 1, 4))
    matrix, vector, single = np.empty((3, 3)), np.empty(3), np.empty(4)
    turn, previous, half = np.empty(4), np.empty(4), np.empty(4)
    previous[0] = 1.0
    previous[1] = previous[2] = previous[3] = 0.0
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
        turned = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
        largest = max(largest, turned, STRAIN_WEIGHT * abs(along) / length)
        strain[j] = shape.strain[j] + along / rod.edges[j]
        exponential(vector, turn)
        multiply(shape.frames[j], turn, frames[j])
        normalise(frames[j])
        turned_at(rod, shape, j, single)
        between(previous, single, half)
        multiply(half, turn, turns[j])
        turn, previous = previous, turn
    turned_at(rod, shape, n, single)
    between(previous, single, turns[n])
    for i in range(n + 1):
        normalise(turns[i])
        if turns[i, 0] < 0.0:
            for r in range(4):
                turns[i, r] = -turns[i, r]
    return Shape(strain, frames, turns, shape.tilts), largest


@shipped(SpatialRod)
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
