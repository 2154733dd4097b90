"""The rod as a body: a strip with or without teeth, from back to front, as polygons in a picture."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from curveline.cameras.view import SeenRod, View
from curveline.units import deg, mm

Array = npt.NDArray[np.float64]

FLANK = deg(20.0)
"""Of teeth: the pressure angle of racks."""
ADDENDUM = 1.0 / 2.25
"""Part of a tooth's height beyond its pitch line, where it is half a pitch thick."""
PLAIN = mm(3.0)
"""Length of the pieces of a rod without teeth."""
SLICE = mm(0.5)
"""Thickness of the slices that the body is painted in."""
LIGHT = np.array([-0.35, 0.94])
"""Where most of the light comes from, in the display's plane."""
LEAST_LIGHT, MORE_LIGHT = 0.72, 0.2
"""Of a skin that is turned away from the light, of what a front face has; and what one in the light has more."""


class PaintedBody(NamedTuple):
    """Polygons, each (n, 2) [px], from back to front, and the grey level of each."""

    polygons: list[Array]
    levels: list[float]


def body_of(curve: Array, seen: SeenRod, view: View, level: float) -> PaintedBody:
    """A rod along a `curve (n, 2)` [m], whose front face has a grey `level`."""
    places, pieces = _pieces(seen, float(np.sum(np.hypot(*np.diff(curve, axis=0).T))))
    points, directions = _at(curve, places.ravel())
    normals = np.column_stack([-directions[:, 1], directions[:, 0]])
    flat = (points + pieces.ravel()[:, None] * normals).reshape(*places.shape, 2)
    middle = flat.mean(axis=1)
    facing = _skins(middle, normals.reshape(*places.shape, 2)[:, 0], view)
    skins = level * (LEAST_LIGHT + MORE_LIGHT * np.maximum(facing @ LIGHT, 0.0))
    polygons: list[Array] = []
    levels: list[float] = []
    slices = max(2, int(np.ceil(seen.depth / SLICE)) + 1)
    for number, z in enumerate(np.linspace(-0.5 * seen.depth, 0.5 * seen.depth, slices)):
        solid = np.concatenate([flat, np.full((*flat.shape[:2], 1), z)], axis=2)
        polygons += list(view.pixels(solid.reshape(-1, 3)).reshape(flat.shape))
        levels += [level] * len(flat) if number == slices - 1 else skins.tolist()
    return PaintedBody(polygons, levels)


def _pieces(seen: SeenRod, length: float) -> tuple[Array, Array]:
    """Corners of the pieces of a rod: arc lengths (m, k) [m], and how far to its left (m, k) [m]."""
    near, far = -seen.fibre - 0.5 * seen.back, 0.5 * seen.back - seen.fibre
    side = seen.side if seen.side else 1
    if not (seen.teeth > 0.0 and seen.pitch > 0.0 and seen.side):
        begins = np.linspace(0.0, length, max(2, int(length / PLAIN)) + 1)
        places = np.column_stack([begins[:-1], begins[1:], begins[1:], begins[:-1]])
        return places, np.tile(side * np.array([near, near, far, far]), (len(places), 1))
    pitch, slope = seen.pitch, np.tan(FLANK)
    tip = 0.5 * pitch - 2.0 * slope * ADDENDUM * seen.teeth
    root = 0.5 * pitch + 2.0 * slope * (1.0 - ADDENDUM) * seen.teeth
    middles = np.arange(0.5 * pitch, length - 0.5 * pitch, pitch)
    along = np.array([-pitch, pitch, pitch, root, tip, -tip, -root, -pitch]) * 0.5
    across = side * np.array([near, near, far, far, far + seen.teeth, far + seen.teeth, far, far])
    return middles[:, None] + along, np.tile(across, (len(middles), 1))


def _at(curve: Array, places: Array) -> tuple[Array, Array]:
    """Points (m, 2) of a curve at some arc lengths, and unit vectors (m, 2) along it there."""
    steps = np.hypot(*np.diff(curve, axis=0).T)
    known = np.concatenate([[0.0], np.cumsum(steps)])
    inside = np.clip(places, 0.0, known[-1])
    points = np.column_stack([np.interp(inside, known, curve[:, axis]) for axis in (0, 1)])
    slopes = np.gradient(curve, known, axis=0)
    along = np.column_stack([np.interp(inside, known, slopes[:, axis]) for axis in (0, 1)])
    return points, along / np.hypot(*along.T)[:, None]


def _skins(points: Array, normals: Array, view: View) -> Array:
    """Which way the skin (m, 2) looks that the camera sees of every piece."""
    towards = view.eye[:2] - points
    skins: Array = np.sign(np.sum(towards * normals, axis=1))[:, None] * normals
    return skins
