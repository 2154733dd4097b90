"""The least that a planar rod can cost: Newton's method on its discrete equations and nothing else, compiled by numba.

The same equations as curveline's planar rod, n equal edges with half cells at the clamps, in units of the length and
EI, from the same guess, but without anything of curveline's: no line search, no stability, no error estimate, nothing
kept. Whoever certifies and extrapolates pays on top of this, and `curveline bench` says how much.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(error_model="numpy")
def newton(angles, force, chord, ends, weight):
    """Solve for `angles (n,)` and the end `force (2,)`, both overwritten; returns the iterations, -1 if they fail."""
    n = angles.size
    h = 1.0 / n
    pivots = np.empty(n)
    right = np.empty((3, n))
    for iteration in range(1, 31):
        s00 = s01 = s11 = r0 = r1 = 0.0
        gap_x, gap_y = -chord[0], -chord[1]
        previous = ends[0]
        joint = 2.0 / h
        a = b = c = 0.0
        pivot = 1.0
        for j in range(n):
            cosine, sine = np.cos(angles[j]), np.sin(angles[j])
            after = angles[j + 1] if j + 1 < n else ends[1]
            next_joint = 1.0 / h if j + 1 < n else 2.0 / h
            pull_x = h * force[0]
            pull_y = h * force[1] + weight * h * (1.0 - (j + 0.5) * h)
            gap_x += h * cosine
            gap_y += h * sine
            ratio = -joint / pivot if j > 0 else 0.0
            pivot = joint + next_joint - pull_x * cosine - pull_y * sine + ratio * joint
            slope = joint * (angles[j] - previous) - next_joint * (after - angles[j]) - pull_x * sine + pull_y * cosine
            a = slope - ratio * a
            b = -h * sine - ratio * b
            c = h * cosine - ratio * c
            pivots[j], right[0, j], right[1, j], right[2, j] = pivot, a, b, c
            s00 += b * b / pivot
            s01 += b * c / pivot
            s11 += c * c / pivot
            r0 += b * a / pivot
            r1 += c * a / pivot
            previous = angles[j]
            joint = next_joint
            if j == 0:
                joint = 1.0 / h
        determinant = s00 * s11 - s01 * s01
        x = (s11 * (gap_x - r0) - s01 * (gap_y - r1)) / determinant
        y = (s00 * (gap_y - r1) - s01 * (gap_x - r0)) / determinant
        largest = 0.0
        step = 0.0
        for j in range(n - 1, -1, -1):
            step = (-(right[0, j] + x * right[1, j] + y * right[2, j]) + (step / h if j + 1 < n else 0.0)) / pivots[j]
            angles[j] += step
            largest = max(largest, abs(step))
        force[0] += x
        force[1] += y
        if largest < 1e-7:
            return iteration
        if not largest < 1e3:
            return -1
    return -1


@njit(error_model="numpy")
def halve(angles, ends):
    """The same curve on edges cut in two, by linear interpolation."""
    n = angles.size
    fine = np.empty(2 * n)
    for j in range(n):
        before = angles[j - 1] if j > 0 else 2.0 * ends[0] - angles[0]
        after = angles[j + 1] if j + 1 < n else 2.0 * ends[1] - angles[n - 1]
        fine[2 * j] = 0.75 * angles[j] + 0.25 * before
        fine[2 * j + 1] = 0.75 * angles[j] + 0.25 * after
    return fine


@njit(error_model="numpy")
def solve(guess, chord, ends, weight, most):
    """Newton from `guess (n,)` on n edges, then on twice as many until `most`; returns the angles of the finest."""
    angles = guess.copy()
    force = np.zeros(2)
    iterations = newton(angles, force, chord, ends, weight)
    while 2 * angles.size <= most and iterations > 0:
        angles = halve(angles, ends)
        iterations = newton(angles, force, chord, ends, weight)
    return angles if iterations > 0 else np.empty(0)
