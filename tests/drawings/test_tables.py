"""Points from tables."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from curveline.drawings.reading import read_drawing
from curveline.drawings.sketch import HowToRead
from curveline.errors import InvalidInput
from drawings.curves import refusal

Write = Callable[[str, str | bytes], Path]

POINTS = [[0, 1.5], [250, 60], [500, 1.5]]


@pytest.mark.parametrize(
    ("name", "text", "unit"),
    [
        ("a.csv", "x_mm,y_mm\n0,1.5\n250,60\n500,1.5\n", ""),
        ("a.csv", "\ufeffx_mm, y_mm\r\n0, 1.5\r\n250, 60\r\n500, 1.5\r\n", ""),
        ("a.csv", "y_mm,note,x_mm\n1.5,,0\n60,\"a, b\",250\n1.5,x,500", ""),
        ("a.csv", "x_cm;y_cm\n0;0,15\n25;6\n50;0,15\n", ""),
        ("a.tsv", "x\ty\n0\t.15e1\n# a remark\n\n250\t60\n500\t1.5\n", "mm"),
        ("a.txt", "x_in,y_in\n0,0.0590551181102\n9.84251968504,2.36220472441\n19.685039370079,0.0590551181102", ""),
    ],
)  # fmt: skip
def test_tables_as_programs_write_them(name: str, text: str, unit: str, write: Write) -> None:
    drawing = read_drawing(write(name, text), HowToRead(unit=unit))
    np.testing.assert_allclose(drawing.points * 1e3, POINTS, atol=1e-9)
    assert drawing.understood.startswith("CSV of 3 points, columns x")
    assert "500 x 58.5 mm in all" in drawing.understood


def test_a_column_tells_curves_apart(write: Write) -> None:
    text = "curve,x_mm,y_mm\nroof,0,0\nhill,0,9\nroof,500,1\nhill,500,10\n"
    path = write("two.csv", text)
    code, message, hint, _ = refusal(path)
    assert (code, message, hint) == (
        "several-curves",
        "there are 2 curves in it",
        "name one of them: --curve 'roof', 'hill'",
    )
    drawing = read_drawing(path, HowToRead(curve="hill"))
    np.testing.assert_allclose(drawing.points * 1e3, [[0, 9], [500, 10]])
    assert refusal(path, curve="rof")[2] == "choose 'roof'"
    assert refusal(write("one.csv", "x_mm,y_mm\n0,0\n9,9"), curve="roof")[2].startswith("its curves have no names")


def test_curves_that_meet_are_not_joined(write: Write) -> None:
    assert refusal(write("two.csv", "curve,x_mm,y_mm\na,0,0\na,9,0\nb,9,0\nb,20,0"))[0] == "several-curves"


def test_from_right_to_left_is_from_left_to_right(write: Write) -> None:
    drawing = read_drawing(write("back.csv", "x_mm,y_mm\n500,1\n0,2\n"))
    np.testing.assert_allclose(drawing.points * 1e3, [[0, 2], [500, 1]])


def test_all_lines_that_are_no_points_are_told(write: Write) -> None:
    path = write("bad.csv", "x_mm,y_mm\n0,0\nnan,3\n5\n9,1e999\nhill,4\n500,0\n")
    with pytest.raises(InvalidInput) as caught:
        read_drawing(path)
    found = caught.value.diagnostics
    assert [each.line for each in found] == [3, 4, 5, 6]
    assert {each.code for each in found} == {"no-point"}
    assert [each.source for each in found] == ["nan,3", "5", "9,1e999", "hill,4"]


@pytest.mark.parametrize(
    ("text", "how", "code"),
    [
        ("x,y\n0,0\n500,0", {}, "no-unit"),
        ("x_mm,y_mm\n0,0\n500,0", {"unit": "in"}, "two-units"),
        ("0,0\n500,0", {}, "header"),
        ("x_mm,y_cm\n0,0\n500,0", {}, "header"),
        ("x_mm,y_mm\n", {}, "no-curve"),
        ("x_mm,y_mm\n5,5\n", {}, "no-curve"),
        ("x_mm,y_mm\n5,5\n5,5\n5,5", {}, "no-curve"),
        ("x_mm,y_mm\n0,0\n1e9,0", {}, "far-away"),
        ("x_mm,y_mm\n0,0\n500,0\n250,99\n0,0", {}, "closed"),
        ("  \n\n", {}, "empty"),
        ("", {}, "empty"),
        (b"x_mm,y_mm\n0,\xff\n", {}, "encoding"),
        (b"x_mm,y_mm\n0,\0\n", {}, "encoding"),
        ("x,y\n5,5\n5,9", {"width_mm": 500.0}, "no-width"),
        ("x,y\n0,0\n1,1e300\n1e-10,0", {"width_mm": 500.0}, "far-away"),
    ],
)
def test_what_is_no_curve_is_refused(text: str | bytes, how: dict[str, object], code: str, write: Write) -> None:
    assert refusal(write("bad.csv", text), **how)[0] == code


def test_a_width_is_a_scale(write: Write) -> None:
    drawing = read_drawing(write("any.csv", "x,y\n2,0\n4,1\n6,0\n"), HowToRead(width_mm=500.0))
    np.testing.assert_allclose(drawing.points * 1e3, [[250, 0], [500, 125], [750, 0]])
