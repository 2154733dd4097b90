"""A grey picture that is painted with polygons whose edges are as fine as those of a real picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Greys = npt.NDArray[np.float32]

FINEST = 4
"""Into how many parts a pixel is cut, along and across."""
MOST = 16_000_000
"""Parts of pixels that are looked at together at most."""
BITS = 4
"""Of a part of a pixel that a corner's place is told to."""
LEVELS = 256.0
"""Steps of a grey level in between."""


class PaintedPicture:
    """A grey picture (height, width), levels from 0 to 255, on which what comes later hides what is there."""

    def __init__(self, size: tuple[int, int], level: float) -> None:
        """A picture of `size`, width and height, that has one level everywhere."""
        self.greys: Greys = np.full((size[1], size[0]), level, dtype=np.float32)

    def paint(self, polygons: Sequence[Array], levels: Sequence[float], cover: float = 1.0) -> None:
        """Polygons, each (n, 2) [px], as one thing: where several touch, nothing shows between them.

        It covers what is behind it by a part, 1 for a solid thing.
        """
        import cv2

        if not polygons:
            return
        box = self._box(polygons)
        if box is None:
            return
        left, top, wide, high = box
        parts = max(1, min(FINEST, int((MOST / (wide * high)) ** 0.5)))
        tone, mask = (np.zeros((high * parts, wide * parts), dtype=np.uint16) for _ in range(2))
        for polygon, level in zip(polygons, levels, strict=True):
            fine = (polygon - [left, top] + 0.5) * parts - 0.5
            corners = [np.round(fine * 2**BITS).astype(np.int32)]
            cv2.fillPoly(mask, corners, 65535, cv2.LINE_8, BITS)
            cv2.fillPoly(tone, corners, round(min(max(level, 0.0), 255.0) * LEVELS), cv2.LINE_8, BITS)
        small = [
            cv2.resize(each.astype(np.float32), (wide, high), interpolation=cv2.INTER_AREA) for each in (tone, mask)
        ]
        here = self.greys[top : top + high, left : left + wide]
        here *= 1.0 - cover * small[1] / 65535.0
        here += cover * small[0] / LEVELS

    def _box(self, polygons: Sequence[Array]) -> tuple[int, int, int, int] | None:
        """What of the picture polygons touch: left, top, width, height; None for nothing."""
        low = np.min([each.min(axis=0) for each in polygons], axis=0) - 2.0
        high = np.max([each.max(axis=0) for each in polygons], axis=0) + 3.0
        height, width = self.greys.shape
        left, top = (int(max(0.0, np.floor(each))) for each in low)
        right, bottom = int(min(width, np.ceil(high[0]))), int(min(height, np.ceil(high[1])))
        return None if right <= left or bottom <= top else (left, top, right - left, bottom - top)
