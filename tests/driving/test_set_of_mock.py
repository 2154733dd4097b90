"""A modelled display whose rod has kept a curvature that nobody told: plans may go wrong, as Monte Carlo says."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import curveline
from curveline.errors import InvalidInput
from curveline.plan_file import Plan
from curveline.radio.mock.spec import parse_spec
from curveline.replay.error_sizes import Errors

from .to_mock import ends_in

SURE = Errors(feed=0.0, feed_scale=0.0, angle=0.0, height=0.0, bow=0.0, unevenness=0.0)
"""Nodes that do what they are told."""


@pytest.fixture(scope="module")
def plan() -> Plan:
    """Of a peak near where it ends."""
    scene = curveline.read_shape("level-asymmetric-peak")
    return curveline.plan(replace(scene, nodes=(scene.nodes[0], replace(scene.nodes[1], angle=math.radians(40.0)))))


@pytest.mark.parametrize(
    ("settings", "state"), [("set=0", "peak"), ("set=0.05", "peak"), ("set=0.1", "valley"), ("set=-0.1", "peak")]
)
def test_a_kept_curvature_may_lead_a_plan_into_the_wrong_curve(
    settings: str, state: str, plan: Plan, tmp_path: Path
) -> None:
    assert ends_in(settings, plan, tmp_path) == state


def test_monte_carlo_says_how_often(plan: Plan, tmp_path: Path) -> None:
    shares = np.linspace(0.0, 0.2, 21)[:-1] + 0.005
    good = np.mean([ends_in(f"set={share:.3f}", plan, tmp_path) == "peak" for share in shares])
    ranges = curveline.DisplayErrors(set_share=curveline.Range(0.0, 0.2))
    trials = curveline.monte_carlo(plan, curveline.TrialsRequest(runs=200, jobs=1, errors=SURE, display_errors=ranges))
    low, high = trials.share.interval
    assert low - 0.05 < good < high + 0.05
    assert 0.1 < good < 0.9


def test_the_other_shape_before_counts_where_the_plan_says_it(tmp_path: Path) -> None:
    valley = "level-asymmetric-valley"
    for share, state in ((0.1, "peak"), (0.9, "valley")):
        with curveline.connect("mock:fresh", runs=tmp_path) as session:
            assert session.send(valley).playback.states == ("valley",)
        with curveline.connect(f"mock:set={share}", runs=tmp_path) as session:
            assert session.send(curveline.plan("level-up-peak", begin=valley)).playback.states == (state,)


@pytest.mark.parametrize("settings", ["set=2", "set=nan", "set=-1.5", "set=much"])
def test_what_no_rod_keeps_is_refused(settings: str) -> None:
    with pytest.raises(InvalidInput, match=f"the mock radio's {settings} cannot be read"):
        parse_spec(settings)
