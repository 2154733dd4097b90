"""The journal of a run as a log that people read."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from curveline.drive_settings import DEFAULT_DISPLAY
from curveline.driving.runs import advice_of, cause_of, moment, text
from curveline.radio.host.journal import FILE_NAME, read_journal

DEEPEST = 20
"""Lists within lists that a record has at most; ours have three."""


@dataclass(frozen=True)
class Entry:
    """One record: when [s since 1970], of which step (0 for none), what happened, and what to do about it."""

    at: float | None  # [s] since 1970
    step: int  # from 1, 0 for none
    what: str  # happened, in words
    hint: str = ""  # what to do about it


def read_log(run: Path) -> list[Entry]:
    """The log of the run in a folder; InvalidInput for a record that is not there or is damaged."""
    return log_of(read_journal(run / FILE_NAME))


def log_of(records: Sequence[Mapping[str, Any]]) -> list[Entry]:
    """A journal's records, one entry each."""
    display = text(records[0].get("display")) if records else ""
    return [_entry(record, display or DEFAULT_DISPLAY) for record in records]


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
    known = {
        "release": "released",
        "barrier": "done by all nodes",
        "pause": "paused, all nodes hold",
        "end": "done to its end",
    }
    return known.get(kind, f"unknown entry {text(kind)!r}")
