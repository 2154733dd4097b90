"""Kernel for the guesses that the search starts from: arches on either side that meet both clamps and the chord.

Along the rod, s from 0 to 1, the angle is the clamps' own, plus a wave and half a wave:

    phi(s) = start + (end - start) s + a sin(2 pi s) + b sin(pi s)

The wave bends the rod to one side, by 1 - J0(a), about a^2 / 4, of its length; half a wave turns it towards the other
clamp. Newton finds both amplitudes. This takes a small part of the time of the paper's spline, see `spline`, and
leads the search to the same states.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.kernel import leaf
from curveline.rod.problem import COSINE, GRADIENT, SINE, STEP
from curveline.rod.trigonometry import sines_and_cosines

ITERATIONS = 8
LONGEST = 0.5
"""Largest change of an amplitude in an iteration [rad]."""
CLOSE = 1e-3


@leaf
def arch(problem, side, phi):
    """Lay the rod in an arch to the left of its chord for a `side` of 1, to the right for -1: overwrites `phi (n,)`.

    Where no amplitudes meet the chord, with those that Newton came to.
    """
    edges, targets, start, end = problem.edges, problem.targets, problem.ends[0], problem.ends[1]
    room = problem.room
    chord_x, chord_y = targets[0], targets[1]
    wave, half_wave = room[STEP], room[GRADIENT]
    at = 0.0
    for j in range(phi.size):
        phi[j] = np.pi * (at + 0.5 * edges[j])
        at += edges[j]
    sines_and_cosines(phi, half_wave, wave)
    for j in range(phi.size):
        wave[j] *= 2.0 * half_wave[j]
    excess = max(1.0 - np.hypot(chord_x, chord_y), 1e-6)
    turned = np.arctan2(chord_y, chord_x) - 0.5 * (start + end)
    turned -= 2.0 * np.pi * np.round(turned / (2.0 * np.pi))
    a, b = side * 2.0 * np.sqrt(excess), 0.5 * np.pi * turned
    for _ in range(ITERATIONS):
        lay(problem, a, b, phi)
        sines_and_cosines(phi, room[SINE], room[COSINE])
        x, y, xa, xb, ya, yb = -chord_x, -chord_y, 0.0, 0.0, 0.0, 0.0
        for j in range(phi.size):
            right, up = edges[j] * room[COSINE, j], edges[j] * room[SINE, j]
            x += right
            y += up
            xa -= up * wave[j]
            xb -= up * half_wave[j]
            ya += right * wave[j]
            yb += right * half_wave[j]
        determinant = xa * yb - xb * ya
        if abs(determinant) < 1e-9:
            return
        by_a, by_b = (xb * y - yb * x) / determinant, (ya * x - xa * y) / determinant
        largest = max(abs(by_a), abs(by_b))
        if not largest > CLOSE:
            return
        scale = min(1.0, LONGEST / largest)
        a += scale * by_a
        b += scale * by_b
    lay(problem, a, b, phi)


@leaf
def lay(problem, a, b, phi):
    """Overwrite `phi (n,)` with the angles for the amplitudes `a` and `b`, from the waves in the problem's room."""
    start, end = problem.ends[0], problem.ends[1]
    at = 0.0
    for j in range(phi.size):
        middle = at + 0.5 * problem.edges[j]
        phi[j] = start + (end - start) * middle + a * problem.room[STEP, j] + b * problem.room[GRADIENT, j]
        at += problem.edges[j]
