"""A photograph with what was made of it: states as predicted, the way of the bar, the rod, what was left out."""

from __future__ import annotations

import textwrap

import numpy as np
import numpy.typing as npt

from curveline.cameras.outcomes import TrialOutcome
from curveline.tracing.following import FollowedState
from curveline.tracing.sections import front
from curveline.tracing.trace import Traced, TracedSegment

Array = npt.NDArray[np.float64]
Colour = tuple[int, int, int]
Picture = npt.NDArray[np.uint8]

PREDICTED, WAY, SEEN, LEFT_OUT = (200, 120, 0), (0, 190, 255), (0, 200, 0), (0, 0, 230)
"""Blue, amber, green, red, as OpenCV has them."""
PAPER: Colour = (255, 255, 255)
BITS = 3
LETTERS = 100
"""In a line of text."""


def overlay(picture: Picture, traced: Traced) -> Picture:
    """A colour picture (height, width, 3), blue first, of a grey one that was traced.

    Blue are the states as predicted, amber the way of a bar near the likeliest, green where the rod was seen, red where
    it should be and was not.
    """
    drawn = _in_colour(picture)
    lines = []
    for number, segment in enumerate(traced.segments, start=1):
        for each in segment.followed:
            _draw(drawn, _pixels(traced, each.predicted.points), PREDICTED)
        if segment.followed:
            _mark(drawn, traced, segment.followed[0])
        said = _said(segment)
        lines.append(f"{number}: {said}" if len(traced.segments) > 1 else said)
    _write(drawn, lines, SEEN if traced.outcome is TrialOutcome.SEEN else LEFT_OUT)
    return drawn


def plain_overlay(picture: Picture, text: str) -> Picture:
    """A colour picture as `overlay` makes them, of one in which nothing could be traced, with a `text` why."""
    drawn = _in_colour(picture)
    _write(drawn, [text], LEFT_OUT)
    return drawn


def _in_colour(picture: Picture) -> Picture:
    import cv2

    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), dtype=np.uint8)


def _unit(drawn: Picture) -> int:
    """Pixels that make a line that is seen."""
    return max(1, int(drawn.shape[1] / 1200.0 + 0.5))


def _write(drawn: Picture, lines: list[str], colour: Colour) -> None:
    """Lines of text in the upper left corner."""
    import cv2

    unit = _unit(drawn)
    for row, text in enumerate(piece for line in lines for piece in textwrap.wrap(line, LETTERS)):
        place = (12 * unit, (26 + 24 * row) * unit)
        for each, width in ((PAPER, 5 * unit), (colour, 2 * unit)):
            cv2.putText(drawn, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.6 * unit, each, width, cv2.LINE_AA)


def _said(segment: TracedSegment) -> str:
    """The verdict in a line."""
    verdict = segment.verdict
    if verdict.outcome is TrialOutcome.SEEN:
        best = segment.followed[0]
        return f"{verdict.outcome.value}: {best.state.name}, {best.cover:.0%} of the rod"
    return f"{verdict.outcome.value}: {verdict.reason}"


def _mark(drawn: Picture, traced: Traced, best: FollowedState) -> None:
    """What was made of the likeliest state."""
    import cv2

    unit = _unit(drawn)
    _draw(drawn, _pixels(traced, best.way), WAY)
    for used, place in zip(best.used, _pixels(traced, best.rod), strict=True):
        colour = SEEN if used else LEFT_OUT
        middle = tuple(int(each) for each in np.round(place * 2**BITS))
        cv2.circle(drawn, middle, 3 * unit * 2**BITS, colour, -1, cv2.LINE_AA, BITS)


def _pixels(traced: Traced, points: Array) -> Array:
    depth = np.full(len(points), front(traced.setup.rod))
    return traced.view.pixels(np.column_stack([points, depth]))


def _draw(drawn: Picture, pixels: Array, colour: Colour) -> None:
    import cv2

    corners = [np.round(pixels * 2**BITS).astype(np.int32)]
    cv2.polylines(drawn, corners, False, colour, _unit(drawn), cv2.LINE_AA, BITS)
