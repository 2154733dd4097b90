"""Ask a person before anything moves or is recorded."""

from __future__ import annotations

import sys

import typer

from curveline.cli.printing import terminal
from curveline.errors import InvalidInput


def require_terminal(why: str, hint: str) -> None:
    """InvalidInput unless there is somebody to ask."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        raise InvalidInput(f"{why}there is no terminal to ask on", hint)


def agrees(question: str) -> bool:
    """The answer; KeyboardInterrupt if there is none, so that Ctrl-C is one here, too, and no mere no."""
    # Nothing may be drawn over the question.
    terminal.end()
    try:
        return typer.confirm(question, err=True)
    except typer.Abort:
        raise KeyboardInterrupt from None
    finally:
        terminal.begin()


def number(question: str) -> float:
    """The number that is answered; KeyboardInterrupt if there is none."""
    terminal.end()
    try:
        return float(typer.prompt(question, type=float, err=True))
    except typer.Abort:
        raise KeyboardInterrupt from None
    finally:
        terminal.begin()
