"""Figures of pushed shapes and of maps: what is in them, and that they are the same every time."""

from __future__ import annotations

import io
import re
from pathlib import Path

import pytest
from matplotlib.image import imread

import curveline
from curveline.figures import common, loads
from curveline.loading.load_map import LoadMap, load_map
from curveline.loading.pushes import Push
from curveline.loading.snap_through import Loading, load

SHAPES = Path(__file__).parent.parent / "shapes"


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
    assert {common.COLOURS["peak"], common.COLOURS["valley"], loads.ORANGE, common.GREY} <= colours(svg)
    for text in ("level-up-peak", "peak, unloaded", "just before it snaps, 6.76 N", "lands in valley", "F"):
        assert f"<!-- {text} -->" in svg
    assert "<!-- bifurcation at 6.76 N, lands in valley -->" in svg
    assert "deflection along the load [mm]" in svg


def test_a_pull_that_does_not_snap_is_shown_without_a_landing() -> None:
    scene = curveline.read_shape(SHAPES / "level-up-peak.toml")
    svg = loads.draw_loading(load(scene, Push(direction="0,1", most=1.0)), "svg").decode()
    assert "<!-- no snap-through up to 1 N -->" in svg
    assert "lands in" not in svg
    assert common.COLOURS["valley"] not in colours(svg)


def test_a_map_shows_what_fingers_do_and_the_weakest_point(mapped: LoadMap) -> None:
    svg = loads.draw_map(mapped, "svg").decode()
    assert svg == loads.draw_map(mapped, "svg").decode()
    assert mapped.weakest is not None
    for text in ("1 N", "5 N", "yields to 5 N", "more than 20 N", f"weakest point: {mapped.weakest.force:.3g} N"):
        assert f"<!-- {text} -->" in svg


def test_pixels_are_as_many_as_the_panels_need(pushed: Loading, mapped: LoadMap) -> None:
    for data in (loads.draw_loading(pushed, "png"), loads.draw_map(mapped, "png")):
        image = imread(io.BytesIO(data))
        assert image.shape[1] == round((loads.LEFT + loads.RIGHT) * common.PIXELS_PER_INCH)
        assert image.min() < 0.3
