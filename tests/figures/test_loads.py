"""Figures of pushed shapes and of maps: what is in them, and that they are the same every time."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

import curveline
from curveline.figures import common, loads
from curveline.loading.load_map import LoadMap, load_map
from curveline.loading.pushes import Push
from curveline.loading.snap_through import Loading, load

SHAPES = Path(__file__).parents[2] / "shapes"


@pytest.fixture(scope="module")
def pushed() -> Loading:
    return load(curveline.read_shape(SHAPES / "level-up-peak.toml"), Push())


@pytest.fixture(scope="module")
def mapped() -> LoadMap:
    return load_map(curveline.read_shape(SHAPES / "level-up-peak.toml"), Push(), 15)


def colours(svg: str) -> set[str]:
    return {found.upper() for found in re.findall(r"stroke: (#[0-9a-f]{6})", svg)}


def test_a_push_shows_both_curves_the_load_and_where_the_rod_lands(pushed: Loading) -> None:
    svg = loads.draw_loading(pushed, "svg").decode()
    assert svg == loads.draw_loading(pushed, "svg").decode()
    assert "<dc:date>" not in svg
    assert {common.COLOURS["peak"], common.COLOURS["valley"], common.FORCE, common.GREY} <= colours(svg)
    for text in ("level-up-peak", "F", "bifurcation at 6.76 N, lands in valley", "deflection along the load [mm]"):
        assert f">{text}</text>" in svg


def test_the_legend_names_all_lines_and_the_star(pushed: Loading) -> None:
    svg = loads.draw_loading(pushed, "svg").decode()
    legend = svg.split('id="legend_1"')[1]
    for text in ("peak, unloaded", "just before it snaps", "lands in valley", "does not stay", "snaps through"):
        assert f">{text}</text>" in legend
    # Only what does not stay is dashed.
    dashed = re.findall(r'style="fill: none; stroke-dasharray[^"]*stroke: (#[0-9a-f]{6})', svg)
    assert dashed == [common.DARK] * 2


def test_both_panels_are_as_high_and_true_to_aspect(pushed: Loading, mapped: LoadMap) -> None:
    for found in (pushed, mapped):
        svg = loads.draw(found, "svg").decode()
        boxes = [
            [float(number) for number in re.findall(r"-?[\d.]+", path)]
            for path in re.findall(r'id="patch_\d+">\s*<path d="([^"]*)z?\s*" style="fill: #ffffff"', svg)
        ]
        # The figure itself, then its panels: x and y of the corners.
        panels = [(box[1::2], box[0::2]) for box in boxes[1:3]]
        assert panels[0][0] == pytest.approx(panels[1][0], abs=0.5)


def test_a_response_is_smooth_and_meets_its_rows(pushed: Loading) -> None:
    rows = np.array(pushed.rows)[:, ::-1] * [1e3, 1.0]
    branch = np.array([(1e3 * point.deflection, point.force, point.unstable) for point in pushed.branch])
    stable, beyond = loads.smoothed(rows, branch[branch[:, 2] == 0, :2], branch[branch[:, 2] > 0, :2])
    size = np.ptp(rows, axis=0)
    for row in rows:
        assert np.min(np.linalg.norm((stable - row) / size, axis=1)) < 2e-3
    assert beyond[0] == pytest.approx(rows[-1])
    whole = np.vstack([stable, beyond[1:]])
    steps = np.diff(whole, axis=0) / size
    angles = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    # A polygon would turn by several degrees at each of its corners.
    assert np.max(np.abs(np.diff(angles))) < np.radians(1.5)


def test_a_push_of_one_row_and_no_branch_has_no_curve() -> None:
    one = np.array([[0.0, 0.0]])
    none = np.empty((0, 2))
    stable, beyond = loads.smoothed(one, none, none)
    assert stable.tolist() == beyond.tolist() == [[0.0, 0.0]]


def test_a_pull_that_does_not_snap_is_shown_without_a_landing() -> None:
    scene = curveline.read_shape(SHAPES / "level-up-peak.toml")
    svg = loads.draw_loading(load(scene, Push(direction="0,1", most=1.0)), "svg").decode()
    assert ">no snap-through up to 1 N</text>" in svg
    assert "lands in" not in svg
    assert "does not stay" not in svg
    assert common.COLOURS["valley"] not in colours(svg)


def test_a_map_shows_what_fingers_do_and_the_weakest_point(mapped: LoadMap) -> None:
    svg = loads.draw_map(mapped, "svg").decode()
    assert svg == loads.draw_map(mapped, "svg").decode()
    assert mapped.weakest is not None
    for text in ("1 N", "5 N", "yields to 5 N", "more than 20 N", f"weakest point: {mapped.weakest.force:.3g} N"):
        assert f">{text}</text>" in svg
    assert "stroke-dasharray" not in svg


def test_pixels_are_as_many_as_the_panels_need(pushed: Loading, mapped: LoadMap) -> None:
    for data in (loads.draw_loading(pushed, "png"), loads.draw_map(mapped, "png")):
        image = imread(io.BytesIO(data))
        assert image.shape[1] == round((loads.LEFT + loads.RIGHT) * common.PIXELS_PER_INCH)
        assert image.min() < 0.3
