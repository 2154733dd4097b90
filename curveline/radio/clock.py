"""The clock of radios that are not modelled."""

from __future__ import annotations

from curveline.system.portable import steady_ns


def steady_us() -> int:
    """Microseconds since some moment in the past, also of time that the computer slept: the nodes did not."""
    return steady_ns() // 1000
