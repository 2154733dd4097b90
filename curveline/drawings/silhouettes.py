"""The edge of a silhouette in an array of greys, to a part of a pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from curveline.drawings.drawing import Array
from curveline.drawings.sketch import UPPER

Mask = npt.NDArray[np.bool_]
Places = npt.NDArray[np.int64]
Greys = npt.NDArray[np.float32]

CONTRAST = 24.0
"""Of 255 greys, by which a silhouette differs from what is behind it at least."""
CLEAR = 0.75
"""Part of the outermost row that is background, for it to be known as such."""
RIVAL = 0.1
"""Part of the largest patch that another one may have before it is unclear which is meant."""
FEW = 4
"""Columns of a patch that is hardly one."""
AS_FAR = 0.5
"""Pixels within which rows reach as far to the left."""
CORNER = 0.6
"""Pixels by which a patch recedes within two rows beyond the end of a wall; where it recedes less it is round."""
STEEP = 2.0
"""Slope above which an edge is not drawn on beyond its last column."""
MOST_RUNS = 2_000_000


@dataclass(frozen=True, eq=False)
class Edge:
    """An edge through `points (k, 2)` in pixels from the lower left corner, and what it is the edge of."""

    points: Array
    is_dark: bool
    specks: int


class Unclear(Exception):
    """There is no one silhouette: why, and what to do."""

    def __init__(self, code: str, message: str, hint: str) -> None:
        super().__init__(message)
        self.code, self.hint = code, hint


def edge_in(greys: Greys, edge: str) -> Edge:
    """The upper or lower edge of the one silhouette in greys (rows, columns), 0 black and 255 white.

    An edge is where the grey is midway between the two. Unclear for a picture without a silhouette, or with several.
    """
    seen = greys if edge == UPPER else greys[::-1]
    level = _level(seen)
    border = float(np.mean(seen[0] > level))
    if not (border >= CLEAR or border <= 1.0 - CLEAR):
        row = "top" if edge == UPPER else "bottom"
        raise Unclear(
            "no-background",
            f"its {row} row is half dark and half light, so that nobody can tell what is background",
            "leave a margin of background there",
        )
    is_dark = border >= CLEAR
    # From here on the silhouette is what is above 0.
    inside = (level - seen) if is_dark else (seen - level)
    mask, specks = _largest(inside > 0.0)
    points = _walk(inside, mask)
    rows = len(greys)
    points[:, 1] = rows - points[:, 1] if edge == UPPER else points[:, 1]
    return Edge(points, is_dark, specks)


def _level(greys: Greys) -> float:
    """The grey midway between what is dark and what is light: medians of the two classes of Otsu (1979)."""
    counts = np.bincount(greys.astype(np.uint8).ravel(), minlength=256).astype(np.float64)
    shades = np.arange(256.0)
    below, sums = np.cumsum(counts), np.cumsum(counts * shades)
    above = below[-1] - below
    with np.errstate(divide="ignore", invalid="ignore"):
        between = below * above * (sums / below - (sums[-1] - sums) / above) ** 2
    cut = int(np.argmax(np.nan_to_num(between)))
    dark, light = counts.copy(), counts.copy()
    dark[cut + 1 :] = 0.0
    light[: cut + 1] = 0.0
    medians = [float(np.searchsorted(np.cumsum(part), 0.5 * part.sum())) for part in (dark, light)]
    if medians[1] - medians[0] < CONTRAST or not (light.sum() and dark.sum()):
        hint = "make it a dark silhouette on white, or a light one on black"
        raise Unclear("no-silhouette", "it is of one grey all over", hint)
    return 0.5 * (medians[0] + medians[1])


def _largest(mask: Mask) -> tuple[Mask, int]:
    """The largest patch of a mask, and the number of others; patches touch along columns' runs."""
    padded = np.zeros((mask.shape[1], mask.shape[0] + 2), dtype=np.int8)
    padded[:, 1:-1] = mask.T
    steps = np.diff(padded, axis=1)
    columns, begins = np.nonzero(steps == 1)
    ends = np.nonzero(steps == -1)[1]
    if len(begins) > MOST_RUNS:
        raise Unclear("noise", "it is full of specks", "make it a silhouette of two tones first")
    labels = _joined(columns, begins, ends, mask.shape[1])
    areas = np.bincount(labels, weights=ends - begins)
    sizes = np.sort(areas[areas > 0.0])[::-1]
    if len(sizes) > 1 and sizes[1] > RIVAL * sizes[0]:
        what = f"there are several silhouettes in it, the two largest of {sizes[0]:.0f} and {sizes[1]:.0f} pixels"
        raise Unclear("several-curves", what, "leave one of them in the picture")
    keep = labels == int(np.argmax(areas))
    kept = np.zeros_like(padded)
    kept[columns[keep], begins[keep]] = 1
    kept[columns[keep], ends[keep]] -= 1
    return np.cumsum(kept, axis=1)[:, :-2].T.astype(bool), len(sizes) - 1


def _joined(columns: Places, begins: Places, ends: Places, count: int) -> Places:
    """For every run of a column the number of the patch that it belongs to."""
    parent = list(range(len(begins)))

    def root(run: int) -> int:
        while parent[run] != run:
            parent[run] = parent[parent[run]]
            run = parent[run]
        return run

    bounds = np.searchsorted(columns, np.arange(count + 1)).tolist()
    starts, stops = begins.tolist(), ends.tolist()
    for column in range(count - 1):
        here, there, last = bounds[column], bounds[column + 1], bounds[column + 2]
        middle = there
        while here < middle and there < last:
            if starts[here] < stops[there] and starts[there] < stops[here]:
                parent[root(there)] = root(here)
            if stops[here] < stops[there]:
                here += 1
            else:
                there += 1
    return np.array([root(run) for run in range(len(begins))], dtype=np.int64)


def _walk(inside: Greys, mask: Mask) -> Array:
    """The first crossing from above in every column of a patch, with its ends; pixels are squares from k to k + 1."""
    columns = np.flatnonzero(mask.any(axis=0))
    tops = np.argmax(mask[:, columns], axis=0)
    y = tops + 0.5
    lower = inside[tops, columns].astype(np.float64)
    upper = inside[np.maximum(tops - 1, 0), columns].astype(np.float64)
    # At the picture's border there is no crossing: the silhouette goes on beyond it.
    y = np.where(tops > 0, y - lower / np.where(tops > 0, lower - upper, 1.0), 0.0)
    points = np.column_stack([columns + 0.5, y])
    if len(points) > FEW:
        # The outermost columns are covered in part only, unless the picture ends there, and seem to cross lower.
        points = points[int(columns[0] > 0) : len(points) - int(columns[-1] < mask.shape[1] - 1)]
    backwards = [mask.shape[1], 0.0] + points[::-1] * [-1.0, 1.0]
    right = [mask.shape[1], 0.0] + _end(inside[:, ::-1], mask[:, ::-1], backwards)[::-1] * [-1.0, 1.0]
    return np.vstack([_end(inside, mask, points), points, right])


def _end(inside: Greys, mask: Mask, edge: Array) -> Array:
    """The points (k, 2) of a patch from its leftmost place to where its `edge` begins.

    A wall ends at its corner, what is round where it is leftmost.
    """
    rows = np.flatnonzero(mask.any(axis=1))
    columns = np.argmax(mask[rows], axis=1)
    within = inside[rows, columns].astype(np.float64)
    before = inside[rows, np.maximum(columns - 1, 0)].astype(np.float64)
    x = np.where(columns > 0, columns + 0.5 - within / np.where(columns > 0, within - before, 1.0), 0.0)
    least = int(np.argmin(x))
    run = least - np.argmin(np.append(x[: least + 1][::-1] <= x[least] + AS_FAR, False)) + 1
    bottom = least + int(np.argmin(np.append(x[least:] <= x[least] + AS_FAR, False)))
    is_round = x[least] > 0.0 and run >= 2 and x[run - 2] <= x[run] + CORNER
    if not is_round:
        at = float(np.median(x[run:bottom]))
        near = edge[: FEW + 1]
        slope = (near[-1, 1] - near[0, 1]) / (near[-1, 0] - near[0, 0]) if len(near) > 1 else 0.0
        if abs(slope) > STEEP:
            return np.array([[at, rows[run] + 0.5]])
        # The edge runs into the wall as it came.
        return np.array([[at, edge[0, 1] + slope * (at - edge[0, 0])]])
    middle = (run + bottom - 1) // 2
    way = np.arange(middle, -1, -1)
    way = way[(x[way] < edge[0, 0]) & (rows[way] + 0.5 > edge[0, 1])]
    return np.column_stack([x[way], rows[way] + 0.5]) if len(way) else np.array([[x[middle], rows[middle] + 0.5]])
