"""Displays whose rod is bent when free, each part of it otherwise: from the file to states, sweeps, plans and loads."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest
from typer.testing import CliRunner

import curveline
from curveline.cli.app import app
from curveline.drive_settings import drive_settings
from curveline.planning.layout import Box, box_of, layout_of, pose_of
from curveline.replay.playback import segment_at
from curveline.rod.states.planar_states import find_states
from curveline.scene import Profile, Scene
from curveline.shapes.files import builtin_text, read_display
from curveline.simulation.changes import part_of
from curveline.simulation.simulate import scene_rod

SHAPES = Path(__file__).parents[2] / "shapes"
PROFILE = Profile((0.7, 0.85, 1.0, 1.2), (0.0, 1.5, -1.0, 0.5))


def bent(name: str, profile: Profile | None = PROFILE) -> Scene:
    """A built-in shape on its display, whose rod has a profile."""
    scene = curveline.read_shape(name)
    return replace(scene, display=replace(scene.display, rod=replace(scene.display.rod, profile=profile)))


def shape_file(folder: Path, name: str) -> Path:
    """The same as a file, beside that of its display."""
    pairs = [[1e3 * place, value] for place, value in zip(PROFILE.places, PROFILE.values, strict=True)]
    display = builtin_text("single").replace("[limits]", f"natural_curvature_along = {pairs}\n\n[limits]", 1)
    (folder / "bent.toml").write_text(display)
    path = folder / f"{name}.toml"
    path.write_text((SHAPES / f"{name}.toml").read_text().replace('"single"', '"bent.toml"'))
    return path


def longer(scene: Scene, by: float) -> Scene:
    """With other lengths of rod [m] in all segments."""
    return replace(scene, segments=tuple(replace(each, length=each.length + by) for each in scene.segments))


def test_a_shape_takes_the_middle_of_the_rod() -> None:
    scene = bent("level-up-peak")
    rod = scene_rod(scene, 0)
    length = scene.segments[0].length
    assert rod.pose.begin == pytest.approx(0.5 * (scene.display.rod.total_length - length))
    (segment,) = curveline.simulate(scene)
    assert "curvature along the rod" in segment.terms
    for state, found in zip(segment.states, find_states(rod, 1e-4), strict=True):
        assert abs(state.curve(101) - found.curve(101)).max() < 1e-9


def test_segments_share_one_rod() -> None:
    scene = bent("roofline")
    rods = [scene_rod(scene, index) for index in range(len(scene.segments))]
    for left, right in pairwise(rods):
        assert left.pose.begin + left.length == pytest.approx(right.pose.begin)
    layout = layout_of(scene)
    for index, rod in enumerate(rods):
        assert pose_of(scene.display, layout, index) == pytest.approx(rod.pose, abs=1e-8)
    last = rods[-1].pose.begin + rods[-1].length
    assert rods[0].pose.begin == pytest.approx(scene.display.rod.total_length - last)


def test_a_part_of_a_row_keeps_its_own_rod() -> None:
    scene = bent("roofline")
    for index in range(len(scene.segments)):
        part = part_of(scene, range(index, index + 2))
        assert scene_rod(part, 0).pose.begin == pytest.approx(scene_rod(scene, index).pose.begin)
        assert pose_of(part.display, layout_of(part), 0) == pytest.approx(scene_rod(scene, index).pose, abs=1e-8)


def test_what_nodes_have_fed_says_which_rod_is_between_them() -> None:
    display = bent("level-up-peak").display
    drive = drive_settings(display)
    fed = drive.axes[0].counts(30.0)
    still = segment_at(display, drive, [(0, 0, 0), (0, 0, 0)], 0)
    left = segment_at(display, drive, [(fed, 0, 0), (0, 0, 0)], 0)
    both = segment_at(display, drive, [(fed, 0, 0), (fed, 0, 0)], 0)
    assert (left[1] - still[1], left[2] - still[2]) == pytest.approx((0.03, -0.03), abs=1e-5)
    assert (both[1] - still[1], both[2] - still[2]) == pytest.approx((0.0, -0.03), abs=1e-5)
    assert segment_at(read_display("single"), drive, [(fed, 0, 0), (0, 0, 0)], 0)[2] == 0.0


def test_uneven_progress_may_have_any_rod_between_what_both_nodes_hold() -> None:
    scene = bent("level-up-peak")
    before, after = layout_of(scene), layout_of(longer(scene, 0.1))
    box = box_of(scene.display, before, after, 0)
    ends = {(round(pose.begin, 6), round(pose.begin + pose.length, 6)) for pose in box.corners()}
    begin, length = pose_of(scene.display, before, 0).begin, scene.segments[0].length
    lows, highs = (begin, begin - 0.05), (begin + length, begin + length + 0.05)
    assert ends == {(round(low, 6), round(high, 6)) for low in lows for high in highs}
    ways = list(box.edges(pose_of(scene.display, before, 0), pose_of(scene.display, after, 0)))
    assert len(ways) == 4
    still = Box(pose_of(scene.display, before, 0), pose_of(scene.display, before, 0))
    assert len(list(still.corners())) == 1


def test_a_sweep_has_the_states_of_its_points(tmp_path: Path) -> None:
    path = shape_file(tmp_path, "level-asymmetric-peak")
    swept = ["simulate", str(path), "--sweep", "segments.1.length_mm=640:700:4", "--json"]
    lines = [json.loads(line) for line in CliRunner().invoke(app, swept).stdout.splitlines()]
    assert len(lines) == 4
    for line in lines:
        scene = curveline.read_shape(path)
        length = 1e-3 * line["swept"]["segments.1.length_mm"]
        (segment,) = curveline.simulate(replace(scene, segments=(replace(scene.segments[0], length=length),)))
        told = line["segments"][0]["states"]
        assert [each["name"] for each in told] == [state.name for state in segment.states]
        assert [each["energy_mJ"] for each in told] == pytest.approx([1e3 * each.energy for each in segment.states])


def test_poses_may_say_which_part_of_the_rod_they_take() -> None:
    scene = bent("level-up-peak")
    rod = scene_rod(scene, 0)
    middle = curveline.simulate_poses(scene, [rod.pose[:5]])
    same = curveline.simulate_poses(scene, [rod.pose])
    aside = curveline.simulate_poses(scene, [rod.pose._replace(begin=0.0)])
    assert middle.energy == pytest.approx(same.energy, rel=1e-12)
    assert abs(aside.energy - same.energy).max() > 1e-3
    assert aside.energy == pytest.approx([each.energy for each in find_states(aside.rod_at(0), 1e-4)])


def test_a_rod_that_is_bent_alike_all_along_is_one_that_is_curved() -> None:
    scene = bent("level-asymmetric-peak", Profile((0.0,), (0.8,)))
    curved = replace(scene.display.rod, profile=None, natural_curvature=0.8)
    other = replace(scene, display=replace(scene.display, rod=curved))
    for one, same in zip(curveline.simulate(scene)[0].states, curveline.simulate(other)[0].states, strict=True):
        assert abs(one.curve(101) - same.curve(101)).max() < 1e-9
        assert one.energy == pytest.approx(same.energy)
        assert one.clamp_moment == pytest.approx(same.clamp_moment)
        assert one.max_curvature == pytest.approx(same.max_curvature)


@pytest.mark.parametrize("name", ["level-up-peak", "level-neutral-valley"])
def test_a_plan_ends_in_the_shape_and_so_do_runs_with_errors_and_the_model(name: str, tmp_path: Path) -> None:
    plan = curveline.plan(shape_file(tmp_path, name))
    assert plan.wanted == (name.split("-")[-1],)
    trials = curveline.monte_carlo(plan, curveline.TrialsRequest(runs=10, jobs=1))
    assert (trials.share.count, trials.share.runs) == (10, 10)
    with curveline.connect("mock:fresh", runs=tmp_path / "runs") as session:
        assert session.send(plan).playback.states == plan.wanted


def test_a_row_is_planned_with_the_rod_that_it_has() -> None:
    scene = bent("roofline")
    assert curveline.plan(scene).wanted == tuple(segment.state for segment in scene.segments)


def test_a_push_finds_the_same_snap_however_the_energy_is_counted() -> None:
    straight, bent_one = curveline.load(curveline.read_shape("level-up-peak")), curveline.load(bent("level-up-peak"))
    assert straight.snap is not None
    assert bent_one.snap is not None
    assert bent_one.snap.force != pytest.approx(straight.snap.force, rel=0.02)
