"""A followed state is the state that is there; folds are found where they are; what is lost lands in a stable state."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clamped_rods import changed, rod_between
from curveline.rod.branches.continuation import (
    FOLLOW_EDGES,
    Branch,
    coarse_start,
    follow,
    land,
    node_loads,
    perturbation,
    start_along,
    travel,
)
from curveline.rod.branches.control_path import (
    ControlPath,
    between,
    counts_along,
    loading,
    problem_at,
    rod_at,
    straight_path,
)
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.richardson import LOAD_POTENTIAL, STRAIN_ENERGY
from curveline.rod.problem import Array, make_problem, mesh
from curveline.rod.states.equilibrium import Equilibrium
from curveline.rod.states.planar_states import find_states

from .rods import STIFFNESS, WEIGHT, random_rods, solve_level

ROD = rod_between((0.5, 0.0), 0.2, -0.1, 0.64, 0.02, STIFFNESS, WEIGHT)
AWAY = changed(ROD, chord=(0.5, 0.1), start=0.5, end=-0.6, length=0.7)
LOSING = changed(ROD, start=1.2, end=-1.2)
PUSH = ((0.3, 0.0, 0.0), (0.62, 0.0, -0.4))


def state_of(rod: ClampedRod, name: str) -> Equilibrium:
    return next(state for state in find_states(rod, 1e-7) if state.name == name)


def way_of(begin: ClampedRod, end: ClampedRod) -> ControlPath:
    """The way from one rod to another that has loads at the same places."""
    (at, before), (_, after) = begin.dead_loads(), end.dead_loads()
    return ControlPath(begin.pose, end.pose, at, before, after)


def followed(begin: ClampedRod, end: ClampedRod, start: tuple[Array, Array]) -> Branch:
    branch: Branch = follow(way_of(begin, end), begin.bearing, *start)
    return branch


@pytest.mark.parametrize("loads", [(), PUSH])
@pytest.mark.parametrize("name", ["peak", "valley"])
def test_forward_and_backward_meet(name: str, loads: tuple[tuple[float, float, float], ...]) -> None:
    rod = changed(ROD, loads=loads)
    away = changed(AWAY, loads=tuple((at, x + 0.1, y - 0.2) for at, x, y in loads))
    start = solve_level(rod, FOLLOW_EDGES, *coarse_start(state_of(rod, name)))
    there = followed(rod, away, (start.phi, start.multipliers))
    assert there.reached == 1.0
    back = followed(away, rod, (there.phi, there.multipliers))
    assert back.reached == 1.0
    assert np.max(abs(there.phi - start.phi)) > 0.1
    np.testing.assert_allclose(back.phi, start.phi, atol=1e-10)
    np.testing.assert_allclose(back.multipliers, start.multipliers, atol=1e-8)


@pytest.mark.parametrize("name", ["peak", "valley"])
def test_the_state_followed_is_the_one_found_there(name: str) -> None:
    branch = followed(ROD, AWAY, coarse_start(state_of(ROD, name)))
    np.testing.assert_allclose(branch.phi, coarse_start(state_of(AWAY, name))[0], atol=5e-3)
    assert list(branch.fractions) == sorted(branch.fractions)
    assert branch.fractions[0] == 0.0
    assert branch.fractions[-1] == 1.0
    assert np.all(branch.lowest > 0.0)


@pytest.mark.parametrize("name", ["peak", "valley"])
def test_edges_meet_at_the_loads_while_the_length_changes(name: str) -> None:
    begin, end = changed(ROD, loads=PUSH), changed(AWAY, loads=PUSH)
    way = way_of(begin, end)
    counts = counts_along(way, begin.bearing, FOLLOW_EDGES)
    assert counts.sum() == FOLLOW_EDGES
    for fraction, rod in ((0.0, begin), (1.0, end)):
        problem = problem_at(way, begin.bearing, fraction, counts)
        vertices = rod.free_length * np.cumsum(problem.edges)
        for at, _, _ in PUSH:
            assert min(abs(vertices - (at * rod.length - 0.5 * rod.clamp))) < 1e-15
    branch = follow(way, begin.bearing, *start_along(way, state_of(begin, name)))
    level = solve_level(end, FOLLOW_EDGES, branch.phi, branch.multipliers)
    np.testing.assert_allclose(level.phi, branch.phi, atol=1e-3)
    np.testing.assert_allclose(branch.phi, coarse_start(state_of(end, name))[0], atol=6e-3)


def test_too_few_edges_for_the_loads_are_not_followed() -> None:
    way = way_of(changed(ROD, loads=PUSH), changed(AWAY, loads=PUSH))
    assert follow(way, ROD.bearing, np.zeros(5), np.zeros(2)).wrenches.shape == (0, 6)
    assert travel(way, ROD.bearing, np.zeros(5), np.zeros(2))[0] == 0.0
    assert not land(way, 0.0, ROD.bearing, np.zeros(5), np.zeros(2), np.zeros(5))[0]


@pytest.mark.parametrize("change", [{"start": 1.2}, {"start": 1.2, "end": -1.3}, {"length": 0.52, "start": 0.9}])
def test_a_fold_is_found_at_the_same_place_whatever_the_path_beyond(change: dict[str, float]) -> None:
    start = coarse_start(state_of(ROD, "valley"))
    end = changed(ROD, **change)
    short = followed(ROD, end, start)
    assert 0.05 < short.reached < 1.0
    beyond = between(ROD.pose, end.pose, 1.0 + 0.3 * math.pi)
    far = follow(straight_path(ROD.pose, beyond), ROD.bearing, *start)
    assert far.reached * (1.0 + 0.3 * math.pi) == pytest.approx(short.reached, abs=1e-6)
    lowest = short.lowest
    assert 0.0 < lowest[-1] < 0.1 < lowest[0]


@pytest.mark.parametrize("seed", range(8))
def test_to_travel_is_to_follow_without_looking(seed: int) -> None:
    begin, end = random_rods(seed, 2)
    for state in find_states(begin, 1e-5):
        if state.simple:
            branch = followed(begin, end, coarse_start(state))
            reached, phi, multipliers, _ = travel(
                straight_path(begin.pose, end.pose), begin.bearing, *coarse_start(state)
            )
            assert reached == pytest.approx(branch.reached, abs=3e-6)
            if reached == 1.0:
                np.testing.assert_allclose(phi, branch.phi, atol=1e-9)
                np.testing.assert_allclose(multipliers, branch.multipliers, atol=1e-7)


def pushed(length: float, load: float) -> ClampedRod:
    """A symmetric rod between level clamps, a unit apart, with a load in the middle that leaves it symmetric."""
    return rod_between((1.0, 0.0), 0.0, 0.0, length, 0.0, 1.0, 0.0, loads=((0.5, 0.0, -load),))


def symmetric_arch(length: float) -> tuple[Array, Array]:
    rod = pushed(length, 0.0)
    level = solve_level(rod, FOLLOW_EDGES, *coarse_start(state_of(rod, "peak")))
    return 0.5 * (level.phi - level.phi[::-1]), level.multipliers * [1.0, 0.0]


def test_a_dip_of_the_eigenvalue_is_not_stepped_over() -> None:
    # The load that a long arch bears falls ever less steeply with its length: a straight way that touches this curve
    # leaves the stable shapes for a part of it that is shorter than a step.
    def limit(length: float) -> float:
        return 40.0 * float(followed(pushed(length, 0.0), pushed(length, 40.0), symmetric_arch(length)).reached)

    middle, slope = limit(3.0), (limit(3.02) - limit(2.98)) / 0.04
    begin, end = (pushed(length, middle + 1e-3 + slope * (length - 3.0)) for length in (2.6 + 1 / 60, 3.4 + 1 / 60))
    there = followed(pushed(begin.length, 0.0), begin, symmetric_arch(begin.length))
    assert there.reached == 1.0
    phi, multipliers = there.phi, there.multipliers
    for step in range(25):
        length = begin.length + (end.length - begin.length) * step / 24.0
        here = pushed(length, middle + 1e-3 + slope * (length - 3.0))
        branch = followed(here, here, (phi, multipliers))
        assert branch.reached == 1.0
        phi, multipliers = branch.phi, branch.multipliers
    assert 0.45 < followed(begin, end, (there.phi, there.multipliers)).reached < 0.48


def test_an_unstable_or_absent_start_is_not_followed() -> None:
    phi = np.full(FOLLOW_EDGES, 2.0)
    branch = follow(straight_path(ROD.pose, AWAY.pose), ROD.bearing, phi, np.zeros(2))
    assert branch.fractions.size == 0
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
    rod = changed(random_rods(3, 6)[number], natural_curvature=natural)
    for state in find_states(rod, 1e-7):
        level = solve_level(rod, 400, *coarse_start(state, 400))
        free = make_problem(rod.scaled(), mesh(np.empty(0), 400))
        here = straight_path(rod.pose, rod.pose)
        bent, held = node_loads(here, 0.0, rod.bearing, free, level.phi, level.multipliers)
        assert bent == pytest.approx(state.max_curvature, rel=1e-2)
        for side, (angle, sign) in enumerate(((rod.start, 1.0), (rod.end, -1.0))):
            along, up, moment = held[3 * side : 3 * side + 3]
            force = state.clamp_force[side]
            bend = state.vertices_table[-side, 3]
            given = force @ [math.cos(angle), math.sin(angle)] - sign * 0.5 * STIFFNESS * (bend**2 - natural**2)
            scale = np.hypot(*force)
            assert along == pytest.approx(given, abs=1e-3 * (scale + 0.5 * STIFFNESS * bend**2))
            assert up == pytest.approx(force[1], abs=1e-3 * scale)
            assert moment == pytest.approx(moments_about_pivots(state)[side], rel=1e-3, abs=1e-5)


def energy_of(rod: ClampedRod, start: Equilibrium) -> float:
    """Energy [J] of the state near another one, with heights counted from the left pivot."""
    level = solve_level(rod, 400, *coarse_start(start, 400))
    stored = (level.scalars[STRAIN_ENERGY] + level.scalars[LOAD_POTENTIAL]) * rod.stiffness / rod.free_length
    natural = rod.natural_curvature
    stored += rod.stiffness * natural * (0.5 * natural * rod.free_length - (rod.end - rod.start))
    below = rod.free_start
    stored += rod.weight * rod.free_length * below[1] - sum(load.x * below[0] + load.y * below[1] for load in rod.loads)
    return float(stored)


SLOPES = {
    "x": lambda rod, d: changed(rod, chord=(rod.chord[0] + d, rod.chord[1])),
    "height": lambda rod, d: changed(rod, chord=(rod.chord[0], rod.chord[1] + d)),
    "start": lambda rod, d: changed(rod, start=rod.start + d),
    "end": lambda rod, d: changed(rod, end=rod.end + d),
    "length": lambda rod, d: changed(rod, length=rod.length + d),
}


@pytest.mark.parametrize("natural", [0.0, 1.5])
@pytest.mark.parametrize("number", range(4))
def test_what_the_nodes_do_is_the_slope_of_the_energy(number: int, natural: float) -> None:
    rod = changed(random_rods(17, 4)[number], natural_curvature=natural)
    if number > 1:
        rod = changed(rod, loads=((0.5, 0.1, -0.3),))
    state = find_states(rod, 1e-7)[0]
    level = solve_level(rod, 400, *coarse_start(state, 400))
    way = way_of(rod, rod)
    free = problem_at(way, rod.bearing, 0.0, counts_along(way, rod.bearing, 400))
    held = node_loads(way, 0.0, rod.bearing, free, level.phi, level.multipliers)[1]
    tangents = level.table[200 : 200 + len(rod.loads), 2]
    slopes = {
        what: (energy_of(change(rod, 1e-5), state) - energy_of(change(rod, -1e-5), state)) / 2e-5
        for what, change in SLOPES.items()
    }
    assert held[2] == pytest.approx(slopes["start"], rel=1e-4, abs=1e-5)
    assert held[5] == pytest.approx(slopes["end"], rel=1e-4, abs=1e-5)
    assert held[4] == pytest.approx(slopes["height"], rel=1e-4, abs=1e-4)
    # A load stays at its fraction of the length: where the rod is fed past it, it works along the rod.
    along = sum(
        load.x * math.cos(angle) + load.y * math.sin(angle) for load, angle in zip(rod.loads, tangents, strict=True)
    )
    # Rod that leaves a bearing has been brought to that height by what feeds it there.
    left = rod.weight * rod.free_start[1]
    right = left + rod.weight * rod.free_chord[1]
    assert held[0] + 0.5 * along + left == pytest.approx(slopes["length"], rel=1e-4)
    assert -held[3] - 0.5 * along + right == pytest.approx(slopes["length"], rel=1e-4)


@pytest.mark.parametrize("name", ["peak", "valley"])
def test_what_is_lost_lands_in_a_stable_state(name: str) -> None:
    sign = 1.0 if name == "valley" else -1.0
    end = changed(ROD, start=sign * 1.2, end=-sign * 1.2)
    way = straight_path(ROD.pose, end.pose)
    branch = follow(way, ROD.bearing, *coarse_start(state_of(ROD, name)))
    assert branch.reached < 1.0
    landed, angles, forces = land(way, 1.0, end.bearing, branch.phi, branch.multipliers, perturbation(FOLLOW_EDGES))
    assert landed
    level = solve_level(end, FOLLOW_EDGES, angles, forces)
    assert level.unstable == 0
    np.testing.assert_allclose(level.phi, angles, atol=1e-9)
    (left,) = (state for state in find_states(end, 1e-6) if state.simple)
    assert left.name != name
    assert np.max(abs(coarse_start(left)[0] - angles)) < 0.02


def test_a_load_too_makes_the_rod_fall() -> None:
    state = state_of(ROD, "peak")
    way = loading(ROD.pose, np.array([0.4]), np.zeros((1, 2)), np.array([[0.0, -12.0]]))
    branch = follow(way, ROD.bearing, *start_along(way, state))
    assert 0.1 < branch.reached < 1.0
    landed, angles, forces = land(way, 1.0, ROD.bearing, branch.phi, branch.multipliers, perturbation(FOLLOW_EDGES))
    assert landed
    loaded = changed(ROD, loads=((0.4, 0.0, -12.0),))
    assert solve_level(loaded, FOLLOW_EDGES, angles, forces).unstable == 0
    edges = mesh(rod_at(way, ROD.bearing, 1.0).at, FOLLOW_EDGES)
    assert edges @ np.sin(branch.phi) == pytest.approx(0.0, abs=1e-2)
    assert np.cumsum(edges * np.sin(angles)).min() < -0.1


def test_a_perfectly_symmetric_rod_still_falls_off_its_dead_branch() -> None:
    rod = changed(ROD, start=0.0, end=0.0, clamp=0.0, weight=0.0)
    end = changed(rod, start=1.0, end=-1.0)
    places = (np.arange(FOLLOW_EDGES) + 0.5) / FOLLOW_EDGES
    valley = solve_level(rod, FOLLOW_EDGES, -np.sin(2.0 * np.pi * places), np.array([45.0, 0.0]))
    np.testing.assert_allclose(valley.phi, -valley.phi[::-1], atol=1e-10)
    way = straight_path(rod.pose, end.pose)
    branch = follow(way, rod.bearing, valley.phi, valley.multipliers)
    assert branch.reached < 1.0
    # Just past the pitchfork the symmetric valley is still there, as a saddle.
    past = changed(rod, start=1.0005 * branch.reached, end=-1.0005 * branch.reached)
    saddle = solve_level(past, FOLLOW_EDGES, branch.phi, branch.multipliers)
    assert saddle.unstable == 1
    way = straight_path(past.pose, past.pose)
    landed, angles, _ = land(way, 0.0, past.bearing, saddle.phi, saddle.multipliers, perturbation(FOLLOW_EDGES))
    assert landed
    assert np.sum(np.sin(angles[: FOLLOW_EDGES // 2])) > 0.0
