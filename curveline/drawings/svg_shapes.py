"""The shapes of SVG as points: paths, lines, polylines, polygons, rectangles, circles and ellipses."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import numpy as np

from curveline.drawings.drawing import MOST_POINTS, Array
from curveline.drawings.flattening import flat_bezier, flat_conic
from curveline.drawings.lengths import UNITS
from curveline.drawings.xml_tree import Element

if TYPE_CHECKING:
    import svgelements

SHAPES = ("path", "line", "polyline", "polygon", "rect", "circle", "ellipse")
MOST_SEGMENTS = 300_000
LONGEST = 100
"""Letters of a length."""
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_LENGTH = re.compile(rf"\s*({NUMBER})\s*([a-zA-Z]*)\s*\Z")
_NUMBERS = re.compile(rf"[\s,]*({NUMBER})")
_UNITS = {**UNITS, "pc": 12.0 * UNITS["pt"], "q": UNITS["mm"] / 4.0, "": UNITS["px"]}


def length_of(text: str) -> tuple[float, str] | None:
    """The number and the unit of a length such as 210mm; None for what is none, or a percentage."""
    found = _LENGTH.match(text[:LONGEST])
    if found is None or len(text) > LONGEST or found[2].lower() not in _UNITS:
        return None
    value = float(found[1])
    return (value, found[2].lower()) if math.isfinite(value) else None


def metres_of_length(value: float, unit: str) -> float:
    """A length of SVG in metres, px being 1/96 inch."""
    return value * _UNITS[unit]


def numbers_of(text: str) -> list[float]:
    """Numbers with spaces or commas between them; ValueError for anything else."""
    at, found = 0, []
    while match := _NUMBERS.match(text, at):
        found.append(float(match[1]))
        at = match.end()
    if text[at:].strip(" \t\r\n,"):
        raise ValueError(f"{text[at : at + 20]!r} is no number")
    return found


def lines_of(element: Element, matrix: Array, error: float) -> list[Array]:
    """The lines (k, 2) of a shape as a `matrix (2, 3)` puts them, one per part of a path that was drawn in one go.

    ValueError for attributes that are damaged. `error` is in the units that the matrix leads to, 0 for a part of the
    size of each curve.
    """
    stretch = float(np.linalg.norm(matrix[:, :2], 2))
    if not (math.isfinite(stretch) and np.isfinite(matrix).all()):
        raise ValueError("its transform is no number")
    within = error / stretch if error and stretch > 0.0 else 0.0
    lines = _path(element.get("d"), within) if element.tag == "path" else _basic(element, within)
    return [line @ matrix[:, :2].T + matrix[:, 2] for line in lines if len(line) > 1]


def _user(element: Element, name: str) -> float:
    """A length in user units; ValueError for one that is none."""
    text = element.get(name).strip()
    if not text:
        return 0.0
    found = length_of(text)
    if found is None:
        raise ValueError(f"{name} is {text[:40]!r}, which is no length")
    return found[0] if not found[1] else metres_of_length(*found) / UNITS["px"]


def _basic(element: Element, error: float) -> list[Array]:
    if element.tag == "line":
        x1, y1, x2, y2 = (_user(element, name) for name in ("x1", "y1", "x2", "y2"))
        return [np.array([[x1, y1], [x2, y2]])]
    if element.tag in ("polyline", "polygon"):
        numbers = numbers_of(element.get("points"))
        if len(numbers) % 2:
            raise ValueError(f"its points have {len(numbers)} numbers, an x without its y")
        points = np.array(numbers, dtype=np.float64).reshape(-1, 2)
        return [np.vstack([points, points[:1]]) if element.tag == "polygon" else points]
    if element.tag == "rect":
        return [_rectangle(element, error)]
    center = np.array([_user(element, "cx"), _user(element, "cy")])
    radii = ("r", "r") if element.tag == "circle" else ("rx", "ry")
    return [flat_conic(center, np.diag([_user(element, name) for name in radii]), (0.0, 2.0 * math.pi), error)]


def _rectangle(element: Element, error: float) -> Array:
    """The outline of a rectangle, its corners round if it says so."""
    x, y, wide, high = (_user(element, name) for name in ("x", "y", "width", "height"))
    rx = _user(element, "rx" if element.get("rx") not in ("", "auto") else "ry")
    ry = _user(element, "ry" if element.get("ry") not in ("", "auto") else "rx")
    rx, ry = min(rx, wide / 2.0), min(ry, high / 2.0)
    if not (rx > 0.0 and ry > 0.0):
        return np.array([[x, y], [x + wide, y], [x + wide, y + high], [x, y + high], [x, y]])
    centers = [(x + wide - rx, y + ry), (x + wide - rx, y + high - ry), (x + rx, y + high - ry), (x + rx, y + ry)]
    quarter = 0.5 * math.pi
    corners = [
        flat_conic(np.array(center), np.diag([rx, ry]), ((k - 1) * quarter, k * quarter), error)
        for k, center in enumerate(centers)
    ]
    return np.vstack([*corners, corners[0][:1]])


def _path(text: str, error: float) -> list[Array]:
    """The parts of a path; ValueError for one that is damaged anywhere."""
    import svgelements

    path, parser = svgelements.Path(), svgelements.SVGLexicalParser()
    if text.strip():
        parser.parse(path, text)
        rest = text[parser.pos :].strip(" \t\r\n,")
        if rest:
            raise ValueError(f"its path breaks off at {rest[:20]!r}")
    if len(path) > MOST_SEGMENTS:
        raise ValueError(f"its path has more than {MOST_SEGMENTS} segments")
    parts: list[list[Array]] = []
    points = 0
    for segment in path:
        if isinstance(segment, svgelements.Move) or not parts:
            parts.append([_xy(segment.end)[None, :]])
        if not isinstance(segment, svgelements.Move):
            parts[-1].append(_segment(segment, error))
        points += len(parts[-1][-1])
        if points > MOST_POINTS:
            raise ValueError(f"its path takes more than {MOST_POINTS} points")
        if isinstance(segment, svgelements.Close):
            parts.append([_xy(segment.end)[None, :]])
    lines = [np.vstack(part) for part in parts]
    for line in lines:
        if not np.isfinite(line).all():
            raise ValueError("its path leads to no number")
    return lines


def _segment(segment: svgelements.PathSegment, error: float) -> Array:
    """The points of a segment after its first."""
    import svgelements

    if isinstance(segment, svgelements.CubicBezier):
        control = [segment.start, segment.control1, segment.control2, segment.end]
    elif isinstance(segment, svgelements.QuadraticBezier):
        control = [segment.start, segment.control, segment.end]
    elif isinstance(segment, svgelements.Arc) and segment.sweep:
        return _arc(segment, error)
    else:
        return _xy(segment.end)[None, :]
    return flat_bezier(np.array([_xy(each) for each in control]), error)[1:]


def _arc(segment: Any, error: float) -> Array:
    center = _xy(segment.center)
    axes = np.array([_xy(segment.prx) - center, _xy(segment.pry) - center])
    if not abs(np.linalg.det(axes)) > 0.0:
        return _xy(segment.end)[None, :]
    begin = math.atan2(*np.linalg.solve(axes.T, _xy(segment.start) - center)[::-1])
    points = flat_conic(center, axes, (begin, begin + float(segment.sweep)), error)[1:]
    # Its end is what the file says, and not what angles come to.
    points[-1] = _xy(segment.end)
    return points


def _xy(point: Any) -> Array:
    if point is None:
        raise ValueError("a segment of its path has no beginning")
    return np.array([float(point.x), float(point.y)])
