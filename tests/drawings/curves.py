"""Curves that are known, and how far a drawing is from one."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from curveline.drawings.drawing import Drawing
from curveline.drawings.reading import read_drawing
from curveline.drawings.sketch import HowToRead
from curveline.errors import InvalidInput

Array = npt.NDArray[np.float64]


def bezier(*control: tuple[float, float], count: int = 4001) -> Array:
    """Points of a Bezier curve, by de Casteljau."""
    rows = [np.tile(point, (count, 1)).astype(float) for point in control]
    t = np.linspace(0.0, 1.0, count)[:, None]
    while len(rows) > 1:
        rows = [(1.0 - t) * one + t * other for one, other in pairwise(rows)]
    return rows[0]


def arc(center: tuple[float, float], radius: float, begin_deg: float, end_deg: float) -> Array:
    """Points of a part of a circle."""
    t = np.linspace(math.radians(begin_deg), math.radians(end_deg), 4001)
    return np.column_stack([center[0] + radius * np.cos(t), center[1] + radius * np.sin(t)])


def off(drawing: Drawing, truth: Array) -> float:
    """How far [mm] a drawing is from points [mm] of the true curve, or these from it."""
    ours = drawing.points * 1e3
    return max(_farthest(ours, truth), _farthest(truth, ours))


def _farthest(points: Array, line: Array) -> float:
    begin, step = line[:-1], np.diff(line, axis=0)
    size = np.maximum((step**2).sum(axis=1), 1e-30)
    worst = 0.0
    for point in points[:: max(1, len(points) // 400)]:
        t = np.clip(((point - begin) * step).sum(axis=1) / size, 0.0, 1.0)
        worst = max(worst, float(np.min(np.hypot(*(begin + t[:, None] * step - point).T))))
    return worst


def refusal(path: Path, **how: object) -> tuple[str, str, str, int]:
    """The code, the message, the hint and the line with which a file is refused."""
    with pytest.raises(InvalidInput) as caught:
        read_drawing(path, HowToRead(**how))  # type: ignore[arg-type]
    (first, *_) = caught.value.diagnostics
    assert first.path == str(path)
    assert first.hint
    return first.code, first.message, first.hint, first.line


def written(folder: Path) -> Callable[[str, str | bytes], Path]:
    """What writes a file into a folder, and gives its path."""

    def write(name: str, content: str | bytes) -> Path:
        path = folder / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write
