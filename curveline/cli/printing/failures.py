"""Failures of commands that answer in JSON: an object on stdout besides the words on stderr."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import asdict
from typing import Any

from curveline.cli.printing import screen
from curveline.cli.printing.manner import MANNER
from curveline.errors import (
    EXIT_INTERRUPTED,
    EXIT_LINK,
    EXIT_NO,
    EXIT_USAGE,
    CurvelineError,
    InvalidInput,
    LinkError,
    SystemRefusal,
)

ENDINGS = {
    EXIT_NO: ("no", "the answer is no"),
    EXIT_USAGE: ("usage", "the command could not be carried out"),
    EXIT_LINK: ("link", "a radio or a node is at fault"),
    EXIT_INTERRUPTED: ("interrupted", "somebody interrupted it"),
}
"""Codes and messages of commands that end without another answer, by exit code."""


class Interrupted(CurvelineError):
    """Somebody pressed Ctrl-C."""

    exit_code = EXIT_INTERRUPTED
    code = "interrupted"


def answer(error: CurvelineError, **where: Any) -> None:
    """Say what is wrong in JSON, if that is how the command answers; `where` says with which of many things."""
    if MANNER.is_json:
        _emit(document(error), where)


def conclude(exit_code: int) -> None:
    """Say in JSON that a command ends with this exit code, unless it has answered."""
    if exit_code == 0 or MANNER.has_answered or not MANNER.is_json:
        return
    code, message = ENDINGS.get(exit_code, ("failed", "it failed"))
    found = document(MANNER.complaint or CurvelineError(message))
    _emit({**found, "code": found["code"] if MANNER.complaint else code, "exit_code": exit_code}, {})


def document(error: CurvelineError) -> dict[str, Any]:
    """An error as plain data; what is not known is null."""
    diagnostics = error.diagnostics if isinstance(error, InvalidInput) else ()
    return {
        "code": error.code,
        "message": error.message,
        "hint": error.hint or None,
        "exit_code": error.exit_code,
        "diagnostics": [{key: value for key, value in asdict(each).items() if key != "caret"} for each in diagnostics],
        "node": (error.node or None) if isinstance(error, LinkError) else None,
        "cause": (error.cause or None) if isinstance(error, LinkError) else None,
    }


def _emit(error: dict[str, Any], where: dict[str, Any]) -> None:
    from curveline._version import __version__

    # If nobody can read that, what it says is still what the command ends with.
    with suppress(SystemRefusal, screen.ReaderGone):
        screen.emit({"curveline": __version__, **where, "error": error})
