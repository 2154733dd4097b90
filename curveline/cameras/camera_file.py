"""Camera files: TOML in mm, degrees and pixels to a `CameraSetup` in SI, or every problem of the file at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from os import fspath

import numpy as np

from curveline.cameras.setup import CameraSetup, SeenNode
from curveline.cameras.view import Frame, Lens, SeenRod, Tag
from curveline.scene import Display
from curveline.shapes.camera_keys import CameraTable, FrameTable, LensTable, SeenNodesTable, SeenRodTable
from curveline.shapes.files import MAX_BYTES
from curveline.shapes.toml_document import Document
from curveline.system.file_kinds import CAMERA, refuse_other_kind
from curveline.system.files import AnyPath, decode_text, read_file, refuse_file
from curveline.units import deg, mm

SIDES = {"up": 1, "down": -1, "none": 0}
EXAMPLE = "write one with `curveline camera calibrate PICTURES -o camera.toml`"
BEYOND = 1.0
"""Of the picture, by which the axis of a lens may be outside of it: no camera comes near that."""
NODE_MARGIN = mm(15.0)
"""Of a node around its bearing, where the camera file says nothing: what carries the bearing."""


def read_camera(path: AnyPath, display: Display) -> CameraSetup:
    """The camera file at a path; what it does not say of rod and nodes is as the display has it.

    InvalidInput lists every problem of the file.
    """
    name = fspath(path)
    text = decode_text(read_file(path, MAX_BYTES), name)
    refuse_other_kind(text, name, CAMERA)
    document = Document(name, text)
    if not document.data:
        refuse_file(name, "empty", "the file says nothing", EXAMPLE)
    table = document.validate(CameraTable)
    if table is None:
        raise document.error()
    lens = lens_from(table.lens)
    _check_lens(document, lens)
    _check_tags(document, table.frame)
    _check_rod(document, table.rod)
    if document.diagnostics():
        raise document.error()
    return CameraSetup(lens, frame_from(table.frame), _rod(table.rod, display), _node(table.nodes, display), name)


def lens_from(table: LensTable) -> Lens:
    """The lens that `[lens]` has."""
    width, height = table.picture_px
    across, down = table.focal_px
    x, y = table.centre_px
    k1, k2, p1, p2, k3 = table.distortion
    lengths = [None if each is None else mm(each) for each in (table.focal_length_mm, table.film_focal_length_mm)]
    return Lens((width, height), (across, down), (x, y), (k1, k2, p1, p2, k3), table.rms_px, *lengths)


def frame_from(table: FrameTable) -> Frame:
    """The tags that `[frame]` has."""
    tags = (Tag(each.number, (mm(each.at_mm[0]), mm(each.at_mm[1])), deg(each.turn_deg)) for each in table.tags)
    return Frame(tuple(tags), mm(table.tag_mm), mm(table.depth_mm))


def _rod(table: SeenRodTable, display: Display) -> SeenRod:
    rod = display.rod
    return SeenRod(
        rod.thickness if table.back_mm is None else mm(table.back_mm),
        rod.width if table.depth_mm is None else mm(table.depth_mm),
        mm(table.teeth_mm),
        mm(table.pitch_mm),
        SIDES[table.teeth],
        mm(table.fibre_mm),
    )


def _node(table: SeenNodesTable, display: Display) -> SeenNode:
    own = 0.5 * display.clamp + NODE_MARGIN
    width, height = (own if each is None else mm(each) for each in (table.half_width_mm, table.half_height_mm))
    return SeenNode(width, height)


def _check_lens(document: Document, lens: Lens) -> None:
    for which, (middle, size) in enumerate(zip(lens.centre, lens.size, strict=True)):
        if not -BEYOND * size <= middle <= (1.0 + BEYOND) * size:
            message = f"the axis of the lens is at {middle:g} pixels, of pictures with {size}"
            document.problem(("lens", "centre_px", which), "out-of-range", message, "calibrate the camera again")
    if folds(lens):
        message = "with these numbers the lens folds the picture: two places look the same"
        document.problem(("lens", "distortion"), "lens-folds", message, "calibrate the camera again")


def folds(lens: Lens) -> bool:
    """Whether a lens shows two directions at the same place of its picture."""
    width, height = lens.size
    grid = np.stack(np.meshgrid(np.linspace(0, width - 1.0, 9), np.linspace(0, height - 1.0, 9)), axis=-1)
    pixels = grid.reshape(-1, 2)
    with np.errstate(all="ignore"):
        rays = lens.rays(pixels)
        back = lens.pixels(rays)
        near = lens.pixels(rays * 0.999)
    if not np.isfinite(back).all() or np.abs(back - pixels).max() > 0.01:
        return True
    # What is nearer to the axis must be nearer to it in the picture.
    inwards = ((back - near) * (pixels - lens.centre)).sum(axis=1)
    return bool((inwards[np.hypot(*(pixels - lens.centre).T) > 1.0] <= 0.0).any())


def _check_tags(document: Document, table: FrameTable) -> None:
    for index, tag in enumerate(table.tags):
        earlier = table.tags[:index]
        if tag.number in (each.number for each in earlier):
            message = f"another tag has the number {tag.number}, too"
            document.problem(("frame", "tags", index, "number"), "duplicate-tag", message, "print one of each number")
        elif any(math.dist(tag.at_mm, each.at_mm) < table.tag_mm for each in earlier):
            message = f"tag {tag.number} would lie on another one"
            hint = "measure from the first rail to the middle of each tag"
            document.problem(("frame", "tags", index, "at_mm"), "tags-overlap", message, hint)


def _check_rod(document: Document, table: SeenRodTable) -> None:
    wanted: Sequence[str] = ("teeth_mm", "pitch_mm") if table.teeth != "none" else ()
    for key in wanted:
        if getattr(table, key) <= 0.0:
            message = f'teeth are "{table.teeth}", and {key} says that there are none'
            document.problem(("rod", key if document.has("rod", key) else "teeth"), "no-teeth", message, f"add {key}")
    if table.teeth == "none" and max(table.teeth_mm, table.pitch_mm) > 0.0:
        key = "teeth_mm" if table.teeth_mm > 0.0 else "pitch_mm"
        hint = 'add teeth = "up" or teeth = "down", where they point on a level rod'
        document.problem(("rod", key), "no-side", f"{key} is for teeth, and teeth is none", hint)
