"""Where on the lines of a display a surface goes, and its section at each of them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from curveline.drawings.drawing import Array, Drawing
from curveline.drawings.lengths import in_mm
from curveline.drawings.placing import TO_WIDTH, into
from curveline.errors import InvalidInput
from curveline.fitting.targets import width_of
from curveline.scene import Display
from curveline.surfaces.height_field import Extent, HeightField
from curveline.system.files import refuse_file
from curveline.units import mm, plain, to_mm

SHORT = 1e-3
"""Part of the width or the depth of the lines by which a surface may be smaller."""
BRIDGED = mm(0.01)
"""The widest gap between faces that is none."""
MOST_LINES = 64


@dataclass(frozen=True)
class Laying:
    """How a surface is laid over `lines`, so many, `pitch` [m] apart.

    Its left edge goes on the first rail, moved along the row by `shift_mm`; from front to back it is in the middle of
    the lines, or its front edge is `depth_from_mm` in front of the first one. `scale` "width" makes it as wide as the
    display, as deep and as high in proportion. InvalidInput for what makes no sense.
    """

    lines: int = 8
    pitch: float = mm(75.0)
    scale: str = ""
    shift_mm: float = 0.0
    depth_from_mm: float | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.lines <= MOST_LINES:
            raise InvalidInput(f"a surface has 1 to {MOST_LINES} lines, not {self.lines}", "choose --lines 8")
        if not mm(1.0) <= self.pitch <= 10.0:
            message = f"no lines are {to_mm(self.pitch):g} mm apart"
            raise InvalidInput(message, "choose a pitch of 1 mm to 10 m, such as --pitch-mm 75")
        if self.scale not in ("", TO_WIDTH):
            raise InvalidInput(f"a surface is not scaled to its {self.scale!r}", f"choose {TO_WIDTH}, or none")
        if not math.isfinite(self.shift_mm + (self.depth_from_mm or 0.0)):
            raise InvalidInput("a surface is moved by numbers of mm", "such as --shift-mm 20 or --depth-from-mm 30")

    @property
    def depth(self) -> float:
        """From the first line to the last [m]."""
        return (self.lines - 1) * self.pitch


@dataclass(frozen=True, eq=False)
class LaidSurface:
    """A surface over the lines of a display: what each line is to show, and what was understood of it all."""

    name: str
    understood: str
    sections: tuple[Drawing, ...]  # front to back
    depths: tuple[float, ...]  # y of each in the surface's own coordinates [m]


@dataclass(frozen=True)
class _Frame:
    """How the coordinates of a surface become those of a display: scaled by `factor`, then moved [m]."""

    factor: float
    right: float
    first: float  # y of the first line, after scaling

    def own_x(self, x: float) -> float:
        """Where an x of the display is on the surface."""
        return (x - self.right) / self.factor


def laid(field: HeightField, display: Display, laying: Laying) -> LaidSurface:
    """A surface laid over the lines of a display.

    A surface of which only differences of heights are known goes up or down until its lowest place under the lines is
    at the home height, or as near to that as the limits of nodes allow. InvalidInput for one that is too small, or that
    has a hole under a line.
    """
    frame, said = _frame(field, display, laying)
    width = width_of(display)
    depths = tuple((frame.first + number * laying.pitch) / frame.factor for number in range(laying.lines))
    curves = []
    for number, y in enumerate(depths, start=1):
        parts = field.section(y, frame.own_x(0.0), frame.own_x(width))
        points = _whole([part * frame.factor for part in parts], (number, y, field), (frame.right, width))
        curves.append(points)
    lift = 0.0
    if not field.is_level_known:
        lift, words = _lift(curves, display)
        said.append(words)
    where = [field.understood, *said]
    raised = [curve + np.array([0.0, lift]) for curve in curves]
    sections = tuple(
        Drawing(curve, f"{field.name}, line {number}", f"section at y = {in_mm(y)} mm")
        for number, (curve, y) in enumerate(zip(raised, depths, strict=True), start=1)
    )
    return LaidSurface(field.name, ", ".join(each for each in where if each), sections, depths)


def _frame(field: HeightField, display: Display, laying: Laying) -> tuple[_Frame, list[str]]:
    """Where the surface goes, and how that is said; InvalidInput where it does not reach over all lines."""
    width, extent, shift = width_of(display), field.extent, mm(laying.shift_mm)
    if extent is None:
        if laying.scale:
            raise InvalidInput("a formula has no width to be scaled from", "leave --scale out, or change the formula")
        return _Frame(1.0, shift, mm(laying.depth_from_mm or 0.0)), []
    said = []
    factor = 1.0
    if laying.scale:
        factor = width / extent.width
        said.append(f"scaled by {plain(float(f'{factor:.6g}'))} to the width of the display")
    front = factor * extent.front
    spare = factor * extent.depth - laying.depth
    before = 0.5 * spare if laying.depth_from_mm is None else mm(laying.depth_from_mm)
    _check(field.name, extent, factor, (width - shift, laying, before))
    middle = ", in the middle" if laying.depth_from_mm is None else ""
    said.append(
        f"its left edge at x = {in_mm(shift)} mm, the first line {in_mm(before)} mm behind its front edge{middle}"
    )
    return _Frame(factor, shift - factor * extent.left, front + before), said


def _check(name: str, extent: Extent, factor: float, asked: tuple[float, Laying, float]) -> None:
    """InvalidInput for a surface that does not reach over the display, or over all of its lines."""
    needed, laying, before = asked
    wide, deep = factor * extent.width, factor * extent.depth
    if wide < needed - SHORT * needed or laying.shift_mm > to_mm(SHORT * needed):
        message = f"the surface is {to_mm(wide):.6g} mm wide, and has to reach {to_mm(needed):.6g} mm"
        hint = f"have it scaled with --scale {TO_WIDTH}, say another unit, or name a narrower display"
        refuse_file(name, "too-narrow", message, hint)
    slack = SHORT * max(laying.depth, mm(1.0))
    if before < -slack or before + laying.depth > deep + slack:
        message = (
            f"the surface is {to_mm(deep):.6g} mm deep, and {laying.lines} lines {to_mm(laying.pitch):.6g} mm apart "
            f"take {to_mm(laying.depth):.6g} mm"
        )
        if laying.depth_from_mm is not None:
            message += f" from {laying.depth_from_mm:g} mm on"
        hint = "take fewer --lines or a smaller --pitch-mm, or a larger surface"
        refuse_file(name, "too-shallow", message, hint)


def _whole(parts: list[Array], at: tuple[int, float, HeightField], over: tuple[float, float]) -> Array:
    """One line from the first rail to the last of the parts of a section; InvalidInput where the surface has a hole."""
    right, width = over
    slack = SHORT * width
    moved = [part + np.array([right, 0.0]) for part in parts]
    inside = [part for part in moved if part[-1, 0] > 0.0 and part[0, 0] < width]
    reached = 0.0
    for begin, end in [*((float(part[0, 0]), float(part[-1, 0])) for part in inside), (width, width)]:
        is_outer = reached == 0.0 or begin == width
        if begin - reached > (slack if is_outer else BRIDGED):
            number, y, field = at
            message = f"under line {number}, at y = {in_mm(y)} mm, nothing is there from x = "
            message += f"{to_mm(reached):.4g} to {to_mm(begin):.4g} mm of the display"
            hint = "close the hole, or choose other places for the lines: --depth-from-mm, --pitch-mm, --shift-mm"
            refuse_file(field.name, "hole", message, hint)
        reached = max(reached, end)
    return np.vstack(list(_within(np.vstack(inside), width)))


def _within(points: Array, width: float) -> Iterator[Array]:
    """The part of a section over a display, its ends where the outer rails are."""
    x = points[:, 0]
    for end in (0.0, width):
        if end == width:
            yield points[(x > 0.0) & (x < width)]
        if x[0] <= end <= x[-1]:
            yield np.array([[end, float(np.interp(end, x, points[:, 1]))]])


def _lift(curves: list[Array], display: Display) -> tuple[float, str]:
    """How far up a surface is moved [m], and how that is said."""
    heights = np.concatenate([curve[:, 1] for curve in curves])
    lift = -float(heights.min())
    limits = display.limits.height
    lift += into(heights + lift, (limits.low, limits.high))
    return lift, f"its lowest place under the lines at a height of {in_mm(float(heights.min()) + lift)} mm"
