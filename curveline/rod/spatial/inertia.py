"""Kernels of the spatial rod in motion: what inertia and damping add to the energy that a time step minimises.

Both are quadratic in what the step changes, with weights and targets that stay fixed during it; see `dynamics.step`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.kernels.forms import Matrix, Vector
from curveline.kernels.kernel import njit, shipped
from curveline.rod.geometry.rotations import between, matrix_of
from curveline.rod.spatial.blocks import along_rotations, rotated, scatter, vertex_blocks
from curveline.rod.spatial.energy import Shape, SpatialRod, cell_of, positions, relative, vertex_slopes
from curveline.rod.spatial.terms import bend, twist


class Pull(NamedTuple):
    """What a time step adds to the energy: weights and targets.

    `masses (n+1,)` pull the vertices to `places (n+1, 3)`, `inertias (n,)` the spins since the step began to `turns
    (n,)`; `viscosity` times the stiffness pulls turns and twists at the vertices to `bends (n+1, 3)`.
    """

    masses: Vector
    places: Matrix
    inertias: Vector
    turns: Vector
    viscosity: float
    bends: Matrix


@shipped(Vector)
def lumped(edges):
    """Mass of each vertex, (n+1,), of a rod of unit mass per length: half of that of its edges."""
    n = edges.size
    masses = np.zeros(n + 1)
    for j in range(n):
        masses[j] += 0.5 * edges[j]
        masses[j + 1] += 0.5 * edges[j]
    return masses


@shipped(SpatialRod, Shape)
def strained(rod, shape):
    """Turns about m1 and m2 and twists at the vertices, (n+1, 3); at an end those of rod and mirrored rod."""
    out = np.empty((rod.edges.size + 1, 3))
    single, q = np.empty(4), np.empty(4)
    for i in range(out.shape[0]):
        relative(rod, shape, i, single, q)
        out[i, 0], out[i, 1] = bend.turns(q)
        out[i, 2] = twist.angle(q)
    return out


@shipped(Shape, Shape)
def spun(shape, begin):
    """Spins of the edges beyond parallel transport since the shape `begin`, (n,) [rad]."""
    out = np.empty(shape.strain.size)
    q = np.empty(4)
    for j in range(out.size):
        between(begin.frames[j], shape.frames[j], q)
        out[j] = twist.angle(q)
    return out


@shipped(SpatialRod, Shape, Shape, Pull, Vector, Matrix)
def add_pull(rod, shape, begin, pull, gradient, band):
    """Add the slope and the Hessian of the quadratic part of a step from `begin` to `gradient` and `band`.

    An edge's spin since the step began is the twist between its frames then and now; only the later one is free.
    """
    places = positions(rod, shape)
    for i in range(places.shape[0]):
        for axis in range(3):
            gradient[4 * i + axis] += pull.masses[i] * (places[i, axis] - pull.places[i, axis])
            band[4 * i + axis, 0] += pull.masses[i]
    q = np.empty(4)
    turned, matrix = np.empty((3, 3)), np.empty((3, 3))
    slope8, hessian8 = np.zeros(8), np.zeros((8, 8))
    for j in range(rod.edges.size):
        between(begin.frames[j], shape.frames[j], q)
        slope, bending = twist.derivatives(q, 1.0, pull.inertias[j], pull.turns[j])
        matrix_of(q, turned)
        length = rod.edges[j] * (1.0 + shape.strain[j])
        vertex_blocks(turned, along_rotations(q, slope, bending), 1.0, length, slope8, hessian8)
        matrix_of(shape.frames[j], matrix)
        add_edge(slope8[4:], hessian8[4:, 4:], matrix, j, gradient, band)


@njit
def add_edge(slope, own, matrix, j, gradient, band):
    """Add slope (4,) and the lower triangle (4, 4) by the change and spin of edge `j` with the frame `matrix`."""
    block = np.empty((4, 4))
    for r in range(4):
        for c in range(r):
            own[c, r] = own[r, c]
    rotated(own, matrix, matrix, block)
    scatter(block, j, j, band)
    for axis in range(3):
        total = matrix[axis, 0] * slope[0] + matrix[axis, 1] * slope[1] + matrix[axis, 2] * slope[2]
        gradient[4 * j + 4 + axis] += total
        gradient[4 * j + axis] -= total
    gradient[4 * j + 3] += slope[3]


@shipped(SpatialRod, Shape, Pull, Vector, Matrix)
def add_viscosity(rod, shape, pull, gradient, band):
    """Add the slope and the Hessian of what internal damping asks of the turns and twists at the vertices.

    It is what a rod would ask that is naturally bent as the step began and stiff by the viscosity.
    """
    n = rod.edges.size
    natural = np.empty((n + 1, 3))
    stiffness = rod.stiffness * pull.viscosity
    damper = SpatialRod(rod.edges, stiffness, natural, rod.forces, rod.chord, rod.frames, rod.held, rod.bearings)
    single, q = np.empty(4), np.empty(4)
    turned, block = np.empty((3, 3)), np.empty((4, 4))
    matrix, previous = np.empty((3, 3)), np.empty((3, 3))
    slope8, hessian8 = np.zeros(8), np.zeros((8, 8))
    for i in range(n + 1):
        before = rod.edges[i - 1] * (1.0 + shape.strain[i - 1]) if i > 0 else 1.0
        after = rod.edges[i] * (1.0 + shape.strain[i]) if i < n else 1.0
        if i < n:
            matrix_of(shape.frames[i], matrix)
        cell, _ = cell_of(rod, i)
        for axis in range(3):
            natural[i, axis] = pull.bends[i, axis] / cell
        relative(rod, shape, i, single, q)
        matrix_of(single, turned)
        vertex_blocks(turned, vertex_slopes(damper, i, single, q), before, after, slope8, hessian8)
        if i > 0:
            add_edge(slope8[:4], hessian8[:4, :4], previous, i - 1, gradient, band)
        if i < n:
            add_edge(slope8[4:], hessian8[4:, 4:], matrix, i, gradient, band)
        if 0 < i < n:
            rotated(hessian8[4:, :4], matrix, previous, block)
            scatter(block, i, i - 1, band)
        previous[:] = matrix
