"""From a scene to the steps that reach it: the paper's five, with a funnel in place of its trial and error.

Paper, section V: extrude a little, bias to the wanted side, extrude to length, bias to the final angles, translate.
The first two steps are chosen such that after them only the wanted state exists, so that it does not matter which way
the rod buckled first, nor which shape the display showed before; from there the state is followed to the goal, and the
plan is refused if the state does not survive with a margin or asks too much of rod or motors.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from curveline import __version__
from curveline.errors import Infeasible, InvalidInput
from curveline.passage import (
    LEAST_STABILITY,
    STIFFEST,
    Passage,
    Strain,
    Waypoint,
    describe,
    midway,
    overload,
    pass_along,
    start_of,
    states_at,
    survey,
    utilisation,
)
from curveline.plan import DriveTable, NodeTarget, Plan, Step, drive_table
from curveline.rod.equilibrium import Equilibrium
from curveline.rod.problem import Array
from curveline.scene import PEAK, VALLEY, Display, Node, Scene
from curveline.units import deg, mm, to_deg, to_mm, to_nmm

Counts = tuple[int, int, int]

LEAST_PAST_FOLD = 0.15
"""The bias of step 2 must exceed the one at which the other state ceases to exist by this fraction."""

FUNNEL_ANGLES = tuple(deg(float(angle)) for angle in range(15, 65, 5))
FUNNEL_RATIOS = (2.45, 2.8, 3.2)
"""alpha sqrt(L / dL) after step 2; at sqrt(6) = 2.45 the rod lies in a circular arc, below 2 both states exist."""

AT_HOME = mm(0.05)
LEVEL_SLACK = deg(0.01)
FIRST_EXCESS = 5e-4
"""Following starts where the rod is this fraction longer than the span: straighter, play and stretch decide."""


@dataclass(frozen=True)
class Move:
    """A step before it is put in numbers for motors: where it ends and what was proven of it."""

    end: Waypoint
    states: str
    lowest_eigenvalue: float
    margin: float
    margin_of: str
    strain: Strain


@dataclass(frozen=True)
class Funnel:
    """Steps 1 and 2, the only state after them, and the smallest reserve: of motors, of the rod, past the fold."""

    moves: tuple[Move, Move]
    state: Equilibrium
    headroom: float


def make_plan(scene: Scene, start: tuple[Counts, ...] | None = None) -> Plan:
    """The steps from `start` (counts of every node; home if None) to the shape of `scene`.

    Raises Infeasible with the reason when no safe plan exists, InvalidInput for a display this version cannot plan.
    """
    display = scene.display
    _can_be_planned(scene)
    drive = drive_table(display)
    here = _waypoint_of(display, drive, start or ((0, 0, 0),) * display.node_count)
    _home_is_allowed(display)
    _goal_exists(scene)
    refusals: list[str] = []
    back = [_return(display, before, after) for before, after in _way_back(here)]
    for funnel in _funnels(scene, back[-1].end if back else here, refusals):
        try:
            moves = [*back, *funnel.moves, *_to_goal(scene, funnel)]
        except Infeasible as refusal:
            refusals.append(refusal.message)
            continue
        return _plan_of(scene, drive, here, moves)
    raise Infeasible(
        f"{scene.name}: no safe plan reaches the {scene.segments[0].state}: {_most_telling(refusals)}",
        "change length or angles, or plan a shape between this one and the last",
    )


def _can_be_planned(scene: Scene) -> None:
    """Raise InvalidInput for what this version, or the three motors of a node, cannot do."""
    if scene.display.node_count != 2 or scene.loads:
        what = "loads on the rod" if scene.loads else f"a display of {scene.display.node_count} nodes"
        raise InvalidInput(f"{scene.name}: planning with {what} is not possible in this version", "plan two free nodes")
    if scene.beyond_the_plane:
        raise InvalidInput(
            f"{scene.name}: no plan is possible with {' and '.join(scene.beyond_the_plane)}: "
            "the motors of a node work in the plane of an upright display",
            "`curveline simulate` shows where the rod goes; take this out to plan the shape",
        )


def _most_telling(refusals: list[str]) -> str:
    """The refusal of the funnel that came furthest: later steps are numbered higher."""
    if not refusals:
        return "the display's limits leave no room for a funnel"
    return max(refusals, key=lambda text: text[: len("step 1")])


def _home_is_allowed(display: Display) -> None:
    """Raise Infeasible unless the nodes may stand level and upright, where every plan passes."""
    if not (display.limits.height.contains(0.0) and display.limits.angle.contains(0.0)):
        raise Infeasible(
            f"display {display.name}: its limits leave out height 0 or angle 0, through which every plan passes",
            "count heights from where the nodes stand level, and angles from where the rod is horizontal",
        )


def _goal_exists(scene: Scene) -> None:
    """Raise Infeasible unless the wanted state exists, is stable with a margin and bends no tighter than allowed."""
    display, segment = scene.display, scene.segments[0]
    goal = Waypoint("goal", (scene.nodes[0], scene.nodes[1]), segment.length)
    states = states_at(display, goal)
    wanted = next((state for state in states if state.name == segment.state), None)
    if wanted is None:
        others = " and ".join(state.name for state in states) or "none that was found and a display can show"
        raise Infeasible(
            f"{scene.name}: segment 1 has no stable {segment.state} at {describe(goal)}; it has: {others}",
            f'ask for state = "{states[0].name}", or change length or angles' if states else "change length or angles",
        )
    passage = pass_along(display, goal, goal, start_of(wanted))
    reason = overload(display, passage.strain) if passage.reached == 1.0 else "it is too taut to be followed"
    if reason:
        raise Infeasible(
            f"{scene.name}: the {segment.state} itself: {reason}", "ask for a longer rod or smaller angles"
        )


def _waypoint_of(display: Display, drive: DriveTable, counts: tuple[Counts, ...]) -> Waypoint:
    """Where a display of two nodes stands, from its encoder counts."""
    feeds = [mm(drive.axes[0].value(node[0])) for node in counts]
    left, right = (Node(mm(drive.axes[2].value(node[2])), deg(drive.axes[1].value(node[1]))) for node in counts)
    return Waypoint("start", (left, right), display.span + feeds[0] - feeds[1])


def _funnels(scene: Scene, home: Waypoint, refusals: list[str]) -> list[Funnel]:
    """Funnels that work from `home`, the one with most headroom first; why the others do not goes to `refusals`."""
    display = scene.display
    funnels = []
    for angle in FUNNEL_ANGLES:
        for ratio in FUNNEL_RATIOS:
            length = display.span * (1.0 + (angle / ratio) ** 2)
            if display.limits.angle.contains(angle) and display.limits.length.contains(length):
                try:
                    funnels.append(_funnel(scene, home, angle, length))
                except Infeasible as refusal:
                    refusals.append(refusal.message)
    return sorted(funnels, key=lambda funnel: -funnel.headroom)


def _funnel(scene: Scene, home: Waypoint, angle: float, length: float) -> Funnel:
    """Steps 1 and 2 with bias `angle` at `length`; raises Infeasible where they fail."""
    display, wanted = scene.display, scene.segments[0].state
    tilt = angle if wanted == PEAK else -angle
    extruded = Waypoint("extrude", (Node(0.0, 0.0), Node(0.0, 0.0)), length)
    biased = Waypoint("bias", (Node(0.0, tilt), Node(0.0, -tilt)), length)
    first = _extrude(display, home, extruded)
    second, state = _bias(display, extruded, biased, wanted)
    use = utilisation(display, first.strain.worst(second.strain))
    return Funnel((first, second), state, min(1.0 - use, second.margin))


def _to_goal(scene: Scene, funnel: Funnel) -> list[Move]:
    """Steps 3 to 5, followed from the funnel's only state; raises Infeasible where one fails."""
    display, segment = scene.display, scene.segments[0]
    nodes = (scene.nodes[0], scene.nodes[1])
    level = (Node(0.0, nodes[0].angle), Node(0.0, nodes[1].angle))
    before = funnel.moves[1].end
    at = start_of(funnel.state)
    moves = []
    goals = (
        Waypoint("extrude", before.nodes, segment.length),
        Waypoint("bias", level, segment.length),
        Waypoint("translate", nodes, segment.length),
    )
    for number, after in enumerate(goals, start=3):
        passage = pass_along(display, before, after, at)
        moves.append(_followed(display, number, (before, after), passage, segment.state))
        before, at = after, (passage.angles, passage.forces)
    _arrives(scene, before, at[0])
    return moves


def _way_back(here: Waypoint) -> Iterator[tuple[Waypoint, Waypoint]]:
    """The moves that bring a display that is not at home to level, untilted nodes; none if it is there already."""
    heights = max(abs(node.height) for node in here.nodes)
    tilts = max(abs(node.angle) for node in here.nodes)
    level = Waypoint("level", (Node(0.0, here.nodes[0].angle), Node(0.0, here.nodes[1].angle)), here.length)
    if heights > AT_HOME:
        yield here, level
    if tilts > LEVEL_SLACK:
        yield level, Waypoint("neutral", (Node(0.0, 0.0), Node(0.0, 0.0)), here.length)


def _return(display: Display, before: Waypoint, after: Waypoint) -> Move:
    """A move on the way back, in whichever state the rod is: only what it asks of rod and motors counts."""
    strain = survey(display, before, after)
    reason = overload(display, strain)
    if reason:
        raise Infeasible(
            f"the way back ({after.action} at {describe(after)}): {reason}",
            "bring the nodes home by hand and start there",
        )
    return Move(after, _names(states_at(display, after)), 0.0, 1.0, "any state will do: a funnel follows", strain)


def _extrude(display: Display, before: Waypoint, after: Waypoint) -> Move:
    """Step 1: extrude, or draw in, to the funnel's length; the rod may be in any state."""
    shortest = display.span * (1.0 + FIRST_EXCESS)
    begin = before if before.length > shortest else Waypoint("start", after.nodes, shortest)
    strain = survey(display, begin, after)
    reason = overload(display, strain)
    if reason:
        raise Infeasible(f"step 1 ({after.action}): {reason}")
    states = states_at(display, after)
    lowest = min((state.lowest_eigenvalue for state in states), default=0.0)
    return Move(after, _names(states), lowest, lowest / STIFFEST, "stability; any state will do", strain)


def _bias(display: Display, before: Waypoint, after: Waypoint, wanted: str) -> tuple[Move, Equilibrium]:
    """Step 2: bias until only the wanted state exists, by `LEAST_PAST_FOLD` past the fold of every other one."""
    left = states_at(display, after)
    if [state.name for state in left] != [wanted]:
        raise Infeasible(f"step 2 (bias): at {describe(after)} not only the {wanted} exists")
    strain, gone = Strain(), 0.0
    for state in states_at(display, before):
        passage = pass_along(display, before, after, start_of(state))
        strain = strain.worst(passage.strain)
        if passage.reached < 1.0:
            gone = max(gone, passage.reached)
    margin = 1.0 / gone - 1.0 if gone > 0.0 else 1.0
    if margin < LEAST_PAST_FOLD:
        raise Infeasible(f"step 2 (bias): the other state ceases only {100 * margin:.0f} % before the end of the bias")
    strain = strain.worst(pass_along(display, after, after, start_of(left[0])).strain)
    reason = overload(display, strain)
    if reason:
        raise Infeasible(f"step 2 (bias): {reason}")
    other = VALLEY if wanted == PEAK else PEAK
    return Move(after, wanted, left[0].lowest_eigenvalue, margin, f"bias past the fold of the {other}", strain), left[0]


def _followed(display: Display, number: int, ends: tuple[Waypoint, Waypoint], passage: Passage, wanted: str) -> Move:
    """A step that keeps the wanted state; raises Infeasible where it would be lost or asks too much."""
    before, after = ends
    if passage.reached < 1.0:
        where = describe(midway(before, after, passage.reached))
        raise Infeasible(f"step {number} ({after.action}): the {wanted} loses its stability at {where}")
    margin = passage.lowest_eigenvalue / STIFFEST
    if margin < LEAST_STABILITY:
        raise Infeasible(f"step {number} ({after.action}): the {wanted} comes within {margin:.3f} of losing stability")
    reason = overload(display, passage.strain)
    if reason:
        raise Infeasible(f"step {number} ({after.action}): {reason}")
    return Move(after, wanted, passage.lowest_eigenvalue, margin, "stability", passage.strain)


def _arrives(scene: Scene, goal: Waypoint, angles: Array) -> None:
    """Raise Infeasible unless the followed state, given by its edges' `angles (n,)`, is the wanted one at the goal."""
    wanted = scene.segments[0].state
    for state in states_at(scene.display, goal):
        distance = abs(start_of(state)[0] - angles).max()
        if distance < 0.02:
            if state.name != wanted:
                raise Infeasible(f"step 5 (translate): the rod would end as the {state.name}")
            return
    raise Infeasible("step 5 (translate): the rod would end in a state that was not found at the goal")


def _names(states: list[Equilibrium]) -> str:
    """Alternatives joined by `|`."""
    return "|".join(state.name for state in states) or "none"


def _plan_of(scene: Scene, drive: DriveTable, here: Waypoint, moves: list[Move]) -> Plan:
    """Put proven moves in numbers for the motors."""
    display = scene.display
    start = _targets(display, drive, here)
    steps: list[Step] = []
    before = start
    for number, move in enumerate(moves, start=1):
        targets = _targets(display, drive, move.end)
        strain = move.strain.curvature * display.rod.thickness / 2.0
        steps.append(_step(number, move, targets, _seconds(drive, before, targets), strain))
        before = targets
    return Plan(
        name=scene.name,
        drive=drive,
        start=start,
        steps=tuple(steps),
        wanted=tuple(segment.state for segment in scene.segments),
        lengths_mm=tuple(to_mm(segment.length) for segment in scene.segments),
        provenance=_provenance(scene),
    )


def _targets(display: Display, drive: DriveTable, at: Waypoint) -> tuple[NodeTarget, ...]:
    """Node targets of a waypoint: each node feeds half of the rod beyond the span, the right one to the left."""
    feed = 0.5 * to_mm(at.length - display.span)
    targets = []
    for node, share in zip(at.nodes, (feed, 0.0 - feed), strict=True):
        values = (share, to_deg(node.angle), to_mm(node.height))
        counts = tuple(axis.counts(value) for axis, value in zip(drive.axes, values, strict=True))
        targets.append(NodeTarget(*values, counts=(counts[0], counts[1], counts[2])))
    return tuple(targets)


def _seconds(drive: DriveTable, before: tuple[NodeTarget, ...], after: tuple[NodeTarget, ...]) -> float:
    """Time of a step, to the millisecond: all axes of all nodes take as long as the slowest of them."""
    slowest = 0.0
    for old, new in zip(before, after, strict=True):
        ways = (new.extrude_mm - old.extrude_mm, new.bias_deg - old.bias_deg, new.translate_mm - old.translate_mm)
        slowest = max(slowest, *(axis.seconds(way) for axis, way in zip(drive.axes, ways, strict=True)))
    return math.ceil(1e3 * slowest) / 1e3


def _step(number: int, move: Move, targets: tuple[NodeTarget, ...], seconds: float, strain: float) -> Step:
    """One step in the units of the plan file."""
    return Step(
        number=number,
        action=move.end.action,
        seconds=seconds,
        targets=targets,
        lengths_mm=(to_mm(move.end.length),),
        states=(move.states,),
        lowest_eigenvalue=move.lowest_eigenvalue,
        margin=move.margin,
        margin_of=move.margin_of,
        max_strain=strain,
        max_force_N=move.strain.force,
        max_moment_Nmm=to_nmm(move.strain.moment),
    )


def _provenance(scene: Scene) -> dict[str, str]:
    """Where the plan comes from."""
    return {
        "curveline": __version__,
        "shape": scene.path,
        "shape_sha256": scene.digest,
        "display": scene.display.path or scene.display.name,
        "display_sha256": scene.display.digest,
    }
