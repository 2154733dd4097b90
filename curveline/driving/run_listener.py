"""Who hears how a run goes on."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from curveline.listening import Listener
from curveline.plan_file import Plan
from curveline.radio.host.link import Control, Observer


class RunListener(Listener):
    """One who hears nothing; a subclass overrides what it wants to hear."""

    @contextmanager
    def sending(self, plan: Plan, control: Control) -> Iterator[Observer]:
        """A plan is being sent; what it yields is told of every node, and `control` can pause or stop the run."""
        yield lambda news: None


UNHEARD = RunListener()
