"""Curves in characters: braille dots where the terminal can show them, ASCII where it cannot; true to aspect."""

from __future__ import annotations

import math
from collections.abc import Sequence

Curve = Sequence[Sequence[float]]

COLUMNS = 64
ROWS = 14
ASPECT = 2.0
"""Height of a character cell over its width."""

BRAILLE = 0x2800
DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
"""Bits of a braille character, by row and column of the dot."""


class Canvas:
    """A drawing of some curves, given as (x, y) rows in one unit; `encoding` is that of the stream it goes to."""

    def __init__(self, curves: Sequence[Curve], encoding: str) -> None:
        xs = [point[0] for curve in curves for point in curve] or [0.0]
        ys = [point[1] for curve in curves for point in curve] or [0.0]
        self.is_braille = _can_show(chr(BRAILLE + 0xFF), encoding)
        self._across, self._down = (2, 4) if self.is_braille else (1, 1)
        width, height = max(xs) - min(xs), max(ys) - min(ys)
        # Size of a cell in the curves' unit; a dot is as wide as it is high only in braille.
        self._cell = max(width / (COLUMNS - 1), height / (ROWS - 1) / ASPECT, 1e-9)
        self._left, self._top = min(xs), max(ys)
        self._columns = math.ceil(width / self._cell) + 1
        self._dots: dict[tuple[int, int], int] = {}
        self._marks: dict[tuple[int, int], str] = {}
        self._solid: set[tuple[int, int]] = set()

    def draw(self, curve: Curve, gap: int) -> None:
        """A curve; of its dots every `gap`-th is drawn."""
        dots = _unbroken([self._dot(x, y) for x, y in curve])
        for column, row in dots[::gap]:
            cell = (column // self._across, row // self._down)
            bit = DOTS[row % self._down][column % self._across]
            self._dots[cell] = self._dots.get(cell, 0) | bit
            if gap == 1:
                self._solid.add(cell)

    def mark(self, x: float, y: float) -> None:
        """A node."""
        column, row = self._dot(x, y)
        self._marks[column // self._across, row // self._down] = "●" if self.is_braille else "O"

    def lines(self) -> list[str]:
        """The drawing, top line first, without trailing blanks."""
        last = max((row for _, row in [*self._dots, *self._marks]), default=-1)
        return [
            "".join(self._character((column, row)) for column in range(self._columns)).rstrip()
            for row in range(last + 1)
        ]

    def _character(self, cell: tuple[int, int]) -> str:
        if cell in self._marks:
            return self._marks[cell]
        if cell not in self._dots:
            return " "
        if self.is_braille:
            return chr(BRAILLE + self._dots[cell])
        return "#" if cell in self._solid else "."

    def _dot(self, x: float, y: float) -> tuple[int, int]:
        column = (x - self._left) / self._cell * self._across
        row = (self._top - y) / self._cell / ASPECT * self._down
        return round(column), round(row)


def _unbroken(dots: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """Dots along the lines between given ones, each once in a row."""
    path = list(dots[:1])
    for column, row in dots[1:]:
        from_column, from_row = path[-1]
        steps = max(abs(column - from_column), abs(row - from_row))
        for step in range(1, steps + 1):
            part = step / steps
            path.append((round(from_column + part * (column - from_column)), round(from_row + part * (row - from_row))))
    return path


def _can_show(character: str, encoding: str) -> bool:
    try:
        character.encode(encoding)
    except (UnicodeEncodeError, LookupError):
        return False
    return True
