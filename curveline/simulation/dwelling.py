"""A shape after others: its rod with the set that a history leaves, the shapes of the history followed as it grows.

While a rod dwells in a shape its set grows, and under weight or loads, or after other shapes, its curve gives way to
it. A dwell is gone through in steps that are longer and longer, in each of which the bend goes evenly from that at its
begin to that at its end; the number of steps is doubled until the set does not change.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NoReturn

import numpy as np
import numpy.typing as npt

from curveline.errors import Infeasible, InvalidInput
from curveline.material.history import Dwell, duration_text, parse_history
from curveline.material.memory import RodMemory
from curveline.material.past import Past
from curveline.material.relaxation import power_law
from curveline.rod.geometry.vertex_table import CURVATURE
from curveline.rod.natural_curvature import NaturalCurvature, curvatures_at
from curveline.rod.states.equilibrium import SPATIAL, Equilibrium
from curveline.scene import Display, Profile, Scene
from curveline.simulation.simulate import simulate
from curveline.units import mm

Array = npt.NDArray[np.float64]

HOME = "home"
"""What stands for the straight rod in a history."""
FIRST_STEP = 1.0
"""Of a dwell, [s] at the reference temperature: the fastest term of a law takes as long."""
FEWEST, MOST = 1, 8
"""Steps in a decade of time."""
TOLERANCE = mm(0.01)
"""Of the curves that are followed."""
CLOSE = 1e-3
"""Part of the largest set to which steps are to agree with half as many."""
LOOKS = np.linspace(0.0, 1.0, 25)
"""Where along a segment curves are compared, as parts of its vertices."""
APART = 1e-9
"""Part of the rod by which two places differ."""
JUMP = 0.5
"""Angle [rad] by which no curve gives way within a step, unless the rod snaps."""

Reader = Callable[[str], Scene]
"""Finds the shape of a name."""


@dataclass(frozen=True)
class Holding:
    """What holds the rod: a scene, None at home, and by which name the history calls it."""

    dwell: Dwell
    scene: Scene | None


def scene_after(scene: Scene, history: str | Sequence[Dwell], read: Reader) -> Scene:
    """A shape whose rod has been through a history, which may be text such as "other.toml@8h,home@30min".

    Its display's rod has the natural curvature that this leaves, and `past` says how that came about; the history of a
    shape that has a past comes after that. InvalidInput for a history that cannot be read, a shape of another
    display, or one that needs space; Infeasible for a shape of the history that has no such state, or does not keep it
    for as long.
    """
    dwells = parse_history(history) if isinstance(history, str) else tuple(history)
    if not dwells:
        raise InvalidInput("a history has no shape", "name shapes and for how long, such as peak.toml@8h")
    display, past = as_made(scene), scene.past
    law = display.rod.relaxation
    begun = RodMemory.new(law or power_law(), display.rod.total_length) if past is None else past.memory
    held = [Holding(each, _shape_of(each, replace(scene, display=display), read)) for each in dwells]
    memory, count, error = followed(begun, display, held)
    profile = display.rod.profile
    left = Past(
        history=dwells if past is None else (*past.history, *dwells),
        memory=memory,
        span=display.span,
        error=error if past is None else error + past.error,
        steps=count,
        is_estimate=law is None,
        made=None if profile is None else (profile.places, profile.values),
    )
    last = next((each.scene for each in reversed(held) if each.scene is not None), scene.last)
    return replace(scene, display=with_set(display, memory), past=left, last=last)


def as_made(scene: Scene) -> Display:
    """The display of a shape, its rod as it was made, whatever it went through."""
    past, display = scene.past, scene.display
    if past is None:
        return display
    profile = None if past.made is None else Profile(*past.made)
    relaxation = None if past.is_estimate else display.rod.relaxation
    return replace(display, rod=replace(display.rod, profile=profile, relaxation=relaxation))


def at_home_first(scene: Scene, seconds: float) -> Scene:
    """A shape with a past, had the rod been held straight for so long [s] after it."""
    past, display = scene.past, as_made(scene)
    assert past is not None
    memory = past.memory.held(-_as_made(display, past.memory), seconds)
    return replace(scene, display=with_set(display, memory))


def with_set(display: Display, memory: RodMemory) -> Display:
    """A display whose rod has the set that it remembers, besides the natural curvature of its file."""
    rod = display.rod
    places, values = memory.places, memory.set_curvature
    if rod.profile is not None:
        made, taken = _curvature_of(rod.profile), NaturalCurvature(places, values)
        # Beside a place of the file, one that only rounding tells from it would give the curve a slope of rounding.
        gaps = np.abs(places[:, None] - made.places[np.clip(_around(made.places, places), 0, made.places.size - 1)])
        places = np.union1d(places[gaps.min(axis=1) > APART * memory.total_length], made.places)
        values = made(places) + taken(places)
    profile = Profile(tuple(places.tolist()), tuple(values.tolist()))
    return replace(display, rod=replace(rod, profile=profile, relaxation=memory.law))


def _around(places: Array, wanted: Array) -> npt.NDArray[np.intp]:
    """Where the `wanted (m,)` lie among rising `places`: the numbers (m, 2) of those before and behind each."""
    behind = np.searchsorted(places, wanted)
    return np.column_stack([behind - 1, behind])


def _shape_of(dwell: Dwell, scene: Scene, read: Reader) -> Scene | None:
    """A shape of the history, None for home; InvalidInput for one of another display, or one that needs space."""
    if dwell.shape == HOME:
        return None
    other = read(dwell.shape)
    if other.display != scene.display:
        names = f"{other.display.name} and {scene.display.name}"
        raise InvalidInput(
            f"{dwell.shape} and {scene.name} are shapes of two displays, {names}", "name shapes of one display"
        )
    if there := other.beyond_the_plane:
        raise InvalidInput(
            f"{dwell.shape} has {' and '.join(there)}, and a set is computed of planar shapes", "leave it out"
        )
    return other


def followed(begun: RodMemory, display: Display, held: Sequence[Holding]) -> tuple[RodMemory, int, float]:
    """The memory after a history, the curves computed for it, and its difference from that with half the steps."""
    steps = FEWEST
    coarse, _ = _gone_through(begun, display, held, steps)
    while True:
        steps *= 2
        fine, count = _gone_through(begun, display, held, steps)
        error = float(np.max(np.abs(fine.set_curvature - coarse.set_curvature)))
        if error <= CLOSE * np.max(np.abs(fine.set_curvature)) or steps >= MOST:
            return fine, count, error
        coarse = fine


def _gone_through(memory: RodMemory, display: Display, held: Sequence[Holding], steps: int) -> tuple[RodMemory, int]:
    """The memory after a history, in so many steps per decade of time, and the number of curves that were computed."""
    count = 0
    for each in held:
        if each.scene is None:
            memory = memory.held(-_as_made(display, memory), each.dwell.seconds, each.dwell.temperature)
            continue
        times = _times(memory.law.reduced(each.dwell.seconds, each.dwell.temperature), steps)
        # Times of the law, which are those of the dwell at its temperature.
        factor = each.dwell.seconds / times[-1] if times[-1] > 0.0 else 0.0
        bend, states = _bend(each, memory, 0.0, None)
        growth = np.zeros_like(bend)
        for begin, end in zip(times[:-1] * factor, times[1:] * factor, strict=True):
            # Curves give way evenly in the logarithm of time: as much in this step as in the one before.
            ahead = memory.bent(bend, bend + growth, end - begin, each.dwell.temperature)
            after, states = _bend(each, ahead, end, states)
            memory = memory.bent(bend, after, end - begin, each.dwell.temperature)
            bend, growth = after, after - bend
        count += times.size
    return memory, count


def _times(seconds: float, steps: int) -> Array:
    """Ends of the steps of a dwell, from 0 on: the first to `FIRST_STEP` at most, then so many in each decade."""
    if seconds <= FIRST_STEP:
        return np.array([0.0, seconds])
    count = max(1, math.ceil(steps * math.log10(seconds / FIRST_STEP)))
    return np.concatenate(([0.0], np.geomspace(FIRST_STEP, seconds, count + 1)))


def _bend(
    held: Holding, memory: RodMemory, seconds: float, before: Sequence[Equilibrium] | None
) -> tuple[Array, list[Equilibrium]]:
    """Bends (places,) of the rod in a shape of the history, and the states of its segments.

    Infeasible if it is not there any more `seconds` after the dwell began, or has snapped since `before`.
    """
    scene = held.scene
    assert scene is not None
    bent = replace(scene, display=with_set(scene.display, memory))
    states = [_wanted(held, found.wanted, seconds) for found in simulate(bent, TOLERANCE)]
    for state, then in zip(states, before or states, strict=True):
        if _turn(state, then) > JUMP:
            _refuse_lost(held, seconds)
    made = _as_made(scene.display, memory)
    bends = -made
    for state in states:
        _add_bend(bends, state, memory, made)
    return bends, states


def _turn(state: Equilibrium, before: Equilibrium) -> float:
    """The largest angle [rad] between the curves of a segment before and after a step."""
    now, then = (np.interp(LOOKS, np.linspace(0.0, 1.0, each.angles.size), each.angles) for each in (state, before))
    return float(np.max(np.abs(now - then)))


def _wanted(held: Holding, state: Equilibrium | None, seconds: float) -> Equilibrium:
    if state is None:
        _refuse_lost(held, seconds)
    if state.model == SPATIAL:
        raise InvalidInput(
            f"{held.dwell.shape} leaves the plane, and a set is computed of planar shapes", "name another shape"
        )
    return state


def _refuse_lost(held: Holding, seconds: float) -> NoReturn:
    shape = held.dwell.shape
    if seconds == 0.0:
        raise Infeasible(
            f"the rod cannot be held in {shape}: it has no such state", f"`curveline simulate {shape}` says why"
        )
    raise Infeasible(
        f"the rod does not stay in {shape}: within {duration_text(float(f'{seconds:.2g}'))} it gives way and snaps",
        "hold it there for a shorter time",
    )


def _add_bend(bends: Array, state: Equilibrium, memory: RodMemory, made: Array) -> None:
    """Put the bend of a segment in place of that of a straight rod, in all `bends (places,)`.

    A moment, the curvature less the natural one, changes smoothly, also where the set does not: it is taken from the
    vertices of the state, and the set is what is remembered.
    """
    pose, bearing = state.rod.pose, state.rod.bearing
    ends = pose.begin + 0.5 * bearing.clamp + np.concatenate(([0.0], np.cumsum(state.edges)))
    moment = state.vertices_table[:, CURVATURE] - bearing.natural - curvatures_at(bearing.profile, ends)
    inside = memory.within(float(ends[0]), float(ends[-1]))
    bent = memory.set_curvature + made + np.interp(memory.places, ends, moment)
    bends += inside * bent


def _as_made(display: Display, memory: RodMemory) -> Array:
    """Natural curvature (places,) of the rod as it was made."""
    rod = display.rod
    varying = 0.0 if rod.profile is None else _curvature_of(rod.profile)(memory.places)
    return np.asarray(rod.natural_curvature + varying + np.zeros(memory.places.size))


def _curvature_of(profile: Profile) -> NaturalCurvature:
    return NaturalCurvature(np.array(profile.places), np.array(profile.values))
