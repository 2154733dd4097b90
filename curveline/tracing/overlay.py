"""A photograph with what was made of it: states as predicted, the way of the bar, the rod, what was left out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from curveline.cameras.outcomes import TrialOutcome
from curveline.tracing.following import Followed
from curveline.tracing.sections import front
from curveline.tracing.trace import Traced, TracedSegment

Array = npt.NDArray[np.float64]
Colour = tuple[int, int, int]
Picture = npt.NDArray[np.uint8]

PREDICTED, WAY, SEEN, LEFT_OUT = (200, 120, 0), (0, 190, 255), (0, 200, 0), (0, 0, 230)
"""Blue, amber, green, red, as OpenCV has them."""
PAPER: Colour = (255, 255, 255)
BITS = 3


def overlay(picture: Picture, traced: Traced) -> Picture:
    """A colour picture (height, width, 3), blue first, of a grey one that was traced.

    Blue are the states as predicted, amber the way of a bar near the likeliest, green where the rod was seen, red where
    it should be and was not.
    """
    import cv2

    drawn = np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    unit = max(1, round(picture.shape[1] / 1200))
    lines = []
    for number, segment in enumerate(traced.segments, start=1):
        for each in segment.followed:
            _draw(drawn, _pixels(traced, each.predicted.points), PREDICTED, unit)
        if segment.followed:
            _mark(drawn, traced, segment.followed[0], unit)
        lines.append(f"{number}: {_said(segment)}" if len(traced.segments) > 1 else _said(segment))
    _write(drawn, lines, is_good=traced.outcome is TrialOutcome.SEEN)
    return drawn


def _write(drawn: Picture, lines: Sequence[str], *, is_good: bool) -> None:
    """Lines of text into the upper left corner."""
    import cv2

    unit = max(1, round(drawn.shape[1] / 1200))
    for row, line in enumerate(lines):
        place = (12 * unit, (26 + 24 * row) * unit)
        for colour, width in ((PAPER, 5 * unit), (SEEN if is_good else LEFT_OUT, 2 * unit)):
            cv2.putText(drawn, line[:110], place, cv2.FONT_HERSHEY_SIMPLEX, 0.62 * unit, colour, width, cv2.LINE_AA)


def plain_overlay(picture: Picture, said: str) -> Picture:
    """A colour picture of a grey one of which nothing was made, with what is said of it."""
    import cv2

    drawn = np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    _write(drawn, [said], is_good=False)
    return drawn


def _said(segment: TracedSegment) -> str:
    """The verdict in a line."""
    verdict = segment.verdict
    if verdict.outcome is TrialOutcome.SEEN:
        best = segment.followed[0]
        return f"{verdict.outcome.value}: {best.state.name}, {best.cover:.0%} of the rod"
    return f"{verdict.outcome.value}: {verdict.reason}"


def _mark(drawn: Picture, traced: Traced, best: Followed, unit: int) -> None:
    """What was made of the likeliest state."""
    import cv2

    _draw(drawn, _pixels(traced, best.way), WAY, unit)
    at = best.line.at(best.windows.places)
    for used, place in zip(best.used, _pixels(traced, at.beside(best.smooth.off)), strict=True):
        colour = SEEN if used else LEFT_OUT
        middle = tuple(int(each) for each in np.round(place * 2**BITS))
        cv2.circle(drawn, middle, 3 * unit * 2**BITS, colour, -1, cv2.LINE_AA, BITS)


def _pixels(traced: Traced, points: Array) -> Array:
    depth = np.full(len(points), front(traced.setup.rod))
    return traced.view.pixels(np.column_stack([points, depth]))


def _draw(drawn: Picture, pixels: Array, colour: Colour, unit: int) -> None:
    import cv2

    corners = [np.round(pixels * 2**BITS).astype(np.int32)]
    cv2.polylines(drawn, corners, False, colour, unit, cv2.LINE_AA, BITS)
