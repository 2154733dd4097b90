"""Figures: true to aspect, deterministic, and what is in them."""

from __future__ import annotations

import io
import re
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.image import imread

import curveline
from curveline.errors import MissingExtra
from curveline.figures import shapes
from curveline.figures.common import COLOURS, GREY, OTHER, PIXELS_PER_INCH, STYLES, THIN, WIDTH
from curveline.simulation.results import Settings, ShapeReport, curve_mm

SHAPES = Path(__file__).parent.parent / "shapes"


def report_on(name: str, windings: tuple[int, ...] = (0,)) -> ShapeReport:
    settings = Settings(windings=windings, points=51)
    scene = curveline.read_shape(SHAPES / f"{name}.toml")
    return ShapeReport(scene, tuple(curveline.simulate(scene, settings.tolerance, windings)), settings, 0.1)


@pytest.fixture(scope="module")
def reports() -> list[ShapeReport]:
    return [
        report_on(name) for name in ("level-up-peak", "level-up-valley", "staggered-neutral-peak", "level-down-peak")
    ]


def svg_of(reports: list[ShapeReport]) -> str:
    return shapes.draw(reports, "svg").decode()


def test_svg_is_the_same_every_time_and_holds_no_date(reports: list[ShapeReport]) -> None:
    text = svg_of(reports[:1])
    assert text == svg_of(reports[:1])
    assert "<dc:date>" not in text
    assert not re.search(r"20\d\d-\d\d", text)


def test_settings_of_the_user_do_not_show(reports: list[ShapeReport]) -> None:
    text = svg_of(reports[:1])
    with matplotlib.rc_context({"axes.facecolor": "red", "lines.linewidth": 9.0, "font.size": 30.0}):
        assert svg_of(reports[:1]) == text


def test_png_is_the_same_every_time(reports: list[ShapeReport]) -> None:
    data = shapes.draw(reports[:1], "png")
    assert data == shapes.draw(reports[:1], "png")
    image = imread(io.BytesIO(data))
    assert image.shape[1] == round(WIDTH * PIXELS_PER_INCH)
    assert image.min() < 0.3
    assert image.max() == 1.0


def test_the_wanted_curve_is_true_to_aspect_and_thick(reports: list[ShapeReport]) -> None:
    image = imread(io.BytesIO(shapes.draw(reports[:1], "png")))[:, :, :3]
    blue = np.array([0x00, 0x72, 0xB2]) / 255
    rows, columns = np.nonzero(np.abs(image - blue).max(axis=2) < 0.02)
    keep = rows < image.shape[0] - 80  # the legend lies below
    height, width = np.ptp(rows[keep]), np.ptp(columns[keep])
    curve = curve_mm(reports[0], 0, reports[0].segments[0].states[0])
    assert height / width == pytest.approx(np.ptp(curve[:, 1]) / np.ptp(curve[:, 0]), rel=0.03)


def test_peak_and_valley_differ_in_colour_and_style(reports: list[ShapeReport]) -> None:
    text = svg_of(reports[:1])
    for colour in COLOURS.values():
        assert colour.lower() in text
    assert "stroke-dasharray" in text
    assert len(set(COLOURS.values())) == len({str(style) for style in STYLES.values()}) == 2


def test_states_that_cannot_be_shown_are_grey_and_thin(reports: list[ShapeReport]) -> None:
    assert f"stroke: {GREY}; stroke-width: 0.6" not in svg_of(reports[:1])
    text = svg_of([report_on("level-up-peak", (0, 1, -1))])
    assert re.search(rf"stroke-dasharray: [^;]*; stroke-dashoffset: 0; stroke: {GREY}; stroke-width: 0.6", text)


def test_several_shapes_make_a_grid(reports: list[ShapeReport]) -> None:
    one = imread(io.BytesIO(shapes.draw(reports[:1], "png")))
    four = imread(io.BytesIO(shapes.draw(reports, "png")))
    assert four.shape[1] == round(3 * shapes.SMALL_WIDTH * PIXELS_PER_INCH) > one.shape[1]
    assert svg_of(reports).count('id="axes_') >= 4


def test_a_shape_that_leaves_the_plane_is_also_seen_from_above(reports: list[ShapeReport]) -> None:
    pushed = report_on("space/pushed")
    alone, image = svg_of([pushed]), imread(io.BytesIO(shapes.draw([pushed], "png")))[:, :, :3]
    assert alone.count('id="axes_') == 2 * svg_of(reports[:1]).count('id="axes_')
    assert alone == svg_of([pushed])
    assert svg_of([*reports, pushed]).count('id="axes_') >= 10
    # The valley, in vermilion, is 161 mm high and gives way to the push by 50 mm, towards the viewer, who stands below.
    dashed = np.array([0xD5, 0x5E, 0x00]) / 255
    rows, columns = np.nonzero(np.abs(image - dashed).max(axis=2) < 0.02)
    below = (rows > 0.75 * image.shape[0]) & (rows < image.shape[0] - 80)
    front = rows < 0.7 * image.shape[0]
    assert np.ptp(rows[below]) / np.ptp(rows[front]) == pytest.approx(50.1 / 161.0, rel=0.1)
    middle = below & (np.abs(columns - columns[below].mean()) < 40)
    assert rows[middle].mean() == pytest.approx(rows[below].max(), abs=4)


def test_a_state_that_leaves_the_plane_is_drawn_under_its_name(reports: list[ShapeReport]) -> None:
    segment = reports[0].segments[0]
    buckled = replace(segment.states[0], name="buckled-1", leaves_plane=True, stable=False, wanted=False)
    assert shapes._style(buckled) == {
        "label": "buckled-1", "color": OTHER, "linestyle": "-.", "linewidth": THIN,
    }  # fmt: skip
    assert shapes._style(replace(buckled, winding=1))["label"] == shapes.UNSHOWN


def test_a_name_with_signs_is_text(reports: list[ShapeReport]) -> None:
    report = replace(reports[0], scene=replace(reports[0].scene, name=r"$\frac{a}$ <b> & $"))
    assert svg_of([report]).startswith("<?xml")


def test_without_matplotlib_the_extra_is_named(monkeypatch: pytest.MonkeyPatch, reports: list[ShapeReport]) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtra) as caught:
        shapes.draw(reports, "svg")
    assert "curveline[plot]" in caught.value.hint


def test_pyplot_stays_out() -> None:
    assert "matplotlib.pyplot" not in sys.modules
