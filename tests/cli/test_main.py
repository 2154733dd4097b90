"""The command line as a whole: help, version, streams, colours."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

import curveline
from curveline.cli.printing import screen, terminal

from .conftest import BROKEN, SHAPES, Run

COMMANDS = ("simulate", "plan", "send", "status", "stop", "load", "bench")
COMMAND = (sys.executable, "-m", "curveline")
SHAPE = str(SHAPES / "level-up-peak.toml")


def test_version(run: Run) -> None:
    assert run("--version") == (0, f"curveline {curveline.__version__}\n", "")


def test_help_names_every_command_and_exit_code(run: Run) -> None:
    code, out, err = run("--help")
    assert (code, err) == (0, "")
    for word in (*COMMANDS, "keys", "0 done", "1 it ran", "2 usage", "3 radio", "130 interrupted"):
        assert word in out


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help_for_every_option(run: Run, command: str) -> None:
    code, out, err = run(command, "--help")
    assert (code, err) == (0, "")
    assert "Exit codes" in out
    options = [line for line in out.splitlines() if line.startswith("  -")]
    assert options
    assert "--json" in out


@pytest.mark.parametrize(
    "arguments", [(), ("simulate",), ("plan",), ("send",), ("load",), ("simulat",), ("status", "x")]
)
def test_wrong_usage_is_told_on_stderr(run: Run, arguments: tuple[str, ...]) -> None:
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert "Usage: curveline" in err


def test_an_interrupt_is_130_and_no_traceback(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from curveline.shapes import files

    def interrupt(path: str) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(files, "read_shape", interrupt)
    assert run("simulate", SHAPE).code == 130


def test_a_question_that_finds_nobody_is_no_traceback(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    from curveline.shapes import files

    def ask(path: str) -> None:
        raise EOFError

    monkeypatch.setattr(files, "read_shape", ask)
    assert run("simulate", SHAPE).code == 130


def test_a_reader_that_leaves_early_is_no_error_to_talk_about() -> None:
    # A pipe holds 64 kB: more than that, and the writer meets a closed one.
    command = [*COMMAND, "simulate", "--json", "--points", "5000", *[SHAPE] * 3]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.read(100)
        process.stdout.close()
        err = process.stderr.read().decode()
    assert process.returncode == 1
    assert "Traceback" not in err
    assert "Broken" not in err


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_full_disk_under_stdout_is_said() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [*COMMAND, "simulate", SHAPE], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 2
    assert "cannot write the result" in done.stderr
    assert "Traceback" not in done.stderr


def test_closed_streams_and_plain_encodings_are_no_reason_to_fail() -> None:
    shell = f"{' '.join(COMMAND)} simulate {SHAPE}"
    assert subprocess.run(["sh", "-c", f"{shell} >&- 2>&-"], check=False).returncode == 0
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = subprocess.run([*COMMAND, "simulate", SHAPE], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert done.stdout.isascii()
    assert "#" in done.stdout


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


def test_colour_is_for_terminals_that_want_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    assert screen.paint("word", screen.BOLD, Terminal()) == "\x1b[1mword\x1b[0m"
    assert screen.paint("word", screen.BOLD, io.StringIO()) == "word"
    for name, value in (("NO_COLOR", "1"), ("TERM", "dumb"), ("CI", "true")):
        with monkeypatch.context() as patch:
            patch.setenv(name, value)
            assert screen.paint("word", screen.BOLD, Terminal()) == "word"
    monkeypatch.setenv("NO_COLOR", "1")
    assert terminal.is_live(Terminal())


def test_a_caret_stands_under_its_column_behind_tabs(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "tabs.toml"
    text = (SHAPES / "level-up-peak.toml").read_text()
    file.write_text(text + "\tcolour\t= 3\n")
    _, _, err = run("simulate", file)
    lines = err.splitlines()
    at = lines.index("  \tcolour\t= 3")
    assert lines[at + 1] == "  \t^"


def test_nothing_of_a_terminal_reaches_a_pipe(run: Run) -> None:
    for arguments in (("simulate", SHAPE), ("simulate", BROKEN / "syntax.toml"), ("plan", SHAPE)):
        result = run(*arguments)
        assert "\x1b" not in result.out + result.err
