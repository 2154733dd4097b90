"""Synthetic photographs whose truth is known, of displays that differ from their files, and of what is none of them."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import numpy.typing as npt

from curveline.cameras.outcomes import TrialOutcome
from curveline.cameras.pose import ViewFailure, find_view
from curveline.cameras.setup import CameraSetup, SeenNode
from curveline.cameras.synthetic.faults import TIERS, faults_of
from curveline.cameras.synthetic.photograph import photograph_of
from curveline.cameras.synthetic.standpoints import default_setup, standpoint_of
from curveline.rod.branches.drawn import misfits
from curveline.rod.states.equilibrium import Equilibrium
from curveline.scene import Scene
from curveline.shapes.files import read_shape
from curveline.simulation.simulate import SegmentStates, simulate
from curveline.tracing.trace import Traced, trace
from curveline.units import deg, mm

Array = npt.NDArray[np.float64]

SHAPES = [
    f"{place}-{ends}-{state}"
    for place in ("level", "staggered")
    for ends in ("neutral", "up", "down", "asymmetric")
    for state in ("peak", "valley")
]
"""The paper's sixteen."""
WITHHELD, EMPTY, WRONG, OTHER = NONE_OF_THEM = "true state withheld", "empty frame", "wrong display", "another rod"
GIVES = mm(10.0), mm(20.0)
"""How much rod soft clamps give."""
OFF_ANGLE, OFF_HEIGHT, OFF_LENGTH, OFF_WEIGHT = deg(1.0), mm(0.5), mm(1.0), 0.15
"""What displays are off, standard deviations; of the weight over the stiffness the logarithm."""
OFF_NODE, OFF_SECTION = mm(1.5), 0.03
"""By how much nodes are larger, and by which part backs and teeth are thicker, than a camera file says."""
POINTS = 2001


@dataclass(frozen=True, eq=False)
class Pictured:
    """A photograph, what it is taken for, and what it shows."""

    scene: Scene
    setup: CameraSetup
    states: tuple[tuple[Equilibrium, ...], ...]  # that it may show, as far as the tracer knows
    truth: Array | None  # (n, 2) [m], None if it shows none of them
    picture: npt.NDArray[np.uint8]
    from_model: float = 0.0  # [m] RMS of what is shown against the model


@dataclass(frozen=True)
class Looked:
    """What came of a photograph; lengths in m."""

    outcome: TrialOutcome
    state: str
    wanted: str
    rms: float  # of the distances of points from the truth
    worst: float
    sigma: float  # as stated
    inside: float  # part of the points within 1.96 of it
    cover: float
    seconds: float  # CPU of pose and tracing


@cache
def _simulated(name: str) -> tuple[Scene, tuple[SegmentStates, ...]]:
    scene = read_shape(f"shapes/{name}.toml")
    return scene, tuple(simulate(scene))


def differing(scene: Scene, source: np.random.Generator) -> Scene:
    """A display that is not quite as its file says: soft clamps, other angles, heights, lengths, weight."""
    display = scene.display
    give = float(source.choice(GIVES))
    rod = replace(display.rod, mass_per_length=display.rod.mass_per_length * math.exp(source.normal(0.0, OFF_WEIGHT)))
    soft = replace(display, rod=rod, clamp_stiffness=rod.bending_stiffness / give)
    nodes = tuple(
        replace(
            each, angle=each.angle + source.normal(0.0, OFF_ANGLE), height=each.height + source.normal(0.0, OFF_HEIGHT)
        )
        for each in scene.nodes
    )
    segments = tuple(replace(each, length=each.length + source.normal(0.0, OFF_LENGTH)) for each in scene.segments)
    return replace(scene, display=soft, nodes=nodes, segments=segments)


def shown_by(name: str, seed: int) -> tuple[Array, float]:
    """The curve (n, 2) [m] of a display that is to show a shape; RMS from the model: 0 of every other one."""
    scene, segments = _simulated(name)
    model = segments[0].wanted
    assert model is not None
    curve = model.curve(POINTS) + segments[0].origin
    if seed % 2:
        real = differing(scene, np.random.default_rng([seed, 5]))
        found = next((each for each in simulate(real)[0].states if each.name == model.name), None)
        if found is not None:
            other = found.curve(POINTS) + simulate(real)[0].origin
            return other, float(np.sqrt(np.mean(np.sum((other - curve) ** 2, axis=1))))
    return curve, 0.0


def pictured(seed: int, tier: str, kind: str = "") -> Pictured:
    """The photograph of a seed, of a tier; of one of the shapes, or of what is `NONE_OF_THEM`."""
    source = np.random.default_rng([seed, 41])
    name = SHAPES[seed % len(SHAPES)]
    scene, segments = _simulated(name)
    view = standpoint_of(scene.display, seed)
    setup = default_setup(scene.display, view.lens)
    states, shown, curves = segments[0].states, scene, []
    truth, from_model = shown_by(name, seed)
    real = _differing_setup(setup, source)
    if kind in ("", WITHHELD):
        curves = [truth]
    if kind == WITHHELD:
        states = tuple(each for each in states if each.name != scene.segments[0].state)
    if kind == WRONG:
        # Neither of both states of these ends.
        other = SHAPES[(seed + 2 * int(source.integers(1, len(SHAPES) // 2))) % len(SHAPES)]
        shown = _simulated(other)[0]
        curves = [shown_by(other, seed)[0]]
    if kind == OTHER:
        real, curve = another_rod(scene, real, source)
        curves = [curve]
    picture = photograph_of(shown, curves, real, view, faults_of(tier, seed))
    return Pictured(scene, setup, (states,), truth if kind == "" else None, picture, from_model)


def _differing_setup(setup: CameraSetup, source: np.random.Generator) -> CameraSetup:
    """Nodes and a rod that are not quite as a camera file says."""
    wider, higher = OFF_NODE * source.uniform(-1.0, 1.0, 2)
    back, teeth = 1.0 + OFF_SECTION * source.uniform(-1.0, 1.0, 2)
    rod = replace(setup.rod, back=setup.rod.back * back, teeth=setup.rod.teeth * teeth)
    return replace(setup, rod=rod, node=SeenNode(setup.node.half_width + wider, setup.node.half_height + higher))


def another_rod(scene: Scene, setup: CameraSetup, source: np.random.Generator) -> tuple[CameraSetup, Array]:
    """A stick, a wave, or a cable between the nodes, (n, 2) [m], and how it is seen."""
    along = np.linspace(0.0, scene.display.span, 400)
    part = along / scene.display.span
    base = scene.nodes[0].height + (scene.nodes[1].height - scene.nodes[0].height) * part
    kind = int(source.integers(3))
    if kind == 0:
        return setup, np.column_stack([along, base + source.normal(0.0, mm(15.0)) * part])
    if kind == 1:
        size = source.uniform(mm(30.0), mm(140.0)) * source.choice([-1.0, 1.0])
        return setup, np.column_stack([along, base + size * np.sin(np.pi * part * source.integers(1, 4))])
    waves = np.arange(1, 6)
    sizes = source.normal(0.0, mm(80.0), 5) / waves
    cable = replace(setup.rod, teeth=0.0, pitch=0.0, side=0, back=source.uniform(mm(3.0), mm(7.0)), fibre=0.0)
    bent = np.sum(sizes[:, None] * np.sin(np.pi * waves[:, None] * part), axis=0)
    return replace(setup, rod=cable), np.column_stack([along, base + bent])


def traced_in(case: Pictured) -> Traced | ViewFailure:
    """What the tags and the rod of a photograph tell."""
    found = find_view(case.picture, case.setup.lens, case.setup.frame)
    if isinstance(found, ViewFailure):
        return found
    return trace(case.picture, found, case.scene, case.setup, case.states)


def looked_at(case: Pictured) -> Looked:
    """What comes of a photograph, held against the truth."""
    begin = time.process_time()
    found = find_view(case.picture, case.setup.lens, case.setup.frame)
    wanted = case.scene.segments[0].state
    if isinstance(found, ViewFailure):
        return Looked(found.outcome, "", wanted, math.nan, math.nan, 0.0, 0.0, 0.0, time.process_time() - begin)
    traced = trace(case.picture, found, case.scene, case.setup, case.states)
    seconds = time.process_time() - begin
    segment = traced.segments[0]
    cover = segment.followed[0].cover if segment.followed else 0.0
    if segment.curve is None:
        return Looked(traced.outcome, "", wanted, math.nan, math.nan, 0.0, 0.0, cover, seconds)
    sigma = math.hypot(segment.curve.sigma, found.error)
    if case.truth is None:
        return Looked(traced.outcome, segment.curve.state, wanted, math.nan, math.nan, sigma, 0.0, cover, seconds)
    off = np.abs(distances(case.truth, segment.curve.points))
    rms, inside = float(np.sqrt(np.mean(off**2))), float(np.mean(off < 1.96 * sigma))
    return Looked(traced.outcome, segment.curve.state, wanted, rms, float(off.max()), sigma, inside, cover, seconds)


def distances(truth: Array, points: Array) -> Array:
    """How far `points (k, 2)` are beside a curve (n, 2), each (k,) [m]."""
    moved = np.zeros((len(truth) + len(points), 1))
    slopes = np.zeros((1, len(truth), 2))
    off: Array = misfits(np.ascontiguousarray(truth), np.ascontiguousarray(points), slopes, moved)
    return off[len(truth) :]


def tier_of(seed: int) -> str:
    """The tiers by turns."""
    return TIERS[seed // len(SHAPES) % len(TIERS)]
