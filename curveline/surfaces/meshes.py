"""Surfaces from meshes: STL, OBJ and PLY, as they are seen from above; they need not be closed."""

from __future__ import annotations

import io
import logging
import re
import warnings
from typing import Any

import numpy as np

from curveline.drawings.drawing import LARGEST, Array
from curveline.drawings.lengths import UNITS, in_mm, metres_of
from curveline.errors import MissingExtra
from curveline.phrases import counted
from curveline.surfaces.envelope import upper_envelope
from curveline.surfaces.height_field import Extent
from curveline.surfaces.how_to_read import HowToReadSurface
from curveline.system.files import printable, refuse_file

MOST_FACES = 4_000_000
ON_EDGE = 1e-9
"""Part of a mesh's depth by which a section may be beyond it: what conversions of units leave."""
SIDES = ((0, 1), (1, 2), (2, 0))
STL_HEAD, STL_FACE = 84, 50
"""Bytes of binary STL before its faces, the last four of which say how many there are, and of each face."""
TEXT_STL = re.compile(rb"\s*solid\b[^\x00]*?\b(?:facet|endsolid)\b")


class MeshField:
    """Triangles (n, 3, 3) [m] seen from above: x, y from front to back, z up."""

    is_level_known = False

    def __init__(self, triangles: Array, name: str, understood: str) -> None:
        self.triangles, self.name, self.understood = triangles, name, understood
        self._front = triangles[:, :, 1].min(axis=1)
        self._back = triangles[:, :, 1].max(axis=1)

    @property
    def extent(self) -> Extent:
        """Of all triangles."""
        low, high = self.triangles.min(axis=(0, 1)), self.triangles.max(axis=(0, 1))
        return Extent(float(low[0]), float(high[0]), float(low[1]), float(high[1]))

    def section(self, y: float, left: float, right: float) -> list[Array]:
        """What is highest along a line, exactly."""
        extent = self.extent
        slack = ON_EDGE * extent.depth
        if extent.front - slack < y < extent.back + slack:
            y = min(max(y, extent.front), extent.back)
        met = self.triangles[(self._front <= y) & (self._back >= y)]
        met = met[(met[:, :, 0].min(axis=1) <= right) & (met[:, :, 0].max(axis=1) >= left)]
        return upper_envelope(_cut(met, y))


def _cut(triangles: Array, y: float) -> Array:
    """Pieces (k, 4), x and z of both ends, in which triangles meet a plane of constant y."""
    side = triangles[:, :, 1] - y
    crossing = (side.min(axis=1) < 0.0) & (side.max(axis=1) > 0.0)
    pieces = [_lying(triangles, side)]
    if np.any(crossing):
        pieces.append(_crossed(triangles[crossing], side[crossing]))
    return np.vstack(pieces)


def _lying(triangles: Array, side: Array) -> Array:
    """The sides of triangles that lie in the plane."""
    found = []
    for one, other in SIDES:
        lies = (side[:, one] == 0.0) & (side[:, other] == 0.0)
        found.append(np.hstack([triangles[lies][:, one][:, [0, 2]], triangles[lies][:, other][:, [0, 2]]]))
    return np.vstack(found)


def _crossed(triangles: Array, side: Array) -> Array:
    """Where triangles with corners on both sides of the plane meet it: two places each."""
    count = len(triangles)
    places, known = np.zeros((count, 6, 2)), np.zeros((count, 6), dtype=bool)
    for index, (one, other) in enumerate(SIDES):
        known[:, index] = side[:, one] * side[:, other] < 0.0
        span = np.where(known[:, index], side[:, one] - side[:, other], 1.0)
        share = (side[:, one] / span)[:, None]
        places[:, index] = (1.0 - share) * triangles[:, one][:, [0, 2]] + share * triangles[:, other][:, [0, 2]]
        known[:, 3 + index] = side[:, index] == 0.0
        places[:, 3 + index] = triangles[:, index][:, [0, 2]]
    first = np.argmax(known, axis=1)
    last = 5 - np.argmax(known[:, ::-1], axis=1)
    rows = np.arange(count)
    return np.hstack([places[rows, first], places[rows, last]])


def read(data: bytes, kind: str, how: HowToReadSurface, name: str) -> MeshField:
    """The mesh in a file of a kind, "stl", "obj" or "ply"; its unit is said by `how`, since no file says it.

    InvalidInput for a mesh that is damaged, flat, without faces or with corners that are no numbers, or without a unit;
    MissingExtra without trimesh.
    """
    corners = _triangles(data, kind, name)
    if not len(corners):
        hint = "export its faces, and as triangles, from the program that it is from"
        refuse_file(name, "no-faces", "there are no faces in this mesh", hint)
    if len(corners) > MOST_FACES:
        message = f"this mesh has {len(corners):,} faces, more than {MOST_FACES:,}"
        refuse_file(name, "too-large", message, "simplify it: a display shows no detail below a millimetre")
    bad = int(np.count_nonzero(~np.isfinite(corners).all(axis=(1, 2))))
    if bad:
        message = (
            f"{counted(bad, 'face')} of this mesh has a corner that is no number"
            if bad == 1
            else (f"{bad} faces of this mesh have corners that are no numbers")
        )
        refuse_file(name, "not-finite", message, "repair the mesh, and export it again")
    turned = _turned(corners, how.up)
    unit, said = _unit(turned, how, name)
    with np.errstate(over="ignore"):
        scaled = turned * unit
    _check_size(scaled, name)
    size = " x ".join(in_mm(float(each)) for each in np.ptp(scaled, axis=(0, 1)))
    up = "" if how.up == "z" else f", {how.up} up"
    return MeshField(scaled, name, f"{kind.upper()} of {counted(len(corners), 'face')}{up}, {said}, {size} mm in all")


def _turned(corners: Array, up: str) -> Array:
    """With z up, turned and not mirrored: y up has its front towards z, x up has it towards -z."""
    if up == "y":
        return np.stack([corners[:, :, 0], -corners[:, :, 2], corners[:, :, 1]], axis=2)
    if up == "x":
        return np.stack([-corners[:, :, 2], corners[:, :, 1], corners[:, :, 0]], axis=2)
    return corners


def _unit(corners: Array, how: HowToReadSurface, name: str) -> tuple[float, str]:
    """Metres per unit of the file, and how that is said."""
    if how.width_mm is not None:
        wide = float(np.ptp(corners[:, :, 0]))
        if not wide > 0.0:
            refuse_file(name, "no-width", "this mesh has no width", "another axis may point upwards: --up y")
        unit = how.width_mm / wide * UNITS["mm"]
        return unit, f"{in_mm(unit)} mm a unit, by its width"
    if not how.unit:
        hint = "say what a unit of it is, --unit mm, or how wide it is, --width-mm 500"
        refuse_file(name, "no-unit", "a mesh does not say what its unit is", hint)
    unit = metres_of(how.unit)
    return unit, f"1 unit = {in_mm(unit)} mm"


def _check_size(corners: Array, name: str) -> None:
    largest = float(np.max(np.abs(corners)))
    if not largest <= LARGEST:
        hint = "say another unit, or move it to the origin"
        refuse_file(name, "far-away", f"this mesh reaches {largest:.3g} m from its origin, where no display is", hint)
    across, along = float(np.ptp(corners[:, :, 0])), float(np.ptp(corners[:, :, 1]))
    if not min(across, along) > 0.0:
        hint = "another axis may point upwards: --up y"
        refuse_file(name, "no-width", "seen from above this mesh has no width or no depth", hint)


def _triangles(data: bytes, kind: str, name: str) -> Array:
    """The corners of all faces (n, 3, 3) in units of the file."""
    try:
        import trimesh
    except ImportError:
        raise MissingExtra(
            "reading meshes needs trimesh, which is not installed", hint="pip install 'curveline[draw]'"
        ) from None
    if kind == "stl":
        _check_length(data, name)
    logging.getLogger("trimesh").disabled = True  # what it says there is no word to users
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            loaded: Any = trimesh.load(io.BytesIO(data), file_type=kind, process=False, force="mesh")
            corners = np.asarray(loaded.triangles, dtype=np.float64).reshape(-1, 3, 3)
    except MemoryError:
        refuse_file(name, "too-large", "this mesh is larger than memory", "simplify it in the program it is from")
    except Exception as error:  # struct.error, IndexError and whatever else damaged bytes make of readers
        what = printable(str(error)[:60]) or type(error).__name__
        refuse_file(name, "damaged", f"this mesh is damaged: {what}", "export it again")
    return corners


def _check_length(data: bytes, name: str) -> None:
    """InvalidInput for binary STL that is shorter than it says: some readers take that for text without faces."""
    promised = STL_HEAD + STL_FACE * int.from_bytes(data[STL_HEAD - 4 : STL_HEAD], "little")
    if TEXT_STL.match(data) or len(data) >= max(promised, STL_HEAD):
        return
    refuse_file(name, "damaged", "this mesh is damaged: it is shorter than it says", "export it again")
