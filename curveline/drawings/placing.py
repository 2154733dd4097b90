"""Where on a display a drawing goes: never scaled unless somebody says so."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from curveline.drawings.drawing import Array, Drawing
from curveline.drawings.lengths import in_mm
from curveline.errors import InvalidInput
from curveline.system.files import refuse_file
from curveline.units import mm, plain, to_mm

FIT, AS_DRAWN = "fit", "as-drawn"
TO_WIDTH = "width"
SHORT = 1e-3
"""Part of the display's width by which a drawing may be narrower; more is refused."""


@dataclass(frozen=True)
class Placing:
    """How a drawing is put on a display.

    `place` "fit" puts its left end on the first rail, at the home height; "as-drawn" takes its coordinates as they
    are. `shift_mm` moves it along the row after that. `is_flipped` turns it upside down, `scale` "width" makes it as
    wide as the display. InvalidInput for what makes no sense.
    """

    place: str = FIT
    shift_mm: float = 0.0
    is_flipped: bool = False
    scale: str = ""

    def __post_init__(self) -> None:
        if self.place not in (FIT, AS_DRAWN):
            raise InvalidInput(f"there is no place {self.place!r}", f"choose {FIT} or {AS_DRAWN}")
        if self.scale not in ("", TO_WIDTH):
            raise InvalidInput(f"a drawing is not scaled to its {self.scale!r}", f"choose {TO_WIDTH}, or none")
        if not math.isfinite(self.shift_mm):
            raise InvalidInput(f"a drawing cannot be moved by {self.shift_mm} mm", "choose a number of mm")
        if self.scale and self.place == AS_DRAWN:
            raise InvalidInput("what is scaled is not as drawn", f"leave one of them out: --place {AS_DRAWN}, --scale")


def placed(
    drawing: Drawing, placing: Placing, width: float, heights: tuple[float, float] = (-math.inf, math.inf)
) -> Drawing:
    """A drawing in the coordinates of a display so wide [m]: x from its first rail on, y from the home height.

    With "fit" a drawing whose left end at the home height would leave the `heights` [m] that nodes can have is moved
    into these as far as it goes. InvalidInput for one that does not reach from the first rail to the last.
    """
    points = drawing.points.copy()
    said = [drawing.understood] if drawing.understood else []
    if placing.is_flipped:
        points[:, 1] = points[:, 1].min() + points[:, 1].max() - points[:, 1]
        said.append("turned upside down")
    if placing.scale:
        factor = width / _width(drawing)
        points *= factor
        said.append(f"scaled by {plain(float(f'{factor:.6g}'))} to the width of the display")
    move = np.array([mm(placing.shift_mm), 0.0])
    if placing.place == FIT:
        move -= points[0]
        move[1] += into(points[:, 1] + move[1], heights)
    points += move
    if np.any(move):
        said.append(f"moved by {in_mm(float(move[0]))} mm along the row and {in_mm(float(move[1]))} mm up")
    _check(points, width, drawing, placing)
    over = float(max(points[-1, 0] - width, -points[0, 0]))
    if over > SHORT * width:
        said.append("what is beyond the outer rails is left out")
    return replace(drawing, points=points, understood=", ".join(said))


def _width(drawing: Drawing) -> float:
    wide = float(drawing.points[-1, 0] - drawing.points[0, 0])
    if not wide > 0.0:
        raise InvalidInput(
            f"{drawing.name}: it ends below or above where it begins, and has no width", "draw it from left to right"
        )
    return wide


def into(y: Array, heights: tuple[float, float]) -> float:
    """How far up a curve is moved for its heights to lie within some, or as far beyond these above as below."""
    low, high = heights[0] - float(y.min()), heights[1] - float(y.max())
    if low > high:
        return 0.5 * (low + high)
    return min(max(0.0, low), high)


def _check(points: Array, width: float, drawing: Drawing, placing: Placing) -> None:
    """InvalidInput for a curve that does not reach over the display."""
    left, right = float(points[0, 0]), float(points[-1, 0])
    slack = SHORT * width
    if left <= slack and right >= width - slack:
        return
    wide = _width(drawing)
    reach = f"it reaches from {to_mm(left):.6g} to {to_mm(right):.6g} mm, and the display from 0 to {to_mm(width):.6g}"
    shift = mm(placing.shift_mm)
    if shift and left - shift <= slack and right - shift >= width - slack:
        hint = "leave --shift-mm out, or choose less"
    elif wide >= width - slack:
        hint = f"place it with --place {FIT}" + (", and leave --shift-mm out" if shift else "")
    elif placing.place == AS_DRAWN:
        hint = f"draw it wider, or have it scaled: --place {FIT} --scale {TO_WIDTH}"
    else:
        hint = f"have it scaled with --scale {TO_WIDTH}, draw it wider, say another unit, or name a narrower display"
    refuse_file(drawing.name, "too-narrow", f"{reach} mm", hint)
