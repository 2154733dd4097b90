"""Whether a shape can be shown at all, before any way to it is sought."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from curveline.errors import Infeasible, InvalidInput
from curveline.planning.actuator_loads import (
    ActuatorLoad,
    ClampLoads,
    actuator_load_of,
    clamp_loads_of,
    clamp_loads_of_state,
    culprit,
    overload,
)
from curveline.planning.layout import describe, layout_of, pose_of
from curveline.planning.moves import Travel
from curveline.planning.verification import OUT_OF_PLANE, STABILITY, Refused, Verifier, too_near
from curveline.rod.branches.continuation import FOLLOW_EDGES, STIFFEST, follow, start_along, stiffness_of
from curveline.rod.branches.control_path import loading
from curveline.rod.branches.special_points import SpecialKind, critical
from curveline.rod.models.choice import AUTO, SearchRequest, model_states
from curveline.rod.models.model_error import lateral
from curveline.rod.models.no_state_reason import why_not
from curveline.rod.problem import Pose
from curveline.rod.states.equilibrium import Equilibrium
from curveline.rod.states.slack import is_slack, is_straight, least_slack
from curveline.scene import STRAIGHT, Display, Scene
from curveline.simulation.simulate import DEFAULT_TOLERANCE, scene_rod
from curveline.units import rounded_up, to_mm

RESERVE = 1.25
"""What a state must withstand over its loads: these are at most four fifths of what snaps it through."""
DIGITS = 6
"""Of a length that is advised."""
LOADED_EDGES = 4 * FOLLOW_EDGES
"""Edges of a state under loads, where it bends sharply."""


def check_home(scene: Scene) -> None:
    """Raise InvalidInput for what no motor of a node can do, Infeasible where plans have nowhere to begin."""
    display = scene.display
    if scene.beyond_the_plane:
        raise InvalidInput(
            f"{scene.name}: no plan is possible with {' and '.join(scene.beyond_the_plane)}: "
            "the motors of a node work in the plane of an upright display",
            "`curveline simulate` shows where the rod goes; take this out to plan the shape",
        )
    if not (display.limits.height.contains(0.0) and display.limits.angle.contains(0.0)):
        raise Infeasible(
            f"display {display.name}: its limits leave out height 0 or angle 0, through which every plan passes",
            "count heights from where the nodes stand level, and angles from where the rod is horizontal",
        )


@dataclass(frozen=True)
class Burden:
    """What is known of a shape only as it stands: the lowest eigenvalue [EI/L^2] and the margin, under its loads and of
    what is straight, and the most that either asks of rod and motors."""

    lowest: float
    margin: float
    margin_of: str
    load: ActuatorLoad


def check_goal(verifier: Verifier, scene: Scene) -> Burden | None:
    """Raise Refused unless every wanted state exists, is stable with a margin and asks no more than there is.

    With its loads and without them; returns what they come to, or what is straight does, None if there is neither.
    """
    check_spare(verifier, scene)
    states = [_wanted(verifier, scene, *each) for each in enumerate(_poses(scene), start=1)]
    segment_loads = tuple(map(clamp_loads_of_state, states))
    _check_loads(scene.display, segment_loads, "the shape itself")
    if scene.loads:
        return _burden(verifier, scene, states)
    straight = [state.lowest_eigenvalue for state in states if state.name == STRAIGHT]
    if not straight:
        return None
    return Burden(min(straight), min(straight) / STIFFEST, STABILITY, actuator_load_of(segment_loads))


def _check_loads(display: Display, segment_loads: tuple[ClampLoads, ...], what: str) -> None:
    """Refused, saying of what, where rod or motors do not give what the segments of a row ask."""
    if reason := overload(display, segment_loads):
        raise Refused(f"{what}: {reason}", **culprit(display, segment_loads)._asdict())


def laden(travel: Travel, burden: Burden | None) -> Travel:
    """The same moves, the last of which counts what the shape bears once it stands."""
    if burden is None:
        return travel
    last = travel.moves[-1]
    moved = replace(last, load=last.load.joined(burden.load))
    if burden.margin < last.margin:
        moved = replace(moved, lowest_eigenvalue=burden.lowest, margin=burden.margin, margin_of=burden.margin_of)
    return replace(travel, moves=(*travel.moves[:-1], moved))


def check_spare(verifier: Verifier, scene: Scene) -> None:
    """Refused if a curved segment has no rod to spare, or a straight one has: the numbers alone tell that."""
    for number, (segment, pose) in enumerate(zip(scene.segments, _poses(scene), strict=True), start=1):
        rod = verifier.rod(pose)
        if segment.state == STRAIGHT:
            if not is_straight(rod):
                raise Refused(f"segment {number} is not straight at {describe(pose)}: {why_not(rod, STRAIGHT)}", number)
        elif is_straight(rod):
            raise _is_straight(verifier, number, segment.state, pose)
        elif not is_slack(rod):
            raise _missing(scene, number, pose, ())


def _is_straight(verifier: Verifier, number: int, wanted: str, pose: Pose) -> Refused:
    """That a segment, counted from 1, has not the rod to spare that a wanted curve takes."""
    rod, where = verifier.rod(pose), describe(pose)
    if verifier.straight(pose) is not None:
        return Refused(f"segment {number} has no {wanted} at {where}, it is straight: {why_not(rod, wanted)}", number)
    told = f"segment {number} has so little rod to spare at {where} that play decides whether it is the {wanted}"
    return Refused(f"{told}: give it more than {rounded_up(to_mm(least_slack(rod)), DIGITS):g} mm", number)


def _poses(scene: Scene) -> list[Pose]:
    """What the nodes impose on each segment."""
    layout = layout_of(scene)
    return [pose_of(scene.display, layout, segment) for segment in layout.segments]


def _wanted(verifier: Verifier, scene: Scene, number: int, pose: Pose) -> Equilibrium:
    """The wanted state of a segment, counted from 1, at its pose; Refused if the display cannot show it."""
    wanted, found = scene.segments[number - 1].state, verifier.showable(pose)
    if wanted == STRAIGHT:
        return _straight(verifier, number, pose)
    for state, outside in zip(found.states, found.outside, strict=True):
        if state.name == wanted:
            if reason := too_near(state.lowest_eigenvalue, outside):
                raise Refused(f"segment {number}, the {wanted} itself, comes within {reason}", number)
            return state
    if any(state.name == wanted for state in found.leaving):
        text = f"segment {number}: the {wanted} at {describe(pose)} would leave the plane"
        raise Refused(text, number)
    raise _missing(scene, number, pose, found.states)


def _straight(verifier: Verifier, number: int, pose: Pose) -> Equilibrium:
    """The state of a segment, counted from 1, that is to be straight; Refused if it need not be or stay so."""
    state = verifier.straight(pose)
    if state is None:
        why = why_not(verifier.rod(pose), STRAIGHT)
        raise Refused(f"segment {number} need not be straight at {describe(pose)}: {why}", number)
    if reason := too_near(state.lowest_eigenvalue, lateral(state).eigenvalue if state.space is None else STIFFEST):
        raise Refused(f"segment {number}, straight, comes within {reason}", number)
    return state


def _missing(scene: Scene, number: int, pose: Pose, states: Sequence[Equilibrium]) -> Refused:
    """That a segment, counted from 1, has not the wanted state among its `states` at a pose."""
    others = " and ".join(state.name for state in states) or "none that was found and a display can show"
    wanted = scene.segments[number - 1].state
    return Refused(f"segment {number} has no stable {wanted} at {describe(pose)}; it has: {others}", number)


def _burden(verifier: Verifier, scene: Scene, states: Sequence[Equilibrium]) -> Burden:
    """What the loads of a shape come to; Refused where a state or a motor does not withstand them with a reserve."""
    loaded = [_loaded(verifier, scene, number, state) for number, state in enumerate(states, start=1)]
    segment_loads = tuple(
        clamp_loads_of_state(state).joined(each.clamp_loads) for state, each in zip(states, loaded, strict=True)
    )
    _check_loads(scene.display, segment_loads, "under its loads")
    lowest, margin_of = min(each.lowest for each in loaded)
    return Burden(lowest, lowest / STIFFEST, f"{margin_of} under the loads", actuator_load_of(segment_loads))


class _Loaded(NamedTuple):
    """A state that its loads are put on: its lowest eigenvalue and of what that is the margin, and what it asks."""

    lowest: tuple[float, str]
    clamp_loads: ClampLoads


def _loaded(verifier: Verifier, scene: Scene, number: int, state: Equilibrium) -> _Loaded:
    """A state of a segment, counted from 1, while its loads are put on; Refused if they are too much for it."""
    if state.name == STRAIGHT:
        return _loaded_straight(scene, number, state)
    at, forces = scene_rod(scene, number - 1).dead_loads()
    if not at.size:
        return _Loaded((state.lowest_eigenvalue, STABILITY), ClampLoads())
    way = loading(state.rod.pose, at, 0.0 * forces, forces)
    far = loading(state.rod.pose, at, 0.0 * forces, RESERVE * forces)
    snap = critical(far, state.rod.bearing.held_in_plane(), *start_along(far, state))
    if snap.kind is not SpecialKind.NONE:
        share = 100.0 * RESERVE * (snap.fraction if snap.kind is not SpecialKind.LOST else snap.reached)
        text = f"segment {number}: the {state.name} snaps at {share:.0f} % of its loads; it must withstand"
        raise Refused(f"{text} {100.0 * RESERVE:.0f} %", number)
    branch = follow(way, verifier.bearing, *start_along(way, state, LOADED_EDGES))
    if branch.reached < 1.0:
        text = (
            f"segment {number}: the {state.name} would leave the plane at {100.0 * branch.reached:.0f} % of its loads"
        )
        raise Refused(text, number)
    inside, outside = stiffness_of(way, verifier.bearing, branch)
    lowest = min((inside, STABILITY), (outside, OUT_OF_PLANE))
    if reason := too_near(inside, outside):
        raise Refused(f"segment {number}: under its loads the {state.name} comes within {reason}", number)
    return _Loaded(lowest, clamp_loads_of(branch))


def _loaded_straight(scene: Scene, number: int, state: Equilibrium) -> _Loaded:
    """A straight segment, counted from 1, under its loads; Refused if with a reserve they let it lie on either side.

    Its state is not followed: there is but one.
    """
    rod = scene_rod(scene, number - 1)
    found = [state]
    for share in (1.0, RESERVE) if rod.loads else ():
        loads = tuple(load._replace(x=share * load.x, y=share * load.y) for load in rod.loads)
        under = model_states(replace(rod, loads=loads), SearchRequest(DEFAULT_TOLERANCE, (0,), AUTO)).states
        if [each.name for each in under if each.simple] != [STRAIGHT]:
            text = f"segment {number}: under {100.0 * share:.0f} % of its loads the rod is not sure to stay straight"
            raise Refused(text, number)
        found += under
    lowest = min((each.lowest_eigenvalue, STABILITY) for each in found)
    return _Loaded(lowest, clamp_loads_of_state(found[min(1, len(found) - 1)]))
