"""Why a shape comes no nearer to a drawing: the limits at which it stands, what each costs; what the drawing asks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from curveline.fitting.descent import descended
from curveline.fitting.measured import MeasuredShape
from curveline.fitting.row import (
    LENGTH,
    MOTORS,
    ROD,
    STABILITY,
    STRAIN,
    Array,
    FittedRow,
    RowAsk,
    Wanted,
    asked,
    lengths_of,
    limits_of,
)
from curveline.scene import Range
from curveline.units import deg, mm, to_deg, to_mm, to_nmm

ACTIVE = 0.02
"""A limit that is left by less than this, as a part of it, is active."""
AT_LIMIT = 1e-6
"""A number [m or rad] that is this near to a limit stands at it."""
FREE = 1e3
"""By how much a limit is widened to see what it costs."""
LEAST_PART = 0.02
"""Of the distance, that a limit costs to be a reason for it."""
TURNED = deg(8.0)
"""By which a drawing turns the other way before that counts as another bend."""
SMOOTHED = 7
"""Points of a drawing's piece over which its direction is averaged."""
CORNER = deg(8.0)
"""By which a drawing turns from one of its points to the next, and stays so, to have a corner there."""
ROUGH_SHARE = 0.85
"""Of the points of a drawing, more than the others of which turn by so much where it is rough."""
NEAR_CORNER = mm(30.0)
"""Along the drawing, between a corner and the place that is off for it."""
BESIDE = mm(12.0)
"""Before and after a corner, over which the drawing has a direction."""
MOST_BENDS = 2
"""Inflections of a stable rod: 5,997 of 6,000 stable curves of a display had no more."""


@dataclass(frozen=True)
class ActiveLimit:
    """A limit at which a shape stands."""

    name: str  # its key in a display file, or "margin"
    value: float  # in the unit of the key
    nodes: tuple[int, ...]  # from 1, those that stand at it
    segments: tuple[int, ...]  # from 1, those that stand at it
    costs: float | None  # by how much the root mean square distance falls without it [m]; None if that is not known


def active_limits(wanted: Wanted, row: FittedRow, rms: float) -> tuple[ActiveLimit, ...]:
    """The limits at which a row stands that is measured to be so far off [m], those that cost most first."""
    found = dict.fromkeys([*_of_numbers(wanted, row), *_of_asks(wanted, row)])
    priced = [replace(each, costs=_cost(wanted, row, rms, each.name)) for each in found]
    return tuple(sorted(priced, key=lambda each: -(each.costs or 0.0)))


def _of_numbers(wanted: Wanted, row: FittedRow) -> Iterator[ActiveLimit]:
    """Limits of heights, angles and lengths."""
    count, limits = wanted.nodes, wanted.display.limits
    low, high = limits_of(wanted, row.numbers)
    kinds = (
        ("limits.height_mm", limits.height, to_mm, slice(0, count)),
        ("limits.angle_deg", limits.angle, to_deg, slice(count, 2 * count)),
        ("limits.length_mm", limits.length, to_mm, slice(2 * count, None)),
    )
    for name, limit, unit, part in kinds:
        for ends, value in ((low, limit.low), (high, limit.high)):
            places = tuple((np.flatnonzero(np.abs(row.numbers[part] - ends[part]) < AT_LIMIT) + 1).tolist())
            if places and (name != "limits.length_mm" or _is_of_display(wanted, row, places, value)):
                of_nodes = name != "limits.length_mm"
                yield ActiveLimit(name, unit(value), places if of_nodes else (), () if of_nodes else places, None)


def _is_of_display(wanted: Wanted, row: FittedRow, places: tuple[int, ...], value: float) -> bool:
    """True if a length stands at what the display allows, not at the least that is no straight rod."""
    lengths = lengths_of(wanted, row.numbers)
    return any(abs(float(lengths[place - 1]) - value) < AT_LIMIT for place in places)


def _of_asks(wanted: Wanted, row: FittedRow) -> Iterator[ActiveLimit]:
    """Limits of stability, strain, motors and rod."""
    display = wanted.display
    values = {
        STABILITY: ("margin", wanted.reserve.margin),
        STRAIN: ("rod.max_strain", display.rod.max_strain),
        MOTORS[0]: ("drive.max_force_N", display.drive.max_force),
        MOTORS[1]: ("drive.max_force_N", display.drive.max_force),
        MOTORS[2]: ("drive.max_moment_Nmm", to_nmm(display.drive.max_moment)),
        LENGTH: ("limits.length_mm", to_mm(display.limits.length.high)),
        ROD: ("rod.total_length_mm", to_mm(display.rod.total_length)),
    }
    found: dict[str, list[RowAsk]] = {}
    for ask, missed in zip(asked(wanted), row.asks.tolist(), strict=True):
        if missed > -ACTIVE * (wanted.reserve.margin if ask.kind == STABILITY else 1.0):
            found.setdefault(values[ask.kind][0], []).append(ask)
    for name, asks in found.items():
        value = values[asks[0].kind][1]
        nodes = tuple(sorted({ask.node for ask in asks if ask.node}))
        segments = tuple(sorted({ask.segment for ask in asks if ask.segment}))
        yield ActiveLimit(name, value, nodes, segments, None)


def _cost(wanted: Wanted, row: FittedRow, rms: float, name: str) -> float | None:
    """By how much the distance falls without a limit [m]; None if no such row is met from where this one stands."""
    there = descended(_without(wanted, name), row.numbers, row.held)
    # The row's own distance is one of few points, and may be larger than what was measured: its part of that counts.
    return None if there is None else rms * max(1.0 - there.rms / row.rms, 0.0)


def _without(wanted: Wanted, name: str) -> Wanted:
    """The same drawing for a display without a limit."""
    display = wanted.display
    limits, rod, drive = display.limits, display.rod, display.drive
    if name == "margin":
        return wanted._replace(reserve=wanted.reserve._replace(margin=0.0))
    if name == "limits.height_mm":
        display = replace(display, limits=replace(limits, height=Range(limits.height.low - FREE, FREE)))
    elif name == "limits.angle_deg":
        display = replace(display, limits=replace(limits, angle=Range(-math.pi, math.pi)))
    elif name == "limits.length_mm":
        display = replace(display, limits=replace(limits, length=Range(0.0, FREE)))
    elif name == "rod.max_strain":
        display = replace(display, rod=replace(rod, max_strain=FREE))
    elif name == "rod.total_length_mm":
        display = replace(display, rod=replace(rod, total_length=FREE))
    elif name == "drive.max_force_N":
        display = replace(display, drive=replace(drive, max_force=FREE))
    else:
        display = replace(display, drive=replace(drive, max_moment=FREE))
    return wanted._replace(display=display)


@dataclass(frozen=True)
class Miss:
    """A place of the drawing, in the display's frame, that is far from the rod."""

    x: float  # [m]
    y: float  # [m]
    off: float  # how far from the rod [m]
    why: str  # the reason, in words


def misses_of(wanted: Wanted, limits: tuple[ActiveLimit, ...], best: MeasuredShape) -> tuple[Miss, ...]:
    """Where each segment's rod is farthest from the drawing, the farthest first."""
    found = []
    for segment, (fine, gaps) in enumerate(zip(wanted.fine, best.gaps, strict=True)):
        farthest = int(np.argmax(gaps.back))
        x, y = fine[farthest].tolist()
        why = why_off(wanted, limits, best.rms, (segment, farthest))
        found.append(Miss(x + segment * wanted.display.span, y, float(gaps.back[farthest]), why))
    return tuple(sorted(found, key=lambda miss: -miss.off))


def why_off(wanted: Wanted, limits: tuple[ActiveLimit, ...], rms: float, place: tuple[int, int]) -> str:
    """Why the rod is off at a place: a segment, from 0, and the number of a point of its fine piece of the drawing."""
    segment, point = place
    piece, number = wanted.pieces[segment], segment + 1
    if _is_rough(wanted.fine[segment]):
        return "the drawing is rough: its points lie to either side"
    bends = bends_of(piece)
    if bends > MOST_BENDS:
        return (
            f"segment {number} of the drawing changes the side it bends to {bends} times; a stable rod does at most "
            f"{MOST_BENDS} times"
        )
    corner = _corner_near(wanted.fine[segment], point)
    if corner:
        return f"a corner of {to_deg(corner):.0f} deg: the rod stays smooth"
    for limit in limits:
        here = (
            number in limit.segments
            or bool({number, number + 1} & set(limit.nodes))
            or not (limit.segments or limit.nodes)
        )
        if here and (limit.costs or 0.0) > LEAST_PART * rms:
            if limit.name == "margin":
                return "stability: nearer states would not keep the margin"
            return f"held back by {limit.name}"
    return "a segment has five numbers, and none of them leads nearer"


def bends_of(piece: Array) -> int:
    """How often a piece of a drawing changes the side to which it bends, small wiggles left out."""
    angles = _angles(piece)
    kernel = np.ones(SMOOTHED) / SMOOTHED
    angles = np.convolve(np.pad(angles, SMOOTHED // 2, mode="edge"), kernel, mode="valid")
    changes, side, extreme = 0, 0.0, float(angles[0])
    for angle in angles.tolist():
        if side == 0.0:
            if abs(angle - extreme) > TURNED:
                side, extreme = math.copysign(1.0, angle - extreme), angle
        elif side * (angle - extreme) > 0.0:
            extreme = angle
        elif side * (extreme - angle) > TURNED:
            changes, side, extreme = changes + 1, -side, angle
    return changes


def _is_rough(drawn: Array) -> bool:
    """True if a drawing turns back and forth all along, as noise does."""
    return float(np.quantile(np.abs(np.diff(_angles(drawn))), ROUGH_SHARE)) > CORNER


def _angles(drawn: Array) -> Array:
    """Where the pieces of a polyline point [rad]."""
    way = np.diff(drawn, axis=0)
    return np.asarray(np.unwrap(np.arctan2(way[:, 1], way[:, 0])))


def _corner_near(drawn: Array, place: int) -> float:
    """By how much a drawing turns at a corner near one of its points [rad]; 0 without one.

    It turns there from one point to the next, as no smooth one does, and goes on another way, as noise does not.
    """
    angles, lengths = _angles(drawn), np.hypot(*np.diff(drawn, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    # A corner between two of the points is seen over two steps.
    turns = np.abs(angles[2:] - angles[:-2])
    near = np.abs(along[1:-2] - along[place]) < NEAR_CORNER
    if not np.any(near):
        return 0.0
    corner = int(np.argmax(np.where(near, turns, 0.0)))
    before = (along[:-1] > along[corner + 1] - BESIDE) & (along[:-1] < along[corner])
    after = (along[:-1] > along[corner + 2]) & (along[:-1] < along[corner + 2] + BESIDE)
    if turns[corner] < CORNER or not (np.any(before) and np.any(after)):
        return 0.0
    ways = [float(np.average(angles[side], weights=lengths[side])) for side in (before, after)]
    turned = abs(ways[1] - ways[0])
    return turned if turned > CORNER else 0.0
