"""Several lines as people see them, on 80 columns: how a run of them ended, and what one would stage."""

from __future__ import annotations

import sys
from collections.abc import Iterator

from curveline.cli.printing import screen
from curveline.cli.printing.manner import MANNER
from curveline.cli.printing.reports import frame_table, plan_text
from curveline.cli.printing.tables import fitting
from curveline.driving.lines.dry_lines import LinesDryRun
from curveline.driving.lines.lines_result import LineResult, LinesResult
from curveline.driving.rod_report import rod_lines
from curveline.phrases import counted, wrapped

HEAD = ("line", "ended", "steps", "of", "time s", "polls", "lost", "rod")
LEFT = frozenset({0, 1, 7})


def describe(result: LinesResult) -> Iterator[str]:
    """How a run ended, as text: a row per line, then what is not as it was wanted."""
    far = f"{result.steps_done} of {counted(result.steps, 'step')} of {counted(len(result), 'line')}"
    yield f"{result.outcome}: {far} in {result.seconds:.1f} s"
    rows = [_row(line) for line in result]
    if MANNER.is_brief:
        yield from (f"{row[0]}: {row[1]}, {row[2]} of {row[3]} steps" for row in rows)
    else:
        yield from screen.headed(fitting([HEAD, *rows], LEFT), HEAD, rows)
    for line in result:
        yield from _remarks(line)


def _row(line: LineResult) -> tuple[str, ...]:
    report = line.run.report
    polls, lost = (sum(getattr(node.link, key) for node in report.nodes) for key in ("polls", "lost"))
    far = (str(report.steps_done), str(report.steps), f"{report.seconds:.1f}")
    return line.name, line.outcome, *far, str(polls), str(lost), _rod(line)


def _rod(line: LineResult) -> str:
    """Whether the rod is as it is to be where the line has come to."""
    playback, promise = line.run.playback, line.run.promise
    if playback is None:
        return "-"
    pairs = zip(playback.states, promise.states, strict=True)
    is_kept = all(not wanted or state in wanted.split("|") for state, wanted in pairs)
    return ("as wanted" if promise.step == promise.steps else "as planned") if is_kept else "elsewhere"


def _remarks(line: LineResult) -> Iterator[str]:
    """What halted a line, where its rod is if not where it was planned, and shapes that were missed on the way."""
    if line.error is not None:
        yield from wrapped(f"line {line.name}: {line.error.message}")
    run = line.run
    missed = [each.line() for each in run.shapes if each.step < run.report.steps and each.states != each.wanted]
    rods = rod_lines(run.playback, run.promise) if _rod(line) == "elsewhere" else ()
    yield from (text for each in (*missed, *rods) for text in wrapped(f"line {line.name}: {each}"))


def describe_dry(dry: LinesDryRun) -> Iterator[str]:
    """What would be staged, line after line."""
    for name, each in dry.lines.items():
        yield screen.paint(f"line {name}", screen.BOLD, sys.stdout)
        yield from plan_text.describe(each.plan)
        yield from frame_table.table(each.frames)
        yield ""
