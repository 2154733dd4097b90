"""What to write instead in a text that is not TOML: every slip of it, each tried before it is told of."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from typing import NamedTuple

from curveline.shapes.toml_fault import UNENDED, Slip, TomlFault
from curveline.shapes.toml_slips import (
    LATE_TABLE,
    MORE,
    NO_EQUALS,
    NO_KEY,
    NO_STATEMENT,
    NO_VALUE,
    OPEN,
    SLIPS,
)

MAX_CHARACTERS = 20_000
"""Longer texts are not looked into: whoever writes by hand writes a few thousand."""
MOST_SLIPS = 20
LINE = "each line reads key = value or [table]; a key has letters a to z, digits, _ and -"
WORDS = (
    (NO_VALUE, "here is no value", "a value is a number, text in quotes, true, false, an array [ ] or a table { }"),
    (NO_EQUALS, "a key is followed by = and a value", LINE),
    (NO_KEY, "a key should begin here", LINE),
    (NO_STATEMENT, "this is no key and no table", LINE),
    (MORE, "more stands here than one key = value", "write one on each line, and comments behind #"),
    (OPEN, "a bracket is not closed", "close every { with }, every [ with ], and put commas between what is in them"),
    (LATE_TABLE, "the brackets of a table are not closed", "write [table], or [[table]] for each of several"),
    *((each, "text in quotes is not closed", "close it with the quote that it begins with") for each in UNENDED),
)
"""Beginning of a reason of tomllib's, the same in words, and what to do."""


class SyntaxProblem(NamedTuple):
    """What is wrong at an offset of a text that is not TOML, and what to do."""

    offset: int
    what: str
    hint: str


def syntax_problems(fault: TomlFault) -> Iterator[SyntaxProblem]:
    """What is wrong with a text that is not TOML, the first problem first."""
    slips = slips_of(fault.text)
    for slip in slips:
        yield SyntaxProblem(slip.start, _harmless(slip.what), _harmless(slip.hint))
    if not slips:
        yield SyntaxProblem(fault.place, *_in_words(fault))


def slips_of(text: str) -> list[Slip]:
    """The slips of a text, the first ones first; none if it is TOML, or nobody knows what was meant.

    What is said to be meant has been tried: after it the text is TOML, or more of it is. Later slips are those of the
    text without the earlier ones; their places are in the text as it is.
    """
    found: list[Slip] = []
    applied: list[Slip] = []
    while len(found) < MOST_SLIPS and len(text) <= MAX_CHARACTERS:
        slip = _first(text)
        if slip is None:
            break
        start, stop = slip.start, slip.stop
        for earlier in reversed(applied):
            start, stop = earlier.origin(start), earlier.origin(stop)
        found.append(Slip(start, stop, slip.text, slip.what, slip.hint))
        applied.append(slip)
        text = slip.applied(text)
    return found


def _first(text: str) -> Slip | None:
    """The first slip of a text for which something helps."""
    fault = TomlFault.of(text)
    if fault is None:
        return None
    for meant in SLIPS:
        slip = meant(fault)
        if slip is not None and _helps(slip, fault):
            return slip
    return None


def _helps(slip: Slip, fault: TomlFault) -> bool:
    """Whether more of a text is TOML without a slip."""
    after = TomlFault.of(slip.applied(fault.text))
    return after is None or after.left < fault.left


def _harmless(text: str) -> str:
    """What a terminal can be told of a file: no character that steers it, but spaces of all kinds."""
    return "".join(
        c if c.isprintable() or unicodedata.category(c) == "Zs" else "\N{REPLACEMENT CHARACTER}" for c in text
    )


def _in_words(fault: TomlFault) -> tuple[str, str]:
    """What tomllib's reason means, and what to do where nobody knows what was meant."""
    line = fault.text[fault.offset : fault.line[1]].strip()
    if fault.reason.startswith(NO_VALUE) and (not line or line[0] in "#,}]"):
        key = fault.key_at(fault.offset)
        return f"{key or 'a key'} has no value", "write one after the =, or remove the key"
    if fault.reason.startswith(NO_STATEMENT) and line.startswith("{"):
        headers = re.findall(r"(?m)^[ \t]*\[([\w-]+)\]", fault.text[: fault.offset])
        if not headers:
            return "this looks like JSON", "`curveline new shape` and `curveline new display` write files to begin with"
        name = headers[-1]
        hint = f"write `{name} = [` in place of `[{name}]`, commas between the tables, and `]` after the last"
        return "a table in { } has no key", hint
    reason = fault.reason
    for beginning, what, hint in WORDS:
        if reason.startswith(beginning):
            return what, hint
    return f"{reason[:1].lower()}{reason[1:]}", LINE
