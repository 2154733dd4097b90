"""Files as strangers hand them over: read with a size limit and never a hang, written whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import os
import shlex
import stat
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, NoReturn

from curveline.errors import Diagnostic, InvalidInput
from curveline.system import portable

EXCERPT = 76
"""Characters of a source line that a diagnostic shows."""

AnyPath = str | os.PathLike[str]


def read_file(path: AnyPath, limit: int) -> bytes:
    """Bytes of a regular file; InvalidInput if it is missing, closed to us, no file, or above `limit` bytes.

    FileNotFoundError without a name if the current folder, in which it would be, is gone.
    """
    name = os.fspath(path)
    try:
        # Opening a device can act on it, opening a pipe waits for a writer: look first, then open without waiting.
        if not stat.S_ISREG(os.stat(name).st_mode):
            _refuse_kind(name)
        descriptor = os.open(name, os.O_RDONLY | portable.NO_WAIT | portable.PLAIN)
        with os.fdopen(descriptor, "rb") as stream:
            if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
                _refuse_kind(name)
            data = stream.read(limit + 1)
    except (FileNotFoundError, NotADirectoryError, ValueError):  # ValueError: a NUL in the name
        if not os.path.isabs(name):
            os.getcwd()
        refuse_file(name, "no-such-file", "there is no such file", "check the spelling and the current folder")
    except PermissionError:
        refuse_file(name, "permission", "reading it is not permitted", "make it readable, for example with chmod u+r")
    except OSError as error:
        refuse_file(name, "unreadable", f"it cannot be read: {error.strerror}", "copy it to a local disk and try again")
    if len(data) > limit:
        refuse_size(name, limit)
    return data


def refuse_size(name: str, limit: int) -> NoReturn:
    """Raise InvalidInput about a file that is too large."""
    hint = "check that this is the file you meant; ours are a few kilobytes"
    refuse_file(name, "too-large", f"the file is larger than {limit:,} bytes", hint)


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
    """Write a whole file or nothing; InvalidInput if it exists and `force` is not given, or cannot be written."""
    with NewFile(path, force=force) as file:
        file.write(data)


def check_writable(path: AnyPath, *, force: bool = False) -> None:
    """InvalidInput for a file that `write_file` could not make: it exists, is none, or its folder takes none."""
    name = os.fspath(path)
    refuse_no_name(name)
    target = Path(os.path.realpath(name))
    if target.exists() and not target.is_file():
        _refuse_kind(name)
    if target.exists() and not force:
        refuse_file(name, "exists", "the file exists already", "choose another name, or overwrite it with --force")
    if not target.parent.is_dir():
        hint = f"make it first: mkdir -p {shlex.quote(str(target.parent))}"
        refuse_file(name, "no-such-folder", "there is no folder to write it to", hint)
    if not os.access(target.parent, os.W_OK | os.X_OK):
        refuse_file(name, "unwritable", "its folder may not be written to", "choose a folder of your own")


def refuse_no_name(name: str) -> None:
    """Raise InvalidInput for what the system takes for no file's name: a zero character, or too long."""
    try:
        os.lstat(name)
    except (OSError, ValueError) as error:
        if isinstance(error, ValueError) or error.errno == errno.ENAMETOOLONG:
            refuse_file(name, "bad-name", "no file can have this name", "choose a shorter one, of letters and digits")


class NewFile:
    """A file that is written bit by bit, and appears whole or not at all.

    The bytes go to a neighbour that takes the name when the context is left, so that no reader ever meets half a file;
    an exception leaves nothing behind. InvalidInput if the file exists and `force` is not given, or cannot be written.
    """

    def __init__(self, path: AnyPath, *, force: bool = False) -> None:
        self._name = os.fspath(path)
        check_writable(path, force=force)
        self._target = Path(os.path.realpath(self._name))
        self._neighbour = self._target.with_name(f".{self._target.name}.{os.getpid()}.part")
        with self._refusals():
            self._stream = open(self._neighbour, "xb")  # noqa: SIM115

    def __enter__(self) -> NewFile:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if error is None:
            with self._refusals():
                self._stream.flush()
                portable.sync(self._stream.fileno())
                self._stream.close()
                portable.replace(self._neighbour, self._target)
        else:
            self._discard()

    def write(self, data: bytes) -> None:
        """Add bytes at the end."""
        with self._refusals():
            self._stream.write(data)

    @contextlib.contextmanager
    def stream(self) -> Iterator[BinaryIO]:
        """The open file, for writers that move about in it."""
        with self._refusals():
            yield self._stream

    @contextlib.contextmanager
    def _refusals(self) -> Iterator[None]:
        """What the disk refuses, as InvalidInput, with nothing left behind."""
        try:
            yield
        except OSError as error:
            self._discard()
            hint = "check that the folder exists, may be written and has room"
            refuse_file(self._name, "unwritable", f"it cannot be written: {error.strerror}", hint)

    def _discard(self) -> None:
        with contextlib.suppress(OSError, AttributeError):
            self._stream.close()
        with contextlib.suppress(OSError):
            self._neighbour.unlink()


def excerpt(line: str, column: int) -> tuple[str, int]:
    """At most `EXCERPT` characters of a line around a column, and where that column then stands, both from 1.

    Characters that would steer a terminal are replaced one for one.
    """
    start = 0
    if len(line) > EXCERPT:
        start = max(0, min(column - 1 - EXCERPT // 2, len(line) - EXCERPT))
    parts = line[start : start + EXCERPT].split("\t")
    return "\t".join(map(printable, parts)), column - start


def printable(text: str) -> str:
    """`text` with every character replaced that would steer a terminal."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)


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
