"""Pieces joined end to end, and the upper or the lower edge of a closed outline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from curveline.drawings.drawing import Array
from curveline.drawings.sketch import UPPER, Piece


@dataclass(frozen=True, eq=False)
class Chain:
    """Pieces that meet end to end, as one line through `points (k, 2)`; if `is_closed`, it ends where it begins."""

    points: Array
    is_closed: bool


@dataclass(frozen=True)
class Fork:
    """A place, in units of the file, at which more than two ends meet."""

    x: float
    y: float
    ends: int


def chains(pieces: Sequence[Piece], near: float) -> list[Chain] | Fork:
    """All lines that pieces make if ends are joined that are at most `near` apart; or where it is unclear which."""
    lines = _distinct([piece.points for piece in pieces], near)
    found = [Chain(line, is_closed=True) for line in lines if _is_loop(line, near)]
    open_lines = [line for line in lines if not _is_loop(line, near)]
    places = _places([end for line in open_lines for end in (line[0], line[-1])], near)
    meeting: dict[int, list[int]] = {}
    for end, place in enumerate(places):
        meeting.setdefault(place, []).append(end)
    for ends in meeting.values():
        if len(ends) > 2:
            x, y = open_lines[ends[0] // 2][-(ends[0] % 2)]
            return Fork(float(x), float(y), len(ends))
    lonely = [ends[0] for ends in meeting.values() if len(ends) == 1]
    used: set[int] = set()
    for begin in (*lonely, *range(0, 2 * len(open_lines), 2)):
        if begin // 2 not in used:
            found.append(_walked(begin, open_lines, (places, meeting), used))
    return found


def _walked(begin: int, lines: list[Array], ends: tuple[list[int], dict[int, list[int]]], used: set[int]) -> Chain:
    """The chain that begins with an end of a line: end 2 k is the first point of line k, end 2 k + 1 the last."""
    places, meeting = ends
    parts: list[Array] = []
    end = begin
    while True:
        used.add(end // 2)
        line = lines[end // 2]
        part = line if end % 2 == 0 else line[::-1]
        parts.append(part[1:] if parts else part)
        there = end ^ 1
        others = [each for each in meeting[places[there]] if each != there]
        if not others or others[0] // 2 in used:
            return Chain(np.vstack(parts), is_closed=bool(others))
        end = others[0]


def _is_loop(line: Array, near: float) -> bool:
    return bool(np.hypot(*(line[-1] - line[0])) <= near)


def _distinct(lines: list[Array], near: float) -> list[Array]:
    """The lines that are more than a dot, each once: programs for cutters like to draw them twice."""
    kept: dict[bytes, Array] = {}
    for line in lines:
        if float(np.max(np.ptp(line, axis=0))) <= near:
            continue
        step = near if near > 0.0 else 1.0
        forth, back = ((np.round(each / step) + 0.0).tobytes() for each in (line, line[::-1]))
        kept.setdefault(min(forth, back), line)
    return list(kept.values())


def _places(ends: list[Array], near: float) -> list[int]:
    """For every end the number of the place at which it is, the same for ends that are at most `near` apart."""
    cells: dict[tuple[int, int], list[tuple[float, float, int]]] = {}
    found: list[int] = []
    size = near if near > 0.0 else 1.0
    for end in ends:
        x, y = float(end[0]), float(end[1])
        column, row = int(x // size), int(y // size)
        place = -1
        for cell in ((column + i, row + j) for i in (-1, 0, 1) for j in (-1, 0, 1)):
            for there in cells.get(cell, ()):
                if (there[0] - x) ** 2 + (there[1] - y) ** 2 <= near * near:
                    place = there[2]
        if place < 0:
            place = len(found)
            cells.setdefault((column, row), []).append((x, y, place))
        found.append(place)
    return found


def edge_of(outline: Array, edge: str) -> Array:
    """The upper or the lower edge of a closed outline (k, 2), from its left end to its right one.

    Where an end is a wall, its corner is the end.
    """
    ring = outline[:-1] if bool(np.all(outline[0] == outline[-1])) else outline
    up = 1.0 if edge == UPPER else -1.0
    x, y = ring[:, 0], up * ring[:, 1]
    sliver = 1e-6 * float(np.ptp(x))
    corners = [np.flatnonzero(side) for side in (x <= x.min() + sliver, x >= x.max() - sliver)]
    left, right = (int(each[np.argmax(y[each])]) for each in corners)
    ring = np.roll(ring, -left, axis=0)
    split = (right - left) % len(ring)
    forth, back = ring[: split + 1], np.vstack([ring[split:], ring[:1]])[::-1]
    return forth if _mean_height(forth) * up >= _mean_height(back) * up else back


def _mean_height(line: Array) -> float:
    """Of the area under a line, over its width."""
    steps = np.diff(line[:, 0])
    return float((steps * (line[1:, 1] + line[:-1, 1])).sum() / (2.0 * steps.sum()))
