"""Files as people name them on a command line: also standard input, as `-`, and pipes; each is read once."""

from __future__ import annotations

import os
import select
import stat
import sys
import time
from typing import NamedTuple

from curveline.system import portable
from curveline.system.files import AnyPath, read_file, refuse_file, refuse_size

STDIN = "-"
STDIN_NAME = "<stdin>"
"""What messages and results call it; no file is looked for under that name."""
PATIENCE_S = 2.0
"""How long nobody needs to have opened the other end of a pipe: shells start its writer at the same time."""
_PAUSE_S = 0.02
_PIECE = 1 << 16
_STREAMS = ("/dev/", "/proc/")


class GivenFile(NamedTuple):
    """What was read: the name in messages, the bytes, and the folder in which relative paths in it begin."""

    name: str
    data: bytes
    folder: str


def read_given(path: AnyPath, limit: int) -> GivenFile:
    """A file, a pipe, or standard input if the path is `-`, to its end.

    It waits for a writer that is there, as every reader of a pipe does, but for none that is not. Relative paths in
    what comes through a pipe begin in the current folder. InvalidInput for devices, if nothing comes through a pipe,
    and as of `read_file`.
    """
    name = os.fspath(path)
    if name == STDIN:
        return GivenFile(STDIN_NAME, _limited(_read_stdin(limit), STDIN_NAME, limit), "")
    if is_stream(name):
        return GivenFile(name, _limited(_read_pipe(name, limit), name, limit), "")
    folder = "" if name.startswith(_STREAMS) else os.path.dirname(name)
    return GivenFile(name, read_file(name, limit), folder)


def _limited(data: bytes, name: str, limit: int) -> bytes:
    if len(data) > limit:
        refuse_size(name, limit)
    return data


def _read_stdin(limit: int) -> bytes:
    if sys.stdin.isatty():
        hint = "pipe a file into the command, such as: cat FILE | curveline ... -"
        refuse_file(STDIN_NAME, "no-input", "standard input is a terminal, and - means what is piped in", hint)
    data = sys.stdin.buffer.read(limit + 1)
    if not data:
        hint = "pipe a file into the command, and name - once: what was read is gone"
        refuse_file(STDIN_NAME, "no-input", "nothing is left in standard input", hint)
    return data


def is_stream(path: AnyPath) -> bool:
    """Whether a name is that of standard input or of a pipe; what it holds can be read once."""
    try:
        return path == STDIN or (portable.NO_WAIT != 0 and stat.S_ISFIFO(os.stat(path).st_mode))
    except (OSError, ValueError):
        return False


def _read_pipe(name: str, limit: int) -> bytes:
    try:
        descriptor = os.open(name, os.O_RDONLY | portable.NO_WAIT)
    except OSError:
        return read_file(name, limit)  # which says why
    try:
        if not stat.S_ISFIFO(os.fstat(descriptor).st_mode):
            return read_file(name, limit)  # somebody has put something else there
        data = _all_of(descriptor, limit)
    finally:
        os.close(descriptor)
    if not data:
        hint = "start what writes into it, or name a file; a pipe can be read once"
        refuse_file(name, "no-input", "nobody writes into this pipe", hint)
    return data


def _all_of(descriptor: int, limit: int) -> bytes:
    """What comes through a pipe to its end, or until it is too much; nothing if nobody writes."""
    data = bytearray()
    patience_ends = time.monotonic() + PATIENCE_S
    while len(data) <= limit:
        try:
            piece = os.read(descriptor, _PIECE)
        except BlockingIOError:  # there is a writer, who has not written yet
            select.select([descriptor], [], [])
            continue
        if piece:
            data += piece
        elif data or time.monotonic() > patience_ends:
            break
        else:
            time.sleep(_PAUSE_S)
    return bytes(data)
