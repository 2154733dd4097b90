"""What a plan promises of the rod at the step to which a run has come."""

from __future__ import annotations

from dataclasses import replace

import pytest

from curveline.driving.promises import promise
from curveline.plan_file import Plan
from radio.bench import short_plan


def plan_of(*states: tuple[str, ...], shows: tuple[str, ...] = ()) -> Plan:
    plan = short_plan(2, len(states))
    steps = tuple(replace(step, states=names) for step, names in zip(plan.steps, states, strict=True))
    return replace(plan, steps=steps, wanted=states[-1], shows=shows)


PLAN = plan_of(("straight",), ("peak|valley",), ("valley",))


@pytest.mark.parametrize(
    ("done", "released", "state", "verdict"),
    [
        (3, 3, "valley", ", as wanted"),
        (3, 3, "peak", ", not the wanted valley"),
        (2, 2, "valley", ", as step 2 leaves it"),
        (2, 2, "peak", ", as step 2 leaves it"),
        (2, 2, "straight", ", not the peak or valley that step 2 promises"),
        (2, 3, "lost", ", not the peak or valley that step 2 promises"),
        (1, 1, "straight", ", as step 1 leaves it"),
        (1, 1, "valley", ", not the straight rod that step 1 promises"),
        (1, 2, "valley", ", as step 2 leads to"),
        (1, 2, "lost", ", not the straight rod that step 1 promises"),
        (0, 1, "straight", ""),
    ],
)
def test_the_rod_is_held_against_the_step_that_was_done_last(
    done: int, released: int, state: str, verdict: str
) -> None:
    assert promise(PLAN, done, released).verdict(0, state) == verdict


def test_before_the_first_step_the_plan_says_what_it_takes_for_granted() -> None:
    begun = promise(plan_of(("peak", "peak"), shows=("peak", "")), 0, 0)
    assert begun.verdict(0, "peak") == ", as the plan takes for granted"
    assert begun.verdict(0, "valley") == ", not the peak that the plan takes for granted"
    assert begun.verdict(1, "valley") == ""
