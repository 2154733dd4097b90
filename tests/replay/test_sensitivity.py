"""The estimates of effects against functions whose effects are known, their intervals against how often they hold."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from curveline.replay.sensitivity import Effects, Terms, effects_of, row_terms
from curveline.rod.problem import Array

Function = Callable[[Array], Array]


def ishigami(x: Array) -> Array:
    """Ishigami and Homma 1990, with a = 7 and b = 0.1."""
    return np.asarray(np.sin(x[..., 0]) + 7.0 * np.sin(x[..., 1]) ** 2 + 0.1 * x[..., 2] ** 4 * np.sin(x[..., 0]))


def ishigami_effects() -> tuple[Array, Array]:
    """First-order and total effects in closed form."""
    a, b, pi = 7.0, 0.1, math.pi
    first = np.array([0.5 * (1.0 + b * pi**4 / 5.0) ** 2, a * a / 8.0, 0.0])
    both = 8.0 * b * b * pi**8 / 225.0
    variance = first.sum() + both
    return first / variance, (first + np.array([both, 0.0, both])) / variance


SLOPES = np.array([5.0, 1.0, 0.2, 0.0])


def linear(x: Array) -> Array:
    return np.asarray(x @ SLOPES)


def planned(function: Function, inputs: int, rows: int, seed: int) -> Terms:
    """The terms of a design whose inputs are uniform from -pi to pi."""
    source = np.random.default_rng(seed)
    base, other = source.uniform(-math.pi, math.pi, (2, rows, inputs))
    mixed = np.array([np.where(np.arange(inputs) == k, other, base) for k in range(inputs)])
    outcomes = function(base), function(other), function(mixed).T
    centre = float(np.mean(outcomes[:2]))
    found = [row_terms(one[None], two[None], more[:, None], centre) for one, two, more in zip(*outcomes, strict=True)]
    return Terms(*(np.array(column) for column in zip(*found, strict=True)))


def estimated(function: Function, inputs: int, rows: int, seed: int) -> Effects:
    effects = effects_of(planned(function, inputs, rows, seed), seed)
    assert effects is not None
    return effects


def test_effects_of_ishigamis_function() -> None:
    first, total = ishigami_effects()
    assert first == pytest.approx([0.3139, 0.4424, 0.0], abs=5e-5)
    assert total == pytest.approx([0.5576, 0.4424, 0.2437], abs=5e-5)
    found = estimated(ishigami, 3, 8000, 1)
    assert found.first.value == pytest.approx(first, abs=0.03)
    assert found.total.value == pytest.approx(total, abs=0.04)


def test_effects_of_a_linear_function() -> None:
    truth = SLOPES**2 / (SLOPES @ SLOPES)
    found = estimated(linear, 4, 2000, 1)
    for each in (found.first, found.total):
        assert each.value == pytest.approx(truth, abs=0.02)
        assert each.value[3] == each.low[3] == each.high[3] == 0.0
    assert found.variance == pytest.approx(SLOPES @ SLOPES * math.pi**2 / 3.0, rel=0.1)


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    truth = np.concatenate(ishigami_effects())
    held = np.zeros(6)
    for seed in range(60):
        found = estimated(ishigami, 3, 400, seed)
        low, high = (np.concatenate([found.first[k], found.total[k]]) for k in (1, 2))
        held += (low <= truth) & (truth <= high)
    assert np.all(held >= 0.85 * 60)
    assert np.mean(held) < 0.99 * 60


@pytest.mark.parametrize(("function", "inputs"), [(ishigami, 3), (linear, 4)])
def test_both_estimates_together_scatter_less_than_either(function: Function, inputs: int) -> None:
    joined, sobol, jansen = [], [], []
    for seed in range(60):
        terms = planned(function, inputs, 300, seed)
        effects = effects_of(terms)
        assert effects is not None
        joined.append(effects.first.value)
        sobol.append(terms.sobol.mean(axis=0) / terms.variance.mean())
        jansen.append(terms.jansen.mean(axis=0) / terms.variance.mean())
    spread = np.std(joined, axis=0)
    assert np.all(spread <= 1.1 * np.minimum(np.std(sobol, axis=0), np.std(jansen, axis=0)))
    # Of what makes nearly all of the variance the product alone is an order of magnitude worse.
    if function is linear:
        assert spread[0] < 0.2 * np.std(sobol, axis=0)[0]


def test_outcomes_of_several_numbers_count_by_their_variances() -> None:
    def spread_out(x: Array) -> Array:
        return np.stack([3.0 * x[..., 0], 4.0 * x[..., 1]], axis=-1)

    source = np.random.default_rng(3)
    base, other = source.uniform(-1.0, 1.0, (2, 3000, 2))
    rows = []
    for one, two in zip(base, other, strict=True):
        mixed = np.array([[two[0], one[1]], [one[0], two[1]]])
        rows.append(row_terms(spread_out(one), spread_out(two), spread_out(mixed), 0.0))
    found = effects_of(Terms(*(np.array(column) for column in zip(*rows, strict=True))))
    assert found is not None
    assert found.first.value == pytest.approx([9.0 / 25.0, 16.0 / 25.0], abs=0.03)
    assert found.variance == pytest.approx(25.0 / 3.0, rel=0.05)


def test_a_centre_that_is_off_only_adds_scatter() -> None:
    source = np.random.default_rng(4)
    base, other = source.uniform(-1.0, 1.0, (2, 20000))
    rows = [row_terms(one, two, two[None], 0.5) for one, two in zip(base[:, None], other[:, None], strict=True)]
    found = effects_of(Terms(*(np.array(column) for column in zip(*rows, strict=True))))
    assert found is not None
    assert found.first.value == pytest.approx([1.0], abs=0.02)


def test_what_does_not_vary_has_no_effects() -> None:
    same = np.ones(1)
    rows = [row_terms(same, same, same[None], 0.0) for _ in range(5)]
    assert effects_of(Terms(*(np.array(column) for column in zip(*rows, strict=True)))) is None


def test_many_rows_are_joined_and_the_bootstrap_follows_from_its_seed() -> None:
    terms = planned(ishigami, 3, 5001, 5)
    one, same, other = effects_of(terms, 1), effects_of(terms, 1), effects_of(terms, 2)
    assert one is not None
    assert same is not None
    assert other is not None
    assert np.array_equal(one.first.low, same.first.low)
    assert not np.array_equal(one.first.low, other.first.low)
    assert one.first.high - one.first.low == pytest.approx(other.first.high - other.first.low, rel=0.2)
    # A quarter of the rows is twice the interval.
    few = effects_of(Terms(*(each[:1250] for each in terms)), 1)
    assert few is not None
    widths = (few.total.high - few.total.low) / (one.total.high - one.total.low)
    assert np.all((widths > 1.5) & (widths < 2.7))
