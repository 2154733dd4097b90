"""The set found from strips on drums: what was planted is found again, and what readings do not tell is said."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest

from curveline.errors import Infeasible, InvalidInput
from curveline.material.drum_fit import SetFit, drum_curvatures, fit_set
from curveline.material.drum_readings import DrumReading
from curveline.material.memory import RodMemory
from curveline.material.relaxation import ACETAL_EXPONENT, Relaxation, power_law, speed_up

HOUR, DAY, WEEK = 3600.0, 86_400.0, 604_800.0
BEND = 10.0
WHEN = tuple(product((8.0 * HOUR, WEEK), (60.0, 600.0, HOUR, 8.0 * HOUR, DAY)))
"""How long strips were held, and how long after that they were read."""


def readings(
    law: Relaxation, off: float = 0.0, seed: int = 0, when=WHEN, temperature: float = 23.0
) -> list[DrumReading]:
    """Readings of strips that follow a law, each off by so much [1/m] as standard deviation."""
    noise = np.random.default_rng(seed).normal(0.0, off, len(when))
    factor = speed_up(temperature)
    held, after = np.array(when).T * factor
    curvatures = drum_curvatures(law, np.full(len(when), BEND), held, after) + noise
    return [
        DrumReading(BEND, *times, curvature, temperature)
        for times, curvature in zip(when, map(float, curvatures), strict=True)
    ]


def holds(interval: tuple[float, float], value: float) -> bool:
    return interval[0] <= value <= interval[1]


def test_a_strip_on_a_drum_for_a_week_and_its_recovery_are_those_of_the_closed_form() -> None:
    time, fraction = 40_000.0, 0.35
    after = np.array([0.0, 60.0, 3600.0, 1e5])
    ours = drum_curvatures(Relaxation((time,), (fraction,)), np.full(4, BEND), np.full(4, WEEK), after)
    exact = BEND * fraction * -math.expm1(-WEEK / time) * np.exp(-(1.0 - fraction) * after / time)
    np.testing.assert_allclose(ours, exact, rtol=1e-12)


def test_strips_and_the_memory_of_a_rod_obey_the_same_equations() -> None:
    law = power_law(1.3, 0.33)
    for held, after in WHEN:
        memory = RodMemory.new(law, 1.0, 1.0).held(BEND, held).free(after)
        ours = drum_curvatures(law, *(np.array([each]) for each in (BEND, held, after)))
        assert ours[0] == pytest.approx(memory.set_curvature[0], rel=1e-9)


@pytest.mark.parametrize(("strength", "exponent"), [(1.0, ACETAL_EXPONENT), (0.4, 0.2), (1.8, 0.4)])
def test_what_was_planted_is_found_again(strength: float, exponent: float) -> None:
    fit = fit_set(readings(power_law(strength, exponent)))
    assert fit.strength == pytest.approx(strength, rel=1e-3)
    assert fit.exponent == pytest.approx(exponent, abs=1e-3)
    assert fit.is_exponent_told
    assert not fit.is_poor
    assert fit.rms < 1e-4
    assert power_law(*fit.keys.values()).modulus(HOUR) == pytest.approx(fit.law.modulus(HOUR), abs=1e-3)


def test_readings_at_another_temperature_tell_the_same_law() -> None:
    fit = fit_set(readings(power_law(1.2, 0.31), temperature=30.0))
    assert (fit.strength, fit.exponent) == pytest.approx((1.2, 0.31), rel=1e-3)


def test_intervals_have_the_truth_in_them_about_as_often_as_they_say() -> None:
    law, hits = power_law(1.4, 0.33), np.zeros(2)
    for seed in range(20):
        fit = fit_set(readings(law, 0.03, seed))
        hits += holds(fit.strength_interval, 1.4), holds(fit.exponent_interval, 0.33)
    # Of 200 seeds they have it in 96 and 94.5 %; of 20, chance leaves fewer than 16 once in 400 times.
    assert np.all(hits >= 16)
    # Intervals three times as wide would always have it.
    assert hits.sum() < 40


def test_worse_readings_have_wider_intervals() -> None:
    def width(off: float) -> tuple[float, float]:
        fit = fit_set(readings(power_law(), off))
        return fit.strength_interval[1] - fit.strength_interval[0], fit.exponent_interval[1] - fit.exponent_interval[0]

    fine, coarse = width(0.01), width(0.1)
    assert all(wide > 3.0 * narrow for narrow, wide in zip(fine, coarse, strict=True))


def test_an_exponent_that_is_not_told_is_left_at_the_estimate_and_blurs_the_strength() -> None:
    few = readings(power_law(1.4, 0.33), 0.05, when=WHEN[:3])
    fit = fit_set(few)
    assert not fit.is_exponent_told
    assert holds(fit.exponent_interval, fit.exponent)
    assert holds(fit.exponent_interval, 0.33)
    assert holds(fit.strength_interval, 1.4)
    assert fit.strength_interval[1] > 1.5 * fit.strength_interval[0]
    assert list(fit.keys) == ["set_strength"] if fit.exponent == ACETAL_EXPONENT else ["set_strength", "set_exponent"]


def test_readings_of_another_law_are_called_so() -> None:
    rows = readings(
        Relaxation((30.0,), (0.6,)), when=((HOUR, 1.0), (HOUR, 10.0), (HOUR, 60.0), (HOUR, 200.0), (HOUR, 600.0))
    )
    assert fit_set(rows).is_poor


@pytest.mark.parametrize("sign", [0.0, -1.0])
def test_strips_that_took_no_set_are_said_to(sign: float) -> None:
    rows = [DrumReading(each.bend, each.held, each.after, sign * each.curvature) for each in readings(power_law())]
    with pytest.raises(Infeasible, match="no set") as refusal:
        fit_set(rows)
    assert "positive" in refusal.value.hint


def test_strips_that_stay_on_the_drum_are_said_to() -> None:
    rows = [DrumReading(BEND, HOUR, after, 1.2 * BEND) for after in (60.0, 600.0, 6000.0)]
    with pytest.raises(Infeasible, match="larger set"):
        fit_set(rows)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_as_many_readings_as_numbers_are_not_enough(count: int) -> None:
    with pytest.raises(InvalidInput, match=f"{count} reading") as refusal:
        fit_set(readings(power_law())[:count])
    assert "several times" in refusal.value.hint


def test_a_fit_as_plain_data() -> None:
    fit: SetFit = fit_set(readings(power_law(1.2, 0.31)))
    document = fit.document()
    assert document["rod"] == fit.keys
    assert document["set_strength_95"] == list(fit.strength_interval)
    assert [each["fitted_per_m"] for each in document["readings"]] == list(fit.fitted)
    assert document["readings"][0]["held_s"] == 8.0 * HOUR
