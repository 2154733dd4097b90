"""The journal of a run as a log that people read."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from curveline._version import __version__
from curveline.drive_settings import DEFAULT_DISPLAY
from curveline.driving.runs import LAST, Run, advice_of, cause_of, moment, read_run, text
from curveline.errors import InvalidInput
from curveline.notebook import html_of
from curveline.phrases import local_time
from curveline.radio.host.journal import FILE_NAME, LOOK, find_run, read_journal
from curveline.radio.host.line_records import LINE, is_of_lines
from curveline.radio.host.run_folder import folder_names

DEEPEST = 20
"""Lists within lists that a record has at most; ours have three."""


@dataclass(frozen=True)
class Entry:
    """One record: when [s since 1970], of which step (0 for none), what happened, and what to do about it."""

    at: float | None  # [s] since 1970
    step: int  # from 1, 0 for none
    what: str  # happened, in words
    hint: str = ""  # what to do about it


@dataclass(frozen=True)
class RunLog:
    """A run and its log: a sequence of entries, in the order in which they were written."""

    run: Run  # as its record tells it
    records: tuple[Mapping[str, Any], ...]  # as they are in the record

    @property
    def entries(self) -> list[Entry]:
        """The records in words, one entry each."""
        return log_of(self.records)

    def __iter__(self) -> Iterator[Entry]:
        return iter(self.entries)

    def __len__(self) -> int:
        return len(self.records)

    def __getitem__(self, index: int) -> Entry:
        return self.entries[index]

    def _repr_html_(self) -> str:
        rows = [(local_time(each.at), each.step or "", each.what, each.hint) for each in self]
        return html_of(f"{self.run.name} {self.run.ended}", [("at", "step", "what", "hint"), *rows])

    def document(self) -> dict[str, Any]:
        """The run and its records as plain data."""
        return {"curveline": __version__, **self.run.document(), "records": plain(list(self.records))}


def read_log(folder: Path) -> RunLog:
    """The log of the run in a folder; InvalidInput for a record that is not there or is damaged."""
    return RunLog(read_run(folder), tuple(read_journal(folder / FILE_NAME)))


def log_if_any(folder: Path) -> RunLog:
    """The log of the run in a folder, without entries if its record cannot be read."""
    try:
        return read_log(folder)
    except InvalidInput:
        return RunLog(read_run(folder), ())


def run_named(name: str, runs: Path) -> Path:
    """The folder of the run that is meant, by its folder or its name; `last` is the one that was begun last."""
    names = folder_names(runs, FILE_NAME)
    if name != LAST:
        return runs / name if name in names else find_run(runs, name)
    if not names:
        raise InvalidInput(f"there is no run in {runs}", "send a plan or a shape first")
    return runs / names[0]


def log_of(records: Sequence[Mapping[str, Any]]) -> list[Entry]:
    """A journal's records, one entry each."""
    display = text(records[0].get("display")) if records else ""
    if is_of_lines(records):
        return list(_entries_of_lines(records))
    return [_entry(record, display or DEFAULT_DISPLAY) for record in records]


def _entries_of_lines(records: Sequence[Mapping[str, Any]]) -> Iterator[Entry]:
    """The entries of a run of several lines, each with the name of its line."""
    listed = records[0].get("lines")
    lines = [each if isinstance(each, dict) else {} for each in listed] if isinstance(listed, list) else []
    yield Entry(moment(records[0]), 0, f"{len(lines)} lines are to be sent together")
    for record in records[1:]:
        number = record.get(LINE)
        header = lines[number - 1] if type(number) is int and 0 < number <= len(lines) else {}
        entry = _entry(record, text(header.get("display")) or DEFAULT_DISPLAY)
        yield replace(entry, what=f"line {text(header.get('name')) or 'unknown'}: {entry.what}")


def plain(value: Any, depth: int = 0) -> Any:
    """A value from a journal as data that any reader of JSON takes: finite numbers, no endless nesting."""
    if depth > DEEPEST:
        return None
    if isinstance(value, Mapping):
        return {str(key): plain(each, depth + 1) for key, each in value.items()}
    if isinstance(value, list):
        return [plain(each, depth + 1) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _entry(record: Mapping[str, Any], display: str) -> Entry:
    step = record.get("step")
    number = step if type(step) is int and 0 <= step <= 2**16 else 0
    cause = cause_of(record) if record.get("type") == "halt" else None
    by = f", asked for by {text(record['by'])}" if text(record.get("by")) else ""
    return Entry(moment(record), number, _what(record, number) + by, advice_of(cause, record, display))


def _what(record: Mapping[str, Any], step: int) -> str:
    kind = text(record.get("type"))
    process = record.get("process")
    who = f" by process {process}" if type(process) is int and 0 < process < 2**53 else ""
    if kind == "start":
        boots = record.get("boots")
        return f"begun{who} with {len(boots) if isinstance(boots, list) else 'unknown'} nodes"
    if kind == "resume":
        return f"gone on with{who}, at step {step}"
    if kind == "halt":
        return f"halted: {text(record.get('message')) or 'no reason is given'}"
    if kind == LOOK:
        states = record.get("states")
        seen = ", ".join(map(text, states)) if isinstance(states, list) else ""
        why = f"cannot tell what the display shows: {text(record.get('reason')) or text(record.get('outcome'))}"
        return f"seen in a picture: {seen}" if seen else why
    known = {
        "release": "released",
        "barrier": "done by all nodes",
        "pause": "paused, all nodes hold",
        "end": "done to its end",
    }
    return known.get(kind, f"unknown entry {text(kind)!r}")
