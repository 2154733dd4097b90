"""A plan laid out as a grid of panels: the start, then what every step moves and the curve the rod takes by it.

After Fig. 5 of the paper, whose panels are annotated frames of a video; here the curves are those of the physics.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import count, pairwise
from textwrap import shorten
from typing import TYPE_CHECKING, Any

import numpy as np

from curveline.displays.of_plan import display_of
from curveline.figures.common import (
    COLOURS,
    DARK,
    GREY,
    OTHER,
    THICK,
    THIN,
    X_LABEL,
    Y_LABEL,
    bytes_of,
    draw_node,
    dress,
    new_figure,
)
from curveline.plan_file import NodeTarget, Plan, Step
from curveline.replay.plan_animation import Still, stills
from curveline.scene import PEAK, STRAIGHT, VALLEY, Display
from curveline.simulation.results import Array
from curveline.units import deg, to_mm

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_PANELS = 24
"""A longer plan is not shown whole: its figure would be a roll of paper."""
PANEL_WIDTHS = {1: 3.3, 2: 4.4, 3: 4.8, 4: 5.4}  # [inch] by the number of segments
WIDE, PER_SEGMENT = 9.6, 0.6  # [inch] of a panel of more segments: at least, and for each of them
ROW_WIDTH = 11.0  # [inch] that panels side by side may take
LINE_HEIGHT = 0.17  # [inch] of a line of text over a panel
FRAME_ROOM = 0.2  # [inch] between rows
EDGE_ROOM = 1.2  # [inch] of the figure's height for its title, its legend and the lowest labels
SIDE_ROOM = 0.45  # [inch] of a panel's width for labels and for the gap to the next
BESIDE = 0.22
"""Room beside the outer nodes, as a part of the span between nodes: their arrows stand there."""
ABOVE = 0.08
"""Room above and below all curves, as a part of the span."""
BEARING = 0.1
"""Length of a bearing as it is drawn, as a part of the span: true to scale it would vanish behind its pivot."""
RADIUS = 0.14
"""Of the arrow that shows a bias about its pivot, as a part of the span."""
FEED_FROM, FEED_TO, FEED_ASIDE = 0.2, 0.08, 0.075
"""Where the arrow that shows a feed begins and ends along the rod, and how far aside of it, as parts of the span."""
FEW, LARGER = 3, 1.4
"""Displays of more nodes are drawn smaller, so that their arrows must be larger parts of the span."""
HUB = 0.03
"""An arrow up or down a rail ends that much before the pivot, as a part of the span."""
ARROW = "#8A2BE2"
FAINT: dict[str, Any] = {"color": GREY, "alpha": 0.55}
LISTED = 5
"""Values that a caption lists; of more it says from where to where they go."""
LETTERS = 10.0
"""Letters of a title to the inch."""
TOLD = 12
"""States that a caption lists; more are counted."""


@dataclass(frozen=True)
class Panel:
    """What a panel shows: its heading, the display after the step and before, and which nodes moved from where."""

    heading: str
    after: Still
    before: Still | None = None
    moved: tuple[tuple[NodeTarget, NodeTarget], ...] = ()


def parts_of(plan: Plan) -> int:
    """How many parts `draw_plan` reports at most: every panel is filled, and drawn to be measured and for good."""
    return 3 * len(_chosen(plan))


def draw(plan: Plan, kind: str) -> bytes:
    """As `draw_plan`, on the display as its file says now; InvalidInput if that says nothing of use."""
    return draw_plan(plan, display_of(plan), kind=kind)


def draw_plan(plan: Plan, display: Display, heard: Callable[[int], None] = lambda _: None, *, kind: str) -> bytes:
    """A figure of a plan's steps, "svg", "png" or "pdf", all to one scale; MissingExtra without matplotlib.

    Of a plan with more steps than `MOST_PANELS` those that complete a shape are shown first, and the figure says so.
    `heard` is told how many of `parts_of` parts are done.
    """
    panels, chosen = _panels(plan, stills(plan, display)), _chosen(plan)
    width = PANEL_WIDTHS.get(len(plan.wanted), max(WIDE, PER_SEGMENT * len(plan.wanted)))
    across = min(max(1, int(ROW_WIDTH / width)), len(chosen))
    (left, right), (low, high) = _frame(panels, display)
    steepness = (high - low) / (right - left)
    lines = [max(panels[index].heading.count("\n") + 1 for index in row) for row in _rows(chosen, across)]
    heights = [(width - SIDE_ROOM) * steepness + number * LINE_HEIGHT + FRAME_ROOM for number in lines]
    with new_figure(width * across, sum(heights) + EDGE_ROOM, kind) as figure:
        rows = figure.subplots(len(heights), across, squeeze=False, sharex=True, sharey=True, height_ratios=heights)
        axes = list(rows.flatten())
        axes[0].set(xlim=(left, right), ylim=(low, high))
        done = count(1)
        for place, index in zip(axes, chosen, strict=False):
            _draw_panel(place, panels[index], display, index)
            heard(next(done))
            _when_drawn(place, lambda: heard(next(done)))
        _dress_edges(axes, across, len(chosen))
        figure.suptitle(_title(plan, width * across, len(chosen)), fontweight="bold")
        _draw_legend(figure, [panels[index] for index in chosen])
        return bytes_of(figure, kind)


def _chosen(plan: Plan) -> list[int]:
    """The panels of a plan that are drawn, by number: 0 is the start."""
    return chosen_of(len(plan.steps) + 1, [index for index, step in enumerate(plan.steps, start=1) if step.shape])


def chosen_of(panels: int, complete: Sequence[int] = ()) -> list[int]:
    """Which of so many `panels` are drawn: all, or `MOST_PANELS` of them.

    The first, the last and those of `complete` shapes come before others; what is left out is spread evenly.
    """
    if panels <= MOST_PANELS:
        return list(range(panels))
    first = sorted({0, *complete, panels - 1})
    if len(first) >= MOST_PANELS:
        return _spread(first, MOST_PANELS)
    others = sorted(set(range(panels)) - set(first))
    return sorted([*first, *_spread(others, MOST_PANELS - len(first))])


def _spread(items: Sequence[int], number: int) -> list[int]:
    """`number` of the items, evenly, the first and the last among them."""
    return [items[round(place * (len(items) - 1) / max(1, number - 1))] for place in range(number)]


def _rows(chosen: Sequence[int], across: int) -> list[Sequence[int]]:
    return [chosen[begin : begin + across] for begin in range(0, len(chosen), across)]


def _panels(plan: Plan, pictures: Sequence[Still]) -> list[Panel]:
    """The start, then a panel for every step."""
    panels = [Panel(f"start\n{_where(plan.start, plan)}", pictures[0])]
    targets = [plan.start, *(step.targets for step in plan.steps)]
    for step, (old, new), (before, after) in zip(plan.steps, pairwise(targets), pairwise(pictures), strict=True):
        heading = f"{step.number} {step.action}, {step.seconds:.1f} s\n{_what_moves(step, old, new)}"
        if step.shape or step is plan.steps[-1]:
            heading += f"\n{step.shape or plan.name}: {told(step.states)}"
        panels.append(Panel(heading, after, before, tuple(zip(old, new, strict=True))))
    return panels


def _where(start: Sequence[NodeTarget], plan: Plan) -> str:
    """Where the nodes stand before the first step."""
    if not any(any(target.counts) for target in start):
        return "home"
    return f"bias {_listed([target.bias_deg for target in start])} deg"


def _what_moves(step: Step, old: Sequence[NodeTarget], new: Sequence[NodeTarget]) -> str:
    """Where the step brings what it moves."""
    parts = []
    if any(a.counts[0] != b.counts[0] for a, b in zip(old, new, strict=True)):
        parts.append(f"rod {_listed(step.lengths_mm)} mm")
    if any(a.counts[1] != b.counts[1] for a, b in zip(old, new, strict=True)):
        parts.append(f"bias {_listed([target.bias_deg for target in new])} deg")
    if any(a.counts[2] != b.counts[2] for a, b in zip(old, new, strict=True)):
        parts.append(f"height {_listed([target.translate_mm for target in new])} mm")
    return "\n".join(parts) or "nothing moves"


def _listed(values: Sequence[float]) -> str:
    """Values to a tenth: one if they are all the same, else all, or the range of many."""
    texts = [_number(value) for value in values]
    if len(set(texts)) == 1:
        return texts[0]
    if len(texts) <= LISTED:
        return ", ".join(texts)
    return f"{_number(min(values))} to {_number(max(values))}"


def told(states: Sequence[str]) -> str:
    """The states of a row of segments as text: one by one, or counted where they are many."""
    if len(states) <= TOLD:
        return ", ".join(states)
    return ", ".join(f"{number} times {name}" for name, number in Counter(states).items())


def _number(value: float) -> str:
    return f"{round(value, 1) + 0.0:g}".replace("-", "\N{MINUS SIGN}")


def _frame(panels: Sequence[Panel], display: Display) -> tuple[tuple[float, float], tuple[float, float]]:
    """Limits of x and y [mm] that all panels have room in."""
    span = to_mm(display.span)
    heights = [to_mm(node.height) for panel in panels for node in panel.after.nodes]
    for panel in panels:
        for curves in panel.after.curves:
            heights += [to_mm(float(extreme(curve[:, 1]))) for curve in curves.values() for extreme in (np.min, np.max)]
    low, high = min(heights) - ABOVE * span, max(heights) + ABOVE * span
    beside = BESIDE * _enlarged(display)
    return (-beside * span, (display.node_count - 1 + beside) * span), (low, high)


def _enlarged(display: Display) -> float:
    """How much larger than said, as parts of the span, the arrows of a display are."""
    return 1.0 if display.node_count <= FEW else LARGER


def _draw_panel(place: Axes, panel: Panel, display: Display, number: int) -> None:
    """Rod and nodes after a step, faintly where they were before it, and arrows from there to here."""
    place.set_title(panel.heading, loc="left", fontsize=8.0)
    if panel.before is not None:
        for index, curves in enumerate(panel.before.curves):
            for name, curve in curves.items():
                place.plot(*_in_mm(curve).T, linewidth=THIN, **FAINT, gid=f"before-{number}-{index + 1}-{name}")
    for index, curves in enumerate(panel.after.curves):
        for name, curve in curves.items():
            look = _look_of(name, certain=len(curves) == 1)
            place.plot(*_in_mm(curve).T, **look, gid=f"after-{number}-{index + 1}-{name}")
    for index, node in enumerate(panel.after.nodes):
        pivot = (index * display.span, node.height)
        draw_node(place, pivot, (math.cos(node.angle), math.sin(node.angle)), BEARING * display.span)
    for index, (old, new) in enumerate(panel.moved):
        _draw_moves(place, display, index, (old, new))
    place.set_aspect("equal")
    dress(place, Y_LABEL)


def colour_of(name: str) -> str:
    """The colour of a state's curve."""
    return COLOURS.get(name, DARK if name == STRAIGHT else OTHER)


def _look_of(name: str, *, certain: bool) -> dict[str, Any]:
    """How the curve of a state is drawn: thin and dashed where it is one of several that the rod may be in."""
    style = "-" if certain else (0, (4, 2))
    return {"color": colour_of(name), "linewidth": THICK if certain else THIN, "linestyle": style}


def _draw_moves(place: Axes, display: Display, index: int, ways: tuple[NodeTarget, NodeTarget]) -> None:
    """Arrows for what one node does: its feed along the rod, its bias about the pivot, its way up or down the rail."""
    old, new = ways
    x, y = to_mm(index * display.span), new.translate_mm
    span = to_mm(display.span) * _enlarged(display)
    is_last = index == display.node_count - 1
    outwards = 1.0 if is_last else -1.0
    angle = deg(new.bias_deg)
    if old.counts[2] != new.counts[2]:
        way = new.translate_mm - old.translate_mm
        end = new.translate_mm - math.copysign(min(HUB * span, 0.5 * abs(way)), way)
        _arrow(place, [(x, old.translate_mm), (x, end)])
    if old.counts[0] != new.counts[0]:
        along, across = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
        aside = 0.0 if index == 0 or is_last else FEED_ASIDE
        ends = [np.array([x, y]) + span * (outwards * part * along + aside * across) for part in (FEED_FROM, FEED_TO)]
        # What a node feeds counts to the right, whichever side of the rod it comes from.
        to_right = new.extrude_mm > old.extrude_mm
        starts_right = ends[0] @ along > ends[1] @ along
        _arrow(place, ends[::-1] if to_right == starts_right else ends)
    if old.counts[1] != new.counts[1]:
        sweep = np.linspace(deg(old.bias_deg), angle, 24)
        arm = outwards * RADIUS * span
        arc = np.column_stack([x + arm * np.cos(sweep), y + arm * np.sin(sweep)])
        _arrow(place, arc)


def _arrow(place: Axes, points: Sequence[Any] | Array) -> None:
    """An arrow along a line of points [mm]."""
    from matplotlib.patches import FancyArrowPatch
    from matplotlib.path import Path

    style: dict[str, Any] = {"arrowstyle": "-|>", "mutation_scale": 7.0, "linewidth": 1.1, "shrinkA": 0, "shrinkB": 0}
    place.add_patch(FancyArrowPatch(path=Path(np.asarray(points)), color=ARROW, zorder=6, **style))


def _when_drawn(place: Axes, tell: Callable[[], None]) -> None:
    """Have it told when a panel comes to be drawn, which is long after it was filled."""
    from matplotlib.artist import Artist

    class Herald(Artist):
        def draw(self, renderer: Any) -> None:
            tell()

    herald = Herald()
    herald.set_in_layout(False)
    place.add_artist(herald)


def _in_mm(curve: Array) -> Array:
    return to_mm(1.0) * curve


def _dress_edges(places: Sequence[Axes], across: int, shown: int) -> None:
    """Labels at the left and at the lowest panel of every column; no panel where there is no step."""
    for place in places[shown:]:
        place.set_axis_off()
    for number, place in enumerate(places[:shown]):
        is_lowest = number + across >= shown
        place.tick_params(labelbottom=is_lowest)
        place.set_xlabel(X_LABEL if is_lowest else "")
        place.set_ylabel(Y_LABEL if number % across == 0 else "")


def _title(plan: Plan, width: float, shown: int) -> str:
    """Name, length and time of a plan, and how much of it is shown, on a figure of `width` [inch]."""
    length = f"{len(plan.steps)} steps, {plan.seconds:.1f} s"
    part = "" if shown == len(plan.steps) + 1 else f"; {shown - 1} of the steps are shown"
    return f"{within(plan.name, width)}\n{length}{part}"


def within(name: str, width: float) -> str:
    """A name as a title of a figure of `width` [inch], shortened if it must be: that of a tour names all its shapes."""
    return shorten(name, max(8, int(LETTERS * width)), placeholder=" ...")


def _draw_legend(figure: Figure, panels: Sequence[Panel]) -> None:
    """One legend below all panels."""
    from matplotlib.lines import Line2D

    names = {name for panel in panels for curves in panel.after.curves for name in curves}
    order = sorted(names, key=lambda name: ((PEAK, VALLEY, name).index(name), name))
    handles = [Line2D([], [], label=name, **_look_of(name, certain=True)) for name in order]
    if any(len(curves) > 1 for panel in panels for curves in panel.after.curves):
        handles.append(Line2D([], [], label="dashed: either", **{**_look_of("", certain=False), "color": DARK}))
    handles.append(Line2D([], [], label="before the step", linewidth=THIN, **FAINT))
    handles.append(Line2D([], [], label="what moves", linewidth=1.1, color=ARROW))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False)
