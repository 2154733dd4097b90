"""What this process had to compile, counted and timed: people are told, and no answer is said to have taken as long."""

from __future__ import annotations

import time
from collections.abc import Callable


class Compilation:
    """Kernels that are compiled, and wall seconds.

    A kernel that calls others compiles them on its way, which takes time once. `tell` hears of every beginning and end.
    """

    def __init__(self) -> None:
        self.kernels = 0
        self.tell: Callable[[], object] = lambda: None
        self._depth = 0
        self._begin = self._spent = 0.0

    @property
    def is_busy(self) -> bool:
        """Whether a kernel is being compiled now."""
        return self._depth > 0

    @property
    def seconds(self) -> float:
        """Time spent so far."""
        return self._spent + (time.perf_counter() - self._begin if self.is_busy else 0.0)

    def begin(self) -> None:
        """A kernel is compiled from now on, perhaps on the way of another one."""
        if not self.is_busy:
            self._begin = time.perf_counter()
        self._depth += 1
        self.tell()

    def end(self) -> None:
        """It is done, or could not be compiled."""
        self._spent = self.seconds if self._depth == 1 else self._spent
        self._depth -= 1
        self.kernels += 1
        self.tell()


COMPILATION = Compilation()


def clock() -> float:
    """Seconds that only grow, and that stand still while kernels are compiled."""
    return time.perf_counter() - COMPILATION.seconds
