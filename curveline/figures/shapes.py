"""Figures of simulated shapes for reports: true to aspect, in mm, the same bytes for the same shape."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
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
    PanelFrame,
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
SIDE_ROOM = 0.5  # [inch] of a panel for its scale
START_HEIGHT = 8.0  # [inch] of a figure before its panels are measured


@dataclass(frozen=True)
class FigureView:
    """A direction from which a shape is seen: its curves (points, 2) [mm], and pivots and tangents of its nodes."""

    label: str
    of: Callable[[ShapeReport, int, Equilibrium], Array]
    height: Callable[[Node], float]  # [m]
    tangent: Callable[[Node], tuple[float, float]]


def _from_above(report: ShapeReport, index: int, state: Equilibrium) -> Array:
    curve: Array = np.column_stack([curve_mm(report, index, state)[:, 0], depth_mm(report, state)])
    return curve


FRONT = FigureView(
    label=Y_LABEL,
    of=curve_mm,
    height=lambda node: node.height,
    tangent=lambda node: (math.cos(node.yaw) * math.cos(node.angle), math.cos(node.yaw) * math.sin(node.angle)),
)
ABOVE = FigureView(
    label="z [mm]",
    of=_from_above,
    height=lambda _: 0.0,
    tangent=lambda node: (math.cos(node.yaw) * math.cos(node.angle), math.sin(node.yaw)),
)
"""The viewer of the front stands below what is seen from above, so that z, which points to the viewer, points down."""


@dataclass(frozen=True)
class _Place:
    """What stands in a panel: a shape, seen from somewhere, how much of the plane is in sight, over which columns."""

    report: ShapeReport
    view: FigureView
    frame: PanelFrame
    columns: range


def draw(reports: Sequence[ShapeReport], kind: str) -> bytes:
    """A figure of one shape, or a grid of several, as "svg", "png" or "pdf".

    Shapes are seen from the front and, if their rod leaves the plane, below that from above.
    """
    across = _across(reports)
    width = _panel_width(reports, across)
    rows = _rows(reports, across, LOWEST / width)
    with new_figure(width * across, START_HEIGHT, kind) as figure:
        figure.get_layout_engine().set(h_pad=ROW_GAP)  # type: ignore[union-attr, call-arg]
        grid = figure.add_gridspec(len(rows), across)
        panels = []
        for number, row in enumerate(rows):
            cells = [grid[number, place.columns.start : place.columns.stop] for place in row]
            panels.append([figure.add_subplot(cell) for cell in cells])
            for panel, place in zip(panels[-1], row, strict=True):
                _draw_place(panel, place, width)
        if len({report.scene.display.digest for report in reports}) == 1:
            _label_edges(panels, rows)
        draw_legend(figure, _legend(reports))
        fit_height(figure, panels)
        return bytes_of(figure, kind)


def _across(reports: Sequence[ShapeReport]) -> int:
    """How many of the shortest shapes stand side by side: about as many as below each other."""
    most = max(PANEL_WIDTHS)
    segments = [len(report.segments) for report in reports]
    count = segments.count(min(segments))
    return min(max(1, most // min(segments)), count if count < most else min(most, math.ceil(math.sqrt(count))))


def _panel_width(reports: Sequence[ShapeReport], across: int) -> float:
    """Of a panel [inch]."""
    segments = max(len(report.segments) for report in reports)
    return PANEL_WIDTHS[across] if across > 1 else min(WIDEST, max(WIDTH, PER_SEGMENT * segments))


def _rows(reports: Sequence[ShapeReport], across: int, least: float) -> list[list[_Place]]:
    """The panels row by row: those of a row are as high, at least `least` of a column; one display has one scale."""
    rows: list[list[_Place]] = []
    for some in _lines(reports, across):
        is_long = len(some) == 1 and len(some[0].segments) > min(len(report.segments) for report in reports)
        columns = [range(across)] if is_long else [range(number, number + 1) for number in range(len(some))]
        for view in (FRONT, ABOVE):
            shown = [(report, where) for report, where in zip(some, columns, strict=True) if _is_seen(report, view)]
            rows += [[_Place(report, view, _frame(report, view), where) for report, where in shown]] if shown else []
    places = [place for row in rows for place in row]
    return [_as_high([_on_scale(place, places) for place in row], least) for row in rows]


def _lines(reports: Sequence[ShapeReport], across: int) -> Iterator[Sequence[ShapeReport]]:
    """The shapes line by line, each that is longer than the shortest on a line of its own."""
    shortest = min(len(report.segments) for report in reports)
    for is_short, some in groupby(reports, lambda report: len(report.segments) == shortest):
        group, number = list(some), across if is_short else 1
        yield from (group[begin : begin + number] for begin in range(0, len(group), number))


def _on_scale(place: _Place, places: Sequence[_Place]) -> _Place:
    """A place with the frame that all of its display have, seen from where it is."""
    alike = [each.frame for each in places if each.view is place.view and _display_of(each) == _display_of(place)]
    return replace(place, frame=PanelFrame.over(alike))


def _display_of(place: _Place) -> str:
    return place.report.scene.display.digest


def _as_high(row: Sequence[_Place], least: float) -> list[_Place]:
    """Places with frames of one height, that of the highest, but at most as high as a column is wide."""
    height = max([least, *(place.frame.steepness * len(place.columns) for place in row)])
    steep = [min(1.0, height / len(place.columns)) for place in row]
    return [replace(place, frame=place.frame.within(each, each)) for place, each in zip(row, steep, strict=True)]


def _is_seen(report: ShapeReport, view: FigureView) -> bool:
    return view is FRONT or _is_deep(report)


def _is_deep(report: ShapeReport) -> bool:
    """True if a curve of a shape leaves the plane by more than it is known to."""
    return any(deepest(state) > state.error for segment in report.segments for state in segment.states)


def _frame(report: ShapeReport, view: FigureView) -> PanelFrame:
    """All that is drawn of a shape, with room around it."""
    span = to_mm(report.scene.display.span)
    places = [(index * span, to_mm(view.height(node))) for index, node in enumerate(report.scene.nodes)]
    for index, segment in enumerate(report.segments):
        for state in segment.states:
            places += view.of(report, index, state).tolist()
    return PanelFrame.around(places, ROOM * span)


def _draw_place(panel: Axes, place: _Place, width: float) -> None:
    """All states of a shape and the nodes that hold it, in a panel whose columns have a `width` [inch]."""
    report, view = place.report, place.view
    for index, segment in enumerate(report.segments):
        # What the display cannot show lies below, what is wanted on top.
        for state in sorted(segment.states, key=lambda state: (state.is_untangled, state.wanted)):
            curve = view.of(report, index, state)
            panel.plot(curve[:, 0], curve[:, 1], label=state.name, **_look(state))
    display = report.scene.display
    for index, node in enumerate(report.scene.nodes):
        draw_node(panel, (index * display.span, view.height(node)), view.tangent(node), clamp_shown(display))
    room = len(place.columns) * width - SIDE_ROOM
    panel.set_title(within(report.scene.name, room) if view is FRONT else "from above")
    dress(panel, view.label)
    place.frame.show_in(panel)
    if view is ABOVE:
        panel.invert_yaxis()


def _look(state: Equilibrium) -> dict[str, Any]:
    if not state.is_untangled:
        return dict(UNSHOWN_LOOK)
    return look_of(state.name, is_meant=bool(state.wanted), stays=bool(state.stable))


def _label_edges(panels: Sequence[Sequence[Axes]], rows: Sequence[Sequence[_Place]]) -> None:
    """Scales at the left and at the lowest panel of every column: those of one display are the same."""
    for number, (line, row) in enumerate(zip(panels, rows, strict=True)):
        below = {place.columns for lower in rows[number + 1 :] for place in lower}
        for panel, place in zip(line, row, strict=True):
            is_lowest, is_first = place.columns not in below, place is row[0]
            panel.tick_params(labelbottom=is_lowest, labelleft=is_first)
            panel.set_xlabel(X_LABEL if is_lowest else "")
            panel.set_ylabel(place.view.label if is_first else "")


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
