"""MSD and RMSE against cases that were computed by hand."""

from __future__ import annotations

import numpy as np
import pytest

from curveline.comparing.measures import (
    PLACES,
    along,
    common_span,
    heights_at,
    holes_in,
    mean_deviation,
    rms_across,
    rms_over,
)

LINE = np.array([[0.0, 0.0], [0.5, 0.0]])


def lifted(by: float) -> np.ndarray:
    return LINE + np.array([0.0, by])


def test_deviation_of_three_heights_with_either_ddof() -> None:
    # 1, 2 and 6 have the mean 3: squares of 4 + 1 + 9 = 14, over 2 or over 3.
    heights = np.array([[1.0, 1.0], [2.0, 2.0], [6.0, 6.0]])
    assert mean_deviation(heights, 1) == pytest.approx(7.0**0.5)
    assert mean_deviation(heights, 0) == pytest.approx((14.0 / 3.0) ** 0.5)


def test_deviation_is_the_mean_over_places_not_that_of_all_heights() -> None:
    heights = np.array([[0.0, 0.0], [2.0, 0.0]])
    assert mean_deviation(heights, 1) == pytest.approx(0.5 * 2.0**0.5)


def test_one_trial_has_no_deviation() -> None:
    assert mean_deviation(np.array([[1.0, 2.0]]), 0) is None


def test_rmse_is_over_all_places_and_trials() -> None:
    heights = np.array([[3.0, 0.0], [0.0, 4.0]])
    assert rms_over(heights, np.zeros(2)) == pytest.approx((25.0 / 4.0) ** 0.5)


def test_distance_across_a_slope_is_less_than_the_difference_in_height() -> None:
    # A line that rises by 45 deg, 10 mm higher: 7.07 mm away, but for its end, where the nearest point is the end.
    slope = np.array([[0.0, 0.0], [1.0, 1.0]])
    points = np.array([[0.1, 0.11], [0.9, 0.91]])
    assert rms_across(points, slope) == pytest.approx(0.01 / 2.0**0.5, rel=1e-6)
    x = common_span([points, slope])
    higher, expected = heights_at(points, x), heights_at(slope, x)
    assert higher is not None
    assert expected is not None
    assert rms_over(higher[None, :], expected) == pytest.approx(0.01)


def test_common_span_is_what_all_reach() -> None:
    x = common_span([LINE, LINE[:, :] * 0.8 + np.array([0.05, 0.0])])
    assert (x[0], x[-1], x.size) == (pytest.approx(0.05), pytest.approx(0.45), PLACES)
    assert common_span([LINE, LINE + np.array([0.6, 0.0])]).size == 0


def test_overhanging_curves_have_no_heights() -> None:
    turn = np.linspace(0.0, 1.5 * np.pi, 100)
    hook = np.column_stack([np.sin(turn), 1.0 - np.cos(turn)])
    assert heights_at(hook, np.linspace(0.0, 0.5, 5)) is None
    wobble = np.column_stack([np.linspace(0.0, 0.5, 200) + 1e-3 * np.sin(np.arange(200.0)), np.zeros(200)])
    assert heights_at(wobble, np.linspace(0.0, 0.5, 5)) is not None


def test_points_are_spread_evenly_whatever_the_table_had() -> None:
    x = np.cumsum(np.concatenate([[0.0], np.full(60, 2e-3), np.full(60, 6e-3)]))
    crowded = np.column_stack([x, np.zeros(len(x))])
    steps = np.hypot(*np.diff(along(crowded), axis=0).T)
    assert np.ptp(steps) < 1e-12
    assert rms_across(lifted(0.003), LINE) == pytest.approx(0.003)


def test_nothing_counts_in_a_hole() -> None:
    # An arc whose middle was not seen: the chord over the hole is 24 mm beside the arc, and no part of the trial.
    turn = np.linspace(0.0, np.pi, 181)
    arc = 0.2 * np.column_stack([-np.cos(turn), np.sin(turn)])
    seen = np.vstack([arc[:70], arc[111:]])
    assert holes_in(arc) == []
    assert holes_in(seen) == [69]
    assert rms_across(seen, arc) < 1e-4
    x = np.linspace(-0.15, 0.15, 61)
    heights, expected = heights_at(seen, x), heights_at(arc, x)
    assert heights is not None
    assert expected is not None
    unknown = np.isnan(heights)
    assert 15 < unknown.sum() < 35
    assert np.abs(x[unknown]).max() < 0.2 * np.cos(turn[69])
    assert rms_over(np.array([heights]), expected) < 1e-4
    few = np.column_stack([np.linspace(0.0, 0.5, 12), np.zeros(12)])
    assert holes_in(few) == []
