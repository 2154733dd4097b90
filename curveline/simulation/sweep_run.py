"""The points of a sweep, computed many at a time on threads, or one by one on processes; the answers come in order.

Where rods have no difficulties, a kernel finds the states at many points at once and writes their curves, and threads
share that: it needs no interpreter meanwhile. Scenes with difficulties need it all the time, each a process of its own.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from itertools import pairwise
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from curveline.errors import CurvelineError
from curveline.kernels import readiness
from curveline.simulation import batch
from curveline.simulation.batch import Order, Task, line_of
from curveline.simulation.plain_makers import plain_maker
from curveline.simulation.plain_points import PlainSweep
from curveline.simulation.sweep import Sweep
from curveline.simulation.sweep_files import rows_and_curves_of

PROBES = 32
"""Points, spread over all of them, that tell whether most of a sweep are plain."""
MOSTLY = 0.75
"""Part of these from which on it pays to look at many points at once."""
AHEAD = 4
"""Blocks of points per thread that may be under way while the answers wait for the slowest."""


class Stretch(NamedTuple):
    """Neighbouring points of a sweep, from number `first` to `last`, and what became of them.

    `products` are what the makers made, in their order: of each, what is to be taken one after the other. A single
    point that could not be simulated has an `error` instead, and says at which values.
    """

    first: int
    last: int
    products: tuple[list[Any], ...]
    error: CurvelineError | None = None
    swept: tuple[tuple[str, float], ...] = ()


Stretches = Generator[Stretch, None, None]


class SweepRun:
    """A sweep that is being simulated as `order` says by `jobs` threads or processes."""

    def __init__(self, sweep: Sweep, order: Order, jobs: int) -> None:
        self._sweep = sweep
        self._order = order
        self._jobs = jobs
        self._plain = self._as_plain()
        self.is_on_threads = self._plain is not None and jobs > 1
        """Whether threads share the work, not processes."""

    def stretches(self) -> Stretches:
        """All points in order. Close the iterator if it is not drawn to its end: that ends threads and processes."""
        if self._plain is None:
            return self._by_scene()
        return self._on_threads(self._plain) if self.is_on_threads else self._here(self._plain)

    def _as_plain(self) -> PlainSweep | None:
        """The sweep as one of plain points; None if it is none, or if most of its points are not."""
        order, sweep = self._order, self._sweep
        if not all(map(plain_maker, order.makers)) or not PlainSweep.fits(sweep, order.settings):
            return None
        if readiness.is_first_run():
            # Kernels are compiled once, here.
            batch.perform(order, sweep.task(1))
        with_curves = line_of in order.makers or rows_and_curves_of in order.makers
        plain = PlainSweep(sweep, order.settings, with_curves=with_curves)
        numbers = np.unique(np.linspace(1, len(sweep), PROBES).astype(np.int64))
        return plain if plain.states(numbers)[0].mean() >= MOSTLY else None

    def _by_scene(self) -> Stretches:
        sweep = self._sweep
        with closing(batch.run(sweep.tasks(), self._order, self._jobs, len(sweep))) as answers:
            for task, answer in answers:
                yield _stretch_of(task, answer)

    def _here(self, plain: PlainSweep) -> Stretches:
        for first, last in _blocks(len(self._sweep), plain.at_once):
            for each in _pieces(plain, self._order, first, last):
                yield each if isinstance(each, Stretch) else _looked_at(self._sweep, self._order, each)

    def _on_threads(self, plain: PlainSweep) -> Stretches:
        blocks = _blocks(len(self._sweep), plain.at_once)
        waiting: deque[Future[list[Stretch | int]] | Future[Stretch] | Stretch] = deque()
        with ThreadPoolExecutor(self._jobs) as threads:
            try:
                while True:
                    while len(waiting) < AHEAD * self._jobs and (block := next(blocks, None)):
                        waiting.append(threads.submit(_pieces, plain, self._order, *block))
                    if not waiting:
                        return
                    next_one = waiting.popleft()
                    found = next_one if isinstance(next_one, Stretch) else next_one.result()
                    if isinstance(found, Stretch):
                        yield found
                        continue
                    # Points with difficulties are looked at next, in their places, by whoever has time.
                    parts = [
                        each
                        if isinstance(each, Stretch)
                        else threads.submit(_looked_at, self._sweep, self._order, each)
                        for each in found
                    ]
                    waiting.extendleft(reversed(parts))
            finally:
                threads.shutdown(cancel_futures=True)


def _blocks(total: int, size: int) -> Iterator[tuple[int, int]]:
    """The first and the last number of blocks of at most `size` points that are `total` together."""
    return ((first, min(first + size - 1, total)) for first in range(1, total + 1, size))


def _pieces(plain: PlainSweep, order: Order, first: int, last: int) -> list[Stretch | int]:
    """The plain points of a block as stretches, and in their places the numbers of the others."""
    begin = perf_counter()
    is_plain, states = plain.states(np.arange(first, last + 1))
    states = states._replace(seconds=(perf_counter() - begin) / (last + 1 - first))
    makers = [make for make in map(plain_maker, order.makers) if make is not None]
    changes = first + 1 + np.flatnonzero(is_plain[1:] != is_plain[:-1])
    found: list[Stretch | int] = []
    for start, end in pairwise([first, *changes.tolist(), last + 1]):
        if not is_plain[start - first]:
            found += range(start, end)
            continue
        part = states.part(start, end)
        found.append(Stretch(start, end - 1, tuple(make(plain, part) for make in makers)))
    return found


def _looked_at(sweep: Sweep, order: Order, number: int) -> Stretch:
    """What became of a single point."""
    task = sweep.task(number)
    return _stretch_of(task, batch.perform(order, task))


def _stretch_of(task: Task, answer: batch.Simulated | CurvelineError) -> Stretch:
    if isinstance(answer, CurvelineError):
        return Stretch(task.number, task.number, (), answer, task.swept)
    return Stretch(task.number, task.number, tuple([product] for product in answer.products))
