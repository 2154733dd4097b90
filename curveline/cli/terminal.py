"""A person at a terminal, as one who hears how work goes on, and whose Ctrl-C pauses a run."""

from __future__ import annotations

import signal
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from curveline.cli.printing import screen
from curveline.cli.printing.progress.progress_bar import Bar
from curveline.driving.run_listener import LineObserver, RunListener
from curveline.listening import Heard
from curveline.system.portable import STOP_SIGNALS

if TYPE_CHECKING:
    from curveline.plan_file import Plan
    from curveline.radio.host.link import Control, Observer


class Terminal(RunListener):
    """See RunListener; everything goes to stderr."""

    def note(self, text: str) -> None:
        """See Listener."""
        screen.note(text)

    def computing(self) -> None:
        """See Listener."""
        from curveline.cli.printing.progress.compiling import announce_compilation

        announce_compilation()

    @contextmanager
    def progress(self, what: str, total: int | None) -> Iterator[Heard]:
        """See Listener."""
        with Bar(what, total) as bar:
            yield bar.reach

    @contextmanager
    def sending(self, plan: Plan, control: Control) -> Iterator[Observer]:
        """See Listener."""
        from curveline.cli.printing.progress.run_progress import watch

        with _signals(control), watch(plan, control) as shown:
            yield shown

    @contextmanager
    def sending_lines(self, plans: Mapping[str, Plan], control: Control) -> Iterator[LineObserver]:
        """See RunListener."""
        from curveline.cli.printing.progress.lines_progress import watch_lines

        with _signals(control), watch_lines(plans, control) as shown:
            yield shown


TERMINAL = Terminal()


@contextmanager
def _signals(control: Control) -> Iterator[None]:
    """Ctrl-C and its like ask the run to pause; again, to hold now; again, to stop for good."""

    def escalate(number: int, frame: object) -> None:
        control.escalate()

    before = [(number, signal.signal(number, escalate)) for number in STOP_SIGNALS]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)
