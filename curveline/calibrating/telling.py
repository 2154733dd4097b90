"""Fitted numbers as estimates: their intervals, whether they are told, and what they are mixed with if not.

What is told is what an interval is short enough for. Of two numbers that are not told, the one that makes up for the
other stands for what these shapes cannot tell apart.
"""

from __future__ import annotations

import math

import numpy as np

from curveline.calibrating.calibrated import NAMES, Estimate
from curveline.calibrating.descent import Fitted
from curveline.calibrating.intervals import Uncertainty
from curveline.calibrating.unknowns import ANGLE, ASYMMETRY, GIVE, LENGTH, SCALE, SHIFT_X, SHIFT_Y, TURN, WEIGHT
from curveline.trial import Array
from curveline.units import deg, mm

GOOD = {
    WEIGHT: 0.45,
    GIVE: mm(2.0),
    ASYMMETRY: 0.05,
    ANGLE: deg(0.7),
    LENGTH: mm(1.2),
    SHIFT_X: mm(1.0),
    SHIFT_Y: mm(1.0),
    TURN: deg(0.2),
    SCALE: 0.005,
}
"""What a number may be off, either way, and is told: in SI; of the weight over the stiffness as a part of it, which is
15 % of the gravity length."""
MIXED = 0.8
"""Correlation from which on two numbers are mixed."""


def estimates_of(fit: Fitted, uncertainty: Uncertainty) -> tuple[Estimate, ...]:
    """All free numbers as estimates."""
    unknowns = fit.sought.unknowns
    free = np.flatnonzero(fit.sought.free)
    alike = correlations(np.asarray(np.linalg.inv(uncertainty.matrix), dtype=np.float64))
    estimates = []
    for place, number in enumerate(free.tolist()):
        unknown, value, reach = unknowns.all[number], float(fit.numbers[number]), float(uncertainty.reach[place])
        is_told = reach <= good_of(unknown.kind, value)
        low, high, shown = value - reach, value + reach, value
        if unknown.kind == WEIGHT:
            shown, low, high = (gravity_length(each) for each in (value, high, low))
        elif unknown.kind == GIVE:
            low = max(low, 0.0)
        mixed = "" if is_told else _mixed_with(alike[place], [unknowns.all[each] for each in free.tolist()], place)
        estimates.append(Estimate(unknown.kind, unknown.number, shown, low, high, is_told, mixed))
    return tuple(estimates)


def good_of(kind: str, value: float) -> float:
    """What a number may be off to be told, in SI."""
    return GOOD[kind] * abs(value) if kind == WEIGHT else GOOD[kind]


def gravity_length(weight: float) -> float:
    """(EI / w)^(1/3) [m] of a weight over stiffness [1/m^3]; infinite for none."""
    return weight ** (-1.0 / 3.0) if weight > 0.0 else math.inf


def correlations(covariance: Array) -> Array:
    """Correlations (p, p) of a covariance."""
    size = np.sqrt(np.diag(covariance))
    alike: Array = covariance / np.outer(size, size)
    return alike


def _mixed_with(alike: Array, unknowns: list[tuple[str, int]], place: int) -> str:
    others = np.abs(alike)
    others[place] = 0.0
    nearest = int(np.argmax(others))
    kind, number = unknowns[nearest]
    return NAMES[kind].format(number + 1) if others[nearest] >= MIXED else ""
