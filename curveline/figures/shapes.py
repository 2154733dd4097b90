"""Figures of simulated shapes for reports: true to aspect, in mm, the same bytes for the same shape."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

import numpy as np

from curveline.figures.common import (
    DARK,
    DOES_NOT_STAY,
    GREY,
    THICK,
    THIN,
    UNSHOWN,
    UNSHOWN_LOOK,
    WIDTH,
    X_LABEL,
    Y_LABEL,
    Frame,
    by_kind,
    bytes_of,
    clamp_shown,
    draw_legend,
    draw_node,
    dress,
    fit_height,
    kind_of,
    legend_entry,
    look_of,
    new_figure,
    within,
)
from curveline.rod.states.equilibrium import Equilibrium
from curveline.scene import Node
from curveline.simulation.explanation import deepest
from curveline.simulation.results import Array, ShapeReport, curve_mm, depth_mm
from curveline.units import to_mm

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANEL_WIDTHS = {1: WIDTH, 2: 4.4, 3: 3.6, 4: 2.9}
"""Of a panel [inch] by how many stand side by side."""
PER_SEGMENT, WIDEST = 1.6, 16.0  # [inch] of a panel for itself: for each segment of a row, and at most
LOWEST = 0.6  # [inch] of a panel's height, so that its scale has room
ROOM = 0.08
"""Beside and above all that is drawn, as a part of the span between nodes."""
ROW_GAP = 0.08  # [inch] above and below what belongs to a panel
SIDE_ROOM = 0.7  # [inch] of a panel for its scale
START_HEIGHT = 8.0  # [inch] of a figure before its panels are measured


@dataclass(frozen=True)
class View:
    """A direction from which a shape is seen: its curves (points, 2) [mm], and pivots and tangents of its nodes."""

    label: str
    of: Callable[[ShapeReport, int, Equilibrium], Array]
    height: Callable[[Node], float]  # [m]
    tangent: Callable[[Node], tuple[float, float]]


def _from_above(report: ShapeReport, index: int, state: Equilibrium) -> Array:
    curve: Array = np.column_stack([curve_mm(report, index, state)[:, 0], depth_mm(report, state)])
    return curve


FRONT = View(
    label=Y_LABEL,
    of=curve_mm,
    height=lambda node: node.height,
    tangent=lambda node: (math.cos(node.yaw) * math.cos(node.angle), math.cos(node.yaw) * math.sin(node.angle)),
)
ABOVE = View(
    label="z [mm]",
    of=_from_above,
    height=lambda _: 0.0,
    tangent=lambda node: (math.cos(node.yaw) * math.cos(node.angle), math.sin(node.yaw)),
)
"""The viewer of the front stands below what is seen from above, so that z, which points to the viewer, points down."""


@dataclass(frozen=True)
class _Place:
    """What stands in a panel: a shape, seen from somewhere, and how much of the plane is in sight."""

    report: ShapeReport
    view: View
    frame: Frame


def draw(reports: Sequence[ShapeReport], kind: str) -> bytes:
    """A figure of one shape, or a grid of several, as "svg", "png" or "pdf".

    Shapes are seen from the front and, if their rod leaves the plane, below that from above.
    """
    across = _across(reports)
    width = _panel_width(reports, across)
    alike = len({report.scene.display.digest for report in reports}) == 1
    rows = _rows(reports, across, LOWEST / width, alike=alike)
    steepness = [max(place.frame.steepness for place in row if place) for row in rows]
    with new_figure(width * across, START_HEIGHT, kind) as figure:
        figure.get_layout_engine().set(h_pad=ROW_GAP)  # type: ignore[union-attr, call-arg]
        grid = figure.subplots(len(rows), across, squeeze=False, height_ratios=steepness)
        for panels, row in zip(grid, rows, strict=True):
            for panel, place in zip_longest(panels, row):
                if place is None:
                    panel.set_axis_off()
                else:
                    _draw_place(panel, place, width)
        if alike:
            _label_edges(grid, rows)
        draw_legend(figure, _legend(reports))
        fit_height(figure, [_filled(panels, row) for panels, row in zip(grid, rows, strict=True)])
        return bytes_of(figure, kind)


def _across(reports: Sequence[ShapeReport]) -> int:
    """How many shapes stand side by side: about as many as below each other, and no more than have room."""
    most = max(PANEL_WIDTHS)
    room = max(1, most // max(len(report.segments) for report in reports))
    count = len(reports)
    return min(room, count if count < most else min(most, math.ceil(math.sqrt(count))))


def _panel_width(reports: Sequence[ShapeReport], across: int) -> float:
    """Of a panel [inch]."""
    segments = max(len(report.segments) for report in reports)
    return PANEL_WIDTHS[across] if across > 1 else min(WIDEST, max(WIDTH, PER_SEGMENT * segments))


def _rows(reports: Sequence[ShapeReport], across: int, least: float, *, alike: bool) -> list[list[_Place | None]]:
    """The panels row by row, None where there is none; those of a row are as steep, of one display as large."""
    rows: list[list[_Place | None]] = []
    for begin in range(0, len(reports), across):
        some = reports[begin : begin + across]
        rows.append([_Place(report, FRONT, _frame(report, FRONT)) for report in some])
        if any(map(_is_deep, some)):
            rows.append([_Place(report, ABOVE, _frame(report, ABOVE)) if _is_deep(report) else None for report in some])
    for view in (FRONT, ABOVE) if alike else ():
        frames = [place.frame for row in rows for place in row if place and place.view is view]
        rows = [_framed(row, Frame.over(frames)) if _view_of(row) is view else row for row in rows]
    return [_as_steep(row, least) for row in rows]


def _framed(row: Sequence[_Place | None], frame: Frame) -> list[_Place | None]:
    return [place and _Place(place.report, place.view, frame) for place in row]


def _as_steep(row: Sequence[_Place | None], least: float) -> list[_Place | None]:
    """Places with frames of one steepness, `least` or that of the steepest, but at most as high as wide."""
    most = min(1.0, max([least, *(place.frame.steepness for place in row if place)]))
    return [place and _Place(place.report, place.view, place.frame.within(most, most)) for place in row]


def _filled(panels: Sequence[Axes], row: Sequence[_Place | None]) -> list[Axes]:
    return [panel for panel, place in zip(panels, row, strict=False) if place]


def _first(row: Sequence[_Place | None]) -> int:
    return next(index for index, place in enumerate(row) if place)


def _view_of(row: Sequence[_Place | None]) -> View:
    place = row[_first(row)]
    assert place is not None
    return place.view


def _is_deep(report: ShapeReport) -> bool:
    """True if a curve of a shape leaves the plane by more than it is known to."""
    return any(deepest(state) > state.error for segment in report.segments for state in segment.states)


def _frame(report: ShapeReport, view: View) -> Frame:
    """All that is drawn of a shape, with room around it."""
    span = to_mm(report.scene.display.span)
    places = [(index * span, to_mm(view.height(node))) for index, node in enumerate(report.scene.nodes)]
    for index, segment in enumerate(report.segments):
        for state in segment.states:
            places += view.of(report, index, state).tolist()
    return Frame.around(places, ROOM * span)


def _draw_place(panel: Axes, place: _Place, width: float) -> None:
    """All states of a shape and the nodes that hold it."""
    report, view = place.report, place.view
    for index, segment in enumerate(report.segments):
        # What the display cannot show lies below, what is wanted on top.
        for state in sorted(segment.states, key=lambda state: (state.is_untangled, state.wanted)):
            curve = view.of(report, index, state)
            panel.plot(curve[:, 0], curve[:, 1], label=state.name, **_look(state))
    display = report.scene.display
    for index, node in enumerate(report.scene.nodes):
        draw_node(panel, (index * display.span, view.height(node)), view.tangent(node), clamp_shown(display))
    panel.set_title(within(report.scene.name, width - SIDE_ROOM) if view is FRONT else "from above")
    dress(panel, view.label)
    place.frame.show_in(panel)
    if view is ABOVE:
        panel.invert_yaxis()


def _look(state: Equilibrium) -> dict[str, Any]:
    if not state.is_untangled:
        return dict(UNSHOWN_LOOK)
    return look_of(state.name, is_meant=bool(state.wanted), stays=bool(state.stable))


def _label_edges(grid: Any, rows: Sequence[Sequence[_Place | None]]) -> None:
    """Scales at the left and at the lowest panel of every column: those of one display are the same."""
    for number, (panels, row) in enumerate(zip(grid, rows, strict=True)):
        for column, place in enumerate(row):
            if place is None:
                continue
            is_lowest = not any(column < len(below) and below[column] for below in rows[number + 1 :])
            is_first = column == _first(row)
            panels[column].tick_params(labelbottom=is_lowest, labelleft=is_first)
            panels[column].set_xlabel(X_LABEL if is_lowest else "")
            panels[column].set_ylabel(place.view.label if is_first else "")


def _legend(reports: Sequence[ShapeReport]) -> list[Any]:
    """The kinds of states that are drawn, then what lines mean."""
    states = [state for report in reports for segment in report.segments for state in segment.states]
    shown = [state for state in states if state.is_untangled]
    entries = [
        legend_entry(kind, **look_of(kind, is_meant=False)) for kind in by_kind({kind_of(each.name) for each in shown})
    ]
    if any(state.wanted for state in shown):
        entries.append(legend_entry("thick: wanted", linewidth=THICK, color=GREY))
    if not all(state.stable for state in shown):
        entries.append(legend_entry("dashed: does not stay", linewidth=THIN, color=DARK, linestyle=DOES_NOT_STAY))
    if len(shown) < len(states):
        entries.append(legend_entry(UNSHOWN, **UNSHOWN_LOOK))
    return entries
