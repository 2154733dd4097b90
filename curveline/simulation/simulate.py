"""From a scene to every stable state of each of its segments."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from curveline.errors import InvalidInput
from curveline.notebook import html_of
from curveline.rod.clamped_rod import ClampedRod, DeadLoad
from curveline.rod.models.choice import AUTO as AUTO
from curveline.rod.models.choice import MODELS as MODELS
from curveline.rod.models.choice import SearchRequest, model_states
from curveline.rod.models.model_error import Bound
from curveline.rod.models.no_state_reason import why_none, why_not
from curveline.rod.natural_curvature import NaturalCurvature
from curveline.rod.problem import Array, Bearing, Pose
from curveline.rod.profile import NO_PROFILE
from curveline.rod.section import Section
from curveline.rod.states.equilibrium import PLANAR, Equilibrium
from curveline.rod.states.slack import is_straight
from curveline.scene import STRAIGHT, Display, Node, Profile, Scene
from curveline.simulation.set_left_out import set_bound
from curveline.units import millimetres, to_mj, to_mm

STATE_HEAD = ("state", "stable", "energy mJ", "mean height mm", "error mm")
DEFAULT_TOLERANCE = 1e-4
"""Default bound on a curve's error [m]."""


@dataclass(frozen=True)
class SegmentStates:
    """The stable states of one segment, the highest over its chord first.

    `wanted_name` is the state the shape asks for; `terms` are in the model and `left_out` bounds the others, over all
    states. `origin` is the left pivot in the display's frame [m]. `model` is the one that was used; `reasons` say in
    whole sentences what was modelled, what was left out, and why. `advice` says what to change where there is no state,
    or not the wanted one.
    """

    length: float  # [m]
    wanted_name: str
    origin: tuple[float, float]  # [m]
    terms: tuple[str, ...]
    left_out: dict[str, Bound]
    states: tuple[Equilibrium, ...]  # the stable ones
    model: str = PLANAR
    reasons: tuple[str, ...] = ()
    advice: str = ""

    @property
    def wanted(self) -> Equilibrium | None:
        """The state the shape asks for, if it exists."""
        return next((state for state in self.states if state.wanted), None)

    def rows(self) -> list[tuple[object, ...]]:
        """A row of plain values per state, as `STATE_HEAD` names them."""
        return [
            (each.name, each.stable, to_mj(each.energy), to_mm(each.mean_height), to_mm(each.error))
            for each in self.states
        ]

    def _repr_html_(self) -> str:
        title = f"a segment of {to_mm(self.length):.4g} mm of rod, {self.wanted_name} wanted"
        return html_of(title, [STATE_HEAD, *self.rows()])


def clamped_rod(
    display: Display, nodes: tuple[Node, Node], length: float, begin: float = 0.0, loads: tuple[DeadLoad, ...] = ()
) -> ClampedRod:
    """The rod between two neighbouring `nodes` that point into the plane, without a curvature of its own out of it.

    It begins at `begin` [m] of the rod's material, see `Display.material_at`. A planar rod's weight can only point down
    or up: of gravity in another direction it has the vertical part.
    """
    left, right = nodes
    rod, (aside, up, front) = display.rod, display.weight
    pose = (display.span, right.height - left.height, left.angle, right.angle, length, begin)
    bearing = Bearing(
        clamp=float(display.clamp),
        stiffness=float(rod.bending_stiffness),
        weight=-float(up),
        natural=float(rod.natural_curvature),
        lateral=float(rod.lateral_bending_stiffness),
        twisting=float(rod.twisting_stiffness),
        give=float(rod.bending_stiffness / display.clamp_stiffness),
        play=float(display.clamp_play),
        profile=profile_of(rod.profile),
    )
    section = Section(rod.stretching_stiffness, rod.thickness, rod.polar_gyration, rod.weight_per_length)
    return ClampedRod(Pose(*map(float, pose)), bearing, loads, section=section, weight_x=aside, weight_z=front)


@lru_cache(64)
def profile_of(profile: Profile | None) -> Array:
    """What kernels take of a natural curvature that varies along the rod, (k, 4): see `rod.profile`."""
    if profile is None:
        return NO_PROFILE
    return NaturalCurvature(np.array(profile.places), np.array(profile.values)).table


def scene_rod(scene: Scene, index: int) -> ClampedRod:
    """The rod of the segment after node `index`, with all that the scene says of it, and its display's offsets.

    Full turns that both clamps make leave the rod as it was, so that they are not made.
    """
    left, right = scene.nodes[index], scene.nodes[index + 1]
    offsets = scene.display.offsets
    common = 2.0 * math.pi * math.trunc((left.roll + right.roll) / (4.0 * math.pi))
    nodes = (
        replace(left, angle=left.angle + offsets.angle(index)),
        replace(right, angle=right.angle + offsets.angle(index + 1)),
    )
    length = scene.segments[index].length + offsets.length(index)
    return replace(
        clamped_rod(scene.display, nodes, length, begin_of(scene, index), dead_loads(scene, index)),
        yaw=(left.yaw, right.yaw),
        roll=(left.roll - common, right.roll - common),
        lateral_curvature=scene.display.rod.lateral_curvature,
    )


def begin_of(scene: Scene, index: int) -> float:
    """Where of the rod's material the segment after node `index` begins [m]: see `Display.material_at`."""
    lengths = [segment.length for segment in scene.segments]
    if scene.begin is not None:
        return scene.begin + math.fsum(lengths[:index])
    spare = 0.5 * (math.fsum(lengths) - scene.display.span * len(lengths))
    return scene.display.material_at(index, spare - math.fsum(lengths[:index]) + scene.display.span * index)


def dead_loads(scene: Scene, index: int) -> tuple[DeadLoad, ...]:
    """The loads on the segment after node `index`, in order of their places."""
    loads = (DeadLoad(load.at, *load.force, load.lateral) for load in scene.loads if load.segment == index)
    return tuple(sorted(loads))


def simulate(
    scene: Scene, tolerance: float = DEFAULT_TOLERANCE, windings: tuple[int, ...] = (0,), model: str = AUTO
) -> list[SegmentStates]:
    """Every stable state of every segment of `scene`, each curve to `tolerance` [m].

    Complete for what a planar display can show; `windings` names further full turns of the tangent to look at, whose
    loops are then listed as far as they are met. The scene decides the `model`, unless one is named: see
    `rod.models.choice.MODELS`. Raises InvalidInput for a model of another name.
    """
    if model not in MODELS:
        raise InvalidInput(f"there is no model {model!r}", hint=f"choose one of {', '.join(MODELS)}")
    ask = SearchRequest(tolerance, windings, model)
    return [_segment_states(scene, index, ask) for index in range(len(scene.segments))]


def _segment_states(scene: Scene, index: int, ask: SearchRequest) -> SegmentStates:
    """The states of the segment between nodes `index` and `index` + 1."""
    segment = scene.segments[index]
    rod = scene_rod(scene, index)
    found = model_states(rod, ask)
    states = tuple(
        state.but(wanted=True) if state.name == segment.state and state.simple and state.stable else state
        for state in found.states
    )
    origin = (index * scene.display.span, scene.nodes[index].height)
    left_out, reasons = found.left_out, found.reasons
    law = scene.display.rod.relaxation
    if law is not None and scene.past is None and (bound := set_bound(law, found.states)) is not None:
        left_out = {**left_out, "set": bound}
        said = f"left out: set, which moves the curve by at most {millimetres(bound.bound)}: {bound.why}"
        reasons = (*reasons, said)
    return SegmentStates(
        length=segment.length,
        wanted_name=segment.state,
        origin=origin,
        terms=found.terms,
        left_out=left_out,
        states=states,
        model=found.model,
        reasons=reasons,
        advice=_advice(rod, states, segment.state, ask),
    )


def _advice(rod: ClampedRod, states: Sequence[Equilibrium], wanted: str, ask: SearchRequest) -> str:
    """What to change about a rod that has not the `wanted` state among its `states`, or none; empty if it has."""
    if any(state.wanted for state in states):
        return ""
    if wanted == STRAIGHT and ask.model == PLANAR and is_straight(rod):
        return "the planar model has no rod that is straight, since it does not stretch: leave the model to the scene"
    return why_not(rod, wanted) or ("" if states else why_none(rod, ask.windings))
