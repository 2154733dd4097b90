"""A plan as text for terminals of 80 columns; light enough for the computer that only sends."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence

from curveline.cli import show
from curveline.plan import NodeTarget, Plan, Step

STEP_HEAD = ("step", "action", "time s", "rod mm", "state after", "strain %", "force N", "N mm", "margin")
TARGET_HEAD = ("step", "node", "extrude mm", "bias deg", "height mm", "extrude", "bias", "translate")


def describe(plan: Plan) -> Iterator[str]:
    """Lines of text: the steps with what was proven of them, then where every node goes."""
    yield show.paint(plan.name, show.BOLD, sys.stdout)
    yield summary(plan)
    yield from _headed(show.table([STEP_HEAD, *map(_step_cells, plan.steps)], frozenset({1, 4})))
    yield from (f"margin of step {numbers}: {text}" for text, numbers in _margins(plan))
    yield "targets in mm and deg, then in encoder counts from home"
    rows = [
        _target_cells(str(step.number) if node == 1 else "", node, target)
        for step in plan.steps
        for node, target in enumerate(step.targets, start=1)
    ]
    yield from _headed(show.table([TARGET_HEAD, *rows], frozenset()))


def summary(plan: Plan) -> str:
    """One line on a plan as a whole."""
    steps = f"{len(plan.steps)} step{'s' if len(plan.steps) > 1 else ''}"
    return f"display {plan.drive.display}, {steps}, {plan.seconds:.1f} s, ends in: {', '.join(plan.wanted)}"


def _headed(lines: Sequence[str]) -> Iterator[str]:
    yield show.paint(lines[0], show.DIM, sys.stdout)
    yield from lines[1:]


def _margins(plan: Plan) -> Iterator[tuple[str, str]]:
    """What the margins are of, each with the numbers of its steps."""
    steps: dict[str, list[str]] = {}
    for step in plan.steps:
        steps.setdefault(step.margin_of, []).append(str(step.number))
    yield from ((text, ", ".join(numbers)) for text, numbers in steps.items())


def _step_cells(step: Step) -> tuple[str, ...]:
    return (
        str(step.number),
        step.action,
        f"{step.seconds:.1f}",
        " ".join(f"{length:.1f}" for length in step.lengths_mm),
        " ".join(step.states),
        f"{100.0 * step.max_strain:.2f}",
        f"{step.max_force_N:.2f}",
        f"{step.max_moment_Nmm:.0f}",
        f"{step.margin:.2f}",
    )


def _target_cells(step: str, node: int, target: NodeTarget) -> tuple[str, ...]:
    values = (target.extrude_mm, target.bias_deg, target.translate_mm)
    return (step, str(node), *map(show.decimal, values), *map(str, target.counts))
