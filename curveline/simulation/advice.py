"""Of a segment that has not the state its shape wants: the nearest number with which it has, tried as it is printed.

The search has two sieves. The coarse one looks only at planar states; the fine one is the model that was asked for, and
may cost a second in space, so that few see it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from curveline.material.history import Dwell, duration_text, history_text, parse_duration
from curveline.rod.models.choice import SearchRequest
from curveline.rod.models.showable import showable_states
from curveline.rod.states.slack import is_straight
from curveline.scene import STRAIGHT, Scene
from curveline.simulation.changes import ANGLE, HEIGHT, LENGTH, Counted, Hunt, Quantity, part_of, single_rays
from curveline.simulation.dwelling import HOME, at_home_first
from curveline.simulation.simulate import SegmentStates, scene_rod, simulate
from curveline.units import WEEK

LOOKS = 120
"""Values that the coarse sieve sees: some tenths of a second."""
TRIES = 3
"""Values that the model sees."""
WAITS = (1.0, 10.0 * WEEK)
"""The shortest and the longest time at home that is advised [s]."""
CLOSE = 1.05
"""How exactly it is sought."""


def advice_on(scene: Scene, found: tuple[SegmentStates, ...], ask: SearchRequest) -> tuple[str, ...]:
    """For every segment without its wanted state, a sentence on the smallest change with which it has, if any."""
    # Which lengths are straight is said already.
    names = enumerate(segment.wanted_name if segment.wanted is None else STRAIGHT for segment in found)
    missing = [index for index, name in names if name != STRAIGHT]
    sentences = ((index, _nearest(_AdviceSearch(scene, index, ask))) for index in missing)
    return tuple(f"segment {index + 1}: {sentence}" for index, sentence in sentences if sentence)


def advice_to_wait(scene: Scene, found: tuple[SegmentStates, ...], ask: SearchRequest) -> tuple[str, ...]:
    """Of a shape that lacks a state after what its rod went through: how long at home let it have that, if any does."""
    if scene.past is None or all(segment.wanted is not None for segment in found):
        return ()

    def is_there(seconds: float) -> bool:
        return all(each.wanted for each in simulate(at_home_first(scene, seconds), ask.tolerance, model=ask.model))

    low, high = WAITS
    if not is_there(high):
        return ()
    while high > CLOSE * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if is_there(middle) else (middle, high)
    seconds = parse_duration(duration_text(high, rounded=True))
    if not is_there(seconds):
        return ()
    waited = history_text((*scene.past.history, Dwell(HOME, seconds)))
    least = f"it takes {duration_text(seconds)} at home, at the least, until all that is wanted is there"
    return (f"{least}: --after {waited}",)


def _nearest(search: _AdviceSearch) -> str:
    """The smallest change of one number, in words; empty if none was found.

    None is sought where only the model denies the state, and the plane, in which values are sought, has it.
    """
    if search.may_work(search.scene):
        return ""
    hunt = Hunt(single_rays(search.scene, search.quantities), Counted(search.may_work, LOOKS))
    for _ in range(TRIES):
        if (found := hunt.next()) is None:
            break
        ray, change = found
        if search.works(ray.at(change)):
            (only,) = ray.changes(change)
            return f"with {only.quantity} of {only} it has a {search.scene.segments[search.index].state}"
    return ""


@dataclass(frozen=True)
class _AdviceSearch:
    """Whether a changed scene has what a segment lacks, and keeps what its neighbours have."""

    scene: Scene
    index: int
    ask: SearchRequest

    @property
    def quantities(self) -> Iterator[Quantity]:
        """The numbers of the segment and its nodes."""
        yield Quantity(LENGTH, self.index)
        for kind in (ANGLE, HEIGHT):
            yield from (Quantity(kind, node) for node in (self.index, self.index + 1))

    def may_work(self, scene: Scene) -> bool:
        """True if the wanted states are there in the plane, and loads and rod are within the rules of a file."""
        return _fits(scene) and all(self._has_planar(scene, segment) for segment in self._concerned)

    def works(self, scene: Scene) -> bool:
        """True if the wanted states are there by the model that was asked for."""
        parts = (part_of(scene, range(segment, segment + 1)) for segment in self._concerned)
        return all(simulate(part, self.ask.tolerance, model=self.ask.model)[0].wanted is not None for part in parts)

    @cached_property
    def _concerned(self) -> tuple[int, ...]:
        """The segment, and those beside it that have what they should."""
        beside = (each for each in (self.index - 1, self.index + 1) if 0 <= each < len(self.scene.segments))
        return self.index, *(each for each in beside if self._has_planar(self.scene, each))

    def _has_planar(self, scene: Scene, segment: int) -> bool:
        rod = scene_rod(scene, segment)
        if scene.segments[segment].state == STRAIGHT:
            return is_straight(rod)
        found = showable_states(rod, self.ask.tolerance)
        shown = found.planar if scene.beyond_the_plane else found.states
        return any(state.name == scene.segments[segment].state for state in shown)


def _fits(scene: Scene) -> bool:
    """True if loads act on free rod, and there is enough of it."""
    half = 0.5 * scene.display.clamp
    lengths = [segment.length for segment in scene.segments]
    are_free = (half < load.at * lengths[load.segment] < lengths[load.segment] - half for load in scene.loads)
    return sum(lengths) <= scene.display.rod.total_length and all(are_free)
