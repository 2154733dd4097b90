"""From where a display stands into a shape: directly where states are known and kept, else through a funnel.

Paper, section V: extrude a little, bias to the wanted side, extrude to length, bias to the final angles, translate.
The first two steps are chosen such that after them only the wanted state exists, so that it does not matter which way
the rod buckled first, nor which shape the display showed before; from there the state is followed to the goal.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

from curveline.planning.funnels import Funnel, FunnelSearch, candidates, rounds_of
from curveline.planning.layout import (
    Layout,
    angles_of,
    centred,
    heights_of,
    home,
    layout_of,
    lengths_of,
    pose_of,
    posed,
)
from curveline.planning.moves import Leg, Travel, advance, check_limits, check_reach
from curveline.planning.routes import EXTRA, RECIPE, Way, overfed, travel_along, ways
from curveline.planning.verification import Refused, Verifier
from curveline.rod.states.slack import is_slack
from curveline.scene import STRAIGHT, Scene
from curveline.units import deg, mm

HOME = "home"
"""What stands in place of a shape's name where the display is brought home."""
AT_HOME = mm(0.05)
LEVEL_SLACK = deg(0.01)

PARKED = 0.12
"""Excess length, as a fraction of the span, with which segments wait in their states while others are in a funnel."""
TRIES = 12
FAILURES = 2
"""Funnels, and funnels from which no way led on, after which the goal is given up: mostly it fails from all."""


NO_ROOM = "the display's limits leave no room for a funnel"


@dataclass(frozen=True)
class Goal:
    """A shape as a layout and the wanted state of every segment."""

    name: str
    layout: Layout
    wanted: tuple[str, ...]

    @property
    def is_curved(self) -> bool:
        """True if any segment is to be other than straight."""
        return any(state != STRAIGHT for state in self.wanted)


def goal_of(scene: Scene) -> Goal:
    """What a scene asks for."""
    return Goal(scene.name, layout_of(scene), tuple(segment.state for segment in scene.segments))


def check_numbers(verifier: Verifier, goal: Goal, *, is_known: bool) -> None:
    """Refused for what the numbers of a shape alone tell, before any state is searched for.

    `is_known` says whether the states of all segments are, at the start; if not, the way leads through a funnel.
    """
    if not is_known and goal.is_curved and not candidates(verifier, len(goal.wanted)):
        raise Refused(NO_ROOM)
    check_reach(verifier, goal.layout)
    check_limits(verifier.display, goal.layout)


def travel_to(verifier: Verifier, travel: Travel, goal: Goal) -> Travel:
    """Go on to `goal`; Refused with the most telling reason where no way is safe.

    What a segment was in that is to be straight does not matter: without rod to spare it is straight, whatever it was.
    """
    travel = _released(travel, goal)
    known = zip(travel.stage.holds, goal.wanted, strict=True)
    if all(hold is not None or wanted == STRAIGHT for hold, wanted in known):
        try:
            return _directly(verifier, travel, goal)
        except Refused:
            pass
    if goal.is_curved:
        return _through_funnel(verifier, travel, goal)
    return _directly(verifier, _to_neutral(verifier, travel), goal)


def travel_home(verifier: Verifier, travel: Travel) -> Travel:
    """Bring the display home, whatever its rod does on the way."""
    return _named(travel_along(verifier, _to_neutral(verifier, travel), (("extrude", home(verifier.display)),)), HOME)


def _released(travel: Travel, goal: Goal) -> Travel:
    """The same display, whose segments that are to be straight need not keep their states."""
    free = frozenset(segment for segment, wanted in enumerate(goal.wanted) if wanted == STRAIGHT)
    return replace(travel, stage=replace(travel.stage, free=free))


def _direct_ways(verifier: Verifier, here: Layout, goal: Goal) -> Iterator[Way]:
    """The ways that do not lead through a funnel, all at once first."""
    yield (("move", goal.layout),)
    yield from _ways_out(verifier, here, goal)


def _ways_out(verifier: Verifier, here: Layout, goal: Goal) -> list[Way]:
    """The recipe, then whatever else may keep the states; first what takes in the rod last if segments are to be
    straight, since a rod that is straight lets no node move by itself."""
    recipe = tuple((action, goal.layout) for action in RECIPE)
    found = [recipe, *ways(verifier, here, goal.layout)]
    return sorted(found, key=lambda way: STRAIGHT in goal.wanted and way[-1][0] != "extrude")


def _directly(verifier: Verifier, travel: Travel, goal: Goal) -> Travel:
    """Go on to a goal on the first way on which states are kept; Refused, with the most telling reason, if none is.

    To a goal that is straight all along, on the first of them that no step has to be cut smaller for, if there is one.
    """
    refusals: list[Refused] = []
    found: list[Travel] = []
    for way in _direct_ways(verifier, travel.stage.layout, goal):
        try:
            found.append(_arrived(travel_along(verifier, travel, way), goal))
        except Refused as refusal:
            refusals.append(refusal)
            continue
        actions = [move.action for move in found[-1].moves[len(travel.moves) :]]
        if goal.is_curved or all(one != other or one == "extrude" for one, other in itertools.pairwise(actions)):
            return found[-1]
    if not found:
        raise max(refusals, key=lambda refusal: refusal.step)
    return min(found, key=lambda each: len(each.moves))


def _arrived(travel: Travel, goal: Goal) -> Travel:
    """The same moves with the shape's name at the last; Refused if they end in other states than the wanted ones."""
    last = travel.moves[-1]
    for segment, (state, wanted) in enumerate(zip(last.states, goal.wanted, strict=True), start=1):
        if state != wanted:
            raise Refused(f"segment {segment}: the rod would end as the {state}, not the {wanted}", segment)
    return _named(travel, goal.name)


def _named(travel: Travel, shape: str) -> Travel:
    """The same moves; the last one completes a shape."""
    return replace(travel, moves=(*travel.moves[:-1], replace(travel.moves[-1], shape=shape)))


def _through_funnel(verifier: Verifier, travel: Travel, goal: Goal) -> Travel:
    """Steps that do not depend on what the rod does now: level, neutral, then the recipe with its funnel."""
    travel = _to_neutral(verifier, travel)
    refusals: list[Refused] = []
    failures = 0
    funnels = FunnelSearch(verifier, goal.wanted)
    for funnel in itertools.islice(funnels, TRIES):
        try:
            inside = into_states(verifier, travel, goal, funnel)
        except Refused as refusal:
            refusals.append(refusal)
            continue
        try:
            return _out_to(verifier, inside, goal)
        except Refused as refusal:
            refusals.append(refusal)
            failures += 1
            if failures == FAILURES:
                break
    if funnels.is_empty():
        raise Refused(NO_ROOM)
    raise max((*funnels.refusals(), *refusals), key=lambda refusal: refusal.step)


def _to_neutral(verifier: Verifier, travel: Travel) -> Travel:
    """Bring a display to level, untilted nodes; states that are known may be lost on the way."""
    refusals = []
    for begin in _begins_back(verifier, Travel(travel.moves, replace(travel.stage, keeps=False))):
        for way in _ways_back(begin.stage.layout):
            free = begin
            try:
                for leg in way:
                    free = advance(verifier, free, leg)
            except Refused as refusal:
                refusals.append(refusal)
            else:
                return free
    raise Refused(
        f"the way back: {refusals[0].message}; bring the nodes home by hand and start there", step=refusals[0].step
    )


def _begins_back(verifier: Verifier, travel: Travel) -> Iterator[Travel]:
    """Where the way back begins: where the display stands, or where a straight rod has been given some to spare."""
    yield travel
    display, here = verifier.display, travel.stage.layout
    if all(is_slack(verifier.rod(pose_of(display, here, segment))) for segment in here.segments):
        return
    for extra in EXTRA:
        try:
            yield travel_along(verifier, travel, (("extrude", overfed(verifier, here, here, extra)),))
        except Refused:
            continue


def _ways_back(here: Layout) -> Iterator[tuple[Leg, ...]]:
    """Orders in which nodes become level and untilted."""
    zeros = (0.0,) * len(here.nodes)
    is_tilted = max(map(abs, angles_of(here))) > LEVEL_SLACK
    is_level = max(map(abs, heights_of(here))) <= AT_HOME
    level = () if is_level else (Leg("level", posed(here, angles_of(here), zeros)),)
    neutral = (Leg("neutral", posed(here, zeros, zeros)),) if is_tilted else ()
    yield (*level, *neutral)
    if not is_level and is_tilted:
        yield Leg("neutral", posed(here, zeros, heights_of(here))), Leg("level", posed(here, zeros, zeros))
        yield (Leg("swing", posed(here, zeros, zeros)),)


def into_states(verifier: Verifier, travel: Travel, goal: Goal, funnel: Funnel) -> Travel:
    """From level, untilted nodes into all wanted states, round by round.

    Refused before any step is proven if a node would feed more than it can tell.
    """
    here = travel.stage.layout
    fed = _fed_for_rounds(verifier, here, goal, funnel.length)
    for layout in fed:
        check_reach(verifier, layout)
    for members, layout in zip(rounds_of(goal.wanted), fed, strict=True):
        here = travel.stage.layout
        travel = travel_along(verifier, travel, (("extrude", Layout(here.nodes, layout.feeds)),))
        angles = funnel.angles(goal.wanted, members, angles_of(here))
        funnels = {segment: goal.wanted[segment] for segment in members}
        biased = posed(travel.stage.layout, angles, heights_of(here))
        travel = advance(verifier, travel, Leg("bias", biased, funnels))
    return travel


def check_funnels_reach(verifier: Verifier, goal: Goal) -> None:
    """Refused, by numbers alone, if no funnel into all wanted states is where every node can tell what it has fed."""
    refusals = []
    for length in sorted({length for _, length in candidates(verifier, len(goal.wanted))}):
        try:
            for layout in _fed_for_rounds(verifier, home(verifier.display), goal, length):
                check_reach(verifier, layout)
        except Refused as refusal:
            refusals.append(refusal)
        else:
            return
    if refusals:
        raise refusals[0]


def _fed_for_rounds(verifier: Verifier, here: Layout, goal: Goal, length: float) -> list[Layout]:
    """How far rod is fed before each round of a funnel of a `length` [m], while the nodes stay where they are."""
    display = verifier.display
    final = lengths_of(display, goal.layout)
    lengths = [length] * len(final)
    fed = []
    for members in rounds_of(goal.wanted):
        fed.append(centred(display, here.nodes, lengths))
        for segment in members:
            parked = min((1.0 + PARKED) * display.span, display.limits.length.high)
            lengths[segment] = max(parked, final[segment])
    return fed


def _out_to(verifier: Verifier, inside: Travel, goal: Goal) -> Travel:
    """From the funnel to the goal: the recipe, or whatever else keeps the states."""
    first: Refused | None = None
    for way in _ways_out(verifier, inside.stage.layout, goal):
        try:
            return _arrived(travel_along(verifier, inside, way), goal)
        except Refused as refusal:
            first = first or refusal
    assert first is not None
    raise first
