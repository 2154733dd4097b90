"""A command line that cannot be understood, in the words of this program rather than those of its parser."""

from __future__ import annotations

from typing import Any

import typer

from curveline.cli.printing.help.parameters import choices_of, name_of, values_of
from curveline.cli.usage import in_words
from curveline.errors import InvalidInput


class Misuse(InvalidInput):
    """A command, an option or an argument that does not exist, is missing, or cannot have that value."""

    code = "usage"

    def __init__(self, usage: str, message: str, hint: str) -> None:
        super().__init__(message, hint)
        self.usage = usage


def misuse_of(error: typer.TyperException) -> Misuse:
    """What the parser found."""
    context = getattr(error, "ctx", None)
    where = "curveline" if context is None else context.command_path
    nearest = " or ".join(getattr(error, "possibilities", None) or ())
    guess = f"did you mean {nearest}? " if nearest else ""
    return Misuse("" if context is None else context.get_usage(), _message(error), f"{guess}`{where} -h` explains it")


def _message(error: typer.TyperException) -> str:
    if option := getattr(error, "option_name", "") if hasattr(error, "possibilities") else "":
        return f"there is no option {option}"
    parameter = getattr(error, "param", None)
    if not isinstance(error, typer.BadParameter) or parameter is None:
        return _sentence(error.format_message())
    name, takes, given = name_of(parameter), values_of(parameter), _given(error)
    if given is None:
        return f"{name}: {error.message}" if error.message else f"{name} is missing"
    if words := in_words(error):
        return f"{name}: {words}"
    if not takes:
        return _sentence(error.format_message())
    from curveline.shapes.toml_document import nearest

    guess = nearest(str(given), choices_of(parameter)).strip()
    return f"{name} takes {takes}, not {given}{guess and f'; {guess}'}"


def _given(error: typer.TyperException) -> Any:
    """The value that was refused, None if there was none."""
    found: list[Any] = getattr(error.__cause__, "errors", list)()
    return found[0]["input"] if found else None


def _sentence(text: str) -> str:
    """As part of a message of ours, which begin small and end without a stop."""
    return text[:1].lower() + text[1:].rstrip(".")
