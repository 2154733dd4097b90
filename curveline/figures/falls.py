"""Figures of a pushed shape that snaps and falls: a strobe picture, and a film."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from curveline.figures.common import (
    BEFORE_LOOK,
    COLOURS,
    DARK,
    FORCE,
    GREY,
    HUB,
    OTHER,
    THICK,
    THIN,
    WIDTH,
    bytes_of,
    colour_of,
    draw_legend,
    fit_height,
    legend_entry,
    look_of,
    new_figure,
)
from curveline.figures.film import Film
from curveline.figures.pushed import LoadArrow, dress_segment, reach_of, title_of
from curveline.loading.falling import SnapFall
from curveline.loading.snap_through import UNKNOWN
from curveline.rod.problem import Array
from curveline.rod.spatial.dynamics import time_unit
from curveline.units import decimals_of, to_mm, to_ms

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from curveline.rod.spatial.dynamics import FallMotion

START_HEIGHT = 4.0  # [inch] of a figure before its panel is measured
FLASHES = 16
"""Curves in a strobe picture."""
HARDLY = 0.02
"""Of the way that a fall takes in all, what does not count: a rod may stand before it leaves, and tremble after."""
FALLING: dict[str, Any] = {"color": DARK, "linewidth": THIN}
FILM_WIDTH = 5.6  # [inch]
PUSH_MS, FRAME_MS = 80, 40
"""For which frames of the push and of the fall stay."""
HOLD_MS, LAST_MS = 800, 2500
"""How much longer the rod stands before it falls, and when it rests."""
SHORTEST_S = 1.8
"""Of a fall as it is shown, at the least factor by which it is slower than the rod's: one, two or five tens."""
FACTORS = sorted(digit * 10.0**power for power in range(-6, 12) for digit in (1.0, 2.0, 5.0))


@dataclass(frozen=True)
class _FilmFrame:
    """A frame of a film: the curve (m, 2) [mm], its colour, what is said of it, the time, and how long it stays."""

    curve: Array
    colour: str
    heading: str
    clock: str
    duration_ms: int


def draw(fall: SnapFall, heard: Callable[[int], None] = lambda _: None, *, kind: str) -> bytes:
    """A strobe picture of a fall, "svg", "png" or "pdf": flashes at equal times, the later the darker.

    `heard` is told when its one part is done.
    """
    times, places = _moving(fall)[1].sampled(FLASHES)
    curves = [_seen(fall, place) for place in places]
    start = to_mm(1.0) * fall.pushed[0].curve
    name = fall.loading.stand.state.name
    with _panel_of(fall, [start, *curves], (WIDTH, kind)) as (figure, panel, arrow):
        panel.plot(*start.T, **look_of(name, is_meant=True), zorder=3)
        for number, curve in enumerate(curves, start=1):
            panel.plot(*curve.T, **FALLING, alpha=number / FLASHES)
        panel.plot(*_seen(fall, fall.motion.places[-1]).T, **look_of(fall.name, is_meant=True))
        arrow.point_at(_pushed_at(fall, start))
        title = f"{title_of(fall.loading.scene, fall.loading.push, 0.5 * WIDTH)} snaps at {_snaps_at(fall)}"
        panel.set_title(f"{title}\na flash every {to_ms((times[1] - times[0]) * time_unit(fall.segment)):.3g} ms")
        entries = [
            legend_entry(f"{name}, unloaded", **look_of(name, is_meant=True)),
            legend_entry("falling", **FALLING),
            legend_entry(ending_of(fall), **look_of(fall.name, is_meant=True)),
        ]
        draw_legend(figure, entries)
        fit_height(figure, [[panel]])
        made = bytes_of(figure, kind)
    heard(1)
    return made


def _moving(fall: SnapFall) -> tuple[FallMotion, FallMotion]:
    """The motion from when the rod really leaves to its end, and to when it only trembles."""
    motion = fall.motion
    ways = [np.max(np.linalg.norm(motion.places - motion.places[end], axis=2), axis=1) for end in (0, -1)]
    steps = np.flatnonzero((ways[0] > HARDLY * np.max(ways[0])) & (ways[1] > HARDLY * np.max(ways[1])))
    if not steps.size:
        return motion, motion
    parts = [slice(steps[0], end) for end in (None, steps[-1] + 1)]
    whole, short = (replace(motion, times=motion.times[part], places=motion.places[part]) for part in parts)
    return whole, short


def parts_of(fall: SnapFall) -> int:
    """How many parts `animate` reports: every frame is drawn."""
    return len(fall.pushed) + _frames(fall)


def animate(fall: SnapFall, heard: Callable[[int], None] = lambda _: None) -> bytes:
    """A GIF of a shape that is pushed until it snaps, and of its fall, slowed down so that it can be watched.

    `heard` is told how many of `parts_of` parts are done.
    """
    shots = list(_shots(fall))
    with _panel_of(fall, [shot.curve for shot in shots], (FILM_WIDTH, "gif")) as (figure, panel, arrow):
        panel.set_title("")
        heading, clock = panel.set_title(" \n ", loc="left"), panel.set_title(" \n ", loc="right")
        panel.plot(*shots[0].curve.T, **BEFORE_LOOK)
        (line,) = panel.plot([], [], linewidth=THICK)
        arrow.point_at(_pushed_at(fall, shots[0].curve))
        draw_legend(figure, _film_legend(fall))
        fit_height(figure, [[panel]])
        hubs = [each for each in panel.lines if each.get_marker() == HUB["marker"]]
        film = Film(figure, [line, *hubs, *arrow.artists, heading, clock], [GREY, FORCE, OTHER, *COLOURS.values()])
        for number, shot in enumerate(shots, start=1):
            line.set(data=shot.curve.T, color=shot.colour)
            arrow.point_at(_pushed_at(fall, shot.curve))
            heading.set_text(shot.heading)
            clock.set_text(shot.clock)
            film.shoot(shot.duration_ms)
            heard(number)
        return film.gif()


def _shots(fall: SnapFall) -> Iterator[_FilmFrame]:
    """The push, a moment of rest, the fall, and the state that it ends in."""
    loading = fall.loading
    name, shape = loading.stand.state.name, title_of(loading.scene, loading.push, 0.5 * FILM_WIDTH)
    for number, (force, curve) in enumerate(fall.pushed, start=1):
        is_last = number == len(fall.pushed)
        said = f"snaps at {_snaps_at(fall)}" if is_last else f"{name}, pushed with {force:.3g} N"
        stays = PUSH_MS + (HOLD_MS if is_last or number == 1 else 0)
        yield _FilmFrame(to_mm(1.0) * curve, colour_of(name), f"{shape}\n{said}", " ", stays)
    times, places = _moving(fall)[0].sampled(_frames(fall))
    clock = to_ms(1.0) * time_unit(fall.segment) * (times - times[0])
    decimals = decimals_of(clock[-1], 3)
    for place, milliseconds in zip(places, clock, strict=True):
        curve, told = _seen(fall, place), f"{milliseconds:.{decimals}f} ms"
        if milliseconds == clock[-1]:
            yield _FilmFrame(curve, colour_of(fall.name), f"{shape}\n{ending_of(fall)}", told, LAST_MS)
        else:
            yield _FilmFrame(curve, DARK, f"{shape}\nfalls, {_pace(fall)}", told, FRAME_MS)


def _film_legend(fall: SnapFall) -> list[Any]:
    name = fall.loading.stand.state.name
    states = dict.fromkeys((name, fall.name))
    return [
        legend_entry("unloaded", **BEFORE_LOOK),
        *(legend_entry(each, **look_of(each, is_meant=True)) for each in states if each != UNKNOWN),
        legend_entry("falling", color=DARK, linewidth=THICK),
    ]


def _snaps_at(fall: SnapFall) -> str:
    snap = fall.loading.snap
    assert snap is not None
    return f"{snap.force:.3g} N"


def ending_of(fall: SnapFall) -> str:
    """How a fall ends, as text."""
    return fall.motion.fate.value if fall.name == UNKNOWN else f"lands in {fall.name}"


def seconds_of(fall: SnapFall) -> float:
    """How long the rod falls [s], from when it leaves until it only trembles."""
    return _lasting(fall, _moving(fall)[1])


def _lasting(fall: SnapFall, motion: FallMotion) -> float:
    return float(motion.times[-1] - motion.times[0]) * time_unit(fall.segment)


def _factor(fall: SnapFall) -> float:
    """How much slower than the rod a film is."""
    return next((factor for factor in FACTORS if factor * seconds_of(fall) >= SHORTEST_S), FACTORS[-1])


def _pace(fall: SnapFall) -> str:
    factor = _factor(fall)
    return f"{factor:g} times slower" if factor >= 1.0 else f"{1.0 / factor:g} times faster"


def _frames(fall: SnapFall) -> int:
    """Frames of the fall, and of how the rod comes to rest."""
    return max(2, round(to_ms(_factor(fall) * _lasting(fall, _moving(fall)[0])) / FRAME_MS))


@contextmanager
def _panel_of(
    fall: SnapFall, curves: list[Array], canvas: tuple[float, str]
) -> Iterator[tuple[Figure, Axes, LoadArrow]]:
    """A panel that all `curves (m, 2)` [mm] and their loads fit into, in a figure of a width [inch] and a kind."""
    loading = fall.loading
    span = loading.scene.display.span
    reaches = [reach_of(loading.stand, _pushed_at(fall, curve), span) for curve in curves]
    width, kind = canvas
    with new_figure(width, START_HEIGHT, kind) as figure:
        panel = figure.subplots()
        dress_segment(panel, loading.scene, loading.push, np.vstack([*curves, *reaches]))
        yield figure, panel, LoadArrow(panel, loading.stand, span)


def _pushed_at(fall: SnapFall, curve: Array) -> Array:
    """Where a curve (m, 2) [mm] is pushed (2,)."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    place = fall.loading.stand.at * along[-1]
    return np.array([np.interp(place, along, curve[:, axis]) for axis in range(2)])


def _seen(fall: SnapFall, places: Array) -> Array:
    """Points (n+3, 2) [mm], from pivot to pivot in the display's frame, of `places (n+1, 3)` of the free rod over L."""
    rod = fall.segment
    free = np.array(rod.free_start) + rod.free_length * places[:, :2]
    whole: Array = to_mm(1.0) * (np.array(fall.loading.stand.origin) + np.vstack([[0.0, 0.0], free, rod.chord]))
    return whole
