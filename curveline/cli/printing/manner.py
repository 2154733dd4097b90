"""How a command is to answer: in brief, and with its failures as JSON, too.

That is a matter of the whole command, as colours are: whoever prints looks here, and nobody has to hand it on.
"""

from __future__ import annotations

from collections.abc import Sequence

from curveline.errors import CurvelineError


class _Manner:
    """What was asked for, whether anything was answered yet, and what was complained of last."""

    is_brief = False
    is_json = False
    has_answered = False
    complaint: CurvelineError | None = None


MANNER = _Manner()


def begin(arguments: Sequence[str]) -> None:
    """A command begins, with these arguments, which may turn out to be none that it takes."""
    MANNER.is_brief = MANNER.has_answered = False
    MANNER.complaint = None
    MANNER.is_json = _asks_for_json(arguments)


def _asks_for_json(arguments: Sequence[str]) -> bool:
    """Whether JSON is wanted on stdout: by --json, or by - as a file to write."""
    before = ""
    for argument in arguments:
        if argument == "--":
            return False
        if argument in ("--json", "-o-", "--output=-") or (argument == "-" and before in ("-o", "--output")):
            return True
        before = argument
    return False
