"""Commands in processes of their own that begin where the import of everything has ended.

A process that starts as `python -m curveline` spends a second of processor time on imports and on loading kernels
before it does anything. Where a test is about what a command does, and not about how it starts, `python()` stands for
the interpreter: what it starts passes arguments, folder, environment and open files on to a server, which forks a
process that does the rest. Signals, exit codes and the end of either one reach the other. Where that would not be the
same (another cache, an option of the interpreter, a terminal, a folder that is gone, no Linux), it becomes the
interpreter itself. Not the same are niceness, signals that are ignored other than those that are forwarded, and that
objects which are left at the end are not taken apart.
"""

from __future__ import annotations

import os
import secrets
import shlex
import socket
import subprocess
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path

HERE = Path(__file__).parent
CAN = sys.platform == "linux" and hasattr(os, "pidfd_open")
READ_AT_ONCE = (
    *("PYTHON", "NUMBA_", "IMITATED", "CURVELINE_CACHE", "CURVELINE_KERNELS", "XDG_CACHE_HOME"),
    *("MPL", "LC_", "LANG"),
)
"""How variables begin that are read while modules are imported or kernels are loaded."""


def read_at_once(environment: Mapping[str, str]) -> dict[str, str]:
    """What of an environment counts while modules are imported."""
    return {name: value for name, value in environment.items() if name.startswith(READ_AT_ONCE)}


def python(environment: Mapping[str, str] | None = None) -> list[str]:
    """What stands for the interpreter in a command that is run with `environment`, or with this process's own."""
    if not CAN:
        return [sys.executable]
    name = _server(tuple(sorted(read_at_once(os.environ if environment is None else environment).items())))
    return [sys.executable, "-IS", str(HERE / "client.py"), name]


def commands(folder: Path) -> Path:
    """A folder to be put first on a PATH: what stands for `curveline` and for `python`."""
    folder.mkdir()
    for name, options in (("curveline", ("-m", "curveline")), ("python", ())):
        command = folder / name
        command.write_text(f'#!/bin/sh\nexec {shlex.join([*python(), *options])} "$@"\n')
        command.chmod(0o755)
    return folder


@cache
def _server(environment: tuple[tuple[str, str], ...]) -> str:
    """The name at which a server with an environment is found; it ends with this process."""
    name = f"curveline-tests-{os.getpid()}-{secrets.token_hex(8)}"
    others = {each: value for each, value in os.environ.items() if each not in read_at_once(os.environ)}
    read, write = os.pipe()  # nobody writes: it closes when this process ends
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(f"\0{name}")
        listener.listen(16)
        subprocess.Popen(
            [sys.executable, str(HERE / "server.py"), str(listener.fileno())],
            env={**others, **dict(environment)},
            stdin=read,
            pass_fds=[listener.fileno()],
        ).returncode = 0  # nobody waits for it
    os.close(read)
    _held.append(write)
    return name


_held: list[int] = []
"""Open ends of pipes."""
