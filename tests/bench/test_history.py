"""The history of the benchmark: what is kept comes back whole, and what was not kept by it is told so."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import curveline
from curveline.bench import history, machine
from curveline.bench.history import from_json, keep_bench, read_bench
from curveline.bench.machine import MachineLoad
from curveline.bench.report import FORMAT, MARKER, document, to_json
from curveline.errors import InvalidInput

from .samples import CONDITIONS, POINT, REPORT, ROW


def edited(**changes: Any) -> str:
    return json.dumps(document(REPORT) | changes)


def problems(text: str) -> dict[str, str]:
    """Codes and messages of what is wrong with a record; each names its file, and says what to do."""
    with pytest.raises(InvalidInput) as caught:
        from_json(text, "old.json")
    assert caught.value.message.startswith("old.json: ")
    assert all(each.path == "old.json" and each.hint for each in caught.value.diagnostics)
    return {each.code: each.message for each in caught.value.diagnostics}


def test_what_is_kept_comes_back(tmp_path: Path) -> None:
    path = keep_bench(REPORT, tmp_path)
    assert re.fullmatch(r"bench/000001-\d{8}-\d{6}-rod/report\.json", str(path.relative_to(tmp_path)))
    assert read_bench(path) == read_bench(path.parent) == read_bench("last", tmp_path) == REPORT
    assert [each.name for each in path.parent.iterdir()] == ["report.json"]
    assert list(curveline.runs(tmp_path)) == []


def test_last_is_the_newest_of_its_kind_whatever_the_clock_says(tmp_path: Path) -> None:
    older = replace(REPORT, conditions=replace(CONDITIONS, at=1.0))
    keep_bench(REPORT, tmp_path)
    keep_bench(older, tmp_path)
    link = replace(REPORT, kind="link", conditions=replace(CONDITIONS, at=5.0))
    keep_bench(link, tmp_path)
    (tmp_path / "bench" / "000009-20260101-000000-rod").mkdir()  # of a run that was killed there
    assert read_bench("last", tmp_path) == older
    assert read_bench("last", tmp_path, "link") == link


def test_there_may_be_no_history(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="there is no run of `curveline bench` in") as caught:
        read_bench("last", tmp_path)
    assert "run `curveline bench` first" in caught.value.hint
    keep_bench(REPORT, tmp_path)
    with pytest.raises(InvalidInput, match="no run of `curveline bench --link`"):
        read_bench("last", tmp_path, "link")


def test_a_folder_that_takes_no_record_is_told(tmp_path: Path) -> None:
    (tmp_path / "bench").write_text("a file")
    with pytest.raises(InvalidInput, match="bench: it cannot be written") as caught:
        keep_bench(REPORT, tmp_path)
    assert "CURVELINE_RUNS" in caught.value.hint


def test_what_a_comparison_adds_to_a_document_may_stay_in_it() -> None:
    assert from_json(edited(compared={"rows": []}), "new.json") == REPORT


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("{", "json-syntax", "this is not JSON"),
        (to_json(REPORT).decode()[:300], "json-syntax", "this is not JSON"),
        ("[1]", "not-a-bench", f"{MARKER} is missing"),
        ('{"a": 1}', "not-a-bench", f"{MARKER} is missing"),
        ('{"curveline_plan": 3}', "wrong-kind", "this is a plan, not a record of a benchmark"),
        ('{"curveline": "0.1.0", "shape": "x"}', "wrong-kind", "this is a result of curveline"),
        ('name = "x"\ndisplay = "single"\nsegments = []\n', "wrong-kind", "this is a shape"),
        ("[" * 100_000, "too-deep", "nested too deep"),
        ("1" * 5000, "out-of-range", "thousands of digits"),
        (edited(**{MARKER: FORMAT + 1}), "newer-format", "made by a newer release"),
        (edited(**{MARKER: 0}), "unknown-format", "is not"),
        (edited(**{MARKER: True}), "unknown-format", "is not"),
        (edited(extra=1), "unknown-key", "no key 'extra'"),
        (edited(rows=[{"name": "x"}]), "missing-key", "rows[0].how is missing"),
        (edited(rows=[vars(ROW) | {"value": "fast"}]), "wrong-type", "rows[0].value must be a number"),
        (edited(rows=[vars(ROW) | {"value": 1e300}]), "out-of-range", "rows[0].value is 1e+300"),
        (edited(rows=[vars(ROW) | {"name": "\x1b[2J"}]), "bad-value", "cannot be shown"),
        (edited(rows=[vars(ROW) | {"goal": "near 3"}]), "bad-value", "rows[0].goal"),
        (edited(rows=[vars(ROW) | {"goal": "< 1e"}]), "bad-value", "rows[0].goal"),
        (edited(rows=[vars(ROW) | {"spread": -0.1}]), "out-of-range", "rows[0].spread"),
        (edited(rows=[vars(ROW) | {"over_bare_newton": -1.0}]), "out-of-range", "rows[0] has a ratio"),
        (edited(rows=[vars(ROW)] * 2), "duplicate", "same name"),
        (edited(kind="lunch"), "bad-value", "kind is 'lunch'"),
        (edited(machine=vars(CONDITIONS.machine) | {"cores": 0}), "out-of-range", "machine.cores"),
        (edited(machine=None), "wrong-type", "machine must be an object"),
        (edited(versions={"python": 3}), "wrong-type", "versions.python must be a string"),
        (edited(trade=[vars(POINT) | {"pareto": 1}]), "wrong-type", "trade[0].pareto must be true or false"),
        (edited(compared=float("nan")), "not-finite", "compared"),
    ],
)
def test_a_record_that_cannot_be_trusted_says_why(text: str, code: str, message: str) -> None:
    found = problems(text)
    assert message in found[code]


def test_a_file_that_is_none_is_told(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="there is no such file"):
        read_bench(tmp_path / "gone.json")
    with pytest.raises(InvalidInput, match=r"report\.json: there is no such file"):
        read_bench(tmp_path)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InvalidInput, match="not a file"):
        read_bench(tmp_path / "pipe")
    (tmp_path / "large.json").write_bytes(b" " * (history.MAX_BYTES + 1))
    with pytest.raises(InvalidInput, match="larger than"):
        read_bench(tmp_path / "large.json")
    (tmp_path / "bytes.json").write_bytes(b"\xff\xfe")
    with pytest.raises(InvalidInput, match="not UTF-8"):
        read_bench(tmp_path / "bytes.json")


def test_conditions_are_those_of_this_machine() -> None:
    found = machine.conditions()
    assert found.curveline == curveline.__version__
    assert found.kernels in ("shipped", "numba", "interpreted")
    assert None not in (found.versions.python, found.versions.numpy, found.versions.numba, found.versions.llvmlite)
    assert found.machine.cores >= 1
    assert found.machine.processor
    # A tree without its repository, as CI may have it, has no commit.
    assert found.commit is None or re.fullmatch("[0-9a-f]{40}[+]?", found.commit)


def test_what_others_do_is_not_what_oneself_does(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = iter([(100.0, 1000.0), (110.0, 1100.0), (160.0, 1300.0)])
    own = iter([5.0, 35.0])
    monkeypatch.setattr(machine, "_ticks", lambda: next(seen))
    monkeypatch.setattr(machine, "_own_ticks", lambda: next(own))
    monkeypatch.setattr(machine, "LOOK_S", 0.0)
    load = machine.Watch().load()
    assert (load.before, load.during) == (pytest.approx(0.1), pytest.approx(0.1))


@pytest.mark.parametrize(
    ("load", "is_busy"),
    [
        (MachineLoad(0.1, 0.0, 0.0), False),
        (MachineLoad(5.0, 0.0, 0.0), False),  # of what was over when it began
        (MachineLoad(0.0, 0.3, 0.0), True),
        (MachineLoad(0.0, 0.0, 0.3), True),
        (MachineLoad(0.9), False),
        (MachineLoad(1.1), True),
        (MachineLoad(), False),
    ],
)
def test_a_busy_machine_is_noticed(load: MachineLoad, is_busy: bool) -> None:
    assert load.is_busy(2) is is_busy


@pytest.mark.parametrize(("setting", "kernels"), [("python", "interpreted"), ("numba", "numba")])
def test_which_kernels_run_is_said(monkeypatch: pytest.MonkeyPatch, setting: str, kernels: str) -> None:
    monkeypatch.setenv("CURVELINE_KERNELS", setting)
    machine.library.cache_clear()
    try:
        assert machine.kernels_that_run() == kernels
    finally:
        machine.library.cache_clear()


def test_a_system_that_tells_nothing_leaves_the_load_open(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: Path, **how: object) -> str:
        raise OSError

    monkeypatch.setattr(Path, "read_text", refuse)
    assert machine.Watch().load().before is None
    told: Callable[[], str] = machine._processor
    assert told()
