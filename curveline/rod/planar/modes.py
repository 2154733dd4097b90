"""Kernels for the second variation of the planar rod under its constraints: its inertia and its lowest eigenvalue."""

from __future__ import annotations

import numpy as np

from curveline.kernels.kernel import njit
from curveline.rod.planar.newton import TINY, count_positive

LARGEST = 1e290
"""Product of two values of the characteristic polynomial from which on one of them may have overflown."""


@njit
def second_variation(problem, phi, multipliers):
    """Hessian of the Lagrangian at an equilibrium with the strains eliminated.

    Its `diagonal (n,)`, the constraints' `border (k, n)` and how far they yield by stretching, `corner (k, k)`.
    """
    n = phi.size
    k = multipliers.size
    diagonal = np.empty(n)
    border = np.empty((k, n))
    corner = np.zeros((k, k))
    for j in range(n):
        cosine = np.cos(phi[j])
        sine = np.sin(phi[j])
        along = problem.loads[0, j]
        across = problem.loads[1, j]
        for a in range(k):
            along += multipliers[a] * problem.rows[a, 0, j]
            across += multipliers[a] * problem.rows[a, 1, j]
        thrust = along * cosine + across * sine
        turning = across * cosine - along * sine
        stretch = 1.0 - problem.compliance[j] * thrust
        diagonal[j] = (
            problem.stiffness[j] + problem.stiffness[j + 1] - thrust * stretch - problem.compliance[j] * turning**2
        )
        for a in range(k):
            reach = problem.rows[a, 0, j] * cosine + problem.rows[a, 1, j] * sine
            across_a = problem.rows[a, 1, j] * cosine - problem.rows[a, 0, j] * sine
            border[a, j] = across_a * stretch - problem.compliance[j] * reach * turning
            for b in range(k):
                reach_b = problem.rows[b, 0, j] * cosine + problem.rows[b, 1, j] * sine
                corner[a, b] += problem.compliance[j] * reach * reach_b
    return diagonal, border, corner


@njit
def characteristic(problem, variation, value):
    """Number of eigenvalues of the constrained `second_variation` below `value`, and its characteristic polynomial.

    The polynomial is the determinant of the bordered matrix, which has no poles, in units that keep it from overflow;
    it changes sign at each eigenvalue.
    """
    diagonal, border, corner = variation
    k = border.shape[0]
    schur = corner.copy()
    forward = np.zeros(k)
    below = 0
    inverse = 0.0
    product = 1.0
    for j in range(diagonal.size):
        ratio = -problem.stiffness[j] * inverse
        pivot = diagonal[j] - value * problem.edges[j] + ratio * problem.stiffness[j]
        if abs(pivot) < TINY:
            pivot = TINY
        if pivot < 0.0:
            below += 1
        product *= pivot * problem.edges[j]
        # One division an edge: they are what this loop spends its time on.
        inverse = 1.0 / pivot
        for a in range(k):
            forward[a] = border[a, j] - ratio * forward[a]
            scaled = forward[a] * inverse
            for b in range(a + 1):
                schur[a, b] += scaled * forward[b]
    for a in range(k):
        for b in range(a):
            schur[b, a] = schur[a, b]
    below += count_positive(schur) - k
    for a in range(k):
        product *= schur[a, a]
    return below, product


@njit
def modes_below(problem, variation, value):
    """Number of eigenvalues of the constrained `second_variation` that are smaller than `value`."""
    return characteristic(problem, variation, value)[0]


@njit
def lowest_eigenvalue(problem, phi, multipliers, precision):
    """Smallest eigenvalue of the second variation under the constraints, to a relative `precision`.

    Normalised by the L2 norm of the angles' change, in units of EI / L^2 with L the free length. Bracketed by the
    inertia (Sylvester); within, the characteristic polynomial's zero is sought by the Illinois method, and by bisection
    while two eigenvalues are in the bracket or the polynomial leaves the range of floating point.
    """
    variation = second_variation(problem, phi, multipliers)
    low, high, width = 0.0, 0.0, 40.0
    below, at_low = characteristic(problem, variation, 0.0)
    at_high = at_low
    if below > 0:
        inside = below
        while below > 0 and low > -1e15:
            high, at_high, inside = low, at_low, below
            low -= width
            width *= 2.0
            below, at_low = characteristic(problem, variation, low)
    else:
        inside = 0
        while inside == 0 and high < 1e15:
            low, at_low = high, at_high
            high += width
            width *= 2.0
            inside, at_high = characteristic(problem, variation, high)
    side = 0
    while high - low > precision * max(abs(high), abs(low), 1e-3):
        least = 0.4 * precision * max(abs(high), abs(low), 1e-3)
        guess = 0.5 * (low + high)
        if inside == 1 and -LARGEST < at_low * at_high < 0.0:
            # Not nearer to either end than the precision, so that the last step takes the zero between two ends.
            guess = low + (high - low) * at_low / (at_low - at_high)
            guess = min(max(guess, low + least), high - least)
        below, at_guess = characteristic(problem, variation, guess)
        if below > 0:
            high, at_high, inside = guess, at_guess, below
            at_low *= 0.5 if side > 0 else 1.0
            side = 1
        else:
            low, at_low = guess, at_guess
            at_high *= 0.5 if side < 0 else 1.0
            side = -1
    return 0.5 * (low + high)
