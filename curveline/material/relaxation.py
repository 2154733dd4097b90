"""Linear viscoelastic bending: how much of a bend that is held the rod takes for its natural one, and how soon.

    moment / EI = bend - sum_k fraction_k memory_k,    d memory_k / dt = (bend - memory_k) / time_k,

bend being the curvature away from that of the rod as it was made: a Prony series of the relaxation modulus, or
generalised Maxwell solid (Christensen, Theory of Viscoelasticity, 1982, chapter 1). EI is that of a bend of about a
second, the least that the series resolves. The sum is the rod's *set*: the natural curvature that it has besides.

The built-in numbers are estimates from data sheets of acetal: see `ACETAL_CREEP` and `ACTIVATION_ENERGY`. A strip bent
around a drum tells those of a rod: see `material.drum_fit`. Pure Python: scenes carry this law, also where numpy is
not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

from curveline.errors import InvalidInput
from curveline.units import GAS_CONSTANT, HOUR, kelvin

FLEXURAL_GPA, AFTER_1_HOUR_GPA, AFTER_1000_HOURS_GPA = 2.43, 2.10, 1.10
"""Modulus of acetal copolymer in a test of seconds, and creep modulus: data sheet of Celcon M25, the grade of racks.

Hostaform C 9021 and C 27021 (ISO 899-1) say 2.85 and 2.90, 2.5, 1.3; Delrin 500T, a toughened homopolymer, 2.3, 2.3,
1.2. So creep falls by the same factor 1.9 from an hour to 1000 in all of them, the exponent below is 0.295 to 0.31, and
`ACETAL_CREEP` 0.14 to 0.16, but for the last, where the short test is not told from an hour. A modulus from another
machine is off by 5 %, which makes 0.1 to 0.2 of it: take a third either way.
"""
ACETAL_CREEP = FLEXURAL_GPA / AFTER_1_HOUR_GPA - 1.0
"""What a bend under a constant moment grows by within an hour, as a fraction of the first bend: an estimate."""
ACETAL_EXPONENT = math.log10((FLEXURAL_GPA / AFTER_1000_HOURS_GPA - 1.0) / ACETAL_CREEP) / 3.0
"""Of the power of time by which it goes on: creep from one hour to 1000, which are three decades. An estimate."""
ACTIVATION_ENERGY = 88e3
"""Of acetal's slow relaxation [J/mol], between 20 and 70 C: an estimate.

21 +- 1 kcal/mol by superposition of torsional creep: On the alpha-relaxation in bulk polyoxymethylene, Journal of
Materials Science, doi 10.1007/BF02403516, which quotes 20 to 92 from others. That creep at several temperatures
superposes holds for copolymers, too: Gonzalez-Gutierrez et al., Polimery 60 (2015) 620.
"""
REFERENCE_C = 23.0
"""Temperature of the data sheets."""
COLDEST_C, HOTTEST_C = -20.0, 70.0
"""Beyond 70 C creep at several temperatures does not superpose; below 20 C nothing of the above was measured."""

FIRST_DECADE, LAST_DECADE = 0, 8
"""One term a decade, from a second to three years."""
LEAST_EXPONENT, MOST_EXPONENT = 0.05, 0.8
LEAST_STRENGTH, MOST_STRENGTH = 1e-3, 100.0
MOST_TERMS = 64
SHORTEST, LONGEST = 1e-3, 1e12
"""Times that a term may have [s]."""


@dataclass(frozen=True)
class Relaxation:
    """The law of a rod: a Prony series; `fractions[k]` of a bend that is held go over into set within `times[k]` [s].

    The times are those at `REFERENCE_C`. `temperature` [C] is where the rod is, unless a history says otherwise.
    InvalidInput for a law that makes no sense.
    """

    times: tuple[float, ...]  # [s], rising
    fractions: tuple[float, ...]  # positive, together below 1
    temperature: float = REFERENCE_C  # [C]

    def __post_init__(self) -> None:
        object.__setattr__(self, "times", tuple(map(float, self.times)))
        object.__setattr__(self, "fractions", tuple(map(float, self.fractions)))
        if fault := fault_of(self.times, self.fractions):
            raise InvalidInput(f"no rod relaxes so: {fault[0]}", fault[1])
        check_temperature(self.temperature)
        object.__setattr__(self, "temperature", float(self.temperature))

    def reduced(self, seconds: float, temperature: float | None = None) -> float:
        """The time at `REFERENCE_C` [s] in which as much happens as in `seconds` at a temperature [C], or the rod's.

        Arrhenius' law. InvalidInput for a time or a temperature that makes no sense.
        """
        check_seconds(seconds)
        return seconds * speed_up(self.temperature if temperature is None else temperature)

    def modulus(self, seconds: float) -> float:
        """Moment of a bend that has been held for so long at `REFERENCE_C`, over its first moment."""
        relaxed = (each * -math.expm1(-seconds / time) for time, each in zip(self.times, self.fractions, strict=True))
        return 1.0 - math.fsum(relaxed)

    def set_after(self, seconds: float, temperature: float | None = None) -> float:
        """Part of a bend that is set when it has been held for so long at a temperature [C], or the rod's."""
        return 1.0 - self.modulus(self.reduced(seconds, temperature))


def power_law(strength: float = 1.0, exponent: float = ACETAL_EXPONENT, temperature: float = REFERENCE_C) -> Relaxation:
    """The law of a rod that creeps by a power of time: `strength` times as much as acetal does within an hour.

    From J(t) = J0 (1 + c (t / 1 h)^m) follows the modulus as a Mittag-Leffler function, and that is a sum of
    exponentials with a density in ln(time) which can be integrated in closed form (Mainardi, Fractional Calculus and
    Waves in Linear Viscoelasticity, 2010, section 3.3 and appendix E). Each term has what relaxes within its decade.
    From a second to a year acetal's keeps to the Mittag-Leffler function to 0.006; what takes longer is elastic.
    """
    if not LEAST_STRENGTH <= strength <= MOST_STRENGTH:
        hint = f"give one from {LEAST_STRENGTH:g} to {MOST_STRENGTH:g}; 1 is the estimate for acetal"
        raise InvalidInput(f"no rod takes a set of strength {strength:g}", hint)
    if not LEAST_EXPONENT <= exponent <= MOST_EXPONENT:
        hint = f"give one from {LEAST_EXPONENT:g} to {MOST_EXPONENT:g}; acetal's is {ACETAL_EXPONENT:.3f}"
        raise InvalidInput(f"no rod creeps by the power {exponent:g} of time", hint)
    rate = strength * ACETAL_CREEP * math.gamma(1.0 + exponent) / HOUR**exponent
    decades = range(FIRST_DECADE, LAST_DECADE + 1)
    edges = [_faster(10.0 ** (decade - 0.5), rate, exponent) for decade in (*decades, LAST_DECADE + 1)]
    # What relaxes within less than the first term is over when a stiffness is measured.
    held = 1.0 - edges[0]
    fractions = [(late - early) / held for early, late in pairwise(edges)]
    return Relaxation(tuple(10.0**decade for decade in decades), tuple(fractions), temperature)


def _faster(time: float, rate: float, exponent: float) -> float:
    """Part of E_m(-rate t^m) that relaxes faster than within `time`: the integral of its density up to there.

    The density in ln(time) is sin(pi m) / (2 pi (cosh v + cos(pi m))), v = -m ln(time) - ln(rate).
    """
    v = -exponent * math.log(time) - math.log(rate)
    angle = math.pi * exponent
    return 0.5 - math.atan(math.tan(0.5 * angle) * math.tanh(0.5 * v)) / angle


def speed_up(temperature: float) -> float:
    """How many times as fast as at `REFERENCE_C` everything goes at a temperature [C]; InvalidInput outside of limits.

    Three times for ten degrees.
    """
    check_temperature(temperature)
    return math.exp(ACTIVATION_ENERGY / GAS_CONSTANT * (1.0 / kelvin(REFERENCE_C) - 1.0 / kelvin(temperature)))


def check_temperature(temperature: float) -> None:
    """InvalidInput for a temperature [C] at which nothing is known of acetal."""
    if not COLDEST_C <= temperature <= HOTTEST_C:
        hint = f"the law holds from {COLDEST_C:g} to {HOTTEST_C:g} C: is it in degrees Celsius?"
        raise InvalidInput(f"nothing is known of a rod at {temperature:g} C", hint)


def check_seconds(seconds: float) -> None:
    """InvalidInput for a time [s] that is negative or endless."""
    if not 0.0 <= seconds <= LONGEST:
        raise InvalidInput(f"a rod is not held for {seconds:g} s", f"give a time from 0 to {LONGEST:g} s")


def fault_of(times: tuple[float, ...], fractions: tuple[float, ...]) -> tuple[str, str] | None:
    """What is wrong with times [s] and fractions of a law, and what to do; None if nothing is."""
    if not 1 <= len(times) <= MOST_TERMS:
        return f"it has {len(times)} times", f"give 1 to {MOST_TERMS} of them"
    if len(times) != len(fractions):
        return f"{len(times)} times and {len(fractions)} fractions", "give a fraction for every time"
    if not all(SHORTEST <= time <= LONGEST for time in times):
        return "a time is out of range", f"give each in seconds, from {SHORTEST:g} to {LONGEST:g}"
    if any(late <= early for early, late in pairwise(times)):
        return "the times do not rise", "sort them from the shortest to the longest, each once"
    if not all(0.0 < each < 1.0 for each in fractions):
        return "a fraction is not between 0 and 1", "leave out terms that do nothing"
    if math.fsum(fractions) >= 1.0:
        return (
            f"the fractions come to {math.fsum(fractions):.6g}",
            "together they stay below 1: something of a rod is elastic for good",
        )
    return None
