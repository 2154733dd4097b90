"""Kernel that solves an equilibrium once more with another term in the model, to see how far that moves the curve."""

from __future__ import annotations

import numpy as np

from curveline.kernels.forms import Matrix, Vector
from curveline.kernels.kernel import shipped
from curveline.rod.geometry.vertex_table import ANGLE, CURVATURE, X, Y
from curveline.rod.planar.newton import Effort, newton
from curveline.rod.planar.richardson import vertex_table
from curveline.rod.problem import ScaledRod, largest_change, make_problem

SOLVE = Effort(turn=0.3, close=1e-4, iterations=25)
BRANCH = 0.5
"""An edge that turns by more than this [rad] from one model to the other belongs to another state."""


@shipped(Vector, Matrix)
def middle_angles(edges, table):
    """Tangent angles (m,) in the middle of `edges (m,)`, from angles and curvatures of a vertex `table (m+1, 6)`.

    By cubic Hermite interpolation; edges and curvatures in any unit of length.
    """
    out = np.empty(edges.size)
    for j in range(edges.size):
        bulge = 0.125 * edges[j] * (table[j, CURVATURE] - table[j + 1, CURVATURE])
        out[j] = 0.5 * (table[j, ANGLE] + table[j + 1, ANGLE]) + bulge
    return out


@shipped(ScaledRod, ScaledRod, Vector, Vector, Vector)
def response(rod, other, edges, phi, multipliers):
    """Largest distance between the equilibria of two `ScaledRod`s cut into the same `edges (n,)`, near the same angles.

    In units of the length; infinite where either is lost, jumps or is unstable. The first one's `phi (n,)` and
    `multipliers (2,)` are overwritten by its equilibrium. Both have nearly the same error, which falls out of the
    difference.
    """
    here = make_problem(rod, edges)
    spent, unstable = newton(here, phi, multipliers, SOLVE)
    if spent < 0 or unstable != 0:
        return np.inf
    there = make_problem(other, edges)
    angles, force = phi.copy(), multipliers.copy()
    spent, unstable = newton(there, angles, force, SOLVE)
    if spent < 0 or unstable != 0 or largest_change(angles, phi) > BRANCH:
        return np.inf
    one, two = vertex_table(here, phi, multipliers), vertex_table(there, angles, force)
    largest = 0.0
    for i in range(edges.size + 1):
        largest = max(largest, np.hypot(one[i, X] - two[i, X], one[i, Y] - two[i, Y]))
    return largest
