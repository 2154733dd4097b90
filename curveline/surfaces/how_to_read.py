"""What the file of a surface does not say: its unit, its heights, which way is up."""

from __future__ import annotations

import math
from dataclasses import dataclass

from curveline.drawings.lengths import metres_of
from curveline.drawings.sketch import WIDEST_MM
from curveline.errors import InvalidInput

UP = ("x", "y", "z")
"""Axes of a mesh that may point upwards."""


@dataclass(frozen=True)
class HowToReadSurface:
    """What the file of a surface does not say.

    `unit` is what a unit of a mesh is, `up` which of its axes points upwards; `width_mm` is how wide a mesh or picture
    is; `height_mm` are the heights [mm] of black and of white in it. InvalidInput for what makes no sense.
    """

    unit: str = ""
    width_mm: float | None = None
    height_mm: tuple[float, float] | None = None
    up: str = "z"

    def __post_init__(self) -> None:
        if self.unit:
            metres_of(self.unit)
        if self.up not in UP:
            raise InvalidInput(f"no mesh has its {self.up!r} up", f"choose {', '.join(UP)}")
        if self.width_mm is not None and not 0.0 < self.width_mm <= WIDEST_MM:
            raise InvalidInput(f"no surface is {self.width_mm:g} mm wide", f"choose up to {WIDEST_MM:g} mm")
        if self.width_mm is not None and self.unit:
            raise InvalidInput("a unit and a width are two scales of one surface", "say one: --unit or --width-mm")
        if self.height_mm is not None and not all(math.isfinite(each) for each in self.height_mm):
            raise InvalidInput("heights of black and white are numbers of mm", "such as --height-mm 0:60")
