"""Kernels that tell whether a planar rod, free to twist and to bend sideways, stays in its plane.

At a planar equilibrium the second variation of a rod in space falls into two parts: that in the plane, see `planar`,
and that out of it. The latter has two unknowns per edge: the turn a about the normal m1 in the plane, which tilts the
edge out of it, and the turn b about the tangent t. To second order, with the normal of the plane as m2:

    frame = planar frame . exp(a m1 + b t),    edge = l ((1 - a^2 / 2) t - a m2 + a b / 2 m1)

and from edge e to edge f, which differ by the angle d in the plane, s = sin(d / 2), c = cos(d / 2),

    bend about m1 = c (a_f - a_e) + s (b_f + b_e)
    twist         = c (b_f - b_e) - s (a_f + a_e)
    bend about m2 = d - (cos d (b_e a_f - a_e b_f) + sin d (a_e a_f + b_e b_f)) / 2

the last by the product of two rotations (Baker, Campbell and Hausdorff). The moment in the plane, so also the natural
curvature, weighs the last line, the thrust the tilt. The edges' tilts must sum to nothing: one constraint. The Hessian
is block tridiagonal, 2 x 2, so that its inertia costs O(n); a clamped rod (Landau and Lifshitz 1986, section 21) leaves
its plane where it is not positive definite.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.forms import Matrix, Vector
from curveline.kernels.kernel import leaf, njit, shipped
from curveline.rod.geometry.vertex_table import ANGLE
from curveline.rod.planar.clamps import link
from curveline.rod.planar.modes import (
    FIRST_WIDTH,
    Bracket,
    around,
    from_zero,
    is_narrow,
    middle_of,
    narrowed,
    next_value,
)
from curveline.rod.problem import COSINE, SINE, ScaledRod, coefficients, make_problem
from curveline.rod.profile import TURN
from curveline.rod.trigonometry import sines_and_cosines

BLOCKS = 7
"""Per edge: Hessian aa, ab, bb, then its coupling with the edge before: a a', a b', b a', b b' (the edge before: ')."""
PRECISION = 0.01
"""Relative, of the eigenvalues."""


@njit
def lateral_variation(problem, phi, multipliers, lateral):
    """Out-of-plane second variation at the planar equilibrium `phi (n,)`, `multipliers (2,)`.

    `lateral (3,)` holds lateral stiffness EI and GJ, both over EI in the plane, and the natural curvature times the
    length. Returns `blocks (n, 7)`, see `BLOCKS`, and what a tilt of each edge lifts the rod's end by, (n,).
    """
    n = phi.size
    blocks = np.zeros((n, BLOCKS))
    lift = np.empty(n)
    bend, twist, natural = lateral[0], lateral[1], lateral[2]
    sines_and_cosines(phi, problem.room[SINE], problem.room[COSINE])
    for j in range(n):
        cosine, sine = problem.room[COSINE, j], problem.room[SINE, j]
        along, across = coefficients(problem, multipliers, j)
        thrust = along * cosine + across * sine
        stretched = 1.0 - problem.compliance[j] * thrust
        blocks[j, 0] -= thrust * stretched
        blocks[j, 1] += 0.5 * (across * cosine - along * sine) * stretched
        lift[j] = problem.edges[j] * stretched
    for i in range(n + 1):
        before = link(problem, phi, multipliers, 0)[0] if i == 0 else phi[i - 1]
        after = link(problem, phi, multipliers, 1)[0] if i == n else phi[i]
        turn = after - before
        s, c = np.sin(0.5 * turn), np.cos(0.5 * turn)
        rate_bend, rate_twist = bend * problem.stiffness[i], twist * problem.stiffness[i]
        if i < n:
            blocks[i, 0] += rate_bend * c * c + rate_twist * s * s
            blocks[i, 1] += (rate_bend - rate_twist) * s * c
            blocks[i, 2] += rate_bend * s * s + rate_twist * c * c
        if i > 0:
            blocks[i - 1, 0] += rate_bend * c * c + rate_twist * s * s
            blocks[i - 1, 1] -= (rate_bend - rate_twist) * s * c
            blocks[i - 1, 2] += rate_bend * s * s + rate_twist * c * c
        if 0 < i < n:
            moment = (turn - problem.rest[TURN, i]) * problem.stiffness[i] - natural
            whole_s, whole_c = 2.0 * s * c, c * c - s * s
            blocks[i, 3] = rate_twist * s * s - rate_bend * c * c - 0.5 * moment * whole_s
            blocks[i, 4] = (rate_bend + rate_twist) * s * c - 0.5 * moment * whole_c
            blocks[i, 5] = -(rate_bend + rate_twist) * s * c + 0.5 * moment * whole_c
            blocks[i, 6] = rate_bend * s * s - rate_twist * c * c - 0.5 * moment * whole_s
    return blocks, lift


@leaf
def lateral_characteristic(problem, variation, value):
    """Number of eigenvalues of a `lateral_variation` under its constraint that are smaller than `value`.

    And its characteristic polynomial, as `modes.characteristic`.
    """
    blocks, lift = variation
    below = 0
    product = 1.0
    schur = 0.0
    # Inverse of the pivot before, and the constraint's row after elimination.
    iaa = iab = ibb = 0.0
    ra = rb = 0.0
    for j in range(lift.size):
        aa, ab, bb = blocks[j, 0] - value * problem.edges[j], blocks[j, 1], blocks[j, 2] - value * problem.edges[j]
        fa, fb = lift[j], 0.0
        if j > 0:
            p, q, r, t = blocks[j, 3], blocks[j, 4], blocks[j, 5], blocks[j, 6]
            # Coupling times inverse: rows for a and for b.
            pa, pb = p * iaa + q * iab, p * iab + q * ibb
            qa, qb = r * iaa + t * iab, r * iab + t * ibb
            aa -= pa * p + pb * q
            ab -= pa * r + pb * t
            bb -= qa * r + qb * t
            fa -= pa * ra + pb * rb
            fb -= qa * ra + qb * rb
        determinant = aa * bb - ab * ab
        if abs(determinant) < 1e-290:
            determinant = 1e-290
        product *= determinant * problem.edges[j] * problem.edges[j]
        if determinant < 0.0:
            below += 1
        elif aa < 0.0:
            below += 2
        iaa, iab, ibb = bb / determinant, -ab / determinant, aa / determinant
        schur += fa * (iaa * fa + iab * fb) + fb * (iab * fa + ibb * fb)
        ra, rb = fa, fb
    return below + (1 if schur > 0.0 else 0) - 1, -product * schur


@leaf
def lateral_modes_below(problem, variation, value):
    """Number of eigenvalues of a `lateral_variation` under its constraint that are smaller than `value`."""
    return lateral_characteristic(problem, variation, value)[0]


@njit
def lateral_eigenvalue_below(problem, phi, multipliers, lateral, most):
    """Smallest eigenvalue of the out-of-plane second variation, or `most` if that is less: then it costs one sweep.

    In EI / L^2, to a relative `PRECISION`, measured by the L2 norm of both turns, as `relax.lowest_mode`.
    """
    variation = lateral_variation(problem, phi, multipliers, lateral)
    if lateral_modes_below(problem, variation, most) == 0:
        return most
    low = min(0.0, most - FIRST_WIDTH)
    return lowest_lateral(problem, variation, Bracket(low, np.nan, most, np.nan, 0.0, 0.0, FIRST_WIDTH))


@leaf
def lowest_lateral(problem, variation, bracket):
    """Smallest eigenvalue of a `lateral_variation`, to a relative `PRECISION`, first sought in the `bracket`."""
    while not is_narrow(bracket, PRECISION):
        value = next_value(bracket, PRECISION)
        below, at_value = lateral_characteristic(problem, variation, value)
        bracket = narrowed(bracket, value, below, at_value)
    return middle_of(bracket)


@shipped(ScaledRod, Vector, Vector, Matrix, tuple[Vector, Vector])
def lateral_pair(rod, edges, angles, table, forces):
    """Lowest eigenvalues of the out-of-plane second variation on the pairs of `edges (m,)` and on the edges themselves.

    The edges are those of a refined planar equilibrium of the `ScaledRod`, pairs equally long, `angles (m,)` theirs;
    `table (m+1, 6)` holds its vertices; `forces` are multipliers (2,) and `lateral (3,)` as above. Second order.
    """
    multipliers, lateral = forces
    m = edges.size
    pairs, halfway = np.empty(m // 2), np.empty(m // 2)
    for j in range(m // 2):
        pairs[j] = edges[2 * j] + edges[2 * j + 1]
        halfway[j] = table[2 * j + 1, ANGLE]
    problem = make_problem(rod, pairs)
    variation = lateral_variation(problem, halfway, multipliers, lateral)
    coarse = lowest_lateral(problem, variation, from_zero())
    problem = make_problem(rod, edges)
    variation = lateral_variation(problem, angles, multipliers, lateral)
    return coarse, lowest_lateral(problem, variation, around(coarse))
