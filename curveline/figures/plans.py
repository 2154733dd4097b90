"""A plan laid out as a grid of panels: the start, then what steps move and the curve the rod takes by it.

After Fig. 5 of the paper, whose panels are annotated frames of a video; here the curves are those of the physics.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import count, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from curveline.displays.of_plan import display_of
from curveline.figures.common import (
    BEFORE_LOOK,
    BOLD_LETTERS,
    DARK,
    MOTION,
    THIN,
    X_LABEL,
    Y_LABEL,
    by_kind,
    bytes_of,
    draw_legend,
    draw_node,
    dress,
    kind_of,
    legend_entry,
    look_of,
    new_figure,
    within,
)
from curveline.plan_file import NodeTarget, Plan, Step
from curveline.replay.plan_animation import Still, stills
from curveline.scene import Display
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
LISTED = 5
"""Values that a caption lists; of more it says from where to where they go."""
TOLD = 12
"""States that a caption lists; more are counted."""


@dataclass(frozen=True)
class Panel:
    """What a panel shows: heading, the display after a `number` of steps and before the last, what moved from where."""

    heading: str
    number: int
    after: Still
    before: Still | None = None
    moved: tuple[tuple[NodeTarget, NodeTarget], ...] = ()


def parts_of(plan: Plan) -> int:
    """How many parts `draw` reports at most: every panel is filled, and drawn to be measured and for good."""
    return 3 * len(_chosen(plan))


def draw(
    plan: Plan, display: Display | None = None, heard: Callable[[int], None] = lambda _: None, *, kind: str
) -> bytes:
    """A figure of a plan's steps, "svg", "png" or "pdf", all to one scale; MissingExtra without matplotlib.

    A step in which nothing moves has no panel. Of more than `MOST_PANELS` those that complete a shape are shown first,
    and the figure says so. `heard` is told how many of `parts_of` parts are done. Without a
    `display` it is the plan's, as its file says now.
    """
    display = display or display_of(plan)
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
            _draw_panel(place, panels[index], display)
            heard(next(done))
            _when_drawn(place, lambda: heard(next(done)))
        _dress_edges(axes, across, len(chosen))
        figure.suptitle(_title(plan, width * across, len(chosen)), fontweight="bold")
        _draw_legend(figure, [panels[index] for index in chosen])
        return bytes_of(figure, kind)


def _moving(plan: Plan) -> list[int]:
    """The steps of a plan in which something moves, by index."""
    targets = [plan.start, *(step.targets for step in plan.steps)]
    counts = [tuple(target.counts for target in each) for each in targets]
    return [index for index, (old, new) in enumerate(pairwise(counts)) if old != new]


def _chosen(plan: Plan) -> list[int]:
    """The panels of a plan that are drawn, by number: 0 is the start."""
    complete = [number for number, shape in enumerate(_completed(plan)) if shape]
    return chosen_of(len(_moving(plan)) + 1, complete)


def _completed(plan: Plan) -> list[str]:
    """What is complete in each panel, shapes and their states by lines; also by steps after it that move nothing."""
    moving = _moving(plan)
    lines: list[list[str]] = [[] for _ in range(len(moving) + 1)]
    for index, step in enumerate(plan.steps):
        if step.shape or step is plan.steps[-1]:
            lines[bisect_right(moving, index)].append(f"{step.shape or plan.name}: {told(step.states)}")
    # A shape that is asked for twice running is complete once.
    return ["\n".join(dict.fromkeys(each)) for each in lines]


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
    """The start, then a panel for every step in which something moves."""
    targets = [plan.start, *(step.targets for step in plan.steps)]
    complete = [f"\n{lines}" if lines else "" for lines in _completed(plan)]
    panels = [Panel(f"start\n{_where(plan.start, plan)}{complete[0]}", 0, pictures[0])]
    for index, lines in zip(_moving(plan), complete[1:], strict=True):
        step, old, new = plan.steps[index], targets[index], targets[index + 1]
        heading = f"{step.number} {step.action}, {step.seconds:.1f} s\n{_what_moves(step, old, new)}{lines}"
        moved = tuple(zip(old, new, strict=True))
        panels.append(Panel(heading, index + 1, pictures[index + 1], pictures[index], moved))
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
    return "\n".join(parts)


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


def _draw_panel(place: Axes, panel: Panel, display: Display) -> None:
    """Rod and nodes after a step, faintly where they were before it, and arrows from there to here."""
    place.set_title(panel.heading, loc="left", fontsize=8.0)
    if panel.before is not None:
        for index, curves in enumerate(panel.before.curves):
            for name, curve in curves.items():
                place.plot(*_in_mm(curve).T, **BEFORE_LOOK, gid=f"before-{panel.number}-{index + 1}-{name}")
    for index, curves in enumerate(panel.after.curves):
        for name, curve in curves.items():
            look = look_of(name, is_meant=len(curves) == 1)
            place.plot(*_in_mm(curve).T, **look, gid=f"after-{panel.number}-{index + 1}-{name}")
    for index, node in enumerate(panel.after.nodes):
        pivot = (index * display.span, node.height)
        draw_node(place, pivot, (math.cos(node.angle), math.sin(node.angle)), BEARING * display.span)
    for index, (old, new) in enumerate(panel.moved):
        _draw_moves(place, display, index, (old, new))
    place.set_aspect("equal")
    dress(place, Y_LABEL)


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
    place.add_patch(FancyArrowPatch(path=Path(np.asarray(points)), color=MOTION, zorder=6, **style))


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
    moving = len(_moving(plan))
    still = len(plan.steps) - moving
    parts = [f"{len(plan.steps)} steps, {plan.seconds:.1f} s"]
    parts += [f"in {still} of them nothing moves"] if still else []
    parts += [f"{shown - 1} of the {'others' if still else 'steps'} are shown"] if shown <= moving else []
    return f"{within(plan.name, width, BOLD_LETTERS)}\n{'; '.join(parts)}"


def _draw_legend(figure: Figure, panels: Sequence[Panel]) -> None:
    """One legend below all panels."""
    kinds = {kind_of(name) for panel in panels for curves in panel.after.curves for name in curves}
    entries = [legend_entry(kind, **look_of(kind, is_meant=True)) for kind in by_kind(kinds)]
    if any(len(curves) > 1 for panel in panels for curves in panel.after.curves):
        entries.append(legend_entry("thin: in one of them", linewidth=THIN, color=DARK))
    entries.append(legend_entry("before the step", **BEFORE_LOOK))
    entries.append(legend_entry("what moves", linewidth=1.1, color=MOTION))
    draw_legend(figure, entries)
