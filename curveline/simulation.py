"""From a scene to every stable state of each of its segments."""

from __future__ import annotations

from dataclasses import dataclass, replace

from curveline.errors import InvalidInput
from curveline.rod.equilibrium import EXTENSIBLE, PLANAR, SPATIAL, ClampedRod, Equilibrium
from curveline.rod.fidelity import Bound, left_out
from curveline.rod.section import Section
from curveline.rod.space import SpatialSegment
from curveline.rod.spatial_ladder import refine_in_space
from curveline.rod.states import find_states
from curveline.scene import Display, Node, Scene

DEFAULT_TOLERANCE = 1e-4
"""Default bound on a curve's error [m]."""

AUTO = "auto"
MODELS = (AUTO, PLANAR, EXTENSIBLE, SPATIAL)
"""What a user may ask for; with `AUTO` the scene decides."""


@dataclass(frozen=True)
class SegmentStates:
    """The stable states of one segment, the highest over its chord first.

    `wanted_name` is the state the shape asks for; `terms` are in the `model`, chosen for the sentences of `reasons`;
    `left_out` bounds the others, over all states. `origin` is the left pivot in the display's frame [m].
    """

    length: float  # [m]
    wanted_name: str
    origin: tuple[float, float]  # [m]
    terms: tuple[str, ...]
    left_out: dict[str, Bound]
    states: tuple[Equilibrium, ...]
    model: str = PLANAR
    reasons: tuple[str, ...] = ()

    @property
    def wanted(self) -> Equilibrium | None:
        """The state the shape asks for, if it exists."""
        return next((state for state in self.states if state.wanted), None)


def clamped_rod(
    display: Display,
    nodes: tuple[Node, Node],
    length: float,
    loads: tuple[tuple[float, float, float], ...] = (),
) -> ClampedRod:
    """The rod between two neighbouring `nodes`; `loads` are (fraction of the length, force x, force y).

    A planar rod's weight can only point down or up: of gravity in another direction it has the vertical part.
    """
    left, right = nodes
    return ClampedRod(
        chord=(display.span, right.height - left.height),
        start=left.angle,
        end=right.angle,
        length=length,
        clamp=display.clamp,
        stiffness=display.rod.bending_stiffness,
        weight=-display.weight[1],
        natural_curvature=display.rod.natural_curvature,
        loads=loads,
    )


def _planar_rod(scene: Scene, index: int) -> ClampedRod:
    """What of the segment after node `index` lies in the plane."""
    loads = sorted((load.at, *load.force) for load in scene.loads if load.segment == index)
    nodes = (scene.nodes[index], scene.nodes[index + 1])
    return clamped_rod(scene.display, nodes, scene.segments[index].length, tuple(loads))


def spatial_segment(scene: Scene, index: int) -> SpatialSegment:
    """The segment after node `index` with all that the scene says of it, in space."""
    left, right = scene.nodes[index], scene.nodes[index + 1]
    return SpatialSegment(
        rod=_planar_rod(scene, index),
        section=section_of(scene.display),
        yaw=(left.yaw, right.yaw),
        roll=(left.roll, right.roll),
        weight=scene.display.weight,
        loads=tuple(sorted((load.at, *load.force, load.lateral) for load in scene.loads if load.segment == index)),
        lateral_curvature=scene.display.rod.lateral_curvature,
    )


def section_of(display: Display) -> Section:
    """What the terms left out depend on."""
    rod = display.rod
    return Section(
        rod.stretching_stiffness,
        rod.thickness,
        rod.width,
        rod.weight_per_length,
        rod.lateral_bending_stiffness,
        rod.twisting_stiffness,
    )


def simulate(
    scene: Scene, tolerance: float = DEFAULT_TOLERANCE, windings: tuple[int, ...] = (0,), model: str = AUTO
) -> list[SegmentStates]:
    """Every stable state of every segment of `scene`, each curve to `tolerance` [m], in one of `MODELS`.

    Complete for what a planar display can show; `windings` names further full turns of the tangent to look at, whose
    loops are then listed as far as they are met. Raises InvalidInput for an unknown model.
    """
    if model not in MODELS:
        raise InvalidInput(f"there is no model {model!r}", hint=f"choose one of {', '.join(MODELS)}")
    return [_segment_states(scene, index, (tolerance, windings, model)) for index in range(len(scene.segments))]


def _segment_states(scene: Scene, index: int, asked: tuple[float, tuple[int, ...], str]) -> SegmentStates:
    """The states of the segment between nodes `index` and `index` + 1; `asked` as in `simulate`."""
    tolerance, windings, asked_model = asked
    segment, space = scene.segments[index], spatial_segment(scene, index)
    model, reasons = _model_for(space, asked_model)
    rod = replace(space.rod, stretching=space.section.stretching_stiffness) if model == EXTENSIBLE else space.rod
    found = find_states(rod, tolerance, windings)
    if model == SPATIAL:
        found = [refine_in_space(space, state, tolerance) for state in found]
    states = tuple(replace(state, wanted=state.name == segment.state and state.simple) for state in found)
    origin = (index * scene.display.span, scene.nodes[index].height)
    terms, bounds = _terms(space, model), _bounds(states, space)
    return SegmentStates(segment.length, segment.state, origin, terms, bounds, states, model, reasons)


def _model_for(space: SpatialSegment, asked: str) -> tuple[str, tuple[str, ...]]:
    """The model for a segment, and why."""
    if asked != AUTO:
        return asked, (f"the {asked} model was asked for",)
    if not space.is_flat or space.weight[0]:
        return SPATIAL, ("something points out of the plane",)
    return PLANAR, ("nothing points out of the plane",)


def _terms(space: SpatialSegment, model: str) -> tuple[str, ...]:
    """What is in the model of a segment."""
    extra = {PLANAR: (), EXTENSIBLE: ("stretch",), SPATIAL: ("stretch", "lateral bend", "twist")}
    weight = any(space.weight) if model == SPATIAL else space.rod.weight
    return ("bend", *extra[model], *(["gravity"] if weight else []), *(["loads"] if space.loads else []))


def _bounds(states: tuple[Equilibrium, ...], space: SpatialSegment) -> dict[str, Bound]:
    """The worst of every term left out."""
    bounds: dict[str, Bound] = {}
    # A loop that no planar display can show would drown the others; it has flags of its own.
    for state in [state for state in states if state.simple] or states:
        for name, bound in left_out(state, space.section).items():
            if name not in bounds or bound.bound > bounds[name].bound:
                bounds[name] = bound
    return bounds
