"""Who hears how a run goes on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

from curveline.listening import Listener
from curveline.plan_file import Plan
from curveline.radio.host.link import Control, Observer, Progress

LineObserver = Callable[[str, Progress], None]
"""Takes the name of a line, and news of a node of it."""


class RunListener(Listener):
    """One who hears nothing; a subclass overrides what it wants to hear."""

    @contextmanager
    def sending(self, plan: Plan, control: Control) -> Iterator[Observer]:
        """A plan is being sent; what it yields is told of every node, and `control` can pause or stop the run."""
        yield lambda news: None

    @contextmanager
    def sending_lines(self, plans: Mapping[str, Plan], control: Control) -> Iterator[LineObserver]:
        """Plans are being sent to several lines, by the names of these; what it yields is told of every node of each.

        It may be called by several threads.
        """
        yield lambda line, news: None


UNHEARD = RunListener()
