"""DXF files: units, bulges, pieces that are joined, and what is refused."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
from ezdxf.enums import InsertUnits

from curveline.drawings.reading import read_drawing
from curveline.drawings.sketch import HowToRead
from drawings.curves import arc, bezier, off, refusal

Draw = Callable[[Any], object]
EXACT = 0.02


@pytest.fixture
def saved(tmp_path: Path) -> Callable[..., Path]:
    """What writes a DXF file of what a function draws into its model space."""

    def save(draw: Draw, units: int = InsertUnits.Millimeters, version: str = "R2010") -> Path:
        document = ezdxf.new(version, units=units)
        draw(document.modelspace())
        stream = io.StringIO()
        document.write(stream)
        path = tmp_path / "curve.dxf"
        path.write_text(stream.getvalue(), encoding="utf-8")
        return path

    return save


def hill(space: Any) -> None:
    """Four pieces, not in order and not in one direction: a line, an arc, bulges, a spline."""
    space.add_lwpolyline([(200, 50, 0, 0, -0.5), (300, 50, 0, 0, 0), (320, 40)])
    space.add_line((0, 0), (100, 0), dxfattribs={"layer": "roof"})
    space.add_open_spline([(500, 0), (440, 10), (400, 100), (320, 40)])
    space.add_arc((100, 100), 100, 270, 330)


def test_pieces_of_all_kinds_are_joined(saved: Callable[..., Path]) -> None:
    def draw(space: Any) -> None:
        hill(space)
        space.add_line((100 + 100 * np.cos(np.radians(330)), 50), (200, 50))

    # A bulge of -1/2 turns right by 4 atan(1/2): radius 62.5 over a chord of 100, its middle 25 above that.
    bulge = arc((250, 50 - 37.5), 62.5, 90 + 53.130102, 90 - 53.130102)
    spline = bezier((320, 40), (400, 100), (440, 10), (500, 0))
    truth = np.vstack([[[0, 0]], arc((100, 100), 100, 270, 330), bulge, spline])
    drawing = read_drawing(saved(draw))
    assert off(drawing, truth) < EXACT
    assert "DXF in mm, 1 unit = 1 mm, 5 pieces joined, 500 x" in drawing.understood


@pytest.mark.parametrize(
    ("units", "unit", "scale"),
    [
        (InsertUnits.Inches, "", 25.4),
        (InsertUnits.Feet, "", 304.8),
        (InsertUnits.Centimeters, "", 10.0),
        (InsertUnits.Unitless, "in", 25.4),
        (InsertUnits.Inches, "mm", 1.0),
    ],
)
def test_units_are_those_of_the_file_or_of_whoever_asks(
    units: int, unit: str, scale: float, saved: Callable[..., Path]
) -> None:
    path = saved(lambda space: space.add_arc((10, 0), 10, 30, 150), units)
    drawing = read_drawing(path, HowToRead(unit=unit))
    assert off(drawing, arc((10, 0), 10, 150, 30) * scale) < EXACT
    assert f"1 unit = {scale:g} mm" in drawing.understood


def test_a_file_of_no_unit_is_refused(saved: Callable[..., Path]) -> None:
    path = saved(lambda space: space.add_line((0, 0), (20, 0)), version="R12")
    code, message, hint, _ = refusal(path)
    assert code == "no-unit"
    assert "$INSUNITS" in message
    assert "--unit in" in hint
    assert read_drawing(path, HowToRead(width_mm=400.0)).points[-1, 0] == pytest.approx(0.4)


def ellipse(space: Any) -> None:
    space.add_ellipse((250, 0), (250, 0), 0.4, 0.0, np.pi)


def mirrored(space: Any) -> None:
    """As CAD mirrors: seen from below, so that x runs backwards."""
    space.add_arc((-250, 0), 250, 0, 180, dxfattribs={"extrusion": (0, 0, -1)})


def heavy(space: Any) -> None:
    space.add_polyline2d([(0, 0, -1.0), (500, 0, 0.0)], format="xyb")


def raised(space: Any) -> None:
    space.add_lwpolyline([(0, 0, -1.0), (500, 0, 0.0)], format="xyb", dxfattribs={"elevation": 7.0})


def in_space(space: Any) -> None:
    space.add_polyline3d([(250 - 250 * np.cos(t), 250 * np.sin(t), 3.0) for t in np.linspace(0, np.pi, 2001)])


def rational(space: Any) -> None:
    half = np.sqrt(0.5)
    control = [(0, 0), (0, 250), (250, 250), (500, 250), (500, 0)]
    space.add_rational_spline(control, [1, half, 1, half, 1], degree=2, knots=[0, 0, 0, 1, 1, 2, 2, 2])


HALF = arc((250, 0), 250, 180, 0)


@pytest.mark.parametrize(
    ("draw", "truth"),
    [
        (ellipse, HALF * [1, 0.4]),
        (mirrored, HALF),
        (heavy, HALF),
        (raised, HALF),
        (in_space, HALF),
        (rational, HALF),
    ],
)
def test_one_entity(draw: Draw, truth: Any, saved: Callable[..., Path]) -> None:
    assert off(read_drawing(saved(draw)), truth) < EXACT


def test_weights_of_a_spline_count(saved: Callable[..., Path]) -> None:
    points = np.array([[0, 0, 0], [100, 200, 0], [200, -100, 0], [300, 150, 0], [500, 0, 0]], dtype=float)
    weights = [1, 5, 0.5, 2, 1]
    path = saved(lambda space: space.add_rational_spline(points, weights, degree=3))
    curve = ezdxf.math.BSpline(points, order=4, weights=weights)
    truth = np.array([(p.x, p.y) for p in curve.approximate(20_000)])
    drawing = read_drawing(path)
    assert off(drawing, truth) < EXACT
    assert len(drawing.points) < 5000


def test_a_spline_that_no_points_could_follow_is_refused(saved: Callable[..., Path]) -> None:
    def draw(space: Any) -> None:
        space.add_rational_spline([(0, 0), (250, 90), (500, 0)], [1, 1e9, 1], degree=2)

    assert refusal(saved(draw))[0] == "damaged"


@pytest.mark.parametrize("degree", [2, 3, 5])
def test_splines_of_many_spans_are_followed_everywhere(degree: int, saved: Callable[..., Path]) -> None:
    random = np.random.default_rng(degree)
    points = np.column_stack([np.linspace(0, 500, 13), random.uniform(0, 200, 13)])
    points[5] = points[6]  # a corner

    def draw(space: Any) -> None:
        space.add_open_spline(np.column_stack([points, np.zeros(13)]), degree=degree)

    curve = ezdxf.math.BSpline(points, order=degree + 1)
    truth = np.array([(p.x, p.y) for p in curve.approximate(20_000)])
    assert off(read_drawing(saved(draw)), truth) < EXACT


def test_layers_and_handles_are_names(saved: Callable[..., Path]) -> None:
    def draw(space: Any) -> None:
        space.add_line((0, 0), (250, 0), dxfattribs={"layer": "roof"})
        space.add_line((250, 0), (500, 9), dxfattribs={"layer": "roof"})
        space.add_line((0, 50), (500, 50), dxfattribs={"layer": "two", "handle": "ABC"})
        space.add_line((0, 60), (500, 60), dxfattribs={"layer": "two", "handle": "ABD"})
        space.add_text("hill", dxfattribs={"layer": "notes"})
        space.doc.layers.add("secret").off()
        space.add_line((0, 70), (500, 70), dxfattribs={"layer": "secret"})

    path = saved(draw)
    code, message, hint, _ = refusal(path)
    assert (code, message) == ("several-curves", "there are 3 curves in it")
    assert "--curve 'roof', 'ABC', 'ABD'" in hint
    assert refusal(path, curve="two")[0] == "several-curves"
    code, _, hint, _ = refusal(path, curve="rof")
    assert (code, hint) == ("no-such-curve", "choose 'roof'")
    drawing = read_drawing(path, HowToRead(curve="roof"))
    np.testing.assert_allclose(drawing.points * 1e3, [[0, 0], [250, 0], [500, 9]])
    assert "1 TEXT, 1 hidden line left out" in drawing.understood
    np.testing.assert_allclose(read_drawing(path, HowToRead(curve="ABD")).points * 1e3, [[0, 60], [500, 60]])


def test_a_line_that_was_drawn_twice_is_one(saved: Callable[..., Path]) -> None:
    def draw(space: Any) -> None:
        for _ in range(2):
            space.add_lwpolyline([(0, 0), (250, 40), (500, 0)])
        space.add_lwpolyline([(500, 0), (250, 40), (0, 0)])

    np.testing.assert_allclose(read_drawing(saved(draw)).points * 1e3, [[0, 0], [250, 40], [500, 0]])


def test_closed_outlines_have_edges(saved: Callable[..., Path]) -> None:
    path = saved(lambda space: space.add_circle((250, 0), 250))
    assert refusal(path)[0] == "closed"
    assert off(read_drawing(path, HowToRead(edge="upper")), HALF) < EXACT
    assert off(read_drawing(path, HowToRead(edge="lower")), HALF * [1, -1]) < EXACT


def block(space: Any) -> None:
    space.doc.blocks.new("b").add_line((0, 0), (500, 0))
    space.add_blockref("b", (0, 0))
    space.add_line((0, 0), (500, 0), dxfattribs={"layer": "roof"})


def test_blocks_are_refused_with_a_way_round_them(saved: Callable[..., Path]) -> None:
    path = saved(block)
    code, _, hint, _ = refusal(path)
    assert code == "block"
    assert hint == "explode blocks first, or name a layer of lines: --curve 'roof'"
    assert len(read_drawing(path, HowToRead(curve="roof")).points) == 2


@pytest.mark.parametrize(
    ("draw", "code"),
    [
        (lambda space: space.add_line((0, 0, 0), (500, 0, 9)), "in-space"),
        (lambda space: space.add_circle((0, 0), 5, dxfattribs={"extrusion": (1, 0, 0)}), "in-space"),
        (lambda space: space.add_3dface([(0, 0), (1, 0), (1, 1), (0, 1)]), "no-line"),
        (lambda space: space.add_text("hill"), "no-curve"),
        (lambda space: None, "no-curve"),
        (lambda space: space.add_line((0, 0), (1e9, 0)), "far-away"),
        (lambda space: (space.add_line((0, 0), (200, 0)), space.add_line((200.5, 0), (500, 0))), "gap"),
        (lambda space: [space.add_line((200, 0), (300 * k, 9)) for k in range(3)], "fork"),
    ],
)
def test_what_is_no_line_in_a_plane_is_refused(draw: Draw, code: str, saved: Callable[..., Path]) -> None:
    assert refusal(saved(draw))[0] == code


def test_what_is_left_of_a_file_is_refused(saved: Callable[..., Path]) -> None:
    path = saved(hill)
    text = path.read_text(encoding="utf-8")
    path.write_text(text[: text.rindex("SPLINE")], encoding="utf-8")
    assert refusal(path)[0] == "cut-off"
    path.write_bytes(b"AutoCAD Binary DXF\r\n\x1a\0" + bytes(100))
    code, _, hint, _ = refusal(path)
    assert code == "binary"
    assert "ASCII" in hint
