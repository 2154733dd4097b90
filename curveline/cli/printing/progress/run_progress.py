"""News of a running send: a live table on a terminal, plain lines elsewhere; always on stderr."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from curveline.cli.printing import screen, terminal
from curveline.plan_file import Plan
from curveline.radio.host.link import Control, OperatorRequest, Progress

REDRAW_SECONDS = 0.1
BAR = 20
MOST_BARS = 16
"""Nodes that are shown, those first which have most of their way before them: more would not fit a terminal."""
WISHES = {
    OperatorRequest.PAUSE: "pausing at the barrier; Ctrl-C again holds at once",
    OperatorRequest.HOLD: "holding; Ctrl-C again is an emergency stop",
    OperatorRequest.ESTOP: "emergency stop",
}


@contextmanager
def watch(plan: Plan, control: Control) -> Iterator[Callable[[Progress], None]]:
    """An observer for a send of `plan` that shows what it is told."""
    if not terminal.is_live(sys.stderr):
        yield Lines(plan, control)
        return
    view = Picture(plan, control, terminal.draw)
    try:
        yield view
    finally:
        view.finish()
        terminal.keep()


class Lines:
    """One line whenever a step begins or the operator asks for something."""

    def __init__(self, plan: Plan, control: Control) -> None:
        self._plan = plan
        self._control = control
        self._told: tuple[int, OperatorRequest] = (0, OperatorRequest.NONE)

    def __call__(self, news: Progress) -> None:
        """News of a node."""
        step, wish = self._told
        asked = self._control.request  # a signal may change it while a line is written, and is told of next time
        if asked is not wish:
            screen.note(f"{news.seconds:7.1f} s  {WISHES[asked]}")
        if news.status.started >= news.step > step:
            step = news.step
            screen.note(f"{news.seconds:7.1f} s  step {step} of {news.steps}: {self._plan.steps[step - 1].action}")
        self._told = (step, asked)


class Picture:
    """A few lines that are drawn over: the step, a bar per node, and what the operator asked for."""

    def __init__(self, plan: Plan, control: Control, draw: Callable[[str], Any]) -> None:
        self._plan = plan
        self._control = control
        self._draw = draw
        self._news: dict[int, Progress] = {}
        self._drawn = 0.0

    def __call__(self, news: Progress) -> None:
        """News of a node."""
        self._news[news.status.node] = news
        if time.monotonic() - self._drawn > REDRAW_SECONDS:
            self._drawn = time.monotonic()
            keys = WISHES.get(self._control.request, "Ctrl-C pauses at the barrier")
            self._draw("\n".join([*self._lines(), keys]))

    def finish(self) -> None:
        """Leave the last news on the screen."""
        self._draw("\n".join(self._lines()))

    def _lines(self) -> list[str]:
        if not self._news:
            return []
        newest = max(self._news.values(), key=lambda news: news.seconds)
        action = self._plan.steps[newest.step - 1].action
        head = f"{newest.seconds:.1f} s  step {newest.step} of {newest.steps}: {action}  ({newest.phase.value})"
        behind = sorted(self._news.values(), key=lambda news: news.fraction)[:MOST_BARS]
        rest = len(self._news) - len(behind)
        more = [f"  {rest} more node{'s' if rest > 1 else ''}, none of them behind these"] if rest else []
        return [head, *map(_bar, sorted(behind, key=lambda news: news.status.node)), *more]


def _bar(news: Progress) -> str:
    """One node's progress through the present step."""
    full = round(BAR * news.fraction)
    bar = "#" * full + "." * (BAR - full)
    lost = f"  lost {news.status.link.lost} of {news.status.link.polls}"
    fault = f"  {news.status.fault}" if news.status.fault else ""
    return f"  node {news.status.node:<3} [{bar}] {100 * news.fraction:3.0f} %  {news.status.state}{lost}{fault}"
