"""The guesses of the search: they meet clamps and chord, on the side that is asked for."""

from __future__ import annotations

import math

import numpy as np
import pytest

from curveline.rod.planar import spline
from curveline.rod.planar.arch import arch
from curveline.rod.planar.newton import Effort, descend
from curveline.rod.problem import Array, ScaledRod, held_in_height, make_problem, mean_height, mesh

FALL = Effort(turn=0.5, close=1e-9, iterations=200)


def rod_of(seed: int) -> ScaledRod:
    """A slack rod between clamps up to 60 deg off their chord."""
    rng = np.random.default_rng(seed)
    along = rng.uniform(-0.6, 0.6)
    chord = rng.uniform(0.6, 0.93) * np.array([math.cos(along), math.sin(along)])
    return ScaledRod(rng.uniform(0.0, 4.0), np.empty(0), np.empty((0, 2)), chord, along + rng.uniform(-1.0, 1.0, 2))


def arched(rod: ScaledRod, side: float, n: int = 48) -> Array:
    phi = np.empty(n)
    arch(make_problem(rod, mesh(rod.at, n)), side, phi)
    return phi


@pytest.mark.parametrize("seed", range(20))
def test_an_arch_leads_from_clamp_to_clamp_on_its_side(seed: int) -> None:
    rod = rod_of(seed)
    problem = held_in_height(make_problem(rod, mesh(rod.at, 48)))
    heights = []
    for side in (1.0, -1.0):
        phi = arched(rod, side)
        end = np.array([problem.edges @ np.cos(phi), problem.edges @ np.sin(phi)])
        np.testing.assert_allclose(end, rod.chord, atol=2e-3)
        assert abs(phi[0] - rod.ends[0]) < 0.5
        assert abs(phi[-1] - rod.ends[1]) < 0.5
        heights.append(mean_height(problem, phi))
    assert heights[0] > heights[1]


@pytest.mark.parametrize("seed", range(20))
def test_an_arch_leads_downhill_to_where_the_papers_spline_does(seed: int) -> None:
    rod = rod_of(seed)
    problem = make_problem(rod, mesh(rod.at, 48))
    for side in (1.0, -1.0):
        ends = []
        for phi in (arched(rod, side), np.empty(48)):
            if len(ends):
                spline.guess(rod.chord, rod.ends, side, phi)
            assert descend(problem, phi, np.zeros(2), FALL) > 0
            ends.append(phi)
        np.testing.assert_allclose(ends[0], ends[1], atol=1e-6)


def test_where_no_arch_meets_the_chord_there_is_one_all_the_same() -> None:
    rod = ScaledRod(0.0, np.empty(0), np.empty((0, 2)), np.array([0.9999, 0.0]), np.array([1.2, -1.1]))
    assert np.isfinite(arched(rod, 1.0)).all()
