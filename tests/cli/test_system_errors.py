"""What the system refuses: one line on what and where, a hint, an exit code that is no answer, no traceback."""

from __future__ import annotations

import errno
import json
import os
import re
import resource
import shlex
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import pytest
from numba.core import caching

import standby
from curveline.cli.printing import screen
from curveline.cli.printing.progress import compiling
from curveline.kernels import cache, readiness
from curveline.kernels.kernel import njit
from curveline.shapes import files
from worlds import FULL, READ_ONLY, in_a_world

from .conftest import SHAPES, Result, Run

SHAPE = str(SHAPES / "level-up-peak.toml")
COMMAND = (sys.executable, "-m", "curveline")
SWEEP = ("simulate", SHAPE, "--sweep", "nodes.1.angle_deg=-30:30:21")
SHELL = " ".join(COMMAND)


def begun() -> list[str]:
    """What begins a command whose own beginning is not what matters."""
    return [*standby.python({**os.environ, **KERNELS}), "-m", "curveline"]


KERNELS = {"CURVELINE_CACHE": str(cache.home())}
"""For other processes the kernels of this one, which are there already."""


def process(*command: str, limit: Callable[[], None] | None = None, cwd: Path | None = None) -> Result:
    """What a process leaves behind."""
    environment = {**os.environ, **KERNELS}
    done = subprocess.run(
        command, env=environment, cwd=cwd, capture_output=True, text=True, preexec_fn=limit, check=False
    )
    assert "Traceback" not in done.stderr, done.stderr
    return Result(done.returncode, done.stdout, done.stderr)


def told(err: str) -> str:
    """The one error that is told, and its hint."""
    (error,) = [line for line in err.splitlines() if line.startswith("error:")]
    (hint,) = [line for line in err.splitlines() if line.startswith("hint:")]
    return f"{error}\n{hint}"


@pytest.fixture(autouse=True)
def _warm(run: Run) -> None:
    assert run("simulate", SHAPE).code == 0


# Whatever it is, and wherever


REFUSALS = [
    OSError(errno.ENOSPC, "No space left on device", "/somewhere/file"),
    OSError(errno.EROFS, "Read-only file system", "/somewhere/file"),
    PermissionError(errno.EACCES, "Permission denied", "/somewhere/file"),
    FileNotFoundError(errno.ENOENT, "No usable temporary directory found in ['/tmp']"),
    OSError(errno.EMFILE, "Too many open files"),
    BrokenPipeError(errno.EPIPE, "Broken pipe"),
    ConnectionResetError(errno.ECONNRESET, "Connection reset by peer"),
    OSError("something without a number"),
]


KEEP_WHAT_THEY_IMPORT = ("curveline.displays.lint", "curveline.displays.of_plan", "curveline.shapes.new_files")
"""Modules that would go on refusing after the test, were they imported in it."""


@pytest.mark.parametrize("error", REFUSALS, ids=[type(error).__name__ for error in REFUSALS])
@pytest.mark.parametrize(
    ("command", "code", "place"),
    [
        (("simulate", SHAPE), 2, "curveline/simulation/batch.py"),
        (("plan", SHAPE), 2, "curveline/shapes/files.py"),
        (("load", SHAPE), 2, "curveline/cli/commands/load.py"),
        (("display", "check", "single"), 2, "curveline/shapes/files.py"),
        (("send", SHAPE, "--radio", "mock", "--yes"), 3, "curveline/shapes/files.py"),
        (("status", "--radio", "mock"), 3, "curveline/shapes/files.py"),
        (("stop", "--radio", "mock"), 3, "curveline/shapes/files.py"),
        (("keys", "adopt", "--radio", "mock:keys", "--yes"), 3, "curveline/shapes/files.py"),
    ],
    ids=lambda value: value[0] if isinstance(value, tuple) else "",
)
def test_every_refusal_is_told_by_every_command(
    run: Run, monkeypatch: pytest.MonkeyPatch, command: tuple[str, ...], code: int, place: str, error: OSError
) -> None:
    def refuse(*arguments: object) -> None:
        raise error.with_traceback(None)  # else it keeps the frames of the command before, and tells of that

    for name in KEEP_WHAT_THEY_IMPORT:
        import_module(name)
    monkeypatch.setattr(files, "read_shape", refuse)
    monkeypatch.setattr(files, "read_display", refuse)
    found = run(*command)
    assert (found.code, found.out) == (code, "")
    assert (error.strerror or str(error)) in told(found.err)
    assert re.search(error.filename or f"in {place}.*, line [0-9]+", told(found.err))


def test_what_comes_out_of_a_refusal_outside_of_commands_is_told(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(text: str = "") -> None:
        raise OSError(errno.EIO, "Input/output error", "/somewhere")

    monkeypatch.setattr(screen, "result", refuse)
    code, _, err = run("--version")
    assert code == 2
    assert "Input/output error: /somewhere" in told(err)


# As people meet it


@pytest.mark.parametrize("command", [("status",), ("stop",), ("send", "--home", "--yes")])
def test_a_full_disk_under_the_runs(command: tuple[str, ...], tmp_path: Path) -> None:
    arguments = [*COMMAND, *command, "--radio", "mock", "--runs", str(tmp_path)]
    code, out, err = process(*in_a_world([FULL.format(tmp_path)], arguments))
    assert (code, out) == (3, "")
    assert str(tmp_path) in told(err)
    assert "No space left on device" in told(err)
    assert "free space" in told(err)


def no_bytes() -> None:
    """Nothing may be written to any file, as if all disks were full."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))


@pytest.mark.parametrize("command", [("status",), ("stop",), ("send", "--home", "--yes")])
def test_a_disk_that_takes_no_bytes(command: tuple[str, ...], tmp_path: Path) -> None:
    code, out, err = process(*COMMAND, *command, "--radio", "mock", "--runs", str(tmp_path), limit=no_bytes)
    assert (code, out) == (3, "")
    assert "File too large" in told(err)


def test_a_read_only_computer_still_simulates() -> None:
    changes = [READ_ONLY.format(folder) for folder in ("/", "/tmp", "/var/tmp", "/dev/shm", str(cache.folder()))]
    code, out, err = process(*in_a_world(changes, [*COMMAND, "simulate", SHAPE]), cwd=Path("/"))
    assert (code, err) == (0, "")
    assert "valley" in out
    code, _, err = process(*in_a_world(changes, [*COMMAND, "status", "--radio", "mock"]), cwd=Path("/"))
    assert code == 3
    assert "Read-only file system" in told(err)


@pytest.mark.parametrize(
    ("first", "keeps", "says"),
    [
        (True, True, "compiling kernels, about 35 s, once"),
        (True, False, f"compiling kernels, about 35 s, in every run: {cache.wanted()} cannot be written"),
        (False, True, "compiling kernels that are new here, up to half a minute, once"),
        (False, False, f"new here, up to half a minute, in every run: {cache.wanted()} cannot be written"),
    ],
)
def test_what_is_compiled_is_said(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], first: bool, keeps: bool, says: str
) -> None:
    monkeypatch.undo()
    monkeypatch.setattr(readiness, "is_first_run", lambda: first)
    monkeypatch.setattr(compiling, "keeps", lambda: keeps)
    monkeypatch.setattr(caching.IndexDataCacheFile, "load", lambda self, key: None)
    compiling.announce_compilation.cache_clear()
    compiling.announce_compilation()

    @njit
    def new(x: float) -> float:
        return 3.0 * x

    new(1.0)
    new(1)
    err = capsys.readouterr().err
    assert says in err
    assert err.count("compiling") == 1


def few_files() -> None:
    """A process may have 12 files open."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (12, 12))


def test_too_few_files_for_workers() -> None:
    # Points of a planar sweep are computed by threads, which need none.
    code, out, err = process(*COMMAND, *SWEEP, "--model", "extensible", "--jobs", "2", limit=few_files)
    assert (code, out) == (2, "")
    assert "Too many open files" in told(err)
    assert "fewer --jobs" in told(err)


def in_a_deleted_folder(arguments: str, tmp_path: Path) -> subprocess.CompletedProcess[str]:
    """What comes of a command whose current folder was deleted."""
    (tmp_path / "gone").mkdir()
    script = f"cd {tmp_path}/gone && rmdir {tmp_path}/gone && exec {SHELL} {arguments}"
    environment = {**os.environ, "PYTHONPATH": str(Path(files.__file__).parents[2])}
    return subprocess.run(["sh", "-c", script], env=environment, capture_output=True, text=True, check=False)


def test_what_needs_nothing_of_a_deleted_folder_works(tmp_path: Path) -> None:
    done = in_a_deleted_folder(f"simulate {SHAPE}", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert "peak" in done.stdout


@pytest.mark.parametrize("arguments", [f"plan {SHAPE} -o plan.json", "simulate shape.toml"])
def test_a_folder_that_was_deleted_under_the_command(arguments: str, tmp_path: Path) -> None:
    done = in_a_deleted_folder(arguments, tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert "Traceback" not in done.stderr
    assert "the current folder does not exist any more" in told(done.stderr)


# Streams


def test_a_closed_stdin_is_no_terminal_to_ask_on(tmp_path: Path) -> None:
    for arguments in (f"send {SHAPE} --radio mock:fresh", "send --home --radio mock:fresh"):
        code, out, err = process("sh", "-c", f"{shlex.join(begun())} {arguments} --runs {tmp_path} <&-")
        assert (code, out) == (2, "")
        assert "there is no terminal to ask on" in told(err)
        assert "--yes" in told(err)
    assert process("sh", "-c", f"{shlex.join(begun())} {' '.join(SWEEP)} --jobs 2 <&-").code == 0
    assert process("sh", "-c", f"{shlex.join(begun())} status --radio mock --runs {tmp_path} <&- >&- 2>&-").code == 0


def test_adopting_does_not_ask_a_closed_stdin_either(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("CURVELINE_KEYS", str(tmp_path / "site.json"))
    run("keys", "new")
    code, _, err = process("sh", "-c", f"{shlex.join(begun())} keys adopt --radio mock:keys <&-")
    assert code == 2
    assert "--yes" in told(err)


needs_full = pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")


@needs_full
@pytest.mark.parametrize("arguments", ["--help", "--version", "status --radio mock --json"])
def test_results_that_cannot_be_written_are_no_answer(arguments: str, tmp_path: Path) -> None:
    code, _, err = process("sh", "-c", f"{shlex.join(begun())} {arguments} > /dev/full", cwd=tmp_path)
    assert code == 2
    assert "No space left on device" in told(err)


@needs_full
@pytest.mark.parametrize("unbuffered", ["", "1"])  # what is buffered is tried to be written once more at the end
def test_a_run_does_not_end_because_its_news_cannot_be_written(unbuffered: str, tmp_path: Path) -> None:
    environment = {**os.environ, **KERNELS, "PYTHONUNBUFFERED": unbuffered}
    gone, pipe = os.pipe()
    os.close(gone)
    for stderr in (pipe, os.open("/dev/full", os.O_WRONLY)):
        arguments = ["send", "--home", "--radio", "mock:fresh", "--yes", "--json", "--runs", str(tmp_path)]
        done = subprocess.run(
            [*COMMAND, *arguments],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=stderr,
            check=False,
        )
        os.close(stderr)
        assert done.returncode == 0
        assert json.loads(done.stdout)["outcome"] == "done"
