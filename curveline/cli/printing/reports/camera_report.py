"""What is printed for a camera, what its lens is, and where it stands, as text."""

from __future__ import annotations

import math
from collections.abc import Iterator

from curveline.cameras.boards import CameraBoard
from curveline.cameras.lens_calibration import DISTANCE, LensCalibration
from curveline.cameras.pose import FoundView, ViewFailure, scale, slant
from curveline.cameras.tag_fit import off
from curveline.cameras.view import Frame
from curveline.cli.printing import screen
from curveline.cli.printing.tables import fitting
from curveline.phrases import counted, wrapped
from curveline.units import millimetres, to_deg, to_mm

BOARD_HEAD = ("tag", "x mm", "y mm")
PICTURE_HEAD = ("picture", "corners", "tilt deg", "off px", "")
TAG_HEAD = ("tag", "off mm", "")


def board_lines(board: CameraBoard) -> Iterator[str]:
    """Lines of text: what the pages are, and where the tags may be glued."""
    yield from wrapped(
        f"{counted(len(board.pages), 'page')}, to be printed in actual size: the board for the lens, whose squares are "
        f"{to_mm(board.square):g} mm, and {len(board.frame.tags)} tags of {to_mm(board.frame.size):g} mm"
    )
    yield from wrapped(
        "glue the tags around the display, in one plane, and measure their middles; out of the rod's way:"
    )
    rows = [(str(tag.number), *(f"{to_mm(each):.4g}" for each in tag.centre)) for tag in board.frame.tags]
    yield from screen.headed(fitting([BOARD_HEAD, *rows], frozenset()), BOARD_HEAD, rows)


def calibration_lines(found: LensCalibration) -> Iterator[str]:
    """Lines of text: the lens and how exact it is, every picture, and what is missing."""
    rows = [
        (
            each.source,
            str(len(each.numbers)),
            f"{to_deg(each.tilt):.0f}" if each.rms > 0.0 else "",
            f"{each.rms:.2f}" if each.rms > 0.0 else "",
            "" if not each.reason else each.outcome.value,
        )
        for each in found.pictures
    ]
    yield from screen.headed(fitting([PICTURE_HEAD, *rows], frozenset({0, 4})), PICTURE_HEAD, rows)
    for each in found.pictures:
        if each.reason:
            yield from wrapped(f"{each.source} is not used: {each.reason}")
    used = f"{len(found.used)} of {counted(len(found.pictures), 'picture')} used"
    yield from wrapped(f"{used}, the board was seen in {100.0 * found.covered:.0f} % of the picture")
    if found.lens is not None:
        lens = found.lens
        yield from wrapped(
            f"lens of {lens.size[0]} x {lens.size[1]} pixels: focal length {lens.focal[0]:.1f} and {lens.focal[1]:.1f} "
            f"px, off by {lens.rms:.2g} px on average"
        )
    if math.isfinite(found.error):
        where = f"on a display {to_mm(DISTANCE):.0f} mm away"
        yield from wrapped(f"positions {where} will be off by {millimetres(found.error)} (standard error)")
    if found.lens is None:
        yield "the pictures do not tell the lens"
    for wanted in found.missing:
        yield from wrapped(f"photograph besides: {wanted}")


def pose_lines(found: FoundView | ViewFailure, frame: Frame) -> Iterator[str]:
    """Lines of text: where the camera stood and how exact that is, and every tag; or why it cannot be told."""
    if isinstance(found, ViewFailure):
        yield from wrapped(f"{found.outcome}: {found.reason}")
        return
    x, y, z = (to_mm(float(each)) for each in found.view.eye)
    yield from wrapped(
        f"the camera stood at x = {x:.0f}, y = {y:.0f} mm, {z:.0f} mm before the rod, {to_deg(slant(found.view)):.1f} "
        "degrees from square to the display"
    )
    yield from wrapped(
        f"a pixel is {to_mm(scale(found.view, frame)):.2g} mm, an edge {millimetres(found.blur)} wide; positions are "
        f"off by {millimetres(found.error)} (standard error)"
    )
    for note in found.notes:
        yield from wrapped(note)
    tags = sorted((*found.tags, *found.left_out), key=lambda each: each.tag.number)
    rows = [
        (
            str(each.tag.number),
            f"{to_mm(off(found.view, each, frame)):.2f}",
            "" if each in found.tags else "left out",
        )
        for each in tags
    ]
    yield from screen.headed(fitting([TAG_HEAD, *rows], frozenset({2})), TAG_HEAD, rows)
    unseen = sorted({tag.number for tag in frame.tags} - {each.tag.number for each in tags})
    if unseen:
        yield from wrapped(f"not seen: {', '.join(map(str, unseen))}")
