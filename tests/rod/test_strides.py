"""Long strides pass the same poses as short ones: no fall is stepped over, however the nodes move."""

from __future__ import annotations

import numpy as np
import pytest

from curveline.replay.monte_carlo import Errors, Setup, play_run
from curveline.rod.branches import quasi_static
from curveline.rod.branches.continuation import travel
from curveline.rod.branches.control_path import between, straight_path
from curveline.rod.branches.strides import led_along, looks_kept, pass_through
from curveline.rod.branches.tracking import TrackedState, reached, tracked
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.showable import showable_states
from curveline.rod.problem import Array, Bearing, Pose
from curveline.simulation.simulate import scene_rod
from curveline.units import deg, mm
from playing import plan, scene


def one_by_one(poses: Array, bearing: Bearing, phi: Array, multipliers: Array) -> tuple[int, Array, Array, bool]:
    """As `pass_through`, every way for itself and to the last millionth."""
    for place in range(1, len(poses)):
        way = straight_path(*(Pose(*pose.tolist()) for pose in poses[place - 1 : place + 1]))
        share, angles, forces, leaves = travel(way, bearing, phi, multipliers)
        if share < 1.0:
            return place - 1, phi, multipliers, leaves
        phi, multipliers = angles, forces
    return len(poses) - 1, phi, multipliers, False


CASES = [
    ("roofline", Errors(), range(1, 7)),
    ("roofline", Errors(feed=mm(20.0)), (10, 16, 24)),
    ("roofline", Errors(angle=deg(10.0)), range(14, 20)),
    ("level-up-peak", Errors(angle=deg(25.0)), range(1, 31)),
    ("staggered-asymmetric-valley", Errors(angle=deg(25.0)), (344,)),
    ("staggered-asymmetric-valley", Errors(unevenness=1.0, bow=mm(50.0)), range(1, 31)),
]
"""Errors of all sizes. Among the seeds are those in which strides of half as much again, from states that are less
calm, step over a fall, and one in which Newton with fewer iterations loses a state near a fold."""


@pytest.mark.parametrize(("name", "errors", "seeds"), CASES)
def test_runs_end_as_if_every_pose_were_met(
    monkeypatch: pytest.MonkeyPatch, name: str, errors: Errors, seeds: range
) -> None:
    setup = Setup(scene(name).display, plan(name), errors)
    found = [play_run(setup, seed).endings for seed in seeds]
    monkeypatch.setattr(quasi_static, "pass_through", one_by_one)
    assert found == [play_run(setup, seed).endings for seed in seeds]


def held(name: str = "level-neutral-peak", state: int = 0) -> tuple[ClampedRod, TrackedState]:
    rod = scene_rod(scene(name), 0)
    return rod, tracked(showable_states(rod, 1e-5).states[state])


def course(rod: ClampedRod, to: Pose, ways: int) -> Array:
    return np.array([between(rod.pose, to, share) for share in np.linspace(0.0, 1.0, ways + 1)])


@pytest.mark.parametrize("ways", [1, 5, 40, 400])
@pytest.mark.parametrize("turn", [0.05, -0.4, -1.2])
def test_however_finely_a_way_is_cut_the_same_of_it_is_passed(ways: int, turn: float) -> None:
    rod, state = held()
    poses = course(rod, rod.pose._replace(start=rod.pose.start + turn, end=rod.pose.end - turn), ways)
    done, angles, _, leaves = pass_through(poses, rod.bearing, state.angles, state.multipliers)
    expected, other, _, _ = one_by_one(poses, rod.bearing, state.angles, state.multipliers)
    assert done == expected
    assert not leaves
    assert (done == ways) == (turn > -1.0)
    assert np.max(np.abs(angles - other)) < 1e-6


def test_there_and_back_across_a_fold_is_no_stride() -> None:
    rod, state = held()
    far = rod.pose._replace(start=rod.pose.start - 1.2, end=rod.pose.end + 1.2)
    for ways in (2, 8, 24):
        there = course(rod, far, ways)
        poses = np.concatenate([there, there[-2::-1]])
        done = pass_through(poses, rod.bearing, state.angles, state.multipliers)[0]
        assert done == one_by_one(poses, rod.bearing, state.angles, state.multipliers)[0] < ways


def test_looks_are_those_of_single_steps() -> None:
    rod, state = held()
    for turn in (0.1, -0.6, -0.9, -1.2):
        far = rod.pose._replace(start=rod.pose.start + turn, end=rod.pose.end - turn)
        way = straight_path(rod.pose, far)
        here: TrackedState | None = state
        kept = 0
        while (
            kept < 4
            and (here := reached(rod.moved_to(between(rod.pose, far, (kept + 1) / 4)), here or state)) is not None
        ):
            kept += 1
        assert looks_kept(way, rod.bearing, state.angles, state.multipliers, 4)[0] == kept


def test_states_are_led_along_each_for_itself() -> None:
    rod, peak = held()
    _, valley = held(state=1)
    shapes, forces = (np.array([getattr(peak, key), getattr(valley, key)]) for key in ("angles", "multipliers"))
    way = straight_path(rod.pose, rod.pose._replace(start=rod.pose.start - 1.2, end=rod.pose.end + 1.2))
    arrive, angles, _ = led_along(way, rod.bearing, shapes, forces)
    assert arrive.tolist() == [False, True]
    expected = travel(way, rod.bearing, valley.angles, valley.multipliers)[1]
    assert np.max(np.abs(angles[1] - expected)) < 1e-6
