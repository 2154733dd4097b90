"""What of many straight pieces in a plane is seen from above: their upper envelope, exactly."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from curveline.drawings.drawing import Array
from curveline.errors import InvalidInput

MOST_PAIRS = 30_000_000
"""Pieces times places where one of them begins or ends; more take a gigabyte."""
WALL = 1e-6
"""The width [m] of a step in an envelope, so that it has one height everywhere."""


SAME_PLACE = 1e-9
"""Places that are nearer to each other [m] are one: faces that share a corner meet there, whatever was rounded."""


def upper_envelope(pieces: Array) -> list[Array]:
    """The parts (k, 2), from left to right, of the upper envelope of pieces (n, 4): x, y of one end, and of the other.

    Where nothing is above a place, one part ends; x increases along each. InvalidInput for too many pieces.
    """
    turned = pieces[:, 0] > pieces[:, 2]
    pieces = np.where(turned[:, None], pieces[:, [2, 3, 0, 1]], pieces)
    x, ends = _places(pieces[:, [0, 2]])
    across = ends[:, 0] < ends[:, 1]
    pieces, first, last = pieces[across], ends[across, 0], ends[across, 1]
    if not len(pieces):
        return []
    counts = last - first
    if int(counts.sum()) > MOST_PAIRS:
        raise InvalidInput("this surface has too many faces one above another", "simplify it in the program it is from")
    owner = np.repeat(np.arange(len(pieces)), counts)
    cell = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts) + first[owner]
    left, right = _heights(pieces[owner], x[cell]), _heights(pieces[owner], x[cell + 1])
    return _joined(x, cell, left, right)


def _places(x: Array) -> tuple[Array, npt.NDArray[np.int64]]:
    """Where pieces begin and end, from the left on, and which of these places each of some x (n, 2) is."""
    flat = x.ravel()
    order = np.argsort(flat, kind="stable")
    is_new = np.diff(flat[order], prepend=-np.inf) > SAME_PLACE
    number = np.empty(len(flat), dtype=np.int64)
    number[order] = np.cumsum(is_new) - 1
    return flat[order][is_new], number.reshape(x.shape)


def _heights(pieces: Array, x: Array) -> Array:
    share = np.clip((x - pieces[:, 0]) / (pieces[:, 2] - pieces[:, 0]), 0.0, 1.0)
    heights: Array = (1.0 - share) * pieces[:, 1] + share * pieces[:, 3]
    return heights


def _joined(x: Array, cell: Array, left: Array, right: Array) -> list[Array]:
    """The parts of an envelope of lines across cells between some x, which have heights at both sides of their cell."""
    order = np.lexsort((right, left, cell))
    cell, left, right = cell[order], left[order], right[order]
    begins = np.flatnonzero(np.diff(cell, prepend=-1))
    ends = np.append(begins[1:], len(cell))
    highest = np.maximum.reduceat(right, begins)
    parts: list[list[tuple[float, float]]] = []
    before = -2
    for begin, end, most in zip(begins.tolist(), ends.tolist(), highest.tolist(), strict=True):
        here = int(cell[begin])
        across = [(float(x[here]), float(left[end - 1])), (float(x[here + 1]), most)]
        if right[end - 1] < most:
            across[1:1] = _crossings(across[0][0], across[1][0], left[begin:end], right[begin:end])
        if here != before + 1:
            parts.append([])
        _append(parts[-1], across)
        before = here
    return [np.array(part) for part in parts]


def _crossings(begin: float, end: float, left: Array, right: Array) -> list[tuple[float, float]]:
    """Where another of several lines across a cell becomes the highest; the last one is highest at the left side."""
    found: list[tuple[float, float]] = []
    share, top = 0.0, len(left) - 1
    slopes = right - left
    while True:
        steeper = np.flatnonzero(slopes > slopes[top])
        if not steeper.size:
            return found
        at = (left[top] - left[steeper]) / (slopes[steeper] - slopes[top])
        nearest = np.lexsort((-slopes[steeper], at))[0]
        if at[nearest] >= 1.0:
            return found
        top, share = int(steeper[nearest]), max(share, float(at[nearest]))
        if share > 0.0:
            found.append((begin + share * (end - begin), float(left[top] + share * slopes[top])))


def _append(part: list[tuple[float, float]], across: list[tuple[float, float]]) -> None:
    """Go on with a part; a step is a little wide, at the cost of the cells at its sides."""
    if part:
        x, height = part[-1]
        if abs(height - across[0][1]) > 1e-12:
            room = min(x - part[-2][0], across[1][0] - x)
            half = min(0.5 * WALL, 0.25 * room)
            part[-1] = (x - half, height)
            across[0] = (x + half, across[0][1])
        else:
            part.pop()
    part.extend(across)
