"""Pictures that were turned after the sensor took them, and the lens that belongs to a turned picture.

A phone that is held upright, or upside down, stores what its sensor saw and a note (EXIF) of how to turn that. The
middle of the lens is not the middle of the picture, so that a lens must be turned along.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from curveline.cameras.view import Array, Grey, Lens


class Turning(NamedTuple):
    """What turns a picture: its axes are swapped, then each is reversed or not."""

    is_swapped: bool
    reverses_x: bool
    reverses_y: bool


ORIENTATIONS = {
    1: Turning(False, False, False),
    2: Turning(False, True, False),
    3: Turning(False, True, True),
    4: Turning(False, False, True),
    5: Turning(True, False, False),
    6: Turning(True, True, False),
    7: Turning(True, True, True),
    8: Turning(True, False, True),
}
"""By the number that EXIF has for each."""


def turned(levels: Grey, orientation: int) -> Grey:
    """What the sensor saw (rows, columns), turned as it was held."""
    swap, x, y = ORIENTATIONS[orientation]
    found = levels.T if swap else levels
    return np.ascontiguousarray(found[:: -1 if y else 1, :: -1 if x else 1])


def as_taken(levels: Grey, orientation: int) -> Grey:
    """The inverse of `turned`."""
    swap, x, y = ORIENTATIONS[orientation]
    found = levels[:: -1 if y else 1, :: -1 if x else 1]
    return np.ascontiguousarray(found.T if swap else found)


def turned_lens(lens: Lens, orientation: int) -> Lens:
    """The lens of pictures that were turned, from that of those that the sensor took."""
    swap, x, y = ORIENTATIONS[orientation]
    order = (1, 0) if swap else (0, 1)
    width, height = (lens.size[each] for each in order)
    focal_x, focal_y = (lens.focal[each] for each in order)
    centre_x, centre_y = (lens.centre[each] for each in order)
    k1, k2, p1, p2, k3 = lens.distortion
    # Tangential distortion is along a direction, p2 across and p1 down, that turns with the picture.
    along_x, along_y = (p1, p2) if swap else (p2, p1)
    return replace(
        lens,
        size=(width, height),
        focal=(focal_x, focal_y),
        centre=(width - 1.0 - centre_x if x else centre_x, height - 1.0 - centre_y if y else centre_y),
        distortion=(k1, k2, -along_y if y else along_y, -along_x if x else along_x, k3),
    )


def turned_pixels(pixels: Array, size: tuple[int, int], orientation: int) -> Array:
    """Where `pixels (n, 2)` of what the sensor saw, of `size`, are in the turned picture."""
    swap, x, y = ORIENTATIONS[orientation]
    found = pixels[:, ::-1] if swap else pixels
    width, height = size[::-1] if swap else size
    return np.column_stack(
        [width - 1.0 - found[:, 0] if x else found[:, 0], height - 1.0 - found[:, 1] if y else found[:, 1]]
    )
