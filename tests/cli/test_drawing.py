"""Curves in characters."""

from __future__ import annotations

import math

import pytest

from curveline.cli.printing.canvas import ASPECT, COLUMNS, ROWS, Canvas

CIRCLE = [(math.cos(0.01 * turn), math.sin(0.01 * turn)) for turn in range(629)]


@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
def test_a_circle_is_as_high_as_wide(encoding: str) -> None:
    canvas = Canvas([CIRCLE], encoding)
    canvas.draw(CIRCLE, gap=1)
    lines = canvas.lines()
    width = max(map(len, lines)) - min(len(line) - len(line.lstrip()) for line in lines)
    assert len(lines) in (ROWS, ROWS - 1)
    assert width == pytest.approx(ASPECT * len(lines), abs=3)


@pytest.mark.parametrize("encoding", ["utf-8", "ascii", "latin-1", "cp437", "no such encoding"])
def test_every_character_can_be_shown(encoding: str) -> None:
    canvas = Canvas([CIRCLE], encoding)
    canvas.draw(CIRCLE, gap=3)
    canvas.mark(1.0, 0.0)
    text = "\n".join(canvas.lines())
    text.encode("ascii" if encoding == "no such encoding" else encoding)
    assert "O" in text or "●" in text


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_the_drawing_keeps_to_its_size(scale: float) -> None:
    curve = [(scale * x, 0.1 * scale * x * (1.0 - x)) for x in (0.0, 0.25, 0.5, 0.75, 1.0)]
    for each in (curve, [(y, x) for x, y in curve]):
        canvas = Canvas([each], "utf-8")
        canvas.draw(each, gap=1)
        assert len(canvas.lines()) <= ROWS
        assert all(len(line) <= COLUMNS for line in canvas.lines())


def test_a_solid_line_has_no_holes_and_a_dotted_one_has() -> None:
    line = [(0.0, 0.0), (1.0, 0.0)]
    canvas = Canvas([line], "ascii")
    canvas.draw(line, gap=1)
    assert canvas.lines() == ["#" * COLUMNS]
    canvas = Canvas([line], "ascii")
    canvas.draw(line, gap=3)
    assert canvas.lines()[0].startswith(".  .  .")


def test_nothing_to_draw() -> None:
    assert Canvas([], "utf-8").lines() == []
