"""Folders of runs: an order that neither a clock nor a second process upsets."""

from __future__ import annotations

import os
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import pytest

from curveline.errors import LinkError
from curveline.radio.host import run_folder
from curveline.radio.host.journal import new_run
from curveline.radio.host.run_folder import claim_folder, folder_names, number_of, run_names


def test_a_clock_that_is_set_back_does_not_change_the_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = new_run(tmp_path, "b")
    monkeypatch.setattr(time, "strftime", lambda form: "19990101-000000")
    second = new_run(tmp_path, "a")
    os.utime(second, (0, 0))
    assert run_names(tmp_path) == [second.name, first.name]
    assert [number_of(name) for name in run_names(tmp_path)] == [2, 1]


def test_runs_of_earlier_releases_come_first_by_name(tmp_path: Path) -> None:
    for name in ("20991231-235959-new", "20200101-000000-old", "20200101-000000-123456-x", "notes", ".claim-000007"):
        (tmp_path / name).mkdir()
    (tmp_path / "20990101-000000-file").write_text("no folder")
    newest = new_run(tmp_path, "x")
    assert number_of(newest.name) == 8, "a claim that a killed process left counts"
    assert run_names(tmp_path) == [
        newest.name,
        "20991231-235959-new",
        "20200101-000000-old",
        "20200101-000000-123456-x",
    ]
    (tmp_path / "notes" / "journal").touch()
    assert folder_names(tmp_path, "journal")[1] == "notes"


def test_the_number_is_larger_than_all_that_are_there_however_large(tmp_path: Path) -> None:
    (tmp_path / f"{10**40}-20200101-000000-x").mkdir()
    assert number_of(new_run(tmp_path, "y").name) == 10**40 + 1
    (tmp_path / f"{'9' * 230}-20200101-000000-x").mkdir()
    with pytest.raises(LinkError, match="cannot write"):
        new_run(tmp_path, "y" * 60)
    assert run_names(tmp_path / "nowhere") == []


def many(folder: Path, name: str) -> list[int]:
    return [number_of(claim_folder(folder, f"20200101-000000-{name}").name) for _ in range(40)]


def test_two_processes_never_get_the_same_number(tmp_path: Path) -> None:
    with ProcessPoolExecutor(3, get_context("spawn")) as pool:
        found = list(pool.map(partial(many, tmp_path), "abc"))
    assert len({number for each in found for number in each}) == 120
    assert all(each == sorted(each) for each in found)
    assert len(os.listdir(tmp_path)) == 120, "no claim is left"


def test_a_number_that_was_taken_since_it_was_read_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plain, calls = run_folder._taken, []

    def late(runs: Path) -> list[int]:
        found = list(plain(runs))
        if not calls:
            calls.append(1)
            claim_folder(runs, "20200101-000000-quick")
        return found

    monkeypatch.setattr(run_folder, "_taken", late)
    assert number_of(claim_folder(tmp_path, "20200101-000000-slow").name) == 2
    assert sorted(os.listdir(tmp_path)) == ["000001-20200101-000000-quick", "000002-20200101-000000-slow"]
