"""What is wrong with an option, in words: what was given, what is allowed, in the unit that the option's name says."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import typer

from curveline.units import plain

NUMBER = {"float_parsing": "number", "int_parsing": "whole number", "int_from_float": "whole number"}
MINUS = "\N{MINUS SIGN}"
BOUNDS = frozenset({"greater_than", "greater_than_equal", "less_than", "less_than_equal", "finite_number"})


def in_words(error: typer.BadParameter) -> str:
    """What is wrong with an option's value; "" where it was not refused for its type or its size."""
    from curveline.shapes.key_units import unit_of

    details = _details(error)
    names = [name.replace("-", "_") for name in getattr(error.param, "opts", ())]
    unit = next((unit for unit in map(unit_of, names) if unit), " %" if "percent" in "".join(names) else "")
    given, kind = str(details.get("input", "")), str(details.get("type", ""))
    if kind in NUMBER:
        return f"{given[:40]!r} is no {NUMBER[kind]}{_better(given, NUMBER[kind], unit)}"
    if kind in BOUNDS:
        return f"{given[:40]}{unit} is not allowed: give {_allowed(error.param, details)}{unit}"
    return ""


def _details(error: typer.BadParameter) -> Mapping[str, Any]:
    """The first finding of the validation that refused a value; empty if it was something else."""
    find = getattr(error.__cause__, "errors", None)
    found = find() if callable(find) else []
    return found[0] if found else {}


def _better(given: str, noun: str, unit: str) -> str:
    """The number that was probably meant, as the end of a sentence."""
    match = re.fullmatch(rf"\s*([-{MINUS}+]?\d+)(?:([.,])(\d+))?\s*([^\d\s]*)\s*", given)
    if match is None:
        return ""
    whole, point, decimals, suffix = match.groups()
    if noun == "whole number" and point:
        return ""
    number = f"{whole.replace(MINUS, '-')}{'.' + decimals if decimals else ''}"
    if suffix and suffix != unit.strip():
        return f": give the number of{unit} alone" if unit else ""
    return f": write {number}{suffix and f', it is in{unit}'}"


def _allowed(param: Any, details: Mapping[str, Any]) -> str:
    """The range of an option's values."""
    info = getattr(getattr(param, "type_descriptor", None), "parameter_info", None)
    least, most = getattr(info, "min", None), getattr(info, "max", None)
    if least is None and most is None:
        context = details.get("ctx", {})
        least = context.get("ge", context.get("gt"))
        most = context.get("le", context.get("lt"))
    if least is not None and most is not None:
        return f"{plain(least)} to {plain(most)}"
    ends = [f"{words} {plain(end)}" for words, end in (("at least", least), ("at most", most)) if end is not None]
    return ends[0] if ends else "a finite number"
