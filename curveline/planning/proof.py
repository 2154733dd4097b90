"""The rod of one segment during one step: in which states it can be, how near it comes to losing one, what it asks.

A rod in a known state is followed straight to the end of the step, and along every edge of the box of uneven progress;
where ways meet, they must do so in one state. A rod in an unknown state may be in any; then every one is weighed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from curveline.errors import Infeasible
from curveline.plan import drive_table
from curveline.planning.demand import Demand, demand_of
from curveline.planning.layout import Box, describe
from curveline.rod.continuation import coarse_start, follow
from curveline.rod.equilibrium import ClampedRod, Equilibrium
from curveline.rod.problem import Array, Bearing, Pose
from curveline.rod.states import find_states
from curveline.rod.way import between, straight
from curveline.scene import PEAK, STRAIGHT, VALLEY, Display, Node
from curveline.simulation import DEFAULT_TOLERANCE, clamped_rod
from curveline.units import deg, mm

STIFFEST = 4.0 * math.pi**2
"""Lowest eigenvalue of a straight clamped rod without load, in EI/L^2: the unit of stability margins."""
LEAST_STABILITY = 0.05
"""A followed state must keep this fraction of `STIFFEST`."""
LEAST_PAST_FOLD = 0.15
"""The bias into a funnel must exceed the one at which the other state ceases to exist by this fraction."""

FIRST_EXCESS = 5e-4
"""Below this excess of the free rod over its chord, as a fraction, it counts as straight: play and stretch decide."""
TAUT = mm(0.05)
"""A rod may be shorter than its chord by this: encoder counts and rounding."""
OUT_OF_LINE = deg(5.0)
"""Without rod to spare, a clamp that points further away from the chord [rad] asks for more than motors give: under a
pull T, bending back to the chord takes up sqrt(EI/T)/4 times the angle squared of the rod; of two such clamps of the
built-in displays, at the 8 N of their motors, all of `FIRST_EXCESS`."""
SAME_STATE = 0.02
"""Edges of one state, followed on two ways, differ by less than this [rad]."""
LOOKS = 8
"""Parts of a step at whose ends every state is weighed."""

STABILITY = "stability"


class Refused(Infeasible):
    """A step, or a shape, is not safe: `segment` from 1, 0 if it concerns all; `step` is its number if that is known.

    `is_hopeless` if smaller steps would not help.
    """

    def __init__(self, message: str, segment: int = 0, *, step: int = 0, is_hopeless: bool = False) -> None:
        super().__init__(message)
        self.segment = segment
        self.step = step
        self.is_hopeless = is_hopeless


@dataclass(frozen=True)
class Hold:
    """The state that the rod of a segment is in, as `angles (n,)` and `forces (2,)` of a coarse rod."""

    angles: Array
    forces: Array

    @cached_property
    def key(self) -> tuple[float, ...]:
        """Tells states at the same pose apart."""
        return tuple(np.round(self.angles[:: max(1, self.angles.size // 6)], 5))


@dataclass(frozen=True)
class Passed:
    """What came of a segment in a step: its state (None if any of `names`), lowest eigenvalue, margin and of what."""

    hold: Hold | None
    names: str
    lowest: float
    margin: float
    margin_of: str
    demand: Demand
    corners: int


class Prover:
    """Follows and weighs the rod between two nodes of `display`; remembers what it has worked out.

    `tell` is to be called whenever a step of the whole display has been proven.
    """

    def __init__(self, display: Display, tell: Callable[[], None]) -> None:
        self.display = display
        self.tell = tell
        self.drive = drive_table(display)
        self.bearing: Bearing = self.rod(Pose(display.span, 0.0, 0.0, 0.0, display.span)).bearing
        self._states: dict[Pose, list[Equilibrium]] = {}
        self._ways: dict[tuple[Pose, Pose, tuple[float, ...]], tuple[Hold, float, Demand]] = {}
        self._weighed: dict[Pose, Demand] = {}
        self._allowed: dict[tuple[Pose, Pose, Box], Passed] = {}
        self._funnels: dict[tuple[Pose, str], float] = {}

    def rod(self, pose: Pose) -> ClampedRod:
        """The rod between two nodes."""
        return clamped_rod(self.display, (Node(0.0, pose.start), Node(pose.y, pose.end)), pose.length)

    def states(self, pose: Pose) -> list[Equilibrium]:
        """The states that the display can show at a pose; none for a straight rod."""
        if pose not in self._states:
            rod = self.rod(pose)
            found = [] if is_straight(rod) else find_states(rod, DEFAULT_TOLERANCE)
            self._states[pose] = [state for state in found if state.simple]
        return self._states[pose]

    def hold_of(self, state: Equilibrium) -> Hold:
        """A state that was found, as one that can be followed."""
        return Hold(*coarse_start(state))

    def name_of(self, pose: Pose, hold: Hold) -> str:
        """What the state `hold` is called at `pose`; Refused if it was not found there."""
        for state in self.states(pose):
            if np.max(np.abs(coarse_start(state)[0] - hold.angles)) < SAME_STATE:
                return state.name
        raise Refused(f"the rod would end in a state that was not found at {describe(pose)}", is_hopeless=True)

    def keep(self, before: Pose, after: Pose, box: Box, hold: Hold) -> Passed:
        """Follow a known state through a step; Refused where it would be lost or comes too near to it."""
        end, lowest, demand = self._follow(before, after, hold, is_hopeless=True)
        holds = {before: hold, after: end}
        for here, there in box.edges(before, after):
            reached, least, asked = self._follow(here, there, holds[here])
            if np.max(np.abs(holds.setdefault(there, reached).angles - reached.angles)) > SAME_STATE:
                raise Refused(f"uneven progress by way of {describe(here)} would end in another state")
            lowest, demand = min(lowest, least), demand.joined(asked)
        corners = set(box.corners()) - {before, after}
        name = self.name_of(after, end)
        return Passed(end, name, lowest, lowest / STIFFEST, STABILITY, demand, len(corners))

    def can_keep(self, before: Pose, after: Pose, box: Box, hold: Hold) -> bool:
        """True if a known state would survive a step."""
        try:
            self.keep(before, after, box, hold)
        except Refused:
            return False
        return True

    def allow(self, before: Pose, after: Pose, box: Box) -> Passed:
        """Let the rod be in any state through a step; Refused where it would be taut."""
        key = before, after, box
        if key not in self._allowed:
            shares = [look / LOOKS for look in range(LOOKS + 1)] if before != after else [1.0]
            corners = set(box.corners())
            demand = Demand()
            for pose in (*(between(before, after, share) for share in shares), *corners):
                demand = demand.joined(self.weigh(pose))
            states = self.states(after)
            lowest = min((state.lowest_eigenvalue for state in states), default=STIFFEST)
            names = "|".join(state.name for state in states) or STRAIGHT
            margin_of = f"{STABILITY}; any state will do"
            self._allowed[key] = Passed(None, names, lowest, lowest / STIFFEST, margin_of, demand, len(corners))
        return self._allowed[key]

    def funnel(self, before: Pose, after: Pose, box: Box, wanted: str) -> Passed:
        """Bias the rod, whatever its state, to where only the `wanted` one exists; Refused unless with a margin."""
        margin = self.past_fold(after, wanted)
        if margin < LEAST_PAST_FOLD:
            raise Refused(
                f"the other state ceases to exist only {100 * margin:.0f} % before the end of the bias",
                is_hopeless=True,
            )
        passed = self.allow(before, after, box)
        state = self.states(after)[0]
        lowest = state.lowest_eigenvalue
        margin_of = f"bias past the fold of the {VALLEY if wanted == PEAK else PEAK}"
        return Passed(self.hold_of(state), wanted, lowest, margin, margin_of, passed.demand, passed.corners)

    def past_fold(self, pose: Pose, wanted: str) -> float:
        """By how much, as a fraction, the bias at `pose` exceeds the one that leaves only the `wanted` state.

        From untilted nodes on; Refused if another state is left.
        """
        if (pose, wanted) not in self._funnels:
            if [state.name for state in self.states(pose)] != [wanted]:
                raise Refused(f"at {describe(pose)} not only the {wanted} exists", is_hopeless=True)
            level = pose._replace(start=0.0, end=0.0)
            way = straight(level, pose)
            branches = [follow(way, self.bearing, *coarse_start(state)) for state in self.states(level)]
            gone = max((branch.reached for branch in branches if branch.reached < 1.0), default=0.0)
            self._funnels[pose, wanted] = 1.0 / gone - 1.0 if gone > 0.0 else 1.0
        return self._funnels[pose, wanted]

    def _follow(
        self, before: Pose, after: Pose, hold: Hold, *, is_hopeless: bool = False
    ) -> tuple[Hold, float, Demand]:
        """Where a state is after a straight way, its lowest eigenvalue on it, and what it asks."""
        key = before, after, hold.key
        if key not in self._ways:
            branch = follow(straight(before, after), self.bearing, hold.angles, hold.forces)
            if branch.reached < 1.0:
                where = describe(between(before, after, branch.reached))
                raise Refused(f"the state loses its stability at {where}", is_hopeless=is_hopeless)
            lowest = float(branch.samples[:, 1].min())
            self._ways[key] = Hold(branch.phi, branch.multipliers), lowest, demand_of(branch.samples)
        found = self._ways[key]
        if found[1] < LEAST_STABILITY * STIFFEST:
            margin = found[1] / STIFFEST
            raise Refused(f"the state comes within {margin:.3f} of losing stability", is_hopeless=is_hopeless)
        return found

    def weigh(self, pose: Pose) -> Demand:
        """What any of the states at `pose` asks; Refused if the rod is taut there."""
        if pose not in self._weighed:
            rod = self.rod(pose)
            is_pulled = is_straight(rod) and out_of_line(rod) > OUT_OF_LINE
            if is_pulled or rod.free_length < math.hypot(*rod.free_chord) - TAUT:
                raise Refused(f"in uneven progress the rod would be pulled taut at {describe(pose)}")
            demand = Demand()
            way = straight(pose, pose)
            for state in self.states(pose):
                demand = demand.joined(demand_of(follow(way, self.bearing, *coarse_start(state)).samples))
            self._weighed[pose] = demand
        return self._weighed[pose]


def is_straight(rod: ClampedRod) -> bool:
    """True if there is no rod to spare between the clamps."""
    return rod.free_length <= math.hypot(*rod.free_chord) * (1.0 + FIRST_EXCESS)


def out_of_line(rod: ClampedRod) -> float:
    """How far the clamps point away from the straight line between them, the larger of two angles [rad]."""
    x, y = rod.free_chord
    line = math.atan2(y, x)
    return max(abs(rod.start - line), abs(rod.end - line))
