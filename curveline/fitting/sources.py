"""Where drawings come from: points in a CSV file, and formulas; what was meant by a number is said, never guessed."""

from __future__ import annotations

import ast
import csv
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from curveline.errors import Diagnostic, InvalidInput
from curveline.fitting.drawing import Drawing
from curveline.scene import Display
from curveline.system.files import AnyPath, decode_text, excerpt, read_file, refuse_file
from curveline.units import to_mm

MAX_BYTES = 64_000_000
UNITS: Mapping[str, float] = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
"""What a unit of a drawing is in metres."""
PER_SEGMENT = 400
"""Points of a formula per segment."""
MOST_LETTERS = 1000
DEEPEST = 40
FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    **{name: getattr(np, name) for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "abs", "tanh", "sign", "floor")},
    "min": np.minimum,
    "max": np.maximum,
    "where": np.where,
}
CONSTANTS = {"pi": math.pi, "e": math.e}
_BINARY = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.Mod: operator.mod,
}
_UNARY = {ast.UAdd: operator.pos, ast.USub: operator.neg}
_COMPARE = {ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge}
KNOWN = f"it may have x, numbers, + - * / ** %, comparisons, {', '.join((*FUNCTIONS, *CONSTANTS))}"


def drawing_of_formula(text: str, display: Display) -> Drawing:
    """The height [mm] that a formula gives at every x [mm] from the first rail of a display to the last.

    InvalidInput for what is no formula of x, or has no value somewhere.
    """
    x = np.linspace(0.0, to_mm(display.span) * (display.node_count - 1), PER_SEGMENT * (display.node_count - 1) + 1)
    if len(text) > MOST_LETTERS:
        raise InvalidInput(f"a formula of {len(text)} letters is too long", f"write at most {MOST_LETTERS}")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise InvalidInput(
            f"{text!r} is no formula", f"write the height in mm at x in mm, such as 60*sin(pi*x/500); {KNOWN}"
        ) from None
    with np.errstate(all="ignore"):
        try:
            y = np.broadcast_to(np.asarray(_value(tree, x, 0), dtype=np.float64), x.shape)
        except (TypeError, ValueError, OverflowError, ZeroDivisionError) as error:
            raise InvalidInput(f"{text!r} has no value: {error}", KNOWN) from None
    bad = np.flatnonzero(~np.isfinite(y))
    if bad.size:
        raise InvalidInput(f"{text!r} has no value at x = {x[bad[0]]:g} mm", "x runs over the display, in mm")
    return Drawing(np.column_stack([x, y]) * 1e-3, text.strip())


def _value(node: ast.expr, x: Any, depth: int) -> Any:
    """What a part of a formula comes to; InvalidInput for what has no place in one."""
    if depth > DEEPEST:
        raise InvalidInput("this formula is nested too deeply", "write it with fewer brackets")
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return float(node.value)
    if isinstance(node, ast.Name) and node.id == "x":
        return x
    if isinstance(node, ast.Name) and node.id in CONSTANTS:
        return CONSTANTS[node.id]
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        return _BINARY[type(node.op)](_value(node.left, x, depth + 1), _value(node.right, x, depth + 1))
    if isinstance(node, ast.UnaryOp) and type(node.op) in _UNARY:
        return _UNARY[type(node.op)](_value(node.operand, x, depth + 1))
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _COMPARE:
        return _COMPARE[type(node.ops[0])](_value(node.left, x, depth + 1), _value(node.comparators[0], x, depth + 1))
    if (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id in FUNCTIONS
        and not node.keywords
    ):
        return FUNCTIONS[node.func.id](*(_value(each, x, depth + 1) for each in node.args))
    raise InvalidInput(f"a formula cannot have {ast.unparse(node)[:60]!r}", KNOWN)


def read_drawing(path: AnyPath, unit: str = "") -> Drawing:
    """The curve through the points of a CSV file, whose first line names its columns: x_mm and y_mm, or other units.

    Columns x and y take their `unit` from whoever asks. InvalidInput for a file that does not say its unit, or has
    lines that are no points.
    """
    name = str(path)
    lines = decode_text(read_file(path, MAX_BYTES), name).splitlines()
    rows = list(csv.reader(lines))
    scale, columns = _columns([cell.strip() for cell in rows[0]] if rows else [], unit, name)
    points, problems = [], []
    for number, row in enumerate(rows[1:], start=2):
        if not any(cell.strip() for cell in row):
            continue
        try:
            pair = [scale * float(row[column]) for column in columns]
        except (ValueError, IndexError):
            pair = [math.nan]
        if all(map(math.isfinite, pair)):
            points.append(pair)
        elif len(problems) < MAX_SHOWN:
            source, caret = excerpt(lines[number - 1] if number <= len(lines) else "", 1)
            message, hint = "this line has no x and y", "give two numbers, such as 120.5,33.1, and leave gaps out"
            problems.append(Diagnostic(name, number, 1, "no-point", message, hint, source, caret))
    if problems:
        raise InvalidInput(f"{name}: {problems[0].message}", problems[0].hint, problems)
    return Drawing(np.array(points).reshape(-1, 2), name)


MAX_SHOWN = 20
"""Problems of a file that are listed."""


def _columns(header: list[str], unit: str, name: str) -> tuple[float, tuple[int, int]]:
    """What a unit of the file is in metres, and which columns are x and y."""
    if unit and unit not in UNITS:
        raise InvalidInput(f"there is no unit {unit!r} of a drawing", f"choose one of {', '.join(UNITS)}")
    for known, scale in UNITS.items():
        if {f"x_{known}", f"y_{known}"} <= set(header):
            if unit and unit != known:
                refuse_file(name, "two-units", f"its columns are in {known}, and {unit} was asked for", "ask for none")
            return scale, (header.index(f"x_{known}"), header.index(f"y_{known}"))
    if {"x", "y"} <= set(header):
        if not unit:
            refuse_file(
                name, "no-unit", "its columns x and y have no unit", "name them x_mm and y_mm, or say --unit mm"
            )
        return UNITS[unit], (header.index("x"), header.index("y"))
    hint = "begin it with the line x_mm,y_mm, and give a point per line"
    refuse_file(name, "header", "the first line of this file does not name the columns of x and y", hint)
