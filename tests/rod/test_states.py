"""Every stable state is found, none is invented or met twice, also near folds; and how states are named."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from clamped_rods import changed, rod_between
from curveline.rod.branches.continuation import coarse_start, follow
from curveline.rod.branches.control_path import straight_path
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.newton import Effort, descend, newton
from curveline.rod.problem import Array, Problem, make_problem, mesh, sharpest_turn
from curveline.rod.states.equilibrium import Equilibrium, Outcome, refine
from curveline.rod.states.identity import named
from curveline.rod.states.planar_states import find_states

from .rods import distance, random_rods, simple

SCENES = random_rods(20240229, 144)
TRIES = 60
EDGES = 48
RELAX = Effort(turn=0.5, close=1e-9, iterations=200)
JUMP = Effort(turn=0.4, close=1e-9, iterations=60)


def random_start(problem: Problem, rng: np.random.Generator) -> Array:
    """Edge angles: the clamps' blended, plus a few waves of any size."""
    places = (np.arange(problem.edges.size) + 0.5) / problem.edges.size
    phi = problem.ends[0] + places * (problem.ends[1] - problem.ends[0])
    for wave in range(1, 5):
        phi = phi + rng.normal(0.0, 1.0) * np.sin(math.pi * wave * places)
    return np.asarray(phi)


def brute_force(rod: ClampedRod, rng: np.random.Generator) -> list[Equilibrium]:
    """Simple stable states met from random starts, by descent and by Newton, without anything `find_states` uses."""
    scaled = rod.scaled()
    edges = mesh(scaled.at, EDGES)
    problem = make_problem(scaled, edges)
    states: list[Equilibrium] = []
    shapes: list[Array] = []
    for attempt in range(TRIES):
        phi, multipliers = random_start(problem, rng), np.zeros(2)
        if attempt % 2:
            iterations, unstable = newton(problem, phi, multipliers, JUMP)
        else:
            iterations, unstable = descend(problem, phi, multipliers, RELAX), 0
        if iterations < 0 or unstable != 0 or sharpest_turn(problem, phi) > 1.0:
            continue
        if any(np.max(abs(phi - other)) < 1e-6 for other in shapes):
            continue
        shapes.append(phi.copy())
        state = refine(rod, edges, phi, multipliers, 1e-5)
        if state.outcome is Outcome.CONVERGED and state.simple:
            states.append(state)
    return states


def test_brute_force_meets_nothing_that_the_search_missed() -> None:
    rng = np.random.default_rng(7)
    counts = {1: 0, 2: 0}
    met = 0
    for number, rod in enumerate(SCENES):
        states = simple(find_states(rod, 1e-5))
        counts[len(states)] += 1
        for other in brute_force(rod, rng):
            met += 1
            nearest = min(distance(state, other.curve(101)) for state in states)
            assert nearest < 1e-4, f"scene {number} has a state that was not found: {rod}"
    print(f"{met} states met by brute force; scenes with one and two states: {counts}")
    assert met >= 260
    assert counts[1] >= 10
    assert counts[2] >= 70


def resolved(state: Equilibrium, n: int) -> float:
    """Distance of a state [m] to the equilibrium that Newton reaches from it on n edges; infinite if not stable."""
    scaled = state.rod.scaled()
    problem = make_problem(scaled, mesh(scaled.at, n))
    phi, multipliers = coarse_start(state, n)
    iterations, unstable = newton(problem, phi, multipliers, JUMP)
    if iterations < 0 or unstable != 0:
        return math.inf
    steps = np.column_stack([np.cos(phi), np.sin(phi)]) * problem.edges[:, None]
    ends = np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)]) * state.rod.free_length + state.rod.free_start
    places = state.rod.clamp / 2 + np.linspace(0.0, state.rod.free_length, n + 1)
    fine = state.curve(4001)
    every = np.linspace(0.0, state.rod.length, 4001)
    ours = np.column_stack([np.interp(places, every, fine[:, axis]) for axis in (0, 1)])
    return float(np.max(np.linalg.norm(ours - ends, axis=1)))


def test_no_state_is_invented_and_none_comes_twice() -> None:
    for rod in SCENES:
        states = find_states(rod, 1e-5)
        assert 1 <= len(simple(states)) <= 2
        for i, state in enumerate(states):
            assert state.stable
            assert state.outcome is Outcome.CONVERGED
            assert resolved(state, 800) < 2e-5
            assert all(distance(state, other.curve(101)) > 1e-3 for other in states[:i])


def to_the_fold(rod: ClampedRod) -> tuple[ClampedRod, ClampedRod, float] | None:
    """Turn both ends against the lower-lying state until it is lost: the rod before, far past, and the fraction."""
    state = simple(find_states(rod, 1e-5))[-1]
    sign = -1.0 if state.mean_height > 0.0 else 1.0
    end = changed(rod, start=rod.start + sign * 1.4, end=rod.end - sign * 1.0)
    reached = follow(straight_path(rod.pose, end.pose), rod.bearing, *coarse_start(state, 192)).reached
    return (rod, end, float(reached)) if 0.01 < reached < 1.0 else None


def between(begin: ClampedRod, end: ClampedRod, fraction: float) -> ClampedRod:
    return changed(
        begin,
        start=begin.start + fraction * (end.start - begin.start),
        end=begin.end + fraction * (end.end - begin.end),
    )


@pytest.mark.parametrize("back", [1e-2, 1e-3])
def test_states_about_to_vanish_at_a_fold_are_found(back: float) -> None:
    tried = found = 0
    for rod in SCENES:
        fold = to_the_fold(rod)
        if fold is None:
            continue
        begin, end, reached = fold
        near = between(begin, end, reached * (1.0 - back))
        followed = follow(
            straight_path(begin.pose, near.pose),
            begin.bearing,
            *coarse_start(simple(find_states(begin, 1e-5))[-1], 192),
        )
        assert followed.reached == 1.0
        truth = refine(near, np.full(192, 1.0 / 192), followed.phi, followed.multipliers, 1e-6)
        if not (truth.stable and truth.simple and truth.outcome is Outcome.CONVERGED):
            continue
        tried += 1
        found += min(distance(state, truth.curve(101)) for state in find_states(near, 1e-6)) < 1e-4
    print(f"{found} of {tried} states found {100 * back} % before their fold")
    assert tried >= 100
    assert found >= 0.95 * tried


def test_past_the_fold_the_state_is_gone() -> None:
    for rod in SCENES[:20]:
        fold = to_the_fold(rod)
        if fold is None:
            continue
        begin, end, reached = fold
        state = simple(find_states(begin, 1e-5))[-1]
        last = between(begin, end, 0.999 * reached)
        followed = follow(straight_path(begin.pose, last.pose), begin.bearing, *coarse_start(state, 192))
        lost = refine(last, np.full(192, 1.0 / 192), followed.phi, followed.multipliers, 1e-6)
        after = find_states(between(begin, end, min(1.0, 1.01 * reached)), 1e-5)
        assert after
        assert min(distance(state, lost.curve(101)) for state in after) > 5e-3


Fake = dict[str, Any]


def faked(height: float, *, winding: int = 0, crosses: bool = False, wraps: bool = False) -> Fake:
    return {"mean_height": height, "winding": winding, "crosses_itself": crosses, "wraps_clamp": wraps}


@pytest.fixture(scope="module")
def plain() -> Equilibrium:
    return find_states(rod_between((0.5, 0.0), 0.0, 0.0, 0.6, 0.02, 0.028, 0.47), 1e-4)[0]


@pytest.mark.parametrize(
    ("states", "names"),
    [
        ([], []),
        ([faked(0.1)], ["peak"]),
        ([faked(-0.1)], ["valley"]),
        ([faked(-0.1), faked(0.1)], ["peak", "valley"]),
        ([faked(-0.2), faked(-0.1)], ["peak", "valley"]),
        ([faked(0.0), faked(-0.1), faked(0.1)], ["peak", "middle-1", "valley"]),
        ([faked(0.0)], ["middle-1"]),
        ([faked(1e-9)], ["middle-1"]),
        ([faked(-1e-9)], ["middle-1"]),
        ([faked(0.1), faked(0.1), faked(-0.1)], ["middle-1", "middle-2", "valley"]),
        ([faked(0.1 + 1e-9), faked(-0.1), faked(0.1)], ["middle-1", "middle-2", "valley"]),
        ([faked(0.3, winding=1), faked(0.1)], ["peak", "loop-1"]),
        ([faked(0.3, crosses=True), faked(0.2, crosses=True)], ["crossing-1", "crossing-2"]),
        ([faked(0.3, wraps=True), faked(-0.2)], ["valley", "wrapped-1"]),
        ([faked(0.3, winding=-1, crosses=True), faked(0.2, winding=1)], ["loop-1", "loop-2"]),
    ],
)
def test_names_follow_height_and_what_a_display_can_show(
    plain: Equilibrium, states: list[Fake], names: list[str]
) -> None:
    assert [state.name for state in named([replace(plain, **each) for each in states])] == names


def test_of_two_the_peak_is_the_higher_of_three_the_middle_lies_between(plain: Equilibrium) -> None:
    states = [replace(plain, **faked(height)) for height in (0.0, -0.1, 0.1)]
    heights = {state.name: state.mean_height for state in named(states)}
    assert heights["peak"] > heights["middle-1"] > heights["valley"]


def test_heights_count_from_the_chord_not_from_the_ground() -> None:
    steep = find_states(rod_between((0.5, 0.3), 0.54, 0.54, 0.7, 0.0, 0.028, 0.0), 1e-4)
    assert [state.name for state in steep] == ["peak", "valley"]
    assert steep[0].mean_height > 0.0 > steep[1].mean_height


def test_a_rod_too_short_to_reach_has_no_state() -> None:
    assert find_states(rod_between((0.5, 0.0), 0.5, -0.5, 0.49, 0.02, 0.028, 0.47), 1e-4) == []


@pytest.mark.parametrize("angle", [0.8, 0.815, 0.8165, 0.8175])
def test_a_symmetric_state_just_before_its_pitchfork_is_found(angle: float) -> None:
    # On the coarse rod it is unstable already, and the sweep passes it on the asymmetric branch.
    states = find_states(rod_between((0.5, 0.0), angle, -angle, 0.6, 0.0, 1.0, 0.0), 1e-5)
    assert [state.name for state in states] == ["peak", "valley"]
    assert 0.0 < states[1].lowest_eigenvalue < 6.0


@pytest.mark.parametrize(
    ("angle_deg", "eigenvalue"),
    [(10.15, 1.7870), (10.152, 1.6192), (10.156, 1.2164), (10.160, 0.5829), (10.16115, math.nan), (10.162, 0.0)],
)
def test_a_state_just_before_its_fold_is_found_and_none_after(angle_deg: float, eigenvalue: float) -> None:
    # A strip 1 % longer than its span; by a spectral method (tests/completeness) its valley ends at 10.161195 deg.
    states = find_states(rod_between((0.5, 0.0), math.radians(angle_deg), 0.0, 0.505, 0.0, 0.0585, 0.0), 1e-4)
    assert [state.name for state in states] == (["peak", "valley"] if eigenvalue else ["peak"])
    if eigenvalue > 0.0:
        assert states[1].lowest_eigenvalue == pytest.approx(eigenvalue, rel=0.06)


def test_a_state_that_only_fine_edges_have_beside_a_saddle_is_found() -> None:
    # All but symmetric, 0.02 % before its fold, beside a cusp: coarse edges have passed it and show the saddle alone.
    rod = rod_between(
        (0.5, 4.4055149e-07), -1.0868559222744378, 1.0868546426965187, 0.87743012, 0.02, 0.00290677, 0.2163167
    )
    states = find_states(rod, 1e-4)
    assert [state.name for state in states] == ["peak", "valley"]
    assert 0.0 < states[0].lowest_eigenvalue < 0.05


@pytest.mark.parametrize(("share", "count"), [(0.999, 2), (0.9999, 2), (0.99999, 2), (1.00001, 1), (1.001, 1)])
def test_a_symmetric_state_ends_at_its_pitchfork_and_not_before(share: float, count: int) -> None:
    # Reference C: with 1.32 spans of rod and both ends turned against each other that is at 57.73902789 deg.
    angle = share * math.radians(57.73902789)
    assert len(find_states(rod_between((1.0, 0.0), angle, -angle, 1.32, 0.0, 1.0, 0.0), 1e-5)) == count


@pytest.mark.parametrize(
    ("share", "names"),
    [
        (0.98, ["peak", "valley"]),
        (0.995, ["peak", "valley"]),
        (0.9999, ["peak", "valley"]),
        (1.0001, ["valley"]),
        (1.01, ["valley"]),
    ],
)
def test_a_loaded_arch_is_found_until_it_snaps(share: float, names: list[str]) -> None:
    # Reference S1: a centre load of 166.4424 N on EI = 1 takes the arch's stability by a bifurcation.
    load = (0.5, 0.0, -166.442444794162 * share)
    states = find_states(rod_between((0.5, 0.0), 0.0, 0.0, 0.6, 0.0, 1.0, 0.0, loads=(load,)), 1e-5)
    assert [state.name for state in states] == names
