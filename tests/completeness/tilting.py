"""Exact equilibria between bearings that give: those between rigid clamps, whose angles a method of its own moves.

The rod between clamps that stand is shot for, see `kirchhoff`. What its node would have to hold about a pivot is the
slope of the rod's energy by the tilt of a bearing; Newton's method with differences of that finds where the springs
hold it. The whole is stable if the rod between clamps that stand is, and the energy rises with both tilts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from curveline.rod.clamped_rod import ClampedRod

from .kirchhoff import Rod, Solution, integrated_whole, places_of, rod_of, shoot

Array = NDArray[np.float64]

STEP = 1e-5
"""Tilt [rad] by which slopes are taken."""
CLOSE = 1e-8
"""Moment [EI / L] that is taken for none."""
LONGEST = 0.1
"""Most that a bearing tilts in a step [rad]."""
TRIES = 40
STOP = 1e-12


def tilted(segment: ClampedRod, tilts: Array) -> ClampedRod:
    """The same rod between rigid clamps that stand where bearings tilted by `tilts (2,)` hold its mouths."""
    pose = segment.pose._replace(start=segment.start + float(tilts[0]), end=segment.end + float(tilts[1]))
    moved = segment.moved_to(pose)
    return ClampedRod(
        pose,
        segment.bearing._replace(give=0.0, play=0.0),
        moved.loads,
        section=moved.section,
        yaw=moved.yaw,
        roll=moved.roll,
        weight_x=moved.weight_x,
        weight_z=moved.weight_z,
        lateral_curvature=moved.lateral_curvature,
    )


def tilts_of(segment: ClampedRod, start: Array) -> Array:
    """Those that an equilibrium's start (8,), wrench and tilts, has; none of one between rigid clamps, (6,)."""
    return start[6:] if segment.has_giving_clamps else np.zeros(2)


def rest(segment: ClampedRod, start: Array) -> Solution | None:
    """The equilibrium that Newton's method reaches from a wrench, or from a wrench and tilts (8,); None if none."""
    if not segment.has_giving_clamps:
        return shoot(rod_of(segment), start[:6])
    tilts = start[6:].copy()
    if segment.bearing.give == 0.0:
        tilts = np.clip(tilts, -segment.bearing.play, segment.bearing.play)
    here = shoot(rod_of(tilted(segment, tilts)), start[:6])
    for _ in range(TRIES):
        if here is None:
            return None
        slope = _asked(segment, tilts, here) + _springs(segment, tilts)[0]
        free = ~_is_stopped(segment, tilts, slope)
        bend = _bend(segment, tilts, here)
        if bend is None:
            return None
        bend += np.diag(_springs(segment, tilts)[1])
        values, axes = np.linalg.eigh(bend[np.ix_(free, free)])
        if np.max(np.abs(slope[free]), initial=0.0) < CLOSE:
            return Solution(np.append(here.wrench, tilts), here.poses, here.conjugate + int(np.sum(values < 0.0)))
        step = np.zeros(2)
        step[free] = -axes @ ((axes.T @ slope[free]) / np.maximum(np.abs(values), 1e-3))
        tilts, here = _gone(segment, tilts, here, step)
    return None


def _gone(segment: ClampedRod, tilts: Array, here: Solution, step: Array) -> tuple[Array, Solution | None]:
    """Tilts and equilibrium after a step, or a part of it, that leaves less moment or turns a bearing to its stop."""
    step = step * min(1.0, LONGEST / max(float(np.max(np.abs(step))), 1e-300))
    before = _left(segment, tilts, here)
    least: tuple[float, Array, Solution] | None = None
    for part in 0.5 ** np.arange(10):
        trial = tilts + part * step
        if segment.bearing.give == 0.0:
            trial = np.clip(trial, -segment.bearing.play, segment.bearing.play)
        there = shoot(rod_of(tilted(segment, trial)), here.wrench)
        if there is None or np.max(np.abs(there.curve - here.curve)) > 2.0 * LONGEST:
            continue
        after = _left(segment, trial, there)
        if after < (1.0 - 0.2 * part) * before:
            return trial, there
        if least is None or after < least[0]:
            least = after, trial, there
    # Downhill over a hill of the slope, as out of what is no minimum.
    return (least[1], least[2]) if least is not None else (tilts, None)


def _left(segment: ClampedRod, tilts: Array, here: Solution) -> float:
    slope = _asked(segment, tilts, here) + _springs(segment, tilts)[0]
    return float(np.max(np.abs(slope[~_is_stopped(segment, tilts, slope)]), initial=0.0))


def _springs(segment: ClampedRod, tilts: Array) -> tuple[Array, Array]:
    """Moments of the springs and their slopes (2,), in units of EI and the length."""
    beyond = np.maximum(np.abs(tilts) - segment.bearing.play, 0.0)
    if segment.bearing.give == 0.0:
        return np.zeros(2), np.zeros(2)
    rate = segment.free_length / segment.bearing.give
    return rate * np.copysign(beyond, tilts), np.where(beyond > 0.0, rate, 0.0)


def _is_stopped(segment: ClampedRod, tilts: Array, slope: Array) -> Array:
    """Which bearings (2,) are held by the end of their play and do not give beyond."""
    at_end = np.abs(tilts) > segment.bearing.play - STOP
    return at_end & (segment.bearing.give == 0.0) & (slope * tilts < 0.0)


def _asked(segment: ClampedRod, tilts: Array, here: Solution) -> Array:
    """Moments (2,) about the pivots, along z, that hold the rod: slopes of its energy by the tilts."""
    rod = rod_of(tilted(segment, tilts))
    whole = integrated_whole(rod, here.wrench, places_of(rod))
    reach = 0.5 * segment.clamp / segment.free_length
    out = np.empty(2)
    for end, side in ((0, -1.0), (1, 1.0)):
        state = whole[-end]
        arm = reach * _tangent(rod, end)
        out[end] = side * state[12] - arm[0] * state[8] + arm[1] * state[7]
    return out


def _tangent(rod: Rod, end: int) -> Array:
    w, x, y, z = rod.last if end else rod.first
    return 2.0 * np.array([x * z + w * y, y * z - w * x])


def _bend(segment: ClampedRod, tilts: Array, here: Solution) -> Array | None:
    """Slopes (2, 2) of the moments by the tilts."""
    out = np.empty((2, 2))
    for end in range(2):
        ends = []
        for side in (1.0, -1.0):
            there = tilts.copy()
            there[end] += side * STEP
            found = shoot(rod_of(tilted(segment, there)), here.wrench)
            if found is None:
                return None
            ends.append(_asked(segment, there, found))
        out[:, end] = (ends[0] - ends[1]) / (2.0 * STEP)
    return 0.5 * (out + out.T)
