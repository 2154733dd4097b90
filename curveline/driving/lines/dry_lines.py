"""A dry run of several lines: as of one display, line after line."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from curveline._version import __version__
from curveline.driving.dry_run import DryRun, DrySite, dry_run_of
from curveline.driving.lines.interrupted_lines import InterruptedLines
from curveline.driving.lines.lines_wish import LinesWish
from curveline.driving.lines.naming import NamedListener, errors_of
from curveline.driving.run_listener import UNHEARD, RunListener
from curveline.driving.wishes import Wish
from curveline.notebook import html_of


@dataclass(frozen=True)
class LinesDryRun:
    """What would be staged for each of several lines."""

    name: str  # of all lines together
    lines: dict[str, DryRun]  # by name, front to back
    current_limit: float | None = None  # [A] of all that would move at the same time

    def _repr_html_(self) -> str:
        rows = [
            (name, dry.plan.drive.display, len(dry.plan.steps), dry.plan.seconds, len(dry.frames))
            for name, dry in self.lines.items()
        ]
        return html_of(self.name, [("line", "display", "steps", "s", "frames"), *rows])

    def document(self) -> dict[str, Any]:
        """The same as plain data."""
        lines = []
        for name, dry in self.lines.items():
            told = dry.document()
            del told["curveline"]
            lines.append({"line": name, **told})
        return {"curveline": __version__, "name": self.name, "current_limit_A": self.current_limit, "lines": lines}


def dry_run_of_lines(
    wish: LinesWish | InterruptedLines, runs: Path, listener: RunListener = UNHEARD, *, touched: bool = False
) -> LinesDryRun:
    """What sending would stage; errors name the line, and are those of `dry_run_of`."""
    whole = wish.wish if isinstance(wish, InterruptedLines) else wish
    dry = {}
    for name, radio, asked in _asked(wish):
        with errors_of(name):
            site = DrySite(radio or None, runs, touched, NamedListener(listener, name))
            dry[name] = dry_run_of(asked, site)
    return LinesDryRun(whole.name, dry, whole.current_limit)


def _asked(wish: LinesWish | InterruptedLines) -> Iterator[tuple[str, str, Wish]]:
    """Name, radio and wish of every line that has something to do."""
    if isinstance(wish, LinesWish):
        yield from ((line.name, line.radio, line.wish) for line in wish.lines)
        return
    for line, far in zip(wish.wish.lines, wish.lines, strict=True):
        if far.is_left:
            yield line.name, line.radio, far.point or far.plan
