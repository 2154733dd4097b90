"""`curveline atlas`: a table of 80 columns, files, JSON, and what is said of a wrong grid."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from .conftest import Run

SMALL = ("--over", "angle_deg=-40:40:5", "--over", "length_mm=500:620:7")


def test_a_table_says_which_states_there_are_and_what_they_ask(run: Run) -> None:
    code, out, err = run("atlas", "single", *SMALL)
    assert code == 0
    assert max(map(len, out.splitlines())) <= 80
    assert "angle_deg -40 to 40 in 5 values" in out
    assert "rise_mm 0" in out
    assert "peak, valley" in out
    assert "bifurcations" in out
    assert "located to" in out
    assert not err


def test_the_whole_display_is_the_default(run: Run) -> None:
    code, out, _ = run("atlas", "single", "--brief")
    assert code == 0
    assert out.startswith("single: peak, valley at 1,241 of 1,681 points, ")
    assert len(out.splitlines()) == 1


def test_files_are_written_and_json_is_one_document(run: Run, tmp_path: Path) -> None:
    names = ["a.npz", "a.json", "a.svg"]
    outputs = [part for name in names for part in ("-o", tmp_path / name)]
    code, out, err = run("atlas", "single", *SMALL, "--at", "rise_mm=20", *outputs, "--json")
    assert code == 0
    document = json.loads(out)
    assert document["at"] == {"rise_mm": 20.0}
    kept = json.loads((tmp_path / "a.json").read_text())
    assert {**kept, "seconds": 0.0} == {**document, "seconds": 0.0}
    assert np.load(tmp_path / "a.npz", allow_pickle=False)["kinds"].tolist() == document["kinds"]
    assert "wrote" in err
    assert run("atlas", "single", *SMALL, "-o", tmp_path / "a.npz").code == 2


def test_keys_may_stand_together(run: Run) -> None:
    code, out, _ = run(
        "atlas", "single", "--over", "rise_mm=0:100:3,length_mm=520:560:3", "--at", "left_deg=10,right_deg=5"
    )
    assert code == 0
    assert "left_deg 10, right_deg 5" in out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--over", "length"), "a segment has no number 'length'"),
        (("--over", "angle_deg"), "an atlas is over two keys, not 1"),
        (("--over", "angle_deg=1:2"), "--over 'angle_deg=1:2' is no range"),
        (("--at", "length_mm=500"), "length_mm runs, and stands still"),
        (("--at", "rise_mm"), "--at 'rise_mm' gives no number"),
        (("-o", "a.toml"), "cannot tell the format"),
        (("--scheduler", "localhost"), "is no address of a scheduler"),
        (("--scheduler", "tcp://127.0.0.1:9", "--jobs", "2"), "jobs are processes of this machine"),
    ],
)
def test_what_cannot_be_is_refused(run: Run, options: tuple[str, ...], message: str) -> None:
    code, out, err = run("atlas", "single", *options)
    assert code == 2
    assert not out
    assert message in err
    assert "hint: " in err
