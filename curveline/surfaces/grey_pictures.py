"""Surfaces from pictures whose greys are heights; the lower edge of the picture is the front."""

from __future__ import annotations

from typing import Any

import numpy as np

from curveline.drawings.drawing import Array
from curveline.drawings.lengths import in_mm, size_in_mm
from curveline.drawings.pictures import picture_of, scale_of
from curveline.drawings.sketch import HowToRead
from curveline.surfaces.height_field import GridField
from curveline.surfaces.how_to_read import HowToReadSurface
from curveline.system.files import refuse_file
from curveline.units import mm, plain

COLOURED = 8
"""Of 255, by which colours of a pixel may differ that is grey."""


def read(data: bytes, how: HowToReadSurface, name: str) -> GridField:
    """The heights in a picture; InvalidInput for one that is damaged, clear in places, coloured, or without a scale."""
    if how.height_mm is None:
        hint = "say the heights of black and of white: --height-mm 0:60"
        refuse_file(name, "no-height", "greys are no heights until somebody says which", hint)
    if how.up != "z":
        refuse_file(name, "up", "a picture is seen from above", "leave --up out")
    image = picture_of(data, name)
    cell, said = scale_of(image, HowToRead(how.unit, width_mm=how.width_mm), name, "picture")
    if how.width_mm is not None:
        cell = mm(how.width_mm) / image.width
        said = f", 1 pixel = {in_mm(cell)} mm"
    low, high = how.height_mm
    shares, depth = _shares(image, name)
    # The first row of a picture is the one at the back.
    heights = np.ascontiguousarray(mm(low) + (mm(high) - mm(low)) * shares[::-1])
    size = size_in_mm(image.width * cell, image.height * cell)
    understood = (
        f"{image.format} of {image.width} x {image.height} pixels{said}, {size}, {depth} bits, "
        f"black at {plain(low)} and white at {plain(high)} mm"
    )
    return GridField(heights, cell, name, understood)


def _shares(image: Any, name: str) -> tuple[Array, int]:
    """Greys (rows, columns), 0 for black and 1 for white, and the bits of a pixel."""
    if "A" in image.getbands() or "transparency" in image.info:
        alpha = np.asarray(image.convert("RGBA").getchannel("A"))
        if alpha.min() < 255:
            hint = "save it without transparency"
            refuse_file(name, "clear", "this picture is clear in places, where it has no height", hint)
    if image.mode.startswith(("I", "F")):
        return _deep(image, name), 16
    colours = np.asarray(image.convert("RGB"), dtype=np.int16)
    if int(np.max(np.ptp(colours, axis=2))) > COLOURED:
        refuse_file(name, "coloured", "this picture has colours, which are no heights", "save it in greys")
    return np.asarray(image.convert("L"), dtype=np.float64) / 255.0, 8


def _deep(image: Any, name: str) -> Array:
    values = np.asarray(image, dtype=np.float64)
    if not (np.isfinite(values).all() and values.min() >= 0.0 and values.max() <= 65535.0):
        refuse_file(name, "greys", "its greys are not of 8 or 16 bits", "save it as a PNG of 8 or 16 bits")
    shares: Array = values / 65535.0
    return shares
