"""Sines and cosines of many angles at once, and angles of points, against the system's."""

from __future__ import annotations

import numpy as np
import pytest

from curveline.rod.problem import Array
from curveline.rod.trigonometry import arc_tangent, sines_and_cosines

BOUND = 4e-16


def both(angles: Array) -> tuple[Array, Array]:
    sines, cosines = np.empty_like(angles), np.empty_like(angles)
    sines_and_cosines(angles, sines, cosines)
    return sines, cosines


@pytest.mark.parametrize("largest", [1e-8, 0.1, 1.6, 7.0, 1e3, 1e6])
def test_both_are_right_to_the_last_bits(largest: float) -> None:
    rng = np.random.default_rng(int(largest))
    # 0 and a multiple of each quarter turn, where the reduction of an angle cancels most.
    quarters = np.round(rng.uniform(-largest, largest, 500) / (0.5 * np.pi)) * (0.5 * np.pi)
    angles = np.concatenate([[0.0, -0.0], rng.uniform(-largest, largest, 20_000), quarters])
    sines, cosines = both(angles)
    assert np.max(abs(sines - np.sin(angles))) < BOUND
    assert np.max(abs(cosines - np.cos(angles))) < BOUND


def test_small_sines_are_right_to_their_own_last_bits() -> None:
    angles = np.geomspace(1e-300, 1e-3, 400)
    sines, _ = both(angles)
    np.testing.assert_allclose(sines, np.sin(angles), rtol=4e-16)


def test_what_is_not_finite_has_neither() -> None:
    sines, cosines = both(np.array([np.inf, -np.inf, np.nan]))
    assert np.isnan(sines).all()
    assert np.isnan(cosines).all()


def test_angles_of_points_are_the_systems() -> None:
    rng = np.random.default_rng(3)
    slight = np.geomspace(1e-300, 0.3, 400)
    points = [*rng.normal(size=(400, 2)), *np.column_stack([slight, np.ones(400)]), [0.0, -1.0], [1.0, 0.0]]
    for y, x in np.concatenate([points, np.multiply(points, [-1.0, 1.0])]).tolist():
        assert arc_tangent(y, x) == pytest.approx(np.arctan2(y, x), rel=4e-16, abs=0.0)
    assert np.isnan(arc_tangent(np.nan, 1.0))
