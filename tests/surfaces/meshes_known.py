"""Meshes that are known, as files, and how far a section is from what it is to be."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from curveline.surfaces.height_field import HeightField
from curveline.surfaces.how_to_read import HowToReadSurface
from curveline.surfaces.meshes import read

Array = npt.NDArray[np.float64]
IN_MM = HowToReadSurface(unit="mm")


def stl(triangles: Array) -> bytes:
    """Triangles (n, 3, 3) as a binary STL file."""
    body = b"".join(struct.pack("<12fH", 0.0, 0.0, 0.0, *corners.ravel(), 0) for corners in triangles)
    return b"\0" * 80 + struct.pack("<I", len(triangles)) + body


def sheet(height: Callable[[Array, Array], Array], x: Array, y: Array) -> Array:
    """Triangles of a height over a grid of places [mm]."""
    across, back = np.meshgrid(x, y)
    corners = np.stack([across, back, height(across, back)], axis=2)
    a, b, c, d = corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1]
    lower, upper = np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)
    return np.concatenate([lower.reshape(-1, 3, 3), upper.reshape(-1, 3, 3)])


def box(low: Sequence[float], high: Sequence[float]) -> Array:
    """The twelve faces of a box [mm]."""
    faces = []
    for axis in range(3):
        one, other = (each for each in range(3) if each != axis)
        for end in (low[axis], high[axis]):
            corners = np.zeros((4, 3))
            corners[:, axis] = end
            corners[:, one] = [low[one], high[one], high[one], low[one]]
            corners[:, other] = [low[other], low[other], high[other], high[other]]
            faces += [corners[[0, 1, 2]], corners[[0, 2, 3]]]
    return np.array(faces)


def field_of(triangles: Array) -> HeightField:
    """A mesh in mm as it is read from a file."""
    return read(stl(triangles), "stl", IN_MM, "known.stl")


def heights(field: HeightField, y: float, x: Array) -> Array:
    """The heights [mm] of a section at places [mm]; nan where there is nothing."""
    found = np.full(len(x), np.nan)
    for part in field.section(1e-3 * y, 1e-3 * float(x.min()), 1e-3 * float(x.max())):
        there = (x >= 1e3 * part[0, 0]) & (x <= 1e3 * part[-1, 0])
        found[there] = np.interp(x[there], 1e3 * part[:, 0], 1e3 * part[:, 1])
    return found
