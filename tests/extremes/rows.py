"""The table of extreme planar scenes: each row a rod, and what must come out of the search for its stable states."""

from __future__ import annotations

import math
from typing import NamedTuple

from clamped_rods import rod_between
from curveline.rod.clamped_rod import ClampedRod

FOLD_LOAD = 166.442444794162
"""Centre load at which an arch of EI = 1, length 0.6 over a span of 0.5 loses its stability: see the references, S1."""
ONE_END = math.radians(41.81572612)
BOTH_ENDS = math.radians(57.73902789)
"""Clamp angles at which a rod of 1.2 (one end turned) and of 1.32 spans (both, symmetrically) snaps: references, C."""
SAME_WAY = 0.0200003
"""Both ends turned the same way: angle at which peak and valley merge, at an excess of 1e-4 of the length."""


class Row(NamedTuple):
    """A scene and what must come out.

    `expect`: "pair" (a peak and a valley), "one" (a single state that a display can show), "some" (at least one stable
    state, shown or not), "none" (no state, and `change` is part of the sentence that says what to change), or "coarse"
    (states short of the tolerance, and the sentence says so).
    """

    name: str
    rod: ClampedRod
    expect: str
    tolerance: float = 1e-5
    change: str = ""
    windings: tuple[int, ...] = (0,)


def clamped(
    start_deg: float, end_deg: float, length: float, chord: tuple[float, float] = (1.0, 0.0), weight: float = 0.0
) -> ClampedRod:
    """A rod with EI = 1 over a span of 1 unless said."""
    return rod_between(chord, math.radians(start_deg), math.radians(end_deg), length, 0.0, 1.0, weight)


def loaded(length: float, *loads: tuple[float, float, float], start_deg: float = 0.0) -> ClampedRod:
    """A rod with EI = 1 over a span of 0.5, with point loads."""
    return rod_between((0.5, 0.0), math.radians(start_deg), 0.0, length, 0.0, 1.0, 0.0, loads=loads)


def sized(span: float, stiffness: float, weight: float, tilt: float = 0.3) -> ClampedRod:
    """The built-in display's arch at another size."""
    return rod_between((span, 0.0), tilt, -tilt, 1.3 * span, 0.04 * span, stiffness, weight)


def strip(thickness_mm: float, gravities: float = 1.0, tilt: float = 0.3) -> ClampedRod:
    """A rod of the built-in display's material, 10 mm wide and as thick as said, and as heavy as the built-in one."""
    stiffness = 2.45e9 * 0.01 * (thickness_mm * 1e-3) ** 3 / 12.0
    return rod_between((0.5, 0.0), tilt, -tilt, 0.66, 0.02, stiffness, 0.4707192 * gravities)


EXCESS = [
    Row("level, 1e-7 more than the span", clamped(0, 0, 1 + 1e-7), "pair", 1e-9),
    Row("level, 1e-6", clamped(0, 0, 1 + 1e-6), "pair", 1e-9),
    Row("level, 1e-4", clamped(0, 0, 1 + 1e-4), "pair", 1e-9),
    Row("5 deg, 1e-7: taut", clamped(5, -5, 1 + 1e-7), "one", 1e-9),
    Row("0.01 deg, 1e-7: both arches left", clamped(0.01, -0.01, 1 + 1e-7), "pair", 1e-9),
    Row("30 deg, 1e-7", clamped(30, -30, 1 + 1e-7), "one"),
    Row("60 deg the same way, 1e-7", clamped(60, 60, 1 + 1e-7), "one"),
    Row("150 deg, 1e-7", clamped(150, -150, 1 + 1e-7), "some"),
    Row("30 deg, 1e-5", clamped(30, -30, 1 + 1e-5), "one", 1e-9),
    Row("60 and -20 deg, 1e-4", clamped(60, -20, 1 + 1e-4), "one", 1e-9),
    Row("150 deg, 1e-5", clamped(150, -150, 1 + 1e-5), "some"),
    Row("60 deg, 1e-3", clamped(60, -60, 1.001), "one", 1e-9),
    Row("60 deg, 1e-2", clamped(60, -60, 1.01), "one", 1e-9),
    Row("5 deg, 3e-3: both arches", clamped(5, -5, 1.003), "pair", 1e-9),
    Row("two spans", clamped(0, 0, 2), "pair"),
    Row("three spans", clamped(30, -30, 3), "pair"),
    Row("four spans", clamped(-60, 60, 4), "pair"),
    Row("five spans", clamped(10, 20, 5), "some"),
    Row("six spans", clamped(0, 0, 6), "pair"),
    Row("six spans, square clamps", clamped(90, -90, 6), "one"),
    Row("six spans, clamps turned away", clamped(170, -170, 6), "one"),
    Row("no longer than the span", clamped(0, 0, 1.0), "none", change="lengthen"),
    Row("shorter than the span", clamped(20, -20, 0.9), "none", change="lengthen"),
    Row("all of it in the bearings", rod_between((0.5, 0), 0, 0, 0.6, 0.6, 1.0, 0.0), "none", change="lengthen"),
]

ANGLES = [
    Row("180 deg each, the same way", clamped(180, 180, 2), "pair"),
    Row("180 deg, away from each other", clamped(180, -180, 2), "one"),
    Row("-180 deg", clamped(-180, 180, 2), "one"),
    Row("180 deg against 0", clamped(179.999, 0, 2), "one"),
    Row("180 deg, six spans", clamped(180, 180, 6), "pair"),
    Row("beyond: 210 and -210 deg", clamped(210, -210, 3), "some"),
    Row("beyond: 360 deg is a winding", clamped(360, 0, 2), "some"),
    Row("a loop of one turn", clamped(0, 0, 3), "some", 1e-5, "", (1,)),
    Row("a loop of one turn the other way", clamped(10, -20, 2.5), "some", 1e-5, "", (-1,)),
    Row("two turns", clamped(0, 0, 6), "some", 1e-5, "", (2,)),
    Row("a loop on a taut rod slides", clamped(0, 0, 1.01), "none", 1e-5, "lengthen", (1,)),
    Row("a loop on a tauter rod slides", clamped(0, 0, 1.1), "none", 1e-5, "lengthen", (1,)),
]

HEIGHTS = [
    Row("straight diagonal, 1e-6 more", clamped(45, 45, math.sqrt(2) * (1 + 1e-6), (1, 1)), "pair", 1e-9),
    Row("almost straight diagonal", clamped(40, 45, math.sqrt(2) * 1.0005, (1, 1)), "one", 1e-9),
    Row("steep diagonal, level clamps", clamped(0, 0, 2.3, (1, 2)), "one"),
    Row("straight up", clamped(90, 90, 1.3, (0, 1)), "pair"),
    Row("almost no span", clamped(90, -90, 1.0, (1e-3, 0)), "some"),
    Row("no span at all", clamped(90, -90, 1.0, (0.0, 0.0)), "some"),
]

THICKNESSES = [
    Row("0.05 mm thick", strip(0.05), "one"),
    Row("0.1 mm thick", strip(0.1), "one"),
    Row("0.3 mm thick", strip(0.3), "one"),
    Row("1 mm thick", strip(1.0), "some"),
    Row("10 mm thick", strip(10.0), "pair"),
    Row("30 mm thick", strip(30.0), "pair"),
]

WEIGHTS = [
    Row("no gravity", strip(2.4, 0.0), "pair"),
    Row("10 g", strip(2.4, 10.0), "pair"),
    Row("100 g", strip(2.4, 100.0), "one"),
    Row("0.05 mm thick at 100 g", strip(0.05, 100.0), "one"),
    Row("heavy as a chain, 1e4", clamped(0, 0, 1.2, weight=1e4), "one"),
    Row("heavy as a chain, 1e6", clamped(57, -29, 1.2, weight=1e6), "one"),
    Row("heavy as a chain, 1e8", clamped(0, 0, 1.2, weight=1e8), "one"),
    Row("heavy and taut", clamped(57, -29, 1.0001, weight=1e5), "one"),
    Row("hanging upwards, 1e4", clamped(0, 0, 1.2, weight=-1e4), "one"),
    Row("a heavy column", clamped(90, 90, 1.0, (0.0, 0.5), 1e4), "some"),
]

LOADS = [
    Row("a centre load at 0.999 of the fold", loaded(0.6, (0.5, 0.0, -0.999 * FOLD_LOAD)), "pair", 1e-7),
    Row("a centre load at 1.001 of the fold", loaded(0.6, (0.5, 0.0, -1.001 * FOLD_LOAD)), "one", 1e-7),
    Row("a centre load upwards at 1.001", loaded(0.6, (0.5, 0.0, 1.001 * FOLD_LOAD)), "one", 1e-7),
    Row("a centre load of four folds", loaded(0.6, (0.5, 0.0, -4.0 * FOLD_LOAD)), "one", 1e-7),
    Row("a load of 1e4", loaded(0.6, (0.3, 0.0, -4e4), start_deg=20), "one"),
    Row("loads of 1e6", loaded(0.6, (0.3, 0.0, -4e6), (0.6, 4e5, 0.0)), "one"),
    Row("a load at the clamp", loaded(0.6, (1e-4, 0.0, -100.0)), "pair"),
    Row("one end at 0.999 of its fold", clamped(0.999 * math.degrees(ONE_END), 0, 1.2), "pair", 1e-8),
    Row("one end at 1.001 of its fold", clamped(1.001 * math.degrees(ONE_END), 0, 1.2), "one", 1e-8),
    Row("both ends at 0.999", clamped(*(s * 0.999 * math.degrees(BOTH_ENDS) for s in (1, -1)), 1.32), "pair", 1e-8),
    Row("both ends at 1.001", clamped(*(s * 1.001 * math.degrees(BOTH_ENDS) for s in (1, -1)), 1.32), "one", 1e-8),
]

SIZES = [
    Row("microns", sized(5e-7, 2.8e-20, 0.0), "pair", 1e-11),
    Row("microns with weight", sized(5e-7, 2.8e-20, 0.47e-6), "pair", 1e-11),
    Row("kilometres", sized(5e3, 2.8e10, 0.47), "pair", 1e-1),
    Row("kilometres of rope", sized(5e3, 2.8e4, 0.47), "one", 1e-1),
    Row("a tolerance beyond rounding", sized(0.5, 0.028, 0.47), "coarse", 1e-16, "larger tolerance"),
]

COINCIDENT = [
    Row("peak and valley about to merge", clamped(*[math.degrees(0.99 * SAME_WAY)] * 2, 1 / (1 - 1e-4)), "pair", 1e-9),
    Row("peak and valley just merged", clamped(*[math.degrees(1.01 * SAME_WAY)] * 2, 1 / (1 - 1e-4)), "one", 1e-9),
    Row("symmetric, far past the pitchfork", clamped(65, -65, 1.32), "one", 1e-8),
    Row("symmetric about the middle, past it", clamped(60, 60, 1.05), "one", 1e-8),
    Row("symmetric under weight", clamped(0, 0, 1.2, weight=300.0), "one", 1e-8),
]

ROWS = EXCESS + ANGLES + HEIGHTS + THICKNESSES + WEIGHTS + LOADS + SIZES + COINCIDENT
