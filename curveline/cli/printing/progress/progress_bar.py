"""A progress bar on stderr for what takes longer than about a second; nothing where stderr is no terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from types import TracebackType

from curveline.cli.printing import terminal

QUIET_S = 1.0
"""What is over by then needs no bar."""
REDRAW_S = 0.1
WIDTH = 24


class Bar:
    """How far something has come that has `total` parts, None if nobody knows; gone without a trace at the end.

    `detail` says what is being done at present.
    """

    def __init__(self, what: str, total: int | None) -> None:
        self.detail = ""
        self._what = what
        self._total = total
        self._done = 0
        self._begin = self._drawn = time.monotonic()
        self._first: tuple[float, int] | None = None
        self._is_wanted = (total is None or total > 1) and terminal.is_live(sys.stderr)

    def __enter__(self) -> Bar:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._is_wanted:
            terminal.erase()

    def reach(self, done: int) -> None:
        """So many parts are done."""
        self._done = done
        now = time.monotonic()
        # What came before the first news, such as processes that start, says nothing about the pace.
        self._first = self._first or (now, done)
        if now - self._drawn >= REDRAW_S and now - self._begin >= QUIET_S:
            self.show()

    def step(self) -> None:
        """One more part is done."""
        self.reach(self._done + 1)

    def show(self) -> None:
        """Draw how far it is, even if it has only begun."""
        if self._is_wanted:
            self._drawn = time.monotonic()
            terminal.draw("  ".join(part for part in self._parts() if part))

    def _parts(self) -> Iterator[str]:
        yield self._what
        if self._total is None:
            yield str(self._done)
        else:
            full = round(WIDTH * self._done / max(1, self._total))
            yield f"[{'#' * full}{'.' * (WIDTH - full)}] {self._done} of {self._total}"
        pace = self._pace()
        if pace >= 1.0:
            yield f"{pace:.0f}/s"
        if pace > 0.0 and self._total is not None:
            yield f"{_duration((self._total - self._done) / pace)} to go"
        yield self.detail

    def _pace(self) -> float:
        """Parts per second, 0 while nobody can tell."""
        begin, first = self._first or (self._drawn, self._done)
        return (self._done - first) / (self._drawn - begin) if self._done > first else 0.0


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
