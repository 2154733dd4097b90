"""The scenarios of the simulation with thousands of seeds, on all processors: `pytest -m campaign -s`."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections import Counter
from collections.abc import Iterator

import pytest

from .scenarios import SCENARIOS

SEEDS = {
    "filtered": 24,
    "lossy": 1000,
    "restarted": 1000,
    "killed": 1000,
    "paused": 500,
    "held": 500,
    "cut_off": 300,
    "silenced": 10_000,
    "misled": 300,
    "haunted": 500,
    "rivals": 10_000,
    "withheld": 2000,
    "visited": 2000,
}
"""How often each scenario is run: 1,000 restarts, 10,000 silences and 10,000 interleavings of two hosts among them."""
POLLS = 5_000_000
FIRST = 10_000
"""Seeds below are those of CI."""

Outcome = tuple[str, int, int, str]


def play(task: tuple[str, int]) -> Outcome:
    """One seed of one scenario: polls, and what went wrong."""
    name, seed = task
    try:
        return name, seed, SCENARIOS[name](seed), ""
    except AssertionError as error:
        return name, seed, 0, f"{error} (python -m tests.radio.scenarios {name} {seed})"


def tasks() -> Iterator[tuple[str, int]]:
    """All seeds, the scenarios mixed, so that a campaign that is broken off has seen all of them."""
    most = max(SEEDS.values())
    for turn in range(most):
        for name, count in SEEDS.items():
            if turn * count // most != (turn + 1) * count // most:
                yield name, FIRST + turn * count // most


@pytest.mark.campaign
def test_thousands_of_seeds_break_no_invariant() -> None:
    polls: Counter[str] = Counter()
    runs: Counter[str] = Counter()
    failures = []
    begin = told = time.monotonic()
    with multiprocessing.get_context("spawn").Pool(os.cpu_count()) as pool:
        for name, _, count, failure in pool.imap_unordered(play, tasks(), chunksize=20):
            polls[name] += count
            runs[name] += 1
            if failure:
                failures.append(failure)
                print(failure, flush=True)
            if time.monotonic() - told > 10.0:
                told = time.monotonic()
                rate = polls.total() / (told - begin)
                print(f"{polls.total()} polls, {runs.total()} runs, {rate:.0f} polls/s", flush=True)
    for name in SEEDS:
        print(f"{name}: {runs[name]} runs, {polls[name]} polls")
    print(f"{polls.total()} polls in {time.monotonic() - begin:.0f} s")
    assert not failures, "\n".join(failures)
    assert polls.total() >= POLLS
