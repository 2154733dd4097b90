"""A plan as a film: the nodes move as their motors do, and the rod follows, buckles and snaps by its physics."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from curveline.figures.common import (
    BEFORE_LOOK,
    BOLD_LETTERS,
    COLOURS,
    GREY,
    HUB,
    OTHER,
    THICK,
    Y_LABEL,
    by_kind,
    colour_of,
    draw_legend,
    dress,
    kind_of,
    legend_entry,
    look_of,
    new_figure,
    within,
)
from curveline.figures.film import Film
from curveline.figures.plans import ABOVE, BEARING, BESIDE, told
from curveline.plan_file import Plan
from curveline.replay.plan_animation import Course, Moment, moment_count, play
from curveline.replay.playback import Snap
from curveline.scene import Display
from curveline.simulation.results import Array
from curveline.units import to_mm, to_ms

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FRAMES_PER_SECOND = 10
LONGEST_S = 30.0
"""A film that would take longer runs faster than the display, at the least of these speeds."""
SPEEDS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)
FIRST_MS, LAST_MS = 800, 2500
"""How much longer than the others the first and the last frame stay."""
TICK_MS = 10
"""A GIF counts time in these."""
ECHO = 6
"""Frames for which a curve that the rod snapped out of stays in sight."""
NARROW, PER_SEGMENT, WIDE = 5.2, 1.2, 10.4  # [inch] of a film: for no segment, for each more, at most of few
LEAST_PER_SEGMENT = 0.3  # [inch] for each of many
SIDE_ROOM = 0.7  # [inch] of its width for labels
TEXT_ROOM = 1.55  # [inch] of its height for headings, labels and legend


def speed_of(plan: Plan) -> float:
    """How much faster than the display a film of `plan` runs."""
    return next((speed for speed in SPEEDS if plan.seconds <= LONGEST_S * speed), SPEEDS[-1])


def parts_of(plan: Plan) -> int:
    """How many parts `animate` reports: every frame is played and drawn."""
    return 2 * moment_count(plan, speed_of(plan) / FRAMES_PER_SECOND)


def animate(plan: Plan, display: Display, heard: Callable[[int], None] = lambda _: None) -> bytes:
    """A GIF of `plan` being carried out from its start, steps in proportion to their time; MissingExtra as figures.

    `heard` is told how many of `parts_of` parts are done.
    """
    speed = speed_of(plan)
    course = play(plan, display, speed / FRAMES_PER_SECOND, heard)
    count = len(course.moments)
    (left, right), (low, high) = _frame(course, display)
    segments = len(plan.wanted)
    width = max(min(WIDE, NARROW + PER_SEGMENT * segments), LEAST_PER_SEGMENT * segments)
    height = (width - SIDE_ROOM) * (high - low) / (right - left) + TEXT_ROOM
    with new_figure(width, height, "gif") as figure:
        panel = figure.subplots()
        panel.set(xlim=(left, right), ylim=(low, high), aspect="equal")
        dress(panel, Y_LABEL)
        figure.suptitle(within(plan.name, width, BOLD_LETTERS), fontweight="bold")
        stage = _Stage(panel, plan, display)
        _draw_legend(figure, course)
        film = Film(figure, stage.moving, [GREY, OTHER, *COLOURS.values()])
        for index, duration_ms in enumerate(_durations_ms(course, speed)):
            stage.show(course, index)
            film.shoot(duration_ms)
            heard(count + index + 1)
        return film.gif()


class _Stage:
    """What moves in a film: bearings, pivots, curves, the curve just left, two headings."""

    def __init__(self, panel: Axes, plan: Plan, display: Display) -> None:
        self._plan = plan
        self._display = display
        places = to_mm(display.span) * np.arange(display.node_count)
        for place in places:
            panel.axvline(place, color="#dddddd", linewidth=2.0, zorder=0.5)
        self._echoes = [panel.plot([], [], **BEFORE_LOOK)[0] for _ in plan.wanted]
        self._curves = [panel.plot([], [], linewidth=THICK)[0] for _ in plan.wanted]
        (self._bearings,) = panel.plot([], [], color=GREY, linewidth=6.0, solid_capstyle="butt")
        (self._hubs,) = panel.plot([], [], **HUB)
        self._heading = panel.set_title(" \n ", loc="left")
        self._clock = panel.set_title(" ", loc="right")
        self.moving = [self._bearings, *self._echoes, *self._curves, self._hubs, self._heading, self._clock]

    def show(self, course: Course, index: int) -> None:
        """Bring everything to a moment."""
        moment = course.moments[index]
        for line, curve, state in zip(self._curves, moment.curves, moment.states, strict=True):
            line.set_data(*to_mm(1.0) * curve.T)
            line.set_color(colour_of(state))
        for line in self._echoes:
            line.set_data([], [])
        recent = _recent(course, index)
        for snap, left in recent:
            self._echoes[snap.segment - 1].set_data(*to_mm(1.0) * left.T)
        self._show_nodes(moment)
        self._heading.set_text(f"{self._heading_at(course, index)}\n{_told(recent)}")
        speed = speed_of(self._plan)
        self._clock.set_text(f"{moment.seconds:.1f} s\n{f'{speed:g} times faster' if speed > 1.0 else ' '}")

    def _show_nodes(self, moment: Moment) -> None:
        pivots = np.array([(index * self._display.span, node.height) for index, node in enumerate(moment.nodes)])
        tangents = np.array([(math.cos(node.angle), math.sin(node.angle)) for node in moment.nodes])
        reach = 0.5 * BEARING * self._display.span * tangents
        gaps = np.full_like(pivots, np.nan)
        bars = np.stack([pivots - reach, pivots + reach, gaps], axis=1).reshape(-1, 2)
        self._bearings.set_data(*to_mm(1.0) * bars.T)
        self._hubs.set_data(*to_mm(1.0) * pivots.T)

    def _heading_at(self, course: Course, index: int) -> str:
        moment = course.moments[index]
        if index == len(course.moments) - 1:
            shape = self._plan.steps[-1].shape if self._plan.steps else ""
            return f"{shape or self._plan.name}: {told(moment.states)}"
        if moment.step == 0:
            return "start"
        step = next(step for step in self._plan.steps if step.number == moment.step)
        return f"step {step.number} of {len(self._plan.steps)}: {step.action}"


def _recent(course: Course, index: int) -> list[tuple[Snap, Array]]:
    """The snaps of the last `ECHO` frames, each with the curve that the rod had before; none in the last frame."""
    found: list[tuple[Snap, Array]] = []
    if index == len(course.moments) - 1:
        return found
    for back in range(max(1, index - ECHO + 1), index + 1):
        seconds = course.moments[back].seconds
        curves = course.moments[back - 1].curves
        found += [(snap, curves[snap.segment - 1]) for snap in course.snaps if snap.seconds == seconds]
    return found


def _told(snaps: Sequence[tuple[Snap, Array]]) -> str:
    """The latest snaps as text."""
    if not snaps:
        return " "
    latest = snaps[-1][0]
    numbers = [str(snap.segment) for snap, _ in snaps if (snap.before, snap.after) == (latest.before, latest.after)]
    who = f"segment {numbers[0]} snaps" if len(numbers) == 1 else f"segments {', '.join(numbers)} snap"
    return f"{who} from {latest.before} to {latest.after}"


def _frame(course: Course, display: Display) -> tuple[tuple[float, float], tuple[float, float]]:
    """Limits of x and y [mm] that every moment has room in."""
    span = to_mm(display.span)
    heights = [to_mm(node.height) for moment in course.moments for node in moment.nodes]
    for moment in course.moments:
        for curve in moment.curves:
            heights += [to_mm(float(height)) for height in curve[:, 1]]
    low, high = min(heights) - ABOVE * span, max(heights) + ABOVE * span
    return (-BESIDE * span, (display.node_count - 1 + BESIDE) * span), (low, high)


def _durations_ms(course: Course, speed: float) -> list[int]:
    """How long every frame stays: until the next moment, on a clock that is rounded but loses nothing."""
    clock = [TICK_MS * round(to_ms(moment.seconds) / speed / TICK_MS) for moment in course.moments]
    durations = [after - before for before, after in pairwise(clock)]
    return [FIRST_MS + durations[0], *durations[1:], LAST_MS] if durations else [LAST_MS]


def _draw_legend(figure: Figure, course: Course) -> None:
    """The kinds of all states that the rod is in on its way, and what it left."""
    kinds = {kind_of(state) for moment in course.moments for state in moment.states}
    entries = [legend_entry(kind, **look_of(kind, is_meant=True)) for kind in by_kind(kinds)]
    if course.snaps:
        entries.append(legend_entry("before it snapped", **BEFORE_LOOK))
    draw_legend(figure, entries)
