"""Tasks for worker processes; a module of its own, since every worker imports it."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path


def square(number: int) -> int:
    """The square, the first ones late."""
    if number < 3:
        time.sleep(0.1)
    return number * number


def refuse_seven(number: int) -> int:
    """The number, unless it is 7."""
    if number == 7:
        raise LookupError("seven")
    return number


def die_at_seven(number: int) -> int:
    """The number, unless it is 7."""
    if number == 7:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def die_once(folder: str, number: int) -> int:
    """The number; the first process that is asked for 5 dies of it."""
    if number == 5:
        try:
            Path(folder, "died").touch(exist_ok=False)
        except FileExistsError:
            return number
        os._exit(3)
    return number


def die(number: int) -> int:
    """Nothing."""
    os._exit(9)


def hears_interrupts(number: int) -> bool:
    """True if Ctrl-C reaches this process."""
    return signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])
