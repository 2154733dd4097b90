"""How high a curve can lie over its chord: where a sweep over the mean height may stop."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from curveline.rod.planar.newton import Effort, newton
from curveline.rod.planar.search import search_edges
from curveline.rod.planar.sweep import (
    BEYOND,
    CAPACITY,
    follow_heights,
    highest_mean,
    no_ridge,
    nothing_found,
    nowhere_near,
    settle_at,
    slip_from,
    sweep_heights,
)
from curveline.rod.problem import Array, Problem, ScaledRod, held_in_height, make_problem, mean_height, mesh, released

CHORDS = (0.02, 0.1, 0.3, 0.6, 0.9, 0.99, 0.9999)
EDGES = mesh(np.empty(0), 48)


def closed(phi: Array) -> Problem:
    """A weightless rod whose edges' angles are `phi (n,)`, between clamps where it then ends."""
    chord = np.array([EDGES @ np.cos(phi), EDGES @ np.sin(phi)])
    return held_in_height(make_problem(ScaledRod(0.0, np.empty(0), np.empty((0, 2)), chord, phi[[0, -1]]), EDGES))


@pytest.mark.parametrize("chord", CHORDS)
def test_the_bound_is_the_mean_height_of_a_catenary(chord: float) -> None:
    scale = brentq(lambda a: 2.0 * a * math.sinh(min(0.5 * chord / a, 700.0)) - 1.0, 1e-3 * chord, 100.0)
    end = math.cosh(0.5 * chord / scale)
    area = quad(lambda x: scale * (end - math.cosh(x / scale)) * math.cosh(x / scale), 0.0, 0.5 * chord)[0]
    assert highest_mean(chord) == pytest.approx(2.0 * area, rel=1e-6)


def test_the_bound_where_the_rod_is_straight_and_where_it_is_folded() -> None:
    assert highest_mean(1.0) == highest_mean(1.2) == 0.0
    assert highest_mean(1e-9) == pytest.approx(0.25, rel=1e-6)
    # A nearly straight rod: a parabola of the same length.
    assert highest_mean(1.0 - 1e-8) == pytest.approx(math.sqrt(1e-8 / 6.0), rel=1e-3)


@pytest.mark.parametrize("seed", range(40))
def test_no_curve_lies_higher_and_a_catenary_reaches_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = np.cumsum(EDGES) - 0.5 * EDGES
    steep = rng.uniform(0.05, 3.0)
    arch = math.pi * rng.uniform(-0.5, 0.5) + np.arctan(steep * (1.0 - 2.0 * places))
    problem = closed(arch)
    highest = highest_mean(math.hypot(*problem.targets[:2]))
    assert mean_height(problem, arch) == pytest.approx(highest, rel=2e-3)
    for wave in rng.normal(0.0, 0.3, (20, 4)):
        bent = arch + sum(size * np.sin((i + 1) * math.pi * places) for i, size in enumerate(wave))
        problem = closed(bent)
        assert abs(mean_height(problem, bent)) <= highest_mean(math.hypot(*problem.targets[:2])) * (1.0 + 1e-12)


@pytest.mark.parametrize("chord", [0.8, 0.9, 0.95])
def test_a_sweep_stops_where_no_rod_can_follow(chord: float) -> None:
    rod = ScaledRod(0.0, np.empty(0), np.empty((0, 2)), np.array([chord, 0.0]), np.array([0.2, -0.3]))
    problem = held_in_height(make_problem(rod, mesh(rod.at, 24)))
    found = search_edges(rod, mesh(rod.at, 24))[0][1]
    assert found.filled[0] >= 2.0
    phi, held = found.shapes[0], np.append(found.multipliers[0], 0.0)
    highest = BEYOND * highest_mean(chord)
    assert not settle_at(problem, highest, phi.copy(), held.copy())
    # The height of the last try: without that stop it would be the first that fails.
    out = nothing_found(24), nowhere_near(24), no_ridge(24), np.zeros(CAPACITY)
    follow_heights(problem, (phi, held, math.nan), -1.0, out, 0.0)
    assert -highest <= problem.targets[2] < 0.0


def test_a_rod_on_a_saddle_is_nudged_out_of_its_symmetry() -> None:
    # A level rod held in a mean height near zero: the symmetric double arch is a saddle between two S.
    rod = ScaledRod(0.0, np.empty(0), np.empty((0, 2)), np.array([0.85, 0.0]), np.array([0.0, 0.0]))
    problem = held_in_height(make_problem(rod, mesh(rod.at, 24)))
    problem.targets[2] = 0.03
    places = np.cumsum(problem.edges) - 0.5 * problem.edges
    phi, forces = 0.9 * np.sin(2.0 * np.pi * places) * np.cos(2.0 * np.pi * places), np.zeros(3)
    iterations, unstable = newton(problem, phi, forces, Effort(0.3, 1e-9, 60))
    assert iterations > 0
    assert unstable == 1
    assert phi == pytest.approx(-phi[::-1], abs=1e-6)
    below = phi.copy()
    assert slip_from(problem, phi, below, forces)
    assert np.max(abs(below + below[::-1])) > 0.1


@pytest.mark.parametrize("seed", range(6))
def test_states_that_one_sweep_passes_are_found_from_each_of_them(seed: int) -> None:
    """What a sweep from one end of a way leaves out at the other end: every state is met from every other one."""
    rng = np.random.default_rng(seed)
    rod = ScaledRod(
        rng.uniform(0.0, 2.0), np.empty(0), np.empty((0, 2)), np.array([0.85, 0.05]), rng.uniform(-0.5, 0.5, 2)
    )
    found = search_edges(rod, mesh(rod.at, 24))[0][1]
    stable = [found.shapes[i] for i in range(int(found.filled[0])) if found.unstable[i] == 0.0]
    assert len(stable) >= 2
    for begin, other in itertools.permutations(range(len(stable)), 2):
        problem = held_in_height(make_problem(rod, mesh(rod.at, 24)))
        met = nothing_found(24)
        way = 1.0 if mean_height(problem, stable[other]) > mean_height(problem, stable[begin]) else -1.0
        held, start = np.zeros(3), stable[begin].copy()
        newton(released(problem), start, held[:2], Effort(0.3, 1e-9, 60))
        sweep_heights(problem, (start, held), way, met, nowhere_near(24))
        assert any(np.max(abs(met.shapes[i] - stable[other])) < 1e-3 for i in range(int(met.filled[0])))
