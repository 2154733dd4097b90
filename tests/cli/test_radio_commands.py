"""`curveline radio`: what it prints, writes and refuses."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from curveline.driving import frame_log

from .conftest import Run
from .sending import LIMIT_S, Sending

NOISY = ("--radio", "mock:fresh,noise=13,seed=5", "--seconds", "20")


def test_a_noisy_channel_and_what_to_do(run: Run, tmp_path: Path) -> None:
    figure = tmp_path / "band.svg"
    done = run("radio", "scan", *NOISY, "-o", str(figure))
    assert done.code == 1
    lines = done.out.splitlines()
    assert lines[0] == "display single over mock:fresh,noise=13,seed=5"
    assert lines[1] == "159 looks at each of 126 channels in 20 s, and nothing sent"
    assert max(map(len, lines)) <= 80
    assert "take channel 23" in done.out
    assert "nothing is sent; Ctrl-C ends it" in done.err
    words = figure.read_text()
    assert all(word in words for word in ("the display: 76", "channel to take: 23", "WLAN 13"))
    assert run("radio", "scan", *NOISY, "-o", str(figure)).code == 2, "it exists"


def test_a_quiet_one(run: Run) -> None:
    done = run("radio", "scan", "--radio", "mock:fresh", "--seconds", "5", "--json")
    assert done.code == 0
    document = json.loads(done.out)
    assert (document["display"], document["advised"], document["present"]["channel"]) == ("single", 76, 76)
    assert len(document["channels"]) == 126


def test_how_well_a_node_is_heard(run: Run, tmp_path: Path) -> None:
    figure, table = tmp_path / "range.svg", tmp_path / "range.csv"
    weak = ("range", "2", "--radio", "mock:fresh,weak=12,seed=5", "--seconds", "12")
    done = run("radio", *weak, "-o", str(figure))
    assert done.code == 0, done.err
    lines = done.out.splitlines()
    assert lines[0] == "node 2 of display single over mock:fresh,weak=12,seed=5, for 12 s"
    assert [line.split()[0] for line in lines[2:6]] == ["max", "high", "low", "min"]
    assert max(map(len, lines)) <= 80
    assert "with 6 dB less it still is" in done.out
    assert all(f"{level}, " in figure.read_text() for level in ("max", "high", "low", "min"))
    found = re.findall(r' y="([\d.]+)"[^>]*>(time|max,|high,|low,|min,)', figure.read_text())
    heights = {word: float(height) for height, word in found}
    assert heights.pop("time") < min(heights.values()), "no line is where the legend is"
    document = json.loads(run("radio", *weak, "--level", "max", "--level", "min", "--json").out)
    assert [each["level"] for each in document["levels"]] == ["max", "min"]
    assert run("radio", *weak, "-o", str(table)).code == 0
    assert table.read_text().startswith("level,dbm,at_s,polls,lost,retries\nmax,0,")


@pytest.mark.parametrize(
    ("wrong", "code", "words"),
    [
        ("weak=0", 1, "not good enough for runs at 0 dBm"),
        ("channel=1", 3, "does not answer on channel 76, which the display file names, but on 23"),
        ("twin=1", 1, "2 devices answer"),
    ],
)
def test_a_node_that_is_not_heard_well(run: Run, wrong: str, code: int, words: str) -> None:
    done = run("radio", "range", "1", "--radio", f"mock:fresh,{wrong}", "--seconds", "4")
    assert done.code == code
    assert words in " ".join((done.out + done.err).split())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("1", "--seconds", "0"), "cannot be measured for 0 s"),
        (("9",), "there is no node 9"),
        (("1", "--level", "most"), "--level"),
        (("1", "-o", "range.npz"), "cannot tell the format"),
    ],
)
def test_ranges_that_make_no_sense(run: Run, arguments: tuple[str, ...], words: str) -> None:
    done = run("radio", "range", *arguments, "--radio", "mock")
    assert done.code == 2, done.out
    assert words in " ".join(done.err.split())
    assert "cannot be measured" not in words or "Ctrl-C" not in done.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--radio", "mock", "--seconds", "0"), "cannot be measured for 0 s"),
        (("--radio", "mock", "--seconds", "nan"), "cannot be measured for nan s"),
        (("--radio", "mock", "--seconds", "1e9"), "to 86400 s"),
        (
            (
                "--radio",
                "mock:noise=14",
            ),
            "noise=14 cannot be read",
        ),
        (
            (
                "--radio",
                "mock:noise=6@1",
            ),
            "cannot be read",
        ),
        (
            (
                "--radio",
                "mock:noise=6@0.2@3",
            ),
            "cannot be read",
        ),
        (
            (
                "--radio",
                "mock:noise",
            ),
            "noise takes a value",
        ),
        (
            (
                "--radio",
                "mock:weak=100",
            ),
            "weak=100 cannot be read",
        ),
        (("--radio", "mock", "-o", "band.txt"), "cannot tell the format"),
        ((), "no radio was named"),
    ],
)
def test_what_makes_no_sense(run: Run, arguments: tuple[str, ...], words: str) -> None:
    done = run("radio", "scan", *arguments)
    assert done.code == 2, done.out
    assert words in " ".join(done.err.split())
    assert "0 s" not in words or "Ctrl-C" not in done.err


def test_what_another_command_says_is_shown_as_it_passes(run: Run, tmp_path: Path) -> None:
    """The other one in another process, as in another terminal."""
    sending = Sending(tmp_path, "mock:realtime", seconds=0.2, steps=30)
    sending.wait_for("step 1 of 30")
    try:
        done = run("radio", "log", "--seconds", "1", "--node", "2", "--type", "drive")
        documents = run("radio", "log", "--seconds", "0.7", "--json").out.splitlines()
    finally:
        sending.kill()
    assert done.code == 0
    lines = done.out.splitlines()
    assert max(map(len, lines)) <= 80
    assert len(lines) > 20
    assert all(" 2 > drive   release " in line or " < status " in line for line in lines)
    assert "WRONG" not in done.out
    told = [json.loads(line) for line in documents]
    assert {each["process"] for each in told} == {sending.process.pid}
    assert {each["node"] for each in told} == {1, 2}
    assert {each["answer"]["tag"] for each in told if each["answer"]} == {"good"}
    assert all(each["sent"]["type"] == "drive" and each["sent"]["fields"]["counter"] > 0 for each in told)


def test_ctrl_c_ends_it_well(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def strike(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(frame_log, "overhear", strike)
    done = run("radio", "log")
    assert (done.code, done.out) == (130, "")
    assert done.err == "listening to the commands that use this runs folder; Ctrl-C ends it\n"


@pytest.mark.parametrize("ending", ["reader", "interrupt", "kill"])
def test_whoever_listens_may_go_at_any_time(tmp_path: Path, ending: str) -> None:
    """The reader of its pipe leaves, as `head` does; Ctrl-C; or it is killed. The run that is being sent goes on."""
    sending = Sending(tmp_path, "mock:realtime", seconds=0.3, steps=8)
    sending.wait_for("step 1 of 8")
    command = [sys.executable, "-m", "curveline", "radio", "log", "--runs", str(tmp_path / "runs")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as listening:
        assert listening.stdout is not None
        assert " > drive " in listening.stdout.readline()
        if ending == "reader":
            listening.stdout.close()
        else:
            listening.send_signal(signal.SIGINT if ending == "interrupt" else signal.SIGKILL)
        code = listening.wait(LIMIT_S)
        assert listening.stderr is not None
        said = listening.stderr.read().splitlines()
    assert code == {"reader": 1, "interrupt": 130, "kill": -signal.SIGKILL}[ending]
    assert len(said) == 1, said
    left = list((tmp_path / "runs" / "listeners").iterdir())
    assert len(left) == (ending == "kill")
    ended = sending.end()
    assert (ended.code, json.loads(ended.out)["outcome"]) == (0, "done")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [(("--type", "drives"), "there is no frame 'drives'"), (("--seconds", "-1"), "-1 s"), (("--node", "x"), "--node")],
)
def test_logs_that_make_no_sense(run: Run, arguments: tuple[str, ...], words: str) -> None:
    done = run("radio", "log", *arguments)
    assert done.code == 2, done.out
    assert words in " ".join(done.err.split())


def test_a_node_that_there_is_not_is_refused_before_anything_is_said(run: Run) -> None:
    code, out, err = run("radio", "range", "7", "--radio", "mock")
    assert (code, out) == (2, "")
    assert "there is no node 7" in err
    assert "polling" not in err
