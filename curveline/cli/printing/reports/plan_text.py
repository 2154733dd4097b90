"""A plan as text for terminals of 80 columns; light enough for the computer that only sends."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence

from curveline.cli.printing import screen
from curveline.cli.printing.manner import MANNER
from curveline.cli.printing.tables import Heading, Row, fitting
from curveline.driving.tours import granted, summary
from curveline.phrases import alike, spans, wrapped
from curveline.plan_file import NodeTarget, Plan, Step

STEP_HEAD = ("step", "action", "time s", "strain %", "force N", "N mm", "margin")
SINGLE_HEAD = ("rod mm", "state after")
"""Columns of the steps of a single segment; the segments of a row have a table of their own."""
SEGMENT_HEAD = ("step", "segment", "rod mm", "state after")
MOST_ROWS = 300
"""Rows of a table that are shown."""
TARGET_HEAD = ("step", "node", "feed mm", "angle deg", "height mm", "feed", "angle", "height")
TARGET_GROUPS = (Heading("position", 2, 4), Heading("encoder counts from home", 5, 7))


def describe(plan: Plan) -> Iterator[str]:
    """Lines of text: where every node goes, then the steps with what was proven of them, the rod of every segment."""
    if MANNER.is_brief:
        yield from _briefly(plan)
        return
    yield screen.paint(plan.name, screen.BOLD, sys.stdout)
    yield from wrapped(summary(plan))
    if any(plan.shows):
        yield from wrapped(f"takes for granted that the display shows: {granted(plan)}")
    yield from _section("targets, where a step moves a node")
    yield from _unless_many(TARGET_HEAD, list(_target_rows(plan)), frozenset(), TARGET_GROUPS)
    yield from _section("steps, and what was proven of them")
    yield from _steps(plan)
    for text, numbers in _margins(plan):
        yield from wrapped(f"margin of step {spans(numbers)}: {text}")
    yield from _remarks(plan)
    if len(plan.wanted) > 1:
        yield from _section("rod and states after a step, where it changes them")
        yield from _unless_many(SEGMENT_HEAD, list(_segment_rows(plan)), frozenset({1, 3}))


def _briefly(plan: Plan) -> Iterator[str]:
    """What it is, where it may be interrupted by a shape, and how far it stays from a snap."""
    yield f"{plan.name}: {summary(plan)}"
    if any(plan.shows):
        yield f"takes for granted that the display shows: {granted(plan)}"
    yield from _complete(plan)
    if plan.steps:
        least = min(plan.steps, key=lambda step: step.margin)
        yield f"least margin: {least.margin:.2f} in step {least.number}, {least.margin_of}"


def _section(title: str) -> Iterator[str]:
    yield ""
    yield screen.paint(title, screen.BOLD, sys.stdout)


def _steps(plan: Plan) -> Iterator[str]:
    """The table of the steps; force and moment are the largest of any node."""
    is_single = len(plan.wanted) == 1
    head = STEP_HEAD[:3] + SINGLE_HEAD * is_single + STEP_HEAD[3:]
    rows = [_step_cells(step, is_single=is_single) for step in plan.steps]
    moment = head.index("N mm")
    groups = (Heading("moment", moment, moment),)
    yield from screen.headed(fitting([head, *rows], frozenset({1, 4} if is_single else {1}), groups), head, rows)


def _unless_many(head: Row, rows: Sequence[Row], left: frozenset[int], groups: Sequence[Heading] = ()) -> Iterator[str]:
    """A table that a person may want to read, or how many rows it would have."""
    if len(rows) > MOST_ROWS:
        yield f"  {len(rows)} rows, too many for a terminal: --json, or the file that -o writes, has them"
    else:
        yield from screen.headed(fitting([head, *rows], left, groups), head, rows)


def _margins(plan: Plan) -> Iterator[tuple[str, list[int]]]:
    """What the margins are of, each with the numbers of its steps."""
    steps: dict[str, list[int]] = {}
    for step in plan.steps:
        steps.setdefault(step.margin_of, []).append(step.number)
    yield from steps.items()


def _remarks(plan: Plan) -> Iterator[str]:
    """What was followed besides the steps in lockstep, and where the shapes are complete."""
    corners = sum(step.corners for step in plan.steps)
    if corners:
        yield f"{corners} mixture{'s' if corners > 1 else ''} of uneven progress were followed"
    for text in _complete(plan):
        yield from wrapped(text)


def _complete(plan: Plan) -> Iterator[str]:
    """Where each shape of a tour is complete."""
    complete = [f"{step.shape} after step {step.number}" for step in plan.steps if step.shape]
    if len(complete) > 1:
        yield f"complete: {', '.join(complete)}"


def _step_cells(step: Step, *, is_single: bool) -> tuple[str, ...]:
    """A row of the steps' table: the worst values of all segments and nodes."""
    single = (f"{step.lengths_mm[0]:.1f}", step.states[0]) if is_single else ()
    return (
        str(step.number),
        step.action,
        f"{step.seconds:.1f}",
        *single,
        f"{100.0 * step.max_strain:.2f}",
        f"{step.max_force_N:.2f}",
        f"{step.max_moment_Nmm:.0f}",
        f"{step.margin:.2f}",
    )


def _segment_rows(plan: Plan) -> Iterator[tuple[str, ...]]:
    """What a step changes of the segments, equal neighbours in one row; of the first step, all."""
    before: tuple[tuple[str, str], ...] = (("", ""),) * len(plan.wanted)
    for step in plan.steps:
        after = tuple((f"{length:.1f}", state) for length, state in zip(step.lengths_mm, step.states, strict=True))
        changed = [each if each != old else None for each, old in zip(after, before, strict=True)]
        number = str(step.number)
        for segments, each in alike(changed):
            if each is not None:
                yield (number, spans(segments), *each)
                number = ""
        before = after


def _target_rows(plan: Plan) -> Iterator[tuple[str, ...]]:
    """Where a step takes the nodes that it moves; all of them if it moves none."""
    before = plan.start
    for step in plan.steps:
        moves = [new.counts != old.counts for new, old in zip(step.targets, before, strict=True)]
        number = str(step.number)
        for node, target in enumerate(step.targets, start=1):
            if moves[node - 1] or not any(moves):
                yield _target_cells(number, node, target)
                number = ""
        before = step.targets


def _target_cells(step: str, node: int, target: NodeTarget) -> tuple[str, ...]:
    values = (target.extrude_mm, target.bias_deg, target.translate_mm)
    return (step, str(node), *map(screen.decimal, values), *map(str, target.counts))
