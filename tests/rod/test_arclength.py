"""A traced branch consists of equilibria, passes folds both ways alike, and keeps to itself where others come near."""

from __future__ import annotations

import numpy as np
import pytest

from clamped_rods import changed, rod_between
from curveline.rod.branches.arclength import (
    TraceReach,
    Track,
    begin_at,
    residual,
    slope_along,
    solve_bordered,
    tangent_at,
    trace,
    weighted,
)
from curveline.rod.branches.continuation import FOLLOW_EDGES, coarse_start, follow, start_along
from curveline.rod.branches.control_path import ControlPath, between, counts_along, problem_at, straight_path
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.modes import second_variation
from curveline.rod.planar.newton import energy
from curveline.rod.problem import Array, Problem
from curveline.rod.states.planar_states import find_states

from .rods import random_rods, solve_level
from .test_continuation import ROD, state_of, symmetric_arch, way_of
from .test_special_points import press

LOADED = changed(ROD, loads=((0.3, 0.0, 0.0), (0.62, 0.1, -0.1)))
MOVED = changed(ROD, chord=(0.49, 0.05), start=1.1, end=-0.4, length=0.62, loads=((0.3, -0.2, 0.3), (0.62, 0.0, -0.4)))
SOFT = 2e-5
"""Compliance of a rod that stretches enough to be seen [m^2]."""


def point_of(way: ControlPath, rod: ClampedRod, compliance: float = 0.0) -> tuple[Array, Array]:
    """Edge counts and a point, no equilibrium, of a way."""
    counts = counts_along(way, rod.bearing, FOLLOW_EDGES)
    phi, multipliers = start_along(way, state_of(rod, "valley"))
    rng = np.random.default_rng(8)
    return counts, np.concatenate([phi + 0.1 * rng.standard_normal(phi.size), multipliers, [0.3]])


def lagrangian(problem: Problem, point: Array) -> float:
    """Energy of an inextensible rod plus its constraints with their multipliers."""
    n = problem.edges.size
    phi, multipliers = point[:n], point[n : n + 2]
    reach = np.array([problem.edges @ np.cos(phi), problem.edges @ np.sin(phi)])
    return float(energy(problem, phi, multipliers) + multipliers @ (reach - problem.targets))


def test_the_residual_is_the_slope_of_the_lagrangian() -> None:
    way = way_of(LOADED, MOVED)
    counts, point = point_of(way, LOADED)
    problem = problem_at(way, LOADED.bearing, 0.3, counts)
    given = residual(problem, point)
    assert np.max(abs(given)) > 1.0
    for i in range(point.size - 1):
        step = np.zeros(point.size)
        step[i] = 1e-5
        slope = (lagrangian(problem, point + step) - lagrangian(problem, point - step)) / 2e-5
        assert given[i] == pytest.approx(slope, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("compliance", [0.0, SOFT])
def test_the_bordered_system_is_that_of_the_derivatives(compliance: float) -> None:
    way = way_of(LOADED, MOVED)
    bearing = LOADED.bearing._replace(compliance=compliance)
    counts, point = point_of(way, LOADED)
    n = FOLLOW_EDGES
    problem = problem_at(way, bearing, point[-1], counts)
    variation = second_variation(problem, point[:n], point[n : n + 2])
    rng = np.random.default_rng(9)
    row, right = rng.standard_normal((2, n + 3))
    change = solve_bordered(problem, variation, slope_along(way, bearing, counts, point), row, right)
    assert row @ change == pytest.approx(right[-1], rel=1e-9)
    size = 1e-6 / np.max(abs(change[:n]))
    ends = [point + sign * size * change for sign in (1.0, -1.0)]
    there = [residual(problem_at(way, bearing, end[-1], counts), end) for end in ends]
    np.testing.assert_allclose((there[0] - there[1]) / (2.0 * size), right[:-1], rtol=1e-5, atol=1e-5)


def test_the_tangent_is_the_direction_of_the_branch() -> None:
    way = way_of(LOADED, MOVED)
    bearing = LOADED.bearing
    counts = counts_along(way, bearing, FOLLOW_EDGES)
    start = start_along(way, state_of(LOADED, "valley"))
    spots = [begin_at(way, bearing, counts, fraction, *start)[1] for fraction in (-1e-3, 0.0, 1e-3)]
    secant = spots[2].point - spots[0].point
    edges = problem_at(way, bearing, 0.0, counts).edges
    tangent = spots[1].tangent
    assert weighted(edges, tangent) @ tangent == pytest.approx(1.0)
    assert tangent[-1] > 0.0
    np.testing.assert_allclose(tangent / tangent[-1], secant / secant[-1], rtol=1e-4, atol=1e-4)
    back = tangent_at(way, bearing, counts, spots[1].point, -tangent)
    np.testing.assert_allclose(back, -tangent, rtol=1e-9)


@pytest.mark.parametrize("name", ["peak", "valley"])
def test_where_no_fold_lies_on_the_way_tracing_is_following(name: str) -> None:
    end = changed(ROD, chord=(0.5, 0.1), start=0.5, end=-0.6, length=0.7)
    way = straight_path(ROD.pose, end.pose)
    start = coarse_start(state_of(ROD, name))
    track = trace(way, ROD.bearing, *start, TraceReach())
    branch = follow(way, ROD.bearing, *start)
    assert branch.reached == 1.0
    assert track.fractions[-2] <= 1.0 < track.fractions[-1]
    assert not track.unstable.any()
    lowest = np.interp(track.fractions[:-1], branch.fractions, branch.lowest)
    np.testing.assert_allclose(track.lowest[:-1], lowest, rtol=0.02)
    level = solve_level(end, FOLLOW_EDGES, track.phi[-1], track.multipliers[-1])
    np.testing.assert_allclose(level.phi, branch.phi, atol=1e-9)


def test_around_a_fold_the_number_of_unstable_directions_grows_and_the_fraction_turns_back() -> None:
    way = straight_path(ROD.pose, changed(ROD, start=1.2).pose)
    start = coarse_start(state_of(ROD, "valley"))
    track = trace(way, ROD.bearing, *start, TraceReach(low=0.0))
    turn = int(np.argmax(track.fractions))
    assert 0 < turn < track.fractions.size - 1
    assert np.all(np.diff(track.fractions[: turn + 1]) > 0.0)
    assert np.all(np.diff(track.fractions[turn:]) < 0.0)
    lost = int(np.argmax(track.unstable))
    assert abs(lost - turn) <= 1
    assert not track.unstable[:lost].any()
    assert np.all(track.unstable[lost:] == 1.0)
    assert np.all((track.lowest > 0.0) == (track.unstable == 0.0))
    assert track.fractions.max() == pytest.approx(follow(way, ROD.bearing, *start).reached, rel=1e-2)
    counts = counts_along(way, ROD.bearing, FOLLOW_EDGES)
    for fraction, phi, multipliers in zip(track.fractions, track.phi, track.multipliers, strict=True):
        problem = problem_at(way, ROD.bearing, fraction, counts)
        assert np.max(abs(residual(problem, np.concatenate([phi, multipliers, [fraction]])))) < 1e-8


def turns_of(track: Track) -> int:
    """How often the fraction turns back."""
    return int(np.count_nonzero(np.diff(np.sign(np.diff(track.fractions)))))


def test_forward_and_backward_meet_around_folds() -> None:
    turns = []
    for begin in random_rods(41, 8):
        end = changed(begin, start=begin.start + 1.5, end=begin.end - 1.1)
        start = solve_level(begin, FOLLOW_EDGES, *coarse_start(find_states(begin, 1e-6)[-1]))
        there = trace(
            straight_path(begin.pose, end.pose), begin.bearing, start.phi, start.multipliers, TraceReach(0.0, 1.0)
        )
        turns.append(turns_of(there))
        # Back from its last state, on a way towards the first one.
        last = there.fractions[-1]
        poses = [between(begin.pose, end.pose, fraction) for fraction in (last, 0.0 if last > 0.5 else last + 1.0)]
        reach = TraceReach(-0.5, 1.05, 0.05, 1000)
        back = trace(straight_path(*poses), begin.bearing, there.phi[-1], there.multipliers[-1], reach)
        assert turns_of(back) == turns[-1]
        gaps = np.max(abs(back.phi - start.phi), axis=1)
        nearest = int(np.argmin(gaps))
        assert gaps[nearest] < 0.1
        home = solve_level(begin, FOLLOW_EDGES, back.phi[nearest], back.multipliers[nearest])
        np.testing.assert_allclose(home.phi, start.phi, atol=1e-9)
    assert {1, 2} <= set(turns)


@pytest.mark.parametrize("off", [1e-5, 1e-4, 2e-3])
def test_a_branch_that_another_one_nearly_crosses_is_not_left(off: float) -> None:
    # A load off centre parts the branches that cross at its bifurcation: the stable one turns back in a fold.
    rod = rod_between((1.0, 0.0), 0.0, 0.0, 1.2, 0.0, 1.0, 0.0)
    way = press(rod, 0.5 + off, 70.0)
    for step in (0.02, 0.1, 0.3):
        track = trace(way, rod.bearing, *start_along(way, state_of(rod, "peak")), TraceReach(0.0, 1.5, step))
        turn = int(np.argmax(track.unstable > 0.0))
        assert 70.0 * 1.44 * track.fractions[: turn + 1].max() < 59.92
        assert track.fractions[turn + 1] < track.fractions[turn]
        assert np.max(abs(track.phi[turn + 1] + track.phi[turn + 1][::-1])) > off ** (1.0 / 3.0)


def test_a_symmetric_branch_is_traced_on_past_its_bifurcation() -> None:
    rod = rod_between((1.0, 0.0), 0.0, 0.0, 1.2, 0.0, 1.0, 0.0)
    way = press(rod, 0.5, 300.0 / 1.44)
    track = trace(way, rod.bearing, *symmetric_arch(1.2), TraceReach())
    loads = 300.0 * track.fractions
    np.testing.assert_allclose(track.phi, -track.phi[:, ::-1], atol=1e-6)
    assert set(track.unstable[loads > 62.0]) >= {1.0, 2.0}
    assert not track.unstable[: int(np.argmax(loads > 58.0))].any()
    assert loads.max() == pytest.approx(240.31, rel=0.02)


def test_an_absent_equilibrium_is_not_traced() -> None:
    taut = changed(ROD, length=0.49)
    track = trace(straight_path(taut.pose, ROD.pose), ROD.bearing, *coarse_start(state_of(ROD, "peak")), TraceReach())
    assert track.fractions.size == 0
    assert track.phi.shape == (0, FOLLOW_EDGES)
