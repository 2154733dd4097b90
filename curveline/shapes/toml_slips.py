"""What people write where TOML has something else: each slip is a function from a fault to what was meant, or None."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable

from curveline.shapes.key_units import unit_of
from curveline.shapes.toml_fault import CLOSERS, UNENDED, Slip, TomlFault, closing
from curveline.shapes.toml_numbers import calculation, number

QUOTES = "\u201c\u201d\u201e\u201f\u00ab\u00bb\u2018\u2019\u201a\u201b\u2039\u203a`\u00b4\u2033\uff02\u300c\u300d"
"""Quotes of word processors and of other languages, for which TOML has those of the keyboard."""
LONGEST = 60
"""Characters of a table that a hint repeats."""
_WORD = r"[^\s,\]}#\"'=:]"
TRUE, FALSE = ("true", "yes", "on"), ("false", "no", "off")
NO_STATEMENT, NO_VALUE, MORE = "Invalid statement", "Invalid value", "Expected newline or end of document"
NO_EQUALS, NO_KEY = "Expected '=' after a key", "Invalid initial character for a key"
OPEN, LATE_TABLE = "Unclosed", "Expected ']"
NEWLINE = "\n"


def odd_space(fault: TomlFault) -> Slip | None:
    """A space or a control character that only looks like a blank."""
    match = fault.here(r"[^\S \t\n]+|[\u200b-\u200f\u2060\ufeff]+")
    if match is None:
        return None
    name = unicodedata.name(match[0][0], f"control character 0x{ord(match[0][0]):02x}").lower()
    if match[0][0] == "\r":
        return Slip(*match.span(), "\n", "a line ends in a carriage return alone", "begin a new line here")
    if match[0].isspace():
        return Slip(*match.span(), " ", f"a {name} is no blank for TOML", "put a blank in its place")
    return Slip(*match.span(), "", f"here is a {name}, which cannot be seen", "remove it")


def odd_quotes(fault: TomlFault) -> Slip | None:
    """Text or a key in quotes that are not those of the keyboard, or of which one is not."""
    is_lost = fault.reason.startswith(UNENDED)
    for match in re.compile(rf"([{QUOTES}\"'])([^\n{QUOTES}\"']*)([{QUOTES}\"'])").finditer(fault.text, *fault.line):
        is_sound = match[1] == match[3] and match[1] in "\"'"
        if not is_sound and (is_lost or match.start() <= fault.offset <= match.end()):
            return fault.put(match.span(), f'"{match[2]}"', "these are no quotes of TOML")
    return None


def backslash(fault: TomlFault) -> Slip | None:
    """A path with backslashes, each of which begins an escape in quotes."""
    for match in re.compile(r'"([^"\n]*\\[^"\n]*)"').finditer(fault.text, *fault.line):
        if match.start() < fault.offset:
            new = re.sub(r"\\+", "/", match[0])
            return fault.put(match.span(), new, r"in quotes a \ begins an escape")
    return None


def open_text(fault: TomlFault) -> Slip | None:
    """Text of which only one quote is there."""
    if fault.reason.startswith(UNENDED):
        pattern = r"['\"]([\w.~/ -]*[\w.~/-])(?=[ \t]*([,}\]#].*)?$)"
    elif fault.reason.startswith(NO_VALUE):
        pattern = r"([A-Za-z~./][\w.~/ -]*+)[\"']"
    else:
        return None
    match = re.compile(pattern, re.MULTILINE).match(fault.text, fault.place)
    return match and fault.put(match.span(), f'"{match[1]}"', "a quote is missing")


def bare_word(fault: TomlFault) -> Slip | None:
    """A word as a value."""
    match = fault.here(rf"(?:[^\W\d]{_WORD}*+(?:[ \t]++{_WORD}++)*+|[~./\\]{_WORD}*+)(?![ \t]*[=:])")
    if not fault.reason.startswith(NO_VALUE) or match is None or unit_of(fault.key_at(fault.offset)):
        return None
    word = match[0].lower()
    if word in TRUE + FALSE:
        return fault.put(match.span(), "true" if word in TRUE else "false", f"{match[0]} is no truth value of TOML")
    new = re.sub(r"\\+", "/", match[0])
    return fault.put(match.span(), f'"{new}"', "text stands in quotes")


def equals_sign(fault: TomlFault) -> Slip | None:
    """Another sign between a key and its value, or none."""
    what = "between a key and its value stands ="
    if fault.reason.startswith(NO_VALUE) and (match := fault.around(r"==+|=>")):
        return fault.put(match.span(), "=", what)
    if not fault.reason.startswith(NO_EQUALS):
        return None
    if match := fault.here(r":=|:|->|\u2192|\uff1d"):
        return fault.put(match.span(), "=", what)
    return fault.put((fault.offset, fault.offset), "= ", what) if fault.here(r"[\"'\[{\d+.-]") else None


def spaced_key(fault: TomlFault) -> Slip | None:
    """A key of several words."""
    match = fault.around(r"[A-Za-z_]\w*(?:[ \t]+\w+)+(?=[ \t]*=)")
    if not fault.reason.startswith(NO_EQUALS) or match is None:
        return None
    return fault.put(match.span(), re.sub(r"[ \t]+", "_", match[0]), "a key is one word")


def statement_end(fault: TomlFault) -> Slip | None:
    """Something behind a statement: a comma, a bracket too many, or the next statement."""
    if not fault.reason.startswith(MORE):
        return None
    if match := fault.here(r"[,;\]})][ \t]*"):
        return fault.put(match.span(), "", f"nothing stands behind a statement, and no {match[0].strip()}")
    if fault.here(r"[\w\"'.-]+[ \t]*=|\[") is None:
        return None
    return Slip(fault.offset, fault.offset, "\n", "a line has one statement", "begin a new line here")


def comment(fault: TomlFault) -> Slip | None:
    """A comment of another language."""
    signs = r"/\*+|//+" if fault.reason.startswith((NO_VALUE, MORE, OPEN)) else r"/\*+|//+|;+|%+|!+|<!--"
    match = fault.here(signs) or re.compile(r"[ \t]*--+(?=[ \t])").match(fault.text, *fault.line)
    return match and fault.put(match.span(), "#", "a comment begins with #")


def inline_table(fault: TomlFault) -> Slip | None:
    """A table in braces over several lines, or with a comma too many."""
    if not fault.open or fault.text[fault.open[-1]] != "{":
        return None
    start, end = fault.open[-1], closing(fault.text, fault.open[-1])
    if end is None:
        return None
    old = fault.text[start : end + 1]
    if "\n" not in old:
        return _comma_too_many(fault)
    new = re.sub(r",[ \t]*\}$", " }", re.sub(r"[ \t]*(#[^\n]*)?\n\s*", " ", old))
    why = "write all of it on one line, from this { to its }, without comments and a comma before the }"
    hint = f"write `{new}`, on one line" if len(new) <= LONGEST else why
    return Slip(start, end + 1, new, "a table in { } stands on one line", hint)


def _comma_too_many(fault: TomlFault) -> Slip | None:
    """A comma before the end of a table in braces, or two in a row."""
    if fault.here(",") and fault.text[fault.before - 1] == ",":
        return fault.put((fault.offset, fault.offset + 1), "", "two commas stand in a row")
    if fault.here(r"\}") and fault.text[fault.before - 1] == ",":
        return fault.put((fault.before - 1, fault.before), "", "a table in { } has no comma before its end")
    return None


def missing_comma(fault: TomlFault) -> Slip | None:
    """Two items or keys with nothing between them."""
    in_braces = fault.open and fault.text[fault.open[-1]] == "{"
    following = r"[\w\"'.-]+[ \t]*[=:]" if in_braces else r"[\w\"'\[{+-]"
    if not fault.reason.startswith(OPEN) or fault.here(following) is None:
        return None
    hint = f"write `,` after {_last(fault.text[: fault.before])}"
    return Slip(fault.before, fault.before, ",", "a comma is missing", hint)


def missing_bracket(fault: TomlFault) -> Slip | None:
    """A bracket that is not closed, nor those around it."""
    closers = "".join(CLOSERS[fault.text[each]] for each in reversed(fault.open))
    if not fault.reason.startswith((OPEN, NO_KEY, NO_VALUE)) or not closers:
        return None
    first, comma = fault.open[-1], fault.text[fault.before - 1] == ","
    what = f"the {fault.text[first]} of line {fault.text.count(NEWLINE, 0, first) + 1} is not closed"
    helping = []
    for count in range(1, len(closers) + 1):
        for at in (fault.before, fault.before - comma):
            new = closers[:count]
            slip = Slip(at, at, new, what, f"write `{new}` after {_last(fault.text[:at])}")
            after = TomlFault.of(slip.applied(fault.text))
            if after is None:
                return slip
            helping += [slip] if after.left < fault.left else []
    return helping[0] if helping else None


def wrong_bracket(fault: TomlFault) -> Slip | None:
    """A bracket that closes another kind, a round one, or a header that lacks one."""
    if fault.reason.startswith(LATE_TABLE):
        has_one = fault.text.startswith("]", fault.offset)
        missing = "]]" if "']]'" in fault.reason and not has_one else "]"
        at = fault.offset + has_one
        hint = f"write `{missing}` after {_last(fault.text[: fault.before])}"
        return Slip(at, at, missing, "the brackets of a table are not closed", hint)
    if (match := fault.here(r"\(([^()\n]*)\)")) and fault.reason.startswith(NO_VALUE):
        return fault.put(match.span(), f"[{match[1]}]", "an array stands in square brackets")
    if fault.open and (match := fault.here(r"[\]})]")):
        right = CLOSERS[fault.text[fault.open[-1]]]
        return fault.put(match.span(), right, f"{match[0]} does not close {fault.text[fault.open[-1]]}")
    return None


def _last(text: str) -> str:
    """The end of a text, in a few words."""
    words = text.rpartition("\n")[2].split()
    return f"`{' '.join(words[-3:])[-30:]}`"


SLIPS: tuple[Callable[[TomlFault], Slip | None], ...] = (
    calculation,
    number,
    odd_space,
    odd_quotes,
    backslash,
    equals_sign,
    comment,
    open_text,
    bare_word,
    inline_table,
    statement_end,
    missing_comma,
    missing_bracket,
    wrong_bracket,
    spaced_key,
)
"""In this order: what is told by a sign comes before what only might be meant."""
