"""Whole commands as a user waits for them: help, a batch of shapes, the first run; and their memory."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

from curveline.bench.measurement import Measurement
from curveline.bench.methods.stopwatch import Timed
from curveline.bench.processes import COMMAND, apart, peak_memory, shortest, spent, unless_it_fails

SHAPE = "level-up-peak"
SEND = ("send", SHAPE, "--radio", "mock:fresh", "--yes")
WARM = (
    (("simulate", SHAPE), "simulate a shape, warm", "< 0.5"),
    (("plan", SHAPE), "plan a shape, warm", "< 0.8"),
    (SEND, "send a shape to a mock, warm", "< 0.8"),
    (("load", SHAPE), "load a shape, warm", "< 0.9"),
)
"""Commands with their goals [s], wall time with start-up."""
FIRST = ((("simulate", SHAPE), "first run of simulate", "< 2"), (SEND, "first run of send", "< 10"))
"""Commands with an empty cache and their goals [s], processor time."""
SOON_S = 3.0


def rows(paths: Sequence[str]) -> Iterator[Measurement]:
    """Help, warm starts, all shape files, peak memory, first runs with an empty cache of kernels."""
    with tempfile.TemporaryDirectory() as folder:
        environment = apart(folder)
        yield from _help(environment)
        for words, name, goal in WARM:
            yield _warm(words, name, goal, environment)
        every = ("simulate", "--json", *paths)
        yield _warm(every, f"simulate {len(paths)} files, warm", "< 0.7", environment)
        memory = Measurement("its peak memory", None, "MB", "< 150", "resident")
        yield unless_it_fails(memory, lambda: (peak_memory([*COMMAND, *every], environment), None))
        for words, name, goal in FIRST:
            yield _first(words, name, goal)


def _help(environment: Mapping[str, str]) -> Iterator[Measurement]:
    bare = shortest([sys.executable, "-c", "import typer"], environment)
    shown = shortest([*COMMAND, "--help"], environment, 5)
    noise = (shown.spread or 0.0) + (bare.spread or 0.0)
    yield Measurement("curveline --help", shown.best, "s", "< 0.3", "wall, best of 5", shown.spread)
    yield Measurement("help over Python with typer", shown.best / bare.best, "x", "< 3", "same run", noise)


def _warm(words: Sequence[str], name: str, goal: str, environment: Mapping[str, str]) -> Measurement:
    row = Measurement(name, None, "s", goal, "wall, best of 3")
    measured: partial[Timed] = partial(shortest, [*COMMAND, *words], environment)
    return unless_it_fails(row, measured)


def _first(words: Sequence[str], name: str, goal: str) -> Measurement:
    """The processor's time of a command with an empty cache; once more if that is soon done, for the noise."""

    def measured() -> Timed:
        taken = [_with_empty_cache(words)]
        if taken[0] < SOON_S:
            taken.append(_with_empty_cache(words))
        return Timed.of(taken)

    return unless_it_fails(Measurement(name, None, "s", goal, "processor, empty cache"), measured)


def _with_empty_cache(words: Sequence[str]) -> float:
    with tempfile.TemporaryDirectory() as folder:
        fresh = apart(folder, CURVELINE_CACHE=str(Path(folder) / "cache"))
        return spent([*COMMAND, *words], fresh).processor
