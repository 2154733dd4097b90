"""The way of a bar through a strip of a picture: how like a bar every place is, and the smoothest likely way."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from curveline.tracing.lines import Greys
from curveline.tracing.sections import Reach
from curveline.units import mm

Array = npt.NDArray[np.float64]
Codes = npt.NDArray[np.int8]

STEP, ACROSS = mm(4.0), mm(0.5)
"""From column to column, and from row to row of the strips that ways are sought in."""
BAND = mm(46.0)
"""How far from a predicted curve ways are sought."""
GAP, FLANK = mm(1.0), mm(3.0)
"""What is left out beside a bar, since it is blurred; how wide what it is compared with is."""
AROUND = mm(9.0)
"""Half of the rows in which it is looked at how much there is besides."""
WIDE = mm(7.0)
"""Half of what the bar along a way takes."""
MOST = 1.2
"""No place counts as more like a bar."""
SLOPES = 3
"""A way rises by at most so many rows from column to column."""
BEND, FLIP, ASIDE = 0.12, 1.5, 0.03
FAR = mm(20.0)
"""What it costs if a way turns by a row a column, if the bar becomes the darker or the lighter one, and if it lies so
far off what was predicted."""


class BarWay(NamedTuple):
    """A way along a strip: by column, the row's offset [m] and how like a bar it is there."""

    off: Array  # (n,) [m]
    likeness: Array  # (n,)
    sign: Array  # (n,) 1 where the bar is lighter than what is beside it


def likeness(strip: Greys, across: Array, bar: Reach, noise: float) -> Array:
    """How much every place of a strip (m, n) is like the middle of a light bar, and of a dark one: (2, m, n).

    The bar reaches as far as `bar` says by columns; both its sides count as the worse one.
    """
    step = across[1] - across[0]
    known = np.nan_to_num(strip, nan=float(np.nanmean(strip)) if np.any(np.isfinite(strip)) else 0.0).astype(float)
    sums = np.concatenate([np.zeros((1, strip.shape[1])), np.cumsum(known, axis=0)])
    squares = np.concatenate([np.zeros((1, strip.shape[1])), np.cumsum(known**2, axis=0)])

    def mean(table: Array, low: Array, high: Array) -> Array:
        rows = np.arange(strip.shape[0])[:, None]
        begin = np.clip(rows + np.rint(low / step).astype(int), 0, strip.shape[0] - 1)
        end = np.clip(np.maximum(rows + np.rint(high / step).astype(int) + 1, begin + 1), 1, strip.shape[0])
        taken: Array = (np.take_along_axis(table, end, 0) - np.take_along_axis(table, begin, 0)) / (end - begin)
        return taken

    inside = mean(sums, bar.low * 0.5, bar.high * 0.5)
    left = mean(sums, bar.high + GAP, bar.high + GAP + FLANK)
    right = mean(sums, bar.low - GAP - FLANK, bar.low - GAP)
    wide = np.full(strip.shape[1], AROUND)
    spread = np.sqrt(np.maximum(mean(squares, -wide, wide) - mean(sums, -wide, wide) ** 2, 0.0) + noise**2)
    light = np.minimum(inside - left, inside - right) / spread
    dark = np.minimum(left - inside, right - inside) / spread
    found = np.minimum(np.stack([light, dark]), MOST)
    found[:, np.isnan(strip)] = -0.2
    return found


def best_way(found: Array, across: Array) -> BarWay:
    """The way along a strip that is most like a bar, light or dark by turns: `found` is its likeness."""
    _, rows, columns = found.shape
    count = 2 * SLOPES + 1
    cost = ASIDE * (across / FAR) ** 2
    score = np.zeros((2, count, rows)) + found[:, None, :, 0] - cost
    comes = np.zeros((columns, 2, count, rows), dtype=np.int8)
    for column in range(1, columns):
        score, comes[column] = _onward(score)
        score += found[:, None, :, column] - cost
    sign, slope, row = np.unravel_index(int(np.argmax(score)), score.shape)
    return _followed(found, across, comes, (int(sign), int(slope), int(row)))


def _onward(score: Array) -> tuple[Array, Codes]:
    """Scores in the next column before what is found there, and from where they come: sign and slope in one number."""
    count, rows = score.shape[1:]
    other = score[::-1] - FLIP
    flips = other > score
    best = np.where(flips, other, score)
    turns = np.stack([np.full_like(best, -np.inf)] * 3)
    turns[1] = best
    turns[0][:, 1:] = best[:, :-1] - BEND
    turns[2][:, :-1] = best[:, 1:] - BEND
    which = np.argmax(turns, axis=0)
    chosen = np.take_along_axis(turns, which[None], 0)[0]
    before = np.arange(count)[None, :, None] + which - 1
    flipped = np.take_along_axis(flips, before, 1)
    code = (2 * before + flipped).astype(np.int8)
    out, origin = np.full_like(score, -np.inf), np.zeros_like(code)
    for place, rise in enumerate(range(-SLOPES, SLOPES + 1)):
        to = slice(max(rise, 0), rows + min(rise, 0))
        since = slice(max(-rise, 0), rows + min(-rise, 0))
        out[:, place, to] = chosen[:, place, since]
        origin[:, place, to] = code[:, place, since]
    return out, origin


def _followed(found: Array, across: Array, comes: Codes, last: tuple[int, int, int]) -> BarWay:
    sign, slope, row = last
    columns = found.shape[2]
    rows, signs = np.empty(columns, dtype=int), np.empty(columns, dtype=int)
    for column in range(columns - 1, -1, -1):
        rows[column], signs[column] = row, sign
        code = int(comes[column, sign, slope, row])
        row -= slope - SLOPES
        slope, sign = code // 2, sign ^ (code % 2)
    places = np.arange(columns)
    return BarWay(across[rows], found[signs, rows, places], 1.0 - 2.0 * signs)


def without(found: Array, across: Array, way: BarWay) -> Array:
    """How like a bar every place is, were it not for the bar along a way."""
    left = found.copy()
    left[:, np.abs(across[:, None] - way.off[None, :]) < WIDE] = 0.0
    return left
