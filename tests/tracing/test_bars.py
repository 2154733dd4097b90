"""The way of a bar through a strip: past others, and where it becomes lighter than what is behind it."""

from __future__ import annotations

import numpy as np
import pytest

from curveline.tracing.bars import ACROSS, best_way, likeness, without
from curveline.tracing.sections import Reach
from curveline.units import mm

ROWS = np.arange(-mm(30.0), mm(30.0) + 0.5 * ACROSS, ACROSS)
COLUMNS = 80


def strip_with(off: np.ndarray, wall: np.ndarray, level: float = 120.0) -> np.ndarray:
    """A bar of 4 mm at `off (n,)` [m] before a wall of levels `wall (n,)`."""
    strip = np.tile(wall, (len(ROWS), 1)).astype(np.float32)
    strip[np.abs(ROWS[:, None] - off[None, :]) < mm(2.0)] = level
    return strip + np.random.default_rng(2).normal(0.0, 1.0, strip.shape).astype(np.float32)


def bar() -> Reach:
    return Reach(np.full(COLUMNS, -mm(2.0)), np.full(COLUMNS, mm(2.0)))


def test_a_bar_is_followed_where_it_changes_from_light_to_dark() -> None:
    off = mm(10.0) * np.sin(np.linspace(0.0, 3.0, COLUMNS))
    wall = np.where(np.arange(COLUMNS) < 40, 60.0, 190.0)
    way = best_way(likeness(strip_with(off, wall), ROWS, bar(), 1.0), ROWS)
    assert np.abs(way.off - off).max() < mm(2.0)
    assert np.all(way.sign[:38] == 1.0)
    assert np.all(way.sign[42:] == -1.0)


def test_an_edge_is_no_bar() -> None:
    strip = np.where(ROWS[:, None] > 0.0, 200.0, 50.0) * np.ones((1, COLUMNS))
    assert likeness(strip.astype(np.float32), ROWS, bar(), 1.0).max() < 0.05


def test_the_second_bar_is_found_without_the_first() -> None:
    first, second = np.full(COLUMNS, -mm(8.0)), np.full(COLUMNS, mm(9.0))
    strip = strip_with(first, np.full(COLUMNS, 60.0))
    strip[np.abs(ROWS - mm(9.0)) < mm(2.0), :] = 110.0
    found = likeness(strip, ROWS, bar(), 1.0)
    one = best_way(found, ROWS)
    other = best_way(without(found, ROWS, one), ROWS)
    assert sorted([float(np.median(one.off)), float(np.median(other.off))]) == pytest.approx(
        [first[0], second[0]], abs=mm(2.0)
    )
