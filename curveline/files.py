"""Files as strangers hand them over: read with a size limit and never a hang, written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import stat
from pathlib import Path
from typing import NoReturn

from curveline.errors import Diagnostic, InvalidInput

EXCERPT = 120
"""Characters of a source line that a diagnostic shows."""

AnyPath = str | os.PathLike[str]


def read_file(path: AnyPath, limit: int) -> bytes:
    """Bytes of a regular file; InvalidInput if it is missing, closed to us, no file, or above `limit` bytes."""
    name = os.fspath(path)
    try:
        # Opening a device can act on it, opening a pipe waits for a writer: look first, then open without waiting.
        if not stat.S_ISREG(os.stat(name).st_mode):
            _refuse_kind(name)
        descriptor = os.open(name, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with os.fdopen(descriptor, "rb") as stream:
            if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
                _refuse_kind(name)
            data = stream.read(limit + 1)
    except (FileNotFoundError, NotADirectoryError, ValueError):  # ValueError: a NUL in the name
        refuse_file(name, "no-such-file", "there is no such file", "check the spelling and the current folder")
    except PermissionError:
        refuse_file(name, "permission", "reading it is not permitted", "make it readable, for example with chmod u+r")
    except OSError as error:
        refuse_file(name, "unreadable", f"it cannot be read: {error.strerror}", "copy it to a local disk and try again")
    if len(data) > limit:
        hint = "check that this is the file you meant; ours are a few kilobytes"
        refuse_file(name, "too-large", f"the file is larger than {limit:,} bytes", hint)
    return data


def decode_text(data: bytes, name: str) -> str:
    """UTF-8 text with lines that end in a bare newline; InvalidInput at the first byte that is not text."""
    fault = len(data)
    text = ""
    try:
        # A byte order mark is what some editors on Windows put before UTF-8; it carries no meaning.
        text = data.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        fault = error.start + (3 if data.startswith(b"\xef\xbb\xbf") else 0)
    zero = data.find(b"\0", 0, fault)
    if zero >= 0:
        _refuse_byte(data, name, zero, "a zero byte: this is not a text file")
    if fault < len(data):
        _refuse_byte(data, name, fault, f"byte 0x{data[fault]:02x} is not UTF-8 text")
    return text


def write_file(path: AnyPath, data: bytes, *, force: bool = False) -> None:
    """Write a whole file or nothing; InvalidInput if it exists and `force` is not given, or cannot be written.

    The bytes go to a neighbour that then takes the name, so that no reader ever meets half a file.
    """
    name = os.fspath(path)
    target = Path(os.path.realpath(name))
    if target.exists() and not target.is_file():
        _refuse_kind(name)
    if target.exists() and not force:
        refuse_file(name, "exists", "the file exists already", "choose another name, or overwrite it with --force")
    neighbour = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        with open(neighbour, "xb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(neighbour, target)
    except OSError as error:
        with contextlib.suppress(OSError):
            neighbour.unlink()
        hint = "check that the folder exists, may be written and has room"
        refuse_file(name, "unwritable", f"it cannot be written: {error.strerror}", hint)


def excerpt(line: str, column: int) -> tuple[str, int]:
    """At most `EXCERPT` characters of a line around a column, and where that column then stands, both from 1.

    Characters that would steer a terminal are replaced one for one.
    """
    start = 0
    if len(line) > EXCERPT:
        start = max(0, min(column - 1 - EXCERPT // 2, len(line) - EXCERPT))
    shown = "".join(
        c if c.isprintable() or c == "\t" else "\N{REPLACEMENT CHARACTER}" for c in line[start : start + EXCERPT]
    )
    return shown, column - start


def refuse_file(name: str, code: str, message: str, hint: str) -> NoReturn:
    """Raise InvalidInput about a file as a whole."""
    raise InvalidInput(f"{name}: {message}", hint, [Diagnostic(name, 1, 1, code, message, hint)])


def _refuse_kind(name: str) -> NoReturn:
    kind = "a folder" if os.path.isdir(name) else "a device or a pipe"
    refuse_file(name, "not-a-file", f"this is {kind}, not a file", "name a regular file")


def _refuse_byte(data: bytes, name: str, offset: int, message: str) -> NoReturn:
    start = data.rfind(b"\n", 0, offset) + 1
    end = data.find(b"\n", offset)
    before = data[start:offset].decode("utf-8-sig" if start == 0 else "utf-8")
    line = before + data[offset : len(data) if end < 0 else end].decode("utf-8", "replace")
    column = len(before) + 1
    source, caret = excerpt(line, column)
    hint = "save the file as UTF-8 text"
    row = data.count(b"\n", 0, offset) + 1
    raise InvalidInput(
        f"{name}: {message}", hint, [Diagnostic(name, row, column, "encoding", message, hint, source, caret)]
    )
