"""Options and arguments in words: what they are called, which values they take, what holds where they are left out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from enum import Enum
from typing import Any

from typer.core import TyperArgument, TyperOption

Parameter = TyperOption | TyperArgument
NUMBERS: dict[Any, str] = {int: "a whole number", float: "a number"}
LONGEST_CHOICE = 24
"""Columns that choices may take in place of a name for what is chosen."""


def name_of(parameter: Parameter) -> str:
    """What a parameter is called in a message: its long option, or the word that usage has for an argument."""
    if isinstance(parameter, TyperOption):
        return max(parameter.opts, key=len)
    return _word(parameter)


def heading_of(parameter: Parameter) -> str:
    """What a parameter looks like in a command: `-t, --tolerance-mm MM`, `SHAPE...`."""
    if isinstance(parameter, TyperArgument):
        return _word(parameter) + ("..." if parameter.nargs != 1 else "")
    names = ", ".join(sorted(parameter.opts, key=lambda name: (len(name) > 2, name)))
    return names if parameter.is_flag else f"{names} {_word(parameter)}"


def usage_of(argument: TyperArgument) -> str:
    """What an argument looks like in the line of usage: in brackets if it may be left out."""
    name = _word(argument) if argument.required else f"[{_word(argument)}]"
    return name + ("..." if argument.nargs != 1 else "")


def values_of(parameter: Parameter) -> str:
    """Which values a parameter takes, as the rest of a sentence; empty if any text will do."""
    described = parameter.type_descriptor
    if (choices := _choices(parameter)) is not None:
        return " or ".join(part for part in (", ".join(choices[:-1]), choices[-1]) if part)
    what = NUMBERS.get(described.annotation, "")
    return " ".join(part for part in (what, _range(parameter)) if part)


def help_of(parameter: Parameter) -> str:
    """What a parameter is for, then in brackets what it takes and what holds where it is left out."""
    facts = "; ".join(_facts(parameter))
    return f"{parameter.help or ''} [{facts}]" if facts else parameter.help or ""


def _facts(parameter: Parameter) -> Iterator[str]:
    if _choices(parameter) is not None and parameter.metavar is not None:
        yield values_of(parameter)
    elif limits := _range(parameter):
        yield limits
    if isinstance(parameter, TyperOption) and parameter.multiple:
        yield "may be repeated"
    if parameter.envvar:
        yield f"or {parameter.envvar} in the environment"
    if parameter.required and isinstance(parameter, TyperOption):
        yield "required"
    if default := _default(parameter):
        yield f"default: {default}"


def _default(parameter: Parameter) -> str:
    """What holds where a parameter is left out; empty if nothing does, or its help says it."""
    if isinstance(parameter.show_default, str):
        return parameter.show_default
    value = parameter.default
    if value is None or isinstance(value, bool) or value == []:
        return ""
    return _plain(value)


def _range(parameter: Parameter) -> str:
    low, high = parameter.min, parameter.max
    if low is None:
        return "" if high is None else f"at most {_plain(high)}"
    return f"at least {_plain(low)}" if high is None else f"from {_plain(low)} to {_plain(high)}"


def choices_of(parameter: Parameter) -> list[str]:
    """All that there is to choose from; empty if anything may be given."""
    return list(_choices(parameter) or ())


def _choices(parameter: Parameter) -> Sequence[str] | None:
    found = parameter.type_descriptor.choices
    return None if found is None else [_plain(each) for each in found]


def _word(parameter: Parameter) -> str:
    """The word for a value: its metavar, or all that there is to choose from."""
    return parameter.metavar or "|".join(_choices(parameter) or [parameter.name.upper()])


def _plain(value: Any) -> str:
    value = value.value if isinstance(value, Enum) else value
    return f"{value:g}" if isinstance(value, float) else str(value)
