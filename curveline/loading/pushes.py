"""What is pushed, where and which way; and the rod of that segment under a push of any size."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from curveline.errors import Infeasible, InvalidInput
from curveline.rod.branches.control_path import ControlPath, loading
from curveline.rod.clamped_rod import ClampedRod, DeadLoad
from curveline.rod.models.choice import AUTO, SearchRequest, model_states
from curveline.rod.planar.approach import fitting_mesh
from curveline.rod.planar.richardson import interpolate
from curveline.rod.problem import Array, Bearing
from curveline.rod.states.equilibrium import EXTENSIBLE, PLANAR, SPATIAL, Equilibrium, refine
from curveline.scene import STRAIGHT, Scene
from curveline.simulation.simulate import scene_rod
from curveline.units import between, deg

DOWN = "down"
NORMAL = "normal"
MODELS = (AUTO, PLANAR, EXTENSIBLE)
"""Of a rod that is pushed."""
DOWNWARDS = (0.0, -1.0)
TOLERANCE = 1e-6
"""Bound on the error of a loaded curve, as a part of the rod's length."""
ROUGH = 1e-4
"""The same of curves that only tell states apart, or whether they stay in the plane."""
EDGES = (96, 384, 1536, 6144)
"""Of the coarsest level of a loaded curve; the finer ones near a fold, which coarse edges have earlier."""
MOST_ROWS = 10_000
NARROWEST = 1e-9
"""A step of the push, as a part of its end, that is halved no more."""
MOST = 20.0
"""Largest push to try on the built-in rod [N]."""
DECADE = 10.0
STEPS, LEAST_STEPS = 40, 2
"""Of the push, from nothing to the largest that suits the rod, and at least to where it ends."""
STRONG = 150.0
"""A push, in EI/L^2, that hardly any state withstands: those of the paper's shapes snap through at half of it."""
LARGEST_TURN = deg(10.0)
"""The rod turns by less than this in one step of the push, or the step is halved: it may have jumped."""


class Push(NamedTuple):
    """What is pushed, where and how far: `segment` from 0, `at` a fraction of its arc length from pivot to pivot.

    `direction` is "down", "normal" (to the unloaded curve, downwards) or a vector "x,y"; the load grows by `step` [N]
    up to `most` [N]; either suits the rod if it is 0. `state` is pushed, the one that the shape wants if empty, by one
    of the `MODELS`; `argv` is the command as typed.
    """

    segment: int = 0
    at: float = 0.5
    direction: str = DOWN
    step: float = 0.0
    most: float = 0.0
    state: str = ""
    model: str = AUTO  # "auto", "planar" or "extensible"
    argv: tuple[str, ...] = ()


@dataclass(frozen=True)
class Stand:
    """The rod of a segment in the `state` that is pushed, under its own loads, and where and which way it is pushed.

    `origin` is its left pivot in the display's frame [m], `toward` a unit vector.
    """

    rod: ClampedRod
    origin: tuple[float, float]
    state: Equilibrium
    at: float
    toward: tuple[float, float]

    def moved_to(self, at: float, direction: str) -> Stand:
        """The same rod in the same state, pushed elsewhere; `direction` as in `Push`."""
        there = replace(self, at=at)
        # Cut into the same edges as under a push, what is left of its error goes out of the deflections.
        state = replace(there.near(0.0, self.state), name=self.state.name)
        angle = float(tangents(state, np.array([at]))[0])
        return replace(there, state=state, toward=direction_of(direction, angle))

    def loaded(self, force: float) -> ClampedRod:
        """The rod under a push of `force` [N]."""
        pushed = DeadLoad(self.at, force * self.toward[0], force * self.toward[1])
        return replace(self.rod, loads=tuple(sorted((*self.rod.loads, pushed), key=lambda load: load.at)))

    @property
    def bearing(self) -> Bearing:
        """What holds the rod in the plane, in which pushes are computed."""
        return self.rod.bearing.held_in_plane()

    def path(self, before: float, after: float) -> ControlPath:
        """The path from one push to another [N]."""
        (at, begin), (_, end) = (self.loaded(force).dead_loads() for force in (before, after))
        path: ControlPath = loading(self.rod.pose, at, begin, end)
        return path

    def place(self, state: Equilibrium) -> tuple[float, float]:
        """Where the point that is pushed is in a state, seen from the left pivot [m]."""
        out = np.empty((1, 2))
        along = np.array([self.at * self.rod.length - 0.5 * self.rod.clamp])
        interpolate(state.vertices_table, state.edges, along, out)
        return float(out[0, 0]), float(out[0, 1])

    def seen(self, place: Sequence[float]) -> tuple[float, float]:
        """A place of the segment in the display's frame [m]."""
        return place[0] + self.origin[0], place[1] + self.origin[1]

    def deflection(self, state: Equilibrium) -> float:
        """How far that point has moved along the push in a state [m]."""
        return self.moved(self.place(state))

    def moved(self, place: Sequence[float]) -> float:
        """How far a place, seen from the left pivot, is along the push from where the point begins [m]."""
        begin = self.place(self.state)
        return (place[0] - begin[0]) * self.toward[0] + (place[1] - begin[1]) * self.toward[1]

    def near(self, force: float, state: Equilibrium, tolerance: float = TOLERANCE) -> Equilibrium:
        """The state under a push of `force` [N] that Newton finds from another one, if there is one a stable one.

        Its error is at most `tolerance`, as a part of the rod's length.
        """
        rod = self.loaded(force)
        for count in EDGES:
            edges = fitting_mesh(rod.scaled(), count)
            found = refine(rod, edges, *state.start_on(edges), tolerance * rod.length)
            if found.stable:
                break
        return found

    def reach(
        self, force: float, begin: tuple[float, Equilibrium], tolerance: float = TOLERANCE
    ) -> tuple[float, Equilibrium]:
        """What `begin`, a push [N] and the stable state under it, becomes as the push changes to `force`.

        Ends before where the state is lost.
        """
        reached, state = begin
        step = force - reached
        while reached != force and abs(step) >= NARROWEST * abs(force):
            target = force if abs(step) >= abs(force - reached) else reached + step
            trial = self.near(target, state, tolerance)
            if trial.stable and turned(state, trial) < LARGEST_TURN:
                reached, state = target, trial
                step *= 2.0
            else:
                step *= 0.5
        return reached, state


def stand_of(scene: Scene, push: Push) -> Stand:
    """The rod that is pushed, in its state.

    InvalidInput for a push that makes no sense; Infeasible if there is no such state, or not under the file's loads.
    """
    if beyond := scene.beyond_the_plane:
        hint = "`curveline simulate` finds its states in space; to push it, take that out of the file"
        raise InvalidInput(f"{scene.name} has {beyond[0]}, and pushing is computed in the plane", hint)
    check_place(scene, push)
    state = _state(scene, push)
    origin = (push.segment * scene.display.span, scene.nodes[push.segment].height)
    stand = Stand(state.rod, origin, state, push.at, DOWNWARDS)
    return stand.moved_to(push.at, push.direction)


def check_place(scene: Scene, push: Push) -> None:
    """InvalidInput unless the push acts on free rod of a segment that there is, by steps that come to an end."""
    count = len(scene.segments)
    if not 0 <= push.segment < count:
        hint = f"{scene.name} has {count} segment{'s' if count > 1 else ''}, numbered from 1, from the left"
        raise InvalidInput(f"there is no segment {push.segment + 1}", hint)
    bearing = 0.5 * scene.display.clamp / scene.segments[push.segment].length
    if not bearing < push.at < 1.0 - bearing:
        low, high = between(bearing, 1.0 - bearing, 4)
        hint = f"push at {low:g} to {high:g}"
        raise InvalidInput(f"at {push.at:g} of its length the rod is inside a node's bearing", hint)


def most_on(rod: ClampedRod) -> float:
    """The largest push to try on a rod [N]: `MOST` by the power of ten that makes it just enough for one as stiff."""
    strong = STRONG * rod.stiffness / rod.free_length**2
    return float(MOST * DECADE ** math.ceil(math.log10(strong / MOST)))


def step_to(end: float, rod: ClampedRod) -> float:
    """A step of the push [N] that suits the rod: half a newton on the built-in one, less if that is most of it."""
    step = most_on(rod) / STEPS
    while LEAST_STEPS * step > end:
        step /= DECADE
    return max(step, end / MOST_ROWS)


def direction_of(text: str, tangent: float) -> tuple[float, float]:
    """The unit vector of a push: see `Push`; `tangent` is the curve's angle there [rad]. InvalidInput if it is none."""
    if text == DOWN:
        return DOWNWARDS
    if text == NORMAL:
        # Of the two normals the one below the rod, also where it stands upright or has turned over.
        side = 1.0 if math.cos(tangent) >= 0.0 else -1.0
        return side * math.sin(tangent), -side * math.cos(tangent)
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        x = y = math.nan
    size = math.hypot(x, y)
    if not 0.0 < size < math.inf:
        raise InvalidInput(f"a push towards {text!r} points nowhere", "say down, normal, or a vector such as 1,-1")
    return x / size, y / size


def tangents(state: Equilibrium, at: Array) -> Array:
    """Angles (m,) [rad] of a curve's tangent at fractions `at (m,)` of its arc length, pivot to pivot."""
    ends = np.concatenate([[0.0], np.cumsum(state.edges)]) + 0.5 * state.rod.clamp
    return np.interp(at * state.rod.length, ends, state.angles)


def turned(one: Equilibrium, other: Equilibrium) -> float:
    """The largest angle between the tangents of two states at one place of their rods [rad]."""
    places = np.linspace(0.0, 1.0, 65)
    return float(np.max(np.abs(tangents(one, places) - tangents(other, places))))


def _state(scene: Scene, push: Push) -> Equilibrium:
    """The state that is pushed."""
    name = push.state or scene.segments[push.segment].state
    described = scene_rod(scene, push.segment)
    shown = _shown(described, push.model)
    for state in shown:
        if state.name == name:
            return state
    names = " and ".join(state.name for state in shown) or "none that stays in the plane"
    where = f"{scene.name}, segment {push.segment + 1}"
    bare = scene_rod(replace(scene, loads=()), push.segment)
    if bare.loads != described.loads and any(state.name == name for state in _shown(bare, push.model)):
        message = f"{where}: the {name} does not withstand the loads in the file; under them there is {names}"
        raise Infeasible(message, "make these loads smaller, or take them out, and push again")
    lack = f"has no stable {name} to push" if name != STRAIGHT else "is not straight"
    raise Infeasible(f"{where} {lack}; there is {names}", "choose another one with --state")


def _shown(segment: ClampedRod, model: str) -> list[Equilibrium]:
    """The states of a segment that a planar display can show; InvalidInput for a model that is none of `MODELS`."""
    if model not in MODELS:
        raise InvalidInput(f"a push has no model {model!r}", f"choose one of {', '.join(MODELS)}")
    tolerance = ROUGH * segment.length
    found = model_states(segment, SearchRequest(tolerance, (0,), model))
    if found.model == SPATIAL:
        # Some state leaves the plane; those that do not are pushed in it.
        found = model_states(segment, SearchRequest(tolerance, (0,), PLANAR))
    return [state for state in found.states if state.simple and state.stable]
