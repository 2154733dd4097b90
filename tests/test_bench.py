"""The benchmark measures what it says; whether a figure is good enough is for people to judge, not for a test."""

import math
from pathlib import Path

import numpy as np

from curveline import bench
from curveline.rod.equilibrium import ClampedRod
from curveline.rod.states import find_states

SHAPE = str(Path(__file__).parents[1] / "shapes" / "level-up-peak.toml")


def test_a_state_that_is_not_known_counts_as_missed():
    rod = ClampedRod((0.5, 0.0), 0.2, -0.2, 0.65, 0.02, 0.028224, 0.4707192)
    heights = [state.mean_height for state in find_states(rod, 1e-4)]
    assert len(heights) == 2
    assert bench._missed(rod, heights, np.random.default_rng(1)) == 0
    assert bench._missed(rod, heights[:1], np.random.default_rng(1)) == 1
    assert bench._missed(rod, [], np.random.default_rng(1)) == 2


def test_one_state_is_measured_against_the_closed_form():
    rows = {row.name: row for row in bench._one_state()}
    assert 0.0 < rows["true error at 0.1 mm"].value < 0.1
    assert 0.0 < rows["its true error"].value < 0.1


def test_the_trade_keeps_every_tolerance():
    rows = {row.name: row for row in bench.trade([SHAPE])}
    for name, row in rows.items():
        assert math.isfinite(row.value)
        if name.endswith("worst true error"):
            assert 0.0 < row.value < float(name.split()[0])
