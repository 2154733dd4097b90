"""The clock of radios that are not modelled: it never goes back, and a suspended computer does not stop it."""

from __future__ import annotations

import time

_CLOCK = getattr(time, "CLOCK_BOOTTIME", None)
"""Where a system has one, its monotonic clock stands still while the computer sleeps, but the nodes' does not."""


def steady_us() -> int:
    """Microseconds since some moment in the past."""
    return (time.monotonic_ns() if _CLOCK is None else time.clock_gettime_ns(_CLOCK)) // 1000
