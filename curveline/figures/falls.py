"""Figures of a rod that falls: a strobe picture, and a film."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from curveline.figures.common import (
    DARK,
    HEAD_ROOM,
    MARGIN,
    THICK,
    THIN,
    WIDTH,
    Y_LABEL,
    bytes_of,
    dress,
    new_figure,
)
from curveline.figures.film import Film
from curveline.rod.spatial.dynamics import time_unit
from curveline.simulation.results import Array
from curveline.units import to_mm, to_ms

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from curveline.rod.spatial.dynamics import FallMotion
    from curveline.rod.spatial.segment import SpatialSegment

FLASHES = 16
"""Curves in a strobe picture."""
SLOWER = 5.0
FRAME_MS = 40
FILM_INCHES = 4.8


def draw_fall(film: FallMotion, segment: SpatialSegment, kind: str) -> bytes:
    """A strobe picture ("svg", "png", "pdf") of a motion from the front: flashes at equal times, the last darkest.

    `segment` says how long the rod is and how heavy, hence how fast.
    """
    times, curves = film.sampled(FLASHES)
    with _panel_of(curves, segment, kind) as (figure, panel):
        for number, curve in enumerate(curves):
            last = number == FLASHES - 1
            panel.plot(
                *_seen(curve, segment).T,
                color=DARK,
                linewidth=THICK if last else THIN,
                alpha=(number + 2) / (FLASHES + 1),
            )
        flash_ms = to_ms((times[1] - times[0]) * time_unit(segment))
        panel.set_title(f"{FLASHES} flashes, one every {flash_ms:.3g} ms: {film.fate.value}", wrap=True)
        return bytes_of(figure, kind)


def animate_fall(film: FallMotion, segment: SpatialSegment) -> bytes:
    """A motion as seen from the front, a GIF that runs `SLOWER` times slower than the rod, over and over."""
    seconds = (film.times[-1] - film.times[0]) * time_unit(segment)
    _, curves = film.sampled(max(2, round(to_ms(seconds) * SLOWER / FRAME_MS)))
    with _panel_of(curves, segment, "gif") as (figure, panel):
        panel.set_title(f"{SLOWER:g} times slower than the rod")
        (line,) = panel.plot([], [], color=DARK, linewidth=THICK)
        strip = Film(figure, [line], [DARK])
        for curve in curves:
            line.set_data(*_seen(curve, segment).T)
            strip.shoot(FRAME_MS)
        return strip.gif()


@contextmanager
def _panel_of(curves: Array, segment: SpatialSegment, kind: str) -> Iterator[tuple[Figure, Axes]]:
    """An empty panel that all `curves (k, n+1, 3)` of a segment fit into."""
    seen = np.concatenate([_seen(curve, segment) for curve in curves])
    (left, low), (right, high) = np.min(seen, axis=0), np.max(seen, axis=0)
    room = MARGIN * (right - left)
    width = FILM_INCHES if kind == "gif" else WIDTH
    height = width * min(1.5, (high - low + 2.0 * room) / (right - left + 2.0 * room)) + HEAD_ROOM
    with new_figure(width, height, kind) as figure:
        panel = figure.subplots()
        panel.set(xlim=(left - room, right + room), ylim=(low - room, high + room), aspect="equal")
        dress(panel, Y_LABEL)
        yield figure, panel


def _seen(curve: Array, segment: SpatialSegment) -> Array:
    """Points (n+3, 2) [mm], from pivot to pivot, of a `curve (n+1, 3)` over the free length."""
    rod = segment.rod
    free = np.array(rod.free_start) + rod.free_length * curve[:, :2]
    return to_mm(1.0) * np.vstack([[0.0, 0.0], free, rod.chord])
