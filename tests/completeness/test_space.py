"""A few scenes of the yardstick in space, and the yardstick itself against what it does not share."""

from __future__ import annotations

import numpy as np
import pytest

from curveline.rod.models.choice import SearchRequest, model_states
from curveline.rod.spatial.linking_number import writhe

from .kirchhoff import DEGREES, gauss, lagrangian, linking, rod_of
from .space import Held, Tally, cases, drawn, exact, judge, segment_of

SCENES = 60
STARTS = 6


@pytest.mark.campaign
def test_nothing_is_missed_and_nothing_invented() -> None:
    """The yardstick's own kernels are compiled in a quarter of a minute, for however few scenes."""
    tally, rng = Tally(), np.random.default_rng(3)
    for case in cases(5, SCENES):
        judge(case, rng, tally, STARTS)
    assert tally.missed == []
    assert tally.invented == []
    assert tally.states >= SCENES
    assert tally.folds >= 1


def test_slopes_of_the_descent_are_those_of_its_values() -> None:
    rng = np.random.default_rng(1)
    numbers, held = drawn(rng)
    numbers[10:14] = 0.4, 3.0, -5.0, 4.0
    rod = rod_of(segment_of(numbers, held))
    coefficients, way = rng.normal(size=(2, 3, DEGREES))
    force, slope, unused = rng.normal(size=7), np.empty((3, DEGREES)), np.empty((3, DEGREES))
    lagrangian(rod, coefficients, force, 30.0, slope)
    ends = [lagrangian(rod, coefficients + side * 1e-6 * way, force, 30.0, unused)[0] for side in (1.0, -1.0)]
    assert (ends[0] - ends[1]) / 2e-6 == pytest.approx(float(np.sum(slope * way)), rel=1e-7)


def test_turns_are_whole_beside_those_of_the_clamps() -> None:
    points = np.random.default_rng(2).normal(size=(9, 3))
    assert gauss(points) == pytest.approx(writhe(points), abs=1e-12)
    for roll in (0.5, 5.0):
        numbers = np.zeros(15)
        numbers[6], numbers[10], numbers[14] = roll, 0.5, np.log(0.25)
        segment = segment_of(numbers, Held((0.01, 0.0024), 0.0))
        states = [exact(segment, state) for state in model_states(segment, SearchRequest(1e-4, (0,), "spatial")).states]
        assert states
        for state in states:
            assert state is not None
            assert linking(rod_of(segment), state) == pytest.approx(roll / (2.0 * np.pi), abs=1e-3)
