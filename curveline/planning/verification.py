"""The rod of one segment during one step: in which states it can be, how near it comes to losing one, what it asks.

A rod in a known state is followed straight to the end of the step, and along every edge of the box of uneven progress;
where ways meet, they must do so in one state. A rod in an unknown state may be in any; then every one is weighed.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce

from curveline.drive_settings import drive_settings
from curveline.errors import Infeasible
from curveline.planning.actuator_loads import ClampLoads, actuator_load_of, clamp_loads_of, clamp_loads_of_state
from curveline.planning.glances import Glance, Glances, past
from curveline.planning.layout import Box, describe
from curveline.rod.branches.continuation import FOLLOW_EDGES, STIFFEST, coarse_start, follow, stiffness_of, travel
from curveline.rod.branches.control_path import between, straight_path
from curveline.rod.branches.tracking import CLOSE, TrackedState, identify, on_edges, refined, tracked, why_not_shown
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.choice import AUTO, SearchRequest, model_states
from curveline.rod.models.showable import Showable, showable_states
from curveline.rod.models.straight import straight_state
from curveline.rod.planar.approach import layer
from curveline.rod.problem import Pose
from curveline.rod.states.equilibrium import SPATIAL, Equilibrium
from curveline.rod.states.slack import OUT_OF_LINE, is_slack, is_straight, missing, out_of_line
from curveline.scene import PEAK, STRAIGHT, VALLEY, Display, Node
from curveline.simulation.simulate import DEFAULT_TOLERANCE, clamped_rod
from curveline.units import TAUT, mm

LEAST_STABILITY = 0.05
"""A followed state must keep this fraction of `STIFFEST`, in the plane and out of it."""
LEAST_PAST_FOLD = 0.15
"""The bias into a funnel must exceed the one at which the other state ceases to exist by this fraction."""

EDGES = (FOLLOW_EDGES, 4 * FOLLOW_EDGES, 16 * FOLLOW_EDGES)
"""A state is followed on the fewest that are short enough for it, and on the next if it is lost on these."""
PER_LAYER = 1.0
"""Edges in the thickness of a layer in which a taut or heavy rod bends."""
COARSE_CURVE = mm(1.0)
"""Bound on the error of curves out of the plane, of which only forces and strain matter."""
LOOKS = 8
"""Parts of a step at whose ends every state is weighed."""

STABILITY = "stability"
OUT_OF_PLANE = "stability out of the plane"


class Refused(Infeasible):
    """A step, or a shape, is not safe: `segment` from 1, 0 if it concerns several; `step` is its number if known.

    `node` is that whose motors cannot, from 1, 0 if it is not that; `is_final` if smaller steps would not help.
    """

    def __init__(self, message: str, segment: int = 0, *, node: int = 0, step: int = 0, is_final: bool = False) -> None:
        super().__init__(message)
        self.segment = segment
        self.node = node
        self.step = step
        self.is_final = is_final


@dataclass(frozen=True)
class Passed:
    """What came of a segment in a step: its state (None if any of `names`), lowest eigenvalue, margin and of what."""

    hold: TrackedState | None
    names: str
    lowest: float
    margin: float
    margin_of: str
    clamp_loads: ClampLoads
    corners: int


@dataclass(frozen=True)
class Followed:
    """A state after a straight way, its lowest eigenvalues in the plane and out of it on it [EI/L^2], what it asks."""

    end: TrackedState
    inside: float
    outside: float
    clamp_loads: ClampLoads


class Verifier:
    """Follows and weighs the rod between two nodes of `display`; remembers what it has worked out.

    `tell` is to be called whenever a step of the whole display has been proven.
    """

    def __init__(self, display: Display, tell: Callable[[], None]) -> None:
        self.display = display
        self.tell = tell
        self.drive = drive_settings(display)
        self._rod = _level_rod(display)
        self.bearing = self._rod.bearing
        self.is_row = display.node_count > 2
        self._steps_left = math.inf
        self._showable: dict[Pose, Showable] = {}
        self._straight: dict[Pose, Equilibrium | None] = {}
        self._elsewhere: dict[Pose, tuple[Equilibrium, ...]] = {}
        self._ways: dict[tuple[Pose, Pose, tuple[float, ...]], Followed] = {}
        self._weighed: dict[Pose, ClampLoads] = {}
        self._kept: dict[tuple[Pose, Pose, Box, tuple[float, ...]], Passed] = {}
        self._allowed: dict[tuple[Pose, Pose, Box], Passed] = {}
        self._funnelled: dict[tuple[Pose, Pose, Box, str], Passed] = {}
        self._funnels: dict[tuple[Pose, str], float] = {}
        self._glances = Glances(self.bearing, self.states)

    def has_rod_of(self, display: Display) -> bool:
        """True if a rod between nodes of `display` does what this one does, in its plane and out of it."""
        return _level_rod(display).bearing == self.bearing

    def like(self, display: Display, steps: float = math.inf) -> Verifier:
        """A verifier for a `display` with the same rod between its nodes, but maybe other motors or limits.

        What was worked out of the rod holds there, too. It refuses everything after so many `steps`.
        """
        other = copy.copy(self)
        other.display, other.drive, other._steps_left = display, drive_settings(display), steps
        return other

    def begin_step(self) -> None:
        """To be called before a step of the whole display is looked at; Refused if it is one too many."""
        self._steps_left -= 1
        if self._steps_left < 0:
            raise Refused("too many steps were tried", is_final=True)

    def rod(self, pose: Pose) -> ClampedRod:
        """The rod between two nodes."""
        return self._rod.moved_to(pose)

    def showable(self, pose: Pose) -> Showable:
        """The states that the display can show at a pose, and those that would leave the plane; none if straight."""
        if pose not in self._showable:
            rod = self.rod(pose)
            self._showable[pose] = showable_states(rod, DEFAULT_TOLERANCE) if is_slack(rod) else Showable()
        return self._showable[pose]

    def states(self, pose: Pose) -> tuple[Equilibrium, ...]:
        """The states that the display can show at a pose; none for a straight rod."""
        return self.showable(pose).states

    def straight(self, pose: Pose) -> Equilibrium | None:
        """The state of a rod that is straight at a pose; None where it is not, or may lie on either side."""
        if pose not in self._straight:
            rod = self.rod(pose)
            request = SearchRequest(DEFAULT_TOLERANCE, (0,), AUTO)
            found = model_states(rod, request).states if is_straight(rod) else ()
            self._straight[pose] = next((state for state in found if state.name == STRAIGHT), None)
        return self._straight[pose]

    def elsewhere(self, pose: Pose) -> tuple[Equilibrium, ...]:
        """The states out of the plane that the rod has at a pose."""
        if pose not in self._elsewhere:
            found = model_states(self.rod(pose), SearchRequest(COARSE_CURVE, (0,), SPATIAL)).states
            self._elsewhere[pose] = tuple(state for state in found if state.leaves_plane and state.stable)
        return self._elsewhere[pose]

    def name_of(self, pose: Pose, hold: TrackedState) -> str:
        """What the state `hold` is called at `pose`; Refused if the display cannot show it there."""
        rod = self.rod(pose)
        if (state := identify(rod, hold, self.states(pose))) is not None:
            return state.name
        if identify(rod, hold, self.showable(pose).leaving) is not None:
            why = "that leaves the plane"
        else:
            why = why_not_shown(refined(rod, hold, DEFAULT_TOLERANCE)) or "that was not found"
        raise Refused(f"the rod would end in a state {why} at {describe(pose)}", is_final=True)

    def keep(self, before: Pose, after: Pose, box: Box, hold: TrackedState) -> Passed:
        """Follow a known state through a step; Refused where it would be lost or comes too near to it.

        A coarse rod has its folds earlier than the real one: what it cannot keep is tried on finer edges.
        """
        key = before, after, box, hold.key
        refusals: list[Refused] = []
        for n in self._edges(before, after) if key not in self._kept else ():
            try:
                self._kept[key] = self._keep(before, after, box, self._on_edges(before, hold, n))
                break
            except Refused as refusal:
                refusals.append(refusal)
        else:
            if refusals:
                raise refusals[-1]
        return self._kept[key]

    def _edges(self, before: Pose, after: Pose) -> tuple[int, int]:
        """How many edges to follow a state on, and how many where these lose it."""
        thinnest = min(layer(self.rod(pose).scaled()) for pose in (before, after))
        first = next((n for n in EDGES[:-1] if n * thinnest > PER_LAYER), EDGES[-2])
        return first, EDGES[EDGES.index(first) + 1]

    def _on_edges(self, pose: Pose, hold: TrackedState, n: int) -> TrackedState:
        held = on_edges(self.rod(pose), hold, n)
        if held is None:
            raise Refused(f"the state is about to lose its stability at {describe(pose)}", is_final=True)
        return held

    def _keep(self, before: Pose, after: Pose, box: Box, hold: TrackedState) -> Passed:
        """Follow a known state through a step on the edges that it is held on."""
        direct = self._follow(before, after, hold, is_final=True)
        holds = {before: hold, after: direct.end}
        followed = [direct]
        for here, there in box.edges(before, after):
            way = self._follow(here, there, holds[here])
            if holds.setdefault(there, way.end).gap(way.end) > CLOSE:
                raise Refused(f"uneven progress by way of {describe(here)} would end in another state")
            followed.append(way)
        corners = set(box.corners()) - {before, after}
        clamp_loads = reduce(ClampLoads.joined, (way.clamp_loads for way in followed))
        inside, outside = (min(getattr(way, side) for way in followed) for side in ("inside", "outside"))
        lowest, margin_of = (inside, STABILITY) if inside <= outside else (outside, OUT_OF_PLANE)
        name = self.name_of(after, direct.end)
        return Passed(direct.end, name, lowest, lowest / STIFFEST, margin_of, clamp_loads, len(corners))

    def can_keep(self, before: Pose, after: Pose, box: Box, hold: TrackedState) -> bool:
        """True if a known state would survive a step."""
        try:
            self.keep(before, after, box, hold)
        except Refused:
            return False
        return True

    def allow(self, before: Pose, after: Pose, box: Box) -> Passed:
        """Let the rod be in any state through a step, out of the plane, too; Refused where it would be taut."""
        key = before, after, box
        if key not in self._allowed:
            looks = looks_at(before, after, is_row=self.is_row)
            corners = set(box.corners())
            clamp_loads = reduce(ClampLoads.joined, (self.weigh(pose) for pose in (*looks, *corners)))
            leaves = [pose for pose in looks if self.showable(pose).leaving]
            aside = [state for pose in leaves for state in self.elsewhere(pose)]
            clamp_loads = reduce(ClampLoads.joined, map(clamp_loads_of_state, aside), clamp_loads)
            states = (*self.states(after), *(self.elsewhere(after) if leaves else ()))
            lowest = min((state.lowest_eigenvalue for state in states), default=STIFFEST)
            names = "|".join(state.name for state in states) or STRAIGHT
            margin_of = f"{STABILITY}; any state will do"
            self._allowed[key] = Passed(None, names, lowest, lowest / STIFFEST, margin_of, clamp_loads, len(corners))
        return self._allowed[key]

    def funnel(self, before: Pose, after: Pose, box: Box, wanted: str) -> Passed:
        """Bias the rod, whatever its state, to where only the `wanted` one exists; Refused unless with a margin."""
        key = before, after, box, wanted
        if key not in self._funnelled:
            self._funnelled[key] = self._funnel(before, after, box, wanted)
        return self._funnelled[key]

    def _funnel(self, before: Pose, after: Pose, box: Box, wanted: str) -> Passed:
        """As `funnel`."""
        margin = self.past_fold(after, wanted)
        if margin < LEAST_PAST_FOLD:
            raise Refused(
                f"the other state ceases to exist only {100 * margin:.0f} % before the end of the bias",
                is_final=True,
            )
        if self._may_be_aside(before, after) and (aside := self.elsewhere(after)):
            names = " and ".join(state.name for state in aside)
            raise Refused(f"at {describe(after)} the rod may be out of the plane: {names}", is_final=True)
        passed = self.allow(before, after, box)
        state = self.states(after)[0]
        lowest = state.lowest_eigenvalue
        margin_of = f"bias past the fold of the {VALLEY if wanted == PEAK else PEAK}"
        return Passed(tracked(state), wanted, lowest, margin, margin_of, passed.clamp_loads, passed.corners)

    def _may_be_aside(self, before: Pose, after: Pose) -> bool:
        """True if the rod may leave the plane on a way, or may have done so while it was fed to where that begins."""
        fed = before._replace(length=self.display.span)
        ways = ((fed, before), (before, after))
        return any(self.showable(pose).leaving for way in ways for pose in looks_at(*way, is_row=self.is_row))

    def past_fold(self, pose: Pose, wanted: str) -> float:
        """By how much, as a fraction, the bias at `pose` exceeds the one that leaves only the `wanted` state.

        From untilted nodes on; Refused if another state is left.
        """
        if (pose, wanted) not in self._funnels:
            if [state.name for state in self.states(pose)] != [wanted]:
                raise Refused(f"at {describe(pose)} not only the {wanted} exists", is_final=True)
            level = pose._replace(start=0.0, end=0.0)
            way = straight_path(level, pose)
            ends = [travel(way, self.bearing, *coarse_start(state))[0] for state in self.states(level)]
            gone = max((reached for reached in ends if reached < 1.0), default=0.0)
            self._funnels[pose, wanted] = past(gone)
        return self._funnels[pose, wanted]

    def glance(self, level: Pose, biased: Pose, share: float) -> Glance:
        """Roughly what becomes of the states of level nodes as they are biased: see `Glances`."""
        return self._glances.glance(level, biased, share)

    def _follow(self, before: Pose, after: Pose, hold: TrackedState, *, is_final: bool = False) -> Followed:
        """A state on a straight way; Refused where it would be lost or comes too near to it."""
        key = before, after, hold.key
        if key not in self._ways:
            way = straight_path(before, after)
            branch = follow(way, self.bearing, hold.angles, hold.multipliers)
            if branch.reached < 1.0:
                where = describe(between(before, after, branch.reached))
                what = "leaves the plane" if branch.leaves_plane else "loses its stability"
                raise Refused(f"the state {what} at {where}", is_final=is_final)
            inside, outside = stiffness_of(way, self.bearing, branch)
            end = TrackedState(branch.phi, branch.multipliers)
            self._ways[key] = Followed(end, inside, outside, clamp_loads_of(branch))
        found = self._ways[key]
        if reason := too_near(found.inside, found.outside):
            raise Refused(f"the state comes within {reason}", is_final=is_final)
        return found

    def weigh_on_the_way(self, before: Pose, after: Pose) -> ClampLoads:
        """What the states at `before` ask at `after`, as far as a straight way leads them there: near folds they are
        sooner followed than found."""
        way, bearing = straight_path(before, after), self.bearing.held_in_plane()
        clamp_loads = ClampLoads()
        for state in self.showable(before).planar:
            reached, angles, forces, _ = travel(way, bearing, *coarse_start(state))
            if reached == 1.0:
                clamp_loads = clamp_loads.joined(
                    clamp_loads_of(follow(straight_path(after, after), bearing, angles, forces))
                )
        return clamp_loads

    def weigh(self, pose: Pose) -> ClampLoads:
        """What any of the states at `pose` asks; Refused if the rod is taut there."""
        if pose not in self._weighed:
            rod = self.rod(pose)
            is_pulled = not is_slack(rod) and out_of_line(rod) > OUT_OF_LINE
            if is_pulled or missing(rod) > TAUT:
                raise Refused(f"in uneven progress the rod would be pulled taut at {describe(pose)}")
            self._check_pull(pose)
            segment_loads = map(clamp_loads_of_state, self.showable(pose).planar)
            self._weighed[pose] = reduce(ClampLoads.joined, segment_loads, ClampLoads())
        return self._weighed[pose]

    def _check_pull(self, pose: Pose) -> None:
        """Refused if a rod without any to spare, between nodes that are not at home, pulls harder than a motor can.

        What it asks below that is not counted: play and what gives take it up.
        """
        rod = self.rod(pose)
        if pose.y == pose.start == pose.end == 0.0 or not is_straight(rod):
            return
        state, gives = straight_state(rod, COARSE_CURVE), self.display.drive.max_force
        pull = actuator_load_of((clamp_loads_of_state(state),)).force
        if state.stable and pull > gives:
            text = f"in uneven progress the rod would pull with {pull:.1f} N, the motor gives {gives:.1f} N"
            raise Refused(f"{text}, at {describe(pose)}")


def _level_rod(display: Display) -> ClampedRod:
    """The rod between two level nodes that it leads to on the straight way."""
    return clamped_rod(display, (Node(0.0, 0.0), Node(0.0, 0.0)), display.span)


def looks_at(before: Pose, after: Pose, *, is_row: bool) -> list[Pose]:
    """Where on the way from one pose to another every state is weighed: at the ends of `LOOKS` parts of it, or more.

    In a row, while nothing but rod is fed, at excesses over the span that are multiples of a power of two: segments
    have other lengths on the way, and share these.
    """
    if before == after:
        return [after]
    if not is_row or before._replace(length=after.length) != after:
        return [between(before, after, look / LOOKS) for look in range(LOOKS + 1)]
    low, high = sorted((before.length - before.x, after.length - after.x))
    part = 2.0 ** math.floor(math.log2((high - low) / LOOKS))
    excesses = (number * part for number in range(math.floor(low / part) + 1, math.ceil(high / part)))
    return [before, *(before._replace(length=before.x + excess) for excess in excesses), after]


def too_near(inside: float, outside: float) -> str:
    """Of what a state with these lowest eigenvalues [EI/L^2] is too near to, and how near; empty if it is not."""
    for lowest, what in ((inside, "losing stability"), (outside, "leaving the plane")):
        if lowest < LEAST_STABILITY * STIFFEST:
            return f"{max(lowest, 0.0) / STIFFEST:.3f} of {what}, and must stay {LEAST_STABILITY:g} away from it"
    return ""
