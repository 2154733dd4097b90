"""A display whose host was killed more than once: its rod is followed over all that nobody has told of."""

from __future__ import annotations

from pathlib import Path

import curveline

from .fatal import SIGKILLED, in_a_child, put_under_records
from .lines_folder import hill_plan


def test_the_rod_is_followed_from_where_it_was_last_told_of(tmp_path: Path) -> None:
    def host(fatal: int, run: str) -> None:
        put_under_records(fatal)
        with curveline.connect("mock", plan, runs=tmp_path) as session:
            session.resume(run) if run else session.send(plan)

    plan = hill_plan(3)
    # The rod turns over on the way, while the first of the two is at it.
    assert in_a_child(lambda: host(17, "")) == SIGKILLED
    assert in_a_child(lambda: host(7, "last")) == SIGKILLED
    with curveline.connect("mock", plan, runs=tmp_path) as session:
        result = session.resume("last")
    assert result.playback is not None
    assert result.playback.states == plan.wanted
    assert result.is_wanted
