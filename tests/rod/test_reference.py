"""Every answer of an independent solver, an order-16 collocation of the boundary value problem, is met."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from curveline.rod.states.equilibrium import Equilibrium, Outcome
from curveline.rod.states.planar_states import find_states

from .rods import DISPLAY, REFERENCE, display_rod, distance, reference_rod, simple

PLAIN = REFERENCE["public"] + REFERENCE["gravity"]
TOLERANCES = [1e-3, 1e-4, 1e-6]
ROUNDED = 1e-12
"""The reference curves are given to 12 digits."""
NEAR_SNAP = 0.97


def curve_of(answer: dict[str, Any]) -> np.ndarray:
    return np.column_stack([answer["x"], answer["y"]])


def by_name(case: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """The simple stable states of a reference case, of which there are always two here."""
    answers = [state for state in case["states"] if state["simple"]]
    assert len(answers) == case["n_stable_simple"] == 2
    low, high = sorted(answers, key=lambda state: state["mean_offset_from_chord"])
    return {"peak": high, "valley": low}


def assert_curve(state: Equilibrium, curve: np.ndarray, tolerance: float) -> None:
    error = distance(state, curve)
    assert state.outcome is Outcome.CONVERGED
    assert error <= state.error + ROUNDED
    assert state.error <= tolerance
    assert error <= 1e-4


def assert_close(actual: float, wanted: float, relative: float, scale: float = 0.0) -> None:
    assert actual == pytest.approx(wanted, rel=relative, abs=relative * scale)


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("case", PLAIN, ids=lambda case: case["id"])
def test_the_same_states_with_the_same_curves_and_forces(case: dict[str, Any], tolerance: float) -> None:
    rod = reference_rod(case)
    answers = by_name(case)
    states = {state.name: state for state in simple(find_states(rod, tolerance))}
    assert sorted(states) == ["peak", "valley"]
    relative = 3e-5 if tolerance > 1e-5 else 5e-6
    for name, answer in answers.items():
        state = states[name]
        assert_curve(state, curve_of(answer), tolerance)
        assert_close(state.energy * rod.length, answer["energy_L_over_EI"], relative)
        start, end = np.array(answer["internal_force_start"]), np.array(answer["internal_force_end"])
        np.testing.assert_allclose(state.clamp_force, [-start, end], rtol=0.0, atol=relative * abs(start).max())
        moments = [-answer["internal_moment_start"], answer["internal_moment_end"]]
        np.testing.assert_allclose(state.clamp_moment, moments, rtol=0.0, atol=relative * abs(np.array(moments)).max())
        assert_close(state.lowest_eigenvalue, answer["lam_min_L2"], 2e-4)
        # The answer is a plain mean of 201 points, two of which lie on the chord; ours a trapezoid over the vertices.
        assert_close(state.mean_height, 201 / 200 * answer["mean_offset_from_chord"], 1e-3)


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("case", DISPLAY, ids=lambda case: case["id"])
def test_the_default_display_shows_the_same_states(case: dict[str, Any], tolerance: float) -> None:
    rod = display_rod(case)
    states = {state.name: state for state in simple(find_states(rod, tolerance))}
    assert sorted(states) == sorted(answer["name"] for answer in case["states"]) == ["peak", "valley"]
    relative = 3e-5 if tolerance > 1e-5 else 5e-6
    for answer in case["states"]:
        state = states[answer["name"]]
        # The answers leave out the straight pieces in the bearings: of 701 points take those of the free rod alone.
        places = rod.clamp / 2 + np.linspace(0.0, rod.free_length, 201)
        every = np.linspace(0.0, rod.length, 20001)
        fine = state.curve(20001)
        ours = np.column_stack([np.interp(places, every, fine[:, axis]) for axis in (0, 1)])
        error = float(np.max(np.linalg.norm(ours - curve_of(answer), axis=1)))
        assert error <= state.error + 1e-9  # the linear interpolation between 20001 points
        assert max(error, state.error) <= min(tolerance, 1e-4)
        assert_close(state.energy, answer["energy"], relative)
        np.testing.assert_allclose(
            state.clamp_force[0], -np.array(answer["force"]), rtol=0.0, atol=relative * abs(answer["force"][0])
        )
        assert_close(-state.clamp_moment[0], answer["m0"], relative)
        assert_close(state.lowest_eigenvalue, answer["lam_min_L2"], 2e-4)


@pytest.mark.parametrize("case", REFERENCE["public"], ids=lambda case: case["id"])
def test_states_with_further_turns_are_real_and_flagged(case: dict[str, Any]) -> None:
    states = find_states(reference_rod(case), 1e-5, (0, 1, -1))
    assert sorted(state.name for state in simple(states)) == ["peak", "valley"]
    for state in states:
        if state.simple:
            continue
        assert state.name.split("-")[0] in ("loop", "crossing", "wrapped")
        assert not state.wanted
        assert state.stable
        assert state.lowest_eigenvalue > 0.0
        answers = [answer for answer in case["states"] if answer["winding"] == state.winding]
        nearest = min(answers, key=lambda answer: distance(state, curve_of(answer)))
        if nearest["neutral_loop"]:
            # A loop on a taut rod slides freely: only its energy and its flags are its own.
            assert_close(state.energy * case["L"], nearest["energy_L_over_EI"], 1e-4)
        else:
            assert distance(state, curve_of(nearest)) <= state.error + 1e-7
            assert_close(state.energy * case["L"], nearest["energy_L_over_EI"], 1e-5)
        assert state.crosses_itself == nearest["self_intersecting"]
        # The answers count crossings of the curve with itself among those of the curve with its tails.
        assert (state.crosses_itself or state.wraps_clamp) == nearest["wraps_clamp"]


def loaded_states(case: dict[str, Any], force: float) -> list[Equilibrium]:
    x, y = case["direction"]
    return find_states(reference_rod(case, ((case["s_fraction"], force * x, force * y),)), 1e-6)


def rows_before_the_snap(case: dict[str, Any]) -> list[list[float]]:
    """The tabulated states from no load up to near the load at which they cease to be stable."""
    return list(itertools.takewhile(lambda row: row[4] > 0.0 and row[0] < NEAR_SNAP * case["P_snap"], case["curve"]))


@pytest.mark.parametrize("case", REFERENCE["load"], ids=lambda case: case["id"])
def test_a_point_load_deflects_as_tabulated_up_to_the_snap(case: dict[str, Any]) -> None:
    rows = rows_before_the_snap(case)
    assert len(rows) >= 5
    for force, _, x, y, eigenvalue in rows:
        errors = []
        for state in loaded_states(case, force):
            point = state.curve(201)[round(200 * case["s_fraction"])]
            errors.append((float(np.hypot(*(point - [x, y]))), state))
        error, state = min(errors, key=lambda pair: pair[0])
        assert error <= state.error + ROUNDED
        assert_close(state.lowest_eigenvalue, eigenvalue, 5e-4, scale=1.0)


@pytest.mark.parametrize("case", REFERENCE["load"], ids=lambda case: case["id"])
def test_the_state_is_gone_above_the_snap_load(case: dict[str, Any]) -> None:
    assert len(simple(loaded_states(case, NEAR_SNAP * case["P_snap"]))) == 2
    left = simple(loaded_states(case, 1.01 * case["P_snap"]))
    assert [state.name for state in left] == ["valley"]
