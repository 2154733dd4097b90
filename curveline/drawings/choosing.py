"""One curve of all that a file has: the one that was named, or the only one; never a guess."""

from __future__ import annotations

import difflib
import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NoReturn

import numpy as np

from curveline.drawings.drawing import LARGEST, Array, Drawing
from curveline.drawings.joining import Chain, Fork, chains, edge_of
from curveline.drawings.lengths import in_mm, size_in_mm
from curveline.drawings.sketch import ERROR, OF_WIDTH, HowToRead, Piece, Sketch, refuse_line
from curveline.system.files import printable
from curveline.units import mm, to_mm

FLOAT = 1e-14
"""Part of a coordinate that is noise."""
MOST_LETTERS = 100
"""Of a name that is told."""
SHOWN = 12
"""Names of curves that are told."""


def drawing_of(sketch: Sketch, how: HowToRead, name: str) -> Drawing:
    """The curve of a sketch that was asked for, to its scale.

    InvalidInput where there are several, none by that name, a gap, or a closed outline of which no edge was chosen.
    """
    pieces = _named(sketch.pieces, how.curve, name)
    near = _near(sketch, pieces, name)
    line = _only_line(sketch, pieces, near, name)
    said = [sketch.said]
    if how.curve or (len({piece.names[:1] for piece in pieces}) == 1 and pieces[0].names):
        said.append(f"curve {_quoted(how.curve or pieces[0].names[0])}")
    if len(pieces) > 1:
        said.append(f"{len(pieces)} pieces joined")
    points = line.points
    if line.is_closed:
        points = _edge(line, how, pieces[0], name)
        said.append(f"{how.edge} edge of its outline")
    scale = _scale(sketch, how, points, name)
    if not sketch.unit:
        said.append(f"1 unit = {in_mm(scale)} mm, for a width of {how.width_mm:g} mm")
    with np.errstate(over="ignore"):
        points = points * scale
    if not (np.abs(points) <= LARGEST).all():
        message = f"for a width of {how.width_mm} mm it reaches farther than {LARGEST:g} m, where no display is"
        refuse_line(name, pieces[0].line, "far-away", message, "move it to x = 0, or choose another width")
    wide, high = map(float, np.ptp(points, axis=0))
    said.append(f"{size_in_mm(wide, high)} in all")
    return Drawing(points, name, ", ".join(each for each in said if each))


def _near(sketch: Sketch, pieces: Sequence[Piece], name: str) -> float:
    """How far ends may be apart that are joined, in units of the file; InvalidInput for places where nothing is."""
    low = np.min([piece.points.min(axis=0) for piece in pieces], axis=0)
    high = np.max([piece.points.max(axis=0) for piece in pieces], axis=0)
    farthest = float(max(np.abs(low).max(), np.abs(high).max()))
    if not farthest * (sketch.unit or 1.0) <= LARGEST / (1.0 if sketch.unit else OF_WIDTH):
        unit = f"1 unit = {in_mm(sketch.unit)} mm" if sketch.unit else "its units"
        message = f"it has places {farthest:.4g} units away from its origin, at {unit}: no display is there"
        refuse_line(name, pieces[0].line, "far-away", message, "say what a unit is with --unit, or move it to x = 0")
    near = ERROR / sketch.unit if sketch.unit else OF_WIDTH * float((high - low).max())
    return max(near, FLOAT * farthest)


def _scale(sketch: Sketch, how: HowToRead, points: Array, name: str) -> float:
    """Metres per unit of the sketch."""
    if sketch.unit:
        return sketch.unit
    assert how.width_mm is not None, "readers refuse files without a scale"
    width = abs(float(points[-1, 0] - points[0, 0]))
    if not width > 0.0:
        hint = "say --unit instead of --width-mm"
        refuse_line(name, 1, "no-width", "this curve ends below or above where it begins, and has no width", hint)
    return mm(how.width_mm) / width


def _named(pieces: Sequence[Piece], curve: str, name: str) -> Sequence[Piece]:
    """The pieces that go by a name, all of them if none was asked for."""
    if not pieces:
        refuse_line(name, 1, "no-curve", "there is no curve in this file", "draw one line from left to right")
    found = [piece for piece in pieces if not curve or curve in piece.names]
    if not found:
        known = list(dict.fromkeys(each for piece in pieces for each in piece.names))
        near = difflib.get_close_matches(curve, known[:1000], 3, 0.5) or known
        hint = f"choose {_listed(near)}" if near else "its curves have no names: leave --curve out"
        refuse_line(name, 1, "no-such-curve", f"there is no curve {_quoted(curve)} in it", hint)
    return found


def _only_line(sketch: Sketch, pieces: Sequence[Piece], near: float, name: str) -> Chain:
    """The one line that pieces make; InvalidInput for several curves, a gap, or a fork."""
    names = {piece.names[:1] for piece in pieces}
    if not sketch.is_joined and len(names) > 1:
        _refuse_several(pieces, near, name)
    found = chains(pieces, near)
    if isinstance(found, Fork):
        at = _place(sketch, found.x, found.y)
        hint = f"leave one line from left to right, without branches{_or_one_of(pieces, near)}"
        refuse_line(name, pieces[0].line, "fork", f"{found.ends} ends of its lines meet at {at}", hint)
    if not found:
        hint = "draw one line from left to right"
        refuse_line(name, pieces[0].line, "no-curve", "its lines are no longer than a dot", hint)
    if len(found) > 1 and len(names) > 1 and _overlap(found):
        _refuse_several(pieces, near, name)
    if len(found) > 1:
        _refuse_gap(sketch, found, pieces, name)
    return found[0]


def _overlap(found: Sequence[Chain]) -> bool:
    """True for lines that lie side by side or above each other, and not one after the other."""
    spans = sorted((float(chain.points[:, 0].min()), float(chain.points[:, 0].max())) for chain in found)
    return any(
        min(one[1], other[1]) - other[0] > 0.05 * min(one[1] - one[0], other[1] - other[0])
        for one, other in pairwise(spans)
    )


def _refuse_several(pieces: Sequence[Piece], near: float, name: str) -> NoReturn:
    """Raise InvalidInput with names that lead to one line each."""
    offered = _offered(pieces, near)
    hint = f"name one of them: --curve {_listed(offered)}" if offered else "leave one curve in the file"
    message = f"there are {len(offered) or 'several'} curves in it"
    refuse_line(name, pieces[0].line, "several-curves", message, hint)


def _offered(pieces: Sequence[Piece], near: float) -> list[str]:
    """Names that lead to one line each, of groups where these do."""
    groups: dict[str, list[Piece]] = {}
    for piece in pieces:
        for each in piece.names:
            groups.setdefault(each, []).append(piece)
    is_one = {each: len(some) < len(pieces) and _is_one(some, near) for each, some in groups.items()}
    found = (next((each for each in reversed(piece.names) if is_one[each]), None) for piece in pieces)
    return list(dict.fromkeys(each for each in found if each))


def _or_one_of(pieces: Sequence[Piece], near: float) -> str:
    """Advice to name a part of what is there; empty where nothing has a name."""
    offered = _offered(pieces, near)
    return f", or name one of its curves: --curve {_listed(offered)}" if offered else ""


def _is_one(pieces: Sequence[Piece], near: float) -> bool:
    if len(pieces) == 1:
        return True
    found = chains(pieces, near)
    return not isinstance(found, Fork) and len(found) == 1


def _refuse_gap(sketch: Sketch, found: Sequence[Chain], pieces: Sequence[Piece], name: str) -> NoReturn:
    """Raise InvalidInput about the narrowest gap between two of several lines."""
    ends = [(number, chain.points[end]) for number, chain in enumerate(found[:300]) for end in (0, -1)]
    gaps = [
        (math.dist(one, other), tuple(one), tuple(other))
        for at, (number, one) in enumerate(ends)
        for there, other in ends[at + 1 :]
        if there != number
    ]
    wide, one, other = min(gaps)
    breadth = f"{to_mm(wide * sketch.unit):.3g} mm" if sketch.unit else f"{wide:.3g} units"
    message = f"its line has a gap of {breadth}, from {_place(sketch, *one)} to {_place(sketch, *other)}"
    if len(found) > 2:
        message += f", and falls into {len(found)} pieces in all"
    hint = f"join the ends in the program that drew it{_or_one_of(pieces, _near(sketch, pieces, name))}"
    refuse_line(name, pieces[0].line, "gap", message, hint)


def _place(sketch: Sketch, x: float, y: float) -> str:
    """A place as the file counts it, in mm where that is known."""
    if sketch.unit:
        return f"{to_mm(x * sketch.unit):.6g}, {to_mm(y * sketch.unit):.6g} mm"
    return f"{x:.6g}, {y:.6g}"


def _edge(line: Chain, how: HowToRead, first: Piece, name: str) -> Array:
    if not how.edge:
        hint = "say which: --edge upper or --edge lower"
        refuse_line(name, first.line, "closed", "this line is a closed outline, which has two sides", hint)
    if not float(np.ptp(line.points[:, 0])) > 0.0:
        refuse_line(name, first.line, "no-width", "this outline has no width", "draw one line from left to right")
    return edge_of(line.points, how.edge)


def _quoted(text: str) -> str:
    return f"'{printable(text[:MOST_LETTERS])}'"


def _listed(names: Sequence[str]) -> str:
    """Some names, and how many more."""
    text = ", ".join(map(_quoted, names[:SHOWN]))
    return text + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")
