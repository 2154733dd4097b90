"""`curveline status`: every node's word as a table and as JSON."""

from __future__ import annotations

import json
import os
import time
from contextlib import closing
from pathlib import Path

import pytest

from curveline.cli.commands import status as command
from curveline.drive_settings import DriveSettings, drive_settings
from curveline.driving.live import published
from curveline.radio.host.journal import Journal, new_run
from curveline.radio.host.link import Control
from curveline.radio.interface import InUse, Radio
from curveline.radio.mock import store
from curveline.radio.mock.air import Air, Heard
from curveline.radio.mock.display import open_radio
from curveline.radio.mock.mock_node import Station
from curveline.radio.ports import serial
from curveline.radio.protocol.codes import Fault
from curveline.shapes.files import read_display

from .conftest import Run, small_plan
from .test_send import NODE_KEYS


def test_a_table_on_80_columns(run: Run) -> None:
    code, out, err = run("status", "--radio", "mock")
    assert (code, err) == (0, "")
    assert all(len(line) <= 80 for line in out.splitlines())
    assert out.splitlines()[0] == "display single over mock"
    assert out.count("ready") == 2
    assert out.endswith("rod: not known\n")


def test_json_holds_every_field(run: Run) -> None:
    code, out, err = run("status", "--radio", "mock", "--json")
    assert (code, err) == (0, "")
    document = json.loads(out)
    assert set(document) == {"curveline", "display", "radio", "nodes", "rod", "sender"}
    assert [node["node"] for node in document["nodes"]] == [1, 2]
    for node in document["nodes"]:
        assert set(node) == NODE_KEYS
        assert node["state"] == "ready"
        assert node["fault"] is None
        assert node["counts"] == [0, 0, 0]
        assert node["position"] == {"extrude_mm": 0.0, "bias_deg": 0.0, "translate_mm": 0.0}
        assert set(node["link"]) == {"polls", "answered", "lost", "retries", "bad_tags"}


def test_the_display_may_be_named(run: Run) -> None:
    assert len(json.loads(run("status", "--radio", "mock", "--display", "quad", "--json").out)["nodes"]) == 5
    code, out, err = run("status", "--radio", "mock", "--display", "quadd")
    assert (code, out) == (2, "")
    assert "error[unknown-display]" in err
    assert "quad" in err


def test_a_radio_must_be_named(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    assert run("status").code == 2
    monkeypatch.setenv("CURVELINE_RADIO", "mock")
    assert run("status").code == 0
    code, _, err = run("status", "--radio", "mock:loss=2")
    assert code == 2
    assert "loss" in err


def test_a_silent_node_is_a_fault(run: Run) -> None:
    code, out, _ = run("status", "--radio", "mock:loss=0.99")
    assert code == 3
    assert "node 1: no answer from C1C1C1C101" in out
    code, out, _ = run("status", "--radio", "mock:loss=0.99", "--json")
    assert code == 3
    node = json.loads(out)["nodes"][0]
    assert node["state"] == "silent"
    assert [node[key] for key in ("boot", "counts", "position", "fault")] == [None] * 4


def test_a_fault_is_told(run: Run, plan_file: Path) -> None:
    run("send", plan_file, "--radio", "mock:stall=2@step2", "--yes")
    code, out, _ = run("status", "--radio", "mock")
    assert code == 3
    assert "node 2: fault stall (extrude)" in out
    assert json.loads(run("status", "--radio", "mock", "--json").out)["nodes"][1]["fault"] == "stall (extrude)"


@pytest.mark.parametrize("option", [(), ("--json",)])
def test_watching_goes_on_until_interrupted(run: Run, monkeypatch: pytest.MonkeyPatch, option: tuple[str, ...]) -> None:
    polls = []

    def sleep(seconds: float) -> None:
        polls.append(seconds)
        if len(polls) == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(time, "sleep", sleep)
    code, out, _ = run("status", "--radio", "mock", "--watch", *option)
    assert code == 130
    assert polls == [command.POLL_SECONDS] * 3
    if option:
        assert [json.loads(line)["display"] for line in out.splitlines()] == ["single"] * 3
    else:
        assert out.count("display single over mock") == 3


def test_watching_waits_while_a_run_has_the_display(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(store, "LOCK_WAIT_S", 0.0)
    radio = open_radio("", drive_settings(read_display("single")), tmp_path / "runs")
    polls = []

    def sleep(seconds: float) -> None:
        polls.append(seconds)
        if len(polls) == 2:
            radio.close()
        if len(polls) == 4:
            raise KeyboardInterrupt

    monkeypatch.setattr(time, "sleep", sleep)
    code, out, err = run("status", "--radio", "mock", "--watch", "--json")
    assert code == 130
    assert err.count("waiting: the mock display 'single' is in use by process") == 1
    assert "a run may be on" in err
    assert len(out.splitlines()) == 2


def test_a_scan_names_every_device(run: Run) -> None:
    code, out, err = run("status", "--radio", "mock", "--scan")
    assert (code, err) == (0, "")
    assert all(len(line) <= 80 for line in out.splitlines())
    *lines, others = out.splitlines()
    assert others == "others send on no channel; the display is on 76"
    chips = [line.split()[2] for line in lines[2:]]
    code, out, _ = run("status", "--radio", "mock:loss=0.2,seed=4", "--scan", "--json")
    assert code == 0
    document = json.loads(out)
    assert [node["devices"][0]["chip"] for node in document["nodes"]] == chips
    for node in document["nodes"]:
        assert node["problems"] == []
        assert node["link"]["polls"] == 21
        assert node["link"]["retries"] > 0
        assert {"chip", "firmware", "boot", "state", "bad_tags", "version"} <= set(node["devices"][0])


def test_two_devices_on_one_address_are_a_fault(run: Run) -> None:
    code, out, _ = run("status", "--radio", "mock:twin=2", "--scan")
    assert code == 3
    assert "node 2: 2 devices answer on C1C1C1C102: chips" in out
    code, out, _ = run("status", "--radio", "mock:loss=0.999", "--scan")
    assert code == 3
    assert out.count("silent") == 2


def test_radio_chips_are_tested_as_far_as_that_goes(run: Run) -> None:
    code, out, err = run("status", "--radio", "mock", "--radio-test")
    assert code == 0
    assert out.count("dropped") == 2
    assert "Not tested: packets without acknowledgement" in err
    code, out, _ = run("status", "--radio", "mock:clone=1", "--radio-test")
    assert code == 3
    assert "cut short" in out
    document = json.loads(run("status", "--radio", "mock:clone=1", "--radio-test", "--json").out)
    assert [node["drops_repeats"] for node in document["nodes"]] == [None, True]


def test_a_chip_that_lets_repeats_through_is_a_doubt(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    exchange = Station.exchange

    def forgetful(station: Station, air: Air, payload: bytes, now_us: int) -> Heard:
        station.antenna.last = (-1, -1)
        return exchange(station, air, payload, now_us)

    monkeypatch.setattr(Station, "exchange", forgetful)
    code, out, _ = run("status", "--radio", "mock", "--radio-test")
    assert code == 3
    assert out.count("let through") == 2
    assert "node 1: its radio chip lets repeats through: it is no original" in out


def test_only_one_question_at_a_time(run: Run) -> None:
    for pair in (("--scan", "--watch"), ("--scan", "--radio-test"), ("--watch", "--radio-test")):
        code, out, err = run("status", "--radio", "mock", *pair)
        assert (code, out) == (2, "")
        assert "different questions" in err


@pytest.mark.parametrize(
    ("memory", "state", "words"),
    [
        ({"estop": True}, "estop", "node 2 has been stopped for good by an emergency stop; find out why"),
        ({"unhomed": [0, 15, 0]}, "unhomed", "it has not been homed; home it: `curveline node home 2`"),
        ({"fault": int(Fault.ENCODER), "fault_axis": 1}, "position-lost", "node 2: fault encoder (extrude)"),
        ({"fault": int(Fault.STALL), "fault_axis": 2}, "fault", "node 2: fault stall (bias)"),
    ],
)
def test_a_node_that_cannot_move_is_a_fault(
    run: Run, tmp_path: Path, memory: dict[str, object], state: str, words: str
) -> None:
    assert run("status", "--radio", "mock").code == 0
    path = tmp_path / "runs" / "mock-single.json"
    content = json.loads(path.read_text())
    content["nodes"][1] |= memory
    path.write_text(json.dumps(content))
    code, out, _ = run("status", "--radio", "mock")
    assert (code, state in out.split()) == (3, True)
    assert words in " ".join(out.split())
    code, out, _ = run("status", "--radio", "mock", "--json")
    assert code == 3
    nodes = json.loads(out)["nodes"]
    assert (nodes[0]["obstacle"], nodes[0]["advice"]) == (None, None)
    assert nodes[1]["obstacle"].startswith("node 2 ")
    assert nodes[1]["advice"]


def test_a_radio_that_sends_to_another_display_is_in_use_by_somebody(
    run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A dongle that drives one display cannot be asked about another."""

    def busy(settings: str, drive: DriveSettings, runs: Path) -> Radio:
        raise InUse("the port p is in use by another program")

    monkeypatch.setattr(serial, "open_radio", busy)
    plan = small_plan()
    run_folder = new_run(tmp_path / "runs", "small")
    with (
        closing(Journal(run_folder)),
        published(run_folder, plan, "serial:p", Control()) as publisher,
    ):
        publisher.look()
        assert run("status", "--radio", "serial:p").code == 3, "its nodes have said nothing yet"
        code, out, err = run("status", "--radio", "serial:p", "--display", "quad")
        assert (code, out) == (3, "")
        who = f"process {os.getpid()}, which sends small to display single"
        assert f"the port p is in use by another program: {who}\n" in err
    code, out, err = run("status", "--radio", "serial:p")
    assert (code, out) == (3, "")
    assert "by another program\n" in err
