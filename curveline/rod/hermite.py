"""Quintic Hermite interpolation: meets values, slopes and second derivatives at both ends of an interval."""

from __future__ import annotations

from curveline.rod._jit import njit


@njit
def weights(t):
    """Weights at the fraction `t` of a unit interval: of both values, both slopes, both second derivatives.

    On an interval of length h the slopes are multiplied by h, the second derivatives by h^2.
    """
    t3 = t * t * t
    late = t3 * (10.0 - 15.0 * t + 6.0 * t * t)
    return (
        1.0 - late,
        late,
        t - t3 * (6.0 - 8.0 * t + 3.0 * t * t),
        -t3 * (4.0 - 7.0 * t + 3.0 * t * t),
        0.5 * t * t - t3 * (1.5 - 1.5 * t + 0.5 * t * t),
        t3 * (0.5 - t + 0.5 * t * t),
    )
