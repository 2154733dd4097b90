"""Where tags stand around a display by default: in two rows, beyond the highest and the lowest place of the rod."""

from __future__ import annotations

import math

from curveline.cameras.view import Frame, Tag
from curveline.scene import Display
from curveline.units import mm, to_mm

TAG_SIZE = mm(70.0)
DEPTH = mm(-12.0)
"""[m] A guess at how far behind the rod's middle the frame is."""
GAP = mm(10.0)
"""[m] between a tag's white margin and the rod."""
MOST_COLUMNS = 24


def frame_for(display: Display, size: float = TAG_SIZE) -> Frame:
    """Tags above and below the rails of a display, and between them if there are only two; at places in whole mm.

    A rod of the longest segment that the limits allow cannot be before any of them.
    """
    widest = max(display.limits.length.high, display.span)
    bulge = 0.5 * math.sqrt(widest**2 - display.span**2)
    beyond = bulge + GAP + 0.5 * size + size / 8.0
    step = math.ceil(display.node_count / MOST_COLUMNS)
    rails = [index * display.span for index in range(0, display.node_count, step)]
    columns = rails if len(rails) > 2 else [rails[0], 0.5 * (rails[0] + rails[-1]), rails[-1]]
    rows = display.limits.height.high + beyond, display.limits.height.low - beyond
    places = [(_whole(x), _whole(y)) for y in rows for x in columns]
    return Frame(tuple(Tag(number, place) for number, place in enumerate(places)), size, DEPTH)


def _whole(length: float) -> float:
    """A length rounded to a mm, which a ruler shows."""
    return mm(round(to_mm(length)))
