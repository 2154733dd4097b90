"""The runs on record: which there are, how each ended, how far it came, and whether it can go on.

Whatever is in the folder of a run is taken with suspicion: a run that cannot be read is listed as damaged.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import islice
from pathlib import Path
from typing import Any

from curveline.driving.interrupted import plan_of, resuming
from curveline.driving.live import LIVE_NAME, read_live
from curveline.errors import InvalidInput
from curveline.notebook import html_of
from curveline.phrases import local_time
from curveline.radio.host.journal import FILE_NAME, LOOK, is_open, read_journal
from curveline.radio.host.line_records import MOST_LINES, begun, is_of_lines, line_folder, of_line, parts_of, run_of
from curveline.radio.host.resume import FINAL, SEND_AGAIN, resume_point
from curveline.radio.host.run_folder import folder_names
from curveline.radio.host.stop_causes import Cause, Halt, named_display
from curveline.system.files import printable

LAST = "last"
LOOKED_AT = 1000
"""How many runs, the newest first, `last` is sought among."""
TEXT = 1000
"""Characters of a text from a record that are shown."""
LATEST = 253402300799
"""The last second of the year 9999."""


class RunEnding(Enum):
    """How a run ended."""

    DONE = "done"
    PAUSED = "paused"
    HALTED = "halted"
    CUT_OFF = "cut off"
    SENDING = "being sent"
    NOT_BEGUN = "never began"
    DAMAGED = "damaged"


WORST_FIRST = (RunEnding.HALTED, RunEnding.DAMAGED, RunEnding.CUT_OFF, RunEnding.PAUSED, RunEnding.NOT_BEGUN)
UNSTUCK = frozenset({RunEnding.DONE, RunEnding.SENDING, RunEnding.NOT_BEGUN})


@dataclass(frozen=True)
class Run:
    """A run as its folder tells it; texts are fit to be shown.

    `began` is the time of day [s], `reason` why it was halted, never began or is damaged, `advice` what to do if it
    cannot go on, `process` the one that is sending it, 0 if that is not known.
    """

    folder: Path  # of its record
    ending: RunEnding  # how it ended
    display: str = ""  # by name
    plan: str = ""  # by name
    began: float | None = None
    steps_done: int = 0  # by all nodes
    steps: int = 0  # of the plan
    reason: str = ""
    advice: str = ""
    can_resume: bool = False  # whether it can go on
    process: int = 0
    line: str = ""  # name, if this is one line of a run
    lines: tuple[Run, ...] = ()  # of a run of several displays

    @property
    def name(self) -> str:
        """Its name, fit to be shown."""
        return printable(run_of(self.folder).name)

    @property
    def displays(self) -> frozenset[str]:
        """The displays that it is of, by name; "" stands for one that is not known."""
        return frozenset(line.display for line in self.lines) if self.lines else frozenset({self.display})

    @property
    def of(self) -> str:
        """Of what it is, in words; "" if that is not known."""
        if self.lines:
            return f"{len(self.lines)} lines"
        return f"display {self.display}" if self.display else ""

    @property
    def command(self) -> str:
        """The command that goes on with it, "" if it cannot go on."""
        return printable(resuming(run_of(self.folder))) if self.can_resume else ""

    @property
    def is_stuck(self) -> bool:
        """Whether it began, did not come to its end, and cannot go on."""
        return self.ending not in UNSTUCK and not self.can_resume

    @property
    def ended(self) -> str:
        """How it ended, as part of a sentence."""
        stuck = f"; it cannot go on: {self.reason}" if self.reason else ""
        far = f"after {self.steps_done} of {self.steps} steps"
        if self.ending is RunEnding.SENDING:
            who = f"process {self.process}" if self.process else "another process"
            return f"is being sent now by {who}"
        return {
            RunEnding.DONE: "was done to its end",
            RunEnding.PAUSED: f"was paused {far}{stuck}",
            RunEnding.HALTED: f"was halted {far}: {self.reason}",
            RunEnding.CUT_OFF: f"was cut off {far}, killed or without power{stuck}",
            RunEnding.NOT_BEGUN: "never began" + (f": {self.reason}" if self.reason else ""),
            RunEnding.DAMAGED: f"is damaged: {self.reason}",
        }[self.ending]

    def _repr_html_(self) -> str:
        head = ("display", "plan", "began", "how it ended", "to go on")
        row = (
            self.of.removeprefix("display "),
            self.plan,
            local_time(self.began),
            self.ended,
            self.command or self.advice,
        )
        return html_of(self.name, [head, row])

    def document(self) -> dict[str, Any]:
        """The run as plain data; what is not known is null."""
        told = {"reason": self.reason, "advice": self.advice, "resume": self.command}
        return {
            "run": run_of(self.folder).name,
            "folder": str(self.folder),
            "display": self.display or None,
            "plan": self.plan or None,
            "began": self.began,
            "ending": self.ending.value,
            "steps_done": self.steps_done,
            "steps": self.steps,
            "process": self.process or None,
            "can_resume": self.can_resume,
            **{key: text or None for key, text in told.items()},
            "lines": [{"line": line.line, **_line_document(line)} for line in self.lines],
        }


LINE_KEYS = ("display", "plan", "ending", "steps_done", "steps", "can_resume", "reason", "advice")


def _line_document(line: Run) -> dict[str, Any]:
    told = line.document()
    return {key: told[key] for key in LINE_KEYS}


def read_runs(runs: Path, display: str = "") -> Iterator[Run]:
    """All runs in the runs folder, or those of one display, the newest first."""
    for name in folder_names(runs, FILE_NAME):
        run = read_run(runs / name)
        if not display or run.displays & {"", display}:
            yield run


def read_run(folder: Path) -> Run:
    """One run; it never fails."""
    try:
        records = read_journal(folder / FILE_NAME)
    except InvalidInput as error:
        if [each.code for each in error.diagnostics] == ["no-such-file"]:
            return Run(folder, RunEnding.NOT_BEGUN, advice=SEND_AGAIN)
        return Run(folder, RunEnding.DAMAGED, reason=text(error.message), advice=text(error.hint))
    run = _of_lines(folder, records) if is_of_lines(records) else _told(Run(folder, RunEnding.CUT_OFF), records)
    if is_open(folder):
        sending = replace(run, ending=RunEnding.SENDING, reason="", advice="", can_resume=False)
        live = next((live for part in parts_of(folder) if (live := read_live(part / LIVE_NAME))), None)
        if live is None:
            return sending
        if run.lines:
            return replace(sending, process=live.process)
        return replace(sending, display=live.display, plan=live.plan, steps=live.steps, process=live.process)
    return run


def _of_lines(folder: Path, records: Sequence[Mapping[str, Any]]) -> Run:
    """A run of several lines that nobody is sending: what is true of all, and each by itself."""
    header = records[0]
    listed = header.get("lines")
    named = [each if isinstance(each, dict) else {} for each in listed] if isinstance(listed, list) else []
    lines = tuple(_line(folder, number, records, each) for number, each in enumerate(named[:MOST_LINES], start=1))
    endings = {line.ending for line in lines}
    ending = next((each for each in WORST_FIRST if each in endings), RunEnding.DONE)
    if endings <= {RunEnding.NOT_BEGUN}:
        ending = RunEnding.NOT_BEGUN
    worst = next((line for line in lines if line.ending is ending and line.reason), None)
    is_left = [
        line.can_resume or line.ending is RunEnding.NOT_BEGUN for line in lines if line.ending is not RunEnding.DONE
    ]
    return Run(
        folder,
        ending,
        plan=text(header.get("name")),
        began=moment(header),
        steps_done=sum(line.steps_done for line in lines),
        steps=sum(line.steps for line in lines),
        reason=f"line {worst.line}: {worst.reason}" if worst is not None else "",
        advice=worst.advice if worst is not None else SEND_AGAIN if ending is RunEnding.NOT_BEGUN else "",
        can_resume=ending is not RunEnding.NOT_BEGUN and any(is_left),
        lines=lines,
    )


def _line(folder: Path, number: int, records: Sequence[Mapping[str, Any]], header: Mapping[str, Any]) -> Run:
    """One line of a run, from 1."""
    run = _told(Run(line_folder(folder, number), RunEnding.CUT_OFF), begun(of_line(records, number)))
    steps = header.get("steps")
    told = replace(
        run, line=text(header.get("name")), plan=text(header.get("plan")), display=text(header.get("display"))
    )
    return replace(told, steps=steps if type(steps) is int and 0 <= steps <= 2**16 else run.steps)


def _told(run: Run, records: Sequence[Mapping[str, Any]]) -> Run:
    """A run that nobody is sending, as its records tell it."""
    last: Mapping[str, Any] = next((each for each in reversed(records) if each.get("type") != LOOK), {})
    if not records or records[0].get("type") != "start":
        return replace(run, ending=RunEnding.NOT_BEGUN, reason=text(last.get("message")), advice=SEND_AGAIN)
    start = records[0]
    steps = start.get("steps")
    run = replace(
        run,
        display=text(start.get("display")),
        plan=text(start.get("plan")),
        began=moment(start),
        steps=len(steps) if isinstance(steps, list) else 0,
        steps_done=max((_step(each) for each in records if each.get("type") == "barrier"), default=0),
    )
    if last.get("type") == "end":
        return replace(run, ending=RunEnding.DONE)
    endings = {"pause": RunEnding.PAUSED, "halt": RunEnding.HALTED}
    return _with_way_on(replace(run, ending=endings.get(text(last.get("type")), RunEnding.CUT_OFF)), last, records)


def _with_way_on(run: Run, last: Mapping[str, Any], records: Sequence[Mapping[str, Any]]) -> Run:
    """A run that did not come to its end, its `last` record of the link, and whether it can go on."""
    reason = text(last.get("message")) if run.ending is RunEnding.HALTED else ""
    cause = cause_of(last)
    try:
        plan = plan_of(run.folder)
    except InvalidInput as error:
        why = f"{reason}; {error.message}" if reason else error.message
        return replace(run, reason=text(why), advice=text(error.hint))
    try:
        resume_point(plan, records)
    except InvalidInput as error:
        if run.ending is RunEnding.HALTED and cause in FINAL:
            return replace(run, reason=reason or cause.name.lower(), advice=advice_of(cause, last, named_display(plan)))
        return replace(run, ending=RunEnding.DAMAGED, reason=text(error.message), advice=text(error.hint) or SEND_AGAIN)
    return replace(run, reason=reason, advice=advice_of(cause, last, named_display(plan)), can_resume=True)


def advice_of(cause: Cause | None, halt: Mapping[str, Any], display: str) -> str:
    """What a cause says is to be done, for the node of its record and a display."""
    if cause is None:
        return ""
    node = halt.get("node")
    return text(Halt(cause, node if type(node) is int else 0, display=display).hint)


@dataclass(frozen=True)
class Newest:
    """The newest run that can go on, and newer ones: which cannot, although they did not come to their end, and all."""

    run: Run
    broken: tuple[Run, ...] = ()
    since: tuple[Run, ...] = ()
    """Of the same display: they have most likely moved its nodes, which then refuse to go on with the older run."""


def unfinished(runs: Path, display: str = "") -> Newest:
    """The newest run, of one display or of any, that can go on, or else one that is being sent.

    InvalidInput if there is none; it says which run was the last, and how it ended.
    """
    seen = list[Run]()
    for run in islice(read_runs(runs, display), LOOKED_AT):
        if run.can_resume:
            since = [each for each in seen if each.displays & run.displays]
            return Newest(run, tuple(each for each in seen if each.is_stuck), tuple(since))
        seen.append(run)
    if sending := next((run for run in seen if run.ending is RunEnding.SENDING), None):
        return Newest(sending)
    raise _nothing_left(seen, f" of display {display}" if display else f" in {printable(str(runs))}")


def _nothing_left(seen: Sequence[Run], where: str) -> InvalidInput:
    begun = [run for run in seen if run.ending is not RunEnding.NOT_BEGUN] or list(seen)
    if not begun:
        return InvalidInput(f"there is no run{where}", "send a plan or a shape first")
    last = begun[0]
    of = f" of {last.of}" if last.of else ""
    which = f"no run{where}" if len(seen) < LOOKED_AT else f"none of the newest {LOOKED_AT} runs{where}"
    message = f"{which} can go on: the last one, {last.name}{of}, {last.ended}"
    broken = next((run for run in begun if run.is_stuck), last)
    if broken is not last:
        message += f"; {broken.name} {broken.ended}"
    return InvalidInput(message, SEND_AGAIN if broken.ending is RunEnding.DONE else broken.advice)


def text(value: Any) -> str:
    """A text from a record, fit to be shown; "" if it is none."""
    return printable(value[:TEXT]) if isinstance(value, str) else ""


def moment(record: Mapping[str, Any]) -> float | None:
    """When a record was written [s since 1970], None if it does not say so in earnest."""
    at = record.get("at")
    return float(at) if isinstance(at, int | float) and type(at) is not bool and 0 <= at <= LATEST else None


def cause_of(record: Mapping[str, Any]) -> Cause | None:
    """The cause that a record names, None if it is none that this release knows."""
    return Cause.__members__.get(text(record.get("cause")).upper())


def _step(record: Mapping[str, Any]) -> int:
    step = record.get("step")
    return step if type(step) is int and 0 <= step <= 2**16 else 0
