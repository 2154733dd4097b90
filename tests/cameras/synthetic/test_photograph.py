"""Synthetic photographs show the rod, the tags and the nodes where the camera sees them."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import curveline
from curveline.cameras.pose import FoundView, find_view
from curveline.cameras.synthetic.faults import PictureFaults, faults_of
from curveline.cameras.synthetic.painted import PaintedPicture
from curveline.cameras.synthetic.photograph import curves_of, photograph_of
from curveline.cameras.synthetic.standpoints import default_setup, default_view, standpoint_of
from curveline.cameras.view import View
from curveline.scene import Scene
from curveline.shapes.files import read_shape
from curveline.simulation.simulate import simulate
from curveline.units import mm

PLAIN = PictureFaults(wall=60.0, contrast=140.0, blur=0.3, noise=0.0, quality=0)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return read_shape("shapes/level-up-peak.toml")


def pixels_of(view: View, points: np.ndarray, depth: float) -> np.ndarray:
    return np.rint(view.pixels(np.column_stack([points, np.full(len(points), depth)]))).astype(int)


def test_polygons_cover_as_much_as_they_are_large() -> None:
    picture = PaintedPicture((40, 30), 0.0)
    picture.paint([np.array([[5.25, 6.5], [25.75, 6.5], [25.75, 20.25], [5.25, 20.25]])], [100.0])
    assert picture.greys.sum() / 100.0 == pytest.approx(20.5 * 13.75, rel=0.04)
    rows, columns = np.nonzero(picture.greys > 99.0)
    assert (rows.mean(), columns.mean()) == pytest.approx((13.5, 15.5), abs=0.26)


def test_the_rod_is_where_the_camera_sees_it(scene: Scene) -> None:
    view = default_view(scene.display)
    setup, curves = default_setup(scene.display, view.lens), curves_of(scene, [simulate(scene)[0].states[0]])
    picture = photograph_of(scene, curves, setup, view, PLAIN)
    front = pixels_of(view, curves[0][60:-60], 0.5 * setup.rod.depth)
    assert np.all(picture[front[:, 1], front[:, 0]] > 170)
    # 20 mm farther out there is the wall.
    wall = pixels_of(view, curves[0][150:-150] + np.array([0.0, mm(20.0)]), 0.5 * setup.rod.depth)
    assert np.all(picture[wall[:, 1], wall[:, 0]] < 80)


def test_teeth_stand_on_their_side(scene: Scene) -> None:
    view = default_view(scene.display)
    setup, curves = default_setup(scene.display, view.lens), curves_of(scene, [simulate(scene)[0].states[0]])
    tips = curves[0][180:220] + np.array([0.0, mm(2.5)])
    place = pixels_of(view, tips, 0.5 * setup.rod.depth)
    levels = []
    for side in (1, -1):
        turned = replace(setup, rod=replace(setup.rod, side=side))
        picture = photograph_of(scene, curves, turned, view, PLAIN)
        levels.append(float(picture[place[:, 1], place[:, 0]].mean()))
    assert levels[0] > levels[1] + 30.0


def test_tags_tell_where_the_camera_is(scene: Scene) -> None:
    view = standpoint_of(scene.display, 3)
    setup = default_setup(scene.display, view.lens)
    found = find_view(photograph_of(scene, [], setup, view, faults_of("clean", 3)), view.lens, setup.frame)
    assert isinstance(found, FoundView)
    assert len(found.tags) == len(setup.frame.tags)
    points = np.array([[0.0, 0.0], [0.25, 0.15], [0.5, -0.1]])
    seen = view.pixels(np.column_stack([points, np.zeros(3)]))
    assert found.view.in_plane(seen) == pytest.approx(points, abs=mm(0.1))


def test_a_seed_makes_the_same_picture_again(scene: Scene) -> None:
    view = default_view(scene.display)
    setup = default_setup(scene.display, view.lens)
    one, again, other = (photograph_of(scene, [], setup, view, faults_of("lab", seed)) for seed in (4, 4, 5))
    assert np.array_equal(one, again)
    assert not np.array_equal(one, other)


def test_what_traces_knows_nothing_of_what_paints() -> None:
    for path in (Path(curveline.__file__).parent / "tracing").rglob("*.py"):
        names = [
            node.module or "" for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.ImportFrom)
        ]
        assert not any(name.startswith("curveline.cameras.synthetic") for name in names), path
