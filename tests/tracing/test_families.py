"""The elastic curves around a state: their slopes, what they are fitted to, what is beyond them."""

from __future__ import annotations

import numpy as np
import pytest

from curveline.shapes.files import read_shape
from curveline.simulation.simulate import scene_rod, simulate
from curveline.tracing.families import BOUNDS, LIKELY, NUMBERS, Family, Targets
from curveline.units import mm


@pytest.fixture(scope="module")
def family() -> Family:
    scene = read_shape("shapes/staggered-asymmetric-peak.toml")
    segment = simulate(scene)[0]
    return Family(scene_rod(scene, 0), segment.states[0], segment.origin)


def test_slopes_say_where_points_go(family: Family) -> None:
    first = family.first()
    assert first is not None
    for number in range(NUMBERS):
        step = np.zeros(NUMBERS)
        step[number] = 0.02
        moved = family.moved(step, first.angles, first.multipliers)
        assert moved is not None
        # The first edge of a clamp that gives is none of a rigid one.
        assert (moved.points - first.points) / 0.02 == pytest.approx(first.slopes[number], abs=mm(0.08))


def test_a_curve_of_the_family_is_found_again_among_outliers(family: Family) -> None:
    first = family.first()
    assert first is not None
    truth = family.moved(np.array([0.5, -0.5, 1.0, -0.7, 0.4, 0.2, 0.3, 1.0]), first.angles, first.multipliers)
    assert truth is not None
    points = truth.points[5:-5:2].copy()
    points[10:25, 1] += mm(15.0)
    found = family.fitted(first, Targets(points, np.full(len(points), mm(0.2))))
    off = np.hypot(*(found.points - truth.points).T)
    assert off.max() < mm(0.6)


def test_no_curve_is_farther_than_displays_are(family: Family) -> None:
    first = family.first()
    assert first is not None
    far = first.points + np.array([0.0, mm(60.0)]) * np.sin(np.linspace(0.0, np.pi, len(first.points)))[:, None]
    found = family.fitted(first, Targets(far, np.full(len(far), mm(0.2))), scale=1e4)
    assert np.all(np.abs(found.numbers) <= BOUNDS)
    assert np.all(found.numbers >= family.least)
    assert found.numbers[-1] * LIKELY[-1] >= 0.0
