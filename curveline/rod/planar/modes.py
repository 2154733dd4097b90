"""Kernels for the second variation of the planar rod under its constraints: its inertia and its lowest eigenvalue."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.kernels.kernel import leaf, njit
from curveline.rod.planar.clamps import link
from curveline.rod.planar.newton import TINY, border_of
from curveline.rod.problem import COSINE, REACH, SINE, coefficients, gives
from curveline.rod.trigonometry import sines_and_cosines

FIRST_WIDTH = 40.0
"""Where the lowest eigenvalue of most rods lies, from 0 on: that of a straight one is 4 pi^2."""
NEARBY = 0.03
"""Share of itself by which an eigenvalue changes when edges are halved, or less."""
FARTHEST = 1e16
"""Eigenvalue beyond which none is sought."""
LARGEST = 1e290
"""Product of two values of the characteristic polynomial from which on one of them may have overflown."""


@njit
def second_variation(problem, phi, multipliers):
    """Hessian of the Lagrangian at an equilibrium with the strains eliminated.

    Its `diagonal (n,)`, the constraints' `border (k, n)` and how far they yield by stretching, `corner (k, k)`.
    """
    edges, stiffness, height, compliance = problem.edges, problem.stiffness, problem.height, problem.compliance
    n, k = phi.size, multipliers.size
    diagonal, border, corner = np.empty(n), np.empty((k, n)), np.zeros((k, k))
    reach = np.empty(k)
    sines_and_cosines(phi, problem.room[SINE], problem.room[COSINE])
    for j in range(n):
        sine, cosine = problem.room[SINE, j], problem.room[COSINE, j]
        along, across = coefficients(problem, multipliers, j)
        thrust, turning = along * cosine + across * sine, across * cosine - along * sine
        give = compliance[j]
        stretch = 1.0 - give * thrust
        diagonal[j] = stiffness[j] + stiffness[j + 1] - thrust * stretch - give * turning * turning
        reach[0], reach[1] = edges[j] * cosine, edges[j] * sine
        border[0, j] = -reach[1] * stretch - give * turning * reach[0]
        border[1, j] = reach[0] * stretch - give * turning * reach[1]
        if k == 3:
            reach[2] = height[0, j] * cosine + height[1, j] * sine
            border[2, j] = (height[1, j] * cosine - height[0, j] * sine) * stretch - give * turning * reach[2]
        if give > 0.0:
            for a in range(k):
                for b in range(k):
                    corner[a, b] += give * reach[a] * reach[b]
    if gives(problem):
        for side in range(2):
            angle, give = link(problem, phi, multipliers, side)
            j, rate = side * (n - 1), stiffness[side * n]
            reach[0], reach[1] = -problem.clamps[REACH] * np.sin(angle), problem.clamps[REACH] * np.cos(angle)
            diagonal[j] -= give * rate * rate
            for a in range(2):
                border[a, j] += give * rate * reach[a]
                for b in range(2):
                    corner[a, b] += give * reach[a] * reach[b]
    return diagonal, border, corner


@leaf
def characteristic(problem, variation, value):
    """Number of eigenvalues of the constrained `second_variation` below `value`, and its characteristic polynomial.

    The polynomial is the determinant of the bordered matrix, which has no poles, in units that keep it from overflow;
    it changes sign at each eigenvalue.
    """
    diagonal, border, corner = variation
    edges, stiffness = problem.edges, problem.stiffness
    is_high = border.shape[0] == 3
    xx, xy, yy = corner[0, 0], corner[0, 1], corner[1, 1]
    xh, yh, hh = (corner[0, 2], corner[1, 2], corner[2, 2]) if is_high else (0.0, 0.0, 1.0)
    forward_x = forward_y = forward_h = 0.0
    below = 0
    inverse = 0.0
    product = 1.0
    for j in range(diagonal.size):
        ratio = -stiffness[j] * inverse
        pivot = diagonal[j] - value * edges[j] + ratio * stiffness[j]
        if abs(pivot) < TINY:
            pivot = TINY
        if pivot < 0.0:
            below += 1
        product *= pivot * edges[j]
        # One division an edge: they are what this loop spends its time on.
        inverse = 1.0 / pivot
        forward_x = border[0, j] - ratio * forward_x
        forward_y = border[1, j] - ratio * forward_y
        by_x, by_y = forward_x * inverse, forward_y * inverse
        xx += by_x * forward_x
        xy += by_y * forward_x
        yy += by_y * forward_y
        if is_high:
            forward_h = border[2, j] - ratio * forward_h
            by_h = forward_h * inverse
            xh += by_h * forward_x
            yh += by_h * forward_y
            hh += by_h * forward_h
    wrong, determinant, _ = border_of(problem, (xx, xy, yy, xh, yh, hh))
    return below - wrong, product * determinant


@leaf
def modes_below(problem, variation, value):
    """Number of eigenvalues of the constrained `second_variation` that are smaller than `value`."""
    return characteristic(problem, variation, value)[0]


class Bracket(NamedTuple):
    """Where the lowest eigenvalue is sought: between `low` and `high`, with the polynomial there, NaN if not asked yet.

    `inside` counts the eigenvalues below `high`; `side` is the end that was moved last, `width` the next step outwards.
    """

    low: float
    at_low: float
    high: float
    at_high: float
    inside: float
    side: float
    width: float


@leaf
def from_zero():
    """The bracket in which the lowest eigenvalue is first sought."""
    return Bracket(0.0, np.nan, FIRST_WIDTH, np.nan, 0.0, 0.0, FIRST_WIDTH)


@leaf
def around(guess):
    """The bracket in which an eigenvalue is first sought that was `guess` on coarser edges."""
    width = max(NEARBY * abs(guess), 0.1)
    return Bracket(guess - width, np.nan, guess + width, np.nan, 0.0, 0.0, 2.0 * width)


@leaf
def is_narrow(bracket, precision):
    """True if the eigenvalue is known to a relative `precision`, or lies beyond all bounds."""
    if bracket.inside == 0.0 or np.isnan(bracket.at_low):
        return bracket.low < -FARTHEST or bracket.high > FARTHEST
    return bracket.high - bracket.low <= precision * max(abs(bracket.high), abs(bracket.low), 1e-3)


@leaf
def middle_of(bracket):
    """What the eigenvalue of a narrow bracket is."""
    return 0.5 * (bracket.low + bracket.high)


@leaf
def next_value(bracket, precision):
    """Where to ask next: at an end, at the polynomial's zero by the Illinois method, or in the middle.

    That is while two eigenvalues are in the bracket or the polynomial leaves the range of floating point.
    """
    low, at_low, high, at_high, inside, _, _ = bracket
    if np.isnan(at_low):
        return low
    if inside == 0.0:
        return high
    if inside > 1.0 or not -LARGEST < at_low * at_high < 0.0:
        return 0.5 * (low + high)
    # Not nearer to either end than the precision, so that the last step takes the zero between two ends.
    least = 0.4 * precision * max(abs(high), abs(low), 1e-3)
    return min(max(low + (high - low) * at_low / (at_low - at_high), low + least), high - least)


@leaf
def narrowed(bracket, value, below, at_value):
    """The bracket after the answer at the `value`: how many eigenvalues are `below` it (Sylvester), the polynomial."""
    low, at_low, high, at_high, inside, side, width = bracket
    if np.isnan(at_low) and below > 0:
        return Bracket(value - width, np.nan, value, at_value, float(below), 0.0, 2.0 * width)
    if np.isnan(at_low):
        return Bracket(value, at_value, high, at_high, inside, 0.0, width)
    if inside == 0.0 and below == 0:
        return Bracket(value, at_value, value + width, np.nan, 0.0, 0.0, 2.0 * width)
    if below > 0:
        at_low *= 0.5 if side > 0.0 else 1.0
        return Bracket(low, at_low, value, at_value, float(below), 1.0, width)
    at_high *= 0.5 if side < 0.0 else 1.0
    return Bracket(value, at_value, high, at_high, inside, -1.0, width)


@njit
def lowest_eigenvalue(problem, phi, multipliers, bracket, precision):
    """Smallest eigenvalue of the second variation under the constraints, to a relative `precision`.

    Normalised by the L2 norm of the angles' change, in units of EI / L^2 with L the free length. It is first sought in
    the `bracket`, `from_zero` or `around` a guess.
    """
    variation = second_variation(problem, phi, multipliers)
    while not is_narrow(bracket, precision):
        value = next_value(bracket, precision)
        below, at_value = characteristic(problem, variation, value)
        bracket = narrowed(bracket, value, below, at_value)
    return middle_of(bracket)
