"""Displays whose bearings tilt: from the file to states, plans and loads, and what is refused as it needs space."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import curveline
from curveline.cli.app import app
from curveline.displays.check import check_of
from curveline.errors import InvalidInput
from curveline.rod.spatial.dynamics import Fate
from curveline.scene import Scene
from curveline.sections import Rectangle
from curveline.shapes.files import builtin_text

SHAPES = Path(__file__).parents[2] / "shapes"
STIFFNESS, PLAY = "clamp_stiffness_Nmm_per_deg = 25.0", "clamp_play_deg = 0.5"


def soft(folder: Path, *lines: str, shape: str = "level-asymmetric-peak") -> Scene:
    """A shape of the project on the display `single` whose file has these `lines` besides."""
    display = builtin_text("single").replace("clamp_mm", "\n".join([*lines, "clamp_mm"]), 1)
    (folder / "soft.toml").write_text(display)
    text = (SHAPES / f"{shape}.toml").read_text().replace('"single"', '"soft.toml"')
    (folder / "shape.toml").write_text(text)
    return curveline.read_shape(folder / "shape.toml")


def test_a_file_says_how_much_the_bearings_give(tmp_path: Path) -> None:
    display = soft(tmp_path, STIFFNESS, PLAY).display
    assert display.clamp_stiffness == pytest.approx(0.025 * 180.0 / math.pi)
    assert display.clamp_play == pytest.approx(math.radians(0.5))
    document = check_of(display).document()
    assert document["clamp_stiffness_Nmm_per_deg"] == pytest.approx(25.0)
    assert document["clamp_play_deg"] == pytest.approx(0.5)


def test_a_file_that_says_nothing_has_rigid_bearings(tmp_path: Path) -> None:
    display = soft(tmp_path).display
    assert (display.clamp_stiffness, display.clamp_play) == (math.inf, 0.0)
    assert check_of(display).document()["clamp_stiffness_Nmm_per_deg"] is None


def test_a_check_says_how_much_the_bearings_give(tmp_path: Path) -> None:
    for lines, said in (((), 0), ((STIFFNESS,), 1), ((STIFFNESS, PLAY), 2)):
        soft(tmp_path, *lines)
        text = CliRunner().invoke(app, ["display", "check", str(tmp_path / "soft.toml")]).stdout
        assert text.count("bearings tilt by") == said
    assert "bearings tilt by one degree under 25 N mm" in text
    assert "bearings tilt by 0.5 deg either way at no moment" in text


def test_bearings_that_give_move_the_curve_and_are_named(tmp_path: Path) -> None:
    (rigid,), (giving,) = curveline.simulate(soft(tmp_path)), curveline.simulate(soft(tmp_path, STIFFNESS, PLAY))
    assert "giving clamps" in giving.terms
    assert "giving clamps" not in rigid.terms
    assert giving.model == "planar"
    for before, after in zip(rigid.states, giving.states, strict=True):
        assert 0.005 < abs(before.curve(101) - after.curve(101)).max() < 0.05


def test_a_very_stiff_bearing_is_a_rigid_one(tmp_path: Path) -> None:
    (rigid,) = curveline.simulate(soft(tmp_path))
    (stiff,) = curveline.simulate(soft(tmp_path, "clamp_stiffness_Nmm_per_deg = 1e6"))
    for before, after in zip(rigid.states, stiff.states, strict=True):
        assert abs(before.curve(101) - after.curve(101)).max() < 1e-6


def test_a_sweep_has_the_curves_of_its_points(tmp_path: Path) -> None:
    soft(tmp_path, STIFFNESS, PLAY)
    swept = ["simulate", str(tmp_path / "shape.toml"), "--sweep", "nodes.1.angle_deg=30:40:3", "--json"]
    lines = [json.loads(line) for line in CliRunner().invoke(app, swept).stdout.splitlines()]
    assert len(lines) == 3
    for line in lines:
        scene = curveline.read_shape(tmp_path / "shape.toml")
        left = replace(scene.nodes[0], angle=math.radians(line["swept"]["nodes.1.angle_deg"]))
        (segment,) = curveline.simulate(replace(scene, nodes=(left, *scene.nodes[1:])))
        (found,) = line["segments"]
        assert "giving clamps" in found["model"]["terms"]
        for state, told in zip(segment.states, found["states"], strict=True):
            points = np.array(told["curve_mm"])
            origin = points[0]
            assert points - origin == pytest.approx(1e3 * state.curve(len(points)), abs=1e-6)


def test_a_plan_ends_in_the_shape_and_runs_with_errors_do(tmp_path: Path) -> None:
    plan = curveline.plan(soft(tmp_path, STIFFNESS, PLAY))
    trials = curveline.monte_carlo(plan, curveline.TrialsRequest(runs=20, jobs=1))
    assert (trials.share.count, trials.share.runs) == (20, 20)


def test_a_push_snaps_earlier_between_soft_bearings(tmp_path: Path) -> None:
    rigid, giving = (curveline.load(soft(tmp_path, *lines)) for lines in ((), (STIFFNESS,)))
    assert rigid.snap is not None
    assert giving.snap is not None
    assert 0.5 * rigid.snap.force < giving.snap.force < 0.95 * rigid.snap.force


@pytest.mark.parametrize("lines", [(STIFFNESS,), (STIFFNESS, PLAY)])
def test_a_fall_between_bearings_that_give_loses_energy_and_tilts_them_as_the_state_does(
    tmp_path: Path, lines: tuple[str, ...]
) -> None:
    motion = curveline.fall(curveline.load(soft(tmp_path, *lines))).motion
    total = motion.kinetic + motion.potential
    assert np.max(np.diff(total)) < 1e-10 * np.max(np.abs(total))
    assert motion.fate is Fate.LANDED
    assert motion.settled is not None
    assert max(map(abs, motion.settled.tilts)) > 0.1
    assert motion.last.shape.tilts == pytest.approx(motion.settled.tilts, abs=1e-4)


def test_a_fall_between_very_stiff_bearings_is_that_between_rigid_ones(tmp_path: Path) -> None:
    rigid, stiff = (
        curveline.fall(curveline.load(soft(tmp_path, *lines))).motion
        for lines in ((), ("clamp_stiffness_Nmm_per_deg = 1e6",))
    )
    assert stiff.times[-1] == pytest.approx(rigid.times[-1], rel=0.02)
    assert stiff.places[-1] == pytest.approx(rigid.places[-1], abs=1e-3)


def test_a_fall_between_bearings_that_strike_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="strike at the end of their play"):
        curveline.fall(curveline.load(soft(tmp_path, PLAY)))


def test_what_points_out_of_the_plane_is_modelled_in_space_between_bearings_that_give(tmp_path: Path) -> None:
    rigid, giving = (
        curveline.simulate(replace(scene, nodes=(replace(scene.nodes[0], yaw=0.1), *scene.nodes[1:])))[0]
        for scene in (soft(tmp_path), soft(tmp_path, STIFFNESS))
    )
    assert (giving.model, rigid.model) == ("spatial", "spatial")
    assert "giving clamps" in giving.terms
    for name in ("peak", "valley"):
        before, after = (next(state for state in each.states if state.name == name) for each in (rigid, giving))
        assert after.stable
        assert 0.005 < abs(before.curve(101) - after.curve(101)).max() < 0.05


@pytest.mark.parametrize("lines", [(STIFFNESS,), (PLAY,), (STIFFNESS, PLAY)])
def test_the_spatial_model_has_the_states_of_the_extensible_one(tmp_path: Path, lines: tuple[str, ...]) -> None:
    scene = soft(tmp_path, *lines)
    (flat,), (whole,) = (curveline.simulate(scene, model=model) for model in ("extensible", "spatial"))
    for one, other in zip(flat.states, whole.states, strict=True):
        assert one.name == other.name
        assert abs(one.curve(101) - other.curve(101)).max() <= one.error + other.error


def test_a_state_that_would_leave_its_plane_goes_to_space(tmp_path: Path) -> None:
    scene = soft(tmp_path, STIFFNESS, shape="level-up-peak")
    narrow = replace(scene.display.rod, section=Rectangle(0.002, 0.0024))
    (segment,) = curveline.simulate(replace(scene, display=replace(scene.display, rod=narrow)))
    assert segment.model == "spatial"
    assert "giving clamps" in segment.terms
    assert any(state.leaves_plane and state.stable for state in segment.states)


def test_a_bearing_softer_than_the_rod_looks_odd(tmp_path: Path) -> None:
    warnings = check_of(soft(tmp_path, "clamp_stiffness_Nmm_per_deg = 1.0").display).document()["warnings"]
    assert "soft-clamp" in [each["code"] for each in warnings]
