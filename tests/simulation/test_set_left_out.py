"""What a set could do to a curve, told where nobody said what the rod went through."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import curveline
from curveline.cli.app import app
from curveline.material.relaxation import power_law
from curveline.rod.models.model_error import SAFETY
from curveline.scene import Scene
from curveline.shapes.files import builtin_text
from curveline.simulation.dwelling import scene_after
from curveline.simulation.set_left_out import set_bound

SHAPES = Path(__file__).parents[2] / "shapes"


def plastic(name: str) -> Scene:
    scene = curveline.read_shape(name)
    return replace(scene, display=replace(scene.display, rod=replace(scene.display.rod, relaxation=power_law())))


@pytest.mark.parametrize("name", ["level-up-valley", "level-neutral-peak", "staggered-neutral-valley"])
def test_a_week_in_the_other_state_moves_the_curve_by_no_more(name: str) -> None:
    scene = plastic(name)
    (segment,) = curveline.simulate(scene)
    bound = segment.left_out["set"]
    assert "held in the" in bound.why
    moved = 0.0
    for other in segment.states:
        before = replace(scene, name="other", segments=(replace(scene.segments[0], state=other.name),))
        (held,) = curveline.simulate(scene_after(scene, "other@1w", lambda _, before=before: before))
        there = {state.name: state for state in held.states}
        for state, bent in ((each, there[each.name]) for each in segment.states if each.name in there):
            moved = max(moved, float(np.linalg.norm(state.curve(201) - bent.curve(201), axis=1).max()))
    assert moved < bound.bound < 2.0 * SAFETY * moved + 1e-3


def test_a_state_that_would_be_gone_may_be_anywhere() -> None:
    scene = plastic("level-asymmetric-peak")
    steep = replace(scene, nodes=(scene.nodes[0], replace(scene.nodes[1], angle=0.7)))
    (segment,) = curveline.simulate(steep)
    assert segment.left_out["set"].bound > 0.4


def test_who_says_what_went_before_and_rods_without_a_set_have_no_such_bound() -> None:
    scene = plastic("level-up-peak")
    (fresh,), (after,) = curveline.simulate("level-up-peak"), curveline.simulate(curveline.after(scene, "home@1h"))
    assert "set" not in fresh.left_out
    assert "set" not in after.left_out


def test_a_sweep_has_it_at_every_point(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(builtin_text("single").replace("[limits]", "set_strength = 1.0\n\n[limits]", 1))
    text = (SHAPES / "level-up-peak.toml").read_text().replace('"single"', '"mine.toml"')
    (tmp_path / "shape.toml").write_text(text)
    swept = ["simulate", str(tmp_path / "shape.toml"), "--sweep", "nodes.1.angle_deg=20:30:2", "--json"]
    for line in CliRunner().invoke(app, swept).stdout.splitlines():
        assert json.loads(line)["segments"][0]["model"]["left_out"]["set"]["bound_mm"] > 1.0


@pytest.mark.parametrize(("name", "mass"), [("level-asymmetric-peak", 3.0), ("level-asymmetric-peak", 4.0)])
def test_a_heavy_rod_that_gives_way_in_its_own_state_moves_by_no_more(name: str, mass: float) -> None:
    scene = plastic(name)
    rod = replace(
        scene.display.rod, relaxation=power_law(3.0), mass_per_length=mass * scene.display.rod.mass_per_length
    )
    scene = replace(scene, display=replace(scene.display, rod=rod))
    scene = replace(scene, nodes=(scene.nodes[0], replace(scene.nodes[1], angle=0.0)))
    (segment,) = curveline.simulate(scene)
    (after,) = curveline.simulate(scene_after(scene, "itself@1w", lambda _: scene))
    moved = np.linalg.norm(segment.wanted.curve(201) - after.wanted.curve(201), axis=1).max()
    bound = set_bound(power_law(3.0), [segment.wanted])
    assert bound is not None
    assert 1e-3 < moved < bound.bound
