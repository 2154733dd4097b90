"""Drawings are moved, turned and put where they belong, and scaled by nobody but who says so."""

from __future__ import annotations

import numpy as np
import pytest

from curveline.drawings.drawing import Drawing
from curveline.drawings.formulas import drawing_of_formula
from curveline.drawings.placing import AS_DRAWN, Placing, placed
from curveline.errors import InvalidInput

WIDTH = 0.5
ROOF = Drawing(np.array([[0.1, 0.2], [0.3, 0.26], [0.6, 0.21]]), "roof.csv", "CSV")


def test_fit_puts_the_left_end_on_the_first_rail_at_home() -> None:
    there = placed(ROOF, Placing(), WIDTH)
    np.testing.assert_allclose(there.points, [[0, 0], [0.2, 0.06], [0.5, 0.01]], atol=1e-12)
    assert there.understood == "CSV, moved by -100 mm along the row and -200 mm up"
    assert there.name == ROOF.name


def test_as_drawn_is_left_alone() -> None:
    drawing = Drawing(np.array([[-0.1, 0.2], [0.6, 0.21]]), "roof.csv", "CSV")
    there = placed(drawing, Placing(AS_DRAWN), WIDTH)
    np.testing.assert_array_equal(there.points, drawing.points)
    assert there.understood == "CSV, what is beyond the outer rails is left out"


def test_upside_down_keeps_its_heights_where_it_is_as_drawn() -> None:
    drawing = Drawing(np.array([[0.0, 0.2], [0.3, 0.26], [0.5, 0.21]]))
    there = placed(drawing, Placing(AS_DRAWN, is_flipped=True), WIDTH)
    np.testing.assert_allclose(there.points[:, 1], [0.26, 0.2, 0.25])
    fit = placed(drawing, Placing(is_flipped=True), WIDTH)
    np.testing.assert_allclose(fit.points[:, 1], [0.0, -0.06, -0.01], atol=1e-12)


def test_a_shift_is_along_the_row_after_all_else() -> None:
    wide = Drawing(np.array([[0.1, 0.0], [0.9, 0.0]]))
    np.testing.assert_allclose(placed(wide, Placing(shift_mm=-31.0), WIDTH).points[:, 0], [-0.031, 0.769])


def test_only_who_says_so_has_a_drawing_scaled() -> None:
    narrow = Drawing(ROOF.points * 0.5, "roof.csv")
    with pytest.raises(InvalidInput, match="it reaches from 0 to 250 mm, and the display from 0 to 500 mm") as caught:
        placed(narrow, Placing(), WIDTH)
    assert "--scale width" in caught.value.hint
    assert caught.value.diagnostics[0].code == "too-narrow"
    there = placed(narrow, Placing(scale="width"), WIDTH)
    np.testing.assert_allclose(there.points, [[0, 0], [0.2, 0.06], [0.5, 0.01]], atol=1e-12)
    assert "scaled by 2 to the width of the display" in there.understood


def test_heights_are_those_that_nodes_have_as_far_as_it_goes() -> None:
    hill = Drawing(np.array([[0.0, 0.0], [0.25, 0.3], [0.5, 0.0]]))
    assert placed(hill, Placing(), WIDTH, (-0.1, 0.4)).points[0, 1] == 0.0
    assert placed(hill, Placing(), WIDTH, (-0.2, 0.2)).points[0, 1] == pytest.approx(-0.1)
    assert placed(hill, Placing(), WIDTH, (-0.1, 0.1)).points[0, 1] == pytest.approx(-0.15)


@pytest.mark.parametrize(
    ("placing", "advised"),
    [
        (Placing(AS_DRAWN), Placing()),
        (Placing(shift_mm=20.0), Placing(shift_mm=0.0)),
    ],
)
def test_what_is_advised_helps(placing: Placing, advised: Placing) -> None:
    drawing = Drawing(np.array([[0.2, 0.0], [0.7, 0.1]]), "roof.csv")
    with pytest.raises(InvalidInput):
        placed(drawing, placing, WIDTH)
    assert placed(drawing, advised, WIDTH).points[-1, 0] == pytest.approx(0.5)


@pytest.mark.parametrize(
    "how",
    [{"place": "left"}, {"scale": "height"}, {"shift_mm": float("nan")}, {"place": AS_DRAWN, "scale": "width"}],
)
def test_what_makes_no_sense_is_refused(how: dict[str, object]) -> None:
    with pytest.raises(InvalidInput):
        Placing(**how)  # type: ignore[arg-type]


def test_a_drawing_without_width_cannot_be_scaled() -> None:
    with pytest.raises(InvalidInput, match="no width"):
        placed(Drawing(np.array([[0.0, 0.0], [0.0, 1.0]])), Placing(scale="width"), WIDTH)


def test_a_formula_is_as_wide_as_the_display() -> None:
    there = placed(drawing_of_formula("60*sin(pi*x/500)", WIDTH), Placing(), WIDTH)
    x, y = there.points.T * 1e3
    np.testing.assert_allclose(y, 60 * np.sin(np.pi * x / 500), atol=1e-9)
    assert there.understood == "formula in mm, x from 0 to 500 mm"


@pytest.mark.parametrize(
    "text",
    [
        "", "x +", "y", "sin(x", "__import__('os')", "x.real", "[x]", "lambda: x", "log(x - 900)", "1/0", "1/x",
        "x < 5 < 9", "9**9**9**9", "sin()", "where(x)", "'a'", "True", "1e999", "x" * 2000, "-" * 900 + "x",
        "10**400", "1j*x", "min(x)", "sin(x, x, x)", "x\0", "9**9**9", "0**-1", "sin(x, x)", "max(x, 40, x)",
    ],
)  # fmt: skip
def test_what_is_no_formula_is_refused(text: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        drawing_of_formula(text, WIDTH)
    assert caught.value.hint


@pytest.mark.parametrize(
    ("text", "words"),
    [("where(x<250)", "where is of 3 values, not of 1"), ("1e9*x", "1.25e\\+08 mm at x = 0.125 mm")],
)
def test_what_is_wrong_with_a_formula_is_told_in_its_words(text: str, words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        drawing_of_formula(text, WIDTH)


@pytest.mark.parametrize(
    ("text", "value"),
    [("where(x < 250, 10, 20)", 20.0), ("7", 7.0), ("min(x, 3) + max(x, 4)", 503.0), ("x**2 % 7", 2.0)]
)  # fmt: skip
def test_formulas(text: str, value: float) -> None:
    assert drawing_of_formula(text, WIDTH).points[-1, 1] * 1e3 == pytest.approx(value, abs=1e-9)


def test_a_shift_that_goes_too_far_is_advised_against() -> None:
    with pytest.raises(InvalidInput) as caught:
        placed(drawing_of_formula("x", WIDTH), Placing(AS_DRAWN, 20.0), WIDTH)
    assert "--shift-mm" in caught.value.hint
