"""The scenes that methods are measured on: single segments with one wanted state, whose exact curve is known."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple

import numpy as np

from curveline.bench.methods.shooting import Exact, exact
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar import spline
from curveline.rod.problem import Array
from curveline.rod.states.equilibrium import PLANAR, Equilibrium
from curveline.rod.states.planar_states import find_states
from curveline.scene import PEAK, VALLEY, Display, Node, Rod, Scene, Segment
from curveline.sections import Rectangle
from curveline.shapes.files import read_display, read_shape
from curveline.simulation.simulate import scene_rod
from curveline.units import deg, g_per_m, gpa, mm

SEED = 20260101
RANDOM_SCENES = 12
REFERENCE = mm(1e-6)
"""What the state next to an exact curve is refined to."""


@dataclass(frozen=True, eq=False)
class Case:
    """One segment, the state that is wanted of it, and which way from the chord (1 or -1) a guess for it starts."""

    name: str
    scene: Scene
    state: Equilibrium  # of the inextensible rod
    side: float

    @property
    def rod(self) -> ClampedRod:
        """The inextensible rod."""
        return self.state.rod

    @property
    def section(self) -> Rod:
        """Material and cross-section."""
        return self.scene.display.rod

    @property
    def stretchy(self) -> ClampedRod:
        """The rod with its stretching stiffness."""
        return self.rod.extensible()

    def guess(self, edges: int) -> Array:
        """Angles of the spline guess on equal edges of the free rod, (edges,) [rad]."""
        scaled = self.rod.scaled()
        angles = np.empty(edges)
        spline.guess(scaled.chord, scaled.ends, self.side, angles)
        return angles


@cache
def truth(case: Case, model: str) -> Exact | None:
    """The exact curve of a case; a rod in space that only bends in a plane is the extensible one."""
    return exact(case.state, math.inf if model == PLANAR else case.section.stretching_stiffness)


class CaseSet(NamedTuple):
    """Cases that are measured together."""

    name: str
    cases: tuple[Case, ...]


def shapes(paths: Sequence[str]) -> CaseSet:
    """The segments of shape files, each with the state that the file wants."""
    return CaseSet("shapes", tuple(_cases(_segments(paths))))


def clamps() -> CaseSet:
    """Two scenes without weight that other rod codes were measured on: level clamps, and raised and tilted ones."""
    return CaseSet("clamps", tuple(_cases(_clamp_scenes())))


def random(count: int = RANDOM_SCENES) -> CaseSet:
    """Segments of the built-in display: height +-120 mm, angles +-45 deg, length 560 to 800 mm."""
    return CaseSet("random", tuple(_cases(random_scenes(count))))


def acetal_strip(display: Display) -> Display:
    """`display` with point clamps, without gravity, with a strip of POM: 10 x 3 mm, 2.6 GPa, EI = 0.0585 N m^2."""
    section = Rectangle(width=mm(10), thickness=mm(3))
    rod = replace(display.rod, youngs_modulus=gpa(2.6), section=section, mass_per_length=g_per_m(42.3))
    return replace(display, clamp=0.0, gravity=False, rod=rod)


def _clamp_scenes() -> Iterator[Scene]:
    display = acetal_strip(read_display("single"))
    for name, height, tilt, length in (("S1", 0.0, 0.0, mm(600)), ("S2", mm(60), deg(30), mm(640))):
        yield _scene(name, display, (Node(0.0, tilt), Node(height, -tilt)), length)


def random_scenes(count: int) -> Iterator[Scene]:
    """What `random` is made of."""
    display = read_display("single")
    rng = np.random.default_rng(SEED)
    for number in range(count):
        height, left, right, length = rng.uniform([-0.12, deg(-45), deg(-45), 0.56], [0.12, deg(45), deg(45), 0.8])
        yield _scene(f"random {number}", display, (Node(0.0, float(left)), Node(float(height), float(right))), length)


def _scene(name: str, display: Display, nodes: tuple[Node, Node], length: float) -> Scene:
    return Scene(name, display, nodes, (Segment(float(length), PEAK),))


def _segments(paths: Sequence[str]) -> Iterator[Scene]:
    """Every segment of shape files as a scene of its own."""
    for path in paths:
        scene = read_shape(path)
        for index, segment in enumerate(scene.segments):
            loads = tuple(replace(load, segment=0) for load in scene.loads if load.segment == index)
            name = scene.name if len(scene.segments) == 1 else f"{scene.name} {index + 1}"
            yield replace(scene, name=name, nodes=scene.nodes[index : index + 2], segments=(segment,), loads=loads)


def _cases(scenes: Iterator[Scene]) -> Iterator[Case]:
    """The scenes whose wanted state exists; of a single state that one."""
    for scene in scenes:
        state = _wanted(find_states(scene_rod(scene, 0), REFERENCE), scene.segments[0].state)
        if state is not None:
            wanted = replace(scene, segments=(replace(scene.segments[0], state=state.name),))
            yield Case(scene.name, wanted, state, 1.0 if state.mean_height > 0.0 else -1.0)


def _wanted(states: Sequence[Equilibrium], name: str) -> Equilibrium | None:
    """The state of that name; a lone one, peak or valley, will do."""
    shown = [state for state in states if state.name in (PEAK, VALLEY)]
    if len(shown) == 1:
        return shown[0]
    return next((state for state in shown if state.name == name), None)
