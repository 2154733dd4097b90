"""How long things take: the best of repeats in one process, as everything else on a machine only adds to that."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

ROUNDS = 5
"""Parts of the repeats of an action, each with a best time of its own: how far these lie apart is the noise."""
WAITED = 1.1
"""A time so much longer than the processor's tells that a single round is not to be trusted."""


class Timed(NamedTuple):
    """The shortest time of some rounds [s], and its noise, None where it is not known.

    The noise is by what part the median round is longer, or, if that is more, by what part the shortest time is longer
    than what the processor spent in it: on a busy machine even the shortest one has waited.
    """

    best: float
    spread: float | None

    @classmethod
    def of(cls, rounds: Sequence[float], processor: float = math.inf) -> Timed:
        """What the best times of rounds [s] come to, with the processor's time in the best of them [s], if it tells."""
        best = min(rounds)
        processor = processor if processor > 0.0 else math.inf
        if len(rounds) < 2 and best <= WAITED * processor:
            return cls(best, None)
        return cls(best, max(statistics.median(rounds), best / processor * best) / best - 1.0)


def timed(action: Callable[[], object], seconds: float = 0.3) -> Timed:
    """The time of `action` over repeats that take about `seconds`; the first call is not counted."""
    action()
    rounds, spent, processor = list[float](), 0.0, 0.0
    while not rounds or (spent < seconds and len(rounds) < ROUNDS):
        shortest, begun = (math.inf, 0.0), spent
        while spent - begun < seconds / ROUNDS:
            worked, begin = time.process_time(), time.perf_counter()
            action()
            took = time.perf_counter() - begin
            shortest, spent = min(shortest, (took, time.process_time() - worked)), spent + took
        if shortest[0] < min(rounds, default=math.inf):
            processor = shortest[1]
        rounds.append(shortest[0])
    return Timed.of(rounds, processor)


def best(action: Callable[[], object], seconds: float = 0.3) -> float:
    """Shortest time of `action` [s], see `timed`."""
    return timed(action, seconds).best
