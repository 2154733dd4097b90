"""Figures of a shape that is pushed, after the paper's Fig. 7: the curves, and force against deflection; and maps."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from curveline.figures.common import (
    BEFORE_LOOK,
    DARK,
    DOES_NOT_STAY,
    FORCE,
    GREY,
    STAYS,
    THICK,
    THIN,
    bytes_of,
    draw_legend,
    dress,
    fit_height,
    legend_entry,
    look_of,
    new_figure,
    within,
)
from curveline.figures.pushed import LoadArrow, dress_segment, reach_of
from curveline.loading.load_map import FORCES, LoadMap
from curveline.loading.pushes import Stand
from curveline.loading.results import curve_mm
from curveline.loading.snap_through import LOST, Loading
from curveline.rod.problem import Array
from curveline.rod.states.equilibrium import Equilibrium
from curveline.units import to_mm

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LEFT, RIGHT = 4.6, 3.8  # [inch] wide, the two panels
START_HEIGHT = 4.0  # [inch] of a figure before its panels are measured
FORCE_LABEL = "{x:g}"
"""Whole numbers at the ticks, also small ones: a common factor above them would push the title out of the figure."""
MOST_DOTS = 40
"""Steps of a push that are marked one by one."""
APART = 0.04
"""Of a panel's size: points of a branch this near to a step of the push add nothing, and are less exact."""
SMOOTH_POINTS = 400
FARTHEST, HIGHEST_LOAD = 2.5, 1.3
"""Deflection and load to which an unstable branch is shown, as parts of those at snap-through."""


def draw(found: Loading | LoadMap, kind: str) -> bytes:
    """A push, or a map of pushes, as "svg", "png" or "pdf"; MissingExtra without matplotlib."""
    return draw_loading(found, kind) if isinstance(found, Loading) else draw_map(found, kind)


def draw_loading(loading: Loading, kind: str) -> bytes:
    """A push as "svg", "png" or "pdf": left the curves before and after snapping, right force over deflection."""
    stand, snap = loading.stand, loading.snap
    landings = [landing for landing in snap.landings if landing.state is not None] if snap else []
    curves = [_curve(stand, state) for state in (stand.state, loading.last)]
    curves += [_curve(stand, landing.state) for landing in landings if landing.state is not None]
    with new_figure(LEFT + RIGHT, START_HEIGHT, kind) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(LEFT, RIGHT))
        name = stand.state.name
        left.plot(*curves[0].T, label=f"{name}, unloaded", **look_of(name, is_meant=True))
        if snap:
            left.plot(*curves[1].T, label="just before it snaps", **BEFORE_LOOK)
        else:
            left.plot(
                *curves[1].T, label=f"{name}, loaded with {loading.rows[-1][0]:.3g} N", **look_of(name, is_meant=False)
            )
        for landing, curve in zip(landings, curves[2:], strict=True):
            left.plot(*curve.T, label=f"lands in {landing.name}", **look_of(landing.name, is_meant=False))
        tip, span = _tip(loading), loading.scene.display.span
        dress_segment(left, loading.scene, loading.push, np.vstack([*curves, reach_of(stand, tip, span)]))
        LoadArrow(left, stand, span).point_at(tip)
        _draw_response(right, loading)
        draw_legend(figure, [*left.get_legend_handles_labels()[0], *right.get_legend_handles_labels()[0]])
        fit_height(figure, [[left]])
        return bytes_of(figure, kind)


def draw_map(found: LoadMap, kind: str) -> bytes:
    """A map as "svg", "png" or "pdf": left the curve and its weakest point, right what every place of it bears."""
    curve = _curve(found.stand, found.stand.state)
    with new_figure(LEFT + RIGHT, START_HEIGHT, kind) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(LEFT, RIGHT))
        name = found.stand.state.name
        left.plot(*curve.T, label=name, **look_of(name, is_meant=True))
        for verdict in found.verdicts[-1:]:
            look: dict[str, Any] = {"color": FORCE, "linewidth": 2.0 * THICK, "alpha": 0.6, "zorder": 1}
            for number, stretch in enumerate(verdict.stretches):
                label = f"yields to {verdict.force:g} N" if number == 0 else None
                left.plot(*_part(curve, stretch).T, label=label, **look)
        dress_segment(left, found.scene, found.push, curve)
        entries = [*left.get_legend_handles_labels()[0], *_draw_strength(right, found)]
        if found.weakest is not None:
            place = to_mm(found.weakest.x), to_mm(found.weakest.y)
            entries += left.plot(*place, label="weakest point", **_star())
        draw_legend(figure, entries)
        fit_height(figure, [[left]])
        return bytes_of(figure, kind)


def _draw_response(panel: Axes, loading: Loading) -> None:
    """Force over deflection, the special point, and the states that do not stay, with which the branch goes on."""
    rows = np.array(loading.rows)[:, ::-1] * [to_mm(1.0), 1.0]
    known = [(to_mm(point.deflection), point.force, point.unstable) for point in loading.branch]
    branch = np.array(known).reshape(-1, 3)
    look = look_of(loading.stand.state.name, is_meant=False)
    stable, beyond = smoothed(rows, branch[branch[:, 2] == 0, :2], branch[branch[:, 2] > 0, :2])
    panel.plot(*stable.T, **look, zorder=3)
    if len(rows) <= MOST_DOTS:
        panel.plot(*rows.T, color=look["color"], marker=".", linestyle="none", zorder=3)
    if (snap := loading.snap) is None:
        panel.set_title(f"no snap-through up to {loading.push.most:g} N")
    else:
        if len(beyond) > 1:
            lost: dict[str, Any] = {"color": DARK, "linewidth": THIN, "linestyle": DOES_NOT_STAY}
            panel.plot(*beyond.T, label="does not stay", **lost, zorder=2)
        panel.plot(*rows[-1], label="lost" if snap.kind == LOST else "snaps through", **_star())
        names = " or ".join(dict.fromkeys(landing.name for landing in snap.landings))
        panel.set_title(within(f"{snap.kind} at {snap.force:.3g} N{names and f', lands in {names}'}", RIGHT))
        # What people can feel is the part up to the snap-through: the rest only shows where the branch goes.
        right = min(FARTHEST * rows[-1, 0], panel.get_xlim()[1])
        panel.set_xlim(-0.04 * right, right)
        panel.set_ylim(top=min(HIGHEST_LOAD * rows[-1, 1], panel.get_ylim()[1]))
    dress(panel, "load [N]")
    panel.yaxis.set_major_formatter(FORCE_LABEL)
    panel.set_xlabel("deflection along the load [mm]")
    panel.set_ylim(bottom=0.0)


def smoothed(rows: Array, stable: Array, beyond: Array) -> tuple[Array, Array]:
    """A response as two curves (m, 2), (deflection, load), to its last row and from there on: cubics through points.

    `rows` are exact and come first; of the `stable` points of the branch those count that lie between them.
    """
    size = np.ptp(rows, axis=0)
    size[size == 0.0] = 1.0
    far = [point for point in stable if np.min(np.linalg.norm((rows - point) / size, axis=1)) > APART]
    below = np.array([point for point in far if point[1] < rows[-1, 1]]).reshape(-1, 2)
    first = np.vstack([rows, below])
    first = first[np.argsort(first[:, 1], kind="stable")]
    apart = np.linalg.norm(np.diff(np.vstack([rows[-1:], beyond]), axis=0) / size, axis=1)
    rest = beyond[np.cumsum(apart) > APART]
    points = np.vstack([first, rest])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0) / size, axis=1))])
    is_new = np.concatenate([[True], np.diff(along) > 0.0])
    return _between(points[is_new], along[is_new], float(along[len(first) - 1]))


def _between(points: Array, along: Array, middle: float) -> tuple[Array, Array]:
    """Cubics through `points (m, 2)` at the path lengths `along (m,)`, cut in two at that of the `middle`."""
    from scipy.interpolate import CubicSpline

    if len(points) < 2:
        return points, points
    curve = CubicSpline(along, points)
    ends = (along[0], middle, along[-1])
    parts = [curve(np.linspace(begin, end, SMOOTH_POINTS)) for begin, end in pairwise(ends) if end > begin]
    return parts[0], parts[1] if len(parts) > 1 else points[-1:]


def _draw_strength(panel: Axes, found: LoadMap) -> list[Any]:
    """Snap-through load over the place on the curve, with lines at the forces of fingers; entries of a legend."""
    places = np.array([point.at for point in found.points])
    forces = np.array([math.nan if point.force is None else point.force for point in found.points])
    panel.plot(places, forces, color=DARK, linewidth=THIN, marker=".", zorder=3)
    withstood = places[np.isnan(forces)]
    if withstood.size:
        most = found.push.most
        beyond: dict[str, Any] = {"color": GREY, "linestyle": "none", "marker": "^", "markersize": 3.0}
        panel.plot(withstood, np.full(withstood.size, most), **beyond)
        panel.annotate(
            f"more than {most:g} N", (withstood[0], most), xytext=(0, -10), textcoords="offset points", color=GREY
        )
    # Lines far above all that was found would leave it flat on the ground.
    highest = max(forces[~np.isnan(forces)], default=found.push.most)
    fingers = [force for force in (FORCES[0], FORCES[-1]) if force < FARTHEST * highest]
    look: dict[str, Any] = {"color": FORCE, "linewidth": THIN, "linestyle": STAYS}
    for force in fingers:
        panel.axhline(force, **look, zorder=1)
        panel.annotate(f"{force:g} N", (1.0, force), xytext=(2, 2), textcoords="offset points", ha="right")
    if found.weakest is not None and found.weakest.force is not None:
        panel.plot(found.weakest.at, found.weakest.force, **_star())
        panel.set_title(f"weakest point: {found.weakest.force:.3g} N")
    dress(panel, "snap-through load [N]")
    panel.yaxis.set_major_formatter(FORCE_LABEL)
    panel.set_xlabel("place, as a fraction of arc length")
    panel.set(xlim=(0.0, 1.0), ylim=(0.0, None))
    return [legend_entry("a finger", **look)] if fingers else []


def _tip(loading: Loading) -> Array:
    """Where the unloaded curve is pushed (2,) [mm]."""
    stand = loading.stand
    return to_mm(1.0) * np.array(stand.seen(stand.place(stand.state)))


def _star() -> dict[str, Any]:
    return {"marker": "*", "markersize": 9.0, "color": DARK, "linestyle": "none", "zorder": 6}


def _curve(stand: Stand, state: Equilibrium) -> Array:
    return np.array(curve_mm(stand, state))


def _part(curve: Array, stretch: tuple[float, float]) -> Array:
    """Those points of a curve (m, 2), equally spaced in arc length, that lie on a stretch."""
    places = np.linspace(0.0, 1.0, len(curve))
    part: Array = curve[(places >= stretch[0]) & (places <= stretch[1])]
    return part
