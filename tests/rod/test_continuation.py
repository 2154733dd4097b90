"""A followed state is the state that is there; folds are found where they are; what is lost lands in a stable state."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from curveline.rod.continuation import FOLLOW_EDGES, between, coarse_start, follow, land, node_loads
from curveline.rod.equilibrium import ClampedRod, Equilibrium
from curveline.rod.problem import make_problem, mesh, released
from curveline.rod.states import find_states

from .rods import STIFFNESS, WEIGHT, random_rods, solve_level

ROD = ClampedRod((0.5, 0.0), 0.2, -0.1, 0.64, 0.02, STIFFNESS, WEIGHT)
AWAY = replace(ROD, chord=(0.5, 0.1), start=0.5, end=-0.6, length=0.7)
LOSING = replace(ROD, start=1.2, end=-1.2)


def state_of(rod: ClampedRod, name: str) -> Equilibrium:
    return next(state for state in find_states(rod, 1e-7) if state.name == name)


@pytest.mark.parametrize("name", ["peak", "valley"])
def test_forward_and_backward_meet(name: str) -> None:
    start = solve_level(ROD, FOLLOW_EDGES, *coarse_start(state_of(ROD, name)))
    there = follow(ROD.pose, AWAY.pose, ROD.bearing, start.phi, start.multipliers)
    assert there.reached == 1.0
    back = follow(AWAY.pose, ROD.pose, ROD.bearing, there.phi, there.multipliers)
    assert back.reached == 1.0
    assert np.max(abs(there.phi - start.phi)) > 0.1
    np.testing.assert_allclose(back.phi, start.phi, atol=1e-10)
    np.testing.assert_allclose(back.multipliers, start.multipliers, atol=1e-8)


@pytest.mark.parametrize("name", ["peak", "valley"])
def test_the_state_followed_is_the_one_found_there(name: str) -> None:
    branch = follow(ROD.pose, AWAY.pose, ROD.bearing, *coarse_start(state_of(ROD, name)))
    np.testing.assert_allclose(branch.phi, coarse_start(state_of(AWAY, name))[0], atol=5e-3)
    assert list(branch.samples[:, 0]) == sorted(branch.samples[:, 0])
    assert branch.samples[0, 0] == 0.0
    assert branch.samples[-1, 0] == 1.0
    assert np.all(branch.samples[:, 1] > 0.0)


@pytest.mark.parametrize("change", [{"start": 1.2}, {"start": 1.2, "end": -1.3}, {"length": 0.52, "start": 0.9}])
def test_a_fold_is_found_at_the_same_place_whatever_the_path_beyond(change: dict[str, float]) -> None:
    start = coarse_start(state_of(ROD, "valley"))
    end = replace(ROD, **change)
    short = follow(ROD.pose, end.pose, ROD.bearing, *start)
    assert 0.05 < short.reached < 1.0
    beyond = between(ROD.pose, end.pose, 1.0 + 0.3 * math.pi)
    far = follow(ROD.pose, beyond, ROD.bearing, *start)
    assert far.reached * (1.0 + 0.3 * math.pi) == pytest.approx(short.reached, abs=1e-6)
    lowest = short.samples[:, 1]
    assert 0.0 < lowest[-1] < 0.1 < lowest[0]


def test_an_unstable_or_absent_start_is_not_followed() -> None:
    phi = np.full(FOLLOW_EDGES, 2.0)
    branch = follow(ROD.pose, AWAY.pose, ROD.bearing, phi, np.zeros(2))
    assert branch.samples.shape[0] == 0
    assert branch.reached == 0.0


def moments_about_pivots(state: Equilibrium) -> list[float]:
    rod = state.rod
    half = 0.5 * rod.clamp
    out = []
    for moment, force, angle, way in zip(
        state.clamp_moment, state.clamp_force, (rod.start, rod.end), (1.0, -1.0), strict=True
    ):
        arm = way * half * np.array([math.cos(angle), math.sin(angle)])
        out.append(float(moment + arm[0] * force[1] - arm[1] * force[0]))
    return out


@pytest.mark.parametrize("natural", [0.0, 1.5])
@pytest.mark.parametrize("number", range(6))
def test_what_the_nodes_hold_is_what_the_equilibrium_says(number: int, natural: float) -> None:
    rod = replace(random_rods(3, 6)[number], natural_curvature=natural)
    for state in find_states(rod, 1e-7):
        level = solve_level(rod, 400, *coarse_start(state, 400))
        free = released(make_problem(rod.scaled(), mesh(np.empty(0), 400)))
        bent, axial, vertical, moment = node_loads(rod.pose, rod.bearing, free, level.phi, level.multipliers)
        along = [
            force @ [math.cos(angle), math.sin(angle)]
            for force, angle in zip(state.clamp_force, (rod.start, rod.end), strict=True)
        ]
        assert bent == pytest.approx(state.max_curvature, rel=1e-2)
        assert axial == pytest.approx(max(abs(value) for value in along), rel=1e-3)
        assert vertical == pytest.approx(abs(state.clamp_force[:, 1]).max(), rel=1e-3)
        assert moment == pytest.approx(max(abs(value) for value in moments_about_pivots(state)), rel=1e-3)


@pytest.mark.parametrize("name", ["peak", "valley"])
def test_what_is_lost_lands_in_a_stable_state(name: str) -> None:
    sign = 1.0 if name == "valley" else -1.0
    end = replace(ROD, start=sign * 1.2, end=-sign * 1.2)
    branch = follow(ROD.pose, end.pose, ROD.bearing, *coarse_start(state_of(ROD, name)))
    assert branch.reached < 1.0
    landed, angles, forces = land(end.pose, end.bearing, branch.phi, branch.multipliers)
    assert landed
    level = solve_level(end, FOLLOW_EDGES, angles, forces)
    assert level.unstable == 0
    np.testing.assert_allclose(level.phi, angles, atol=1e-9)
    (left,) = (state for state in find_states(end, 1e-6) if state.simple)
    assert left.name != name
    assert np.max(abs(coarse_start(left)[0] - angles)) < 0.02


def test_a_perfectly_symmetric_rod_still_falls_off_its_dead_branch() -> None:
    rod = replace(ROD, start=0.0, end=0.0, clamp=0.0, weight=0.0)
    end = replace(rod, start=1.0, end=-1.0)
    places = (np.arange(FOLLOW_EDGES) + 0.5) / FOLLOW_EDGES
    valley = solve_level(rod, FOLLOW_EDGES, -np.sin(2.0 * np.pi * places), np.array([45.0, 0.0]))
    np.testing.assert_allclose(valley.phi, -valley.phi[::-1], atol=1e-10)
    branch = follow(rod.pose, end.pose, rod.bearing, valley.phi, valley.multipliers)
    assert branch.reached < 1.0
    # Just past the pitchfork the symmetric valley is still there, as a saddle.
    past = replace(rod, start=1.0005 * branch.reached, end=-1.0005 * branch.reached)
    saddle = solve_level(past, FOLLOW_EDGES, branch.phi, branch.multipliers)
    assert saddle.unstable == 1
    landed, angles, _ = land(past.pose, past.bearing, saddle.phi, saddle.multipliers)
    assert landed
    assert np.sum(np.sin(angles[: FOLLOW_EDGES // 2])) > 0.0
