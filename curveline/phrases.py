"""Many segments, nodes and steps in few words: equal neighbours are named together."""

from __future__ import annotations

import re
import textwrap
import time
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import TypeVar

Value = TypeVar("Value")

NO_BREAK = "\xa0"
WIDTH = 80
"""Columns of a terminal of which nobody knows more."""
ESCAPE = re.compile(r"\x1b\[[0-9;]*m")
"""What changes the colour of a terminal, and takes no room on it."""
COMMAND = re.compile(r"`[^`]*`|(?<=: )curveline .*$")
"""A command in a sentence: between marks, or at its end after a colon."""
MOST_RUNS = 8
"""Runs of equal states that are told one by one; of more, only how many segments are in which."""


def alike(values: Sequence[Value]) -> Iterator[tuple[range, Value]]:
    """Equal neighbours: their numbers, from 1, and what they have in common."""
    first = 1
    for value, group in groupby(values):
        count = len(list(group))
        yield range(first, first + count), value
        first += count


def in_words(states: Sequence[str]) -> str:
    """The states of all segments, from the left: `valley, 3 x peak`."""
    found = [(len(numbers), state) for numbers, state in alike(states)]
    if len(found) > MOST_RUNS:
        found = [(states.count(state), state) for state in sorted(set(states), key=states.index)]
    return ", ".join(state if count == 1 else f"{count} x {state}" for count, state in found)


def counted(number: int, noun: str) -> str:
    """A number of things: `1 item`, `2 items`."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def lines_in_words(names: Sequence[str]) -> str:
    """Some lines by their names: `line a`, `lines a, b and c`."""
    return f"line {names[0]}" if len(names) == 1 else f"lines {', '.join(names[:-1])} and {names[-1]}"


def local_time(moment: float | None) -> str:
    """A time of day [s since 1970] as text."""
    return "unknown time" if moment is None else time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(moment))


def spans(numbers: Iterable[int]) -> str:
    """Whole numbers, rising, with those in a row joined: `1-4, 7`."""
    parts: list[list[int]] = []
    for number in numbers:
        if parts and number == parts[-1][-1] + 1:
            parts[-1] = [parts[-1][0], number]
        else:
            parts.append([number])
    return ", ".join("-".join(map(str, part)) for part in parts)


def wrapped(text: str, indent: int = 0, width: int = WIDTH, hang: int = 2) -> list[str]:
    """Lines of a sentence, indented, those after the first a little more.

    Neither a long word nor a command is broken: they are to be copied.
    """
    kept = COMMAND.sub(lambda command: command[0].replace(" ", NO_BREAK), text)
    wrapper = textwrap.TextWrapper(width, break_on_hyphens=False, break_long_words=False)
    wrapper.initial_indent, wrapper.subsequent_indent = " " * indent, " " * (indent + hang)
    lines = wrapper.wrap(kept)
    return [line.replace(NO_BREAK, " ") for line in lines]


def fitted(text: str, width: int) -> list[str]:
    """Lines of text, those that are too long for so many columns wrapped at words."""
    lines: list[str] = []
    for line in text.split("\n"):
        indent = len(line) - len(line.lstrip())
        lines += [line] if len(ESCAPE.sub("", line)) <= width else wrapped(line.strip(), indent, width)
    return lines
