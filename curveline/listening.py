"""Who hears how work goes on: what is worth telling, how far something is, that something slow is about to begin."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

Heard = Callable[[int], object]
"""Takes how many parts are done."""


class Listener:
    """One who hears nothing; a subclass overrides what it wants to hear."""

    def note(self, text: str) -> None:
        """A sentence that is worth telling."""

    def computing(self) -> None:
        """Physics is about to be computed, for which kernels may have to be compiled first."""

    @contextmanager
    def progress(self, what: str, total: int | None) -> Iterator[Heard]:
        """Something of `total` parts, None if nobody knows how many; what it yields is told how many are done."""
        yield lambda done: None


SILENT = Listener()
