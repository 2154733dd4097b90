"""From a scene, or several, to the steps that reach it: each proven before a motor turns.

layout          where a whole display stands; what a segment meets while its nodes are anywhere between two layouts
actuator_loads  what the rod asks of the motors of a node
verification    one segment in one step: followed in every mixture of uneven progress
moves           one step of all segments, cut smaller where it is not safe
feeding         the order in which nodes feed rod through a row of segments
glances         what becomes of the rod in a funnel, roughly
funnels         where only the wanted state exists
routes          ways on which a state is kept
sequence        from where a display stands into a shape
targets         layouts in the numbers of motors
set_first       what to do before a shape that a rod with a set does not hold
reproof         a plan proven once more for a rod that is not as it was
advice          the nearest boundary condition that would work
reachability    whether any shape can be planned from home
remedies        with which number of the display one could
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from curveline.drive_settings import drive_settings
from curveline.errors import Infeasible, InvalidInput
from curveline.plan_file import Plan
from curveline.planning.advice import nearest
from curveline.planning.feasibility import check_goal, check_home, check_spare, laden
from curveline.planning.layout import home, layout_of, pose_of
from curveline.planning.moves import DisplayState, Travel
from curveline.planning.plan_writer import Trip, plan_of
from curveline.planning.reachability import entry_to
from curveline.planning.sequence import check_numbers, goal_of, travel_home, travel_to
from curveline.planning.set_first import advice_first
from curveline.planning.targets import Counts, layout_at, targets_of
from curveline.planning.verification import Refused, Verifier
from curveline.rod.branches.tracking import tracked
from curveline.scene import STRAIGHT, Display, Scene

OTHERWISE = "change length or angles, or plan a shape between this one and the last"

SHUT = "from home no {kind} can be planned on this display: `curveline display check {display}` says what to change"

LONE_TRIES, ROW_TRIES, WAY_TRIES = 3, 4, 1
"""Changed shapes that are planned in full before none is advised: of one segment, of a row, and of a row that exists
but to which no way is safe, which has mostly taken seconds already."""
ADVICE_STEPS = 150
"""Steps that are tried to plan one of them: of plans of five nodes that succeed nine in ten take fewer, while one that
fails takes 300 to 1200."""

Start = Sequence[Counts] | None
"""Encoder counts of every node; home if None."""
Tell = Callable[[], None]
"""Called whenever a step has been proven."""


def _nobody() -> None:
    pass


def make_plan(scene: Scene, start: Start = None, shows: Sequence[str] = (), tell: Tell = _nobody) -> Plan:
    """The steps from `start` to the shape of `scene`.

    `shows` names the state that every segment is known to be in, empty where it is not. Raises Infeasible with the
    reason when no safe plan exists, InvalidInput for a scene that no motors can make.
    """
    return make_tour([scene], start, shows, tell)


def make_tour(scenes: Sequence[Scene], start: Start = None, shows: Sequence[str] = (), tell: Tell = _nobody) -> Plan:
    """One plan through several shapes of one display, from one to the next without a detour where that is safe.

    As `make_plan`, and InvalidInput if the shapes are not of one display.
    """
    scenes = _as_told(scenes)
    verifier = Verifier(scenes[0].display, tell)
    _check_numbers(verifier, scenes, start, shows)
    begin = _begin(verifier, start, shows)
    travel = _through(verifier, begin, scenes)
    wanted = tuple(segment.state for segment in scenes[-1].segments)
    return plan_of(verifier, begin.stage, travel.moves, Trip(tuple(scenes), verifier.display, wanted))


def make_round_trip(
    scenes: Sequence[Scene], start: Start = None, shows: Sequence[str] = (), tell: Tell = _nobody
) -> Plan:
    """As `make_tour`, and home after the last shape."""
    scenes = _as_told(scenes)
    verifier = Verifier(scenes[0].display, tell)
    _check_numbers(verifier, scenes, start, shows)
    begin = _begin(verifier, start, shows)
    travel = travel_home(verifier, _through(verifier, begin, scenes))
    return plan_of(verifier, begin.stage, travel.moves, _home(verifier.display, tuple(scenes)))


def make_home_plan(display: Display, start: Start, shows: Sequence[str] = (), tell: Tell = _nobody) -> Plan:
    """The steps that bring a display from `start` home: nodes level and upright, the rod straight."""
    verifier = Verifier(display, tell)
    begin = _begin(verifier, start, shows)
    travel = travel_home(verifier, begin)
    return plan_of(verifier, begin.stage, travel.moves, _home(display, ()))


def start_at(scene: Scene) -> tuple[tuple[Counts, ...], tuple[str, ...]]:
    """The encoder counts, and the states, of a display that shows `scene`."""
    targets = targets_of(drive_settings(scene.display), layout_of(scene))
    return tuple(target.counts for target in targets), tuple(segment.state for segment in scene.segments)


def _as_told(scenes: Sequence[Scene]) -> list[Scene]:
    """The scenes on displays whose motors are where they are told: margins allow for tenths of a degree."""
    return [replace(scene, display=scene.display.as_told) for scene in scenes]


def _home(display: Display, scenes: tuple[Scene, ...]) -> Trip:
    return Trip(scenes, display, (STRAIGHT,) * (display.node_count - 1), ends_home=True)


def _check_numbers(verifier: Verifier, scenes: Sequence[Scene], start: Start, shows: Sequence[str]) -> None:
    """Raise for what the numbers of some shapes alone tell, before any state is searched for."""
    display = verifier.display
    for scene in scenes:
        check_home(scene)
        if scene.display.digest != display.digest or scene.display.node_count != display.node_count:
            hint = "plan the shapes of each display for themselves"
            raise InvalidInput(f"{scene.name} is for display {scene.display.name}, not {display.name}", hint)
    is_known = start is not None and len(shows) == display.node_count - 1 and all(shows)
    for scene in scenes:
        try:
            check_spare(verifier, scene)
            check_numbers(verifier, goal_of(scene), is_known=is_known)
        except Refused as refusal:
            raise _refusal(verifier, _begin(verifier, start, shows), scene, refusal) from None
        is_known = True


def _through(verifier: Verifier, travel: Travel, scenes: Sequence[Scene]) -> Travel:
    """Go on through several shapes."""
    for scene in scenes:
        try:
            travel = _into(verifier, travel, scene)
        except Refused as refusal:
            raise _refusal(verifier, travel, scene, refusal) from None
    return travel


def _into(verifier: Verifier, travel: Travel, scene: Scene) -> Travel:
    """Go on to one shape; Refused where that is not possible."""
    goal = goal_of(scene)
    check_numbers(verifier, goal, is_known=all(hold is not None for hold in travel.stage.holds))
    burden = check_goal(verifier, scene)
    return laden(travel_to(verifier, travel, goal), burden)


def _begin(verifier: Verifier, start: Start, shows: Sequence[str]) -> Travel:
    """Where the display stands, and the states of its segments as far as they are known."""
    display = verifier.display
    layout = home(display) if start is None else layout_at(verifier.drive, start)
    holds = []
    for segment in layout.segments:
        known = shows[segment] if segment < len(shows) else ""
        found = verifier.showable(pose_of(display, layout, segment)).called(known) if known else None
        holds.append(tracked(found) if found is not None else None)
    return Travel((), DisplayState(layout, tuple(holds)))


def _refusal(verifier: Verifier, travel: Travel, scene: Scene, refusal: Refused) -> Infeasible:
    """What a user reads when no way to a shape is safe: why, and the nearest shape to which there is one."""

    def works(other: Scene) -> str:
        try:
            _into(verifier.like(verifier.display, ADVICE_STEPS), travel, other)
        except Infeasible as error:
            return error.message
        return ""

    wanted = ", ".join(dict.fromkeys(segment.state for segment in scene.segments))
    way = f"no safe plan reaches the {wanted}: " if refusal.step else ""
    message = f"{scene.name}: {way}{refusal.message}"
    if first := advice_first(scene, _can_be_planned):
        return Infeasible(message, first)
    if not (entry := entry_to(verifier, scene)).is_open:
        return Infeasible(message, SHUT.format(kind=entry.kind, display=verifier.display.path or verifier.display.name))
    advice = nearest(scene, _culprits(scene, refusal), works, _tries(scene, refusal))
    return Infeasible(message, OTHERWISE if advice is None else advice.sentence)


def _can_be_planned(scene: Scene) -> bool:
    """True if a way from home to a shape is found soon."""
    verifier = Verifier(scene.display, _nobody)
    try:
        _into(verifier.like(scene.display, ADVICE_STEPS), _begin(verifier, None, ()), scene)
    except Infeasible:
        return False
    return True


def _tries(scene: Scene, refusal: Refused) -> int:
    if len(scene.segments) == 1:
        return LONE_TRIES
    return WAY_TRIES if refusal.step else ROW_TRIES


def _culprits(scene: Scene, refusal: Refused) -> range:
    """The segments, from 0, whose numbers may be at fault: those that share a node, or all where nothing tells."""
    count = len(scene.segments)
    if refusal.segment:
        return range(refusal.segment - 1, refusal.segment)
    return range(max(refusal.node - 2, 0), min(refusal.node, count)) if refusal.node else range(count)
