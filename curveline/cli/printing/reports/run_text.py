"""Runs as people and scripts see them: how one ended, and those on record."""

from __future__ import annotations

from collections.abc import Iterator

from curveline.cli.printing.manner import MANNER
from curveline.cli.printing.reports import node_table
from curveline.driving.rod_report import rod_lines
from curveline.driving.run_result import RunResult
from curveline.driving.runs import Run, RunEnding
from curveline.phrases import local_time, wrapped


def describe(result: RunResult) -> Iterator[str]:
    """How a run ended, as text."""
    report = result.report
    yield f"{report.outcome}: {report.steps_done} of {report.steps} steps in {report.seconds:.1f} s"
    yield from node_table.table(report.nodes, result.plan.drive)
    yield from (shape.line() for shape in result.shapes if shape.step < report.steps)
    yield from rod_lines(result.playback, result.promise)


def lines(run: Run) -> list[str]:
    """A run as text: what it is, how it ended, and what to do."""
    if MANNER.is_brief:
        how_far = f"{run.steps_done} of {run.steps} steps" if run.steps else "no step"
        return [f"{run.name}: {run.ending.value}, {how_far}{', can go on' if run.can_resume else ''}"]
    told = [line for sentence in (_what(run), run.ended, _advice(run)) for line in wrapped(sentence, 2)]
    return [run.name, *told, *([f"  to go on: {run.command}"] if run.can_resume else [])]


def _what(run: Run) -> str:
    parts = [run.of or "display unknown", f"plan {run.plan}" if run.plan else ""]
    began = f"began {local_time(run.began)}" if run.began is not None else ""
    return ", ".join(part for part in (*parts, began) if part)


def _advice(run: Run) -> str:
    """What to do about a run that did not come to its end, before it goes on or instead."""
    if run.ending in (RunEnding.DONE, RunEnding.SENDING) or not run.advice:
        return ""
    return f"{'first' if run.can_resume else 'cannot go on'}: {run.advice}"
