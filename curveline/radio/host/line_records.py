"""The record of a run of several lines: one journal, whose records say which line they are of, and a folder per line.

The first record tells of all lines. What is of line N (from 1) lies in the folder `lines/N` of the run: its plan, and
what is published while it is sent. So does a lock, as in the folder of a run of one display.
"""

from __future__ import annotations

import os
import re
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from curveline.radio.host.actions import Record
from curveline.radio.host.journal import FILE_NAME, Journal, read_journal

FOLDER = "lines"
KIND = "lines"
"""Type of the first record of such a run."""
LINE = "line"
"""Key of every other record: the number of its line."""
MOST_LINES = 64
NUMBER = re.compile(r"[1-9][0-9]?")


def line_folder(run: Path, number: int) -> Path:
    """Where what is of a line (from 1) of a run lies."""
    return run / FOLDER / str(number)


def parts_of(run: Path) -> list[Path]:
    """The folders of a run that have a plan each: its own, or those of its lines."""
    if not (run / FOLDER).is_dir():
        return [run]
    return [folder for number in range(1, MOST_LINES + 1) if (folder := line_folder(run, number)).is_dir()] or [run]


def run_of(part: Path) -> Path:
    """The folder of the run that a part of it belongs to; runs may lie in a folder of any name, that of lines, too."""
    is_line = part.parent.name == FOLDER and NUMBER.fullmatch(part.name) is not None
    return part.parent.parent if is_line and not os.path.lexists(part / FILE_NAME) else part


def records_of(part: Path) -> list[Mapping[str, Any]]:
    """The records of a run of one display, or those of one line; InvalidInput as of `read_journal`."""
    records = read_journal(run_of(part) / FILE_NAME)
    return records if run_of(part) == part else of_line(records, int(part.name))


def is_of_lines(records: Sequence[Mapping[str, Any]]) -> bool:
    """Whether these are the records of a run of several lines."""
    return bool(records) and records[0].get("type") == KIND


def of_line(records: Sequence[Mapping[str, Any]], number: int) -> list[Mapping[str, Any]]:
    """The records of one line (from 1)."""
    return [record for record in records if type(found := record.get(LINE)) is int and found == number]


def begun(records: Sequence[Mapping[str, Any]]) -> Sequence[Mapping[str, Any]]:
    """The records of a line from its begin on, all of them if it has not begun.

    What it says before is that it did not begin, because another line could not.
    """
    first = next((place for place, record in enumerate(records) if record.get("type") == "start"), 0)
    return records[first:]


class LineJournal:
    """The journal of a run as one of its lines keeps it; several threads may write."""

    def __init__(self, journal: Journal, number: int, lock: threading.Lock) -> None:
        self._journal = journal
        self._number = number
        self._lock = lock

    def reserve(self, size: int) -> None:
        """See Journal; room for all lines is reserved at once."""

    def append(self, record: Record) -> None:
        """See Journal."""
        with self._lock:
            self._journal.append({**record, LINE: self._number})
