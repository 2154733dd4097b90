"""With --json every failure of every command is an object on stdout, too, and words on stderr."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.core import TyperGroup

from curveline.bench import quick
from curveline.comparing import reading
from curveline.driving import frame_log, logbook
from curveline.driving import runs as all_runs
from curveline.material import drum_readings
from curveline.radio.mock import store
from curveline.radio.site import key_file
from curveline.shapes import files

from .conftest import BROKEN, SHAPES, Run, failure, small_plan
from .test_help import ALL

PEAK = str(SHAPES / "level-up-peak.toml")
READINGS = str(SHAPES.parent / "tests" / "data" / "strip.csv")
TRIAL = str(SHAPES.parent / "tests" / "data" / "level-up-peak-1.csv")
TRIALS = str(SHAPES.parent / "tests" / "data" / "trials")
RADIO = ("--radio", "mock")
COMMANDS: dict[str, tuple[str, ...]] = {
    "simulate": ("simulate", PEAK),
    "fit": ("fit", "--formula", "60*sin(pi*x/500)"),
    "surface": ("surface", "--formula", "60*sin(pi*x/500)", "--lines", "2", "--jobs", "1"),
    "plan": ("plan", PEAK),
    "load": ("load", PEAK),
    "atlas": ("atlas", "single"),
    "send": ("send", PEAK, *RADIO, "--yes"),
    "watch": ("watch", "mock", PEAK, *RADIO, "--count", "1"),
    "status": ("status", *RADIO),
    "stop": ("stop", *RADIO),
    "rod": ("rod", *RADIO),
    "node status": ("node", "status", "1", *RADIO),
    "node clear": ("node", "clear", "1", *RADIO),
    "node home": ("node", "home", "1", *RADIO, "--yes"),
    "node info": ("node", "info", "1", *RADIO),
    "node blink": ("node", "blink", "1", *RADIO),
    "node jog": ("node", "jog", "1", "bias", "-1", *RADIO),
    "node zero": ("node", "zero", "1", *RADIO),
    "node watch": ("node", "watch", "1", *RADIO, "--seconds", "0.1"),
    "node check": ("node", "check", "1", *RADIO, "--yes"),
    "node calibrate": ("node", "calibrate", "1", "bias", *RADIO, "--yes"),
    "node settings": ("node", "settings", "1", *RADIO, "--yes"),
    "node update": ("node", "update", "1", "--hex", "updatable.hex", *RADIO, "--yes"),
    "node tune": ("node", "tune", "1", "bias", *RADIO, "--yes"),
    "radio scan": ("radio", "scan", *RADIO, "--seconds", "1"),
    "radio range": ("radio", "range", "1", *RADIO, "--seconds", "1"),
    "radio log": ("radio", "log", "--seconds", "0.1"),
    "display check": ("display", "check", "single"),
    "runs": ("runs", "--display", "single"),
    "runs show": ("runs", "show", "last"),
    "compare": ("compare", PEAK, TRIAL),
    "calibrate rod": ("calibrate", "rod", TRIALS, "--asymmetry", "none"),
    "camera calibrate": ("camera", "calibrate", "board.jpg"),
    "camera pose": ("camera", "pose", "trial.jpg", "--camera", "camera.toml"),
    "calibrate set": ("calibrate", "set", READINGS),
    "keys show": ("keys", "show"),
    "shapes": ("shapes",),
    "bench": ("bench", "--quick", PEAK),
}
"""Every command that can answer in JSON, as it is typed to do something."""
LINKED = {"send", "watch", "status", "stop", *(name for name in COMMANDS if name.startswith(("node ", "radio ")))}
each_command = pytest.mark.parametrize("name", COMMANDS)


def test_these_are_all_commands_that_answer_in_json() -> None:
    able = {
        " ".join(path)
        for path, command in ALL.items()
        if any("--json" in parameter.opts for parameter in command.params)
    }
    assert able == set(COMMANDS)
    assert all(isinstance(ALL[tuple(name.split())], TyperGroup) is (name == "runs") for name in able)


@each_command
def test_a_wrong_option(run: Run, name: str) -> None:
    code, out, err = run(*COMMANDS[name], "--json", "--wrong")
    assert code == 2
    error = failure(out, 2)
    assert (error["code"], error["message"]) == ("usage", "there is no option --wrong")
    assert f"error: {error['message']}\nhint: {error['hint']}\n" in err


def struck(monkeypatch: pytest.MonkeyPatch, strike: Callable[..., Any]) -> None:
    """Let whatever a command does first go wrong in this way."""
    for module, function in (
        (files, "read_shape"),
        (reading, "read_shape"),
        (quick, "read_shape"),
        (files, "read_display"),
        (drum_readings, "read_drum_readings"),
        (key_file, "read_site"),
        (all_runs, "read_runs"),
        (logbook, "read_run"),
        (frame_log, "overhear"),
    ):
        monkeypatch.setattr(module, function, strike)


@each_command
def test_an_interrupt(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str) -> None:
    a_run(run, tmp_path)

    def strike(*arguments: object) -> None:
        raise KeyboardInterrupt

    struck(monkeypatch, strike)
    code, out, _ = run(*COMMANDS[name], "--json")
    assert code == 130
    assert failure(out, 130)["code"] == "interrupted"


@each_command
def test_a_refusal_of_the_system(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str) -> None:
    a_run(run, tmp_path)

    def strike(*arguments: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "/somewhere")

    struck(monkeypatch, strike)
    code, out, err = run(*COMMANDS[name], "--json")
    assert code == (3 if name in LINKED else 2)
    error = failure(out, code)
    assert error["code"] == ("link" if name in LINKED else "system")
    assert "/somewhere" in error["message"]
    assert f"error: {error['message']}\nhint: {error['hint']}\n" in err


def a_run(run: Run, folder: Path) -> None:
    from curveline.plan_file import write_plan

    write_plan(small_plan(steps=1), folder / "small.json")
    assert run("send", folder / "small.json", "--radio", "mock:fresh", "--yes").code == 0


@pytest.mark.parametrize(
    ("arguments", "exit_code", "code"),
    [
        (("simulate", BROKEN / "many-problems.toml"), 2, "invalid-input"),
        (("simulate", PEAK, "-o", "x.doc"), 2, "invalid-input"),
        (("simulate", PEAK, "--sweep", "nonsense"), 2, "invalid-input"),
        (("plan", BROKEN / "many-problems.toml"), 2, "invalid-input"),
        (("plan", "NO-VALLEY"), 1, "infeasible"),
        (("plan", PEAK, "--seed", "3", "--bow-mm", "1"), 2, "invalid-input"),
        (("load", BROKEN / "many-problems.toml"), 2, "invalid-input"),
        (("load", "NO-VALLEY"), 1, "infeasible"),
        (("send", "NO-VALLEY", *RADIO, "--yes"), 1, "infeasible"),
        (("send", PEAK), 2, "invalid-input"),
        (("send", PEAK, "--radio", "mock:stall=1@step1", "--yes"), 3, "halted"),
        (("send", "nothing.json", *RADIO, "--yes"), 2, "invalid-input"),
        (("send", PEAK, *RADIO), 2, "invalid-input"),
        (("send", "--resume", "last", *RADIO, "--yes"), 2, "invalid-input"),
        (("status",), 2, "invalid-input"),
        (("status", "--radio", "mock:los=0.3"), 2, "invalid-input"),
        (("status", "--radio", "carrier-pigeon"), 2, "invalid-input"),
        (("status", "--radio", "serial:/dev/null"), 2, "invalid-input"),
        (("status", *RADIO, "--display", "quadd"), 2, "invalid-input"),
        (("stop", *RADIO, "--display", "quadd"), 2, "invalid-input"),
        (("node", "status", "7", *RADIO), 2, "invalid-input"),
        (("node", "clear", "7", *RADIO), 2, "invalid-input"),
        (("node", "home", "1", *RADIO), 2, "invalid-input"),
        (("node", "home", "1", "--radio", "mock:silence=1@step1,loss=0.999", "--yes"), 3, "halted"),
        (("display", "check", "quadd"), 2, "invalid-input"),
        (("runs", "--display", "quadd"), 2, "invalid-input"),
        (("runs", "show", "last"), 2, "invalid-input"),
        (("keys", "show"), 2, "invalid-input"),
        (("bench", "--link", "--quick"), 2, "invalid-input"),
        (("bench", "nothing.toml"), 2, "invalid-input"),
    ],
)
def test_what_may_go_wrong(run: Run, no_valley: Path, arguments: tuple[object, ...], exit_code: int, code: str) -> None:
    named = [no_valley if argument == "NO-VALLEY" else argument for argument in arguments]
    if arguments == ("simulate", BROKEN / "many-problems.toml"):
        named.append("--sweep=nodes.1.angle_deg=0:1:2")
    done = run(*named, "--json")
    assert done.code == exit_code, done
    error = failure(done.out, exit_code)
    assert error["code"] == code
    for each in error["diagnostics"]:
        assert set(each) == {"path", "line", "column", "code", "message", "hint", "source"}
        assert each["message"] in done.err
    if not error["diagnostics"]:
        assert f"error: {error['message']}\n" in done.err
        assert not error["hint"] or f"hint: {error['hint']}\n" in done.err


def test_a_radio_that_is_in_use(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from contextlib import closing

    from curveline.drive_settings import drive_settings
    from curveline.radio.mock.display import open_radio

    monkeypatch.setattr(store, "LOCK_WAIT_S", 0.0)
    with closing(open_radio("", drive_settings(files.read_display("single")), tmp_path / "runs")):
        done = run("status", *RADIO, "--json")
    assert done.code == 3
    assert failure(done.out, 3)["code"] == "in-use"


def test_what_ends_a_stream_of_answers_is_its_last_line(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from curveline.cli.commands import status
    from curveline.errors import LinkError

    polls = []

    def sleep(seconds: float) -> None:
        polls.append(seconds)
        if len(polls) == 2:
            raise LinkError("the radio went away")

    monkeypatch.setattr(status.time, "sleep", sleep)
    done = run("status", *RADIO, "--watch", "--json")
    first, second, last = map(json.loads, done.out.splitlines())
    assert (done.code, first["display"], second["display"]) == (3, "single", "single")
    assert last["error"]["message"] == "the radio went away"


def test_a_batch_that_is_cut_short_says_so(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from curveline.simulation import batch

    really, seen = batch.files.read_shape, []

    def read(path: str) -> object:
        seen.append(path)
        if len(seen) == 3:
            raise KeyboardInterrupt
        return really(path)

    monkeypatch.setattr(batch.files, "read_shape", read)
    done = run("simulate", PEAK, PEAK, PEAK, "--json")
    assert done.code == 130
    *answers, last = map(json.loads, done.out.splitlines())
    assert [each["shape"] for each in answers] == ["level-up-peak"] * 2
    assert last["error"]["code"] == "interrupted"


def test_a_missing_extra(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "matplotlib", None)
    done = run("simulate", PEAK, "-o", tmp_path / "out.png", "--json")
    assert failure(done.out, done.code)["code"] == "missing-extra"


def test_json_on_stdout_by_another_name(run: Run) -> None:
    for way in (("-o", "-"), ("-o-",), ("--output", "-"), ("--output=-",)):
        assert failure(run("plan", BROKEN / "syntax.toml", *way).out, 2)["diagnostics"]


def test_without_json_there_is_nothing_on_stdout(run: Run) -> None:
    assert run("plan", BROKEN / "syntax.toml").out == ""
    assert run("plan", "--", "--json").out == ""


def test_an_answer_of_no_is_an_answer_and_no_failure(run: Run, no_valley: Path) -> None:
    done = run("simulate", no_valley, "--json")
    assert done.code == 1
    (line,) = done.out.splitlines()
    assert "segments" in json.loads(line)
    done = run("status", "--radio", "mock:loss=0.99", "--json")
    assert done.code == 3
    (line,) = done.out.splitlines()
    assert [node["state"] for node in json.loads(line)["nodes"]] == ["silent", "silent"]


def test_a_no_to_the_question_is_one(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from curveline.cli import consent

    monkeypatch.setattr(consent, "require_terminal", lambda why, hint: None)
    monkeypatch.setattr(consent, "agrees", lambda question: False)
    done = run("send", PEAK, *RADIO, "--json")
    assert done.code == 1
    assert failure(done.out, 1)["code"] == "no"
    assert "nothing was sent" in done.err
