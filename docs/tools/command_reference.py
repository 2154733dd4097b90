"""The reference of all commands, as Markdown, from what each of them says of itself with --help."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any

from typer.main import get_command

from curveline.cli.app import EPILOG, app

Command = Any
"""A command or a group of typer; the base classes of the two are none of its public names."""

PROGRAM = "curveline"


def commands(command: Command | None = None, path: tuple[str, ...] = (PROGRAM,)) -> Iterator[tuple[str, Command]]:
    """Every command by its full name, a group before what is in it."""
    command = command or get_command(app)
    yield " ".join(path), command
    for name, inner in getattr(command, "commands", {}).items():
        yield from commands(inner, (*path, name))


def options(command: Command) -> set[str]:
    """All ways of writing the options of a command."""
    return {name for each in command.get_params(_context(command)) for name in each.opts if name.startswith("-")}


def markdown() -> str:
    """The text that stands on the page of the commands."""
    return "\n".join([_words(EPILOG), "", *(line for name, each in commands() for line in _section(name, each))])


def _context(command: Command) -> Any:
    return command.context_class(command, info_name=command.name)


def _section(name: str, command: Command) -> Iterator[str]:
    """Heading, use, description and options of one command."""
    yield from (f"{'#' * (2 if name.count(' ') < 2 else 3)} {name}", "", "```text")
    yield from (" ".join([name, *command.collect_usage_pieces(_context(command))]), "```", "")
    yield from (_words(inspect.cleandoc(command.help or "")), "")
    records = [each.get_help_record(_context(command)) for each in command.get_params(_context(command))]
    yield from _table([each for each in records if each is not None])


def _table(records: list[tuple[str, str]]) -> Iterator[str]:
    yield from ("| | |", "|---|---|")
    yield from (f"| `{first}` | {_cell(_words(second))} |" for first, second in records)
    yield ""


def _words(words: str) -> str:
    """Plain words, of which no character is taken for markup."""
    return words.replace("*", "\\*").replace("<", "&lt;")


def _cell(words: str) -> str:
    """Words in a table, where a bar outside of code would end a column."""
    return words.replace("|", "\\|")
