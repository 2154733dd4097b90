"""The states of rods without difficulties, from one kernel, are those that the long way finds."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from curveline.rod.clamped_rod import ClampedRod, DeadLoad
from curveline.rod.models import model_error
from curveline.rod.models.model_error import asked_of, gravity_bound, lateral, stretch_bound
from curveline.rod.problem import Bearing, Pose
from curveline.rod.section import Section
from curveline.rod.states import planar_states
from curveline.rod.states.equilibrium import Equilibrium
from curveline.rod.states.plain_states import PLAIN_NUMBERS, Asked, plain_batch, plain_states
from curveline.rod.states.planar_states import find_states

TOLERANCE = 1e-4
STRIP = Section(stretching_stiffness=67_200.0, thickness=0.0024, gyration=0.003, weight=0.47)
BEARING = Bearing(0.02, 0.028224, 0.47, lateral=0.49, twisting=0.033)


def rod_of(seed: int) -> ClampedRod:
    """A rod that a display may be asked for; every third with a load, every fourth without weight."""
    rng = np.random.default_rng(seed)
    pose = Pose(0.5, *rng.uniform([-0.3, -1.2, -1.2, 0.56], [0.3, 1.2, 1.2, 0.85]).tolist())
    loads = (DeadLoad(0.4, 0.05, -0.1),) if seed % 3 == 0 else ()
    bearing = BEARING._replace(weight=0.0) if seed % 4 == 0 else BEARING
    return ClampedRod(pose, bearing, loads, section=STRIP)


RODS = [rod for seed in range(60) if math.hypot(*(rod := rod_of(seed)).free_chord) * 1.01 < rod.free_length]


def the_long_way(rod: ClampedRod, monkeypatch: pytest.MonkeyPatch) -> list[Equilibrium]:
    none = np.empty((0, PLAIN_NUMBERS)), np.empty((0, 6)), np.empty(0)
    with monkeypatch.context() as patched:
        patched.setattr(planar_states, "plain_states", lambda *_: none)
        return find_states(rod, TOLERANCE)


@pytest.mark.parametrize("number", range(len(RODS)))
def test_the_states_are_those_of_the_long_way(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rod = RODS[number]
    states, others = find_states(rod, TOLERANCE), the_long_way(rod, monkeypatch)
    assert [state.name for state in states] == [state.name for state in others]
    for state, other in zip(states, others, strict=True):
        assert (state.outcome, state.stable, state.vertices) == (other.outcome, other.stable, other.vertices)
        np.testing.assert_array_equal(state.vertices_table, other.vertices_table)
        np.testing.assert_array_equal(state.edges, other.edges)
        for name in ("energy", "error", "lowest_eigenvalue", "clearance", "mean_height", "max_curvature"):
            assert getattr(state, name) == getattr(other, name), name
        np.testing.assert_array_equal(state.clamp_force, other.clamp_force)
        np.testing.assert_array_equal(state.clamp_moment, other.clamp_moment)


def test_most_of_them_have_no_difficulties() -> None:
    asked = Asked(TOLERANCE, math.nan, math.nan, sideways=False)
    plain = [len(plain_states(rod.pose, rod.bearing, *rod.dead_loads(), asked)[0]) for rod in RODS]
    assert np.count_nonzero(plain) > 0.6 * len(RODS)


@pytest.mark.parametrize("number", range(0, len(RODS), 3))
def test_what_disturbs_a_state_is_the_same_whether_it_is_asked_at_once_or_later(number: int) -> None:
    rod = RODS[number]
    for state in find_states(rod, TOLERANCE, asked=asked_of(rod, TOLERANCE)):
        later = state.but(disturbed=None)
        assert lateral(state).eigenvalue == pytest.approx(lateral(later).eigenvalue, rel=1e-9)
        assert stretch_bound(state).bound == pytest.approx(stretch_bound(later).bound, rel=1e-6)
        if rod.weight == 0.0:
            assert gravity_bound(state).bound == pytest.approx(gravity_bound(later).bound, rel=1e-6)
        assert model_error.contact_bound(state) == model_error.contact_bound(later)


def test_a_state_of_another_rod_is_asked_again() -> None:
    rod = RODS[1]
    state = find_states(rod, TOLERANCE, asked=asked_of(rod, TOLERANCE))[0]
    assert state.but(name="other").disturbed is state.disturbed
    soft = ClampedRod(rod.pose, rod.bearing, rod.loads, section=replace(STRIP, stretching_stiffness=100.0))
    assert state.but(rod=soft).disturbed is None
    assert stretch_bound(state.but(rod=soft)).bound > 100.0 * stretch_bound(state).bound


def test_a_batch_gives_the_numbers_that_each_has_alone() -> None:
    rods = [rod for rod in RODS if not rod.loads and rod.bearing == BEARING]
    asked = Asked(TOLERANCE, math.nan, math.nan, sideways=False)
    poses = np.array([rod.pose for rod in rods])
    counts, table = plain_batch(poses, BEARING, *rods[0].dead_loads(), asked)
    assert counts.sum() == len(table) > 20
    place = 0
    for rod, count in zip(rods, counts.tolist(), strict=True):
        alone = plain_states(rod.pose, BEARING, *rod.dead_loads(), asked)[0]
        together = table[place : place + count]
        place += count
        assert count in (0, len(alone))
        rows = {row.tobytes() for row in np.nan_to_num(alone)}
        assert all(row.tobytes() in rows for row in np.nan_to_num(together))


@pytest.mark.parametrize("length", [0.0, 0.02, 0.01, -1.0, 0.4, math.nan, math.inf])
def test_a_rod_too_short_or_without_a_length_has_difficulties(length: float) -> None:
    asked = Asked(TOLERANCE, math.nan, math.nan, sideways=False)
    states, vertices, behind = plain_states(
        Pose(0.5, 0.0, 0.1, -0.1, length), BEARING, np.empty(0), np.empty((0, 2)), asked
    )
    assert len(states) == len(vertices) == len(behind) == 0
