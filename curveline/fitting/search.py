"""The rows nearest to a drawing: of a lone segment from many starts; of several from what is nearest to each alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from curveline.fitting.descent import descended
from curveline.fitting.row import Array, FittedRow, Wanted
from curveline.fitting.starts import RowStart, around, first_numbers, nearest_starts, starts_at, straightened
from curveline.rod.clamped_rod import ClampedRod

SAME = 0.01
"""Rows whose distances differ by a smaller part found the same."""
APART = 0.02
"""Rows of which a number differs by more, in m, rad or the root of an excess, are not the same."""
NOISE = 0.3
"""Part of a drawing's points at which it crosses the rod, from which on it goes along it but for noise: half of them
where each point errs for itself."""
EXACT = 5e-5
"""A distance [m] that no other row needs to beat."""
NEAREST = 6
"""Stable curves of the display from which a lone segment is sought."""
ODDS = 0.5
"""Of a segment's rows, sorted by their distance, the next one is taken so often instead of the one before."""


class FitEffort(NamedTuple):
    """How long to search: starts of a lone segment, of each segment of a row by itself, of the row; and how many of a
    lone segment's must agree to end sooner, so many fewer of a segment of a row as it has fewer starts."""

    lone: int
    alone: int
    row: int
    agreeing: int


@dataclass(frozen=True)
class RowSearch:
    """What a search met: rows, the nearest first, from so many starts."""

    rows: tuple[FittedRow, ...]
    starts: int

    def hits(self, taken: FittedRow) -> int:
        """How many of the rows are as near as one of them, and no nearer."""
        return sum(taken.rms <= (1.0 + SAME) * row.rms and row.rms <= (1.0 + SAME) * taken.rms for row in self.rows)

    def distinct(self) -> list[FittedRow]:
        """The rows, the nearest of those whose nodes stand in the same places."""
        found: list[FittedRow] = []
        for row in self.rows:
            if all(float(np.abs(row.numbers - other.numbers).max()) > APART for other in found):
                found.append(row)
        return found


def search(
    wanted: Wanted, rod: ClampedRod, effort: FitEffort, seed: int, heard: Callable[[int], object] = lambda count: None
) -> RowSearch:
    """The rows that starts lead to; `heard` is told their number."""
    source = np.random.default_rng(seed)
    if len(wanted.pieces) == 1:
        return _descents(wanted, _lone_starts(wanted, rod, effort.lone, source), effort, heard)
    alone, shorter = [], effort._replace(lone=effort.alone, agreeing=-(-effort.agreeing * effort.alone // effort.lone))
    for place in range(len(wanted.pieces)):
        own = wanted._replace(pieces=(wanted.pieces[place],), fine=(wanted.fine[place],))
        alone.append(_descents(own, _own_starts(own, rod, shorter.lone, source), shorter, heard).distinct())
    starts = _joint_starts(wanted, rod, alone, effort.row, source)
    return _descents(wanted, starts, effort._replace(agreeing=effort.row), heard)


def _descents(
    wanted: Wanted, starts: Iterator[RowStart], effort: FitEffort, heard: Callable[[int], object]
) -> RowSearch:
    """Where starts lead to, until as many agree as are to, or none can be better."""
    rows: list[FittedRow] = []
    count = 0
    for start in starts:
        count += 1
        heard(count)
        if (row := descended(wanted, *start)) is None:
            continue
        rows.append(row)
        best = min(each.rms for each in rows)
        agreeing = sum(each.rms <= (1.0 + SAME) * best for each in rows)
        if agreeing >= effort.agreeing or (effort.agreeing < effort.lone and _is_enough(wanted, row)):
            break
    return RowSearch(tuple(sorted(rows, key=lambda row: row.rms)), count)


def _is_enough(wanted: Wanted, row: FittedRow) -> bool:
    """True if what is left of the distance is nothing, or noise."""
    if row.rms < EXACT:
        return True
    points = wanted.pieces[0].shape[0]
    off = row.off[-points:]
    return len(wanted.pieces) == 1 and float(np.mean(off[1:] * off[:-1] < 0.0)) > NOISE


def _lone_starts(wanted: Wanted, rod: ClampedRod, count: int, source: np.random.Generator) -> Iterator[RowStart]:
    """Starts of a lone segment: where the drawing has its ends, the nearest stable curves, and around the former."""
    first = first_numbers(wanted)
    yield from starts_at(wanted, rod, first)[:1]
    if (straight := straightened(wanted, first)) is not None:
        yield from starts_at(wanted, rod, straight)
    near = nearest_starts(wanted, NEAREST)
    yield from near
    for _ in range(count - 1 - len(near)):
        yield from starts_at(wanted, rod, around(wanted, first, source))[:1]


def _own_starts(wanted: Wanted, rod: ClampedRod, count: int, source: np.random.Generator) -> Iterator[RowStart]:
    """Starts of one segment of a row: in all states where the drawing has its ends, and the nearest ones around that.

    What is nearest to it alone is moved by its neighbours: the nearest stable curves make rows no better.
    """
    first = first_numbers(wanted)
    yield from starts_at(wanted, rod, first)
    if (straight := straightened(wanted, first)) is not None:
        yield from starts_at(wanted, rod, straight)
    for _ in range(count - 1):
        yield from starts_at(wanted, rod, around(wanted, first, source))[:1]


def _joint_starts(
    wanted: Wanted, rod: ClampedRod, alone: list[list[FittedRow]], count: int, source: np.random.Generator
) -> Iterator[RowStart]:
    """Starts of several segments: of the rows that each has alone, the nearest first, nodes between them averaged."""
    first = first_numbers(wanted)
    yield from starts_at(wanted, rod, first)[:1]
    if (straight := straightened(wanted, first)) is not None:
        yield from starts_at(wanted, rod, straight)[:1]
    for number in range(count - 1):
        chosen = []
        for rows in alone:
            place = 0 if number == 0 else min(source.geometric(1.0 - ODDS) - 1, len(rows) - 1)
            chosen.append(rows[place] if rows else None)
        numbers = _averaged(wanted, first, chosen)
        yield from starts_at(wanted, rod, numbers if number < 2 else around(wanted, numbers, source))[:1]


def _averaged(wanted: Wanted, first: Array, chosen: list[FittedRow | None]) -> Array:
    """The numbers of a row whose nodes stand between what both their segments want; as `first` if they do not say."""
    count, numbers = wanted.nodes, first.copy()
    sums, said = np.zeros(2 * count), np.zeros(2 * count)
    for place, row in enumerate(chosen):
        if row is None:
            continue
        places = np.array([place, place + 1, count + place, count + place + 1])
        sums[places] += row.numbers[:4]
        said[places] += 1.0
        numbers[2 * count + place] = row.numbers[4]
    numbers[: 2 * count] = np.where(said > 0.0, sums / np.maximum(said, 1.0), numbers[: 2 * count])
    return numbers
