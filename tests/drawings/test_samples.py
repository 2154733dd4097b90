"""The drawings that come with curveline are what they say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from curveline.drawings.reading import read_drawing
from curveline.drawings.sketch import HowToRead
from drawings.curves import bezier, off

HERE = Path(__file__).parents[2] / "shapes" / "drawings"


@pytest.mark.parametrize(
    ("curve", "control", "middle"),
    [
        ("hill", [(0, 220), (90, 220), (130, 110), (215, 110)], [(315, 110), (360, 205), (500, 220)]),
        ("pond", [(0, 240), (160, 280), (340, 280), (500, 240)], []),
    ],
)
def test_a_hill_and_a_pond(curve: str, control: list[tuple[float, float]], middle: list[tuple[float, float]]) -> None:
    truth = np.vstack([bezier(*control), *([bezier(control[-1], *middle)] if middle else [])])
    drawing = read_drawing(HERE / "hill.svg", HowToRead(curve=curve))
    assert off(drawing, [47, 297 + 20] + truth * [1, -1]) < 0.02


def test_a_roof_in_inches_is_as_wide_as_the_display_quad() -> None:
    drawing = read_drawing(HERE / "roof.dxf")
    assert drawing.points[-1, 0] - drawing.points[0, 0] == pytest.approx(2.0, abs=1e-5)
    assert "DXF in inch, 1 unit = 25.4 mm, 2 pieces joined" in drawing.understood


def test_a_whale_knows_its_scale() -> None:
    u = np.linspace(0, 1, 4001)
    back = 320 - (300 - 200 * np.sin(np.pi * u**0.75) ** 1.6 - 25 * np.exp(-(((u - 0.80) / 0.05) ** 2)))
    drawing = read_drawing(HERE / "whale.png")
    assert off(drawing, np.column_stack([500 * u, back / 2])) < 0.15
