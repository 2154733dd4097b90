"""Where a display lands: motors of unequal speed, bad air, tours, home, and plans that lead past the funnel."""

from __future__ import annotations

import json
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from curveline.plan import NodeTarget, Plan, read_plan, write_plan
from curveline.playback import replay
from curveline.radio import open_radio
from curveline.radio.actions import Policy
from curveline.radio.frames import Counts
from curveline.radio.journal import Journal, new_run
from curveline.radio.link import Control, send_plan
from curveline.radio.mock import Motion
from curveline.shapefile import read_display

from .conftest import SHAPES, Run, small_plan

BAD = "mock:loss=0.3,spread=0.3"
"""Motors that are slower than this by half their step's time are late, which ends a run as a fault."""
CONDITIONS = sorted({path.stem.rsplit("-", 1)[0] for path in SHAPES.glob("*.toml")})


def sent(run: Run, *arguments: object) -> dict:
    """The document of a send that came to its end."""
    result = run("send", *arguments, "--yes", "--json")
    assert result.code in (0, 1), result.err
    return json.loads(result.out) | {"code": result.code, "said": result.err}


# Motors of unequal speed

PATIENT = Policy(slack_ms=60_000)
"""Waits also for motors of half the speed, which are late enough to end a run as a fault."""


def motion_of(plan: Plan, settings: str, runs: Path) -> Motion:
    """Where all nodes of a mock display were while it carried out a plan."""
    with closing(open_radio(f"mock:{settings}", plan.drive, runs)) as radio:
        with closing(Journal(new_run(runs, plan.name))) as journal:
            assert send_plan(plan, radio, journal, control=Control(PATIENT)).outcome == "done"
        return radio.motion()


def reaching(length_mm: float, angle_deg: float) -> Plan:
    """From home in one step to a length, with both ends of the rod up: feeding and tilting at once."""
    plan = small_plan(steps=1)
    values = ((length_mm / 2.0 - 250.0, angle_deg), (250.0 - length_mm / 2.0, -angle_deg))
    axes = plan.drive.axes
    targets = tuple(
        NodeTarget(feed, tilt, 0.0, (axes[0].counts(feed), axes[1].counts(tilt), 0)) for feed, tilt in values
    )
    return by_hand(plan, targets)


def shares(now: tuple[Counts, ...], end: tuple[Counts, ...]) -> list[tuple[float, float]]:
    """How much of their ways from home the feed and the tilt of every node have behind them."""
    return [(at[0] / to[0], at[1] / to[1]) for at, to in zip(now, end, strict=True)]


@pytest.mark.parametrize(("settings", "uneven"), [("", False), ("spread=0.5,seed=967", True)])
def test_every_axis_of_every_node_has_its_own_course(tmp_path: Path, settings: str, uneven: bool) -> None:
    plan = reaching(600.0, 40.0)
    end = tuple(target.counts for target in plan.steps[-1].targets)
    courses = [shares(counts, end) for _, counts in motion_of(plan, settings, tmp_path)]
    lead = [max(tilt - feed for feed, tilt in course) for course in zip(*courses, strict=True)]
    apart = max(abs(left[0] - right[0]) for left, right in courses)
    print(f"{settings or 'equal'}: tilts lead feeds by {lead}, feeds of the nodes are {apart:.3f} of their way apart")
    assert all((each > 0.3) is uneven for each in lead)
    assert (apart > 0.05) is uneven
    # The rod is up to so much longer or shorter than on the straight way to where the tilts are.
    off_mm = max(abs(0.5 * (left[0] + right[0]) - 0.5 * (left[1] + right[1])) * 100.0 for left, right in courses)
    assert (off_mm > 30.0) is uneven
    assert off_mm < 1.0 or uneven


@pytest.mark.parametrize(
    ("settings", "state"), [("", "valley"), ("spread=0.5,seed=967", "peak"), ("spread=0.5,seed=967,loss=0.3", "peak")]
)
def test_the_rod_follows_the_courses_of_the_axes_not_the_plan(tmp_path: Path, settings: str, state: str) -> None:
    """One step that feeds and tilts at once: with equal motors the sagging rod stays, if tilts lead it snaps over."""
    plan = reaching(600.0, 40.0)
    assert replay(read_display("single"), motion_of(plan, settings, tmp_path)).states == (state,)


# Plans that are not in the funnel


def straight_there(plan: Plan) -> Plan:
    """From home to length and angles at once, then to height: the plan without its funnel."""
    goal = plan.steps[-1]
    level = tuple(replace(each, translate_mm=0.0, counts=(*each.counts[:2], 0)) for each in goal.targets)
    return by_hand(plan, level, goal.targets)


def length_first(plan: Plan) -> Plan:
    """From home to length, between upright nodes, and then to the pose."""
    goal = plan.steps[-1].targets
    upright = tuple(NodeTarget(each.extrude_mm, 0.0, 0.0, (each.counts[0], 0, 0)) for each in goal)
    return by_hand(plan, upright, goal)


def tilted_first(plan: Plan) -> Plan:
    """From home to the final angles with next to no rod to spare, and then to the pose."""
    goal = plan.steps[-1].targets
    per_mm = plan.drive.axes[0].counts_per_unit
    tilted = tuple(
        NodeTarget(feed, each.bias_deg, 0.0, (round(feed * per_mm), each.counts[1], 0))
        for feed, each in zip((5.0, -5.0), goal, strict=True)
    )
    return by_hand(plan, tilted, goal)


def by_hand(plan: Plan, *ends: tuple[NodeTarget, ...]) -> Plan:
    """A plan with these ends of its steps, which promises what `plan` does."""
    steps = tuple(
        replace(plan.steps[-1], number=number, targets=targets, seconds=8.0)
        for number, targets in enumerate(ends, start=1)
    )
    return replace(plan, steps=steps)


@pytest.mark.parametrize(
    ("name", "way"),
    [
        ("level-neutral-peak", straight_there),
        ("level-neutral-peak", length_first),
        ("level-down-peak", straight_there),
        ("staggered-neutral-peak", straight_there),
        ("level-up-valley", tilted_first),
    ],
)
def test_past_the_funnel_the_display_shows_the_wrong_curve(run: Run, tmp_path: Path, name: str, way) -> None:
    real, hand_made = tmp_path / "real.json", tmp_path / "hand-made.json"
    assert run("plan", SHAPES / f"{name}.toml", "-o", real).code == 0
    plan = read_plan(real)
    write_plan(way(plan), hand_made)
    (wanted,) = plan.wanted
    other = {"peak": "valley", "valley": "peak"}[wanted]
    result = run("send", hand_made, "--radio", "mock:fresh", "--yes")
    assert result.code == 1
    assert result.out.endswith(f"segment 1: the rod is in the {other}, not the wanted {wanted}\n")
    result = run("send", real, "--radio", "mock:fresh", "--yes")
    assert result.code == 0
    assert result.out.endswith(f"segment 1: the rod is in the {wanted}, as wanted\n")
