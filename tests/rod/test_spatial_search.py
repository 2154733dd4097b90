"""The search in space: its starts meet their clamps, what it finds is at rest, and costless motions are one state."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from clamped_rods import Stock, made_of, rod_between
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.approach import fitting_mesh
from curveline.rod.spatial.energy import SpatialRod, positions
from curveline.rod.spatial.lifting import spatial_rod
from curveline.rod.spatial.linking_number import turns
from curveline.rod.spatial.relax import descend, is_stable, lowest_mode
from curveline.rod.spatial.search import search_in_space
from curveline.rod.spatial.starts import ALL_SIDES, Curve, started, starts

from .rods import STIFFNESS
from .spatial_rods import matrix

SECTION = Stock(58_800.0, 2.4e-3, 2.97e-3, 0.0, lateral_stiffness=0.49, twisting_stiffness=0.0354887)
TWISTED = made_of(SECTION, rod_between((0.5, 0.0), 0.0, 0.0, 0.6, 0.0, STIFFNESS, 0.0), roll=(0.0, math.radians(290.0)))


def rod_of(segment: ClampedRod, n: int = 48) -> SpatialRod:
    return spatial_rod(segment, fitting_mesh(segment.scaled(), n))


@pytest.mark.parametrize("roll", [0.0, 0.7, 9.0])
def test_starts_begin_and_end_in_their_clamps_with_the_turns_asked_for(roll: float) -> None:
    segment = replace(TWISTED, yaw=(0.3, -0.2), roll=(0.2, 0.2 + roll))
    rod = rod_of(segment, 400)
    for curve in starts(rod, ALL_SIDES):
        shape = started(segment, rod, curve)
        for clamp, edge in ((0, 0), (1, -1)):
            assert np.max(np.abs(matrix(shape.frames[edge]) - matrix(rod.frames[clamp]))) < 0.06
        between = np.abs(np.sum(shape.frames[1:] * shape.frames[:-1], axis=1))
        assert np.max(2.0 * np.arccos(np.minimum(between, 1.0))) < 0.1
        plain = started(segment, rod, Curve(curve.direction, 0.0, 0.0))
        assert turns(rod, shape) - turns(rod, plain) == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize("direction", np.arange(0.1, 6.2, 0.8))
def test_arches_lean_to_where_they_are_sent(direction: float) -> None:
    segment = replace(TWISTED, roll=(0.0, 0.0))
    rod = rod_of(segment)
    middle = np.asarray(positions(rod, started(segment, rod, Curve(direction, 0.8, 0.0))))[24]
    leaning = math.atan2(middle[2], middle[1]) - direction
    assert abs(math.remainder(leaning, 2.0 * math.pi)) < 0.05


def test_all_of_a_twisted_strip_are_at_rest_and_none_is_a_seed() -> None:
    found = search_in_space(TWISTED, [])
    assert len(found) == 6
    for rod, shape in found:
        assert descend(rod, shape).iterations == 1
        assert is_stable(rod, shape)
        assert turns(rod, shape) == pytest.approx(290.0 / 360.0, abs=1e-6)
    others = search_in_space(TWISTED, found[:2])
    assert len(others) == 4


def test_of_a_motion_that_costs_nothing_one_state_is_listed() -> None:
    round_ = replace(SECTION, lateral_stiffness=STIFFNESS, twisting_stiffness=0.7 * STIFFNESS)
    for roll in (0.0, 1.0):
        segment = made_of(round_, TWISTED, roll=(0.0, roll))
        found = search_in_space(segment, [])
        neutral = [shape for rod, shape in found if lowest_mode(rod, shape)[0] < 1e-6]
        assert len(neutral) == 1
        assert len(found) < 4
