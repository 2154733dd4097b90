"""What windows say of the rod's place, smoothed as a rod is smooth; those that contradict their neighbours left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from curveline.units import mm

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

AMPLITUDE, SMOOTH = mm(0.2), mm(45.0)
"""How far a rod strays from its elastic curve, and over which length it does."""
FITTED, DEGREES = mm(0.4), 4
"""How far the elastic curve itself may be off, as each of so many polynomials."""
LEAST_SIGMA = mm(0.06)
"""No window is surer of its place."""
SHARED = 1.4
"""By how much less windows tell since what misleads one misleads the next."""
OUTLIER = 3.0
"""Standard deviations that a window may be off."""
AT_LEAST = mm(0.25)
"""No window is left out that is off by less."""
ROUNDS = 8
FAIR = 1.5
"""Standard deviations beyond which a window counts less."""


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Places of the rod beside a line at windows along it, each (n,)."""

    off: Array  # [m]
    sigma: Array  # [m] standard error
    used: Flags  # whether a window has a say


def smoothed(places: Array, off: Array, sigma: Array, good: Flags) -> Smoothed:
    """Offsets `off (n,)` [m] with standard errors, at arc lengths `places`, smoothed; only `good` ones have a say."""
    own = SHARED * np.hypot(sigma, LEAST_SIGMA)
    prior = _prior(places)
    noise, used = own, good.copy()
    mean, spread = np.zeros(len(off)), np.sqrt(np.diag(prior))
    for number in range(ROUNDS):
        if not used.any():
            break
        far = np.abs(off - mean) / np.hypot(noise, spread)
        weight = 1.0 / np.maximum(far / FAIR, 1.0) if number > 0 else np.ones(len(off))
        matrix = prior[np.ix_(used, used)] + np.diag(noise[used] ** 2 / weight[used])
        gain = np.linalg.solve(matrix, prior[used]).T
        mean = gain @ off[used]
        spread = np.sqrt(np.maximum(np.diag(prior) - np.sum(gain * prior[:, used], axis=1), 0.0))
        noise = own * _more(off[used] - mean[used], own[used])
        again = good & (np.abs(off - mean) < np.maximum(OUTLIER * np.hypot(noise, spread), AT_LEAST))
        if np.array_equal(again, used) and number > 1:
            break
        used = again
    return Smoothed(mean, spread, used)


def _prior(places: Array) -> Array:
    """How the offsets of a rod from its elastic curve go together (n, n) [m^2], before any is seen."""
    apart = (places[:, None] - places[None, :]) / SMOOTH
    middle = 2.0 * (places - places.mean()) / max(float(np.ptp(places)), SMOOTH)
    table = np.polynomial.legendre.legvander(middle, DEGREES - 1)
    prior: Array = AMPLITUDE**2 * np.exp(-0.5 * apart**2) + FITTED**2 * table @ table.T
    return prior


def _more(off: Array, sigma: Array) -> float:
    """By how much windows scatter more than they say."""
    return max(1.0, 1.4826 * float(np.median(np.abs(off) / sigma)))
