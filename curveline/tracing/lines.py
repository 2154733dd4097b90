"""A curve by points, with what is needed to look across it: arc lengths, directions, and pixels beside it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from curveline.cameras.view import View

Array = npt.NDArray[np.float64]
Greys = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class SeenLine:
    """A curve of the rod's neutral fibre in the display's frame."""

    places: Array  # (n,) [m] arc length from its first point
    points: Array  # (n, 2) [m]
    normals: Array  # (n, 2) unit vectors to its left

    @property
    def directions(self) -> Array:
        """Unit vectors along it (n, 2)."""
        return np.column_stack([self.normals[:, 1], -self.normals[:, 0]])

    def beside(self, off: Array) -> Array:
        """The points (n, 2) [m] that lie `off (n,)` [m] to its left."""
        moved: Array = self.points + off[:, None] * self.normals
        return moved

    def at(self, places: Array) -> SeenLine:
        """The same curve by its points at other arc lengths."""
        points = np.column_stack([np.interp(places, self.places, self.points[:, axis]) for axis in (0, 1)])
        normals = np.column_stack([np.interp(places, self.places, self.normals[:, axis]) for axis in (0, 1)])
        return SeenLine(places, points, normals / np.hypot(*normals.T)[:, None])


def line_through(points: Array) -> SeenLine:
    """The curve through `points (n, 2)` [m], no two neighbours alike."""
    places = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    slopes = np.gradient(points, places, axis=0)
    normals = np.column_stack([-slopes[:, 1], slopes[:, 0]]) / np.hypot(*slopes.T)[:, None]
    return SeenLine(places, points, normals)


def strip_of(grey: npt.NDArray[np.uint8], view: View, line: SeenLine, across: Array, depth: float) -> Greys:
    """What a picture shows beside a line: grey levels (m, n), at `across (m,)` to its left, in the plane `depth`.

    Outside the picture they are NaN.
    """
    import cv2

    low, high = across[0], across[-1]
    depths = np.full(len(line.points), depth)
    ends = [line.beside(np.full(len(depths), each)) for each in (low, 0.0, high)]
    seen = [view.pixels(np.column_stack([each, depths])) for each in ends]
    # Across so little of a picture a lens and perspective bend no more than a parabola.
    shares = np.stack(
        [
            across * (across - high) / (low * (low - high)),
            (across - low) * (across - high) / (low * high),
            across * (across - low) / (high * (high - low)),
        ]
    )
    pixels = np.tensordot(shares.T, np.stack(seen), axes=1).astype(np.float32)
    taken = cv2.remap(grey, pixels[..., 0], pixels[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    height, width = grey.shape
    outside = (pixels[..., 0] < 0) | (pixels[..., 1] < 0) | (pixels[..., 0] > width - 1) | (pixels[..., 1] > height - 1)
    strip: Greys = taken.astype(np.float32)
    strip[outside] = np.nan
    return strip
