"""What the rod asks of itself and of the motors of a node, as bounds over everything that may happen in a step."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from curveline.rod.branches.continuation import Branch
from curveline.rod.problem import Array
from curveline.rod.states.equilibrium import Equilibrium
from curveline.scene import Display
from curveline.units import to_mm, to_nmm, told_apart

AXIAL, VERTICAL, MOMENT = range(3)
LEFT, RIGHT = slice(0, 3), slice(3, 6)
TASKS = ("extruding", "holding the height", "biasing")
"""What the motors of a node do against these."""


@dataclass(frozen=True)
class ClampLoads:
    """The least and the most, `low (6,)` and `high (6,)`, that the two nodes of a segment do to its rod.

    For the left, then the right node: along the rod, upwards [N], about its pivot [N m]. `curvature` [1/m] is the
    largest one away from the natural one.
    """

    low: Array = field(default_factory=lambda: np.full(6, math.inf))
    high: Array = field(default_factory=lambda: np.full(6, -math.inf))
    curvature: float = 0.0

    def joined(self, other: ClampLoads) -> ClampLoads:
        """Bounds on either."""
        return ClampLoads(
            np.minimum(self.low, other.low), np.maximum(self.high, other.high), max(self.curvature, other.curvature)
        )


def clamp_loads_of(branch: Branch) -> ClampLoads:
    """Bounds over all poses of a followed branch."""
    if branch.fractions.size == 0:
        return ClampLoads()
    wrenches = branch.wrenches
    return ClampLoads(wrenches.min(axis=0), wrenches.max(axis=0), float(branch.sharpest.max()))


def clamp_loads_of_state(state: Equilibrium) -> ClampLoads:
    """What a state, in the plane or out of it, asks of motors that act in it: see `continuation.node_loads`.

    Straightening the rod as it enters a bearing pushes it out, however it bends and twists: by half of its stiffness
    times the square of its curvature, less that of its natural one, which it has where it comes from. Of a rod that is
    out of the plane that is bounded, with the stiffness in the plane, which is the least.
    """
    rod = state.rod
    asked = []
    for side, angle in enumerate((rod.start, rod.end)):
        sign = 1.0 - 2.0 * side
        (x, y), moment = state.clamp_force[side], state.clamp_moment[side]
        natural = rod.stiffness * rod.mouth_curvatures[side]
        push = 0.5 * ((natural - sign * moment) ** 2 - natural**2) / rod.stiffness
        if state.space is not None:
            push = 0.5 * (math.hypot(*state.space.moments[side]) + abs(natural)) ** 2 / rod.stiffness
        across = y * math.cos(angle) - x * math.sin(angle)
        asked += [x * math.cos(angle) + y * math.sin(angle) - sign * push, y, moment + sign * 0.5 * rod.clamp * across]
    asks = np.array(asked)
    return ClampLoads(asks, asks, state.max_curvature)


@dataclass(frozen=True)
class ActuatorLoad:
    """The most that a step asks of any node, and of the rod."""

    force: float = 0.0  # [N]
    moment: float = 0.0  # [N m]
    curvature: float = 0.0  # [1/m]

    def joined(self, other: ActuatorLoad) -> ActuatorLoad:
        """The more of either."""
        return ActuatorLoad(
            max(self.force, other.force), max(self.moment, other.moment), max(self.curvature, other.curvature)
        )

    def share(self, display: Display) -> float:
        """The largest share of what rod or motors can give."""
        drive, rod = display.drive, display.rod
        return max(self.curvature / rod.max_curvature, self.force / drive.max_force, self.moment / drive.max_moment)


def actuator_load_of(segment_loads: Iterable[ClampLoads]) -> ActuatorLoad:
    """What the segments of a display, left to right, ask together."""
    segment_loads = tuple(segment_loads)
    needs = node_needs(segment_loads)
    return ActuatorLoad(
        float(np.max(needs[:, :MOMENT])), float(np.max(needs[:, MOMENT])), max(each.curvature for each in segment_loads)
    )


def node_needs(segment_loads: tuple[ClampLoads, ...]) -> Array:
    """The most that every node must give, (nodes, 3): along the rod, upwards [N], about its pivot [N m].

    A node bears the ends of both its segments. They are bounded each for itself, since in uneven progress any of one
    may meet any of the other.
    """
    low, high = np.zeros((2, len(segment_loads) + 1, 3))
    lows = np.array([each.low for each in segment_loads])
    highs = np.array([each.high for each in segment_loads])
    unasked = ~np.all(np.isfinite(lows), axis=1)
    lows[unasked], highs[unasked] = 0.0, 0.0
    low[:-1] += lows[:, LEFT]
    low[1:] += lows[:, RIGHT]
    high[:-1] += highs[:, LEFT]
    high[1:] += highs[:, RIGHT]
    return np.asarray(np.maximum(np.abs(low), np.abs(high)))


def overload(display: Display, segment_loads: tuple[ClampLoads, ...]) -> str:
    """What a step asks beyond what rod and motors can give; empty if nothing."""
    rod, drive = display.rod, display.drive
    for segment, clamp_loads in enumerate(segment_loads, start=1):
        if clamp_loads.curvature > rod.max_curvature:
            bent, allowed = told_apart(to_mm(1.0 / clamp_loads.curvature), to_mm(1.0 / rod.max_curvature), 0, "f")
            return f"in segment {segment} the rod would bend to a radius of {bent} mm, its strain allows {allowed} mm"
    gives = (drive.max_force, drive.max_force, drive.max_moment)
    for node, needs in enumerate(node_needs(segment_loads), start=1):
        for axis, (need, have) in enumerate(zip(needs, gives, strict=True)):
            if need > have:
                return f"at node {node} {TASKS[axis]} {_beyond(axis, need, have)}"
    return ""


def _beyond(axis: int, need: float, have: float) -> str:
    """That it takes more than the motor gives, in N or N mm."""
    if axis == MOMENT:
        takes, gives, unit = *told_apart(to_nmm(need), to_nmm(have), 0, "f"), "N mm"
    else:
        takes, gives, unit = *told_apart(need, have, 1, "f"), "N"
    return f"takes {takes} {unit}, the motor gives {gives} {unit}"


class Culprit(NamedTuple):
    """What an overload is about, from 1: a `segment` whose rod bends too much, or else a `node`; 0 if neither."""

    segment: int = 0
    node: int = 0


def culprit(display: Display, segment_loads: tuple[ClampLoads, ...]) -> Culprit:
    """The first segment or node of which a step asks too much."""
    drive = display.drive
    for segment, clamp_loads in enumerate(segment_loads, start=1):
        if clamp_loads.curvature > display.rod.max_curvature:
            return Culprit(segment=segment)
    gives = np.array([drive.max_force, drive.max_force, drive.max_moment])
    overloaded = np.flatnonzero(np.any(node_needs(segment_loads) > gives, axis=1))
    return Culprit(node=int(overloaded[0]) + 1) if overloaded.size else Culprit()
