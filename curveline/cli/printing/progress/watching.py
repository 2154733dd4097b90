"""The same thing asked again and again: drawn over on a terminal, block after block elsewhere, each with its time."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import typer

from curveline.cli.printing import screen, terminal
from curveline.errors import EXIT_INTERRUPTED


@contextmanager
def watching() -> Iterator[Callable[[Sequence[str]], None]]:
    """Where answers go, as lines; the last one stays on the terminal when Ctrl-C ends it."""
    is_live = terminal.is_live(sys.stdout)
    try:
        if is_live:
            yield lambda lines: terminal.draw("\n".join([f"{_now()}, Ctrl-C ends", *lines]), sys.stdout)
        else:
            yield lambda lines: screen.result("\n".join([_now(), *lines]))
    except KeyboardInterrupt:
        # That is how one ends watching: nothing has failed.
        raise typer.Exit(EXIT_INTERRUPTED) from None
    finally:
        terminal.keep()


def _now() -> str:
    return time.strftime("%H:%M:%S")
