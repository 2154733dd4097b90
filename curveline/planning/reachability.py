"""Whether any plan leads from home into a state, and if none does, why.

At home the rod is straight and nothing tells which way it will buckle, so that every plan begins with a funnel. If none
can be entered, no shape can be planned, whatever its lengths and angles; if one can, where it ends is a shape.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

from curveline.errors import CurvelineError
from curveline.planning.feasibility import check_goal, check_home
from curveline.planning.funnels import Funnel, FunnelSearch
from curveline.planning.layout import Layout, centred, home, lengths_of
from curveline.planning.moves import DisplayState, Travel
from curveline.planning.sequence import (
    PARKED,
    TRIES,
    Goal,
    check_funnels_reach,
    goal_of,
    into_states,
    travel_to,
)
from curveline.planning.verification import Refused, Verifier
from curveline.scene import PEAK, STRAIGHT, VALLEY, Display, Scene, Segment

EXCESSES = (PARKED, 0.3, 0.6)
"""Excess lengths of a row's segments, as fractions of the span, that are tried one after the other."""
BEST = 3
"""Funnels that are tried with more rod in the other segments than they need to wait in their states."""


@dataclass(frozen=True)
class Access:
    """What is called `kind`, segments in the `wanted` states, seen from home; `reason` says why no plan leads there."""

    kind: str
    wanted: tuple[str, ...]
    reason: str = ""

    @property
    def is_open(self) -> bool:
        """True if a plan leads there."""
        return not self.reason


def entries_of(verifier: Verifier) -> tuple[Access, ...]:
    """All peaks, all valleys, and in a row both in turn."""
    return tuple(Access(kind, wanted, _why_shut(verifier, wanted)) for kind, wanted in _kinds(verifier.display))


def entry_to(verifier: Verifier, scene: Scene) -> Access:
    """The entry to all that has the states of `scene`; it is shut only if that to its own order of states is, too.

    Straight segments are entered from home as they are, and do not count.
    """
    own = tuple(segment.state for segment in scene.segments)
    curved = {state for state in own if state != STRAIGHT}
    if not curved:
        return Access(STRAIGHT, own)
    kind, wanted = next(each for each in _kinds(verifier.display) if set(each[1]) == curved)
    reason = _out_of_reach(verifier, wanted) or _why_shut(verifier, wanted)
    if reason and own != wanted:
        reason = _out_of_reach(verifier, own) or _why_shut(verifier, own)
    return Access(kind, wanted, reason)


def nearest_shape(verifier: Verifier, wanted: tuple[str, ...], funnels: int = TRIES) -> Scene:
    """A shape with the `wanted` states to which a plan leads from home by way of one of the best `funnels`.

    Refused, with the reason, if there is none.
    """
    begin = Travel((), DisplayState(home(verifier.display), (None,) * len(wanted)))
    refusals: list[Refused] = []
    search = FunnelSearch(verifier, wanted)
    for goal, funnel in _tries(verifier, wanted, search, funnels):
        try:
            inside = into_states(verifier, begin, goal, funnel)
        except Refused as refusal:
            refusals.append(refusal)
            continue
        scene = _scene_of(verifier.display, inside.stage.layout, wanted)
        try:
            check_goal(verifier, scene)
            travel_to(verifier, begin, goal_of(scene))
        except Refused as refusal:
            refusals.append(refusal)
        else:
            return scene
    # Why there is no funnel is told only where there is none.
    refusals = refusals or search.refusals()
    raise max(refusals, key=lambda refusal: refusal.step, default=Refused("the limits leave no room for a funnel"))


def _kinds(display: Display) -> Iterator[tuple[str, tuple[str, ...]]]:
    """What rows of one and of both states are called, and the states."""
    count = display.node_count - 1
    row = "row of {}s" if count > 1 else "{}"
    for state in (PEAK, VALLEY):
        yield row.format(state), (state,) * count
    if count > 1:
        yield "row of valleys and peaks", tuple(itertools.islice(itertools.cycle((VALLEY, PEAK)), count))


def _why_shut(verifier: Verifier, wanted: tuple[str, ...]) -> str:
    """Why no plan leads from home into the `wanted` states; empty if one does."""
    try:
        nearest_shape(verifier, wanted)
    except Refused as refusal:
        return refusal.message
    return ""


def _out_of_reach(verifier: Verifier, wanted: tuple[str, ...]) -> str:
    """Why, by numbers alone, no plan leads from home into the `wanted` states; empty if they do not tell."""
    try:
        check_funnels_reach(verifier, next(_goals(verifier, wanted)))
    except Refused as refusal:
        return refusal.message
    return ""


def _goals(verifier: Verifier, wanted: tuple[str, ...]) -> Iterator[Goal]:
    """Goals of which the lengths count, the shortest first."""
    display = verifier.display
    for excess in EXCESSES if len(wanted) > 1 else EXCESSES[:1]:
        length = min((1.0 + excess) * display.span, display.limits.length.high)
        lengths = [display.span if state == STRAIGHT else length for state in wanted]
        yield Goal("", centred(display, home(display).nodes, lengths), wanted)


def _tries(
    verifier: Verifier, wanted: tuple[str, ...], search: FunnelSearch, count: int
) -> Iterator[tuple[Goal, Funnel]]:
    """Goals, each with one of the best `count` funnels, of which few are tried with longer ones."""
    funnels: list[Funnel] = []
    first, *longer = _goals(verifier, wanted)
    for funnel in itertools.islice(search, count):
        funnels.append(funnel)
        yield first, funnel
    yield from itertools.product(longer, funnels[:BEST])


def _scene_of(display: Display, layout: Layout, wanted: tuple[str, ...]) -> Scene:
    segments = zip(lengths_of(display, layout), wanted, strict=True)
    return Scene("", display, layout.nodes, tuple(Segment(length, state) for length, state in segments))


def has_home(display: Display) -> bool:
    """True if plans have a place to begin, and motors a plane to work in."""
    layout = home(display)
    try:
        check_home(_scene_of(display, layout, (PEAK,) * (display.node_count - 1)))
    except CurvelineError:
        return False
    return True
