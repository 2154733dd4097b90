"""Kernels for a dip: where, along a sweep over the mean height, the slope of the energy nears zero and turns round.

Where it crosses zero a pair of states exists, a stable one and a saddle, which were born at a fold nearby. The fold of
a coarse rod lies elsewhere by the square of its edges, so that the bottom of the dip is found on several resolutions:
its slope converges with that square, too, and its limit tells whether the continuous rod has the pair.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.kernel import leaf, njit
from curveline.rod.planar.newton import Effort, lean, newton
from curveline.rod.planar.sweep import BARELY, CERTIFY, RIDGE, is_ridge, keep
from curveline.rod.problem import largest_change, released

HOLD = Effort(turn=0.3, close=1e-7, iterations=15)
TRIES = 24
SAME_PLACE = 0.1
"""Turn of an edge [rad] from which on the rod, let go where nothing pulls at it, has gone to another state."""
FLAT = 1e-3
"""What the slope may still fall, as a part of itself, below what is taken for the bottom."""


@njit
def hold_at(problem, height, phi, multipliers):
    """Newton with the mean height held; False if that leads to no constrained minimum, nor to a ridge.

    `phi (n,)`, `multipliers (3,)` are overwritten; the last multiplier is the slope of the energy, downhill.
    """
    problem.targets[2] = height
    iterations, unstable = newton(problem, phi, multipliers, HOLD)
    return iterations > 0 and (unstable == 0 or (unstable == 1 and is_ridge(problem, phi, multipliers, RIDGE)))


@leaf
def moved_on(phi, multipliers, lead, by):
    """Follow the `lean` for a change of height, in place."""
    for j in range(phi.size):
        phi[j] += by * lead[0][j]
    for a in range(multipliers.size):
        multipliers[a] += by * lead[1][a]


@njit
def bottom(problem, heights, phi, multipliers, sign):
    """Go to the bottom of a dip between the first and the last of three `heights`, from the middle one.

    `sign` is that of the slope beside the dip. Where the slope's derivative by the height vanishes, by the Illinois
    method. `phi (n,)`, `multipliers (3,)` are overwritten; returns the height there and the slope's second derivative,
    which is 0 if there is no bottom.
    """
    low, high = min(heights[0], heights[2]), max(heights[0], heights[2])
    at_low, at_high = np.nan, np.nan
    here = heights[1]
    side = 0
    last, last_gain = np.nan, np.nan
    for _ in range(TRIES):
        if not hold_at(problem, here, phi, multipliers):
            return here, 0.0
        lead = lean(problem, phi, multipliers)
        gain = sign * lead[1][2]
        bend = (gain - last_gain) / (here - last)
        last, last_gain = here, gain
        if gain > 0.0:
            high, at_high = here, gain
            at_low *= 0.5 if side > 0 else 1.0
            side = 1
        else:
            low, at_low = here, gain
            at_high *= 0.5 if side < 0 else 1.0
            side = -1
        following = 0.5 * (low + high)
        if np.isfinite(at_low) and np.isfinite(at_high):
            if bend > 0.0 and (0.5 * gain * gain / bend < FLAT * abs(multipliers[2]) or high - low < 1e-9):
                return here, bend if is_ridge(problem, phi, multipliers, BARELY) else 0.0
            following = low - at_low * (high - low) / (at_high - at_low)
        elif high - low < 1e-6:
            return here, 0.0
        moved_on(phi, multipliers, lead, following - here)
        here = following
    return here, 0.0


@njit
def bottom_near(problem, dip, phi, multipliers, sign):
    """The bottom on another resolution near that of a `dip`, (height, second derivative): the height and the slope.

    By Newton on the slope's derivative; NaN where that is lost. Overwrites `phi (n,)`, `multipliers (3,)`.
    """
    here, bend = dip
    for _ in range(TRIES):
        if not hold_at(problem, here, phi, multipliers):
            return here, np.nan
        lead = lean(problem, phi, multipliers)
        gain = sign * lead[1][2]
        if 0.5 * gain * gain / bend < FLAT * abs(multipliers[2]):
            return here, multipliers[2]
        moved_on(phi, multipliers, lead, -gain / bend)
        here -= gain / bend
    return here, np.nan


@njit
def let_go(problem, dip, phi, multipliers, sign, found):
    """Keep the stable one of the pair of states beside the bottom of a `dip` that crosses zero: release the rod there.

    It lies where the energy has a minimum over the heights: below the bottom if the `sign` is 1, else above. Newton on
    the slope. Overwrites `phi (n,)`, `multipliers (3,)`; returns False if the way is lost.
    """
    here, bend = dip
    lead = lean(problem, phi, multipliers)
    by = -sign * np.sqrt(2.0 * abs(multipliers[2]) / bend)
    free = released(problem)
    for _ in range(TRIES):
        moved_on(phi, multipliers, lead, by)
        here += by
        if not hold_at(problem, here, phi, multipliers):
            return False
        lead = lean(problem, phi, multipliers)
        if lead[1][2] >= 0.0:
            by = -sign * abs(0.5 * by)
            continue
        by = -multipliers[2] / lead[1][2]
        if abs(by) < 1e-4 * abs(here - dip[0]) or abs(multipliers[2]) < 1e-9:
            break
    angles, force = phi.copy(), multipliers[:2].copy()
    iterations, unstable = newton(free, angles, force, CERTIFY)
    if iterations < 0 or largest_change(angles, phi) > SAME_PLACE:
        return False
    keep(problem, found, angles, force, unstable)
    return True
