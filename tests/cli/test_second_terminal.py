"""`curveline status` and `curveline stop` while another process sends: two real processes, a mock in real time."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from curveline.driving import halting
from curveline.driving.live import read_live
from curveline.radio.host.journal import Journal, new_run, read_journal

from .conftest import Run
from .sending import LIMIT_S, Sending


@pytest.fixture
def sending(tmp_path: Path) -> Iterator[Sending]:
    process = Sending(tmp_path, "mock:realtime", seconds=2.0, steps=30)
    process.wait_for("step 1 of 30")
    deadline = time.monotonic() + LIMIT_S
    while not is_moving(only_run(tmp_path) / "live.json"):
        assert time.monotonic() < deadline
        time.sleep(0.02)
    yield process
    process.kill()


def is_moving(path: Path) -> bool:
    live = read_live(path)
    return live is not None and all(node.state == "moving" for node in live.nodes)


def only_run(tmp_path: Path) -> Path:
    (journal,) = (tmp_path / "runs").glob("*/journal")
    return journal.parent


def test_status_tells_what_the_sender_says(run: Run, sending: Sending, tmp_path: Path) -> None:
    code, out, err = run("status", "--radio", "mock")
    assert (code, err) == (0, "")
    assert f"by process {sending.process.pid}, which sends small to display single" in " ".join(out.split())
    assert out.count("moving") == 2
    assert "waiting" not in out
    document = json.loads(run("status", "--radio", "mock", "--json").out)
    sender = document["sender"]
    assert (sender["process"], sender["run"], sender["steps"]) == (sending.process.pid, str(only_run(tmp_path)), 30)
    assert 0.0 <= sender["age_s"] < LIMIT_S
    assert [node["state"] for node in document["nodes"]] == ["moving", "moving"]
    assert f"is being sent now by process {sending.process.pid}\n" in run("runs").out


def test_watching_tells_it_too(run: Run, sending: Sending, monkeypatch: pytest.MonkeyPatch) -> None:
    def sleep(seconds: float) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(time, "sleep", sleep)
        code, out, err = run("status", "--radio", "mock", "--watch", "--json")
    assert (code, err) == (130, "")
    assert json.loads(out)["sender"]["process"] == sending.process.pid


def test_stop_reaches_the_sender_and_the_run_goes_on_later(run: Run, sending: Sending, tmp_path: Path) -> None:
    code, out, err = run("stop", "--radio", "mock")
    assert (code, out) == (0, "node 1: stands (hold)\nnode 2: stands (hold)\n")
    folder = only_run(tmp_path)
    assert f"paused by process {sending.process.pid}, which sends small to display single" in err
    assert f"curveline send --resume {folder.name}\n" in err
    ended = sending.end()
    assert ended.code == 130
    document = json.loads(ended.out)
    assert (document["outcome"], document["steps_done"]) == ("paused", 0)
    assert [node["state"] for node in document["nodes"]] == ["hold", "hold"]
    who = f"`curveline stop` in process {os.getpid()}"
    assert f"asked to hold by {who}\n" in ended.err
    assert read_journal(folder / "journal")[-1]["by"] == who
    assert who in run("runs", "show", "last").out
    assert run("send", "--resume", "last", "--radio", "mock", "--yes").code == 0
    assert run("status", "--radio", "mock").code == 0


def test_a_clock_that_runs_ahead_does_not_keep_a_stop_waiting(run: Run, tmp_path: Path) -> None:
    """A mock that is not told to keep real time sends as fast as it can."""
    process = Sending(tmp_path, "mock", seconds=60.0, steps=150)
    process.wait_for("step 1 of 150")
    code, out, err = run("stop", "--radio", "mock", "--json")
    assert code == 0, err
    document = json.loads(out)
    assert [node["state"] for node in document["nodes"]] == ["hold", "hold"]
    assert document["sender"] == {"process": process.process.pid, "run": str(only_run(tmp_path))}
    assert process.end().code == 130


def test_a_killed_sender_does_not_look_alive(run: Run, sending: Sending, tmp_path: Path) -> None:
    sending.kill()
    assert (only_run(tmp_path) / "live.json").exists()
    assert "was cut off after 0 of 30 steps" in run("runs").out
    document = json.loads(run("status", "--radio", "mock", "--json").out)
    assert document["sender"] is None
    code, out, err = run("stop", "--radio", "mock")
    assert (code, out, err) == (0, "node 1: stands (hold)\nnode 2: stands (hold)\n", "")


def test_a_sender_that_does_not_react_is_told(
    run: Run, sending: Sending, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its record is locked and its news are there, but nobody is behind them any more."""
    published = (only_run(tmp_path) / "live.json").read_bytes()
    sending.kill()
    other = new_run(tmp_path / "runs", "deaf")
    journal = Journal(other)
    (other / "live.json").write_bytes(published)
    monkeypatch.setattr(halting, "REACT_S", 0.2)
    code, out, err = run("stop", "--radio", "mock")
    journal.close()
    assert (code, out) == (3, "")
    assert f"process {sending.process.pid}, which sends small to display single, does not react" in err
    assert "switch off the power of the motors" in err


def test_a_stop_while_another_display_is_sent_to_asks_nobody(run: Run, sending: Sending) -> None:
    code, out, err = run("stop", "--radio", "mock", "--display", "quad")
    assert (code, out.count("stands (hold)"), err) == (0, 5, "")
    assert json.loads(run("status", "--radio", "mock", "--json").out)["sender"]["process"] == sending.process.pid
