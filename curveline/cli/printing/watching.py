"""The same thing asked again and again: drawn over on a terminal, block after block elsewhere, each with its time."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from curveline.cli.printing import screen, terminal


@contextmanager
def watching() -> Iterator[Callable[[Sequence[str]], None]]:
    """Where answers go, as lines; the last one stays on the terminal."""
    if not terminal.is_live(sys.stdout):
        yield lambda lines: screen.result("\n".join([_now(), *lines]))
        return
    try:
        yield lambda lines: terminal.draw("\n".join([f"{_now()}, Ctrl-C ends", *lines]), sys.stdout)
    finally:
        terminal.keep()


def _now() -> str:
    return time.strftime("%H:%M:%S")
