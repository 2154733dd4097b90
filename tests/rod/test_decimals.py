"""Numbers written by a kernel have the digits of Python's `repr`, each time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from curveline.rod.geometry.decimals import LONGEST, curves_as_json

RANDOM = 200_000
EXPONENTS = range(-1074, 1024)


def assert_written(numbers: object) -> None:
    """Hold finite numbers, and their negatives, against what `repr` makes of them."""
    given = np.ravel(np.asarray(numbers, dtype=np.float64))
    pairs = np.column_stack([given, -given])
    (text,) = curves_as_json(pairs[None])
    assert text == repr(pairs.tolist())


@pytest.mark.parametrize(
    "numbers",
    [
        [0.0, 1.0, 10.0, 0.5, 1.5, 123456.0, 2.0 / 3.0, 0.1, 0.3, 4.35],
        [1e15, 9999999999999998.0, 1e16, 12345678901234567.0, 1e17, 1e22, 1e23, 9007199254740993.0],
        [1e-3, 1e-4, 9.999e-5, 1e-5, 0.00012345, 1.2345e-5, 1e-9, 1e-10, 1e-99, 1e-100, 1e99, 1e100],
        [5e-324, 1e-323, 2.2250738585072014e-308, 2.225073858507201e-308, 1.7976931348623157e308],
        [2.0**-44, 2.0**-1074 * 3, 9.5367431640625e-07, 8.5e-05, 2.0**53 + 2.0, 2.0**63, 2.0**64],
    ],
)
def test_numbers_at_which_the_form_changes(numbers: list[float]) -> None:
    assert_written(numbers)


def test_powers_of_two_and_ten_and_their_neighbours() -> None:
    powers = [math.ldexp(1.0, exponent) for exponent in EXPONENTS] + [float(f"1e{each}") for each in range(-323, 309)]
    assert_written(powers)
    assert_written(np.nextafter(powers, 0.0))
    assert_written(np.nextafter(powers, 1e308))


def test_short_decimals_stay_short() -> None:
    rng = np.random.default_rng(1)
    assert_written([float(f"{digits}e{exponent}") for digits in range(1, 1000, 37) for exponent in range(-300, 300, 7)])
    for places in range(8):
        assert_written(np.round(rng.uniform(-1000.0, 1000.0, 2000), places))
    assert_written(rng.integers(-(10**6), 10**6, 2000) / 64.0)


@pytest.mark.parametrize("rounds", [1, pytest.param(200, marks=pytest.mark.campaign)])
def test_any_numbers(rounds: int) -> None:
    rng = np.random.default_rng(rounds)
    for _ in range(rounds):
        numbers = rng.integers(0, 1 << 63, RANDOM).view(np.float64)
        assert_written(numbers[np.isfinite(numbers)])
        assert_written(rng.uniform(-1000.0, 1000.0, RANDOM))


def test_several_curves_and_the_longest_numbers() -> None:
    longest = -2.2250738585072014e-308
    assert len(repr(longest)) == LONGEST
    curves = np.full((3, 5, 2), longest)
    curves[1] = np.arange(10.0).reshape(5, 2)
    assert curves_as_json(curves) == [repr(each) for each in curves.tolist()]
    assert curves_as_json(np.empty((0, 5, 2))) == []
