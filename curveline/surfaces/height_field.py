"""A surface as heights over a plane: x along the lines, y from front to back, and its section at any y."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from curveline.drawings.drawing import Array
from curveline.drawings.formulas import POINTS, heights_of
from curveline.units import mm, to_mm


class Extent(NamedTuple):
    """Where a surface lies, seen from above [m]: from `left` to `right`, from `front` to `back`."""

    left: float
    right: float
    front: float
    back: float

    @property
    def width(self) -> float:
        """Along the lines."""
        return self.right - self.left

    @property
    def depth(self) -> float:
        """From front to back."""
        return self.back - self.front


class HeightField(Protocol):
    """A surface seen from above, by the `name` of where it comes from; `understood` says how that was read.

    `extent` is None for one that has no ends. What `is_level_known` has heights from the home height on; of others only
    differences of heights mean anything.
    """

    @property
    def name(self) -> str:
        """Of the file, or the formula."""

    @property
    def understood(self) -> str:
        """How it was read: its scale above all."""

    @property
    def extent(self) -> Extent | None:
        """Where it lies; None for everywhere."""

    @property
    def is_level_known(self) -> bool:
        """Whether its heights count from the home height."""

    def section(self, y: float, left: float, right: float) -> list[Array]:
        """Pieces (k, 2) of x and height [m] at a y, from the left on, as far as there are any within some x."""


class FormulaField:
    """The height [mm] that a formula gives at x and y [mm]; InvalidInput for what is none."""

    extent = None
    is_level_known = True

    def __init__(self, text: str) -> None:
        self.name = text.strip()
        self.understood = "formula in mm, x from the first rail on, y from the first line on"
        # What is wrong anywhere with the words of it is said before it is known where the lines are.
        heights_of(text, {"x": np.zeros(1), "y": np.zeros(1)}, is_finite=False)

    def section(self, y: float, left: float, right: float) -> list[Array]:
        """Its values along a line."""
        x = np.linspace(to_mm(left), to_mm(right), POINTS)
        heights = heights_of(self.name, {"x": x, "y": np.full(POINTS, to_mm(y))})
        return [np.column_stack([x, heights]) * mm(1.0)]


class GridField:
    """Heights (rows, columns) [m] in the middles of square cells, the first row at the front; straight between them."""

    is_level_known = True

    def __init__(self, heights: Array, cell: float, name: str, understood: str) -> None:
        self.heights, self.cell, self.name, self.understood = heights, cell, name, understood

    @property
    def extent(self) -> Extent:
        """From the outer edges of the outer cells."""
        rows, columns = self.heights.shape
        return Extent(0.0, columns * self.cell, 0.0, rows * self.cell)

    def section(self, y: float, left: float, right: float) -> list[Array]:
        """The heights between two rows; within half a cell of an edge those of the outermost ones."""
        rows, columns = self.heights.shape
        place = float(np.clip(y / self.cell - 0.5, 0.0, rows - 1.0))
        row = min(int(place), max(rows - 2, 0))
        share = place - row
        above = self.heights[min(row + 1, rows - 1)]
        heights = (1.0 - share) * self.heights[row] + share * above
        x = (np.arange(columns) + 0.5) * self.cell
        x = np.concatenate(([0.0], x, [columns * self.cell]))
        heights = np.concatenate((heights[:1], heights, heights[-1:]))
        return [np.column_stack([x, heights])]
