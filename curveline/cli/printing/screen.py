"""What people see: results on stdout, everything else on stderr; tables, colours, diagnostics and JSON."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from typing import Any, TextIO

from curveline.cli.printing import terminal
from curveline.cli.printing.terminal import has_colours
from curveline.errors import CurvelineError, Diagnostic, InvalidInput, SystemRefusal
from curveline.system.portable import is_hang_up

BOLD = "1"
DIM = "2"
RED = "1;31"
BLUE = "36"


class ReaderGone(Exception):
    """Who read the results has left, as `head` does: there is nobody to tell more."""


def result(text: str = "") -> None:
    """Lines of the result; they leave at once, so that a reader need not wait for the next."""
    terminal.erase()
    try:
        print(text, flush=True)
    except OSError as error:
        if is_hang_up(error):
            raise ReaderGone from None
        hint = "see that what stdout leads to has room"
        raise SystemRefusal(f"cannot write the result: {error.strerror or error}", hint) from None


def emit(document: Any) -> None:
    """A result as one line of JSON."""
    result(json.dumps(document, allow_nan=False))


def note(text: str) -> None:
    """A line beside the result; no run ends because nobody can read what it says."""
    terminal.erase()
    with suppress(OSError):
        print(text, file=sys.stderr, flush=True)


def paint(text: str, colour: str, stream: TextIO) -> str:
    """`text` in a colour, where there are any."""
    return f"\x1b[{colour}m{text}\x1b[0m" if has_colours(stream) else text


def table(rows: Sequence[Sequence[str]], left: frozenset[int] = frozenset({0})) -> list[str]:
    """Lines of a table, the first row its head; columns in `left` are left-aligned, numbers are not."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        cells = zip(row, widths, strict=True)
        line = "  ".join(
            cell.ljust(width) if index in left else cell.rjust(width) for index, (cell, width) in enumerate(cells)
        )
        lines.append(line.rstrip())
    return lines


def decimal(value: float, decimals: int = 2) -> str:
    """Two or so many decimals, and no minus before a zero."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}"


def complain(error: CurvelineError) -> None:
    """What is wrong and what to do about it, every problem of a file in the form that compilers use."""
    diagnostics = error.diagnostics if isinstance(error, InvalidInput) else ()
    for diagnostic in diagnostics:
        _complain_about(diagnostic)
    if not diagnostics:
        note(f"{paint('error:', RED, sys.stderr)} {error.message}")
        advise(error.hint)


def _complain_about(found: Diagnostic) -> None:
    place = f"{found.path}:{found.line}:{found.column}:"
    label = paint(f"error[{found.code}]:", RED, sys.stderr)
    note(f"{paint(place, BOLD, sys.stderr)} {label} {found.message}")
    if found.source:
        # Tabs are kept, so that the caret stands under its column whatever their width.
        indent = "".join("\t" if character == "\t" else " " for character in found.source[: found.caret - 1])
        note(f"  {found.source}")
        note(f"  {indent}{paint('^', RED, sys.stderr)}")
    advise(found.hint)


def advise(hint: str) -> None:
    """What to do about it, on stderr; nothing if nobody knows."""
    if hint:
        note(f"{paint('hint:', BLUE, sys.stderr)} {hint}")


@cache
def announce_compilation() -> None:
    """Say once why the very first run takes long, before it does."""
    from curveline.cli.printing import compiling

    compiling.announce(note)
