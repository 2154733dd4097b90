"""A line on the terminal that says how long something takes, drawn by a thread of its own while it takes long."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from curveline.cli.printing import terminal

QUIET_S = 1.0
"""What is over by then needs no line."""
TICK_S = 0.5


def tick(text: Callable[[], str], is_going: Callable[[], bool], draw: Callable[[str], None]) -> threading.Thread:
    """Draw what `text` says every now and then, as long as it is going; the thread that does it."""

    def run() -> None:
        pause, told = threading.Event(), ""
        while is_going():
            if told := text():
                draw(told)
            pause.wait(TICK_S)
        terminal.erase(told)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    return thread


@contextmanager
def patience(what: str) -> Iterator[None]:
    """Say what is being done and for how long, where stderr is a terminal and nothing else is said there."""
    if not terminal.is_live(sys.stderr):
        yield
        return
    begin = time.monotonic()
    over = threading.Event()

    def text() -> str:
        seconds = time.monotonic() - begin
        return f"{what}: {seconds:.0f} s" if seconds >= QUIET_S else ""

    tick(text, lambda: not over.is_set(), terminal.fill)
    try:
        yield
    finally:
        over.set()
        terminal.erase()
