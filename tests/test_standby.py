"""What stands for the interpreter does as it does: streams, folder, environment, exit codes, signals, and its end."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import standby

pytestmark = pytest.mark.skipif(not standby.CAN, reason="elsewhere it is the interpreter itself")

FACTS = """
import os, sys
print(sys.argv[1:], os.getcwd(), os.environ["FOUND"], __name__, sys.stdin.read())
print("curveline.cli.app" in sys.modules, file=sys.stderr)
sys.exit(7)
"""
LONG = "import os, time; print(os.getpid(), flush=True); time.sleep(60)"
READY = "True\n"
"""What `FACTS` says where everything was imported before."""


def run(*command: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*standby.python(), *command],
        input="given",
        cwd=folder,
        env={**os.environ, "FOUND": "found", **environment},
        capture_output=True,
        text=True,
        check=False,
    )


def test_streams_folder_environment_and_exit_code_are_passed_on(tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(FACTS)
    for command in (("-c", FACTS), ("program.py",), ("-m", "program")):
        done = run(*command, "a", "b c", folder=tmp_path)
        assert (done.returncode, done.stderr) == (7, READY)
        assert done.stdout == f"['a', 'b c'] {tmp_path} found __main__ given\n"


def test_every_open_file_is_passed_on() -> None:
    read, write = os.pipe()
    os.write(write, b"piped")
    os.close(write)
    command = [*standby.python(), "-c", f"import os; print(os.read({read}, 9))"]
    assert subprocess.run(command, pass_fds=[read], stdout=subprocess.PIPE, check=True).stdout == b"b'piped'\n"
    os.close(read)


def test_an_error_is_told_and_a_command_is_a_command(tmp_path: Path) -> None:
    done = run("-c", "1 / 0", folder=tmp_path)
    assert (done.returncode, "ZeroDivisionError" in done.stderr) == (1, True)
    done = run("-m", "curveline", "sennd", folder=tmp_path)
    assert (done.returncode, "no such command 'sennd'" in done.stderr) == (2, True)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_signals_reach_it_and_nothing_outlives_whoever_is_killed(number: signal.Signals) -> None:
    with subprocess.Popen(
        [*standby.python(), "-c", LONG],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        preexec_fn=lambda: signal.signal(number, signal.SIG_DFL) if number != signal.SIGKILL else None,
    ) as process:
        assert process.stdout is not None
        inner = int(process.stdout.readline())
        assert inner != process.pid
        process.send_signal(number)
        assert process.wait(10.0) == -number
    deadline = time.monotonic() + 10.0
    while Path(f"/proc/{inner}").exists():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_where_it_would_not_be_the_same_it_is_the_interpreter(tmp_path: Path) -> None:
    assert run("-c", FACTS, folder=tmp_path, CURVELINE_CACHE=str(tmp_path)).stderr != READY
    assert run("-c", FACTS, folder=tmp_path, PYTHONIOENCODING="latin-1").stderr != READY


def test_what_is_closed_is_closed(tmp_path: Path) -> None:
    code = "import os, sys; print(sys.stdin, os.open('.', os.O_RDONLY)); sys.exit(sys.stderr is not None)"
    for python in (standby.python(), [sys.executable]):
        command = ["sh", "-c", 'exec "$@" <&- 2>&-', "sh", *python, "-c", code]
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
        assert (done.returncode, done.stdout) == (0, "None 0\n")


THREAD = "import threading, time; threading.Thread(target=lambda: (time.sleep(0.2), print('late'))).start()"
INHERITED = """
import os, resource, signal, sys, time
umask = os.umask(0)
os.umask(umask)
blocked = [number.name for number in signal.pthread_sigmask(signal.SIG_BLOCK, [])]
print(umask, resource.getrlimit(resource.RLIMIT_FSIZE), blocked, time.tzname, sys.excepthook is sys.__excepthook__)
"""


def confine() -> None:
    """What a process may be told before it begins."""
    os.umask(0o027)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
    signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR1])


def said(*command: str, **environment: str) -> tuple[int, str]:
    done = subprocess.run(
        command,
        env={**os.environ, **environment},
        input="print(5)\n",
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=confine,
        check=False,
    )
    return done.returncode, done.stdout


@pytest.mark.parametrize(
    "arguments", [("-c", INHERITED), ("-c", THREAD), ("-O", "-c", "print(__debug__)"), ("-W", "error", "-c", "0"), ()]
)
def test_it_inherits_waits_and_takes_options_as_the_interpreter_does(arguments: tuple[str, ...]) -> None:
    expected = said(sys.executable, *arguments, TZ="Asia/Tokyo")
    assert said(*standby.python(), *arguments, TZ="Asia/Tokyo") == expected
    assert expected[0] == 0


@pytest.mark.parametrize("name", ["CURVELINE_KERNELS", "XDG_CACHE_HOME"])
def test_what_kernels_are_loaded_by_is_not_passed_over(name: str, tmp_path: Path) -> None:
    assert run("-c", FACTS, folder=tmp_path, **{name: "numba"}).stderr != READY
