"""Kernels for sines and cosines of many angles at once and for slight angles, alike on all systems, and faster.

An angle is reduced by a multiple of pi that is subtracted in three parts (Cody and Waite 1980), the first two short
enough for their products to be exact. Polynomials follow, for up to pi/2, that meet both functions at the Chebyshev
points of the square. No step is a branch or a call, so that two angles or more go through a processor abreast. The
error is below 4e-16 for angles up to a million.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.kernel import leaf

FIRST, SECOND, THIRD = 3.141592651605606, 1.9841871583270443e-09, 1.034036596358821e-18
"""Parts of pi, the first two of 30 and 31 bits."""
ROUND = 1.5 * 2.0**52
"""What rounds a number to a whole one when it is added and subtracted again."""

S0, S1, S2, S3 = -0.16666666666666666, 0.008333333333333333, -0.00019841269841269806, 2.7557319223971175e-06
S4, S5, S6, S7 = -2.505210838237619e-08, 1.605904347799452e-10, -7.647139048550473e-13, 2.810466816590253e-15
S8 = -8.005858059980551e-18
"""Of sin(x) = x + x^3 (S0 + S1 x^2 + ...)."""
C0, C1, C2, C3 = 0.041666666666666664, -0.001388888888888889, 2.4801587301587285e-05, -2.755731922397919e-07
C4, C5, C6, C7 = 2.0876756986472233e-09, -1.1470745434350532e-11, 4.779466094856132e-14, -1.561469859038243e-16
C8 = 4.0125876448335246e-19
"""Of cos(x) = 1 - x^2 / 2 + x^4 (C0 + C1 x^2 + ...)."""

SLIGHT = 0.25
"""Tangent up to which an angle is the sum of a few powers of it."""
T0, T1, T2, T3 = -0.33333333333333304, 0.19999999999938586, -0.14285714265033303, 0.11111108452369065
T4, T5, T6, T7 = -0.09090740742952762, 0.07686491336172022, -0.06554306272128751, 0.04726258246837694
"""Of arctan(x) = x + x^3 (T0 + T1 x^2 + ...), up to `SLIGHT`."""


@leaf
def arc_tangent(y, x):
    """Angle [rad] of the point (x, y) from the first axis; without a call if it is slight, which it mostly is."""
    if abs(y) > SLIGHT * x:
        return np.arctan2(y, x)
    ratio = y / x
    z = ratio * ratio
    w = z * z
    powers = (T0 + z * T1) + w * ((T2 + z * T3) + w * ((T4 + z * T5) + w * (T6 + z * T7)))
    return ratio + ratio * z * powers


@leaf
def sines_and_cosines(angles, sines, cosines):
    """Overwrite `sines (n,)` and `cosines (n,)` with those of `angles (n,)` [rad]; NaN for what is not finite."""
    for j in range(angles.size):
        halves = angles[j] * (1.0 / np.pi) + ROUND - ROUND
        rest = ((angles[j] - halves * FIRST) - halves * SECOND) - halves * THIRD
        odd = halves - 2.0 * (halves * 0.5 + ROUND - ROUND)
        sign = 1.0 - 2.0 * odd * odd
        z = rest * rest
        w = z * z
        upper = (S4 + z * S5 + w * (S6 + z * S7)) + w * w * S8
        sine = rest + rest * z * ((S0 + z * S1 + w * (S2 + z * S3)) + w * w * upper)
        upper = (C4 + z * C5 + w * (C6 + z * C7)) + w * w * C8
        cosine = (1.0 - 0.5 * z) + w * ((C0 + z * C1 + w * (C2 + z * C3)) + w * w * upper)
        sines[j] = sign * sine
        cosines[j] = sign * cosine
