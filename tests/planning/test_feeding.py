"""Rod fed through a row: however unevenly the nodes feed, no segment runs short or over on the way."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from curveline.planning.feeding import Room, schedule
from curveline.planning.proof import Refused

SPAN = 0.5
SLACK = 1e-9
GIVES = (0.25, 0.1, 0.04, 0.015)

few = settings(max_examples=150, derandomize=True, deadline=None, database=None)


def feeds_for(lengths: Sequence[float], first: float) -> tuple[float, ...]:
    """The feeds that give these lengths [m] if the first node has fed `first`."""
    return tuple(itertools.accumulate((SPAN - length for length in lengths), initial=first))


def lengths_for(feeds: Sequence[float]) -> list[float]:
    return [SPAN + left - right for left, right in itertools.pairwise(feeds)]


@dataclass(frozen=True)
class Job:
    """Feeds of all nodes at the begin and the end, and the room for them."""

    feeds: tuple[float, ...]
    goal: tuple[float, ...]
    room: Room


def job_of(lengths: Sequence[float], goal: Sequence[float], firsts: tuple[float, float], give: float) -> Job:
    """Segments that get no shorter than at the begin and the end, but longer by a share `give` of the span."""
    pairs = list(zip(lengths, goal, strict=True))
    room = Room(tuple(min(pair) for pair in pairs), tuple(max(pair) + give * SPAN for pair in pairs))
    return Job(feeds_for(lengths, firsts[0]), feeds_for(goal, firsts[1]), room)


@st.composite
def jobs(draw: st.DrawFn) -> Job:
    count = draw(st.integers(1, 20))
    excess = st.one_of(st.just(0.0), st.floats(0.0, 0.3))
    row = st.lists(excess.map(lambda more: SPAN + more), min_size=count, max_size=count)
    firsts = st.floats(-0.6, 0.6)
    return job_of(draw(row), draw(row), (draw(firsts), draw(firsts)), draw(st.sampled_from(GIVES)))


@few
@given(jobs(), st.randoms(use_true_random=False))
def test_no_segment_runs_short_or_over_however_unevenly_nodes_feed(job: Job, chance: object) -> None:
    room, before = job.room, job.feeds
    count = 0
    for count, after in enumerate(schedule(SPAN, job.feeds, job.goal, room), start=1):  # noqa: B007
        for side in itertools.product((0, 1), repeat=2):
            # The extremes of a segment are the extremes of its two nodes, whatever the others do.
            for segment, (least, most) in enumerate(zip(room.least, room.most, strict=True)):
                left = (before[segment], after[segment])[side[0]]
                right = (before[segment + 1], after[segment + 1])[side[1]]
                assert least - SLACK <= SPAN + left - right <= most + SLACK
        for old, new, there in zip(before, after, job.goal, strict=True):
            assert abs(there - new) <= abs(there - old)
        before = after
    assert before == pytest.approx(job.goal, abs=1e-7)
    way = max(abs(there - here) for there, here in zip(job.goal, job.feeds, strict=True))
    give = min(most - max(pair) for most, pair in zip(room.most, _pairs(job), strict=True))
    # Rod comes in waves of at most `give` each; while one passes, those behind it wait.
    assert count <= 2 * len(job.goal) + 3 * math.ceil(way / give)


def _pairs(job: Job) -> list[tuple[float, float]]:
    return list(zip(lengths_for(job.feeds), lengths_for(job.goal), strict=True))
