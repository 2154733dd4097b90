"""Rows of any number of segments: planned, proven, and played however unevenly the nodes move."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from curveline.plan_file import Plan, Step, from_json, to_json
from curveline.planning.tours import make_home_plan, make_plan, start_at
from curveline.planning.verification import LEAST_PAST_FOLD, LEAST_STABILITY
from curveline.replay.playback import replay
from curveline.scene import STRAIGHT, Scene
from curveline.units import mm
from playing import counts_of, motion, scene
from rows import row

from .boxes import uneven_motion

COUNTS = (2, 3, 4, 7, 16)
SHAPES = [*(f"row-{count}" for count in COUNTS), "roofline"]


@cache
def shape(name: str) -> Scene:
    return row(int(name.removeprefix("row-"))) if name.startswith("row") else scene(name)


@cache
def plan_of(name: str) -> Plan:
    return make_plan(shape(name))


@pytest.mark.parametrize("name", SHAPES)
def test_a_row_is_proven_and_arrives(name: str) -> None:
    made, goal = plan_of(name), shape(name)
    counts, states = start_at(goal)
    assert counts_of(made.steps[-1].targets) == counts
    assert made.wanted == made.steps[-1].states == states
    assert made.lengths_mm == pytest.approx([1e3 * segment.length for segment in goal.segments])
    assert [step.shape for step in made.steps] == [""] * (len(made.steps) - 1) + [goal.name]
    for step in made.steps:
        least = LEAST_PAST_FOLD if "fold" in step.margin_of else LEAST_STABILITY
        assert step.margin >= least
        assert step.max_strain <= goal.display.rod.max_strain
        assert step.max_force_N <= goal.display.drive.max_force
        assert step.max_moment_Nmm <= 1e3 * goal.display.drive.max_moment
    assert len([step for step in made.steps if "fold" in step.margin_of]) == 2
    assert from_json(to_json(made), "plan.json") == made


@pytest.mark.parametrize("name", SHAPES)
def test_a_row_ends_in_its_states_however_unevenly_nodes_move(name: str) -> None:
    made, display = plan_of(name), shape(name).display
    chance = np.random.default_rng(len(made.steps))
    runs = [uneven_motion(made, chance) for _ in range(2)] if len(made.wanted) < 16 else []
    for played in (motion(made, lag=float(chance.uniform(0.05, 0.3))), *runs):
        assert replay(display, played).states == made.wanted


def test_without_its_funnels_a_row_shows_the_wrong_curve() -> None:
    # The steps that bias are left out; all others go on as if the states had been chosen.
    made, display = plan_of("row-4"), shape("row-4").display
    last = max(index for index, step in enumerate(made.steps) if "fold" in step.margin_of)
    rest = tuple(step for index, step in enumerate(made.steps) if index == 0 or index > last)
    flat = replace(rest[0], targets=tuple(replace(t, counts=(t.counts[0], 0, 0)) for t in rest[0].targets))
    shown = replay(display, motion(replace(made, steps=(flat, *rest[1:])))).states
    assert shown != made.wanted
    assert shown[0] == "valley" != made.wanted[0]


def tails_and_lengths(made: Plan, goal: Scene) -> Iterator[tuple[Step, tuple[float, ...]]]:
    """The left tail, all lengths and the right tail [m] after every step, from the counts alone."""
    display = goal.display
    per_m = display.drive.extrude.counts_per_unit
    spare = 0.5 * (display.rod.total_length - display.span * len(goal.segments))
    for step in made.steps:
        feeds = [counts[0] / per_m for counts in counts_of(step.targets)]
        inner = tuple(display.span + a - b for a, b in itertools.pairwise(feeds))
        yield step, (spare - feeds[0], *inner, spare + feeds[-1])


@pytest.mark.parametrize("name", ["row-3", "row-16"])
def test_no_rod_appears_or_gets_lost(name: str) -> None:
    goal = shape(name)
    for step, rods in tails_and_lengths(plan_of(name), goal):
        assert math.fsum(rods) == pytest.approx(goal.display.rod.total_length, abs=1e-9)
        assert min(rods[0], rods[-1]) > 0.0
        assert rods[1:-1] == pytest.approx([mm(length) for length in step.lengths_mm], abs=1e-5)
        assert all(goal.display.limits.length.contains(length, 1e-5) for length in rods[1:-1])


@pytest.mark.parametrize("name", ["row-3", "row-7"])
def test_a_row_goes_home(name: str) -> None:
    goal = shape(name)
    counts, states = start_at(goal)
    made = make_home_plan(goal.display, counts, states)
    assert made.wanted == (STRAIGHT,) * len(states)
    assert counts_of(made.steps[-1].targets) == ((0, 0, 0),) * (len(states) + 1)
    assert replay(goal.display, uneven_motion(made, np.random.default_rng(3)), states).states == made.wanted
