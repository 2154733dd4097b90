"""Kernels for the forces in a spatial rod at rest: the reaction on its last vertex, and what its edges pass on.

The `reaction (3,)` is the force that keeps the last vertex in its place. With the loads beyond an edge, it is the force
that the edge passes on; what of that lies along the edge strains it.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.kernel import leaf, njit, shipped
from curveline.rod.spatial.bordered import in_space, solve_border
from curveline.rod.spatial.clamps import doubled, links
from curveline.rod.spatial.energy import (
    Shape,
    SpatialRod,
    inner_slopes,
    natural_at,
    stiffnesses,
    turned_at,
    vertex_slopes,
)
from curveline.rod.spatial.mouths import gives, mouth_frame, seen_from_mouth

SLIGHT = 1e-3
"""Weight of what the strains say of the reaction, where the moments say nothing: in a straight rod."""


@njit
def turns_of(rod, shape):
    """Rotations (n+1, 4) from frame to frame, motors among them, as exactly as the shape knows them."""
    n = rod.edges.size
    out = np.empty((n + 1, 4))
    for i in range(n + 1):
        turned_at(rod, shape, i, out[i])
    return out


@njit
def tilts_of(rod, frames, turns, reaction):
    """Tilts [rad] of both bearings at rest."""
    if not gives(rod):
        return 0.0, 0.0
    forces = np.empty((rod.edges.size, 3))
    passed_on(rod, reaction, forces)
    (first, _), (last, _) = links(rod, frames, turns, forces)
    return first, last


@leaf
def _end_slope(rod, shape, turns, end):
    """Slope (3) about the axes of space of the energy of the half cell at an `end`."""
    n = rod.edges.size
    turn = seen_from_mouth(rod.frames, turns[end * n], shape.tilts[end], end)
    slopes = vertex_slopes(rod, end * n, turn, doubled(turn))
    return (
        in_space(shape.frames[n - 1], slopes)[0]
        if end
        else in_space(mouth_frame(rod.frames, shape.tilts[0], 0), slopes)[0]
    )


@leaf
def passed_on(rod, reaction, out):
    """Overwrite `out (n, 3)` with the forces that the edges pass on; returns the largest component, 1 at least."""
    largest = 1.0
    for axis in range(3):
        total = reaction[axis]
        for j in range(rod.edges.size - 1, -1, -1):
            total += rod.forces[j + 1, axis]
            out[j, axis] = total
            largest = max(largest, abs(total))
    return largest


@njit
def first_reaction(rod, shape, turns):
    """The force (3,) on the last vertex that most of a shape asks for, whose rotations at the vertices are `turns`.

    That which leaves least of the moments' slopes; where these say nothing of it, as in a straight rod, the strains do.
    At rest, all edges ask for the same one.
    """
    n = rod.edges.size
    normal, out = np.zeros((3, 4)), np.zeros(3)
    if rod.held[1] == 0.0:
        return out
    forces, slopes = np.empty((n, 3)), np.zeros((n + 2, 3))
    passed_on(rod, out, forces)
    stiffness = stiffnesses(rod)
    for i in range(n + 1):
        if 0 < i < n:
            q = turns[i, 0], turns[i, 1], turns[i, 2], turns[i, 3]
            inner = inner_slopes(stiffness, natural_at(rod, i), 0.5 * (rod.edges[i - 1] + rod.edges[i]), q)
            (m0, m1, m2), _ = in_space(shape.frames[i - 1], inner)
        else:
            m0, m1, m2 = _end_slope(rod, shape, turns, 1 if i == n else 0)
        for at, sign in ((i, 1.0), (i + 1, -1.0)):
            slopes[at, 0] += sign * m0
            slopes[at, 1] += sign * m1
            slopes[at, 2] += sign * m2
    t, asked = np.empty(3), np.empty(3)
    for j in range(n):
        w, x, y, z = shape.frames[j]
        t[0], t[1], t[2] = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), w * w - x * x - y * y + z * z
        long = rod.edges[j] * (1.0 + shape.strain[j])
        for r in range(3):
            asked[r] = slopes[j + 1, r] / long
        # A kink asks for forces of the order of the number of edges squared, and is to count the less.
        weight = 1.0 / (1.0 + asked[0] ** 2 + asked[1] ** 2 + asked[2] ** 2)
        # Of the force, what lies across the edge is what its moments ask for, and along it what its strain says.
        axial = SLIGHT * rod.stiffness[3] * shape.strain[j]
        for r in range(3):
            a, b = (r + 1) % 3, (r + 2) % 3
            missing = asked[b] * t[a] - asked[a] * t[b]
            for c in range(3):
                share = (1.0 if r == c else 0.0) - (1.0 - SLIGHT) * t[r] * t[c]
                normal[r, 1 + c] += weight * share
                missing -= share * forces[j, c]
            out[r] += weight * (missing + axial * t[r])
    solve_border(normal, out)
    return out


@njit
def strains(rod, frames, reaction):
    """Axial strains (n,) that the forces passed on make."""
    forces, out = np.empty((rod.edges.size, 3)), np.empty(rod.edges.size)
    passed_on(rod, reaction, forces)
    for j in range(out.size):
        w, x, y, z = frames[j]
        t0, t1, t2 = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), w * w - x * x - y * y + z * z
        out[j] = (t0 * forces[j, 0] + t1 * forces[j, 1] + t2 * forces[j, 2]) / rod.stiffness[3]
    return out


@shipped(SpatialRod, Shape)
def clamp_forces(rod, shape):
    """Forces (2, 3) of the clamps on the first and on the last vertex of a rod at rest; none on one that is free."""
    out = np.zeros((2, 3))
    reaction = first_reaction(rod, shape, turns_of(rod, shape))
    for axis in range(3):
        out[0, axis] = -reaction[axis]
        out[1, axis] = reaction[axis]
        for i in range(rod.edges.size + 1):
            out[0, axis] -= rod.forces[i, axis]
    return out
