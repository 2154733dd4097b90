"""`curveline stop`: who stands, who does not, and who cannot be asked."""

from __future__ import annotations

import json
from contextlib import closing
from pathlib import Path

import pytest

from curveline.drive_settings import drive_settings
from curveline.driving import halting
from curveline.radio.interface import open_radio
from curveline.radio.mock import store
from curveline.shapes.files import read_display

from .conftest import Run


def test_every_node_confirms(run: Run) -> None:
    assert run("stop", "--radio", "mock") == (0, "node 1: stands (hold)\nnode 2: stands (hold)\n", "")
    document = json.loads(run("stop", "--radio", "mock", "--json", "--display", "quad").out)
    assert [(node["node"], node["state"], node["is_sure"]) for node in document["nodes"]] == [
        (number, "hold", True) for number in range(1, 6)
    ]


def test_a_silent_node_is_told_and_is_a_fault(run: Run) -> None:
    code, out, _ = run("stop", "--radio", "mock:loss=0.999,seed=1")
    assert code == 3
    assert out.count("NOT SURE, no answer from") == 2
    code, out, _ = run("stop", "--radio", "mock:loss=0.999,seed=1", "--json")
    assert code == 3
    assert [node["state"] for node in json.loads(out)["nodes"]] == [None, None]


def test_a_device_with_another_key_is_told(run: Run) -> None:
    code, out, _ = run("stop", "--radio", "mock:chip=2")
    assert code == 3
    assert "node 1: stands (hold)" in out
    assert "node 2: NOT SURE, C1C1C1C102 acknowledges, but not under the key of this site" in out


def test_a_radio_must_be_named_and_help_says_what_this_is_not(run: Run) -> None:
    assert run("stop").code == 2
    assert "no safety circuit" in " ".join(run("stop", "--help").out.split())


def test_a_display_that_is_in_use_by_somebody_who_says_nothing(
    run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(store, "LOCK_WAIT_S", 0.0)
    monkeypatch.setattr(halting, "FREE_S", 0.2)
    with closing(open_radio("mock", drive_settings(read_display("single")), tmp_path / "runs")):
        code, out, err = run("stop", "--radio", "mock")
    assert (code, out) == (3, "")
    assert "the mock display 'single' is in use by process" in err
    assert "end that program, whose nodes then hold by themselves within 7 s, or switch off the power" in err
