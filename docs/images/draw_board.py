"""The picture of one board of a display, its supplies and its motors; `draw.py` writes it with the others."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

SIZE = (1100, 470)
INK, QUIET, LOGIC, POWER, AIR = "#2b2f36", "#6b7280", "#1971c2", "#d9480f", "#9c36b5"
FILL, BOARD = "#ffffff", "#eef1f4"

Box = tuple[float, float, float, float]
"""x, y, width, height."""

BOXES: Sequence[tuple[Box, Sequence[str], str]] = (
    ((24, 70, 150, 54), ("computer",), INK),
    ((24, 170, 150, 64), ("dongle:", "Teensy + radio"), INK),
    ((330, 70, 130, 54), ("radio, 10 uF",), AIR),
    ((330, 190, 130, 64), ("Teensy LC",), INK),
    ((540, 110, 150, 54), ("DRV8833",), INK),
    ((540, 240, 150, 54), ("DRV8833",), INK),
    ((330, 296, 130, 40), ("lamp, button",), QUIET),
    ((830, 62, 230, 56), ("extrude: motor, encoder", "100 nF across the motor"), INK),
    ((830, 142, 230, 56), ("bias: motor, encoder", "100 nF across the motor"), INK),
    ((830, 222, 230, 56), ("translate: motor, encoder", "100 nF across the motor"), INK),
    ((830, 302, 230, 44), ("switch at the lower end",), INK),
    ((24, 392, 150, 50), ("5 V by USB",), LOGIC),
    ((330, 392, 130, 50), ("6 V supply",), POWER),
    ((500, 392, 150, 50), ("the switch", "in your reach"), POWER),
    ((690, 392, 120, 50), ("fuse 2.5 A",), POWER),
)
WIRES: Sequence[tuple[Sequence[tuple[float, float]], str]] = (
    (((99, 124), (99, 170)), LOGIC),
    (((395, 124), (395, 190)), LOGIC),
    (((395, 254), (395, 296)), QUIET),
    (((460, 205), (500, 205), (500, 137), (540, 137)), LOGIC),
    (((460, 222), (500, 222), (500, 267), (540, 267)), LOGIC),
    (((690, 130), (760, 130), (760, 82), (830, 82)), POWER),
    (((690, 146), (745, 146), (745, 160), (830, 160)), POWER),
    (((690, 267), (760, 267), (760, 242), (830, 242)), POWER),
    (((830, 106), (790, 106), (790, 212), (460, 212)), LOGIC),
    (((830, 182), (790, 182), (790, 212)), LOGIC),
    (((830, 262), (790, 262), (790, 212)), LOGIC),
    (((830, 324), (510, 324), (510, 240), (460, 240)), LOGIC),
    (((174, 417), (250, 417), (250, 230), (330, 230)), LOGIC),
    (((460, 417), (500, 417)), POWER),
    (((650, 417), (690, 417)), POWER),
    (((750, 392), (750, 356), (615, 356), (615, 294)), POWER),
    (((615, 240), (615, 164)), POWER),
)


def board() -> Iterator[str]:
    """One board between its computer and its motors: blue is logic, orange what moves motors."""
    yield f'<rect x="300" y="44" width="420" height="308" rx="10" fill="{BOARD}"/>'
    yield _words(510, 37, "one board for each node", QUIET, 14)
    yield _words(945, 37, "on the node", QUIET, 14)
    for points, colour in WIRES:
        path = " L".join(f"{x:.1f} {y:.1f}" for x, y in points)
        yield f'<path d="M{path}" fill="none" stroke="{colour}" stroke-width="2.5" stroke-linejoin="round"/>'
    for reach in (16.0, 28.0, 40.0):
        yield _wave(190.0, 188.0, reach)
    for (x, y, width, height), lines, colour in BOXES:
        frame = f'x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" rx="7"'
        yield f'<rect {frame} fill="{FILL}" stroke="{colour}" stroke-width="2"/>'
        first = y + height / 2 + 5.0 - 9.0 * (len(lines) - 1)
        for index, words in enumerate(lines):
            yield _words(x + width / 2, first + 18.0 * index, words, INK if index == 0 else QUIET, 15 - index)


def _wave(x: float, y: float, reach: float) -> str:
    """A quarter of a circle, as waves are drawn that leave an aerial towards the board."""
    points = [(x + reach * math.cos(at), y - reach * math.sin(at)) for at in (-0.2, 0.1, 0.4, 0.7, 1.0)]
    path = " L".join(f"{one:.1f} {other:.1f}" for one, other in points)
    return f'<path d="M{path}" fill="none" stroke="{AIR}" stroke-width="2.5"/>'


def _words(x: float, y: float, words: str, colour: str, size: int) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" fill="{colour}" font-size="{size}" text-anchor="middle">{words}</text>'
