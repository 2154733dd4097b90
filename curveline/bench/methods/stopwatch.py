"""How long things take: the best of repeats in one process, as everything else on a machine only adds to that."""

from __future__ import annotations

import math
import time
from collections.abc import Callable


def best(action: Callable[[], object], seconds: float = 0.3) -> float:
    """Shortest time of `action` [s] over repeats that take about `seconds`; the first call is not counted."""
    action()
    shortest, spent = math.inf, 0.0
    while spent < seconds:
        begin = time.perf_counter()
        action()
        took = time.perf_counter() - begin
        shortest, spent = min(shortest, took), spent + took
    return shortest
