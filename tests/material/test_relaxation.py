"""The law of a plastic rod against what it stands for: the Mittag-Leffler function and the creep of data sheets."""

from __future__ import annotations

import math

import numpy as np
import pytest

from curveline.errors import InvalidInput
from curveline.material.memory import RodMemory
from curveline.material.relaxation import (
    ACETAL_CREEP,
    ACETAL_EXPONENT,
    AFTER_1_HOUR_GPA,
    AFTER_1000_HOURS_GPA,
    FLEXURAL_GPA,
    Relaxation,
    power_law,
    speed_up,
)

YEAR = 3.15e7


def mittag_leffler(order: float, rate: float, time: float, points: int = 24) -> float:
    """E_order(-rate time^order) from its Laplace transform, s^(order-1) / (s^order + rate), by Talbot's contour."""
    angles = np.arange(1, points) * np.pi / points
    cotangents = 1.0 / np.tan(angles)
    r = 2.0 * points / (5.0 * time)
    s = np.concatenate(([r + 0j], r * angles * (cotangents + 1j)))
    turns = np.concatenate(([0.5 + 0j], 1.0 + 1j * (angles + (angles * cotangents - 1.0) * cotangents)))
    return float(r / points * np.sum((np.exp(time * s) * s ** (order - 1.0) / (s**order + rate) * turns).real))


def crept(law: Relaxation, seconds: float, steps: int = 4000) -> float:
    """Bend under a constant moment over the first bend: the law's own equations in small steps of ln(time)."""
    times, fractions = np.array(law.times), np.array(law.fractions)
    memories, bend, now = np.zeros(times.size), 1.0, 0.0
    for until in np.geomspace(1e-4, seconds, steps):
        left = np.exp(-(until - now) / times)
        # The bend of the end of the step is met by fixed point, and the mean is held within it.
        after = bend
        for _ in range(20):
            new = left * memories + (1.0 - left) * 0.5 * (bend + after)
            after = 1.0 + fractions @ new
        memories, bend, now = new, after, until
    return bend


@pytest.mark.parametrize("strength", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("exponent", [0.2, ACETAL_EXPONENT, 0.4])
def test_the_series_keeps_to_the_mittag_leffler_function_from_a_second_to_a_year(strength, exponent) -> None:
    law = power_law(strength, exponent)
    rate = strength * ACETAL_CREEP * math.gamma(1.0 + exponent) / 3600.0**exponent
    # What relaxes within a second is over before a stiffness is measured.
    moments = np.geomspace(1.0, YEAR, 60)
    exact = np.array([mittag_leffler(exponent, rate, t) for t in moments])
    ours = np.array([law.modulus(t) for t in moments])
    scale = float(np.mean(exact / ours))
    assert 0.94 < scale < 1.0
    assert np.max(np.abs(exact / scale - ours)) < (0.006 if (strength, exponent) == (1.0, ACETAL_EXPONENT) else 0.01)


def test_creep_of_the_built_in_law_is_that_of_the_data_sheet() -> None:
    law = power_law()
    assert crept(law, 3600.0) == pytest.approx(FLEXURAL_GPA / AFTER_1_HOUR_GPA, rel=0.02)
    assert crept(law, 3.6e6) == pytest.approx(FLEXURAL_GPA / AFTER_1000_HOURS_GPA, rel=0.02)


def test_each_term_of_the_law_counts() -> None:
    law = power_law()
    for k in range(len(law.times)):
        keep = [i for i in range(len(law.times)) if i != k]
        less = Relaxation(tuple(law.times[i] for i in keep), tuple(law.fractions[i] for i in keep))
        late = 3.0 * law.times[k]
        assert law.modulus(late) < less.modulus(late) - 0.9 * law.fractions[k]
    assert math.fsum(law.fractions) < 1.0


def test_more_strength_is_more_set_and_the_exponent_turns_about_the_hour() -> None:
    sets = [1.0 - power_law(strength).modulus(3600.0) for strength in (0.25, 0.5, 1.0, 2.0, 4.0)]
    assert sets == sorted(sets)
    assert sets[0] == pytest.approx(0.25 * sets[2], rel=0.15)
    gentle, steep = power_law(1.0, 0.2), power_law(1.0, 0.4)
    assert gentle.modulus(60.0) < steep.modulus(60.0)
    assert gentle.modulus(1e6) > steep.modulus(1e6)


def test_warmth_makes_everything_faster_by_one_factor() -> None:
    assert speed_up(23.0) == 1.0
    assert speed_up(33.0) == pytest.approx(3.21, abs=0.01)
    assert speed_up(13.0) == pytest.approx(1.0 / 3.5, rel=0.02)
    law = power_law()
    memory = RodMemory.new(law, 1.0)
    warm = memory.held(5.0, 3600.0, 40.0).free(600.0, 40.0)
    factor = speed_up(40.0)
    cool = memory.held(5.0, 3600.0 * factor).free(600.0 * factor)
    np.testing.assert_allclose(warm.bends, cool.bends, rtol=1e-12)
    standing = RodMemory.new(power_law(temperature=40.0), 1.0).held(5.0, 3600.0).free(600.0)
    np.testing.assert_array_equal(standing.bends, warm.bends)


@pytest.mark.parametrize(
    ("times", "fractions", "told"),
    [
        ((), (), "0 times"),
        ((1.0,), (0.1, 0.2), "1 times and 2 fractions"),
        ((10.0, 1.0), (0.1, 0.1), "do not rise"),
        ((1.0, 1.0), (0.1, 0.1), "do not rise"),
        ((1.0,), (1.0,), "between 0 and 1"),
        ((1.0,), (0.0,), "between 0 and 1"),
        ((1.0,), (math.nan,), "between 0 and 1"),
        ((math.nan,), (0.1,), "out of range"),
        ((0.0,), (0.1,), "out of range"),
        ((math.inf,), (0.1,), "out of range"),
        ((1.0, 2.0), (0.6, 0.4), "come to 1"),
    ],
)
def test_a_law_that_makes_no_sense_is_refused_with_the_reason(times, fractions, told: str) -> None:
    with pytest.raises(InvalidInput, match=told) as refusal:
        Relaxation(times, fractions)
    assert refusal.value.hint


@pytest.mark.parametrize("temperature", [-300.0, 71.0, math.nan, math.inf])
def test_a_temperature_of_which_nothing_is_known_is_refused(temperature: float) -> None:
    with pytest.raises(InvalidInput, match="nothing is known"):
        power_law(temperature=temperature)
    with pytest.raises(InvalidInput, match="nothing is known"):
        power_law().reduced(1.0, temperature)


@pytest.mark.parametrize(("strength", "exponent"), [(0.0, 0.3), (-1.0, 0.3), (math.nan, 0.3), (1.0, 0.0), (1.0, 1.0)])
def test_a_power_law_that_makes_no_sense_is_refused(strength: float, exponent: float) -> None:
    with pytest.raises(InvalidInput):
        power_law(strength, exponent)


@pytest.mark.parametrize("seconds", [-1.0, math.nan, math.inf])
def test_a_time_that_makes_no_sense_is_refused(seconds: float) -> None:
    with pytest.raises(InvalidInput, match="not held for"):
        power_law().reduced(seconds)
