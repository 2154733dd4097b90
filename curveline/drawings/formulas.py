"""Drawings from formulas: the height at every place."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from curveline.drawings.drawing import LARGEST, Array, Drawing
from curveline.drawings.lengths import in_mm
from curveline.errors import InvalidInput
from curveline.phrases import counted
from curveline.units import mm, to_mm

POINTS = 4001
"""Points of a formula."""
MOST_LETTERS = 1000
DEEPEST = 40
FUNCTIONS: Mapping[str, tuple[Callable[..., Any], int]] = {
    **{
        name: (getattr(np, name), 1)
        for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "abs", "tanh", "sign", "floor")
    },
    "min": (np.minimum, 2),
    "max": (np.maximum, 2),
    "where": (np.where, 3),
}
"""What a formula may call, and with how many values: into one more numpy would write what it finds."""
CONSTANTS = {"pi": math.pi, "e": math.e}
_BINARY: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.Mod: operator.mod,
}
_UNARY: Mapping[type[ast.unaryop], Callable[[Any], Any]] = {ast.UAdd: operator.pos, ast.USub: operator.neg}
_COMPARE = {ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge}
KNOWN = f"numbers, + - * / ** %, comparisons, {', '.join((*FUNCTIONS, *CONSTANTS))}"


def drawing_of_formula(text: str, width: float) -> Drawing:
    """The height [mm] that a formula gives at every x [mm] from 0 to a width [m], such as that of a display.

    InvalidInput for what is no formula of x, or has no value somewhere.
    """
    x = np.linspace(0.0, to_mm(width), POINTS)
    y = heights_of(text, {"x": x})
    understood = f"formula in mm, x from 0 to {in_mm(width)} mm"
    return Drawing(np.column_stack([x, y]) * mm(1.0), text.strip(), understood)


def heights_of(text: str, places: Mapping[str, Array], *, is_finite: bool = True) -> Array:
    """The heights [mm] that a formula gives at places (n,) [mm], which are x, or x and y.

    InvalidInput for what is no formula of them, or has no value at one unless `is_finite` is False.
    """
    known = f"it may have {' and '.join(places)}, {KNOWN}"
    if len(text) > MOST_LETTERS:
        raise InvalidInput(f"a formula of {len(text)} letters is too long", f"write at most {MOST_LETTERS}")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        at = " and ".join(f"{name} in mm" for name in places)
        raise InvalidInput(
            f"{text!r} is no formula", f"write the height in mm at {at}, such as 60*sin(pi*x/500); {known}"
        ) from None
    x = next(iter(places.values()))
    with np.errstate(all="ignore"):
        try:
            heights = np.broadcast_to(np.asarray(_value(tree, places, 0), dtype=np.float64), x.shape)
        except (TypeError, ValueError, OverflowError, ZeroDivisionError) as error:
            raise InvalidInput(f"{text!r} has no value: {error}", known) from None
    bad = np.flatnonzero(~np.isfinite(heights))
    runs = "x runs over the display" if len(places) == 1 else "x runs over the display, y over the lines"
    if bad.size and is_finite:
        raise InvalidInput(f"{text!r} has no value at {_place(places, bad[0])}", f"{runs}, in mm")
    far = np.flatnonzero(np.abs(heights) > to_mm(LARGEST))
    if far.size:
        message = f"{text!r} is {heights[far[0]]:.4g} mm at {_place(places, far[0])}, where no display is"
        raise InvalidInput(message, f"write the height in mm; {runs}, in mm")
    return heights


def _place(places: Mapping[str, Array], which: int) -> str:
    """One of the places in words."""
    return ", ".join(f"{name} = {values[which]:g} mm" for name, values in places.items())


def _value(node: ast.expr, places: Mapping[str, Array], depth: int) -> Any:
    """What a part of a formula comes to; InvalidInput for what has no place in one."""
    if depth > DEEPEST:
        raise InvalidInput("this formula is nested too deeply", "write it with fewer brackets")
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and type(node.value) is not bool:
        return float(node.value)
    if isinstance(node, ast.Name) and node.id in places:
        return places[node.id]
    if isinstance(node, ast.Name) and node.id in CONSTANTS:
        return CONSTANTS[node.id]
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        return _BINARY[type(node.op)](_value(node.left, places, depth + 1), _value(node.right, places, depth + 1))
    if isinstance(node, ast.UnaryOp) and type(node.op) in _UNARY:
        return _UNARY[type(node.op)](_value(node.operand, places, depth + 1))
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _COMPARE:
        return _COMPARE[type(node.ops[0])](
            _value(node.left, places, depth + 1), _value(node.comparators[0], places, depth + 1)
        )
    if (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id in FUNCTIONS
        and not node.keywords
    ):
        function, count = FUNCTIONS[node.func.id]
        if len(node.args) != count:
            message = f"{node.func.id} is of {counted(count, 'value')}, not of {len(node.args)}"
            raise InvalidInput(message, f"write {node.func.id}({', '.join('abc'[:count])})")
        return function(*(_value(each, places, depth + 1) for each in node.args))
    raise InvalidInput(
        f"a formula cannot have {ast.unparse(node)[:60]!r}", f"it may have {' and '.join(places)}, {KNOWN}"
    )
