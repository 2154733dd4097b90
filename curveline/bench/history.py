"""The history of the benchmark: every run is kept among the user's records, and read with suspicion.

A run is a folder in `bench` of the folder of runs, numbered like these, with the document of its report in it.
"""

from __future__ import annotations

import json
import os
import re
import time
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, NoReturn

from curveline.bench.machine import Conditions, Machine, MachineLoad, Versions
from curveline.bench.measurement import RELATIONS, Measurement
from curveline.bench.report import FORMAT, LINK, MARKER, ROD, BenchReport, to_json
from curveline.bench.trade import TradePoint
from curveline.errors import Diagnostic, InvalidInput
from curveline.radio.host.journal import runs_folder
from curveline.radio.host.run_folder import claim_folder, folder_names
from curveline.system.file_kinds import BENCH, refuse_other_kind
from curveline.system.files import AnyPath, decode_text, excerpt, printable, read_file, refuse_file, write_file
from curveline.system.json_records import Decoder

FOLDER = "bench"
FILE_NAME = "report.json"
LAST = "last"
MAX_BYTES = 4_000_000
MAX_DIAGNOSTICS = 20
GOAL = re.compile(rf"(?:{'|'.join(RELATIONS)}) [0-9.e+-]+")
MEASURE_AGAIN = "measure again: `curveline bench` keeps a record that can be compared with"


@dataclass(frozen=True)
class _Document:
    """The keys of a document, but for its marker."""

    kind: str
    at: float
    curveline: str
    commit: str | None
    kernels: str
    versions: Versions
    machine: Machine
    load: MachineLoad
    shapes: tuple[str, ...]
    rows: tuple[Measurement, ...]
    missed: tuple[str, ...]
    trade: tuple[TradePoint, ...]
    compared: Any = None  # what --json prints besides with --compare


def keep_bench(report: BenchReport, runs: AnyPath | None = None) -> Path:
    """Keep a report in the history: in the folder of runs `runs`, by default the user's; the file it is in.

    The file appears whole or not at all. Raises InvalidInput if it cannot be written.
    """
    folder = _folder(runs)
    stamp = time.strftime("%Y%m%d-%H%M%S", time.localtime(report.conditions.at))
    try:
        path = claim_folder(folder, f"{stamp}-{report.kind}") / FILE_NAME
    except OSError as error:
        hint = "free space on that disk, or set CURVELINE_RUNS to a folder that can be written"
        refuse_file(str(folder), "unwritable", f"it cannot be written: {error.strerror or error}", hint)
    write_file(path, to_json(report))
    return path


def read_bench(name: AnyPath = LAST, runs: AnyPath | None = None, kind: str = ROD) -> BenchReport:
    """A report that was kept, by file or by the folder it is in; "last" is the newest of its kind, "rod" or "link".

    Raises InvalidInput, which names the file and lists what is wrong with it, for one that is missing, damaged, of
    another kind or of a newer release.
    """
    if os.fspath(name) == LAST:
        return _newest(_folder(runs), kind)
    path = Path(name)
    return _read(path / FILE_NAME if path.is_dir() else path)


def _folder(runs: AnyPath | None) -> Path:
    return (runs_folder() if runs is None else Path(runs)) / FOLDER


def _newest(folder: Path, kind: str) -> BenchReport:
    """The newest report of a kind; InvalidInput if there is none, or it cannot be read."""
    for name in folder_names(folder, FILE_NAME):
        path = folder / name / FILE_NAME
        if path.exists():  # a run that was killed while it was being kept left none
            report = _read(path)
            if report.kind == kind:
                return report
    option = " --link" if kind == LINK else ""
    hint = f"run `curveline bench{option}` first, which keeps one"
    raise InvalidInput(f"there is no run of `curveline bench{option}` in {printable(str(folder))} yet", hint)


def _read(path: Path) -> BenchReport:
    name = os.fspath(path)
    return from_json(decode_text(read_file(name, MAX_BYTES), name), name)


def from_json(text: str, path: str) -> BenchReport:
    """The report in a JSON document; `path` names it in the Diagnostics of InvalidInput."""
    refuse_other_kind(text, path, BENCH)
    decoder = Decoder()
    try:
        document = _parsed(text, path)
        if not isinstance(document, dict) or MARKER not in document:
            hint = "name a file that `curveline bench` kept, or that its --json printed"
            _refuse(path, [("not-a-bench", f"this is no record of `curveline bench`: {MARKER} is missing")], hint)
        _check_format(document.pop(MARKER), path)
        found: _Document = decoder.decode(_Document, document, "")
    except RecursionError:
        _refuse(path, [("too-deep", "objects or arrays nested too deep")], MEASURE_AGAIN)
    if not decoder.problems:
        _check(found, decoder)
    if decoder.problems:
        _refuse(path, decoder.problems, f"the record is damaged; {MEASURE_AGAIN}")
    conditions = Conditions(**{each.name: getattr(found, each.name) for each in fields(Conditions)})
    return BenchReport(found.rows, found.trade, conditions, found.kind, found.shapes)


def _parsed(text: str, path: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        source, caret = excerpt(text.split("\n")[error.lineno - 1], error.colno)
        message = f"this is not JSON: {error.msg}"
        hint = "the record is cut off or was edited; remove it, or compare with another one"
        found = Diagnostic(path, error.lineno, error.colno, "json-syntax", message, hint, source, caret)
        raise InvalidInput(f"{path}: {message}", hint, [found]) from None
    except ValueError:  # Python refuses to read a whole number of more than 4300 digits
        _refuse(path, [("out-of-range", "a number of thousands of digits")], MEASURE_AGAIN)


def _check_format(version: object, path: str) -> None:
    if type(version) is int and version > FORMAT:
        message = f"this record was made by a newer release: {MARKER} is {version}, and this one reads {FORMAT}"
        _refuse(path, [("newer-format", message)], "update curveline, or compare with a record that it made itself")
    if type(version) is not int or version != FORMAT:
        _refuse(path, [("unknown-format", f"{MARKER} is not {FORMAT}")], MEASURE_AGAIN)


def _check(found: _Document, problems: Decoder) -> None:
    """What types do not say."""
    if found.kind not in (ROD, LINK):
        problems.problem("bad-value", f"kind is {found.kind[:40]!r}, not {ROD} or {LINK}")
    for index, row in enumerate(found.rows):
        where = f"rows[{index}]"
        if row.goal and not _is_goal(row.goal):
            problems.problem("bad-value", f"{where}.goal is {row.goal[:40]!r}, which is none")
        if row.spread is not None and row.spread < 0.0:
            problems.problem("out-of-range", f"{where}.spread is below 0")
        if min(row.over_bare_newton or 1.0, row.over_solve_bvp or 1.0) < 0.0:
            problems.problem("out-of-range", f"{where} has a ratio of times below 0")
    if len({row.name for row in found.rows}) < len(found.rows):
        problems.problem("duplicate", "rows: two have the same name")
    if found.machine.cores < 1:
        problems.problem("out-of-range", "machine.cores is below 1")


def _is_goal(goal: str) -> bool:
    try:
        return GOAL.fullmatch(goal) is not None and float(goal.partition(" ")[2]) >= 0.0
    except ValueError:
        return False


def _refuse(path: str, problems: list[tuple[str, str]], hint: str) -> NoReturn:
    found = [Diagnostic(path, 1, 1, code, message, hint) for code, message in problems[:MAX_DIAGNOSTICS]]
    raise InvalidInput(f"{path}: {problems[0][1]}", hint, found)
