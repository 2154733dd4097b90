"""`curveline node` with a board on the desk: what it prints, asks, writes and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import curveline

from .conftest import Run

MOCK = ("--radio", "mock:fresh")


def test_who_a_node_is(run: Run) -> None:
    done = run("node", "info", "1", *MOCK)
    assert (done.code, done.err) == (0, "")
    lines = done.out.splitlines()
    assert lines[1] == "  address C1C1C1C101, channel 76, 1Mbps"
    assert lines[2].endswith("; firmware 4, protocol 2, boot 1")
    assert "  bias: -75.0 to 75.0 deg" in lines


def test_a_jog_with_a_minus(run: Run) -> None:
    done = run("node", "jog", "1", "bias", "-5", *MOCK)
    assert done.code == 0
    assert done.out.splitlines()[0] == "node 1: bias went -5.00 deg, to -5.00"
    again = run("node", "jog", "1", "bias", "-.5", "--radio", "mock", "--json")
    document = json.loads(again.out)
    assert (document["node"], document["jog"]["axis"]) == (1, "bias")
    assert document["jog"]["position"] == pytest.approx(-5.5, abs=0.05)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("jog", "1", "bias", "five"), "BY"),
        (("jog", "1", "tilt", "5"), "AXIS"),
        (("jog", "9", "bias", "5"), "there is no node 9"),
        (("jog", "1", "bias", "nan"), "cannot be jogged by nan"),
        (("jog", "1", "extrude", "--", "--wrong"), "BY"),
        (("blink", "1", "--seconds", "-1"), "cannot flicker for -1 s"),
        (("check", "1", "bias"), "no terminal to ask on"),
        (("tune", "1", "bias"), "no terminal to ask on"),
        (("tune", "1", "bias", "--yes", "-o", "bias.txt"), "cannot tell the format"),
        (("calibrate", "1", "bias", "--yes", "--times", "2", "--measured", "3"), "1 ways are measured, of 2"),
        (("calibrate", "1", "bias", "--yes", "--times", "0"), "cannot be measured 0 times"),
        (("calibrate", "1", "bias", "--yes", "-o", "single"), "built-in display"),
    ],
)
def test_what_makes_no_sense(run: Run, arguments: tuple[str, ...], words: str) -> None:
    done = run("node", *arguments[:3], *MOCK, *arguments[3:]) if "--" in arguments else run("node", *arguments, *MOCK)
    assert done.code == 2, done.out
    assert words in " ".join(done.err.split())


def test_a_board_that_is_wired_wrongly(run: Run) -> None:
    done = run("node", "check", "1", "--radio", "mock:fresh,reversed=translate@1", "--yes")
    assert done.code == 1
    assert "one thing is wrong" in done.out
    assert "    reversed: translate counts down when its motor is driven forwards" in done.out
    assert "swap the motor's two wires" in done.out
    assert done.err.splitlines()[0] == "turning extrude; Ctrl-C stops it"


def test_a_board_that_is_well(run: Run) -> None:
    done = run("node", "check", "1", "bias", *MOCK, "--yes")
    assert done.code == 0
    assert done.out.splitlines()[0] == "node 1 of display single over mock:fresh: all is well"
    assert "seen from the front, extrude should first feed to the right" in done.err


@pytest.mark.parametrize("command", [("info", "1"), ("check", "1", "--yes")])
def test_a_node_on_another_channel(run: Run, command: tuple[str, ...]) -> None:
    done = run("node", *command, "--radio", "mock:fresh,channel=1", "--json")
    assert done.code == 3
    assert "looking on the others" in done.err
    message = json.loads(done.out)["error"]["message"]
    assert message == "node 1 does not answer on channel 76, which the display file names, but on 23"


def test_zero_and_watch(run: Run) -> None:
    done = run("node", "zero", "1", "--radio", "mock:fresh,unhomed=1")
    assert done.code == 0
    assert "  extrude: 0.00 mm" in done.out
    assert "  bias: not homed" in done.out
    seen = run("node", "watch", "1", "--radio", "mock", "--seconds", "0.2")
    assert (seen.code, seen.out.count("supply: 3.30 V")) == (0, 2)
    assert len(run("node", "watch", "1", "--radio", "mock", "--seconds", "0.2", "--json").out.splitlines()) == 2


def test_what_a_ruler_said_is_written(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "lab.toml"
    file.write_text(curveline.builtin_text("single"))
    measured = [part for each in ("50.5", "50.4", "50.6") for part in ("--measured", each)]
    display = ("--display", str(file))
    done = run("node", "calibrate", "1", "extrude", *MOCK, *display, *measured, "--yes", "-o", str(file))
    assert done.code == 0, done.err
    assert "extrude_mm_per_turn = 38.078" in done.out
    assert f"wrote extrude_mm_per_turn into {file}" in done.err
    assert curveline.read_display(file).drive.extrude.counts_per_unit == pytest.approx(8344 / 0.038078, rel=1e-4)
    assert "# pinion of 12 teeth" in file.read_text()


def test_another_gear_is_named_and_not_written(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "lab.toml"
    file.write_text(curveline.builtin_text("single"))
    wish = ("--display", str(file), "-o", str(file), "--yes", "--times", "1")
    done = run("node", "calibrate", "1", "bias", "--radio", "mock:fresh,gear=bias@1", *wish)
    assert done.code == 1
    assert "100:1 in place of 298:1" in " ".join(done.out.split())
    assert "nothing was written: bias_deg_per_turn = 357.6 is for [drive]" in done.err
    assert file.read_text() == curveline.builtin_text("single")
    assert run("node", "calibrate", "1", "bias", *MOCK, *wish).code == 0
    assert curveline.read_display(file).drive.bias.counts_per_unit == pytest.approx(
        curveline.read_display("single").drive.bias.counts_per_unit
    )


@pytest.mark.parametrize("axis", ["extrude", "bias", "translate"])
def test_an_axis_that_is_not_homed_is_calibrated_as_far_as_it_may_go(run: Run, axis: str) -> None:
    done = run("node", "calibrate", "1", axis, "--radio", "mock:fresh,bare", "--yes", "--times", "2")
    assert done.code == 0, done.err
    assert "by its counts 20.0" in done.out


def test_a_switch_that_is_pressed(run: Run) -> None:
    done = run("node", "watch", "1", "--press", *MOCK)
    assert (done.code, done.out.splitlines()[1]) == (0, "  open, then closed, then open")
    stuck = run("node", "watch", "1", "--press", "--radio", "mock:fresh,open=translate@1", "--seconds", "2", "--json")
    assert stuck.code == 1
    (finding,) = json.loads(stuck.out)["switch"]["findings"]
    assert finding["code"] == "switch"
    assert run("node", "watch", "1", "--press", "--seconds", "0.5", *MOCK).code == 2


def test_how_a_motor_answers(run: Run, tmp_path: Path) -> None:
    figure = tmp_path / "bias.svg"
    done = run("node", "tune", "1", "bias", *MOCK, "--yes", "-o", str(figure))
    assert done.code == 0, done.err
    assert "proportional" in done.out
    assert figure.read_text().count("of full duty") == 4
    assert run("node", "tune", "1", "bias", *MOCK, "--yes", "-o", str(figure)).code == 2, "it exists"


CHECK, MEASURE = ("check", "1", "--yes"), ("calibrate", "1", "bias", "--yes", "--times", "1")
TWELVE = (
    ("reversed=extrude@1", CHECK, 1, "swap the motor's two wires"),
    ("swapped=bias@1", CHECK, 1, "the motor of bias turns, and the encoder of translate counts"),
    ("absent=translate@1", CHECK, 1, "no counts came from translate, either way"),
    ("noisy=extrude@1", CHECK, 1, "100 nF across the motor"),
    ("gear=bias@1", MEASURE, 1, "as a gear of 100:1 in place of 298:1 would"),
    ("switch=translate@1", CHECK, 1, "translate's switch is closed, and stays so"),
    ("supply=1", CHECK, 1, "the supply goes down to 2.72 V while a motor turns"),
    ("channel=1", CHECK, 3, "does not answer on channel 76, which the display file names, but on 23"),
    ("key=1", CHECK, 3, "answers, but not to the key of this site"),
    ("firmware=1", CHECK, 3, "has firmware 2, this release needs 3"),
    ("twin=1", CHECK, 1, "two devices answer on the address of node 1"),
    ("loose=bias@1", CHECK, 1, "a loose plug or wire"),
)
"""Boards built wrong, what is typed, its exit code, and words that it says."""


@pytest.mark.parametrize(("wrong", "command", "code", "words"), TWELVE, ids=[row[0] for row in TWELVE])
def test_boards_built_wrong_in_twelve_ways(
    run: Run, wrong: str, command: tuple[str, ...], code: int, words: str
) -> None:
    done = run("node", *command, "--radio", f"mock:fresh,{wrong}")
    assert done.code == code
    assert words in " ".join((done.out + done.err).split())


@pytest.mark.parametrize(
    ("wrong", "words"),
    [("channel=1", "no answer from"), ("firmware=1", "it has firmware 2"), ("twin=1", "2 devices answer")],
)
def test_a_scan_finds_what_needs_no_key(run: Run, wrong: str, words: str) -> None:
    done = run("status", "--scan", "--radio", f"mock:fresh,{wrong}")
    assert done.code == 3
    assert words in " ".join((done.out + done.err).split())


def test_a_status_tells_another_key_from_silence(run: Run) -> None:
    done = run("status", "--radio", "mock:fresh,key=1,channel=2")
    assert done.code == 3
    text = " ".join(done.out.split())
    assert "node 1: C1C1C1C101 answers, but not to the key of this site" in text
    assert "node 2: no answer from C1C1C1C102" in text
