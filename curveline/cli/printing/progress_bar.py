"""A progress bar on stderr for what takes longer than about a second; nothing where stderr is no terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import TYPE_CHECKING

from curveline.cli.printing import screen

if TYPE_CHECKING:
    from rich.progress import Progress

QUIET_S = 1.0
"""What is over by then needs no bar."""
REDRAW_S = 0.1
WIDTH = 24


class Bar:
    """How far something has come that has `total` parts, None if nobody knows; gone without a trace at the end."""

    def __init__(self, what: str, total: int | None) -> None:
        self._what = what
        self._total = total
        self._done = 0
        self._begin = self._drawn = time.monotonic()
        self._first: tuple[float, int] | None = None
        self._picture: Progress | None = None
        self._is_wanted = (total is None or total > 1) and screen.is_live(sys.stderr)

    def __enter__(self) -> Bar:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._picture is not None:
            self._picture.stop()

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
        if not self._is_wanted:
            return
        self._drawn = time.monotonic()
        if self._picture is None:
            self._picture = self._new_picture()
            self._picture.start()
        self._picture.update(self._picture.task_ids[0], completed=self._done, rate=self._rate())
        self._picture.refresh()

    def _rate(self) -> str:
        begin, first = self._first or (self._drawn, self._done)
        return f"{(self._done - first) / (self._drawn - begin):.0f}/s" if self._done > first else ""

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Take the bar away while something else is written to the terminal."""
        if self._picture is None:
            yield
            return
        self._picture.stop()
        self._picture = None
        yield

    def _new_picture(self) -> Progress:
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        columns = (
            TextColumn("{task.description}"),
            BarColumn(bar_width=WIDTH),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]}"),
            TimeRemainingColumn(),
        )
        # Results go past rich, straight to their stream: they may be meant for a file or another program.
        picture = Progress(
            *columns,
            console=screen.console(),
            transient=True,
            auto_refresh=False,
            redirect_stdout=False,
            redirect_stderr=False,
        )
        picture.add_task(self._what, total=self._total, completed=self._done, rate="")
        return picture
