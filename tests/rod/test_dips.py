"""The bottom of a dip converges with the square of the edges; its limit tells on which side of a fold a rod is."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clamped_rods import rod_between
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.dips import bottom, hold_at, lean, let_go
from curveline.rod.planar.search import search_edges
from curveline.rod.planar.sweep import nothing_found
from curveline.rod.problem import Array, Problem, held_in_height, make_problem, mesh

FOLD_DEG = 10.161195
"""Where the valley of the strip ends, by a spectral method: see tests/completeness."""


def strip(angle_deg: float) -> ClampedRod:
    return rod_between((0.5, 0.0), math.radians(angle_deg), 0.0, 0.505, 0.0, 1.0, 0.0)


def dip(rod: ClampedRod, n: int) -> tuple[Problem, tuple[float, float], Array, Array, float]:
    """The rod on n edges, height and second derivative at the bottom of its dip, angles, multipliers and sign there."""
    scaled = rod.scaled()
    _, _, near, _ = search_edges(scaled, mesh(scaled.at, n))
    assert near.filled[0] >= 1.0
    problem = held_in_height(make_problem(scaled, mesh(scaled.at, n)))
    phi, force = near.shapes[0].copy(), near.forces[0].copy()
    sign = math.copysign(1.0, force[2])
    place = bottom(problem, near.heights[0], phi, force, sign)
    return problem, place, phi, force, sign


def lowest_slope(angle_deg: float, n: int) -> float:
    """The slope of the energy at the bottom of the dip, negative where a pair of states exists."""
    _, _, _, force, sign = dip(strip(angle_deg), n)
    return float(sign * force[2])


def test_the_bottom_converges_with_the_square_of_the_edges() -> None:
    slopes = [lowest_slope(FOLD_DEG + 0.02, n) for n in (24, 48, 96, 192)]
    changes = -np.diff(slopes)
    assert np.all(changes > 0.0)
    assert changes[:-1] / changes[1:] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("away", [-1e-4, 1e-4])
def test_the_limit_of_the_bottom_changes_its_sign_at_the_fold(away: float) -> None:
    slopes = [lowest_slope(FOLD_DEG * (1.0 + away), n) for n in (96, 192)]
    limit = slopes[1] + (slopes[1] - slopes[0]) / 3.0
    assert (limit > 0.0) == (away > 0.0)


def test_a_held_rod_leans_as_the_difference_of_two_heights() -> None:
    problem, (height, _), phi, force, _ = dip(strip(FOLD_DEG), 48)
    step, change = lean(problem, phi, force)
    ways = []
    for by in (1e-4, -1e-4):
        angles, multipliers = phi.copy(), force.copy()
        assert hold_at(problem, height + by, angles, multipliers)
        ways.append((angles, multipliers))
    (up, pull), (down, push) = ways
    assert step == pytest.approx((up - down) / 2e-4, rel=1e-3, abs=1e-3)
    assert change[:2] == pytest.approx((pull - push)[:2] / 2e-4, rel=1e-3)


def test_of_the_pair_the_stable_one_is_kept() -> None:
    problem, place, phi, force, sign = dip(strip(FOLD_DEG - 0.04), 48)
    found = nothing_found(48)
    assert let_go(problem, place, phi, force, sign, found)
    assert found.filled[0] == 1.0
    assert found.unstable[0] == 0.0
