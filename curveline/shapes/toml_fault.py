"""Where tomllib gave a text up, what stands around that place, and a slip: what was meant there instead."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from functools import cached_property

_TOKEN = re.compile(
    r'"""(?:[^\\]|\\.)*?"""'
    r"|'''.*?'''"
    r'|"(?:[^"\\\n]|\\.)*"'
    r"|'[^'\n]*'"
    r"|#[^\n]*"
    r"|[\[\]{}]",
    re.DOTALL,
)
UNENDED = ("Illegal character", "Unterminated", 'Expected "\'"')
"""How reasons begin of text in quotes that has no end; tomllib names the place where it gave up looking for it."""
CLOSERS = {"{": "}", "[": "]", "(": ")"}


@dataclass(frozen=True)
class Slip:
    """What was probably meant: `text` in place of what stands from `start` to `stop`.

    `what` says what is wrong, `hint` what to write.
    """

    start: int
    stop: int
    text: str
    what: str
    hint: str

    def applied(self, text: str) -> str:
        """The text without the slip."""
        return text[: self.start] + self.text + text[self.stop :]

    def origin(self, offset: int) -> int:
        """Where something in the text without the slip stands in the text with it."""
        if offset >= self.start + len(self.text):
            return offset + (self.stop - self.start) - len(self.text)
        return min(offset, self.start)


@dataclass(frozen=True)
class TomlFault:
    """A text that is not TOML, the offset up to which it is, and tomllib's reason."""

    text: str
    offset: int
    reason: str

    @classmethod
    def of(cls, text: str) -> TomlFault | None:
        """The first fault of a text; None if it is TOML."""
        try:
            tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            return cls.told(text, str(error))
        except ValueError:  # a decimal number that Python refuses to read
            return None
        return None

    @classmethod
    def told(cls, text: str, message: str) -> TomlFault:
        """The fault of which tomllib tells so."""
        reason, _, where = message.rpartition(" (at ")
        numbers = re.findall(r"\d+", where)
        if not numbers:
            return cls(text, len(text), reason)
        line, column = map(int, numbers[:2])
        begin = 0
        for _ in range(line - 1):
            begin = text.index("\n", begin) + 1
        return cls(text, begin + column - 1, reason)

    @property
    def left(self) -> int:
        """Characters from the fault to the end of the text."""
        return len(self.text) - self.offset

    @cached_property
    def place(self) -> int:
        """Where to look: the offset, or the quote of which the end was sought."""
        if self.reason.startswith(UNENDED):
            for token in re.finditer(_TOKEN.pattern + "|[\"']", self.text, re.DOTALL):
                if token[0] in ('"', "'"):
                    return token.start()
        return self.offset

    @cached_property
    def line(self) -> tuple[int, int]:
        """Where the line of that place begins and ends."""
        end = self.text.find("\n", self.place)
        return self.text.rfind("\n", 0, self.place) + 1, len(self.text) if end < 0 else end

    @cached_property
    def open(self) -> list[int]:
        """Offsets of the brackets that are open at the fault, the innermost last."""
        found: list[int] = []
        for token in _TOKEN.finditer(self.text, 0, self.offset):
            if token[0] in CLOSERS:
                found.append(token.start())
            elif token[0] in ("]", "}") and found:
                found.pop()
        return found

    @cached_property
    def before(self) -> int:
        """Where the last thing before the fault ends that is neither blank nor a comment."""
        end = 0
        for part in re.finditer(_TOKEN.pattern + r"|[^\s\"'\[\]{}#]+|.", self.text[: self.offset], re.DOTALL):
            if not part[0].isspace() and not part[0].startswith("#"):
                end = part.end()
        return end

    def around(self, pattern: str) -> re.Match[str] | None:
        """The first match on the line of the fault that it lies in, or at the end of."""
        begin, end = self.line
        matches = re.compile(pattern).finditer(self.text, begin, end)
        return next((each for each in matches if each.start() <= self.offset <= each.end()), None)

    def here(self, pattern: str) -> re.Match[str] | None:
        """The match that begins at the fault."""
        return re.compile(pattern).match(self.text, self.offset)

    def key_at(self, offset: int) -> str:
        """The key that a value belongs to; empty if none stands on its line."""
        keys = re.findall(r"([A-Za-z_][\w-]*)[ \t]*[=:]", self.text[self.text.rfind("\n", 0, offset) + 1 : offset])
        return keys[-1] if keys else ""

    def put(self, span: tuple[int, int], new: str, what: str, why: str = "") -> Slip:
        """A slip whose hint is what to write instead of what stands there, and `why`."""
        old = self.text[slice(*span)]
        if not new.strip():
            hint = f"remove `{old.strip()}`"
        elif not old.strip():
            hint = f"write `{new.strip()}` here"
        else:
            hint = f"write `{new}` instead of `{old}`"
        return Slip(*span, new, what, f"{hint}: {why}" if why else hint)


def closing(text: str, start: int) -> int | None:
    """The offset of the bracket that closes the one at `start`; None if none does, or one does not fit."""
    open_ones: list[str] = []
    for token in _TOKEN.finditer(text, start):
        if token[0] in CLOSERS:
            open_ones.append(CLOSERS[token[0]])
        elif token[0] in ("]", "}"):
            if token[0] != open_ones.pop():
                return None
            if not open_ones:
                return token.start()
    return None
