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
from curveline.kernels.kernel import njit, shipped
from curveline.rod.geometry.vertex_table import ANGLE
from curveline.rod.planar.newton import thrust_on
from curveline.rod.problem import ScaledRod, make_problem

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
    for j in range(n):
        thrust = thrust_on(problem, phi, multipliers, j)
        stretched = 1.0 - problem.compliance[j] * thrust
        cosine, sine = np.cos(phi[j]), np.sin(phi[j])
        along, across = problem.loads[0, j], problem.loads[1, j]
        for a in range(multipliers.size):
            along += multipliers[a] * problem.rows[a, 0, j]
            across += multipliers[a] * problem.rows[a, 1, j]
        blocks[j, 0] -= thrust * stretched
        blocks[j, 1] += 0.5 * (across * cosine - along * sine) * stretched
        lift[j] = problem.edges[j] * stretched
    for i in range(n + 1):
        before = problem.ends[0] if i == 0 else phi[i - 1]
        after = problem.ends[1] if i == n else phi[i]
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
            moment = turn * problem.stiffness[i] - natural
            whole_s, whole_c = 2.0 * s * c, c * c - s * s
            blocks[i, 3] = rate_twist * s * s - rate_bend * c * c - 0.5 * moment * whole_s
            blocks[i, 4] = (rate_bend + rate_twist) * s * c - 0.5 * moment * whole_c
            blocks[i, 5] = -(rate_bend + rate_twist) * s * c + 0.5 * moment * whole_c
            blocks[i, 6] = rate_bend * s * s - rate_twist * c * c - 0.5 * moment * whole_s
    return blocks, lift


@njit
def lateral_modes_below(problem, blocks, lift, value):
    """Number of eigenvalues of a `lateral_variation` under its constraint that are smaller than `value`."""
    below = 0
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
        if determinant < 0.0:
            below += 1
        elif aa < 0.0:
            below += 2
        iaa, iab, ibb = bb / determinant, -ab / determinant, aa / determinant
        schur += fa * (iaa * fa + iab * fb) + fb * (iab * fa + ibb * fb)
        ra, rb = fa, fb
    return below + (1 if schur > 0.0 else 0) - 1


@njit
def lateral_eigenvalue(problem, phi, multipliers, lateral, guess):
    """Smallest eigenvalue of the out-of-plane second variation, in EI / L^2, to a relative `PRECISION`.

    Measured by the L2 norm of both turns, as `relax.lowest_mode`; by bisection on the inertia (Sylvester), which is
    soon done if it lies near the `guess`.
    """
    blocks, lift = lateral_variation(problem, phi, multipliers, lateral)
    low, high, width = max(0.9 * guess, 0.0), max(1.1 * guess, 10.0), 20.0
    if lateral_modes_below(problem, blocks, lift, low) > 0:
        return _eigenvalue_below(problem, (blocks, lift), 0.0, low)
    while lateral_modes_below(problem, blocks, lift, high) == 0 and high < 1e15:
        low = high
        high += width
        width *= 2.0
    return _eigenvalue_below(problem, (blocks, lift), low, high)


@njit
def lateral_eigenvalue_below(problem, phi, multipliers, lateral, most):
    """As `lateral_eigenvalue`, to `PRECISION`, or `most` if that is less: then it costs one sweep."""
    blocks, lift = lateral_variation(problem, phi, multipliers, lateral)
    if lateral_modes_below(problem, blocks, lift, most) == 0:
        return most
    return _eigenvalue_below(problem, (blocks, lift), 0.0, most)


@njit
def _eigenvalue_below(problem, variation, low, high):
    """The smallest eigenvalue, which lies below `high` and, unless negative, above `low`."""
    blocks, lift = variation
    width = 10.0
    while lateral_modes_below(problem, blocks, lift, min(low, high)) > 0:
        high = min(low, high)
        low = high - width
        width *= 2.0
    while high - low > PRECISION * max(abs(high), abs(low), 1e-3):
        middle = 0.5 * (low + high)
        if lateral_modes_below(problem, blocks, lift, middle) > 0:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


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
    coarse = lateral_eigenvalue(make_problem(rod, pairs), halfway, multipliers, lateral, 0.0)
    fine = lateral_eigenvalue(make_problem(rod, edges), angles, multipliers, lateral, coarse)
    return coarse, fine
