"""Transforms and viewports of SVG as matrices (2, 3): a point p goes to m[:, :2] p + m[:, 2]."""

from __future__ import annotations

import math
import re

import numpy as np

from curveline.drawings.drawing import Array
from curveline.drawings.svg_shapes import numbers_of
from curveline.units import deg

IDENTITY = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
IDENTITY.flags.writeable = False
LARGEST = 1e9
"""No number of a transform is larger."""
MOST_LETTERS = 10_000
_STEP = re.compile(r"[\s,]*([a-zA-Z]+)\s*\(([^()]*)\)")
_COUNTS = {"matrix": (6,), "translate": (1, 2), "scale": (1, 2), "rotate": (1, 3), "skewX": (1,), "skewY": (1,)}


def after(outer: Array, inner: Array) -> Array:
    """The matrix of doing the inner one first."""
    # A page in a page may be infinitely large: whoever puts a line on it refuses that.
    with np.errstate(all="ignore"):
        return np.column_stack([outer[:, :2] @ inner[:, :2], outer[:, :2] @ inner[:, 2] + outer[:, 2]])


def shift(x: float, y: float) -> Array:
    """The matrix that moves by x and y."""
    return np.array([[1.0, 0.0, x], [0.0, 1.0, y]])


def transform_of(text: str) -> Array:
    """The matrix of a transform attribute (SVG 2, section 8.5); ValueError for one that cannot be read whole."""
    if len(text) > MOST_LETTERS:
        raise ValueError("its transform is very long")
    matrix, at = IDENTITY, 0
    while step := _STEP.match(text, at):
        numbers = numbers_of(step[2])
        if len(numbers) not in _COUNTS.get(step[1], ()):
            raise ValueError(f"{step[0][:40]!r} is no transform")
        matrix = after(matrix, _step(step[1], numbers))
        at = step.end()
    if text[at:].strip(" \t\r\n,"):
        raise ValueError(f"{text[at : at + 40]!r} is no transform")
    if not (np.abs(matrix) < LARGEST).all():
        raise ValueError("its transform leads nowhere")
    return matrix


def _step(kind: str, numbers: list[float]) -> Array:
    first, second = numbers[0], numbers[1] if len(numbers) > 1 else 0.0
    if kind == "matrix":
        return np.array(numbers).reshape(3, 2).T
    if kind == "translate":
        return shift(first, second)
    if kind == "scale":
        return np.array([[first, 0.0, 0.0], [0.0, second if len(numbers) > 1 else first, 0.0]])
    if kind == "rotate":
        cos, sin = math.cos(deg(first)), math.sin(deg(first))
        turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0]])
        x, y = numbers[1:] or (0.0, 0.0)
        return after(after(shift(x, y), turn), shift(-x, -y))
    slant = math.tan(deg(first))
    return np.array([[1.0, slant, 0.0], [0.0, 1.0, 0.0]] if kind == "skewX" else [[1.0, 0.0, 0.0], [slant, 1.0, 0.0]])


def viewport(place: tuple[float, float, float, float], box: tuple[float, float, float, float], aspect: str) -> Array:
    """The matrix that puts a viewBox into a place, both left, top, width and height (SVG 2, section 8.2)."""
    words = aspect.split()
    align = words[0] if words else "xMidYMid"
    with np.errstate(all="ignore"):
        return _viewport(np.array(place), np.array(box), align, is_slice=words[1:] == ["slice"])


def _viewport(place: Array, box: Array, align: str, *, is_slice: bool) -> Array:
    scales = place[2:] / box[2:]
    if align != "none":
        scales[:] = scales.max() if is_slice else scales.min()
    matrix = np.zeros((2, 3))
    for axis, word in enumerate(("x", "Y")):
        matrix[axis, axis] = scales[axis]
        room = place[2 + axis] - box[2 + axis] * scales[axis]
        part = 0.5 if f"{word}Mid" in align else 1.0 if f"{word}Max" in align else 0.0
        matrix[axis, 2] = place[axis] - box[axis] * scales[axis] + part * room
    return matrix
