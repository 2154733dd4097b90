"""Lines of a DXF file, in the units that it says."""

from __future__ import annotations

import io
import logging
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from curveline.drawings.drawing import MOST_POINTS
from curveline.drawings.dxf_entities import points_of
from curveline.drawings.lengths import INCH, in_mm, metres_of
from curveline.drawings.sketch import ERROR, MOST_PIECES, HowToRead, Piece, Sketch
from curveline.phrases import counted
from curveline.system.files import printable, refuse_file
from curveline.units import mm

UNITS: Mapping[int, tuple[str, float]] = {
    1: ("inch", INCH),
    2: ("feet", 12.0 * INCH),
    4: ("mm", mm(1.0)),
    5: ("cm", mm(10.0)),
    6: ("m", 1.0),
    8: ("microinch", 1e-6 * INCH),
    9: ("mil", mm(INCH)),
    10: ("yard", 36.0 * INCH),
    13: ("micrometre", mm(mm(1.0))),
    14: ("dm", mm(100.0)),
}
"""What $INSUNITS means: the name and the size [m] of a unit."""
LINES = ("LINE", "LWPOLYLINE", "POLYLINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE")
SHOWN = 12
SOLID = ("3DFACE", "3DSOLID", "BODY", "MESH", "PLANESURFACE", "REGION", "SURFACE", "HELIX")
NOTES = ("TEXT", "MTEXT", "DIMENSION", "ARC_DIMENSION", "LEADER", "MULTILEADER", "HATCH", "POINT", "VIEWPORT", "IMAGE",
         "ATTDEF", "WIPEOUT", "TOLERANCE", "XLINE", "RAY", "SOLID", "TRACE", "OLE2FRAME")  # fmt: skip
"""What is left out, and told: it is in drawings beside the curve."""
FLAT = 1e-6
"""By what part of its size a line may leave its plane."""


def read(data: bytes, how: HowToRead, name: str) -> Sketch:
    """The lines of a DXF file that are shown; InvalidInput for one without a unit, in space, damaged, or of blocks."""
    document = _document(data, name)
    unit, said = _unit(document, how, name)
    error = ERROR / unit if unit else 0.0
    hidden = {layer.dxf.name.lower() for layer in document.layers if layer.is_off() or layer.is_frozen()}
    pieces: list[Piece] = []
    left_out: Counter[str] = Counter()
    count = 0
    for entity in document.modelspace():
        layer, handle = _told(entity, "layer", "0"), _told(entity, "handle", "")
        if layer.lower() in hidden or _told(entity, "invisible", "0") != "0":
            left_out["hidden line"] += 1
        elif entity.dxftype() in NOTES:
            left_out[entity.dxftype()] += 1
        elif not how.curve or how.curve in (handle, layer):
            pieces.append(_piece(entity, layer, error, name))
            count += len(pieces[-1].points)
        else:
            pieces.append(Piece(np.zeros((2, 2)), (handle, layer)))
        if count > MOST_POINTS or len(pieces) > MOST_PIECES:
            refuse_file(name, "too-large", "its lines have too many points", "keep only the curve, and save it again")
    left = ", ".join(counted(number, what) for what, number in sorted(left_out.items()))
    if not pieces:
        message = "there is no line in this file" + (f", only {left}" if left else "")
        refuse_file(name, "no-curve", message, "draw one line in the model space, on a layer that is shown")
    return Sketch(tuple(pieces), unit, said + (f", {left} left out" if left else ""))


def _others(entity: Any) -> str:
    """Advice to name a layer that has nothing but lines; empty if there is none."""
    kinds: dict[str, set[str]] = {}
    for each in entity.doc.modelspace():
        if each.dxftype() not in NOTES:
            kinds.setdefault(_told(each, "layer", "0"), set()).add(each.dxftype())
    layers = [f"'{printable(layer[:60])}'" for layer, found in kinds.items() if found <= set(LINES)]
    return f", or name a layer of lines: --curve {', '.join(layers[:SHOWN])}" if layers else ""


def _document(data: bytes, name: str) -> Any:
    """A DXF file as ezdxf reads it."""
    from ezdxf import recover

    if data.startswith(b"AutoCAD Binary DXF"):
        refuse_file(name, "binary", "this is a binary DXF file", "save it as DXF in text (ASCII)")
    if data[-100:].split()[-2:] != [b"0", b"EOF"]:
        hint = "it was not copied or saved to its end: save it again"
        refuse_file(name, "cut-off", "the file ends before its drawing does", hint)
    logger = logging.getLogger("ezdxf")
    was = logger.disabled
    logger.disabled = True  # what it repairs is of no use to who drew it
    try:
        return recover.read(io.BytesIO(data))[0]
    except Exception as error:  # damaged files meet errors of many kinds in ezdxf
        what = printable(str(error).partition("\n")[0][:120]) or type(error).__name__
        refuse_file(name, "damaged", f"this DXF file is damaged: {what}", "save the drawing again as DXF")
    finally:
        logger.disabled = was


def _unit(document: Any, how: HowToRead, name: str) -> tuple[float, str]:
    """Metres per unit, 0 where only a width is known, and how that was said."""
    try:
        code = int(document.header.get("$INSUNITS", 0))
    except (TypeError, ValueError):
        code = 0
    unit, size = UNITS.get(code, ("", 0.0))
    told = f"DXF in {unit}" if unit else "DXF without a unit"
    if how.width_mm is not None:
        return 0.0, told
    if how.unit:
        size = metres_of(how.unit)
        return size, f"{told}, 1 unit = {in_mm(size)} mm as asked"
    if not unit:
        message = f"it does not say its unit ($INSUNITS is {code})"
        hint = "say --unit mm or --unit in, or how wide the curve is: --width-mm 500"
        refuse_file(name, "no-unit", message, hint)
    return size, f"{told}, 1 unit = {in_mm(size)} mm"


def _told(entity: Any, key: str, otherwise: str) -> str:
    """What an entity says of itself; kinds that nobody knows have no such thing."""
    from ezdxf.lldxf.const import DXFError

    try:
        return str(entity.dxf.get(key, otherwise))
    except DXFError:
        return otherwise


def _piece(entity: Any, layer: str, error: float, name: str) -> Piece:
    """An entity as a line in the plane of the drawing; InvalidInput for what is none."""
    kind, handle = entity.dxftype(), _told(entity, "handle", "")
    what = f"{kind} {handle} on layer '{printable(layer[:40])}'"
    if kind == "INSERT":
        refuse_file(name, "block", f"{what} is a block", f"explode blocks first{_others(entity)}")
    try:
        points = None if kind in SOLID else points_of(entity, error)
    except Exception as fault:  # entities without what they need meet errors of many kinds in ezdxf
        message = f"{what} is damaged: {printable(str(fault)[:80]) or type(fault).__name__}"
        refuse_file(name, "damaged", message, "draw it anew")
    if points is None:
        hint = f"draw a curve in the xy plane{_others(entity)}"
        refuse_file(name, "no-line", f"{what} is no line that can be read", hint)
    if not np.isfinite(points).all() or np.abs(points).max(initial=0.0) > 1e12:
        refuse_file(name, "damaged", f"{what} has coordinates that are no numbers", "draw it anew")
    if len(points) < 2:
        points = np.zeros((2, 3)) if not len(points) else np.vstack([points, points])
    size = np.ptp(points, axis=0)
    if size[2] > FLAT * max(1e-9, float(size.max())):
        hint = "draw it in the xy plane: turn it by 90 degrees about x if it was drawn in a front view"
        refuse_file(name, "in-space", f"{what} is not flat: z goes from {points[:, 2].min():g} to "
                    f"{points[:, 2].max():g}", hint)  # fmt: skip
    return Piece(np.ascontiguousarray(points[:, :2]), (handle, layer))
