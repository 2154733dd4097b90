"""JSON data to frozen dataclasses, with every mismatch named; what pydantic would do, without its start-up time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Any, get_args, get_origin, get_type_hints

from curveline.units import told_apart

Problem = tuple[str, str]
"""Code and message."""

LARGEST = 1e15
"""No length, angle, time, rate or force of a record is larger, so that products of a few of them stay finite."""
DEEPEST = 20
"""How deep data without a schema may be nested."""


class Decoder:
    """Collects `problems` while it decodes; what it returns is of use only if there are none."""

    def __init__(self) -> None:
        self.problems: list[Problem] = []

    def decode(self, kind: Any, value: Any, where: str) -> Any:
        """`value` as `kind`: a dataclass, a tuple, a mapping, float, int, bool, str or Any; `where` is its key path.

        With `| None` it may also be null.
        """
        if get_origin(kind) is UnionType:
            (kind,) = set(get_args(kind)) - {NoneType}
            if value is None:
                return None
        if is_dataclass(kind):
            return self._record(kind, value, where)
        if get_origin(kind) is tuple:
            return self._row(get_args(kind), value, where)
        if kind is float:
            return self._number(value, where)
        if kind is Any:
            return self._anything(value, where)
        if get_origin(kind) is Mapping:
            return self._anything(value, where) if isinstance(value, dict) else self._mismatch(where, "an object")
        if kind is bool:
            return value if isinstance(value, bool) else self._mismatch(where, "true or false")
        if kind is int:
            whole = isinstance(value, int) and not isinstance(value, bool)
            return value if whole else self._mismatch(where, "a whole number")
        return self._text(value, where) if isinstance(value, str) else self._mismatch(where, "a string")

    def problem(self, code: str, message: str) -> None:
        """Record a problem."""
        self.problems.append((code, message))

    def _record(self, kind: Any, value: Any, where: str) -> Any:
        if not isinstance(value, dict):
            return self._mismatch(where, "an object")
        prefix = f"{where}." if where else ""
        hints = _hints(kind)
        for key in sorted(value.keys() - hints.keys()):
            self.problem("unknown-key", f"there is no key {key[:40]!r} in {where or 'the document'}")
        given = {}
        for entry in fields(kind):
            if entry.name in value:
                given[entry.name] = self.decode(hints[entry.name], value[entry.name], prefix + entry.name)
            elif entry.default is MISSING and entry.default_factory is MISSING:
                self.problem("missing-key", f"{prefix}{entry.name} is missing")
                given[entry.name] = None
        return kind(**given)

    def _row(self, kinds: tuple[Any, ...], value: Any, where: str) -> Any:
        if not isinstance(value, list):
            return self._mismatch(where, "an array")
        if kinds[-1] is Ellipsis:
            kinds = kinds[:1] * len(value)
        elif len(kinds) != len(value):
            self.problem("item-count", f"{where} has {len(value)} items, but must have {len(kinds)}")
            return None
        return tuple(
            self.decode(kind, item, f"{where}[{i}]") for i, (kind, item) in enumerate(zip(kinds, value, strict=True))
        )

    def _number(self, value: Any, where: str) -> float | None:
        if isinstance(value, bool) or not isinstance(value, int | float):
            self._mismatch(where, "a number")
            return None
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if self._finite(number, where) and abs(number) > LARGEST:
            given, most = told_apart(abs(number), LARGEST, 6)
            sign = "-" if number < 0.0 else ""
            self.problem("out-of-range", f"{where} is {sign}{given}, but no number here is beyond {most}")
        return number

    def _finite(self, number: float, where: str) -> bool:
        if not math.isfinite(number):
            self.problem("not-finite", f"{where} is not a finite number")
        return math.isfinite(number)

    def _text(self, value: str, where: str) -> str:
        if not value.isprintable():
            self.problem("bad-value", f"{where} has characters that cannot be shown")
        return value

    def _anything(self, value: Any, where: str, depth: int = 0) -> Any:
        """Data without a schema, which must still be finite and fit to be shown."""
        if depth > DEEPEST:
            self.problem("too-deep", f"{where.split('.')[0]} is nested too deep")
        elif isinstance(value, dict):
            for key, item in value.items():
                self._text(key, f"a key in {where}")
                self._anything(item, f"{where}.{key[:40]}", depth + 1)
        elif isinstance(value, list):
            for index, item in enumerate(value):
                self._anything(item, f"{where}[{index}]", depth + 1)
        elif isinstance(value, str):
            self._text(value, where)
        elif isinstance(value, float):
            self._finite(value, where)
        return value

    def _mismatch(self, where: str, wanted: str) -> None:
        self.problem("wrong-type", f"{where or 'the document'} must be {wanted}")


@cache
def _hints(kind: Any) -> dict[str, Any]:
    return get_type_hints(kind)
