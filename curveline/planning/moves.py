"""Steps of a whole display: every segment proven, every node within what its motors give; what fails is cut smaller."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from curveline.plan_file import MAX_STEP_SECONDS
from curveline.planning.actuator_loads import ActuatorLoad, actuator_load_of, culprit, overload
from curveline.planning.layout import Box, Layout, between, box_of, pose_of, rests, tails_of
from curveline.planning.targets import extremes_of, seconds_between, targets_of
from curveline.planning.verification import Passed, Refused, Verifier
from curveline.radio.protocol.motion import axes_of, outside
from curveline.rod.branches.tracking import TrackedState
from curveline.scene import Display
from curveline.units import to_deg, to_mm

HALVINGS = 4
"""A step may be cut into 2^4 parts."""
SLACK = 1e-9


@dataclass(frozen=True)
class DisplayState:
    """Where a display stands and the state of every segment, None where it can be in any.

    A stage that `keeps` its states must not lose them, but for those of the `free` segments, from 0; where it does not,
    a state that would be lost may become any.
    """

    layout: Layout
    holds: tuple[TrackedState | None, ...]
    keeps: bool = True
    free: frozenset[int] = frozenset()

    def must_keep(self, segment: int) -> bool:
        """True if the state of a segment, from 0, must not be lost."""
        return self.keeps and segment not in self.free


@dataclass(frozen=True)
class PlannedMove:
    """A proven step before it is put in numbers for motors: what it is called, where it ends, what was found."""

    action: str
    end: Layout
    states: tuple[str, ...]
    lowest_eigenvalue: float
    margin: float
    margin_of: str
    load: ActuatorLoad
    corners: int
    shape: str = ""


@dataclass(frozen=True)
class Travel:
    """Moves so far, and where they end."""

    moves: tuple[PlannedMove, ...]
    stage: DisplayState


@dataclass(frozen=True)
class Leg:
    """Where to go next and what that is called; `funnels` names the wanted states of segments, from 0, that it takes
    from any state to that one; `halvings` is how often it may be cut in two."""

    action: str
    goal: Layout
    funnels: Mapping[int, str] = field(default_factory=dict)
    halvings: int = HALVINGS


def advance(verifier: Verifier, travel: Travel, leg: Leg) -> Travel:
    """Go on to a goal in one step, or in as many as make it safe; Refused, with the step's number, if none do."""
    try:
        return _advance(verifier, travel, leg)
    except Refused as refusal:
        step = len(travel.moves) + 1
        text = f"step {step} ({leg.action}): {refusal.message}"
        raise Refused(text, refusal.segment, node=refusal.node, step=step) from None


def _advance(verifier: Verifier, travel: Travel, leg: Leg) -> Travel:
    try:
        return _step(verifier, travel, leg)
    except Refused as refusal:
        if refusal.is_final or leg.halvings == 0:
            raise
    middle = between(travel.stage.layout, leg.goal, 0.5)
    half = _advance(verifier, travel, Leg(leg.action, middle, halvings=leg.halvings - 1))
    return _advance(verifier, half, replace(leg, halvings=leg.halvings - 1))


def _step(verifier: Verifier, travel: Travel, leg: Leg) -> Travel:
    """Prove a single step."""
    verifier.begin_step()
    display, stage, goal = verifier.display, travel.stage, leg.goal
    check_limits(display, goal)
    check_reach(verifier, goal)
    if seconds_between(verifier.drive, stage.layout, goal) > MAX_STEP_SECONDS:
        raise Refused(f"the step would take longer than {MAX_STEP_SECONDS:.0f} s")
    passed = [_pass(verifier, stage, goal, (segment, leg.funnels.get(segment, ""))) for segment in goal.segments]
    segment_loads = tuple(each.clamp_loads for each in passed)
    reason = overload(display, segment_loads)
    if reason:
        raise Refused(reason, **culprit(display, segment_loads)._asdict())
    worst = min(passed, key=lambda each: (each.hold is None, each.margin))
    move = PlannedMove(
        action=leg.action,
        end=goal,
        states=tuple(each.names for each in passed),
        lowest_eigenvalue=min((each.lowest for each in passed if each.hold is not None), default=worst.lowest),
        margin=worst.margin,
        margin_of=worst.margin_of,
        load=actuator_load_of(segment_loads),
        corners=sum(each.corners for each in passed),
    )
    verifier.tell()
    keeps = stage.keeps or bool(leg.funnels)
    return Travel((*travel.moves, move), DisplayState(goal, tuple(each.hold for each in passed), keeps, stage.free))


def _pass(verifier: Verifier, stage: DisplayState, goal: Layout, which: tuple[int, str]) -> Passed:
    """What comes of one segment; a Refused says which one."""
    segment, wanted = which
    display, hold = verifier.display, stage.holds[segment]
    before = after = pose_of(display, stage.layout, segment)
    box = Box(before, before)
    if not rests(stage.layout, goal, segment):
        after, box = pose_of(display, goal, segment), box_of(display, stage.layout, goal, segment)
    try:
        if wanted:
            return verifier.funnel(before, after, box, wanted)
        if hold is not None and (stage.must_keep(segment) or verifier.can_keep(before, after, box, hold)):
            return verifier.keep(before, after, box, hold)
        return verifier.allow(before, after, box)
    except Refused as refusal:
        text = f"segment {segment + 1}: {refusal.message}"
        raise Refused(text, segment + 1, is_final=refusal.is_final) from None


def check_limits(display: Display, layout: Layout) -> None:
    """Refused unless all nodes are within the display's limits and rod is left at both ends."""
    limits = display.limits
    for number, node in enumerate(layout.nodes, start=1):
        if not limits.angle.contains(node.angle, SLACK):
            raise Refused(f"node {number}: {to_deg(node.angle):.1f} deg is beyond the limits", is_final=True)
        if not limits.height.contains(node.height, SLACK):
            raise Refused(f"node {number}: {to_mm(node.height):.1f} mm is beyond the limits", is_final=True)
    for side, tail in zip(("left", "right"), tails_of(display, layout), strict=True):
        if tail < -SLACK:
            text = f"the rod is too short: its {side} tail would be {to_mm(-tail):.0f} mm inside the last node"
            raise Refused(text, is_final=True)


def check_reach(verifier: Verifier, layout: Layout) -> None:
    """Refused unless every node can tell how much rod it has fed: the radio's positions end somewhere."""
    axes = axes_of(verifier.drive)
    if not any(outside(axes, counts) for counts in extremes_of(verifier.drive, layout)):
        return
    for number, target in enumerate(targets_of(verifier.drive, layout), start=1):
        if outside(axes, target.counts):
            raise Refused(
                f"node {number} would have to feed {target.extrude_mm:.0f} mm, more than it can tell by radio",
                is_final=True,
            )
