"""What people see: results on stdout, everything else on stderr; tables, colours, diagnostics and JSON."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any, TextIO

from curveline.cli.printing import terminal
from curveline.cli.printing.manner import MANNER
from curveline.cli.printing.tables import Columns, Row, fitting
from curveline.cli.printing.terminal import has_colours
from curveline.errors import CurvelineError, Diagnostic, InvalidInput, SystemRefusal
from curveline.phrases import WIDTH, fitted
from curveline.system.portable import is_hang_up

BOLD = "1"
DIM = "2"
RED = "1;31"
BLUE = "36"


class ReaderGone(Exception):
    """Who read the results has left, as `head` does: there is nobody to tell more."""


def result(text: str = "") -> None:
    """Lines of the result; they leave at once, so that a reader need not wait for the next.

    On a terminal what is longer than a line is wrapped; tables are not, and neither is JSON.
    """
    MANNER.has_answered = True
    if sys.stdout.isatty() and not MANNER.is_json:
        text = "\n".join(fitted(text, WIDTH))
    try:
        with terminal.aside():
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
    """Lines beside the result, wrapped on a terminal; no run ends because nobody can read what they say."""
    _say(_wrapped(text))


def _wrapped(text: str) -> list[str]:
    """Lines that fit the terminal, if stderr is one: what reads a file or a pipe looks for whole sentences."""
    return fitted(text, terminal.columns(sys.stderr)) if sys.stderr.isatty() else text.split("\n")


def _say(lines: Sequence[str]) -> None:
    with suppress(OSError), terminal.aside():
        print("\n".join(lines), file=sys.stderr, flush=True)


def paint(text: str, colour: str, stream: TextIO) -> str:
    """`text` in a colour, where there are any."""
    return f"\x1b[{colour}m{text}\x1b[0m" if has_colours(stream) else text


def table(rows: Sequence[Row], left: frozenset[int] = frozenset({0})) -> list[str]:
    """Lines of a table, the first row its heading; columns in `left` are left-aligned, numbers are not."""
    return fitting(rows, left).lines(rows)


def headed(table: Columns, head: Row, rows: Sequence[Row]) -> Iterator[str]:
    """Rows of a table under its heading, which is dim where there are colours."""
    for line in table.heading(head):
        yield paint(line, DIM, sys.stdout)
    yield from table.lines(rows)


def decimal(value: float, decimals: int = 2) -> str:
    """Two or so many decimals, and no minus before a zero."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}"


def complain(error: CurvelineError) -> None:
    """What is wrong and what to do about it, every problem of a file in the form that compilers use."""
    MANNER.complaint = error
    diagnostics = error.diagnostics if isinstance(error, InvalidInput) else ()
    for diagnostic in diagnostics:
        _complain_about(diagnostic)
    if not diagnostics:
        _label("error:", RED, error.message)
        advise(error.hint)


def _complain_about(found: Diagnostic) -> None:
    place, label = f"{found.path}:{found.line}:{found.column}:", f"error[{found.code}]:"
    first, *rest = _wrapped(f"{place} {label} {found.message}")
    painted = {place: paint(place, BOLD, sys.stderr), label: paint(label, RED, sys.stderr)}
    _say([" ".join(painted.get(word, word) for word in first.split(" ")), *rest])
    if found.source:
        # Tabs are kept, so that the caret stands under its column whatever their width.
        indent = "".join("\t" if character == "\t" else " " for character in found.source[: found.caret - 1])
        _say([f"  {found.source}", f"  {indent}{paint('^', RED, sys.stderr)}"])
    advise(found.hint)


def advise(hint: str) -> None:
    """What to do about it, on stderr; nothing if nobody knows."""
    if hint:
        _label("hint:", BLUE, hint)


def _label(label: str, colour: str, text: str) -> None:
    """Text after a label in colour."""
    first, *rest = _wrapped(f"{label} {text}")
    _say([paint(label, colour, sys.stderr) + first[len(label) :], *rest])
