"""What can be fitted to: files, points, drawings; and where on a display they go."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from curveline.drawings.drawing import Drawing
from curveline.drawings.placing import Placing, placed
from curveline.drawings.reading import read_drawing
from curveline.fitting.fit import Fit, FitRequest, fit_drawing
from curveline.listening import SILENT, Listener
from curveline.scene import Display
from curveline.shapes.files import given_display
from curveline.system.arguments import expect
from curveline.system.files import AnyPath

if TYPE_CHECKING:
    import numpy.typing as npt


def width_of(display: Display) -> float:
    """From the first rail of a display to the last [m]."""
    return display.span * (display.node_count - 1)


def placed_on(display: Display, drawing: Drawing, placing: Placing | None = None) -> Drawing:
    """A drawing in the coordinates of a display: x from the first rail on, y from the home height.

    By default its left end goes on the first rail, and it is moved up or down to where the nodes can stand.
    InvalidInput for one that does not reach from the first rail to the last.
    """
    limits = display.limits.height
    return placed(drawing, placing or Placing(), width_of(display), (limits.low, limits.high))


def fit(
    target: AnyPath | Drawing | npt.ArrayLike,
    display: AnyPath | Display = "single",
    request: FitRequest | None = None,
    listener: Listener = SILENT,
) -> Fit:
    """The shape of a display whose stable curve is nearest to a drawn one, and its plan.

    `target` is a file, placed as `placed_on` does; or points (k, 2) [m] or a `Drawing`, taken as they are, x from the
    first rail on and y from the home height. `request` says how to fit. Of what comes back `scene` is the shape, `rms`
    and `max` [m] are its distances from the drawing, `worst` says where and why; where `plan` is None, `refusal` says
    why. Raises InvalidInput for a target that cannot be read, or shown by any display; Infeasible where no stable curve
    was met; MissingExtra for files of a kind whose library is not installed.
    """
    given = given_display(display) if isinstance(display, str | os.PathLike) else display
    expect(given, Display, "a display, by name, path or Display,")
    if isinstance(target, str | os.PathLike):
        return fit_drawing(placed_on(given, read_drawing(target)), given, request, listener)
    drawing = target if isinstance(target, Drawing) else Drawing(target)  # type: ignore[arg-type]
    return fit_drawing(drawing, given, request, listener)
