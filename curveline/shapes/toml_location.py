"""Where the keys and values of a TOML document stand; tomllib says what they are, but not where.

The scanner follows the grammar only as far as it must to tell keys, values and containers apart. Any document that
tomllib accepts is scanned to its end; in a broken one the scan stops quietly where it loses track.
"""

from __future__ import annotations

import re
import tomllib
from bisect import bisect_right
from dataclasses import dataclass
from typing import NoReturn

KeyPath = tuple[str | int, ...]

MAX_DEPTH = 32
"""Longest key path that is followed; tomllib's time grows with the square of a path's length."""

_BLANK = re.compile(r"(?:[ \t\n]++|#[^\n]*+)*+")
_BLANK_OR_COMMA = re.compile(r"(?:[ \t\n,]++|#[^\n]*+)*+")
_SPACES = re.compile(r"[ \t]*+")
_KEY = re.compile(r"""[A-Za-z0-9_-]++|"(?:[^"\\\n]++|\\.)*+"|'[^'\n]*+'""")
_SCALAR = re.compile(
    r'''"""(?:[^"\\]++|\\[\s\S]|"(?!""))*+"{3,5}'''
    r"""|'''(?:[^']++|'(?!''))*+'{3,5}"""
    r'''|"(?:[^"\\\n]++|\\.)*+"'''
    r"""|'[^'\n]*+'"""
    r"""|[^"',\[\]{}\n#]++"""
)


@dataclass
class _Open:
    """An array or inline table being read: its path, and for an array how many items began."""

    path: KeyPath
    is_array: bool
    count: int = 0


class _LostError(Exception):
    """The text is not TOML as the scanner knows it."""


class TomlMap:
    """Offsets of the keys and values of a TOML text, by key path.

    `repeated` is the first key defined twice, `too_deep` the offset of the first path longer than `MAX_DEPTH`.
    """

    def __init__(self, text: str) -> None:
        self.keys: dict[KeyPath, int] = {}
        self.values: dict[KeyPath, int] = {}
        self.repeated: tuple[KeyPath, int] | None = None
        self.too_deep: int | None = None
        self._lines = [0, *(match.end() for match in re.finditer("\n", text))]
        _Scanner(text, self).run()

    def value_position(self, path: KeyPath) -> tuple[int, int]:
        """Line and column, from 1, of the value at `path`, or of the nearest table around it."""
        for length in range(len(path), 0, -1):
            if path[:length] in self.values:
                return self.position(self.values[path[:length]])
        return (1, 1)

    def key_position(self, path: KeyPath) -> tuple[int, int]:
        """Line and column, from 1, of the key at the end of `path`; of the value where there is no such key."""
        offset = self.keys.get(path)
        return self.value_position(path) if offset is None else self.position(offset)

    def position(self, offset: int) -> tuple[int, int]:
        """Line and column, from 1, of a character."""
        line = bisect_right(self._lines, offset)
        return line, offset - self._lines[line - 1] + 1


class _Scanner:
    """One pass over a text that fills a TomlMap."""

    def __init__(self, text: str, found: TomlMap) -> None:
        self.text = text
        self.found = found
        self.offset = 0
        self.last_item: dict[KeyPath, int] = {}  # of arrays of tables
        self.headers: set[KeyPath] = set()

    def run(self) -> None:
        table: KeyPath = ()
        try:
            self.skip(_BLANK)
            while self.offset < len(self.text):
                if self.text[self.offset] == "[":
                    table = self.header()
                else:
                    self.value(self.key(table))
                self.skip(_BLANK)
        except _LostError:
            return

    def header(self) -> KeyPath:
        """Read `[table]` or `[[item]]`; the path of the table that the following keys belong to."""
        start = self.offset
        brackets = "[[" if self.text.startswith("[[", start) else "["
        self.offset += len(brackets)
        names = self.names()
        path: KeyPath = ()
        for name, offset in names[:-1]:
            path = (*path, name)
            self.found.keys.setdefault(path, offset)
            self.found.values.setdefault(path, start)
            path = self.latest(path)
        name, offset = names[-1]
        path = (*path, name)
        self.found.keys.setdefault(path, offset)
        if brackets == "[[":
            self.found.values.setdefault(path, start)
            self.last_item[path] = self.last_item.get(path, -1) + 1
            path = self.latest(path)
        elif path in self.headers:
            self.repeat(path, offset)
        self.found.values[path] = start
        self.headers.add(path)
        self.expect("]" * len(brackets))
        return path

    def latest(self, path: KeyPath) -> KeyPath:
        """`path`, or the last item so far if it is an array of tables."""
        return (*path, self.last_item[path]) if path in self.last_item else path

    def key(self, table: KeyPath) -> KeyPath:
        """Read `key =` and return the path of the value that follows."""
        path = table
        names = self.names()
        for name, offset in names:
            path = (*path, name)
            self.found.keys.setdefault(path, offset)
            if path not in self.found.values:
                self.found.values[path] = offset
            elif len(path) == len(table) + len(names):
                self.repeat(path, offset)
        self.expect("=")
        self.skip(_SPACES)
        return path

    def names(self) -> list[tuple[str, int]]:
        """Read a dotted key: its parts and their offsets."""
        parts = []
        while True:
            self.skip(_SPACES)
            match = _KEY.match(self.text, self.offset)
            if match is None:
                raise _LostError
            parts.append((_unquoted(match[0]), self.offset))
            if len(parts) > MAX_DEPTH:
                self.give_up()
            self.offset = match.end()
            self.skip(_SPACES)
            if not self.text.startswith(".", self.offset):
                return parts
            self.offset += 1

    def value(self, start: KeyPath) -> None:
        """Read a value with everything inside it; a stack of our own, so that no nesting exhausts Python's."""
        path: KeyPath | None = start
        containers: list[_Open] = []
        while path is not None:
            if len(path) > MAX_DEPTH:
                self.give_up()
            self.found.values[path] = self.offset
            bracket = self.text[self.offset : self.offset + 1]
            if bracket in ("[", "{"):
                self.offset += 1
                containers.append(_Open(path, bracket == "["))
            else:
                self.scalar()
            path = self.next_value(containers)

    def next_value(self, containers: list[_Open]) -> KeyPath | None:
        """Step to the next value inside the open containers; None once all of them are closed."""
        while containers:
            container = containers[-1]
            self.skip(_BLANK_OR_COMMA)
            if self.text.startswith(("]", "}"), self.offset):
                self.offset += 1
                containers.pop()
            elif container.is_array:
                container.count += 1
                return (*container.path, container.count - 1)
            else:
                return self.key(container.path)
        return None

    def scalar(self) -> None:
        match = _SCALAR.match(self.text, self.offset)
        if match is None:
            raise _LostError
        self.offset = match.end()

    def skip(self, pattern: re.Pattern[str]) -> None:
        match = pattern.match(self.text, self.offset)
        if match is not None:
            self.offset = match.end()

    def expect(self, token: str) -> None:
        if not self.text.startswith(token, self.offset):
            raise _LostError
        self.offset += len(token)

    def repeat(self, path: KeyPath, offset: int) -> None:
        if self.found.repeated is None:
            self.found.repeated = (path, offset)

    def give_up(self) -> NoReturn:
        self.found.too_deep = self.offset
        raise _LostError


def _unquoted(key: str) -> str:
    """A key as tomllib would name it."""
    if key[0] not in "\"'":
        return key
    try:
        return str(tomllib.loads(f"k={key}")["k"])
    except tomllib.TOMLDecodeError:
        raise _LostError from None
