"""The set of a rod from strips that were held on a drum and let go: strength and exponent of a power law, with errors.

Least squares of the curvatures that were read, and intervals from the profile of the sum of squares: what keeps it
within t^2 times the variance of one reading, the other number being fitted anew (Bates and Watts, Nonlinear Regression
Analysis, 1988, section 6.1). Of a power of time, a strength and a scale of time are the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from curveline._version import __version__
from curveline.errors import Infeasible, InvalidInput
from curveline.material.drum_readings import DrumReading
from curveline.material.relaxation import (
    ACETAL_EXPONENT,
    LEAST_EXPONENT,
    LEAST_STRENGTH,
    MOST_EXPONENT,
    MOST_STRENGTH,
    Relaxation,
    power_law,
    speed_up,
)
from curveline.phrases import counted

Array = npt.NDArray[np.float64]
Interval = tuple[float, float]

T_975 = (12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26, 2.23)
"""Student's t for 95 %, either way, of 1 to 10 degrees of freedom; beyond, 1.96 + 2.7 / n is that to 0.01."""
BEST_READING = 1e-3
"""No curvature is read better than to this part of the largest one, however well they agree."""
LEAST_READINGS = 3
"""One more than there are numbers to find."""
TOLD = 0.2
"""An exponent whose interval is wider was not told by the readings, and is left at the estimate for acetal."""
POOR = 0.1
"""Of the largest curvature: readings that are off by more on average follow another law."""
GRID = 24
"""Points of a first look for the least of a function."""
DIGITS = 4
SIZES = (math.log(LEAST_STRENGTH), math.log(MOST_STRENGTH))
"""Ends of the logarithm of a strength."""


@dataclass(frozen=True)
class SetFit:
    """The power law that fits readings best, and how far each of its numbers may be off, at 95 %.

    An end of an interval is that of the range looked at where the readings do not tell; either interval is for any
    value of the other number. Where `is_exponent_told` is False the exponent is that of acetal, or the
    nearest to it that fits.
    """

    readings: tuple[DrumReading, ...]  # what was fitted
    strength: float  # creep within an hour over that of acetal
    strength_interval: Interval  # lowest and highest that fit
    exponent: float  # power of time by which creep goes on
    exponent_interval: Interval  # lowest and highest that fit
    is_exponent_told: bool  # by the readings
    fitted: tuple[float, ...]  # [1/m] of the law, for every reading

    @property
    def law(self) -> Relaxation:
        """The law, at the reference temperature."""
        return power_law(self.strength, self.exponent)

    @property
    def rms(self) -> float:
        """By how much [1/m] readings are off the law: the root of the mean square."""
        off = [each.curvature - fitted for each, fitted in zip(self.readings, self.fitted, strict=True)]
        return math.sqrt(math.fsum(each * each for each in off) / len(off))

    @property
    def is_poor(self) -> bool:
        """True if the readings follow another law."""
        return self.rms > POOR * max(abs(each.curvature) for each in self.readings)

    @property
    def keys(self) -> dict[str, float]:
        """What to write into `[rod]` of a display file."""
        rounded = {"set_strength": float(f"{self.strength:.{DIGITS}g}")}
        if self.exponent == ACETAL_EXPONENT:
            return rounded
        return {**rounded, "set_exponent": float(f"{self.exponent:.{DIGITS}g}")}

    def document(self) -> dict[str, Any]:
        """All of it as plain data."""
        return {
            "curveline": __version__,
            "rod": self.keys,
            "set_strength": self.strength,
            "set_strength_95": list(self.strength_interval),
            "set_exponent": self.exponent,
            "set_exponent_95": list(self.exponent_interval),
            "is_exponent_told": self.is_exponent_told,
            "rms_per_m": self.rms,
            "is_poor": self.is_poor,
            "readings": [
                {
                    "drum_curvature_per_m": each.bend,
                    "held_s": each.held,
                    "after_s": each.after,
                    "temperature_C": each.temperature,
                    "curvature_per_m": each.curvature,
                    "fitted_per_m": fitted,
                }
                for each, fitted in zip(self.readings, self.fitted, strict=True)
            ],
        }


def fit_set(readings: Sequence[DrumReading]) -> SetFit:
    """The power law that fits readings of strips best.

    InvalidInput for fewer than three of them, Infeasible for strips that took no set, or more than any does.
    """
    if len(readings) < LEAST_READINGS:
        hint = "read the strip several times after it was let go, from a minute to as long as it was held"
        raise InvalidInput(f"{counted(len(readings), 'reading')} cannot tell a law and how good it is", hint)
    fit = _Fit(readings)
    strength = fit.strength_at(ACETAL_EXPONENT)
    ends = (LEAST_STRENGTH, MOST_STRENGTH)
    if not 1.01 * ends[0] < strength < 0.99 * ends[1]:
        how = "no set that could be measured" if strength < 1.0 else "a larger set than any law here gives"
        hint = "is the curvature positive as on the drum, and in 1/m or mm as its column says?"
        raise Infeasible(f"the strips took {how}", hint)
    exponents = _interval(fit.profile, fit.exponent, (LEAST_EXPONENT, MOST_EXPONENT), fit.allowed)
    is_told = exponents[1] - exponents[0] <= TOLD
    exponent = fit.exponent if is_told else min(max(ACETAL_EXPONENT, exponents[0]), exponents[1])
    return fit.result(exponent, exponents, is_told=is_told)


class _Fit:
    """Readings as arrays, and the sum of squares of a law."""

    def __init__(self, readings: Sequence[DrumReading]) -> None:
        self.readings = tuple(readings)
        fast = np.array([speed_up(each.temperature) for each in readings])
        self._bends = np.array([each.bend for each in readings])
        self._held = fast * np.array([each.held for each in readings])
        self._after = fast * np.array([each.after for each in readings])
        self._read = np.array([each.curvature for each in readings])
        self.exponent = _least(self.profile, (LEAST_EXPONENT, MOST_EXPONENT))
        least, freedom = self.profile(self.exponent), len(readings) - 2
        variance = max(least / freedom, float(BEST_READING * np.max(np.abs(self._read))) ** 2)
        t = T_975[freedom - 1] if freedom <= len(T_975) else 1.96 + 2.7 / freedom
        self.allowed = least + t * t * variance

    def predicted(self, strength: float, exponent: float) -> Array:
        """Curvatures (readings,) [1/m] by a power law: held on the drum, then free."""
        law = power_law(strength, exponent)
        return drum_curvatures(law, self._bends, self._held, self._after)

    def squares(self, strength: float, exponent: float) -> float:
        off = self.predicted(strength, exponent) - self._read
        return float(off @ off)

    def strength_at(self, exponent: float) -> float:
        """The strength that fits best with an exponent."""
        return _strength(_least(lambda size: self.squares(_strength(size), exponent), SIZES))

    def profile(self, exponent: float) -> float:
        return self.squares(self.strength_at(exponent), exponent)

    def result(self, exponent: float, exponents: Interval, *, is_told: bool) -> SetFit:
        """The fit with an exponent, which may be off by an interval."""
        strength = self.strength_at(exponent)

        def squares(size: float) -> float:
            power = _least(lambda power: self.squares(_strength(size), power), exponents)
            return self.squares(_strength(size), power)

        low, high = _interval(squares, math.log(strength), SIZES, self.allowed)
        fitted = tuple(map(float, self.predicted(strength, exponent)))
        return SetFit(self.readings, strength, (_strength(low), _strength(high)), exponent, exponents, is_told, fitted)


def drum_curvatures(law: Relaxation, bends: Array, held: Array, after: Array) -> Array:
    """Curvatures (n,) [1/m] of strips that were bent by `bends` (n,) for so long, and then free for so long [s].

    Times are those at the reference temperature.
    """
    times, fractions = np.asarray(law.times), np.asarray(law.fractions)
    root, unit = np.sqrt(fractions / times), np.sqrt(fractions * times)
    rates, vectors = np.linalg.eigh(np.outer(root, root) - np.diag(1.0 / times))
    taken = -np.expm1(-held[:, None] / times) * unit
    parts = (taken @ vectors) * np.exp(np.outer(after, rates)) @ (vectors.T @ (fractions / unit))
    return np.asarray(bends * parts)


def _strength(size: float) -> float:
    """The strength of a logarithm, within its ends whatever the rounding."""
    return min(max(math.exp(size), LEAST_STRENGTH), MOST_STRENGTH)


def _least(function: Callable[[float], float], ends: Interval) -> float:
    """Where a function is least between two ends: a look at a grid, then the golden section about its least."""
    grid = np.linspace(*ends, GRID)
    best = int(np.argmin([function(float(each)) for each in grid]))
    low, high = float(grid[max(best - 1, 0)]), float(grid[min(best + 1, GRID - 1)])
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    inner = [high - golden * (high - low), low + golden * (high - low)]
    values = [function(each) for each in inner]
    while high - low > 1e-6 * (ends[1] - ends[0]):
        if values[0] < values[1]:
            high, inner[1], values[1] = inner[1], inner[0], values[0]
            inner[0] = high - golden * (high - low)
            values[0] = function(inner[0])
        else:
            low, inner[0], values[0] = inner[0], inner[1], values[1]
            inner[1] = low + golden * (high - low)
            values[1] = function(inner[1])
    return 0.5 * (low + high)


def _interval(function: Callable[[float], float], best: float, ends: Interval, allowed: float) -> Interval:
    """From where to where about the `best` argument a function stays below what is allowed; its ends if it does."""
    low, high = (_crossing(function, best, end, allowed) for end in ends)
    return low, high


def _crossing(function: Callable[[float], float], inside: float, outside: float, allowed: float) -> float:
    if function(outside) <= allowed:
        return outside
    close = 1e-3 * abs(outside - inside)
    while abs(outside - inside) > close:
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if function(middle) <= allowed else (inside, middle)
    return 0.5 * (inside + outside)
