"""Ctrl-C and its like against a real process that moves a mock display in real time."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from curveline.plan import write_plan
from curveline.radio.journal import read_journal

from .conftest import Result, small_plan

LIMIT_S = 30.0


class Sending:
    """A send of three steps of 1.5 s each; its stderr goes to a file, where it can be watched."""

    def __init__(self, folder: Path) -> None:
        write_plan(small_plan(steps=3, seconds=1.5), folder / "plan.json")
        self._said = folder / "said"
        with self._said.open("w") as said:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "curveline", "send", "plan.json", "--radio", "mock:realtime", "--yes", "--json"],
                cwd=folder,
                env={**os.environ, "CURVELINE_RUNS": str(folder / "runs")},
                stdout=subprocess.PIPE,
                stderr=said,
                text=True,
            )

    def wait_for(self, words: str) -> None:
        """Return once these words have been said."""
        deadline = time.monotonic() + LIMIT_S
        while words not in self._said.read_text():
            assert time.monotonic() < deadline, f"{words!r} was not said"
            time.sleep(0.02)

    def signal(self, number: signal.Signals) -> None:
        """Send a signal."""
        self._process.send_signal(number)

    def end(self) -> Result:
        """Wait for the end."""
        out, _ = self._process.communicate(timeout=LIMIT_S)
        return Result(self._process.returncode, out, self._said.read_text())


@pytest.fixture
def sending(tmp_path: Path) -> Iterator[Sending]:
    process = Sending(tmp_path)
    process.wait_for("step 1 of 3")
    yield process
    process.signal(signal.SIGKILL)


def records(tmp_path: Path) -> list[str]:
    (journal,) = (tmp_path / "runs").glob("*/journal")
    return [entry["type"] for entry in read_journal(journal)]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_once_pauses_at_the_barrier(sending: Sending, tmp_path: Path, number: signal.Signals) -> None:
    sending.signal(number)
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
    sending.signal(signal.SIGINT)
    sending.wait_for("pausing")
    sending.signal(signal.SIGINT)
    code, out, err = sending.end()
    assert code == 130
    document = json.loads(out)
    assert (document["outcome"], document["steps_done"]) == ("paused", 0)
    assert [node["state"] for node in document["nodes"]] == ["hold", "hold"]
    assert "holding" in err


def test_three_times_is_an_emergency_stop(sending: Sending, tmp_path: Path) -> None:
    for _ in range(3):
        sending.signal(signal.SIGINT)
        time.sleep(0.05)
    code, out, err = sending.end()
    assert (code, out) == (130, "")
    assert "emergency stop" in err
    assert "Traceback" not in err
    assert records(tmp_path)[-1] == "halt"
