"""Commands in a terminal of some size, and what a person would see there."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

import pytest

ESCAPES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
ERASED = "\x1b[J"
LIMIT_S = 120.0


class Shown(NamedTuple):
    """How a command ended, all that came to the terminal, and the longest time [s] in which nothing did."""

    code: int
    raw: str
    silence: float

    @property
    def lines(self) -> list[str]:
        """Every line that was ever shown, drawn over or not, without colours."""
        return [
            part for line in ESCAPES.sub("", self.raw.replace("\r\n", "\n")).split("\n") for part in line.split("\r")
        ]

    @property
    def left(self) -> str:
        """What is left on the screen at the end, where lines that were drawn over are of one row."""
        return "\n".join(
            ESCAPES.sub("", line.rpartition(ERASED)[2]) for line in self.raw.replace("\r\n", "\n").split("\n")
        )


def in_terminal(
    *arguments: str,
    columns: int = 80,
    rows: int = 24,
    cwd: Path | None = None,
    settings: Mapping[str, str] | None = None,
    heard: Callable[[str, subprocess.Popen[bytes]], object] = lambda text, process: None,
) -> Shown:
    """Run curveline with both of its streams on a terminal; `heard` is told all that has come so far."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
    environment = {**os.environ, "TERM": "xterm-256color", **(settings or {})}
    for name in ("CI", "NO_COLOR", "COLUMNS", "LINES", "CURVELINE_RADIO"):
        environment.pop(name, None)
    environment.update(settings or {})
    command = [sys.executable, "-m", "curveline", *arguments]
    process = subprocess.Popen(command, stdin=slave, stdout=slave, stderr=slave, cwd=cwd, env=environment)
    os.close(slave)
    try:
        return _read(master, process, heard)
    finally:
        os.close(master)
        if process.poll() is None:
            process.send_signal(signal.SIGKILL)
            process.wait()


@contextmanager
def here(monkeypatch: pytest.MonkeyPatch, columns: int = 80, rows: int = 24) -> Iterator[list[str]]:
    """Let this process write to a terminal; all that came to it is in the list at the end."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
    found: list[bytes] = []
    reader = threading.Thread(target=_drain, args=(master, found))
    reader.start()
    shown: list[str] = []
    try:
        with monkeypatch.context() as patch, os.fdopen(slave, "w", encoding="utf-8") as stream:
            patch.setenv("TERM", "xterm-256color")
            patch.setattr(sys, "stdout", stream)
            patch.setattr(sys, "stderr", stream)
            yield shown
    finally:
        reader.join()
        os.close(master)
        shown.append(b"".join(found).decode(errors="replace"))


def _drain(master: int, found: list[bytes]) -> None:
    with suppress(OSError):  # the other end is closed
        while chunk := os.read(master, 65536):
            found.append(chunk)


def _read(
    master: int, process: subprocess.Popen[bytes], heard: Callable[[str, subprocess.Popen[bytes]], object]
) -> Shown:
    found, silence = bytearray(), 0.0
    last = begin = time.monotonic()
    while time.monotonic() - begin < LIMIT_S:
        if not select.select([master], [], [], 0.1)[0]:
            continue
        try:
            chunk = os.read(master, 65536)
        except OSError:  # the other end is closed
            chunk = b""
        now = time.monotonic()
        silence, last = max(silence, now - last), now
        if not chunk:
            return Shown(process.wait(LIMIT_S), found.decode(errors="replace"), silence)
        found += chunk
        heard(found.decode(errors="replace"), process)
    raise AssertionError(f"no end within {LIMIT_S} s: {found.decode(errors='replace')}")
