"""What windows say of the rod's place, smoothed as a rod is smooth; those that contradict their neighbours left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from curveline.units import mm

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

AMPLITUDE, SMOOTH = mm(0.5), mm(45.0)
"""How far a rod strays from its elastic curve, and over which length it does."""
LEAST_SIGMA = mm(0.06)
"""No window is surer of its place."""
OUTLIER = 3.5
"""Standard deviations that a window may be off."""
AT_LEAST = mm(0.25)
"""No window is left out that is off by less."""
ROUNDS = 6


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Places of the rod beside a line at windows along it, each (n,)."""

    off: Array  # [m]
    sigma: Array  # [m] standard error
    used: Flags  # whether a window has a say


def smoothed(places: Array, off: Array, sigma: Array, good: Flags) -> Smoothed:
    """Offsets `off (n,)` [m] with standard errors, at arc lengths `places`, smoothed; only `good` ones have a say."""
    noise = np.hypot(sigma, LEAST_SIGMA)
    apart = (places[:, None] - places[None, :]) / SMOOTH
    prior = AMPLITUDE**2 * np.exp(-0.5 * apart**2)
    # A common part, and a tilt, are no bend: the curve that the line is may be off by them.
    middle = (places - places.mean()) / max(np.ptp(places), SMOOTH)
    prior = prior + AMPLITUDE**2 * (1.0 + 4.0 * np.outer(middle, middle))
    used = good.copy()
    mean, spread = np.zeros(len(off)), np.full(len(off), AMPLITUDE)
    for _ in range(ROUNDS):
        if not used.any():
            break
        weight = _weights(off - mean, np.hypot(noise, spread)) if _ > 0 else np.ones(len(off))
        own = prior[np.ix_(used, used)] + np.diag(noise[used] ** 2 / np.maximum(weight[used], 1e-3))
        gain = np.linalg.solve(own, prior[used]).T
        mean = gain @ off[used]
        spread = np.sqrt(np.maximum(np.diag(prior) - np.sum(gain * prior[:, used], axis=1), 0.0))
        again = good & (np.abs(off - mean) < np.maximum(OUTLIER * np.hypot(noise, spread), AT_LEAST))
        if np.array_equal(again, used) and _ > 1:
            break
        used = again
    return Smoothed(mean, spread, used)


def _weights(off: Array, sigma: Array) -> Array:
    """Less for what is farther off than usual, by Huber."""
    far = np.abs(off) / (1.5 * sigma)
    weights: Array = 1.0 / np.maximum(far, 1.0)
    return weights
