"""The committed shape files are the paper's sixteen and a roofline in four segments, and say what they show."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from curveline.rod.states.equilibrium import Outcome
from curveline.shapes.files import read_display, read_shape
from curveline.simulation.simulate import simulate
from curveline.units import mm, to_deg, to_mm

HERE = Path(__file__).parents[1]
SHAPES = HERE.parent / "shapes"
SPACE = sorted((SHAPES / "space").glob("*.toml"))
WEIGHT = 0.048 * 9.80665
PAPER = json.loads((HERE / "data" / "paper_shapes.json").read_text())


@pytest.mark.parametrize("state", ["peak", "valley"])
@pytest.mark.parametrize("case", PAPER["cases"])
def test_shape_has_the_boundary_conditions_of_the_paper(case: str, state: str) -> None:
    scene = read_shape(SHAPES / f"{case}-{state}.toml")
    wanted = PAPER["cases"][case]
    (left, right), (segment,) = scene.nodes, scene.segments
    assert scene.name == f"{case}-{state}"
    assert scene.display.name == "single"
    assert to_mm(scene.display.span) == pytest.approx(PAPER["span_mm"], rel=1e-14)
    assert (left.height, to_mm(right.height)) == pytest.approx((0.0, wanted["y_mm"]), rel=1e-14)
    assert [to_deg(left.angle), to_deg(right.angle)] == pytest.approx([wanted["theta1_deg"], wanted["theta2_deg"]])
    assert to_mm(segment.length) == pytest.approx(wanted["length_mm"], rel=1e-14)
    assert segment.state == state
    assert scene.loads == ()


def test_every_file_says_in_its_own_words_what_it_shows() -> None:
    files = sorted(SHAPES.glob("*.toml"))
    assert len(files) == 17
    comments = [file.read_text(encoding="utf-8").split("\n")[0] for file in files]
    assert all(comment.startswith("# ") and len(comment) > 40 for comment in comments)
    assert len(set(comments)) == len(files)


@pytest.mark.parametrize("file", sorted(SHAPES.glob("*.toml")), ids=lambda file: file.stem)
def test_every_file_is_valid_and_named_for_its_stem(file: Path) -> None:
    assert read_shape(file).name == file.stem


def test_the_roofline_is_that_of_a_teardrop_coupe() -> None:
    scene = read_shape(SHAPES / "roofline.toml")
    states = [segment.wanted for segment in simulate(scene)]
    outline = np.concatenate(
        [
            np.add(state.curve(101)[:-1], [index * scene.display.span, node.height])
            for index, (state, node) in enumerate(zip(states, scene.nodes, strict=False))
            if state is not None
        ]
    )
    assert outline.shape == (400, 2)
    x, height = outline.T
    assert np.all(np.diff(x) > 0.0)
    # A low, nearly level bonnet, a steep windscreen, the highest point behind it; from there a tail that only falls.
    assert np.ptp(height[x < 0.35]) < mm(20.0)
    top = int(np.argmax(height))
    assert 1.1 < x[top] < 1.35
    assert height[top] - height[x < 0.35].max() > mm(330.0)
    assert np.all(np.diff(height[top:]) < 0.0)
    assert np.all(np.diff(height[(x > 0.4) & (x <= x[top])]) > 0.0)
    slope = to_deg(1.0) * np.arctan2(np.diff(height), np.diff(x))
    assert 0.6 < x[np.argmax(slope)] < 0.8
    assert 30.0 < slope.max() < 45.0
    # The slope falls along the bonnet, rises to the windscreen, and falls from there on: no ripples beside these.
    bends = [slope[0], slope[x[:-1] < 0.35].min(), slope.max(), slope[-1]]
    assert np.abs(np.diff(slope)).sum() < np.abs(np.diff(bends)).sum() + 2.0


def test_the_roofline_is_comfortably_held() -> None:
    scene = read_shape(SHAPES / "roofline.toml")
    rod, drive = scene.display.rod, scene.display.drive
    forces, moments = np.zeros((5, 2)), np.zeros(5)
    for index, segment in enumerate(simulate(scene)):
        state = segment.wanted
        assert state is not None
        assert state.outcome is Outcome.CONVERGED
        assert state.lowest_eigenvalue > 0.6 * 4.0 * math.pi**2
        assert state.max_curvature < 0.2 * rod.max_curvature
        forces[index : index + 2] += state.clamp_force
        moments[index : index + 2] += state.clamp_moment
    # A node's motors hold the difference between its two neighbours.
    assert np.abs(forces).max() < 0.3 * drive.max_force
    assert np.abs(moments).max() < 0.3 * drive.max_moment
    assert sum(segment.length for segment in scene.segments) < rod.total_length


@pytest.mark.parametrize("file", SPACE, ids=lambda file: file.stem)
def test_every_shape_in_space_exists_and_leaves_the_plane_as_it_was_asked_to(file: Path) -> None:
    assert file.read_text(encoding="utf-8").startswith("# ")
    scene = read_shape(file)
    assert scene.name == file.stem
    assert scene.beyond_the_plane
    (segment,) = simulate(scene)
    assert segment.model == "spatial"
    assert segment.wanted is not None
    assert segment.wanted.outcome is Outcome.CONVERGED
    assert mm(5.0) < float(np.abs(segment.wanted.depth(101)).max()) < mm(100.0)


def test_how_the_shapes_in_space_leave_the_plane() -> None:
    pushed, twisted, leaning = (
        simulate(read_shape(SHAPES / "space" / f"{name}.toml"))[0].wanted for name in ("pushed", "twisted", "leaning")
    )
    assert pushed is not None
    assert twisted is not None
    assert leaning is not None
    # The push acts towards the viewer, and half of it is held by either clamp.
    assert pushed.depth(3)[1] == pytest.approx(mm(8.17), abs=mm(0.05))
    assert pushed.space is not None
    assert pushed.space.forces[:, 2] == pytest.approx([-0.5, -0.5], abs=1e-6)
    assert float(np.abs(twisted.depth(101)).max()) == pytest.approx(mm(74.0), abs=mm(0.5))
    # The bearing that is turned to the viewer carries the rod there, and the weight that pulls it back is held.
    assert leaning.depth(101)[2] > 0.0
    assert leaning.space is not None
    weight = 0.5 * leaning.rod.free_length * WEIGHT / math.hypot(0.866, 0.5)
    assert leaning.space.forces[:, 2].sum() == pytest.approx(weight, rel=1e-6)


def test_the_leaning_display_is_the_single_one_but_for_gravity() -> None:
    leaning, single = read_display(SHAPES / "space" / "displays" / "leaning.toml"), read_display("single")
    assert leaning.down != single.down
    same = replace(leaning, name=single.name, down=single.down, digest=single.digest, path=single.path)
    assert same == single
