"""Tell people that kernels are compiled, while they are: a line that counts on a terminal, one sentence elsewhere."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from functools import cache

from curveline.cli.printing import screen, terminal
from curveline.cli.printing.progress.ticker import tick
from curveline.kernels import readiness
from curveline.kernels.cache import keeps, wanted
from curveline.kernels.compile_time import COMPILATION


@cache
def announce_compilation() -> None:
    """Say once why something takes long, before it does: at once if nothing was ever compiled here."""
    Announcement(screen.note)


class Announcement:
    """Says that kernels are compiled as soon as they are, and counts them on the terminal until they are done."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell = tell
        self._is_said = False
        self._ticker: threading.Thread | None = None
        COMPILATION.tell = self._heard
        if readiness.is_first_run():
            self._say(f"compiling kernels, about 35 s, {_how_often()}")

    def _say(self, text: str) -> None:
        self._is_said = True
        self._tell(text)

    def _heard(self) -> None:
        """A kernel has been begun, or is done."""
        if not self._is_said:
            self._say(f"compiling kernels that are new here, up to half a minute, {_how_often()}")
        is_ticking = self._ticker is not None and self._ticker.is_alive()
        if not is_ticking and _is_busy() and terminal.is_live(sys.stderr):
            self._ticker = tick(_progress, _is_busy, terminal.draw)


def _is_busy() -> bool:
    return COMPILATION.is_busy


def _progress() -> str:
    return f"compiling kernels: {COMPILATION.kernels} done in {COMPILATION.seconds:.0f} s"


def _how_often() -> str:
    return "once" if keeps() else f"in every run: {wanted()} cannot be written"
