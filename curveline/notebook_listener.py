"""One who hears how work goes on, and shows it in a notebook: a line under the cell that is written over."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from curveline.driving.run_listener import LineObserver, RunListener
from curveline.errors import MissingExtra
from curveline.listening import Heard
from curveline.plan_file import Plan
from curveline.radio.host.link import Control, Observer, Progress

REDRAW_S = 0.2


class NotebookListener(RunListener):
    """Shows under the cell what it hears: notes, and a line that is written over while work goes on.

    Pass it as `listener`. Raises MissingExtra where there is no IPython to show anything.
    """

    def __init__(self) -> None:
        try:
            self._display: Any = import_module("IPython.display")
        except ImportError:
            raise MissingExtra("there is no notebook: IPython is not installed", "pip install ipython") from None
        self._is_told = False

    def note(self, text: str) -> None:
        """See Listener."""
        self._display.display({"text/plain": text}, raw=True)

    def computing(self) -> None:
        """See Listener."""
        from curveline.kernels import readiness

        if readiness.is_first_run() and not self._is_told:
            self._is_told = True
            self.note("compiling kernels, about half a minute, once")

    @contextmanager
    def progress(self, what: str, total: int | None) -> Iterator[Heard]:
        """See Listener."""
        line = _WrittenOver(self._display, what)
        yield lambda done: line.write(f"{what} {done}" if total is None else f"{what} {done} of {total}")
        line.finish()

    @contextmanager
    def sending(self, plan: Plan, control: Control) -> Iterator[Observer]:
        """See RunListener."""
        line = _WrittenOver(self._display, plan.name)

        def heard(news: Progress) -> None:
            action = plan.steps[news.step - 1].action
            line.write(f"{news.seconds:.1f} s  step {news.step} of {news.steps}: {action}  ({news.phase.value})")

        yield heard
        line.finish()

    @contextmanager
    def sending_lines(self, plans: Mapping[str, Plan], control: Control) -> Iterator[LineObserver]:
        """See RunListener."""
        line = _WrittenOver(self._display, f"{len(plans)} lines")
        newest: dict[str, Progress] = {}
        lock = threading.Lock()

        def heard(name: str, news: Progress) -> None:
            with lock:
                newest[name] = news
                far = ", ".join(f"{each} {newest[each].step}" for each in plans if each in newest)
                line.write(f"{news.seconds:.1f} s  steps: {far}")

        yield heard
        line.finish()


class _WrittenOver:
    """A line that is written over, at most a few times a second."""

    def __init__(self, display: Any, text: str) -> None:
        self._text = text
        self._written = time.monotonic()
        self._handle = display.display(_bundle(text), raw=True, display_id=True)

    def write(self, text: str) -> None:
        """Have it say something else."""
        self._text = text
        if time.monotonic() - self._written > REDRAW_S:
            self.finish()

    def finish(self) -> None:
        """Show what it says."""
        self._written = time.monotonic()
        self._handle.update(_bundle(self._text), raw=True)


def _bundle(text: str) -> dict[str, str]:
    return {"text/plain": text}
