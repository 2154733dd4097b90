"""Many poses at once: what each has alone, whatever the threads; and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import curveline
from curveline.errors import InvalidInput
from curveline.listening import Listener
from curveline.rod.states.planar_states import find_states
from curveline.simulation.pose_batch import CHUNK, PoseStates
from curveline.simulation.simulate import scene_rod

SHAPES = Path(__file__).parents[2] / "shapes"
PEAK = curveline.read_shape(SHAPES / "level-up-peak.toml")
COUNT = 2 * CHUNK + 40


def random_poses(count: int, seed: int = 1) -> np.ndarray:
    """Poses of the display `single`; some have no rod to spare, and more than a tenth have difficulties."""
    rng = np.random.default_rng(seed)
    return np.column_stack(
        [np.full(count, 0.5), rng.uniform([-0.3, -1.3, -1.3, 0.5], [0.3, 1.3, 1.3, 0.9], (count, 4))]
    )


@pytest.fixture(scope="module")
def batch() -> PoseStates:
    return curveline.simulate_poses(PEAK, random_poses(COUNT), jobs=2)


def test_every_pose_has_the_states_that_it_has_alone(batch: PoseStates) -> None:
    rod = scene_rod(PEAK, 0)
    for number in range(0, COUNT, 5):
        states = find_states(batch.rod_at(number), batch.tolerance)
        mine = batch.pose == number
        assert batch.name[mine].tolist() == [state.name for state in states]
        for name in ("energy", "mean_height", "error", "lowest_eigenvalue", "clearance", "max_curvature"):
            assert getattr(batch, name)[mine].tolist() == [getattr(state, name) for state in states], name
        for name in ("crosses_itself", "wraps_clamp"):
            assert getattr(batch, name)[mine].tolist() == [getattr(state, name) for state in states], name
        for force, moment, state in zip(batch.clamp_force[mine], batch.clamp_moment[mine], states, strict=True):
            np.testing.assert_array_equal(force, state.clamp_force)
            np.testing.assert_array_equal(moment, state.clamp_moment)
        assert [state.name for state in batch.states(number)] == [state.name for state in states]
    assert batch.rod_at(3).bearing == rod.bearing


def test_rods_without_any_to_spare_are_straight_as_they_are_alone() -> None:
    flat = replace(PEAK, segments=(replace(PEAK.segments[0], state="straight"),))
    lengths = [0.49996, 0.5, 0.50002, 0.5001, 0.5002, 0.5003, 0.51]
    poses = np.array([(0.5, 0.0, 0.0, 0.0, length) for length in lengths])
    found = curveline.simulate_poses(flat, poses)
    names = [found.name[found.pose == number].tolist() for number in range(len(lengths))]
    assert names == [["straight"]] * 4 + [["peak", "valley"]] * 3
    for number in range(len(lengths)):
        mine = found.mean_height[found.pose == number].tolist()
        assert mine == [state.mean_height for state in found.states(number)]
        assert found.modelled(number).states[0].name == names[number][0]
    # Stretch is in the heights of those that have none to spare.
    (state,) = found.states(1)
    assert state.model == "extensible"


def test_there_are_rods_of_every_kind(batch: PoseStates) -> None:
    counts = np.bincount(batch.pose, minlength=COUNT)
    assert len(batch) == COUNT
    assert {0, 1, 2} <= set(counts.tolist())
    assert {"peak", "valley"} <= set(batch.name.tolist())


@pytest.mark.parametrize("jobs", [1, 0, None, -3])
def test_threads_change_nothing(batch: PoseStates, jobs: int | None) -> None:
    alone = curveline.simulate_poses(PEAK, random_poses(COUNT), jobs=jobs)
    assert alone.name.tolist() == batch.name.tolist()
    for name in ("pose", "energy", "mean_height", "error", "lowest_eigenvalue", "clamp_force", "clamp_moment"):
        np.testing.assert_array_equal(getattr(alone, name), getattr(batch, name))


def test_bounds_are_there_on_demand() -> None:
    batch = curveline.simulate_poses(PEAK, [scene_rod(PEAK, 0).pose])
    modelled, report = batch.modelled(0), curveline.simulate(PEAK)
    assert modelled.left_out == report[0].left_out
    assert [state.name for state in modelled.states] == batch.name.tolist() == ["peak", "valley"]
    assert "2 states at 1 poses" in batch._repr_html_()


def test_no_pose_at_all_is_none() -> None:
    empty = curveline.simulate_poses(PEAK, np.empty((0, 5)))
    assert (len(empty), len(empty.pose)) == (0, 0)
    assert empty.clamp_force.shape == (0, 2, 2)


def test_who_listens_hears_how_far_it_is() -> None:
    heard: list[int] = []

    class Ear(Listener):
        def progress(self, what, total):  # type: ignore[no-untyped-def]
            assert (what, total) == ("simulating", COUNT)
            from contextlib import nullcontext

            return nullcontext(heard.append)

    curveline.simulate_poses(PEAK, random_poses(COUNT), jobs=2, listener=Ear())
    assert heard == [CHUNK, 2 * CHUNK, COUNT]


@pytest.mark.parametrize(
    ("poses", "what"),
    [
        ([0.5, 0.0, 0.0, 0.0, 0.6], "(m, 5), not (5,)"),
        ([[0.5, 0.0, 0.0, 0.6]], "(m, 5), not (1, 4)"),
        ([[0.5, 0.0, 0.0, 0.0, 0.6], [0.5, math.nan, 0.0, 0.0, 0.6]], "pose 1 is not finite"),
        ([["a"] * 5], "are no numbers"),
        ([[0.5, 0.0, 0.0], [0.5]], "are no numbers"),
    ],
)
def test_poses_of_another_form_are_refused(poses: object, what: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        curveline.simulate_poses(PEAK, poses)  # type: ignore[arg-type]
    assert what in refused.value.message
    assert "a row per pose" in refused.value.hint


def test_shapes_that_are_not_planar_or_have_more_segments_are_refused() -> None:
    for shape, what in (("roofline", "of one segment"), ("space/leaning", "this shape has")):
        with pytest.raises(InvalidInput, match=what):
            curveline.simulate_poses(SHAPES / f"{shape}.toml", random_poses(2))
    with pytest.raises(InvalidInput, match="no curve has a tolerance"):
        curveline.simulate_poses(PEAK, random_poses(2), 0.0)


def test_what_is_raised_in_a_thread_ends_all_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[int] = []

    def broken(*_: object) -> None:
        calls.append(1)
        if len(calls) > 2:
            raise RuntimeError("broken")

    monkeypatch.setattr("curveline.simulation.pose_batch.find_states", lambda *_: broken() or [])
    with pytest.raises(RuntimeError, match="broken"):
        curveline.simulate_poses(PEAK, random_poses(40 * CHUNK), jobs=2)
    assert len(calls) < 10 * CHUNK


def test_a_scene_with_more_loads_is_taken_with_them() -> None:
    loaded = replace(PEAK, loads=(curveline.Load(0, 0.5, (0.0, -0.2)),))
    pose = [scene_rod(PEAK, 0).pose]
    bare, heavy = curveline.simulate_poses(PEAK, pose), curveline.simulate_poses(loaded, pose)
    assert heavy.energy.tolist() == [state.energy for state in curveline.simulate(loaded, model="planar")[0].states]
    assert heavy.energy.tolist() != bare.energy.tolist()
