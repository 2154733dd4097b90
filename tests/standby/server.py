"""Imports everything, loads kernels, and forks a process for every client: see the package."""

from __future__ import annotations

import atexit
import contextlib
import fcntl
import gc
import io
import json
import os
import resource
import runpy
import select
import signal
import socket
import struct
import sys
import threading
import time
from pathlib import Path
from types import ModuleType
from typing import Any, TextIO

TESTS = Path(__file__).parents[1]
SHAPE = TESTS.parent / "shapes" / "level-up-peak.toml"
FAR = 1000
"""A descriptor beyond all that are passed on."""
UNWRITTEN = 120
"""How Python ends where the rest of its output could not be written."""
ERRORS = [stream.errors for stream in (sys.stdin, sys.stdout, sys.stderr)]
ENCODING = sys.stdout.encoding
WRITTEN_AT_ONCE = sys.stdout.write_through  # type: ignore[attr-defined]


def prepare() -> None:
    """Do once what most commands do; for what others are compiling it waits."""
    from compiling import take_turns
    from curveline.cli.app import app

    take_turns()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        for command, *options in (["simulate"], ["plan"], ["send", "--radio", "mock:fresh", "--dry-run"]):
            app([command, str(SHAPE), *options], prog_name="curveline", standalone_mode=False)
    gc.collect()
    gc.freeze()


def serve(listener: socket.socket) -> list[str]:
    """Answer clients until whoever started this is gone; returns in forked processes only, with what they are to do."""
    while True:
        ready, _, _ = select.select([listener, 0], [], [])
        with contextlib.suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
        if 0 in ready:
            os._exit(0)
        client, _ = listener.accept()
        if not os.fork():
            listener.close()
            return attend(client)
        client.close()


def attend(client: socket.socket) -> list[str]:
    """Fork what a client asks for and wait for it; it ends with the client. Returns in the forked process only."""
    from standby import read_at_once

    header, descriptors, _, _ = socket.recv_fds(client, 4, 100)
    request = json.loads(client.recv(*struct.unpack("!I", header), socket.MSG_WAITALL))
    if read_at_once(request["environment"]) != read_at_once(os.environ):
        client.sendall(struct.pack("!i", 0))
        os._exit(0)
    process = os.fork()
    if not process:
        client.close()
        begin(request, descriptors)
        return [str(each) for each in request["arguments"]]
    for descriptor in descriptors:
        os.close(descriptor)
    with contextlib.suppress(OSError):  # who is killed meanwhile is heard of below
        client.sendall(struct.pack("!i", process))
    over = os.pidfd_open(process)
    ready, _, _ = select.select([over, client], [], [])
    if over not in ready:
        os.kill(process, signal.SIGKILL)
    code = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
    with contextlib.suppress(OSError):
        client.sendall(struct.pack("!i", code))
    os._exit(0)


def begin(request: dict[str, Any], descriptors: list[int]) -> None:
    """Be a process that has just started."""
    apart = [fcntl.fcntl(descriptor, fcntl.F_DUPFD_CLOEXEC, FAR) for descriptor in descriptors]
    os.closerange(0, FAR)
    for number, descriptor in zip(request["files"], apart, strict=True):
        os.dup2(descriptor, number)
        os.close(descriptor)
    os.chdir(request["folder"])
    os.environ.clear()
    os.environ.update(request["environment"])
    time.tzset()
    os.umask(request["umask"])
    for number in request["heeded"]:  # what started the server may have been told to ignore some
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_SETMASK, request["blocked"])
    sys.excepthook = sys.__excepthook__  # preparing gave it another one
    streams = [stream(number) if number in request["files"] else None for number in range(3)]
    sys.stdin, sys.stdout, sys.stderr = sys.__stdin__, sys.__stdout__, sys.__stderr__ = streams  # type: ignore[misc]
    for limit, values in request["limits"]:
        if resource.getrlimit(limit) != tuple(values):
            resource.setrlimit(limit, values)


def stream(number: int) -> TextIO:
    """As Python opens it, with PYTHONUNBUFFERED and without."""
    is_raw = WRITTEN_AT_ONCE and number > 0
    file = open(number, "wb" if number else "rb", 0 if is_raw else -1, closefd=False)  # noqa: SIM115
    return io.TextIOWrapper(
        file, ENCODING, ERRORS[number], line_buffering=number == 2 and not is_raw, write_through=is_raw
    )


def run(first: str, *arguments: str) -> None:
    """Do what the interpreter does with `-m MODULE`, `-c TEXT` and the path of a program."""
    if first == "-m":
        sys.path.insert(0, os.getcwd())
        sys.argv = [*arguments]
        runpy.run_module(arguments[0], run_name="__main__", alter_sys=True)
    elif first == "-c":
        sys.path.insert(0, "")
        sys.argv = [first, *arguments[1:]]
        module = sys.modules["__main__"] = ModuleType("__main__")
        exec(compile(arguments[0], "<string>", "exec"), module.__dict__)
    else:
        sys.path.insert(0, str(Path(first).parent))
        sys.argv = [first, *arguments]
        runpy.run_path(first, run_name="__main__")


def leave(code: int) -> None:
    """End as the interpreter does, but for taking a thousand modules apart."""
    threading._shutdown()  # type: ignore[attr-defined]  # waits for all threads that are no daemons
    atexit._run_exitfuncs()
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError:
        code = UNWRITTEN
    with contextlib.suppress(OSError):
        if sys.stderr is not None:
            sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    sys.path[0] = str(TESTS)
    prepare()
    asked = serve(socket.socket(fileno=int(sys.argv[1])))
    del sys.path[0]
    try:
        run(*asked)
    except SystemExit as end:
        if isinstance(end.code, int):
            leave(end.code)
        raise
    leave(0)
