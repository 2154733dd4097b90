"""The scene decides the model: planar, extensible or spatial, each contained in the next, and the reasons in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.model_error import (
    UNKNOWN,
    Bound,
    Judged,
    asked_of,
    judge,
    lateral,
    probe,
    space_bound,
    spatial_left_out,
)
from curveline.rod.models.straight import is_too_short_to_buckle, straight_state
from curveline.rod.planar.approach import soften
from curveline.rod.spatial.lifting import relax_in_space
from curveline.rod.spatial.relax import at_rest
from curveline.rod.spatial.richardson import refine_shape
from curveline.rod.spatial.search import Resting, search_in_space
from curveline.rod.states.equilibrium import EXTENSIBLE, PLANAR, SPATIAL, Equilibrium, Outcome, refine
from curveline.rod.states.identity import GONE, are_twins, as_straight, named, placed, same_curve
from curveline.rod.states.planar_states import find_states
from curveline.rod.states.slack import is_straight
from curveline.units import millimetres

AUTO = "auto"
MODELS = (AUTO, PLANAR, EXTENSIBLE, SPATIAL)
"""What a user may ask for; `AUTO` leaves it to the scene."""

IN_PLANE = 1e-4
"""Of the length: a curve that comes no farther out of the plane lies in it. One that leaves it goes a hundred times as
far where its eigenvalue out of the plane was below zero by a thousandth."""


class SearchRequest(NamedTuple):
    """What is asked of a segment: error [m], further turns to look for, and one of `MODELS`."""

    tolerance: float
    windings: tuple[int, ...]
    model: str


@dataclass(frozen=True)
class ModelledStates:
    """The states of a segment by a `model`: its `terms`, bounds on those left out over all states, reasons in words."""

    model: str
    states: tuple[Equilibrium, ...]
    terms: tuple[str, ...]
    left_out: dict[str, Bound]
    reasons: tuple[str, ...]


def model_states(segment: ClampedRod, ask: SearchRequest) -> ModelledStates:
    """Every stable state of `segment` by the model asked for, or by the smallest one that the scene allows.

    Searched for in the plane; the extensible states start from those, and the spatial ones from the extensible. That of
    a rod without any to spare also starts from the straight line, and is called straight if it is the only one.
    """
    straight = is_straight(segment)
    found = [] if straight and _is_alone(segment, ask) else _planar(segment, ask)
    model, why = ask.model, [f"the {ask.model} model was asked for"]
    judged: list[Judged] = []
    if model == AUTO and straight and not segment.needs_space:
        model, why = EXTENSIBLE, ["the rod has none to spare: how it lies is told by how it stretches"]
    if model == PLANAR or (model == AUTO and not segment.needs_space):
        judged = [judge(state) for state in found]
    if model == AUTO:
        model, why = _choice(segment, judged, ask.tolerance)
    if model != PLANAR:
        # What a planar model leaves out is no matter where all goes to space.
        judged = [
            Judged(state, lateral(state), {}) if model == SPATIAL else judge(state)
            for state in _stretched(segment, found, ask, why)
        ]
        if ask.model == AUTO and model == EXTENSIBLE and _leaving(judged):
            model = SPATIAL
            why.append(_leaving(judged))
    if model == SPATIAL:
        judged = _in_space(segment, judged, ask.tolerance, why)
    else:
        why += [unstable for unstable in [_leaving(judged)] if unstable]
        judged = [_flagged(segment, each) for each in judged]
        # The states have been named among each other; what leaves the plane is renamed, and listed last.
        judged = _placed(judged) if any(each.state.leaves_plane for each in judged) else judged
    modelled = _modelled(segment, ask, model, judged, why)
    return replace(modelled, states=tuple(as_straight(modelled.states))) if straight else modelled


def _is_alone(segment: ClampedRod, ask: SearchRequest) -> bool:
    """True if a straight rod has one state by the model asked for, and no planar one leads to that."""
    return ask.model != PLANAR and ask.windings == (0,) and is_too_short_to_buckle(segment)


def _planar(segment: ClampedRod, ask: SearchRequest) -> list[Equilibrium]:
    asked = asked_of(segment, ask.tolerance) if ask.model in (AUTO, PLANAR) else None
    return find_states(segment, ask.tolerance, ask.windings, asked)


def beyond(segment: ClampedRod) -> tuple[str, ...]:
    """In words, what of a segment a planar model cannot have; its weight can only point straight down."""
    there = {
        "the yaw of its clamps": any(segment.yaw),
        "the roll of its clamps": any(segment.roll),
        "a load that points out of the plane": any(load.z for load in segment.loads),
        "gravity that does not point straight down": bool(segment.weight_x or segment.weight_z),
        "the rod's curvature out of the plane": bool(segment.lateral_curvature),
    }
    return tuple(what for what, is_there in there.items() if is_there)


def _choice(segment: ClampedRod, judged: Sequence[Judged], tolerance: float) -> tuple[str, list[str]]:
    """The smallest model that the scene allows, and why."""
    if segment.needs_space:
        return SPATIAL, [f"the segment needs all three dimensions for {' and '.join(beyond(segment))}"]
    unstable = _leaving(judged)
    if unstable:
        return SPATIAL, [unstable]
    for state, _, bounds in _shown(judged):
        stretch = bounds["stretch"].bound
        if state.error + stretch > tolerance:
            both = f"{millimetres(stretch)}, and its error is {millimetres(state.error)}"
            limit = f"together more than the tolerance of {millimetres(tolerance)}"
            return EXTENSIBLE, [f"stretch might move {state.name} by {both}: {limit}"]
    return PLANAR, ["nothing points out of the plane, no state leaves it, and stretch is within the tolerance"]


def _leaving(judged: Sequence[Judged]) -> str:
    """A sentence on the states that do not stay in their plane; empty if all do."""
    leaving = [each for each in _shown(judged) if not each.sideways.stays]
    if not leaving:
        return ""
    names = " and ".join(each.state.name for each in leaving)
    values = ", ".join(f"{each.sideways.eigenvalue:.3g} EI/L^2" for each in leaving)
    return f"{names} would not stay in the plane: lowest eigenvalue out of it {values}"


def _shown(judged: Sequence[Judged]) -> list[Judged]:
    """Those that decide: a loop that no planar display can show would drown the others, and has flags of its own."""
    return [each for each in judged if each.state.is_untangled] or list(judged)


def _stretched(
    segment: ClampedRod, found: Sequence[Equilibrium], ask: SearchRequest, why: list[str]
) -> list[Equilibrium]:
    """The planar states of an extensible rod to which the inextensible ones lead, or the straight line.

    `why` takes what became of the former.
    """
    states: list[Equilibrium] = []
    tolerance = ask.tolerance
    for state in found:
        rod = state.rod.extensible()
        start = probe(state)
        stretched = refine(rod, start.edges, start.angles.copy(), start.multipliers.copy(), tolerance)
        if stretched.outcome in GONE and soften(rod.scaled(), start.edges, start.angles, start.multipliers):
            stretched = refine(rod, start.edges, start.angles, start.multipliers, tolerance)
        if stretched.outcome in GONE:
            why.append(f"{state.name} is gone when the rod may stretch: {stretched.outcome.value}")
        elif any(same_curve(stretched, other) for other in states):
            why.append(f"{state.name} is gone when the rod may stretch: it falls into a state that is listed already")
        else:
            states.append(stretched.but(iterations=state.iterations + stretched.iterations))
    if 0 in ask.windings and is_straight(segment):
        state = straight_state(segment, tolerance)
        if state.outcome not in GONE and not any(same_curve(state, other) for other in states):
            states.append(state)
    return named(states)


def _in_space(segment: ClampedRod, judged: Sequence[Judged], tolerance: float, why: list[str]) -> list[Judged]:
    """Every stable state in space; those to which planar ones lead that leave their plane come after those that stay.

    Where neither a planar state nor the search leads to any, the planar ones stay in the list and are called lost.
    """
    states: list[Judged] = []
    origins: list[str] = []
    beside: list[Equilibrium] = []
    lost: list[Judged] = []
    seeds: list[Resting] = []
    is_flat = segment.is_nearly_flat
    for start, sideways, _ in sorted(judged, key=lambda each: not each.sideways.stays):
        rod, relaxed = relax_in_space(segment, start)
        state = refine_shape(segment, rod, relaxed, tolerance)
        state = _seen(
            segment, state.but(winding=start.winding, rod=start.rod, iterations=start.iterations + state.iterations)
        )
        if state.outcome in GONE:
            why.append(f"{start.name} was not found in space: {state.outcome.value}")
            lost.append(Judged(start.but(outcome=state.outcome, stable=False), sideways, {}))
            continue
        seeds.append((rod, relaxed.shape))
        if state.leaves_plane:
            beside.append(start)
        if (other := _listed(state, states)) >= 0:
            why.append(f"{start.name} falls, in space, into a state that is listed already, that of {origins[other]}")
            beside.append(start)
            continue
        if state.leaves_plane:
            why.append(f"{start.name} buckles towards the viewer, and might as well buckle the other way")
        origins.append(start.name)
        states.append(Judged(state, sideways, spatial_left_out(segment, (rod, relaxed.shape), state)))
    states += _further(segment, states, seeds, tolerance, why)
    beside += [each.state for each in lost]
    return _placed(states or lost, beside if is_flat else [])


def _further(
    segment: ClampedRod, states: Sequence[Judged], seeds: Sequence[Resting], tolerance: float, why: list[str]
) -> list[Judged]:
    """States in space to which no planar one leads; `why` takes how many."""
    out: list[Judged] = []
    for rod, shape in search_in_space(segment, seeds):
        state = _seen(segment, refine_shape(segment, rod, at_rest(shape), tolerance))
        if state.outcome not in GONE and state.stable and _listed(state, [*states, *out]) < 0:
            out.append(Judged(state, UNKNOWN, spatial_left_out(segment, (rod, shape), state)))
    if out:
        count = f"{len(out)} states that no planar one leads" if len(out) > 1 else "a state that no planar one leads"
        why.append(f"the search in space met {count} to")
    return out


def _seen(segment: ClampedRod, state: Equilibrium) -> Equilibrium:
    """A state in space, said to leave its plane where nothing pushes it out."""
    return state.but(leaves_plane=segment.is_nearly_flat and _lies_outside(state))


def _lies_outside(state: Equilibrium) -> bool:
    """True if the curve of a state does not lie in the display's plane."""
    return state.space is not None and state.space.depth > IN_PLANE * state.rod.length + state.error


def _listed(state: Equilibrium, judged: Sequence[Judged]) -> int:
    """Number of the one among `judged` that is `state`, or its twin if it leaves the plane; -1 if none is."""
    for number, each in enumerate(judged):
        if same_curve(state, each.state) or (state.leaves_plane and are_twins(state, each.state)):
            return number
    return -1


def _placed(judged: Sequence[Judged], beside: Sequence[Equilibrium] = ()) -> list[Judged]:
    """The states with their names, in order; those `beside` count among them and have no place in the list."""
    named = placed([each.state for each in judged], beside)
    return [judged[number]._replace(state=judged[number].state.but(name=name)) for number, name in named]


def _flagged(segment: ClampedRod, judged: Judged) -> Judged:
    """What a planar model may say of a state that space knows better: one that leaves the plane is not stable."""
    state, sideways, bounds = judged
    if beyond(segment):
        bounds = {**bounds, "twist": space_bound(segment, judged)}
    if not sideways.stays:
        state = state.but(outcome=Outcome.BUCKLES, stable=False, leaves_plane=True)
    return Judged(state, sideways, bounds)


def _modelled(
    segment: ClampedRod, ask: SearchRequest, model: str, judged: Sequence[Judged], why: list[str]
) -> ModelledStates:
    """The states in the order and by the names they are shown by, with bounds and reasons."""
    bounds = largest_bounds(_shown(judged))
    terms = terms_of(segment, model)
    said = [f"modelled: {', '.join(terms)}, by the {model} model", *why]
    said += [
        f"left out: {name}, which moves the curve by at most {millimetres(b.bound)}: {b.why}"
        for name, b in bounds.items()
    ]
    if large := [name for name, bound in bounds.items() if bound.bound > ask.tolerance]:
        said.append(f"more than the tolerance of {millimetres(ask.tolerance)} may be missing: {', '.join(large)}")
    states = sorted((each.state for each in judged), key=lambda state: not state.simple)
    return ModelledStates(model, tuple(states), terms, bounds, tuple(said))


def largest_bounds(judged: Sequence[Judged]) -> dict[str, Bound]:
    """The largest bound on each term that is left out, over some states."""
    bounds: dict[str, Bound] = {}
    for each in judged:
        for name, bound in each.bounds.items():
            if name not in bounds or bound.bound > bounds[name].bound:
                bounds[name] = bound
    return bounds


def terms_of(segment: ClampedRod, model: str) -> tuple[str, ...]:
    """Names of the terms of a model of the segment."""
    there = {
        "bend": True,
        "stretch": model != PLANAR,
        "lateral bend": model == SPATIAL,
        "twist": model == SPATIAL,
        "gravity": bool(segment.weight) or (model == SPATIAL and bool(segment.weight_x or segment.weight_z)),
        "curvature along the rod": segment.is_unevenly_curved,
        "giving clamps": segment.has_giving_clamps,
        "loads": any(load.x or load.y or (model == SPATIAL and load.z) for load in segment.loads),
    }
    return tuple(name for name, is_there in there.items() if is_there)
