"""What people see: results on stdout, everything else on stderr; tables, colours, diagnostics and JSON."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, TextIO

from curveline.errors import CurvelineError, Diagnostic, InvalidInput

if TYPE_CHECKING:
    from rich.console import Console

BOLD = "1"
DIM = "2"
RED = "1;31"
BLUE = "36"


def result(text: str = "") -> None:
    """Lines of the result; they leave at once, so that a reader need not wait for the next."""
    try:
        print(text, flush=True)
    except BrokenPipeError:
        raise
    except OSError as error:
        raise CurvelineError(f"cannot write the result: {error.strerror or error}") from None


def emit(document: Any) -> None:
    """A result as one line of JSON."""
    result(json.dumps(document, allow_nan=False))


def note(text: str) -> None:
    """A line beside the result."""
    print(text, file=sys.stderr, flush=True)


def is_live(stream: TextIO) -> bool:
    """True if `stream` is a terminal that can be written over and shows colour."""
    return stream.isatty() and os.environ.get("TERM", "") != "dumb" and not os.environ.get("CI")


def paint(text: str, colour: str, stream: TextIO) -> str:
    """`text` in a colour, if `stream` shows colours and the user wants them."""
    return f"\x1b[{colour}m{text}\x1b[0m" if is_live(stream) and not os.environ.get("NO_COLOR") else text


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


def decimal(value: float) -> str:
    """Two decimals, and no minus before a zero."""
    return f"{round(value, 2) + 0.0:.2f}"


def complain(error: CurvelineError) -> None:
    """What is wrong and what to do about it, every problem of a file in the form that compilers use."""
    diagnostics = error.diagnostics if isinstance(error, InvalidInput) else ()
    for diagnostic in diagnostics:
        _complain_about(diagnostic)
    if not diagnostics:
        note(f"{paint('error:', RED, sys.stderr)} {error.message}")
        _advise(error.hint)


def _complain_about(found: Diagnostic) -> None:
    place = f"{found.path}:{found.line}:{found.column}:"
    label = paint(f"error[{found.code}]:", RED, sys.stderr)
    note(f"{paint(place, BOLD, sys.stderr)} {label} {found.message}")
    if found.source:
        # Tabs are kept, so that the caret stands under its column whatever their width.
        indent = "".join("\t" if character == "\t" else " " for character in found.source[: found.caret - 1])
        note(f"  {found.source}")
        note(f"  {indent}{paint('^', RED, sys.stderr)}")
    _advise(found.hint)


def _advise(hint: str) -> None:
    if hint:
        note(f"{paint('hint:', BLUE, sys.stderr)} {hint}")


@cache
def announce_compilation() -> None:
    """Say once why the very first run takes long, before it does."""
    from curveline.rod import _jit

    if _jit.FIRST_RUN:
        note("compiling kernels, about 35 s, once")


def console() -> Console:
    """A terminal on stderr for what is written over."""
    from rich.console import Console

    return Console(stderr=True, highlight=False)
