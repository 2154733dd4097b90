"""What is piped in is read as a file is: as `-`, by the name of a pipe, once, and without waiting for nobody."""

from __future__ import annotations

import io
import json
import os
import shlex
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

import standby
from curveline.shapes.files import MAX_BYTES, builtin_text
from curveline.system import given_files
from curveline.system.given_files import read_given

from .conftest import SHAPES, Run

SHAPE = SHAPES / "level-up-peak.toml"
TEXT = SHAPE.read_bytes()
Pipe = Callable[[bytes | Path], None]


@pytest.fixture
def pipe(monkeypatch: pytest.MonkeyPatch) -> Pipe:
    """Let the next command find some bytes, or a file, in standard input."""

    def set_stdin(content: bytes | Path) -> None:
        data = content if isinstance(content, bytes) else content.read_bytes()
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data)))

    return set_stdin


@contextmanager
def written(path: Path, pieces: Callable[[], Iterator[bytes]]) -> Iterator[None]:
    """A pipe into which somebody writes meanwhile; whoever reads may leave early."""
    os.mkfifo(path)

    def write() -> None:
        with suppress(BrokenPipeError), open(path, "wb", buffering=0) as stream:
            for piece in pieces():
                stream.write(piece)

    thread = threading.Thread(target=write, daemon=True)
    thread.start()
    yield
    thread.join(10.0)
    assert not thread.is_alive()


def test_a_shape_comes_in_as_a_dash(run: Run, pipe: Pipe) -> None:
    pipe(TEXT)
    code, out, _ = run("simulate", "-", "--no-drawing")
    assert code == 0
    assert out.startswith("level-up-peak\n")
    pipe(TEXT)
    document = json.loads(run("simulate", "-", "--json").out)
    assert document["provenance"]["shape"]["path"] == "<stdin>"


@pytest.mark.parametrize(
    "command", [("load", "-", "--most-N", "1", "--json"), ("simulate", "-", "--sweep", "nodes.1.angle_deg=20:30:2")]
)
def test_every_command_for_a_shape_takes_a_dash(run: Run, pipe: Pipe, command: tuple[str, ...]) -> None:
    pipe(TEXT)
    code, out, err = run(*command)
    assert code == 0, err
    assert "level-up-peak" in out


def test_a_plan_or_a_shape_is_told_by_what_is_in_it(run: Run, pipe: Pipe, plan_file: Path) -> None:
    pipe(plan_file)
    assert json.loads(run("plan", "-", "--json").out)["name"] == "small"
    pipe(plan_file)
    code, out, err = run("send", "-", "--radio", "mock:fresh", "--yes", "--json")
    assert (code, json.loads(out)["outcome"]) == (0, "done"), err
    pipe(TEXT)
    code, out, err = run("send", "-", "--radio", "mock:fresh", "--dry-run", "--json")
    assert code == 0, err
    pipe(TEXT)
    begun = run("plan", "--from", "-", "--home", "--json")
    assert json.loads(begun.out)["steps"][-1]["shape"] == "home"
    pipe(plan_file)
    code, _, err = run("send", "-", SHAPE, "--radio", "mock", "--yes")
    assert code == 2
    assert "a plan is taken by itself" in err


def test_a_display_comes_in_as_a_dash(run: Run, pipe: Pipe) -> None:
    mine = builtin_text("single").replace('"single"', '"mine"').encode()
    pipe(mine)
    document = json.loads(run("display", "check", "-", "--json").out)
    assert (document["display"], document["file"]) == ("mine", "<stdin>")
    pipe(mine)
    assert json.loads(run("status", "--display", "-", "--radio", "mock", "--json").out)["display"] == "mine"
    pipe(mine)
    code, _, err = run("send", "--home", "--display", "-", "--radio", "mock", "--yes")
    assert code in (0, 1), err


def test_what_is_wrong_in_standard_input_is_told_as_of_a_file(run: Run, pipe: Pipe) -> None:
    pipe(TEXT.replace(b"660.0", b"660,5"))
    code, out, err = run("simulate", "-")
    assert (code, out) == (2, "")
    assert "<stdin>:9:28: error[toml-syntax]" in err
    assert "write `660.5` instead of `660,5`" in err
    pipe(builtin_text("single").encode())
    assert "this is a display file, not a shape" in run("simulate", "-").err


def test_standard_input_is_read_once(run: Run, pipe: Pipe) -> None:
    pipe(TEXT)
    code, out, err = run("simulate", "-", "-", "--no-drawing")
    assert code == 1
    assert out.count("level-up-peak") == 1
    assert "nothing is left in standard input" in err
    assert "name - once" in err
    pipe(b"")
    assert "nothing is left in standard input" in run("plan", "-").err


def test_a_terminal_is_not_waited_for(run: Run, pipe: Pipe, monkeypatch: pytest.MonkeyPatch) -> None:
    pipe(TEXT)
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True)
    code, _, err = run("simulate", "-")
    assert code == 2
    assert "standard input is a terminal" in err


def test_displays_of_what_is_piped_in_are_looked_for_in_the_current_folder(
    run: Run, pipe: Pipe, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "lab").mkdir()
    (tmp_path / "lab" / "mine.toml").write_text(builtin_text("single").replace('"single"', '"mine"'))
    text = TEXT.replace(b'"single"', b'"mine.toml"')
    monkeypatch.chdir(tmp_path / "lab")
    pipe(text)
    assert "display mine" in run("simulate", "-", "--no-drawing").out
    with written(tmp_path / "shape", lambda: iter([text])):
        assert "display mine" in run("simulate", "../shape", "--no-drawing").out


def test_a_pipe_is_read_to_its_end_however_slowly_it_is_written(tmp_path: Path) -> None:
    def slowly() -> Iterator[bytes]:
        time.sleep(0.3)  # it is open, and nothing has come yet
        yield TEXT[:100]
        time.sleep(0.3)
        yield TEXT[100:]

    with written(tmp_path / "pipe", slowly):
        given = read_given(tmp_path / "pipe", MAX_BYTES)
    assert (given.data, given.folder) == (TEXT, "")


def test_a_writer_may_come_late(tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    late = threading.Timer(0.3, path.write_bytes, (TEXT,))
    late.start()
    assert read_given(path, MAX_BYTES).data == TEXT
    late.join()


@pytest.mark.parametrize("comes", [False, True], ids=["nobody", "somebody who says nothing"])
def test_nobody_is_waited_for(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, comes: bool) -> None:
    monkeypatch.setattr(given_files, "PATIENCE_S", 0.2)
    path = tmp_path / "pipe"
    begin = time.monotonic()
    if comes:
        with written(path, lambda: iter(())):
            code, _, err = run("simulate", path)
    else:
        os.mkfifo(path)
        code, _, err = run("simulate", path)
    assert time.monotonic() - begin < 5.0
    assert code == 2
    assert "nobody writes into this pipe" in err


def test_size_limits_hold_for_what_never_ends(run: Run, pipe: Pipe, tmp_path: Path) -> None:
    def endless() -> Iterator[bytes]:
        while True:
            yield b"#" * 65536

    with written(tmp_path / "pipe", endless):
        assert f"larger than {MAX_BYTES:,} bytes" in run("simulate", tmp_path / "pipe").err
    pipe(b"#" * (MAX_BYTES + 1))
    assert f"larger than {MAX_BYTES:,} bytes" in run("simulate", "-").err


def test_devices_are_left_alone(run: Run) -> None:
    for device in ("/dev/zero", "/dev/null", "/dev/tty"):
        code, _, err = run("simulate", device)
        assert code == 2
        assert "this is a device or a pipe, not a file" in err


def test_a_pipe_that_a_file_names_is_not_opened(run: Run, pipe: Pipe, tmp_path: Path) -> None:
    """Whoever wrote the shape may have named anything; only people who type a name know what they name."""
    os.mkfifo(tmp_path / "pipe.toml")
    begin = time.monotonic()
    pipe(TEXT.replace(b'"single"', f'"{tmp_path}/pipe.toml"'.encode()))
    code, _, err = run("simulate", "-")
    assert code == 2
    assert "pipe.toml:1:1: error[not-a-file]" in err
    pipe(TEXT.replace(b'"single"', b'"-"'))
    assert "there is no built-in display '-'" in run("simulate", "-").err
    assert time.monotonic() - begin < given_files.PATIENCE_S


SHELL = {
    "a file as standard input": "{curveline} simulate - --no-drawing < {shape}",
    "a pipe as standard input": "cat {shape} | {curveline} simulate - --no-drawing",
    "its name, a file": "{curveline} simulate /dev/stdin --no-drawing < {shape}",
    "its name, a pipe": "cat {shape} | {curveline} simulate /dev/stdin --no-drawing",
    "a process": "{curveline} simulate <(cat {shape}) --no-drawing",
    "two processes": "{curveline} simulate <(cat {shape}) <(cat {shape}) --no-drawing",
}


@pytest.mark.parametrize("line", SHELL.values(), ids=SHELL)
def test_what_a_shell_pipes_in(line: str) -> None:
    command = line.format(curveline=shlex.join([*standby.python(), "-m", "curveline"]), shape=SHAPE)
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("level-up-peak\n")


def test_a_closed_standard_input_is_an_empty_one() -> None:
    command = f"{sys.executable} -m curveline simulate - <&-"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 2
    assert "nothing is left in standard input" in done.stderr
