"""A TOML file under examination: its data, where everything stands, and the problems found so far."""

from __future__ import annotations

import copy
import re
import tomllib
from collections.abc import Collection, Mapping
from difflib import get_close_matches
from typing import Any, NoReturn, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from curveline.errors import Diagnostic, InvalidInput
from curveline.phrases import counted
from curveline.shapes.key_units import unit_of
from curveline.shapes.toml_fault import TomlFault
from curveline.shapes.toml_location import MAX_DEPTH, KeyPath, TomlMap
from curveline.shapes.toml_repair import syntax_problems
from curveline.system.files import excerpt
from curveline.units import plain

MAX_DIAGNOSTICS = 100
"""More problems than anybody reads; a hostile file can hold a hundred thousand."""

MAX_EXPLAINED = 1000
"""Explaining one costs a search for similar keys; the rest only keeps its values from being used."""

ENORMOUS = 1 << 64
"""Whole numbers from here on are not TOML's any more, though tomllib reads them."""

_Model = TypeVar("_Model", bound=BaseModel)

_WRONG_TYPE = {
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "string_type": "text in quotes",
    "bool_type": "true or false",
    "list_type": "an array",
    "flag_or_list_type": "true, false or an array",
    "model_type": "a table",
}
_TYPE_NAMES = {
    bool: "a truth value",
    int: "a whole number",
    float: "a decimal number",
    str: "text",
    list: "an array",
    dict: "a table",
}
_BOUNDS = {
    "greater_than": ("gt", "above"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "below"),
    "less_than_equal": ("le", "at most"),
}


class Document:
    """A parsed TOML file that collects Diagnostics; InvalidInput at once if it is not TOML at all.

    `items` are the tables of which it may have several, written `[[item]]`.
    """

    def __init__(self, path: str, text: str, items: Collection[str] = ()) -> None:
        self.path = path
        self._items = items
        self._problems: list[tuple[int, int, str, str, str]] = []
        self._unusable: set[KeyPath] = set()
        self._lines = text.split("\n")
        self._map = TomlMap(text)
        self.data = self._parse(text)

    def varied(self, numbers: Mapping[KeyPath, float]) -> Document:
        """The same file with other numbers at these places, which it has; no problems found as yet."""
        other = copy.copy(self)
        other._problems, other._unusable, other.data = [], set(), copy.deepcopy(self.data)
        for path, value in numbers.items():
            other.get(*path[:-1])[path[-1]] = value
        return other

    def _parse(self, text: str) -> dict[str, Any]:
        if self._map.too_deep is not None:
            message = f"tables or arrays nested more than {MAX_DEPTH} deep"
            self._fail(self._map.position(self._map.too_deep), "too-deep", message, "remove the nesting")
        try:
            return tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            self._fail_syntax(TomlFault.told(text, str(error)))
        except ValueError:  # Python refuses to read a decimal number of more than 4300 digits
            digits = re.search(r"[0-9_]{4000}", text)
            position = self._map.position(digits.start() if digits else 0)
            self._fail(position, "out-of-range", "a number of thousands of digits", "write fewer digits")

    def _fail_syntax(self, fault: TomlFault) -> NoReturn:
        if fault.reason.startswith(("Cannot", "Duplicate")):
            self._fail_twice(fault)
        for found in syntax_problems(fault):
            place = self._map.position(found.offset)
            self._problems.append((*place, "toml-syntax", f"this is not TOML: {found.what}", found.hint))
        raise self.error()

    def _fail_twice(self, fault: TomlFault) -> NoReturn:
        """Refuse a key or a table that stands there twice, or a table in two ways."""
        line = fault.text[slice(*fault.line)]
        header = re.match(r"[ \t]*\[+[ \t]*([\w-]+)", line)
        if self._map.repeated is not None:
            path, offset = self._map.repeated
        else:
            name = header[1] if header else re.split(r"[.=]", line)[0].strip()
            path, offset = (name,), fault.line[0] + max(0, line.find(name))
        hint = "keep one of the two"
        if header and path[-1] in self._items:
            is_assigned = re.search(rf"(?m)^[ \t]*{path[-1]}[ \t]*=", fault.text)
            hint = f"{hint} ways" if is_assigned else f"write `[[{path[-1]}]]` for each of them"
        elif header:
            hint = f"keep one [{key_text(path)}], with the keys of both"
        first = self._map.key_position(path)[0]
        message = f"{key_text(path)} stands here for the second time, after line {first}"
        self._fail(self._map.position(offset), "duplicate-key", message, hint)

    def _fail(self, position: tuple[int, int], code: str, message: str, hint: str) -> NoReturn:
        self._problems.append((*position, code, message, hint))
        raise self.error()

    def problem(self, path: KeyPath, code: str, message: str, hint: str) -> None:
        """Record a problem with the value at `path`, located at the table around it if there is no such value."""
        self._problems.append((*self._map.value_position(path), code, message, hint))

    def problem_at_key(self, path: KeyPath, code: str, message: str, hint: str) -> None:
        """Record a problem with the key at the end of `path`."""
        self._problems.append((*self._map.key_position(path), code, message, hint))

    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """What was found, in file order, at most `MAX_DIAGNOSTICS`."""
        found = []
        for line, column, code, message, hint in sorted(self._problems)[:MAX_DIAGNOSTICS]:
            source, caret = excerpt(self._lines[line - 1], column)
            found.append(Diagnostic(self.path, line, column, code, message, hint, source, caret))
        return tuple(found)

    def error(self, elsewhere: tuple[Diagnostic, ...] = ()) -> InvalidInput:
        """The exception that carries everything found here, and `elsewhere` in a file that this one names."""
        count = len(self._problems) + len(elsewhere)
        found = (*self.diagnostics(), *elsewhere)
        rest = f", {len(found)} of them shown" if len(found) < count else ""
        return InvalidInput(f"{self.path}: {counted(count, 'problem')}{rest}", diagnostics=found)

    def has(self, *path: str) -> bool:
        """True if there is anything at `path`, faulty or not."""
        value: Any = self.data
        for part in path:
            if not isinstance(value, dict) or part not in value:
                return False
            value = value[part]
        return True

    def get(self, *path: str | int) -> Any:
        """The raw value at `path`; None if it is absent or was found faulty."""
        value: Any = self.data
        for length, part in enumerate(path, 1):
            if path[:length] in self._unusable:
                return None
            if isinstance(part, str):
                value = value.get(part) if isinstance(value, dict) else None
            else:
                value = value[part] if isinstance(value, list) and part < len(value) else None
        return value

    def number(self, *path: str | int) -> float | None:
        """The number at `path`; None if it is absent or was found faulty."""
        value = self.get(*path)
        return None if value is None else float(value)

    def validate(self, model: type[_Model]) -> _Model | None:
        """The document as `model`; None after recording everything that does not fit."""
        try:
            return model.model_validate(self.data)
        except ValidationError as error:
            found = error.errors(include_url=False)
            self._unusable.update(tuple(details["loc"]) for details in found)
            for details in found[:MAX_EXPLAINED]:
                self._record(model, details)
            return None

    def _record(self, model: type[BaseModel], details: Mapping[str, Any]) -> None:
        path: KeyPath = tuple(details["loc"])
        if details["type"] == "extra_forbidden":
            hint = _hint_for_unknown(model, path)
            self.problem_at_key(path, "unknown-key", f"there is no key {_quoted(path[-1])} here", hint)
            return
        code, message, advice = _explain(path, details)
        self.problem(path, code, message, f"{advice}: {_description(model, path)}")


def key_text(path: KeyPath) -> str:
    """A key path as people read it, with arrays counted from 1: `nodes[2].angle_deg`."""
    text = ""
    for part in path:
        text += f"[{part + 1}]" if isinstance(part, int) else f".{part}" if text else part
    return text if text.isprintable() and len(text) <= 80 else shown(text)


def shown(value: Any) -> str:
    """A value as it may stand in a message: short, on one line."""
    if isinstance(value, int) and abs(value) >= ENORMOUS:
        return "an enormous number"  # Python refuses to write out the largest ones
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def nearest(word: object, known: list[str]) -> str:
    """The first part of a hint: the known word that was probably meant; empty if there is none."""
    close = get_close_matches(str(word)[:100], known, n=1)
    return f"did you mean {close[0]}? " if close else ""


def _explain(path: KeyPath, details: Mapping[str, Any]) -> tuple[str, str, str]:
    """Code, message and advice for one finding of pydantic's."""
    kind, context, value = details["type"], details.get("ctx", {}), details["input"]
    name, unit = key_text(path), unit_of(_last_name(path))
    # Pydantic calls a whole number that no float can hold a wrong type; for a user it is out of range.
    enormous = kind in ("float_type", *_BOUNDS) and isinstance(value, int) and abs(value) >= ENORMOUS
    if kind == "missing":
        return "missing-key", f"{name} is missing", "add it"
    if kind in _WRONG_TYPE and not enormous:
        wanted, given = _WRONG_TYPE[kind], _TYPE_NAMES.get(type(value), "a date or time")
        return "wrong-type", f"{name} must be {wanted}, not {given}", _write(wanted, path, value)
    if kind == "finite_number":
        return "not-finite", f"{name} is {shown(value)}, which is not a finite number", "write a finite number"
    if kind in _BOUNDS or enormous:
        bound, words = _BOUNDS.get(kind, ("", ""))
        limit = f"{words} {plain(context[bound])}{unit}" if bound else "an ordinary number"
        return (
            "out-of-range",
            f"{name} is {shown(value)}{'' if enormous else unit}, but must be {limit}",
            f"make it {limit}",
        )
    if kind in ("too_short", "too_long"):
        limit = f"at most {context['max_length']}" if kind == "too_long" else f"at least {context['min_length']}"
        message = f"{name} has {counted(context['actual_length'], 'item')}, but must have {limit}"
        return "item-count", message, f"list {limit}"
    if kind == "string_too_long":
        limit = f"at most {context['max_length']} characters"
        return "bad-value", f"{name} has {len(value)} characters, but must have {limit}", f"use {limit}"
    return "bad-value", f"{name} is {shown(value)}, which is not one of the values it can have", "write"


def _write(wanted: str, path: KeyPath, value: Any) -> str:
    """What to write in place of a value of another type."""
    if wanted.endswith("number") and isinstance(value, str) and re.fullmatch(r"[-+]?\d+(\.\d+)?", value[:40]):
        return f"write {value}, without quotes"
    if wanted == "an array" and isinstance(value, dict) and len(path) == 1:
        return f"write `[[{path[0]}]]` above each"
    return f"write {wanted}"


def _hint_for_unknown(model: type[BaseModel], path: KeyPath) -> str:
    """What was probably meant by an unknown key: a similar one, or the same one in another table."""
    here = list(_model_at(model, path[:-1]).model_fields)
    guess = nearest(path[-1], here)
    if guess:
        return guess.strip()
    homes = [name for name, field in model.model_fields.items() if path[-1] in _fields_of(field.annotation)]
    if homes:
        return f"move it into {homes[0]}"
    return f"remove it; known here: {', '.join(here)}"


def _model_at(model: type[BaseModel], path: KeyPath) -> type[BaseModel]:
    for part in path:
        if isinstance(part, str):
            model = _table_type(model.model_fields[part].annotation) or model
    return model


def _table_type(annotation: Any) -> type[BaseModel] | None:
    """The model that an annotation is, or is a list of."""
    for candidate in (annotation, *get_args(annotation)):
        if isinstance(candidate, type) and issubclass(candidate, BaseModel):
            return candidate
    return None


def _fields_of(annotation: Any) -> list[str]:
    table = _table_type(annotation)
    return [] if table is None else list(table.model_fields)


def _description(model: type[BaseModel], path: KeyPath) -> str:
    names = [part for part in path if isinstance(part, str)]
    if isinstance(path[-1], int) and _table_type(_model_at(model, path[:-2]).model_fields[names[-1]].annotation):
        return "a table of " + ", ".join(_model_at(model, path).model_fields)
    owner = _model_at(model, path[: path.index(names[-1])])
    return owner.model_fields[names[-1]].description or ""


def _last_name(path: KeyPath) -> str:
    return next(str(part) for part in reversed(path) if isinstance(part, str))


def _quoted(name: object) -> str:
    text = str(name)
    return f"`{text}`" if text.isprintable() and len(text) <= 40 else shown(text)
