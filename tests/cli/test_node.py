"""`curveline node`: one node's words, and what brings it back to work."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import typer

from curveline.driving.live import published
from curveline.radio.host.journal import Journal, new_run
from curveline.radio.host.link import Control

from .conftest import SHAPES, Run, small_plan

SHAPE = SHAPES / "level-down-peak.toml"


def test_a_sound_node_says_all_of_itself(run: Run) -> None:
    done = run("node", "status", "1", "--radio", "mock:fresh")
    assert (done.code, done.err) == (0, "")
    assert done.out.splitlines() == [
        "node 1 of display single over mock:fresh: ready",
        "  boot 1: the power came on",
        "  extrude: 0.00 mm",
        "  bias: 0.00 deg",
        "  translate: 0.00 mm",
        "  steps of its last run: 0 begun, 0 done",
    ]


def test_a_fault_says_which_and_since_when_and_what_helps(run: Run) -> None:
    run("send", SHAPE, "--radio", "mock:fresh,stall=1@step2", "--yes")
    found = run("node", "status", "1", "--radio", "mock")
    assert found.code == 3
    assert "  steps of its last run: 2 begun, 1 done" in found.out
    assert "  fault: stall (bias), for 0 s" in found.out
    assert "`curveline node clear 1`" in found.out
    cleared = run("node", "clear", "1", "--radio", "mock")
    assert cleared.code == 0
    assert "fault" not in cleared.out


def test_what_is_printed_as_json(run: Run) -> None:
    run("send", SHAPE, "--radio", "mock:fresh,encoder=2@step1", "--yes")
    found = run("node", "status", "2", "--radio", "mock", "--json")
    assert found.code == 3
    document = json.loads(found.out)
    assert (document["display"], document["radio"]) == ("single", "mock")
    node = document["node"]
    assert (node["node"], node["state"], node["fault"], node["boot_cause"]) == (
        *(2, "position-lost", "encoder (extrude)", "power-on"),
    )
    assert node["unhomed"] == {"extrude": "encoder"}
    assert node["fault_seconds"] >= 0


def test_clearing_a_lost_position_says_that_homing_is_what_helps(run: Run) -> None:
    run("send", SHAPE, "--radio", "mock:fresh,encoder=2@step1", "--yes")
    done = run("node", "clear", "2", "--radio", "mock")
    assert done.code == 3
    assert "`curveline node home 2`" in done.out


def test_homing_takes_the_axes_that_are_named(run: Run) -> None:
    run("status", "--radio", "mock:fresh,unhomed=1")
    one = run("node", "home", "1", "--axis", "bias", "--radio", "mock", "--yes")
    assert one.code == 0, "what was asked for is done"
    assert "extrude: not homed" in one.out
    assert "bias: 0.00 deg" in one.out
    others = run("node", "home", "1", "--axis", "translate", "--axis", "extrude", "--radio", "mock", "--yes")
    assert (others.code, others.out.splitlines()[0]) == (0, "node 1 of display single over mock: ready")
    assert "node 1 is homing; Ctrl-C stops it" in others.err


def test_homing_asks_where_there_is_somebody_to_ask(run: Run) -> None:
    done = run("node", "home", "1", "--radio", "mock:fresh")
    assert done.code == 2
    assert "add --yes" in done.err


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("status", "3"), 2, "there is no node 3: display 'single' has nodes 1 to 2"),
        (("home", "0", "--yes"), 2, "there is no node 0"),
        (("home", "1", "--axis", "yaw", "--yes"), 2, "--axis takes extrude, bias or translate, not yaw"),
        (("status",), 2, "Usage: curveline node status [OPTIONS] N"),
    ],
)
def test_what_is_not_there_is_refused(run: Run, arguments: tuple[str, ...], code: int, message: str) -> None:
    done = run("node", *arguments, "--radio", "mock:fresh")
    assert (done.code, message in done.err) == (code, True), done.err


def test_the_advice_names_the_display(run: Run) -> None:
    done = run("node", "status", "4", "--display", "quad", "--radio", "mock:fresh,unhomed=4")
    assert done.code == 3
    assert "`curveline node home 4 --display quad`" in done.out
    again = run("node", "home", "4", "--display", "quad", "--radio", "mock", "--yes")
    assert again.code == 0
    refused = run("node", "home", "4", "--display", "quad", "--radio", "mock:busy=4", "--yes")
    assert "`curveline stop --display quad`" in refused.err


def test_ctrl_c_stops_a_node_that_is_homing(run: Run, tmp_path: Path) -> None:
    run("send", SHAPE, "--radio", "mock:fresh,reboot=1@step3", "--yes")
    command = [sys.executable, "-m", "curveline", "node", "home", "1", "--radio", "mock:realtime", "--yes"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=dict(os.environ)) as homing:
        assert homing.stderr is not None
        assert "is homing" in homing.stderr.readline()
        time.sleep(0.3)
        homing.send_signal(signal.SIGINT)
        rest = homing.stderr.read()
    assert homing.returncode == 130
    assert "stopped" in rest
    assert "unhomed" in rest
    stands = run("node", "status", "1", "--radio", "mock")
    assert "unhomed" in stands.out


def test_homing_does_not_hide_another_fault(run: Run) -> None:
    run("send", SHAPE, "--radio", "mock:fresh,runaway=1@step2", "--yes")
    done = run("node", "home", "1", "--radio", "mock", "--yes")
    assert done.code == 3
    assert "fault: runaway (bias)" in done.out
    assert "`curveline node clear 1`" in done.out


def test_a_motor_that_stays_absent_is_named_with_what_to_look_at(run: Run) -> None:
    run("status", "--radio", "mock:fresh,unhomed=1")
    done = run("node", "home", "1", "--radio", "mock:absent=bias@1", "--yes")
    assert done.code == 3
    assert "are they connected, is the way free?" in " ".join(done.out.split())
    status = run("status", "--radio", "mock:absent=bias@1")
    assert status.code == 3
    assert "node 1 has not found the zeros of all its axes: bias (encoder)" in " ".join(status.out.split())


def test_a_homing_that_is_killed_leaves_a_node_that_can_be_homed(run: Run, tmp_path: Path) -> None:
    run("send", SHAPE, "--radio", "mock:fresh,reboot=1@step3", "--yes")
    command = [sys.executable, "-m", "curveline", "node", "home", "1", "--radio", "mock:realtime", "--yes"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=dict(os.environ)) as homing:
        assert homing.stderr is not None
        assert "is homing" in homing.stderr.readline()
        homing.kill()
    assert run("node", "status", "1", "--radio", "mock").code == 3
    assert run("node", "home", "1", "--radio", "mock", "--yes").code == 0
    assert run("status", "--radio", "mock").code == 0


@pytest.mark.parametrize("command", [("status",), ("clear",), ("home", "--yes")])
def test_while_this_computer_sends_the_node_is_the_senders(
    run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, command: tuple[str, ...]
) -> None:
    plan = small_plan()
    folder = new_run(tmp_path / "runs", "small")
    with closing(Journal(folder)), published(folder, plan, "mock", Control()) as publisher:
        publisher.look()
        done = run("node", command[0], "1", *command[1:], "--radio", "mock")
    assert (done.code, done.out) == (3, "")
    assert f"the radio is in use by process {os.getpid()}, which sends small to display single" in done.err
    assert "`curveline stop` pauses it" in done.err
    assert run("node", command[0], "1", *command[1:], "--radio", "mock").code == 0


@pytest.mark.parametrize(("answer", "code"), [(False, 1), (typer.Abort, 130)])
def test_homing_asks_first_and_a_no_moves_nothing(
    run: Run, monkeypatch: pytest.MonkeyPatch, answer: Any, code: int
) -> None:
    asked = []

    def confirm(question: str, err: bool) -> bool:
        asked.append(question)
        if isinstance(answer, type):
            raise answer
        return bool(answer)

    run("status", "--radio", "mock:fresh,unhomed=1")
    for name in ("stdin", "stderr"):
        monkeypatch.setattr(getattr(sys, name), "isatty", lambda: True)
    monkeypatch.setattr(typer, "confirm", confirm)
    assert run("node", "home", "1", "--axis", "translate", "--axis", "extrude", "--radio", "mock").code == code
    assert asked == ["Is the rod out of node 1's clamp? Move its extrude, translate?"]
    assert "not homed" in run("node", "status", "1", "--radio", "mock").out


def test_homing_without_a_terminal_wants_a_yes(run: Run) -> None:
    refused = run("node", "home", "1", "--radio", "mock")
    assert (refused.code, refused.out) == (2, "")
    assert "add --yes to agree" in refused.err
