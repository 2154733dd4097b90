"""Plans sent to a modelled display that differs from its file."""

from __future__ import annotations

from pathlib import Path

import curveline
from curveline.plan_file import Plan


def ends_in(settings: str, plan: Plan, runs: Path) -> str:
    """The state of the rod after a plan was sent to the mock with these settings."""
    with curveline.connect(f"mock:fresh,{settings}", runs=runs) as session:
        result = session.send(plan)
    assert result.playback is not None
    return str(result.playback.states[0])
