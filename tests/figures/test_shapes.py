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
from curveline.figures import common, shapes
from curveline.figures.common import COLOURS, GREY, PIXELS_PER_INCH, THICK, THIN, WIDTH, PanelFrame
from curveline.simulation.results import Settings, ShapeReport, curve_mm

SHAPES = Path(__file__).parents[2] / "shapes"


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


def panels_of(svg: str) -> list[str]:
    """What is in each panel that shows something."""
    return [part for part in re.split(r'<g id="axes_\d+">', svg)[1:] if "line2d" in part]


def test_kinds_of_states_differ_in_colour_and_what_is_wanted_in_width(reports: list[ShapeReport]) -> None:
    text = svg_of(reports[:1])
    assert f"stroke: {COLOURS['peak'].lower()}; stroke-width: {THICK}" in text
    assert f"stroke: {COLOURS['valley'].lower()}; stroke-width: {THIN}" in text
    assert len(set(COLOURS.values())) == len(COLOURS)
    assert common.colour_of("middle-1") == common.colour_of("middle-2") == common.OTHER
    assert common.colour_of("front-1") == COLOURS["front"]


def test_states_that_cannot_be_shown_are_grey_and_dotted(reports: list[ShapeReport]) -> None:
    assert "stroke-dasharray" not in svg_of(reports[:1])
    text = svg_of([report_on("level-up-peak", (0, 1, -1))])
    assert re.search(rf"stroke-dasharray: [^;]*; stroke-dashoffset: 0; stroke: {GREY}; stroke-width: 0.9", text)
    assert f">{shapes.UNSHOWN}</text>" in text


def test_several_shapes_make_a_grid(reports: list[ShapeReport]) -> None:
    one = imread(io.BytesIO(shapes.draw(reports[:1], "png")))
    four = imread(io.BytesIO(shapes.draw(reports, "png")))
    assert four.shape[1] == round(2 * shapes.PANEL_WIDTHS[2] * PIXELS_PER_INCH) > one.shape[1]
    assert len(panels_of(svg_of(reports))) == 4
    assert [shapes._across(reports[:1] * count) for count in (1, 2, 3, 4, 5, 9, 10, 16, 40)] == [
        1,
        2,
        3,
        2,
        3,
        3,
        4,
        4,
        4,
    ]


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
def test_no_figure_has_an_empty_band(reports: list[ShapeReport], count: int) -> None:
    image = imread(io.BytesIO(shapes.draw([*reports, report_on("roofline")][:count], "png")))[:, :, :3]
    inked = np.flatnonzero((image < 0.99).any(axis=(1, 2)))
    gaps = np.diff(np.concatenate([[0], inked, [image.shape[0]]])) / PIXELS_PER_INCH
    # The widest is between the last label and the legend.
    assert max(gaps) < 0.3


def test_panels_of_any_label_are_true_to_aspect_and_fill_their_places() -> None:
    for high in (0.3, 2.0):
        with common.new_figure(5.0, 7.0, "svg") as figure:
            panel = figure.subplots()
            PanelFrame(0.0, 12345.0, 0.0, 12345.0 * high).show_in(panel)
            common.fit_height(figure, [[panel]])
            common.bytes_of(figure, "svg")
            box, place = panel.get_position(), panel.get_position(original=True)
            assert box.height * figure.get_figheight() == pytest.approx(high * box.width * figure.get_figwidth())
            assert (box.height, box.width) == pytest.approx((place.height, place.width), rel=0.02)


def test_a_row_among_shapes_of_one_segment_has_a_line_for_itself(reports: list[ShapeReport]) -> None:
    roof = report_on("roofline")
    mixed = [*reports[:3], roof, reports[3]]
    assert shapes._across(mixed) == 2
    assert [[report.scene.name for report in line] for line in shapes._lines(mixed, 2)] == [
        ["level-up-peak", "level-up-valley"], ["staggered-neutral-peak"], ["roofline"], ["level-down-peak"],
    ]  # fmt: skip
    rows = shapes._rows(mixed, 2, 0.1)
    assert [[list(place.columns) for place in row] for row in rows] == [[[0], [1]], [[0]], [[0, 1]], [[0]]]
    assert len({rows[number][0].frame for number in (0, 1, 3)}) == 1
    assert len(panels_of(svg_of(mixed))) == 5


def test_long_rows_are_wide_and_flat_ones_have_a_scale(reports: list[ShapeReport]) -> None:
    roof = report_on("roofline")
    image = imread(io.BytesIO(shapes.draw([roof], "png")))
    assert image.shape[1] == round(WIDTH * PIXELS_PER_INCH)
    assert shapes._panel_width([replace(roof, segments=roof.segments * 2)], 1) == 8 * shapes.PER_SEGMENT
    assert shapes._panel_width([replace(roof, segments=roof.segments * 20)], 1) == shapes.WIDEST
    flat = PanelFrame(0.0, 100.0, 0.0, 1.0).within(0.1, 1.0)
    assert (flat.left, flat.right) == (0.0, 100.0)
    assert (flat.low, flat.high) == pytest.approx((-4.5, 5.5))
    tall = PanelFrame(0.0, 1.0, 0.0, 4.0).within(0.1, 1.0)
    assert (tall.left, tall.right, tall.low, tall.high) == pytest.approx((-1.5, 2.5, 0.0, 4.0))


def test_a_shape_that_leaves_the_plane_is_also_seen_from_above(reports: list[ShapeReport]) -> None:
    pushed = report_on("space/pushed")
    alone, image = svg_of([pushed]), imread(io.BytesIO(shapes.draw([pushed], "png")))[:, :, :3]
    assert len(panels_of(alone)) == 2
    assert alone == svg_of([pushed])
    # The others stay in the plane, and from above would be lines.
    assert len(panels_of(svg_of([*reports, pushed]))) == 6
    # The valley, in vermilion, is 161 mm high and gives way to the push by 50 mm, towards the viewer, who stands below.
    valley = np.array([0xD5, 0x5E, 0x00]) / 255
    rows, columns = np.nonzero(np.abs(image - valley).max(axis=2) < 0.02)
    border = 0.64 * image.shape[0]
    below = (rows > border) & (rows < image.shape[0] - 70)
    front = rows < border
    assert np.ptp(rows[below]) / np.ptp(rows[front]) == pytest.approx(50.1 / 161.0, rel=0.1)
    middle = below & (np.abs(columns - columns[below].mean()) < 40)
    assert rows[middle].mean() == pytest.approx(rows[below].max(), abs=4)


def test_a_state_that_leaves_the_plane_is_drawn_as_one_that_does_not_stay(reports: list[ShapeReport]) -> None:
    segment = reports[0].segments[0]
    buckled = replace(segment.states[0], name="buckled-1", leaves_plane=True, stable=False, wanted=False)
    assert shapes._look(buckled) == {
        "color": COLOURS["buckled"], "linestyle": common.DOES_NOT_STAY, "linewidth": THIN,
    }  # fmt: skip
    assert shapes._look(replace(buckled, winding=1)) == common.UNSHOWN_LOOK
    text = svg_of([replace(reports[0], segments=(replace(segment, states=[*segment.states, buckled]),))])
    for label in ("peak", "valley", "buckled", "thick: wanted", "dashed: does not stay"):
        assert f">{label}</text>" in text


def test_text_is_text_in_a_font_that_most_have(reports: list[ShapeReport]) -> None:
    text = svg_of(reports[:1])
    assert ">level-up-peak</text>" in text
    assert ">x [mm]</text>" in text
    fonts = set(re.findall(r"font-family: ([^;]*);", text))
    assert fonts == {"'DejaVu Sans', Verdana, Geneva, sans-serif"}


def test_a_long_legend_has_rows_and_a_long_title_is_cut() -> None:
    assert [list(column) for column in common._columns([1.0, 2.0, 3.0, 4.0, 5.0], 3)] == [[1.0, 2.0], [3.0, 4.0], [5.0]]
    with common.new_figure(2.0, 2.0, "svg") as figure:
        common.draw_legend(figure, [common.legend_entry(f"a long entry {number}") for number in range(6)])
        (legend,) = figure.legends
        figure.draw_without_rendering()
        assert legend.get_window_extent().width <= figure.bbox.width
    assert common.within("short", 1.0) == "short"
    cut = common.within("level-up-peak, staggered-down-valley, home", 2.0)
    assert cut == "level-up-peak, stagge..."


@pytest.mark.parametrize("kind", ["svg", "pdf", "png"])
def test_every_format_is_the_same_every_time(reports: list[ShapeReport], kind: str) -> None:
    data = shapes.draw(reports[:2], kind)
    assert data == shapes.draw(reports[:2], kind)
    if kind == "pdf":
        assert b"/FontFile2" in data
        assert b"CreationDate" not in data


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
