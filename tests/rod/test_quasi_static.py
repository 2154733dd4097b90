"""A rod on its way through poses: which states it keeps, and where it leaves its plane and comes back."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from clamped_rods import Stock, made_of, rod_between
from curveline.rod.branches.continuation import coarse_start
from curveline.rod.branches.control_path import between, straight_path
from curveline.rod.branches.out_of_plane import seen
from curveline.rod.branches.quasi_static import FELL, LEFT, RETURNED, move_through, pass_through
from curveline.rod.branches.special_points import SpecialKind, critical
from curveline.rod.branches.tracking import TrackedState, identify, tracked
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.choice import SearchRequest, model_states
from curveline.rod.problem import Array, Pose
from curveline.rod.spatial.energy import Shape
from curveline.rod.states.planar_states import find_states

from .rods import STIFFNESS, WEIGHT

RODS = 60
STRIP = Stock(58_800.0, 2.4e-3, 2.97e-3, WEIGHT, 0.49, 0.0355)
HELD = Stock(58_800.0, 2.4e-3, 2.97e-3, WEIGHT, 50.0, 50.0)
"""Of a rod that never leaves its plane."""
ROUND = Stock(17_000.0, 3.0e-3, 1.06e-3, WEIGHT, STIFFNESS, STIFFNESS / 1.35)


def segment(rod: ClampedRod, section: Stock = STRIP) -> ClampedRod:
    return made_of(section, rod)


def at(pose: Pose) -> ClampedRod:
    return rod_between((pose.x, pose.y), pose.start, pose.end, pose.length, 0.02, STIFFNESS, WEIGHT)


@cache
def ways_to_folds(seed: int) -> list[tuple[ClampedRod, TrackedState, Pose, float]]:
    """Rods, states of theirs, and ends of ways on which these meet a fold, with the fraction of the continuous rod."""
    chance = np.random.default_rng(seed)
    found: list[tuple[ClampedRod, TrackedState, Pose, float]] = []
    while len(found) < RODS:
        begin = Pose(0.5, *chance.uniform([-0.1, -0.6, -0.6, 0.53], [0.1, 0.6, 0.6, 0.8]).tolist())
        end = Pose(0.5, *(np.array(begin[1:5]) + chance.normal(0.0, [0.1, 0.9, 0.9, 0.1])).tolist())
        if end.length < 0.52:
            continue
        states = [state for state in find_states(at(begin), 1e-5) if state.simple]
        if not states:
            continue
        state = states[int(chance.integers(len(states)))]
        point = critical(straight_path(begin, end), state.rod.bearing, *coarse_start(state), 1e-6)
        last = at(between(begin, end, point.fraction))
        is_slack = last.free_length > 1.01 * np.hypot(*last.free_chord)
        if point.kind is SpecialKind.FOLD and point.fraction > 0.1 and is_slack:
            found.append((at(begin), tracked(state), end, point.fraction))
    return found


def poses_to(rod: ClampedRod, end: Pose, fraction: float) -> Array:
    return np.array([between(rod.pose, end, share * fraction) for share in np.linspace(0.0, 1.0, 17)])


@pytest.mark.parametrize(("past", "is_kept"), [(-1e-3, True), (1e-3, False)])
def test_a_rod_keeps_its_state_up_to_the_fold_of_the_continuous_rod(past: float, is_kept: bool) -> None:
    """Coarse edges lose it up to half a percent before: that alone would make a Monte Carlo pessimistic."""
    early = 0
    for rod, held, end, fold in ways_to_folds(5):
        poses = poses_to(rod, end, fold * (1.0 + past))
        _, events = move_through(poses, segment(rod, HELD), held)
        assert (not events) == is_kept
        early += pass_through(poses, rod.bearing, held.angles, held.multipliers)[0] < len(poses) - 1
    assert early == RODS if not is_kept else early > 0.5 * RODS


def test_a_state_on_fine_edges_is_known_by_its_name() -> None:
    for rod, held, end, fold in ways_to_folds(5)[:20]:
        poses = poses_to(rod, end, fold * 0.999)
        state, _ = move_through(poses, segment(rod, HELD), held)
        assert isinstance(state, TrackedState)
        there = at(Pose(*poses[-1].tolist()))
        assert identify(there, state, find_states(there, 1e-5)) is not None


# Level, the peak of a round rod falls out of its plane and into the valley; tilted by 0.5 rad it stays.
TILTED = Pose(0.5, 0.0, 0.5, -0.5, 0.62)
LEVEL = TILTED._replace(start=0.0, end=0.0)


def through(*poses: Pose) -> Array:
    """Poses on the straight ways between some, a hundred to each."""
    parts = [np.linspace(one, other, 100, endpoint=False) for one, other in pairwise(poses)]
    return np.vstack([*parts, poses[-1]])


def test_the_peak_of_a_round_rod_rolls_through_space_into_the_valley_and_back() -> None:
    peak = next(state for state in find_states(at(TILTED), 1e-5) if state.name == "peak")
    state, events = move_through(through(TILTED, LEVEL, TILTED), segment(at(TILTED), ROUND), tracked(peak))
    assert [event.kind for event in events] == [LEFT, RETURNED, LEFT, RETURNED]
    assert 0 < events[0].place <= events[1].place <= 101 < events[2].place <= events[3].place <= 200
    assert isinstance(state, TrackedState)
    assert identify(at(TILTED), state, [peak]) is peak


def test_a_strip_stays_in_its_plane_on_the_same_way() -> None:
    peak = next(state for state in find_states(at(TILTED), 1e-5) if state.name == "peak")
    _, events = move_through(through(TILTED, LEVEL, TILTED), segment(at(TILTED)), tracked(peak))
    assert events == []


def test_a_rod_that_is_narrow_sideways_stays_out_of_its_plane() -> None:
    """It buckles to the side as soon as it has rod to spare, and nothing brings it back."""
    narrow = replace(ROUND, lateral_stiffness=0.3 * STIFFNESS, twisting_stiffness=0.3 * STIFFNESS)
    state, events = move_through(through(LEVEL._replace(length=0.5), LEVEL), segment(at(LEVEL), narrow), None)
    assert [event.kind for event in events] == ["buckled", LEFT]
    assert isinstance(state, Shape)


def test_between_bearings_that_give_a_rod_out_of_its_plane_is_where_a_search_has_it() -> None:
    narrow = replace(ROUND, lateral_stiffness=0.3 * STIFFNESS, twisting_stiffness=0.3 * STIFFNESS)
    there = segment(at(LEVEL), narrow)
    there = replace(there, bearing=there.bearing._replace(give=0.02, play=0.01))
    state, events = move_through(through(LEVEL._replace(length=0.5), LEVEL), there, None)
    assert [event.kind for event in events] == ["buckled", LEFT]
    assert isinstance(state, Shape)
    found = model_states(there, SearchRequest(1e-5, (0,), "spatial")).states
    curves = [each.curve(101) for each in found if each.stable and each.leaves_plane]
    assert min(float(np.max(np.abs(seen(there, state, 101) - curve))) for curve in curves) < 2e-3
    assert max(map(abs, state.tilts)) > 0.01


def test_drawn_in_again_a_rod_out_of_its_plane_is_straight() -> None:
    narrow = replace(ROUND, lateral_stiffness=0.3 * STIFFNESS, twisting_stiffness=0.3 * STIFFNESS)
    poses = through(LEVEL._replace(length=0.5), LEVEL, LEVEL._replace(length=0.5))
    state, events = move_through(poses, segment(at(LEVEL), narrow), None)
    assert state is None
    assert [event.kind for event in events][-1] == "pulled"


def test_where_there_is_no_state_to_fall_to_the_rod_is_lost() -> None:
    _, events = move_through(through(LEVEL, TILTED), segment(at(LEVEL)), TrackedState(np.full(48, 2.0), np.zeros(2)))
    assert events[0].kind == FELL
