"""What may differ between a rod and its file, as changes of a shape: for `docs/tools/real_rod.py`."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

import curveline
from curveline.material.relaxation import power_law
from curveline.rod.geometry.vertex_table import CURVATURE
from curveline.rod.states.equilibrium import PLANAR, Equilibrium
from curveline.scene import PEAK, VALLEY, Profile, Scene
from curveline.simulation.dwelling import scene_after
from curveline.simulation.simulate import simulate
from curveline.units import STANDARD_GRAVITY, deg, mm

FOLDER = Path(__file__).parents[2] / "shapes"
SHAPES = tuple(
    f"{rise}-{angles}-{state}"
    for angles in ("neutral", "up", "down", "asymmetric")
    for rise in ("level", "staggered")
    for state in (PEAK, VALLEY)
)
"""The 16 shapes of the paper."""
ROUNDS = 3
"""How often the paper showed each shape."""
OTHER = {PEAK: VALLEY, VALLEY: PEAK}
CURVE = mm(0.001)
"""To which curves are computed."""
BESIDE = mm(0.1)
"""Within which a set that is given ends, beside the mouth of a bearing."""

Change = Callable[[Scene], Scene]


def read(name: str) -> Scene:
    """A shape of the project."""
    return curveline.read_shape(FOLDER / f"{name}.toml")


def state_of(scene: Scene, name: str = "", model: str = PLANAR) -> Equilibrium | None:
    """The state of a shape of one segment that has a name, or the one that it asks for; None if there is none."""
    states = simulate(scene, CURVE, model=model)[0].states
    return next((each for each in states if each.name == (name or scene.segments[0].state)), None)


def partner(scene: Scene) -> str:
    """The name of the shape with the same nodes that asks for the other state."""
    state = scene.segments[0].state
    return scene.name.replace(state, OTHER[state])


def as_it_is(scene: Scene) -> Scene:
    """No change."""
    return scene


def together(*changes: Change) -> Change:
    """One change after the other."""

    def change(scene: Scene) -> Scene:
        for each in changes:
            scene = each(scene)
        return scene

    return change


def of_rod(**values: object) -> Change:
    """Other values of the rod."""
    return lambda scene: replace(scene, display=replace(scene.display, rod=replace(scene.display.rod, **values)))


def of_display(**values: object) -> Change:
    """Other values of the display."""
    return lambda scene: replace(scene, display=replace(scene.display, **values))


def giving(rod_mm: float) -> Change:
    """Clamps that give as much as a length of rod, see `clamp_stiffness`."""

    def change(scene: Scene) -> Scene:
        return of_display(clamp_stiffness=clamp_stiffness(scene, rod_mm))(scene)

    return change


def clamp_stiffness(scene: Scene, rod_mm: float) -> float:
    """That of clamps which give as much as `rod_mm` of rod [N m/rad]."""
    return scene.display.rod.bending_stiffness / mm(rod_mm)


def loose(play_deg: float) -> Change:
    """Clamps with play to either side."""
    return of_display(clamp_play=deg(play_deg))


def turned(left_deg: float, right_deg: float) -> Change:
    """Both nodes turned by so much more."""
    by = (deg(left_deg), deg(right_deg))
    return lambda scene: replace(
        scene,
        nodes=tuple(replace(node, angle=node.angle + each) for node, each in zip(scene.nodes, by, strict=True)),
    )


def wider(by_mm: float) -> Change:
    """The nodes farther apart."""
    return lambda scene: of_display(span=scene.display.span + mm(by_mm))(scene)


def longer(by_mm: float) -> Change:
    """More rod between the nodes."""
    return lambda scene: replace(
        scene, segments=(replace(scene.segments[0], length=scene.segments[0].length + mm(by_mm)),)
    )


def stiffer(factor: float) -> Change:
    """Another modulus."""
    return lambda scene: of_rod(youngs_modulus=factor * scene.display.rod.youngs_modulus)(scene)


def heavier(factor: float) -> Change:
    """Another mass."""
    return lambda scene: of_rod(mass_per_length=factor * scene.display.rod.mass_per_length)(scene)


def gravity_length(length_mm: float) -> Change:
    """A rod so stiff for its weight w that (EI / w)^(1/3) is a length; none for an infinite one."""

    def change(scene: Scene) -> Scene:
        weight = scene.display.rod.bending_stiffness / mm(length_mm) ** 3
        return of_rod(mass_per_length=weight / STANDARD_GRAVITY)(scene) if weight else of_display(gravity=False)(scene)

    return change


def keeping(share: float, name: str) -> Change:
    """A rod that has kept a share of the curvature of a state that its shape has, one named `peak` or `valley`."""

    def change(scene: Scene) -> Scene:
        state = state_of(scene, name)
        assert state is not None
        begin = 0.5 * (scene.display.rod.total_length - scene.segments[0].length + scene.display.clamp)
        places = begin + np.concatenate(([-BESIDE, 0.0], np.cumsum(state.edges), [math.fsum(state.edges) + BESIDE]))
        values = np.concatenate(([0.0], share * state.vertices_table[:, CURVATURE], [0.0]))
        return of_rod(profile=Profile(tuple(places.tolist()), tuple(values.tolist())))(scene)

    return change


def after(history: str, strength: float = 1.0) -> Change:
    """A rod with the set that a history leaves, of shapes as they are in the project, with that of acetal.

    In it `peak` and `valley` stand for the two shapes that have the nodes of the one that is changed, `other` for the
    one that asks for the other state, and `itself` for the shape. `strength` is that of the set, 1 the estimate.
    """

    def change(scene: Scene) -> Scene:
        state, where = scene.segments[0].state, scene.name.rpartition("-")[0]
        names = {PEAK: f"{where}-{PEAK}", VALLEY: f"{where}-{VALLEY}", "itself": scene.name, "other": partner(scene)}
        assert scene.name.endswith(state)
        dwells = (each.partition("@") for each in history.split(","))
        named = ",".join(f"{names.get(shape, shape)}@{time}" for shape, _, time in dwells)
        law = of_rod(relaxation=power_law(strength))

        def on_display(name: str) -> Scene:
            return replace(read(name), display=law(scene).display)

        return scene_after(law(scene), named, on_display)

    return change


@cache
def session(minutes: int) -> dict[str, Scene]:
    """Every shape as it is shown for the last time in a session, with what the rod went through before.

    All shapes come one after the other, each `ROUNDS` times for so many minutes, with one minute at home after each.
    """
    shown: dict[str, Scene] = {}
    rod: Scene | None = None
    for name in SHAPES:
        for _ in range(ROUNDS):
            scene = read(name) if rod is None else replace(read(name), display=rod.display, past=rod.past)
            rod = scene_after(scene, f"{name}@{minutes}min,home@1min", read)
            shown[name] = scene
    return shown
