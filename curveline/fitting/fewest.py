"""As few nodes as bring a curve near enough to a drawing, with rails that may stand elsewhere."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

from curveline.drawings.drawing import Drawing
from curveline.drive_settings import MAX_NODES
from curveline.errors import Infeasible, InvalidInput
from curveline.fitting.fit import Fit, FitRequest, fit_drawing
from curveline.listening import SILENT, Listener
from curveline.scene import Display
from curveline.shapes.respaced import respaced
from curveline.units import to_mm


@dataclass(frozen=True)
class FewestNodes:
    """What is asked for: a distance, and at most so many nodes; InvalidInput for what makes no sense."""

    within: float  # [m], of the curve from the drawing
    most: int  # nodes, over the width of the display
    path: str = ""  # where the file of the display is going to be; empty for nowhere

    def __post_init__(self) -> None:
        if not 0.0 < self.within < math.inf:
            raise InvalidInput(f"no curve is within {to_mm(self.within):g} mm", "choose a distance above 0")
        if not 2 <= self.most <= MAX_NODES:
            raise InvalidInput(
                f"a display has 2 to {MAX_NODES} nodes, not {self.most}", "choose a number in that range"
            )


class FewestFit(NamedTuple):
    """A fit with as few nodes as are enough, and the text of the file of its display."""

    fit: Fit  # the nearest of all if none is near enough
    display_text: str  # of its display, whose rails stand elsewhere
    is_enough: bool  # True if it is as near as it should be, with a plan if that was asked for


def fit_fewest(
    drawing: Drawing,
    display: Display,
    wanted: FewestNodes,
    request: FitRequest | None = None,
    listener: Listener = SILENT,
) -> FewestFit:
    """The fit with the fewest nodes over the width of a display that comes near enough to a drawing.

    Rails stand equally far apart, and limits of length go with the span. If none is near enough, the nearest of all.
    InvalidInput for a display whose file cannot be changed; Infeasible where no stable curve was met.
    """
    nearest: FewestFit | None = None
    for nodes in range(2, wanted.most + 1):
        there = respaced(display, nodes)
        try:
            found = fit_drawing(drawing, replace(there.display, path=wanted.path), request, listener)
        except Infeasible:
            continue
        is_enough = found.off <= wanted.within and not found.refusal
        if is_enough or nearest is None or found.off < nearest.fit.off:
            nearest = FewestFit(found, there.text, is_enough)
        if is_enough:
            return nearest
    if nearest is None:
        text = f"{drawing.name}: no stable curve of 2 to {wanted.most} nodes was met near it"
        raise Infeasible(text, "it may bend too often, or need more rod than the display has: draw it simpler")
    return nearest
