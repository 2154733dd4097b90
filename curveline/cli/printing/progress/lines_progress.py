"""News of several lines on their way: a row per line on a terminal, plain lines elsewhere; always on stderr."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from curveline.cli.printing import screen, terminal
from curveline.cli.printing.progress.run_progress import REDRAW_SECONDS, WISHES
from curveline.driving.run_listener import LineObserver
from curveline.plan_file import Plan
from curveline.radio.host.actions import Phase
from curveline.radio.host.link import Control, OperatorRequest, Progress

BAR = 16
"""So that the longest name and a fault have room in 80 columns."""
NAME = 24
"""Columns that a name takes at most."""
WORDS = {
    Phase.DISCOVER: "is asked",
    Phase.PREFLIGHT: "is ready",
    Phase.STAGING: "waits",
    Phase.RELEASED: "moves",
    Phase.CLOSING: "done",
    Phase.DONE: "done",
    Phase.PAUSING: "holds",
    Phase.PAUSED: "holds",
    Phase.HALTING: "halted",
    Phase.HALTED: "halted",
}
"""What a line does in a phase; it waits for its nodes to take their targets, or for its turn."""


@contextmanager
def watch_lines(plans: Mapping[str, Plan], control: Control) -> Iterator[LineObserver]:
    """An observer for a send of some plans, by the names of their lines, that shows what it is told."""
    if not terminal.is_live(sys.stderr):
        yield LinesInWords(plans, control)
        return
    view = LinesPicture(plans, control, terminal.draw)
    try:
        yield view
    finally:
        view.finish()
        terminal.keep()


class LinesInWords:
    """A sentence whenever a step of a line begins or the operator asks for something."""

    def __init__(self, plans: Mapping[str, Plan], control: Control) -> None:
        self._plans = plans
        self._control = control
        self._steps = dict.fromkeys(plans, 0)
        self._wish = OperatorRequest.NONE
        self._lock = threading.Lock()

    def __call__(self, line: str, news: Progress) -> None:
        """News of a node of a line."""
        with self._lock:
            asked = self._control.request
            if asked is not self._wish:
                self._wish = asked
                screen.note(f"{news.seconds:7.1f} s  {WISHES[asked]}")
            if news.status.started >= news.step > self._steps[line]:
                self._steps[line] = news.step
                action = self._plans[line].steps[news.step - 1].action
                screen.note(f"{news.seconds:7.1f} s  line {line}: step {news.step} of {news.steps}: {action}")


@dataclass
class _LineNews:
    """What is known of a line: news of its nodes, the newest last."""

    plan: Plan
    nodes: dict[int, Progress] = field(default_factory=dict)

    @property
    def newest(self) -> Progress | None:
        return max(self.nodes.values(), key=lambda news: news.seconds, default=None)

    @property
    def fraction(self) -> float:
        """How much of the whole plan the nodes have behind them; in a step that of the one that is ahead."""
        newest = self.newest
        if newest is None:
            return 0.0
        if newest.phase in (Phase.CLOSING, Phase.DONE):
            return 1.0
        here = max((news.fraction for news in self.nodes.values() if news.step == newest.step), default=0.0)
        is_done = newest.phase is not Phase.RELEASED and newest.status.started < newest.step
        return (newest.step - 1 + (0.0 if is_done else here)) / newest.steps


class LinesPicture:
    """A row per line that is drawn over: how far it is, what it does, and what the operator asked for."""

    def __init__(self, plans: Mapping[str, Plan], control: Control, draw: Callable[[str], Any]) -> None:
        self._rows = {name: _LineNews(plan) for name, plan in plans.items()}
        self._wide = min(NAME, max(map(len, plans)))
        self._control = control
        self._draw = draw
        self._drawn = 0.0
        self._lock = threading.Lock()

    def __call__(self, line: str, news: Progress) -> None:
        """News of a node of a line."""
        with self._lock:
            self._rows[line].nodes[news.status.node] = news
            if time.monotonic() - self._drawn > REDRAW_SECONDS:
                self._drawn = time.monotonic()
                keys = WISHES.get(self._control.request, "Ctrl-C pauses at the barriers")
                self._draw("\n".join([*self._lines(), keys]))

    def finish(self) -> None:
        """Leave the last news on the screen."""
        with self._lock:
            self._draw("\n".join(self._lines()))

    def _lines(self) -> list[str]:
        news = [newest for row in self._rows.values() if (newest := row.newest) is not None]
        seconds = max((each.seconds for each in news), default=0.0)
        moving = sum(each.phase is Phase.RELEASED for each in news)
        head = f"{seconds:.1f} s  {moving} of {len(self._rows)} lines move"
        return [head, *(self._bar(name, row) for name, row in self._rows.items())]

    def _bar(self, name: str, row: _LineNews) -> str:
        full = round(BAR * row.fraction)
        bar = f"  {name[: self._wide]:<{self._wide}} [{'#' * full}{'.' * (BAR - full)}]"
        newest = row.newest
        if newest is None:
            return bar
        faults = (f"node {node}: {each.status.fault}" for node, each in row.nodes.items() if each.status.fault)
        return f"{bar}  step {newest.step} of {newest.steps}  {next(faults, WORDS[newest.phase])}"
