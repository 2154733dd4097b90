"""Kernels that tell whether an equilibrium in space is stable: the inertia and lowest value of its second variation.

The second variation is that of all turns which leave the last vertex in its place: the bordered system's.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.kernel import njit, shipped
from curveline.rod.spatial.bordered import balance
from curveline.rod.spatial.descent import factored, neutral_of, newton_step, room_for
from curveline.rod.spatial.energy import Shape, SpatialRod
from curveline.rod.spatial.reaction import first_reaction, passed_on, turns_of

LEAST_SHIFT = 0.05
SHIFTS = 40
CLOSE = 1e-10
"""How closely the lowest eigenvalue is enclosed, relative, or in EI / L^2 if it is below one."""
TRIALS = 80


@njit
def second_variation(rod, shape):
    """The bordered system at an equilibrium, room for its factor, what the border gives, and the forces passed on."""
    n = rod.edges.size
    system, factor = room_for(n)
    turns, forces = turns_of(rod, shape), np.empty((n, 3))
    gap, give = np.empty(3), np.empty((3, 3))
    passed_on(rod, first_reaction(rod, shape, turns), forces)
    balance(rod, shape.frames, turns, forces, system, gap, give)
    return system, factor, give, forces


@shipped(SpatialRod, Shape)
def is_minimum(rod, shape):
    """True if the second variation at an equilibrium is positive definite, but for motions that cost nothing."""
    system, factor, give, _ = second_variation(rod, shape)
    return factored(rod, system, neutral_of(rod), factor, give, np.empty((3, 4)))


@shipped(SpatialRod, Shape)
def lowest_eigenvalue(rod, shape):
    """Smallest eigenvalue [EI / L^2] of the second variation by the metric of turns, spins and strains.

    Inverse iteration finds it from above, inertia from below (Sylvester; Parlett 1998, ch. 3 and 4), so that none is
    overlooked. Minus infinity where none is found.
    """
    n = rod.edges.size
    system, factor, give, forces = second_variation(rod, shape)
    right, complement, change, nothing = system[2], np.empty((3, 4)), np.empty(3), np.zeros(3)
    mode, step = np.empty((n, 3)), np.zeros((n, 3))
    for j in range(n):
        for r in range(3):
            mode[j, r] = np.sin(1.0 + 2.3 * j + 4.7 * r)
    trial = -neutral_of(rod)
    for _ in range(SHIFTS):
        if factored(rod, system, -trial, factor, give, complement):
            break
        trial = min(-LEAST_SHIFT, 4.0 * trial)
    else:
        return -np.inf
    below, above, value = trial, np.inf, np.inf
    for _ in range(TRIALS):
        for j in range(n):
            for r in range(3):
                right[j, r, 0] = rod.edges[j] * mode[j, r]
        if factored(rod, system, -trial, factor, give, complement):
            below = trial
            newton_step(rod, factor, complement, nothing, step, change)
            before = above
            work, size, whole = weighed(rod, shape, forces, mode, step, change)
            if trial + work / size < above:
                above = trial + work / size
                value = above * size / whole
            scale = 1.0 / np.sqrt(size)
            for j in range(n):
                for r in range(3):
                    mode[j, r] = scale * step[j, r]
            near = above - max(0.5 * CLOSE * max(abs(above), 1.0), min(2.0 * (before - above), 0.5 * (above - below)))
        else:
            above = value = trial
            near = 0.5 * (below + above)
        if above - below <= CLOSE * max(abs(above), 1.0):
            break
        trial = near
    return value


@njit
def weighed(rod, shape, forces, before, after, change):
    """Product of two modes (n, 3) over the rest lengths, the square of the second, and its square in the metric.

    That takes edges as long as they are, and counts the strains that the second mode makes: `change (3,)` is that of
    the reaction, `forces (n, 3)` are passed on by the edges.
    """
    work = size = whole = 0.0
    for j in range(rod.edges.size):
        w, x, y, z = shape.frames[j]
        t0, t1, t2 = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), w * w - x * x - y * y + z * z
        a, b, c = after[j]
        f0, f1, f2 = forces[j]
        axial = f0 * (b * t2 - c * t1) + f1 * (c * t0 - a * t2) + f2 * (a * t1 - b * t0)
        strain = (axial + t0 * change[0] + t1 * change[1] + t2 * change[2]) / rod.stiffness[3]
        square, spin = a * a + b * b + c * c, a * t0 + b * t1 + c * t2
        work += rod.edges[j] * (before[j, 0] * a + before[j, 1] * b + before[j, 2] * c)
        size += rod.edges[j] * square
        whole += rod.edges[j] * ((1.0 + shape.strain[j]) ** 2 * (square - spin * spin) + spin * spin + strain * strain)
    return work, size, whole
