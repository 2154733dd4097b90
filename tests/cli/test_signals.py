"""Ctrl-C and its like against a real process that moves a mock display in real time."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import standby
from curveline.radio.host.journal import read_journal

from .conftest import failure
from .sending import Sending


@pytest.fixture
def sending(tmp_path: Path) -> Iterator[Sending]:
    process = Sending(tmp_path, "mock:realtime", 1.5, 3, standby.python())
    process.wait_for("step 1 of 3")
    yield process
    process.kill()


def records(tmp_path: Path) -> list[str]:
    (journal,) = (tmp_path / "runs").glob("*/journal")
    return [entry["type"] for entry in read_journal(journal)]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_once_pauses_at_the_barrier(sending: Sending, tmp_path: Path, number: signal.Signals) -> None:
    sending.process.send_signal(number)
    code, out, err = sending.end()
    assert code == 130
    document = json.loads(out)
    assert (document["outcome"], document["steps_done"]) == ("paused", 1)
    assert [node["finished"] for node in document["nodes"]] == [1, 1]
    assert "pausing at the barrier" in err
    assert "send the shape again" in err
    assert "Traceback" not in err
    assert records(tmp_path)[-1] == "pause"


def test_twice_holds_at_once(sending: Sending) -> None:
    sending.process.send_signal(signal.SIGINT)
    sending.wait_for("pausing")
    sending.process.send_signal(signal.SIGINT)
    code, out, err = sending.end()
    assert code == 130
    document = json.loads(out)
    assert (document["outcome"], document["steps_done"]) == ("paused", 0)
    assert [node["state"] for node in document["nodes"]] == ["hold", "hold"]
    assert "holding" in err


def test_three_times_is_an_emergency_stop(sending: Sending, tmp_path: Path) -> None:
    for _ in range(3):
        sending.process.send_signal(signal.SIGINT)
        time.sleep(0.05)
    code, out, err = sending.end()
    assert code == 130
    assert failure(out, 130)["cause"] == "estop"
    assert "emergency stop" in err
    assert "Traceback" not in err
    assert records(tmp_path)[-1] == "halt"
