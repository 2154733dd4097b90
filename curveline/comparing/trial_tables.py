"""A trial from a table of points: CSV with the columns x_mm and y_mm, in the display's frame."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from curveline.cameras.outcomes import TrialOutcome
from curveline.drawings.sketch import HowToRead
from curveline.drawings.tables import read
from curveline.scene import Scene
from curveline.system.files import AnyPath, read_file, refuse_file
from curveline.trial import Array, Trial, TrialCurve
from curveline.units import to_mm

MAX_BYTES = 64_000_000
FEWEST = 8
"""Points that a segment's curve has at least."""
FARTHEST = 2.0
"""Widths of the display: points beyond that are in another unit, or of another frame."""


def read_table(path: AnyPath, scene: Scene) -> Trial:
    """The points of a trial, from left to right, cut at the nodes.

    InvalidInput for a file that cannot be read, has too few points, or points that lie nowhere near the display.
    """
    name = str(path)
    data = read_file(path, MAX_BYTES)
    if not data.strip():
        refuse_file(name, "empty", "this file is empty", "save the points again")
    sketch = read(data, HowToRead(), name)
    count = len(scene.segments)
    if len(sketch.pieces) not in (1, count):
        hint = f"leave the column out, or give its {count} segments a curve each, left to right"
        refuse_file(name, "curves", f"it has {len(sketch.pieces)} curves", hint)
    pieces = [_rightwards(sketch.unit * piece.points) for piece in sketch.pieces]
    _check_place(name, np.vstack(pieces), scene)
    if len(pieces) < count:
        pieces = _cut(pieces[0], scene)
    for number, points in enumerate(pieces, start=1):
        if len(points) < FEWEST:
            where = f"segment {number} of it" if count > 1 else "it"
            refuse_file(name, "few-points", f"{where} has {len(points)} points", f"give {FEWEST} or more")
    return Trial(name, TrialOutcome.SEEN, curves=tuple(TrialCurve(points) for points in pieces))


def _rightwards(points: Array) -> Array:
    """The same from left to right."""
    return points if len(points) < 2 or points[0, 0] <= points[-1, 0] else points[::-1]


def _check_place(name: str, points: Array, scene: Scene) -> None:
    """Refuse points that cannot be of this display."""
    width = scene.display.span * (len(scene.nodes) - 1)
    far = float(np.abs(points - np.array([0.5 * width, 0.0])).max()) if points.size else 0.0
    if far > FARTHEST * width:
        hint = "give mm, x from the first node's rail and y from the home height"
        refuse_file(name, "elsewhere", f"it has points {to_mm(far):.4g} mm from the middle of the display", hint)


def _cut(points: Array, scene: Scene) -> list[Array]:
    """The points of each segment: a polyline cut where it is nearest to the nodes between."""
    inner = [(place * scene.display.span, node.height) for place, node in enumerate(scene.nodes)][1:-1]
    cuts = [int(np.argmin(np.hypot(*(points - np.array(pivot)).T))) for pivot in inner]
    ends = [0, *cuts, len(points) - 1]
    return [points[begin : end + 1] for begin, end in pairwise(ends)]
