"""Drawings and rows of nodes for tests of fits."""

from __future__ import annotations

from functools import cache

import numpy as np

from curveline.drawings.drawing import Drawing
from curveline.drawings.formulas import drawing_of_formula
from curveline.fitting.cutting import cut_at_rails
from curveline.fitting.row import Array, FittedRow, Reserve, Wanted, row_at
from curveline.fitting.starts import first_numbers, level_rod, starts_at
from curveline.fitting.targets import width_of
from curveline.scene import Display
from curveline.shapes.files import read_display

RESERVE = Reserve(0.12, 0.92)


@cache
def display(name: str = "single") -> Display:
    return read_display(name)


def drawn(formula: str, name: str = "single") -> Drawing:
    """A formula over a display."""
    return drawing_of_formula(formula, width_of(display(name)))


def wanted(drawing: Drawing | str, name: str = "single", reserve: Reserve = RESERVE) -> Wanted:
    """A drawing, or a formula, cut for a display."""
    given = drawn(drawing, name) if isinstance(drawing, str) else drawing
    bearing = level_rod(display(name)).extensible().bearing
    return Wanted(display(name), bearing, *cut_at_rails(given, display(name)), reserve)


def first_row(asked: Wanted, numbers: Array | None = None) -> FittedRow:
    """The row with which a search begins."""
    start = starts_at(
        asked, level_rod(asked.display).extensible(), first_numbers(asked) if numbers is None else numbers
    )
    row = row_at(asked, *start[0])
    assert row is not None
    return row


def moved(asked: Wanted, row: FittedRow, place: int, by: float) -> FittedRow:
    """A row with one of its numbers changed."""
    numbers = row.numbers.copy()
    numbers[place] += by
    found = row_at(asked, numbers, row.held)
    assert found is not None
    return found


def apart(curve: Array, other: Array) -> Array:
    """How far the points of a polyline are from another, by brute force over many points of that."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(other, axis=0).T))])
    at = np.union1d(np.linspace(0.0, along[-1], 20_001), along)
    fine = np.column_stack([np.interp(at, along, column) for column in other.T])
    return np.array([np.hypot(*(fine - point).T).min() for point in curve])
