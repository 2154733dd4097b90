"""The help of a command as plain text: wrapped at words, options in sections, examples, nothing cut."""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any, cast

import typer
from typer.core import TyperArgument, TyperCommand, TyperGroup, TyperOption

from curveline.cli.printing import screen
from curveline.cli.printing.help.examples import EXAMPLES, Example
from curveline.cli.printing.help.parameters import heading_of, help_of, usage_of
from curveline.cli.printing.terminal import columns
from curveline.errors import EXIT_USAGE
from curveline.phrases import wrapped

WIDEST = 100
"""Columns at most: longer lines are hard to read."""
COLUMN = 28
"""Columns of what is explained, at most; what is longer has a line of its own."""
READABLE = 30
"""Columns that an explanation needs beside what it explains; where there are fewer it stands below."""
INDENT = 2
FEW = 7
"""Options of a command that need no sections."""
OTHERS = "Options"


MINUS = "\u2212"
"""In place of the hyphen before a number, while a command line is taken apart."""


class _Explained:
    """What commands and groups of them have in common: they explain themselves in this form."""

    def get_help(self: Any, ctx: Any) -> str:
        """The page."""
        return page(self, ctx)

    def get_usage(self: Any, ctx: Any) -> str:
        """The first line of the page."""
        return "\n".join(_usage(self, ctx))

    def get_short_help_str(self: Any, limit: int = 0) -> str:
        """What it does, in one sentence, however long."""
        return summary(self)


class HelpCommand(_Explained, TyperCommand):
    """A command that explains itself in this form; without the arguments that it needs it does so on stderr."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """See typer."""
        return _parsed(self, ctx, args, super().parse_args)


class SignedCommand(HelpCommand):
    """A command of whose arguments one may be a number below zero, which is not to be taken for an option."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """See typer."""
        return super().parse_args(ctx, [re.sub(r"^-(?=\.?[0-9])", MINUS, each) for each in args])


def signed(text: str) -> float:
    """The number that such an argument is."""
    return float(str(text).replace(MINUS, "-"))


class HelpGroup(_Explained, TyperGroup):
    """A group of commands that explains itself in this form."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """See typer."""
        return _parsed(self, ctx, args, super().parse_args)


Explained = HelpCommand | HelpGroup


def _parsed(
    command: Explained, ctx: Any, arguments: list[str], parse: Callable[[Any, list[str]], list[str]]
) -> list[str]:
    if not arguments and command.no_args_is_help and not ctx.resilient_parsing:
        screen.note(command.get_help(ctx))
        raise typer.Exit(EXIT_USAGE)
    try:
        return parse(ctx, arguments)
    except typer.TyperException as error:
        # Not every error of the parser says which command it was met in.
        if getattr(error, "ctx", ctx) is None:
            cast(Any, error).ctx = ctx
        raise


def page(command: Explained, ctx: Any) -> str:
    """All that is to be known of a command, as text for the terminal that stdout is."""
    width = columns(sys.stdout, WIDEST)
    lines = [*_usage(command, ctx), "", *_paragraphs(inspect.cleandoc(command.help or ""), width)]
    parameters = command.get_params(ctx)
    arguments = [each for each in parameters if isinstance(each, TyperArgument) and not each.hidden]
    options = [each for each in parameters if isinstance(each, TyperOption) and not each.hidden]
    rows = {"Arguments": [(heading_of(each), help_of(each)) for each in arguments], **_commands(command, ctx)}
    rows.update(_sections(options))
    left = min(COLUMN, max(len(name) for section in rows.values() for name, _ in section))
    left = left if width - left >= READABLE else INDENT
    for title, section in rows.items():
        lines += ["", f"{title}:", *_listed(section, left, width)] if section else []
    if examples := EXAMPLES.get(ctx.command_path):
        lines += ["", "Examples:", *_examples(examples, width)]
    return "\n".join([*lines, "", *_paragraphs(command.epilog or "", width)])


def _usage(command: Explained, ctx: Any) -> list[str]:
    arguments = [usage_of(each) for each in command.get_params(ctx) if isinstance(each, TyperArgument)]
    last = []
    if isinstance(command, HelpGroup):
        last = ["[COMMAND ...]" if command.invoke_without_command else "COMMAND ..."]
    text = " ".join(["Usage:", ctx.command_path, "[OPTIONS]", *arguments, *last])
    return wrapped(text, 0, columns(sys.stdout, WIDEST))


def summary(command: Explained) -> str:
    """The first paragraph of a command's help."""
    return " ".join(inspect.cleandoc(command.help or "").split("\n\n")[0].split())


def _paragraphs(text: str, width: int) -> Iterator[str]:
    for number, paragraph in enumerate(text.split("\n\n")):
        if number:
            yield ""
        yield from wrapped(" ".join(paragraph.split()), 0, width, hang=0)


def _sections(options: Sequence[TyperOption]) -> dict[str, list[tuple[str, str]]]:
    """Options by the titles under which they belong, in the order in which these come first, the others last."""
    if len(options) <= FEW:
        return {OTHERS: [(heading_of(each), help_of(each)) for each in options]}
    sections: dict[str, list[tuple[str, str]]] = {}
    for each in sorted(options, key=lambda option: option.rich_help_panel is None):
        sections.setdefault(each.rich_help_panel or OTHERS, []).append((heading_of(each), help_of(each)))
    return sections


def _commands(group: Explained, ctx: Any) -> dict[str, list[tuple[str, str]]]:
    """The commands of a group by their titles, each with the first sentence of its help."""
    sections: dict[str, list[tuple[str, str]]] = {}
    if isinstance(group, HelpGroup):
        for name in group.list_commands(ctx):
            each: Any = group.get_command(ctx, name)
            sections.setdefault(each.rich_help_panel or "Commands", []).append((name, summary(each)))
    return sections


def _listed(rows: Sequence[tuple[str, str]], left: int, width: int) -> Iterator[str]:
    """Names in a column, what they mean beside them."""
    for name, meaning in rows:
        lines = wrapped(meaning, 0, width - left - 4, hang=0)
        if len(name) > left:
            yield f"  {name}"
        else:
            yield f"  {name:<{left}}  {lines.pop(0) if lines else ''}".rstrip()
        yield from (f"{'':{left + 4}}{line}" for line in lines)


def _examples(examples: Sequence[Example], width: int) -> Iterator[str]:
    for command, what in examples:
        yield f"  {command}"
        yield from wrapped(what, 6, width, hang=0)
