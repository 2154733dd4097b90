"""The terminal: how wide it is, what it can show, and lines on it that are drawn over each other.

There is one terminal, whichever of the two streams lead to it. What is drawn on it goes as soon as anything else is
written, and whoever draws next draws below that.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TextIO

from curveline.phrases import WIDTH
from curveline.system.portable import takes_escapes

NARROWEST = 40
"""Columns for which text is still wrapped; narrower terminals break it themselves."""
ROWS = 24
"""Rows of a terminal that does not say."""


def is_live(stream: TextIO) -> bool:
    """True if `stream` is a terminal that can be written over and shows colour."""
    return stream.isatty() and os.environ.get("TERM", "") != "dumb" and not os.environ.get("CI") and takes_escapes()


def has_colours(stream: TextIO) -> bool:
    """Whether `stream` shows colours and the user wants them."""
    return is_live(stream) and not os.environ.get("NO_COLOR")


def size(stream: TextIO) -> tuple[int, int]:
    """Columns and rows of the terminal behind a stream; the usual ones if there is none."""
    with suppress(OSError, ValueError):
        found = os.get_terminal_size(stream.fileno())
        return found.columns or WIDTH, found.lines or ROWS
    return WIDTH, ROWS


def columns(stream: TextIO, most: int = WIDTH) -> int:
    """How wide text is to be on a stream: as its terminal, but at most so many columns."""
    return max(NARROWEST, min(size(stream)[0], most))


class _Drawing:
    """What is drawn on the terminal at present."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._stream: TextIO | None = None
        self._rows = 0
        self._is_closed = False
        self._text = ""
        self._is_filler = False

    def begin(self) -> None:
        """Something new is to be drawn: a process may have several commands, one after another."""
        self._is_closed = False

    def draw(self, text: str, stream: TextIO, *, is_filler: bool = False) -> None:
        """Draw lines over those that were drawn before, cut to the size of the terminal.

        A filler is what there is to say while nobody has anything better to tell: it never takes the place of that.
        """
        with self._lock:
            if self._is_closed or (is_filler and self._stream is not None and not self._is_filler):
                return
            self._is_filler = is_filler
            wide, high = size(stream)
            lines = [line[: wide - 1] for line in text.split("\n")]
            if len(lines) >= high:
                lines = [*lines[: high - 2], f"... {len(lines) - high + 2} more lines"]
            self._write(self._erasure() + "\n".join(lines), stream)
            self._stream, self._rows, self._text = stream, len(lines), text

    def erase(self, text: str | None = None) -> None:
        """Take away what is drawn, if anything is, and if it is this."""
        with self._lock:
            if self._stream is not None and text in (None, self._text):
                self._write(self._erasure(), self._stream)
                self._stream, self._rows = None, 0

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Take away what is drawn, and let nobody draw while something is written in its place."""
        with self._lock:
            self.erase()
            yield

    def keep(self) -> None:
        """Leave what is drawn where it is, and go on below it."""
        with self._lock:
            if self._stream is not None:
                self._write("\n", self._stream)
                self._stream, self._rows = None, 0

    def end(self) -> None:
        """Draw nothing from now on, whatever threads still want to: the process is about to end."""
        with self._lock:
            self.erase()
            self._is_closed = True

    def _erasure(self) -> str:
        """What brings the cursor back to where the drawing begins, and clears all from there."""
        if self._stream is None:
            return ""
        up = f"\x1b[{self._rows - 1}A" if self._rows > 1 else ""
        return f"\r{up}\x1b[J"

    def _write(self, text: str, stream: TextIO) -> None:
        with suppress(OSError, ValueError):
            stream.write(text)
            stream.flush()


_DRAWING = _Drawing()
begin, end = _DRAWING.begin, _DRAWING.end
erase, aside, keep = _DRAWING.erase, _DRAWING.aside, _DRAWING.keep


def draw(text: str, stream: TextIO | None = None) -> None:
    """Draw lines over those that were drawn before, on stderr unless another stream is named."""
    _DRAWING.draw(text, stream or sys.stderr)


def fill(text: str) -> None:
    """Draw a line on stderr where nothing else is drawn."""
    _DRAWING.draw(text, sys.stderr, is_filler=True)
