"""A run of several lines that was broken off, as its folder tells it: which lines are done, how the others go on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from curveline.driving.interrupted import InterruptedRun, plan_of, unseen_steps
from curveline.driving.lines.lines_wish import LinesWish, LineWish, check_together
from curveline.driving.runs import text
from curveline.errors import InvalidInput
from curveline.plan_file import Plan
from curveline.radio.host.journal import FILE_NAME, find_run, read_journal
from curveline.radio.host.line_records import MOST_LINES, begun, is_of_lines, line_folder, of_line
from curveline.radio.host.preflight import run_tag
from curveline.radio.host.resume import SEND_AGAIN, resume_point
from curveline.radio.interface import check_radio
from curveline.system.files import printable

BEGINS = "start"
ENDS = "end"
NOTHING_MOVED = "send the folder again"
LARGEST_A = 1e6
AT_FIRST = ("fresh", "repower")


@dataclass(frozen=True)
class LineSoFar:
    """How far a line has come: it is done, or goes on from `point`, or cannot; it has not begun if none of these."""

    plan: Plan
    is_done: bool = False
    point: InterruptedRun | None = None
    refusal: InvalidInput | None = None

    @property
    def is_left(self) -> bool:
        """Whether the line has something to do, and can."""
        return not self.is_done and self.refusal is None


@dataclass(frozen=True)
class InterruptedLines:
    """What was to be sent, how far each line has come by the record, and where that record is."""

    wish: LinesWish  # with plans
    lines: tuple[LineSoFar, ...]
    folder: Path

    def over(self, radio: str) -> InterruptedLines:
        """The same with all lines over one radio; InvalidInput if their displays are not on one channel."""
        check_radio(radio)
        wish = replace(self.wish, lines=tuple(replace(line, radio=radio) for line in self.wish.lines))
        check_together(wish)
        return replace(self, wish=wish)

    def summary(self) -> str:
        """One line on what is left to do."""
        done = sum(line.is_done for line in self.lines)
        left = sum(line.is_left for line in self.lines)
        return f"{self.wish.name}: {done} of {len(self.lines)} lines are done, {left} go on"


def find_interrupted_lines(name: str, runs: Path) -> InterruptedLines | None:
    """The run of several lines that `name` means, None if that is one of a single display.

    InvalidInput if there is none, or if its record says that nothing of it can go on.
    """
    folder = find_run(runs, name)
    records = read_journal(folder / FILE_NAME)
    if not is_of_lines(records):
        return None
    try:
        wish = _wish(folder, records[0])
        lines = tuple(_so_far(folder, records, number) for number in range(1, len(wish.lines) + 1))
        _check_left(lines, wish)
    except InvalidInput as error:
        raise InvalidInput(f"run {printable(folder.name)}: {error.message}", error.hint, error.diagnostics) from None
    return InterruptedLines(wish, lines, folder)


def _check_left(lines: Sequence[LineSoFar], wish: LinesWish) -> None:
    if all(line.is_done for line in lines):
        raise InvalidInput("there is nothing to resume: all lines have been done to their ends")
    if all(line.point is None and line.is_left for line in lines):
        raise InvalidInput("there is nothing to resume: it was ended before any node was told to move", NOTHING_MOVED)
    if not any(line.is_left for line in lines):
        name, refusal = next(
            (line.name, far.refusal) for line, far in zip(wish.lines, lines, strict=True) if far.refusal is not None
        )
        raise InvalidInput(f"line {name}: {refusal.message}", refusal.hint)


def header_of(wish: LinesWish, plans: Sequence[Plan]) -> dict[str, Any]:
    """The first record of a run: all that a resumption needs to know of its lines, but for their plans."""
    lines = [
        {
            "name": line.name,
            "display": plan.drive.display,
            "plan": plan.name,
            "run": f"{run_tag(plan):016x}",
            "steps": len(plan.steps),
            "radio": line.radio,
            "current_A": line.current,
        }
        for line, plan in zip(wish.lines, plans, strict=True)
    ]
    return {"type": "lines", "name": wish.name, "current_limit_A": wish.current_limit, "lines": lines}


def _wish(folder: Path, header: Mapping[str, Any]) -> LinesWish:
    """What was to be sent by the first record of a run; InvalidInput if that cannot be believed."""
    listed = header.get("lines")
    if not isinstance(listed, list) or not 0 < len(listed) <= MOST_LINES:
        raise _nonsense()
    lines = [_line(folder, number, each) for number, each in enumerate(listed, start=1)]
    wish = LinesWish(text(header.get("name")), tuple(lines), _amperes(header.get("current_limit_A")))
    if wish.current_limit is not None and any(
        not 0 < (line.current or 0) <= wish.current_limit * 1.01 for line in lines
    ):
        raise _nonsense()
    check_together(wish)
    return wish


def _line(folder: Path, number: int, record: Any) -> LineWish:
    if not isinstance(record, dict):
        raise _nonsense()
    name, radio = record.get("name"), record.get("radio")
    if not isinstance(name, str) or not name.isprintable() or not isinstance(radio, str):
        raise _nonsense()
    check_radio(radio)
    plan = plan_of(line_folder(folder, number))
    if record.get("run") != f"{run_tag(plan):016x}":
        raise InvalidInput("the record of the run is not of the plans that are kept beside it", SEND_AGAIN)
    return LineWish(name, plan, _opened_again(radio), _amperes(record.get("current_A")))


def _opened_again(radio: str) -> str:
    """A radio without what is done with a modelled display when it is first opened, which would void the run."""
    kind, _, settings = radio.partition(":")
    kept = [each for each in settings.split(",") if each.strip() not in AT_FIRST]
    return f"{kind}:{','.join(kept)}" if kind == "mock" and any(kept) else kind if kind == "mock" else radio


def _amperes(value: Any) -> float | None:
    if value is None:
        return None
    if type(value) not in (int, float) or not 0 < value <= LARGEST_A:
        raise _nonsense()
    return float(value)


def _nonsense() -> InvalidInput:
    return InvalidInput("the record of the run cannot be believed: its first entry does not tell of its lines")


def _so_far(folder: Path, records: Sequence[Mapping[str, Any]], number: int) -> LineSoFar:
    part = line_folder(folder, number)
    plan, own = plan_of(part), begun(of_line(records, number))
    if not own or own[0].get("type") != BEGINS:
        return LineSoFar(plan)
    if own[-1].get("type") == ENDS:
        return LineSoFar(plan, is_done=True)
    try:
        point = resume_point(plan, own)
    except InvalidInput as refusal:
        return LineSoFar(plan, refusal=refusal)
    return LineSoFar(plan, point=InterruptedRun(plan, point, part, unseen_steps(point, own)))
