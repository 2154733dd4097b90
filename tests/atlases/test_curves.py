"""Stable curves over the limits of a display: what they are, and that the cache is believed in nothing."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import curveline
from curveline.atlases import curves
from curveline.atlases.curves import StableCurves, curves_of
from curveline.atlases.entries import EDGES, POINTS, segment_rod, share_of
from curveline.atlases.sampling import longest, sampled_poses, spread
from curveline.atlases.sharing import Crew
from curveline.errors import InvalidInput
from curveline.planning.actuator_loads import actuator_load_of, clamp_loads_of_state
from curveline.rod.problem import Pose, mesh
from curveline.rod.states.equilibrium import refine
from curveline.rod.states.planar_states import find_states
from curveline.scene import Profile, Range

SINGLE, QUAD = curveline.read_display("single"), curveline.read_display("quad")
FEW = 200


@pytest.fixture(autouse=True)
def _few(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(curves, "POSES", FEW)
    monkeypatch.setattr(curves.cache, "home", lambda: tmp_path)


@pytest.fixture
def found() -> StableCurves:
    return curves_of(SINGLE)


def kept(folder: Path) -> Path:
    (path,) = (folder / "atlases").iterdir()
    return path


def forbidden(*_: object) -> None:
    raise AssertionError("computed anew")


def test_points_are_spread_evenly() -> None:
    points = spread(1600)
    assert points.min() > 0.0
    assert points.max() < 1.0
    # A hundred of them in each of the 16 parts that halves of all numbers make, which at random are off by 10.
    parts = (points > 0.5) @ [1, 2, 4, 8]
    assert np.abs(np.bincount(parts, minlength=16) - 100).max() <= 5
    np.testing.assert_array_equal(spread(50), points[:50])


def test_poses_are_within_the_limits() -> None:
    poses = sampled_poses(SINGLE, segment_rod(SINGLE), 500)
    limits = SINGLE.limits
    _, rise, start, end, length = poses.T
    assert np.abs(rise).max() <= limits.height.high - limits.height.low
    assert max(np.abs(start).max(), np.abs(end).max()) <= limits.angle.high
    assert length.min() >= limits.length.low
    assert length.max() <= longest(SINGLE) == limits.length.high
    # In all of them there is rod to spare, and they reach near all ends.
    assert len(poses) == 500
    assert length.max() > longest(SINGLE) - 0.01
    assert np.abs(start).max() > 0.98 * limits.angle.high


def test_the_rod_that_other_segments_need_is_not_there_for_one() -> None:
    short = replace(QUAD, rod=replace(QUAD.rod, total_length=2.2))
    assert longest(short) == pytest.approx(2.2 - QUAD.clamp - 3 * QUAD.limits.length.low)


def test_every_curve_is_a_state_and_is_found_again_from_its_row(found: StableCurves) -> None:
    rod = segment_rod(SINGLE)
    for row, pose in list(zip(found.entries, found.where.tolist(), strict=True))[::7]:
        there = rod.moved_to(Pose(*pose))
        (state,) = [each for each in find_states(there, 1e-4) if each.name == row["name"]]
        np.testing.assert_array_equal(row["curve"], state.curve(POINTS))
        assert row["lowest_eigenvalue"] == state.lowest_eigenvalue
        np.testing.assert_array_equal(row["loads"], clamp_loads_of_state(state).low)
        share = actuator_load_of((clamp_loads_of_state(state),)).share(SINGLE)
        assert share_of(np.array([row]), SINGLE)[0] == pytest.approx(share, rel=1e-12)
        if share > 1.0:
            continue  # what bends so sharply is no start for edges as long as these
        again = refine(there, mesh(np.zeros(0), EDGES), row["angles"], row["multipliers"], 1e-4)
        assert again.stable
        assert np.abs(again.curve(POINTS) - row["curve"]).max() < 2e-4
    assert np.mean(share_of(found.entries, SINGLE) <= 1.0) > 0.7


def test_all_states_of_a_pose_are_there(found: StableCurves) -> None:
    rod = segment_rod(SINGLE)
    for place in range(0, FEW, 17):
        names = found.entries["name"][found.entries["pose"] == place].tolist()
        states = find_states(rod.moved_to(Pose(*found.poses[place].tolist())), 1e-4)
        assert names == [state.name for state in states]


def test_they_are_computed_once(found: StableCurves, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(curves, "found_at", forbidden)
    again = curves_of(SINGLE)
    assert again.entries.tobytes() == found.entries.tobytes()
    assert again.poses.tobytes() == found.poses.tobytes()


def test_processes_find_the_same(found: StableCurves, tmp_path: Path) -> None:
    before = kept(tmp_path).read_bytes()
    kept(tmp_path).unlink()
    curves_of(SINGLE, Crew(jobs=2))
    assert kept(tmp_path).read_bytes() == before


def flipped(data: bytes) -> bytes:
    return data[:-100] + bytes([data[-100] ^ 1]) + data[-99:]


@pytest.mark.parametrize(
    "damage",
    [
        flipped,
        lambda data: data[:-1],
        lambda data: data + data[-1:],
        lambda data: b"",
        lambda data: b"\x80\x04" + data,
        lambda data: b"x" * (64 * len(data)),
    ],
    ids=["a bit", "cut", "longer", "empty", "a pickle", "too large"],
)
def test_a_damaged_file_is_made_anew(found: StableCurves, tmp_path: Path, damage: Callable[[bytes], bytes]) -> None:
    path = kept(tmp_path)
    whole = path.read_bytes()
    path.write_bytes(damage(whole))
    assert curves_of(SINGLE).entries.tobytes() == found.entries.tobytes()
    assert path.read_bytes() == whole


def test_a_file_of_another_display_is_not_believed(found: StableCurves, tmp_path: Path) -> None:
    path = kept(tmp_path)
    softer = replace(SINGLE, rod=replace(SINGLE.rod, youngs_modulus=0.5 * SINGLE.rod.youngs_modulus))
    others = curves_of(softer)
    assert not np.array_equal(others.entries["loads"], found.entries["loads"])
    (other,) = (each for each in path.parent.iterdir() if each != path)
    path.write_bytes(other.read_bytes())
    assert curves_of(SINGLE).entries.tobytes() == found.entries.tobytes()


def test_sound_digests_of_unsound_rows_are_not_believed(
    found: StableCurves, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in (("pose", FEW), ("pose", -1), ("lowest_eigenvalue", np.nan), ("curve", np.inf)):
        wrong = found.entries.copy()
        wrong[name][-1 if value == FEW else 0] = value
        poses = curves.with_begins(sampled_poses(SINGLE, segment_rod(SINGLE), FEW), SINGLE)
        curves._keep(kept(tmp_path), curves._key(segment_rod(SINGLE), poses), wrong)
        assert curves_of(SINGLE).entries.tobytes() == found.entries.tobytes(), name


def test_another_version_makes_its_own(found: StableCurves, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = kept(tmp_path)
    monkeypatch.setattr(curves, "__version__", "0.0.0")
    curves_of(SINGLE)
    assert len(list(path.parent.iterdir())) == 2


def test_what_the_display_does_not_show_in_its_rod_makes_no_new_file(found: StableCurves, tmp_path: Path) -> None:
    curves_of(replace(SINGLE, name="other", digest="x"))
    assert [path.name for path in kept(tmp_path).parent.iterdir()] == [kept(tmp_path).name]


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="no folder can be closed")
def test_a_folder_that_cannot_be_written_costs_time_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "atlases").write_text("no folder")
    assert len(curves_of(SINGLE)) > FEW


def test_a_rod_bent_when_free_lies_with_equal_tails() -> None:
    rod = replace(SINGLE.rod, profile=Profile((0.9, 1.1), (0.0, 3.0)))
    bent = curves_of(replace(SINGLE, rod=rod))
    np.testing.assert_allclose(bent.poses[:, 5], 0.5 * (rod.total_length - bent.poses[:, 4]))
    straight = curves_of(SINGLE)
    assert bent.poses[:, :5].tobytes() == straight.poses[:, :5].tobytes()
    assert bent.entries["energy"].tolist() != straight.entries["energy"].tolist()


def test_what_has_no_atlas_is_refused() -> None:
    with pytest.raises(InvalidInput, match="planar"):
        curves_of(replace(SINGLE, down=(0.0, -0.8, -0.6)))
    limits = replace(SINGLE.limits, length=Range(0.5, 0.5))
    with pytest.raises(InvalidInput, match="leave no rod for a curve"):
        curves_of(replace(SINGLE, limits=limits))
