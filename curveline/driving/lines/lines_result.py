"""How a run of several lines ended, as data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from curveline._version import __version__
from curveline.driving.run_result import RunResult
from curveline.errors import CurvelineError, LinkError
from curveline.notebook import html_of
from curveline.phrases import in_words
from curveline.radio.host.link import OperatorRequest


@dataclass(frozen=True)
class LineResult:
    """How the run ended for one line; `error` says what halted it, or why it could not go on, None if nothing did."""

    name: str  # of the line
    run: RunResult  # what its nodes did
    error: CurvelineError | None = None

    @property
    def outcome(self) -> str:
        """Whether it is "done", "paused" or "halted"."""
        return "halted" if self.error is not None else self.run.report.outcome

    @property
    def is_wanted(self) -> bool:
        """True if it did all its steps and, where that is known, the rod is in the wanted curves."""
        return self.error is None and self.run.is_wanted

    def document(self) -> dict[str, Any]:
        """The result as plain data."""
        told = self.run.document()
        del told["curveline"]
        error = self.error
        why = None if error is None else {"message": error.message, "hint": error.hint or None, **_fault_of(error)}
        return {"line": self.name, **told, "outcome": self.outcome, "error": why}


def _fault_of(error: CurvelineError) -> dict[str, Any]:
    node, cause = (error.node, error.cause) if isinstance(error, LinkError) else (0, "")
    return {"code": error.code, "node": node or None, "cause": cause or None}


@dataclass(frozen=True)
class LinesResult:
    """How a run of several lines ended: a sequence of lines, front to back."""

    name: str  # of all lines together
    lines: tuple[LineResult, ...]  # front to back
    current_limit: float | None  # [A] of all that moved at the same time
    folder: Path  # of the record
    request: OperatorRequest  # what an operator asked for, if anything

    def __iter__(self) -> Iterator[LineResult]:
        return iter(self.lines)

    def __len__(self) -> int:
        return len(self.lines)

    def __getitem__(self, index: int) -> LineResult:
        return self.lines[index]

    @property
    def outcome(self) -> str:
        """Whether all lines are "done", or one of them "halted", or else "paused"."""
        found = {line.outcome for line in self.lines}
        return next((each for each in ("halted", "paused") if each in found), "done")

    @property
    def steps_done(self) -> int:
        """Steps that all nodes of their lines have done, of all lines."""
        return sum(line.run.report.steps_done for line in self.lines)

    @property
    def steps(self) -> int:
        """Steps of all lines."""
        return sum(line.run.report.steps for line in self.lines)

    @property
    def seconds(self) -> float:
        """How long the line took that took longest [s]."""
        return max(line.run.report.seconds for line in self.lines)

    @property
    def is_interrupted(self) -> bool:
        """True if somebody asked to stop."""
        return self.request is not OperatorRequest.NONE

    @property
    def is_wanted(self) -> bool:
        """True if all lines did all their steps and, where that is known, their rods are in the wanted curves."""
        return all(line.is_wanted for line in self.lines)

    @property
    def can_resume(self) -> bool:
        """Whether what is left of the run can go on."""
        from curveline.driving.runs import read_run

        return read_run(self.folder).can_resume

    def _repr_html_(self) -> str:
        rows = [(each.name, each.run.plan.drive.display, *_row(each)) for each in self.lines]
        title = f"{self.name} {self.outcome}: {self.steps_done} of {self.steps} steps in {self.seconds:.1f} s"
        return html_of(title, [("line", "display", "outcome", "steps done", "of", "rod"), *rows])

    def document(self) -> dict[str, Any]:
        """The result as plain data."""
        head = {"curveline": __version__, "name": self.name, "outcome": self.outcome}
        far = {"steps_done": self.steps_done, "steps": self.steps, "seconds": self.seconds}
        lines = [line.document() for line in self.lines]
        return {**head, **far, "current_limit_A": self.current_limit, "lines": lines, "run": str(self.folder)}


def _row(line: LineResult) -> tuple[object, ...]:
    report, playback = line.run.report, line.run.playback
    return line.outcome, report.steps_done, report.steps, "" if playback is None else in_words(playback.states)


class LinesHalted(LinkError):
    """A run one line of which was halted, once all nodes that can be held are held; `result` tells of all lines."""

    code = "halted"

    def __init__(self, line: LineResult, result: LinesResult) -> None:
        cause = line.error
        assert isinstance(cause, LinkError)
        super().__init__(f"line {line.name}: {cause.message}", cause.hint, cause.node)
        self.code = cause.code
        self.cause = cause.cause
        self.line = line.name
        self.result = result
