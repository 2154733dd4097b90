"""Figures of a shape that is pushed, after the paper's Fig. 7: the curves, and force against deflection; and maps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from curveline.figures.common import (
    COLOURS,
    DARK,
    GREY,
    HEAD_ROOM,
    MARGIN,
    OTHER,
    THICK,
    THIN,
    Y_LABEL,
    bytes_of,
    clamp_shown,
    draw_node,
    dress,
    new_figure,
)
from curveline.loading.load_map import FORCES, LoadMap
from curveline.loading.pushes import Stand
from curveline.loading.results import curve_mm
from curveline.loading.snap_through import Loading
from curveline.rod.problem import Array
from curveline.rod.states.equilibrium import Equilibrium
from curveline.scene import Scene
from curveline.units import to_mm

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LEFT, RIGHT = 4.6, 3.8  # [inch] wide, the two panels
LOWEST, HIGHEST = 2.6, 6.0  # [inch] high
LEGEND_ROOM = 0.3  # [inch]
ARROW = 0.14
"""Length of the arrow, as a part of the display's span."""
ORANGE = "#E69F00"
"""Of the load, as in the paper: of Okabe and Ito's palette."""
DASHES = (0, (5, 2))
FORCE_LABEL = "{x:g}"
"""Whole numbers at the ticks, also small ones: a common factor above them would push the title out of the figure."""
MOST_DOTS = 40
"""Steps of a push that are marked one by one."""
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
    height = _height(np.vstack([*curves, _tail(loading)]))
    colour = COLOURS.get(stand.state.name, OTHER)
    with new_figure(LEFT + RIGHT, height, kind) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(LEFT, RIGHT))
        end = f"{'just before it snaps' if snap else 'loaded'}, {loading.rows[-1][0]:.3g} N"
        left.plot(*curves[0].T, label=f"{stand.state.name}, unloaded", color=colour, linewidth=THICK)
        left.plot(*curves[1].T, label=end, color=colour, linewidth=THIN, linestyle=DASHES)
        for landing, curve in zip(landings, curves[2:], strict=True):
            look: dict[str, Any] = {"color": COLOURS.get(landing.name, OTHER), "linewidth": THIN, "linestyle": ":"}
            left.plot(*curve.T, label=f"lands in {landing.name}", **look)
        _dress_shape(left, loading.scene, loading.push.segment)
        _draw_arrow(left, loading)
        _draw_response(right, loading, colour)
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
        return bytes_of(figure, kind)


def draw_map(found: LoadMap, kind: str) -> bytes:
    """A map as "svg", "png" or "pdf": left the curve and its weakest point, right what every place of it bears."""
    curve = _curve(found.stand, found.stand.state)
    with new_figure(LEFT + RIGHT, _height(curve), kind) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(LEFT, RIGHT))
        name = found.stand.state.name
        left.plot(*curve.T, label=name, color=COLOURS.get(name, OTHER), linewidth=THICK)
        for verdict in found.verdicts[-1:]:
            for number, stretch in enumerate(verdict.stretches):
                label = f"yields to {verdict.force:g} N" if number == 0 else None
                left.plot(
                    *_part(curve, stretch).T, label=label, color=ORANGE, linewidth=2.0 * THICK, alpha=0.6, zorder=1
                )
        _dress_shape(left, found.scene, found.push.segment)
        _draw_strength(right, found)
        if found.weakest is not None:
            place = to_mm(found.weakest.x), to_mm(found.weakest.y)
            left.plot(*place, label="weakest point", **_star())
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
        return bytes_of(figure, kind)


def _draw_response(panel: Axes, loading: Loading, colour: str) -> None:
    """Force over deflection, the special point marked, and the unstable states that the branch goes on with."""
    rows = np.array(loading.rows) * [1.0, to_mm(1.0)]
    branch = np.array([(point.force, to_mm(point.deflection), point.unstable) for point in loading.branch]).reshape(
        -1, 3
    )
    stable = np.vstack([rows, branch[branch[:, 2] == 0, :2]])
    stable = stable[np.argsort(stable[:, 0], kind="stable")]
    panel.plot(stable[:, 1], stable[:, 0], color=colour, linewidth=THIN, zorder=3)
    if len(rows) <= MOST_DOTS:
        panel.plot(rows[:, 1], rows[:, 0], color=colour, marker=".", linestyle="none", zorder=3)
    if (snap := loading.snap) is None:
        panel.set_title(f"no snap-through up to {loading.push.most:g} N")
    else:
        beyond = np.vstack([rows[-1], branch[branch[:, 2] > 0, :2]])
        panel.plot(beyond[:, 1], beyond[:, 0], color=GREY, linewidth=0.8, linestyle=DASHES, zorder=2)
        panel.plot(rows[-1, 1], rows[-1, 0], **_star())
        names = " or ".join(dict.fromkeys(landing.name for landing in snap.landings))
        panel.set_title(f"{snap.kind} at {snap.force:.3g} N{names and f', lands in {names}'}", wrap=True)
        # What people can feel is the part up to the snap-through: the rest only shows where the branch goes.
        right = min(FARTHEST * rows[-1, 1], panel.get_xlim()[1])
        panel.set_xlim(-0.04 * right, right)
        panel.set_ylim(top=min(HIGHEST_LOAD * rows[-1, 0], panel.get_ylim()[1]))
    dress(panel, "load [N]")
    panel.yaxis.set_major_formatter(FORCE_LABEL)
    panel.set_xlabel("deflection along the load [mm]")
    panel.set_ylim(bottom=0.0)


def _draw_strength(panel: Axes, found: LoadMap) -> None:
    """Snap-through load over the place on the curve, with lines at the forces of fingers."""
    places = np.array([point.at for point in found.points])
    forces = np.array([math.nan if point.force is None else point.force for point in found.points])
    panel.plot(places, forces, color=DARK, linewidth=THIN, marker=".", zorder=3)
    withstood = places[np.isnan(forces)]
    if withstood.size:
        most = found.push.most
        look: dict[str, Any] = {"color": GREY, "linestyle": "none", "marker": "^", "markersize": 3.0}
        panel.plot(withstood, np.full(withstood.size, most), **look)
        panel.annotate(
            f"more than {most:g} N", (withstood[0], most), xytext=(0, -10), textcoords="offset points", color=GREY
        )
    # Lines far above all that was found would leave it flat on the ground.
    highest = max(forces[~np.isnan(forces)], default=found.push.most)
    for force in (each for each in (FORCES[0], FORCES[-1]) if each < FARTHEST * highest):
        panel.axhline(force, color=ORANGE, linewidth=THIN, linestyle=DASHES, zorder=1)
        panel.annotate(f"{force:g} N", (1.0, force), xytext=(2, 2), textcoords="offset points", ha="right")
    if found.weakest is not None and found.weakest.force is not None:
        panel.plot(found.weakest.at, found.weakest.force, **_star())
        panel.set_title(f"weakest point: {found.weakest.force:.3g} N")
    dress(panel, "snap-through load [N]")
    panel.yaxis.set_major_formatter(FORCE_LABEL)
    panel.set_xlabel("place, as a fraction of arc length")
    panel.set(xlim=(0.0, 1.0), ylim=(0.0, None))


def _draw_arrow(panel: Axes, loading: Loading) -> None:
    """The load, as an arrow whose tip is on the unloaded curve."""
    tail, tip = (tuple(end) for end in _tail(loading).tolist())
    # An annotation does not count when the panel chooses its scales.
    panel.update_datalim([tail])
    panel.autoscale_view()
    panel.annotate(
        "", tip, tail, arrowprops={"arrowstyle": "-|>", "color": ORANGE, "linewidth": 2.0, "mutation_scale": 14.0}
    )
    across, up = loading.stand.toward
    panel.annotate(
        "F",
        tail,
        (-9.0 * across, -9.0 * up),
        textcoords="offset points",
        color=ORANGE,
        ha="center",
        va="center",
        weight="bold",
    )


def _tail(loading: Loading) -> Array:
    """Where the arrow begins and ends, (2, 2) [mm]."""
    stand = loading.stand
    tip = np.array(stand.seen(stand.place(stand.state)))
    length = ARROW * loading.scene.display.span
    return to_mm(1.0) * np.array([tip - length * np.array(stand.toward), tip])


def _dress_shape(panel: Axes, scene: Scene, segment: int) -> None:
    """The nodes of a segment, labels and scales of its curves."""
    for index in (segment, segment + 1):
        node = scene.nodes[index]
        tangent = math.cos(node.angle), math.sin(node.angle)
        draw_node(panel, (index * scene.display.span, node.height), tangent, clamp_shown(scene.display))
    panel.set_aspect("equal")
    panel.margins(MARGIN, 0.1)
    several = f", segment {segment + 1}" if len(scene.segments) > 1 else ""
    panel.set_title(f"{scene.name}{several}")
    dress(panel, Y_LABEL)


def _star() -> dict[str, Any]:
    return {"marker": "*", "markersize": 9.0, "color": DARK, "linestyle": "none", "zorder": 6}


def _curve(stand: Stand, state: Equilibrium) -> Array:
    return np.array(curve_mm(stand, state))


def _part(curve: Array, stretch: tuple[float, float]) -> Array:
    """Those points of a curve (m, 2), equally spaced in arc length, that lie on a stretch."""
    places = np.linspace(0.0, 1.0, len(curve))
    part: Array = curve[(places >= stretch[0]) & (places <= stretch[1])]
    return part


def _height(points: Array) -> float:
    """Height of the figure [inch] in which curves through `points (m, 2)` are as wide as their panel."""
    (low_x, low_y), (high_x, high_y) = points.min(axis=0), points.max(axis=0)
    steep = float((high_y - low_y) / (high_x - low_x))
    return min(max(LEFT * steep + HEAD_ROOM, LOWEST), HIGHEST) + LEGEND_ROOM
