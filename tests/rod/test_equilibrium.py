"""The stated error bounds the true one, every outcome is said, and a state's numbers belong to its curve."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from clamped_rods import changed, rod_between
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.newton import Effort, descend, newton
from curveline.rod.problem import make_problem, mesh, sharpest_turn
from curveline.rod.states import equilibrium
from curveline.rod.states.equilibrium import Equilibrium, Outcome, refine
from curveline.rod.states.planar_states import find_states

from .rods import STIFFNESS, WEIGHT, distance, random_rods, simple

ROD = rod_between((0.5, 0.08), 0.6, -0.2, 0.66, 0.02, STIFFNESS, WEIGHT)


def peak(rod: ClampedRod, tolerance: float = 1e-9) -> Equilibrium:
    return next(state for state in find_states(rod, tolerance) if state.name == "peak")


def test_stated_error_bounds_the_true_error() -> None:
    ratios = []
    for rod in random_rods(11, 200):
        truths = simple(find_states(rod, 1e-9))
        for tolerance in (1e-3, 1e-4, 1e-5, 1e-6, 1e-7):
            for state in simple(find_states(rod, tolerance)):
                assert state.outcome is Outcome.CONVERGED
                assert state.error <= tolerance
                truth = min(truths, key=lambda other: distance(other, state.curve(51)))
                ratios.append(distance(truth, state.curve(301)) / (state.error + truth.error))
    print(f"true over stated error of {len(ratios)} states: median {np.median(ratios):.2f}, worst {max(ratios):.2f}")
    assert np.mean(np.array(ratios) <= 1.0) >= 0.99
    assert max(ratios) < 2.0
    # A bound that is far too large would hold just as well.
    assert np.median(ratios) > 0.2


def test_the_edge_limit_is_said_to_be_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(equilibrium, "MOST_EDGES", 100)
    edges = mesh(np.empty(0), 24)
    state = refine(ROD, edges, *peak(ROD).start_on(edges), 1e-9)
    assert state.outcome is Outcome.COARSE
    assert state.vertices <= 101
    assert state.error > 1e-9
    assert state.stable


def test_a_saddle_is_called_unstable() -> None:
    # The S between the two arches of a level rod.
    rod = rod_between((0.5, 0.0), 0.0, 0.0, 0.6, 0.0, 1.0, 0.0)
    n = 48
    problem = make_problem(rod.scaled(), mesh(np.empty(0), n))
    phi = np.cos(2.0 * np.pi * (np.arange(n) + 0.5) / n) - 1.0
    multipliers = np.array([80.0, 0.0])
    iterations, unstable = newton(problem, phi, multipliers, Effort(0.3, 1e-9, 60))
    assert iterations > 0
    assert unstable > 0
    state = refine(rod, problem.edges, phi, multipliers, 1e-6)
    assert state.outcome is Outcome.UNSTABLE
    assert not state.stable
    assert state.lowest_eigenvalue < 0.0


@pytest.mark.parametrize("n", [6, 8, 12])
def test_a_state_of_the_coarse_rod_alone_is_called_lost(n: int) -> None:
    # A few edges can turn right over, which no smooth curve follows; more edges lose such a state at any level.
    rng = np.random.default_rng(1)
    problem = make_problem(ROD.scaled(), mesh(np.empty(0), n))
    lost = 0
    for _ in range(100):
        phi, multipliers = rng.normal(0.0, 2.5, n), np.zeros(2)
        if descend(problem, phi, multipliers, Effort(0.5, 1e-9, 200)) < 0 or sharpest_turn(problem, phi) < 3.5:
            continue
        state = refine(ROD, problem.edges, phi, multipliers, 1e-5)
        if state.outcome is Outcome.LOST:
            lost += 1
            assert state.error == math.inf
            assert not state.stable
            assert len(state.curve(5)) == 5
    assert lost >= 2


def test_every_outcome_is_a_sentence() -> None:
    assert all(len(outcome.value) > 20 for outcome in Outcome)


@pytest.mark.parametrize("clamp", [0.0, 0.02, 0.1])
@pytest.mark.parametrize("points", [2, 33, 201])
def test_curve_leads_from_pivot_to_pivot_and_is_straight_in_the_bearings(clamp: float, points: int) -> None:
    rod = changed(ROD, clamp=clamp)
    for state in find_states(rod, 1e-6):
        curve = state.curve(points)
        assert curve.shape == (points, 2)
        np.testing.assert_array_equal(curve[0], [0.0, 0.0])
        np.testing.assert_allclose(curve[-1], rod.chord, atol=state.error + 1e-12)
        held = np.linspace(0.0, rod.length, points) < 0.5 * clamp
        for start, angle in ((curve, rod.start), (rod.chord - curve[::-1], rod.end)):
            off = start[held] @ [-math.sin(angle), math.cos(angle)]
            np.testing.assert_allclose(off, 0.0, atol=1e-12)


def test_points_of_a_curve_are_equally_spaced_in_arc_length() -> None:
    for state in find_states(ROD, 1e-6):
        chords = np.linalg.norm(np.diff(state.curve(2001), axis=0), axis=1)
        np.testing.assert_allclose(chords, ROD.length / 2000, rtol=1e-4)


def test_natural_curvature_moves_energy_and_moments_but_not_the_curve() -> None:
    straight = peak(ROD, 1e-6)
    bent = peak(changed(ROD, natural_curvature=2.0), 1e-6)
    np.testing.assert_allclose(bent.curve(51), straight.curve(51), atol=1e-14)
    np.testing.assert_allclose(bent.clamp_force, straight.clamp_force)
    moment = 2.0 * STIFFNESS
    np.testing.assert_allclose(bent.clamp_moment, straight.clamp_moment + np.array([moment, -moment]))
    # EI / 2 times the integral of (k - k0)^2 - k^2 depends on the ends' angles alone.
    shift = STIFFNESS * 2.0 * (0.5 * 2.0 * ROD.free_length - (ROD.end - ROD.start))
    assert bent.energy - straight.energy == pytest.approx(shift)
    assert bent.lowest_eigenvalue == straight.lowest_eigenvalue
    assert bent.max_curvature == pytest.approx(abs(straight.vertices_table[:, 3] - 2.0).max())


def turning(place: Sequence[float], force: Sequence[float]) -> float:
    """Moment of a force about the left pivot."""
    return place[0] * force[1] - place[1] * force[0]


LOADED = {
    "one": ((0.4, 0.3, -0.8),),
    "two": ((0.25, 0.0, -0.6), (0.7, 0.2, 0.5)),
    "two at one place": ((0.5, 0.0, -0.3), (0.5, 0.1, -0.3)),
}


@pytest.mark.parametrize("loads", LOADED.values(), ids=LOADED)
def test_forces_and_moments_balance_under_point_loads(loads: tuple[tuple[float, float, float], ...]) -> None:
    rod = changed(ROD, loads=loads)
    for state in find_states(rod, 1e-8):
        curve = state.curve(20001)
        places = np.linspace(0.0, rod.length, 20001)
        hung = np.array([np.interp(load[0] * rod.length, places, curve[:, 0]) for load in loads])
        held = np.array([np.interp(load[0] * rod.length, places, curve[:, 1]) for load in loads])
        force = np.array([load[1:] for load in loads])
        weight = rod.weight * rod.free_length
        np.testing.assert_allclose(state.clamp_force.sum(axis=0) + force.sum(axis=0), [0.0, weight], atol=1e-12)
        free = curve[(places >= 0.01) & (places <= rod.length - 0.01)]
        end = np.array(rod.free_start) + rod.free_chord
        moments = [
            *state.clamp_moment,
            turning(rod.free_start, state.clamp_force[0]),
            turning(end, state.clamp_force[1]),
            *(hung * force[:, 1] - held * force[:, 0]),
            -weight * free[:, 0].mean(),
        ]
        assert sum(moments) == pytest.approx(0.0, abs=2e-5 * max(abs(value) for value in moments))


def test_the_numbers_of_a_state_are_plain_ones() -> None:
    plain = {key: value for key, value in vars(peak(ROD)).items() if isinstance(value, bool | int | float | np.generic)}
    assert {"stable", "error", "energy", "vertices", "mean_height", "clearance"} <= set(plain)
    assert {key: type(value) for key, value in plain.items() if isinstance(value, np.generic)} == {}
    assert json.loads(json.dumps(plain)) == plain


def test_a_state_with_other_values_is_a_new_one_that_is_as_fixed_as_the_first() -> None:
    state = peak(ROD)
    other = state.but(name="other", wanted=True)
    assert vars(other) == vars(replace(state, name="other", wanted=True))
    assert (state.name, state.wanted) == ("peak", False)
    with pytest.raises(FrozenInstanceError):
        other.name = "third"  # type: ignore[misc]


def test_two_loads_at_one_place_act_like_their_sum() -> None:
    two = peak(changed(ROD, loads=LOADED["two at one place"]), 1e-7)
    one = peak(changed(ROD, loads=((0.5, 0.1, -0.6),)), 1e-7)
    np.testing.assert_allclose(two.curve(101), one.curve(101), atol=2e-7)
    assert two.energy == pytest.approx(one.energy, rel=1e-6)


def test_clamp_forces_and_moments_are_slopes_of_the_energy() -> None:
    step = 1e-5
    state = peak(ROD)
    for axis in (0, 1):
        chord = np.array(ROD.chord)
        ends = [peak(changed(ROD, chord=tuple(chord + way * step * np.eye(2)[axis]))).energy for way in (1, -1)]
        slope = (ends[0] - ends[1]) / (2 * step)
        assert abs(slope) > 0.01
        assert state.clamp_force[1, axis] == pytest.approx(slope, rel=1e-5)
    turned = [peak(changed(ROD, end=ROD.end + way * step)).energy for way in (1, -1)]
    # Turning the node also swings the place where the free rod ends about the pivot.
    arm = 0.5 * ROD.clamp * np.array([math.sin(ROD.end), -math.cos(ROD.end)])
    about_pivot = state.clamp_moment[1] + arm @ state.clamp_force[1]
    assert about_pivot == pytest.approx((turned[0] - turned[1]) / (2 * step), rel=1e-5)
