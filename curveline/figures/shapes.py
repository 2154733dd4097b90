"""Figures of simulated shapes for reports: true to aspect, in mm, the same bytes for the same shape."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from curveline.figures.common import (
    COLOURS,
    GREY,
    HEAD_ROOM,
    MARGIN,
    OTHER,
    STYLES,
    THICK,
    THIN,
    WIDTH,
    X_LABEL,
    Y_LABEL,
    bytes_of,
    clamp_shown,
    draw_node,
    dress,
    new_figure,
)
from curveline.rod.states.equilibrium import Equilibrium
from curveline.scene import Node
from curveline.simulation.explanation import deepest
from curveline.simulation.results import Array, ShapeReport, curve_mm, depth_mm
from curveline.units import to_mm

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

UNSHOWN = "not for a planar display"
ACROSS = 3
"""Segments side by side in a row of a grid."""
SMALL_WIDTH = 3.6  # [inch] of a panel among others
LEGEND_ROOM = 0.4  # [inch] below all panels


@dataclass(frozen=True)
class View:
    """A direction from which a shape is seen: its curves (points, 2) [mm], and pivots and tangents of its nodes."""

    label: str
    title: str
    of: Callable[[ShapeReport, int, Equilibrium], Array]
    height: Callable[[Node], float]  # [m]
    tangent: Callable[[Node], tuple[float, float]]


def _from_above(report: ShapeReport, index: int, state: Equilibrium) -> Array:
    curve: Array = np.column_stack([curve_mm(report, index, state)[:, 0], depth_mm(report, state)])
    return curve


FRONT = View(
    label=Y_LABEL,
    title="",
    of=curve_mm,
    height=lambda node: node.height,
    tangent=lambda node: (math.cos(node.yaw) * math.cos(node.angle), math.cos(node.yaw) * math.sin(node.angle)),
)
ABOVE = View(
    label="z [mm]",
    title=", from above",
    of=_from_above,
    height=lambda _: 0.0,
    tangent=lambda node: (math.cos(node.yaw) * math.cos(node.angle), math.sin(node.yaw)),
)
"""The viewer of the front stands below what is seen from above, so that z, which points to the viewer, points down."""


def draw(reports: Sequence[ShapeReport], kind: str) -> bytes:
    """A figure of one shape, or a grid of several, as "svg", "png" or "pdf".

    Shapes are seen from the front and, if the rod of any of them leaves the plane, below that from above.
    """
    across = min(max(1, ACROSS // max(len(report.segments) for report in reports)), len(reports))
    down = math.ceil(len(reports) / across)
    width = WIDTH if across == 1 else SMALL_WIDTH
    views = [FRONT, *([ABOVE] if any(map(_is_deep, reports)) else [])]
    heights = [width * max(_steepness(report, view) for report in reports) + HEAD_ROOM for view in views]
    alike = len({report.scene.display.digest for report in reports}) == 1
    with new_figure(width * across, sum(heights) * down + LEGEND_ROOM, kind) as figure:
        rows = figure.subplots(len(views) * down, across, squeeze=False, height_ratios=heights * down)
        for offset, view in enumerate(views):
            panels = list(rows[offset :: len(views)].flatten())
            _draw_view(panels, reports, view, alike=alike)
        _draw_legend(figure)
        return bytes_of(figure, kind)


def _draw_view(panels: Sequence[Axes], reports: Sequence[ShapeReport], view: View, *, alike: bool) -> None:
    """Every shape in its panel; those of one display share their scales."""
    across = panels[0].get_gridspec().ncols  # type: ignore[union-attr]
    for number, (panel, report) in enumerate(zip(panels, reports, strict=False)):
        if alike and number:
            panel.sharex(panels[0])
            panel.sharey(panels[0])
        _draw_shape(panel, report, view)
        if view is ABOVE and not panel.yaxis_inverted():
            panel.invert_yaxis()
    for panel in panels[: len(reports)] if alike else ():
        panel.label_outer()
    for panel in panels[max(0, len(reports) - across) : len(reports)]:
        panel.tick_params(labelbottom=True)
        panel.set_xlabel(X_LABEL)
    for panel in panels[len(reports) :]:
        panel.set_axis_off()


def _is_deep(report: ShapeReport) -> bool:
    """True if a curve of a shape leaves the plane by more than it is known to."""
    return any(deepest(state) > state.error for segment in report.segments for state in segment.states)


def _least_depth(report: ShapeReport) -> float:
    """How far the view from above reaches at least [mm]: a rod that hardly leaves the plane would hide the nodes."""
    return MARGIN * to_mm(report.scene.display.span)


def _steepness(report: ShapeReport, view: View) -> float:
    """Height over width of all that is drawn of a shape, at most 1."""
    curves = [view.of(report, index, state) for index, each in enumerate(report.segments) for state in each.states]
    heights = [float(height) for curve in curves for height in curve[:, 1]] or [0.0]
    heights += [to_mm(view.height(node)) for node in report.scene.nodes]
    heights += [-_least_depth(report), _least_depth(report)] if view is ABOVE else []
    return min(1.0, (max(heights) - min(heights)) / to_mm(len(report.segments) * report.scene.display.span))


def _draw_shape(panel: Axes, report: ShapeReport, view: View) -> None:
    """All states of a shape and the nodes that hold it."""
    for index, segment in enumerate(report.segments):
        # What the display cannot show lies below, what is wanted on top.
        for state in sorted(segment.states, key=lambda state: (state.is_untangled, state.wanted)):
            curve = view.of(report, index, state)
            panel.plot(curve[:, 0], curve[:, 1], **_style(state))
    _draw_nodes(panel, report, view)
    if view is ABOVE:
        panel.update_datalim([(0.0, -_least_depth(report)), (0.0, _least_depth(report))])
    panel.set_aspect("equal")
    panel.margins(MARGIN)
    panel.set_title(f"{report.scene.name}{view.title}")
    dress(panel, view.label)


def _style(state: Equilibrium) -> dict[str, Any]:
    if not state.is_untangled:
        return {"label": UNSHOWN, "color": GREY, "linewidth": 0.6, "linestyle": ":"}
    look = {"color": COLOURS.get(state.name, OTHER), "linestyle": STYLES.get(state.name, "-.")}
    return {"label": state.name, **look, "linewidth": THICK if state.wanted else THIN}


def _draw_legend(figure: Figure) -> None:
    """One legend for all panels, below them where no curve can be."""
    from matplotlib.lines import Line2D

    drawn = {str(line.get_label()): line for panel in figure.axes for line in panel.lines}
    handles = []
    for name in sorted((name for name in drawn if not name.startswith("_")), key=lambda name: (name == UNSHOWN, name)):
        line = drawn[name]
        look: dict[str, Any] = {"color": line.get_color(), "linestyle": STYLES.get(name, line.get_linestyle())}
        handles.append(Line2D([], [], label=name, linewidth=0.6 if name == UNSHOWN else THIN, **look))
    if any(line.get_linewidth() == THICK for panel in figure.axes for line in panel.lines):
        handles.append(Line2D([], [], label="thick: wanted", linewidth=THICK, color=GREY))
    if handles:
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False)


def _draw_nodes(panel: Axes, report: ShapeReport, view: View) -> None:
    """Every node as its pivot and the stretch of rod that its bearing holds straight."""
    display = report.scene.display
    for index, node in enumerate(report.scene.nodes):
        draw_node(panel, (index * display.span, view.height(node)), view.tangent(node), clamp_shown(display))
