"""States in space by their right values and names: buckled ones beside planar ones, twisted ones, rolled clamps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import campaign
import curveline
from curveline.rod.models.model_error import judge
from curveline.rod.states.planar_states import find_states
from curveline.scene import Load, Node, Scene
from curveline.sections import Rectangle
from curveline.simulation.simulate import SegmentStates, scene_rod, simulate
from curveline.units import deg, mm

PLAIN = curveline.read_shape(Path(__file__).parents[2] / "shapes" / "level-neutral-peak.toml")
TINY = 1e-9


def with_rod(scene: Scene, **changes: Any) -> Scene:
    return replace(scene, display=replace(scene.display, rod=replace(scene.display.rod, **changes)))


def with_length(scene: Scene, length_mm: float) -> Scene:
    return replace(scene, segments=(replace(scene.segments[0], length=mm(length_mm)),))


def scene_of(
    left: Node, right: Node, length_mm: float, size_mm: tuple[float, float] = (10.0, 2.4), state: str = "peak"
) -> Scene:
    """The built-in single display with a rod of `size_mm`, width and thickness, between two nodes."""
    scene = with_length(with_rod(PLAIN, section=Rectangle(*map(mm, size_mm))), length_mm)
    return replace(scene, nodes=(left, right), segments=(replace(scene.segments[0], state=state),))


def bare(scene: Scene, clamp: float | None = None, **rod: Any) -> Scene:
    """The same scene without weight."""
    display = replace(scene.display, gravity=False, clamp=scene.display.clamp if clamp is None else clamp)
    return with_rod(replace(scene, display=display), **rod)


def rolled(left_deg: float, right_deg: float, height_mm: float = 0.0) -> tuple[Node, Node]:
    return Node(0.0, 0.0, roll=deg(left_deg)), Node(mm(height_mm), 0.0, roll=deg(right_deg))


def only(scene: Scene, **asked: Any) -> SegmentStates:
    (segment,) = simulate(scene, **asked)
    return segment


def names(scene: Scene, **asked: Any) -> list[str]:
    return [state.name for state in only(scene, **asked).states]


def test_a_peak_that_falls_out_of_its_plane_does_not_take_the_place_of_the_valley_that_it_falls_into() -> None:
    segment = only(scene_of(Node(0.0, 0.0), Node(0.0, 0.0), 600.0, (3.0, 3.0), "valley"))
    assert [state.name for state in segment.states] == ["valley"]
    assert segment.wanted is segment.states[0]
    (valley,) = segment.states
    assert valley.stable
    assert valley.simple
    assert not valley.leaves_plane
    assert valley.lowest_eigenvalue == pytest.approx(1.95, abs=0.01)
    assert any("peak would not stay in the plane" in reason for reason in segment.reasons)
    assert any("peak falls" in reason and "valley" in reason for reason in segment.reasons)


def test_the_good_one_of_two_planar_states_is_not_denied() -> None:
    left, right = Node(mm(86.3), deg(-56.1)), Node(mm(143.4), deg(65.6))
    scene = scene_of(left, right, 808.9, state="valley")
    described = scene_rod(scene, 0)
    judged = {each.name: judge(each) for each in find_states(described, 1e-4)}
    assert judged["peak"].sideways.eigenvalue == pytest.approx(-0.845, abs=0.01)
    assert judged["valley"].state.lowest_eigenvalue == pytest.approx(79.5, abs=0.1)
    assert judged["valley"].sideways.eigenvalue == pytest.approx(62.5, abs=0.5)
    segment = only(scene)
    assert segment.wanted is not None
    assert segment.wanted.name == "valley"
    assert segment.wanted.stable
    assert only(replace(scene, segments=(replace(scene.segments[0], state="peak"),))).wanted is None
    narrow = only(with_rod(scene, section=Rectangle(mm(3.0), mm(3.0))))
    assert narrow.wanted is not None


@pytest.mark.parametrize("model", ["planar", "extensible", "auto"])
def test_names_in_the_plane_outlive_the_states_that_leave_it(model: str) -> None:
    """A valley that buckles leaves the peak a peak, although it is the only state left, below its chord or not."""
    scene = scene_of(Node(0.0, deg(75.0)), Node(0.0, deg(-75.0)), 900.0, state="valley")
    segment = only(scene, model=model)
    assert segment.wanted is None
    assert next(state.name for state in segment.states if state.simple) == "peak"
    assert all(state.name.startswith("buckled-") for state in segment.states if not state.simple)


def test_a_strip_on_its_side_has_no_peak_and_no_valley() -> None:
    strip = bare(scene_of(*rolled(90.0, 90.0), 600.0, (10.0, 1.0)))
    segment = only(strip)
    assert [state.name for state in segment.states] == ["front-1", "back-1"]
    assert segment.wanted is None
    for state, side in zip(segment.states, (1.0, -1.0), strict=True):
        assert state.space is not None
        assert side * state.space.mean_depth > mm(70.0)
        assert abs(state.mean_height) < mm(1e-6)
    # Its weight lets both hang by the same.
    heavy = replace(strip, display=replace(strip.display, gravity=True))
    assert names(heavy) == ["front-1", "back-1"]


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("angle", [30.0, 60.0, *campaign.only([45.0])])
def test_a_strip_that_is_rolled_by_less_is_highest_where_it_can_be(angle: float, way: float) -> None:
    """Up to 60 deg, all usual ones: peak and valley."""
    strip = bare(scene_of(*rolled(way * angle, way * angle), 600.0, (10.0, 1.0)))
    assert names(strip) == ["peak", "valley"]


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_strip_that_lies_nearer_to_the_side_is_called_by_that(way: float) -> None:
    steep = bare(scene_of(*rolled(way * 75.0, way * 75.0), 600.0, (10.0, 1.0)))
    assert sorted(names(steep)) == ["back-1", "front-1"]


TWISTED = {290.0: (1205.4, 1235.0), 305.0: (1294.9, 1263.8)}
"""Energies [mJ] of a strip whose right node is rolled so far [deg], by an independent solver for 2 GPa."""


@pytest.mark.parametrize("roll", TWISTED)
def test_all_states_of_a_twisted_strip_are_found(roll: float) -> None:
    twisted = bare(scene_of(*rolled(0.0, roll), 600.0), clamp=0.0, youngs_modulus=2e9, shear_modulus=2e9 / 2.7)
    states = only(twisted).states
    assert all(state.stable for state in states)
    for energy in TWISTED[roll]:
        alike = [state for state in states if state.energy * 1e3 == pytest.approx(energy, abs=0.6)]
        assert len(alike) >= 2, "a state and its twin"
    assert min(state.lowest_eigenvalue for state in states) > 2.0


Change = Callable[[Scene, float], Scene]


def _node(number: int, **by: float) -> Change:
    def change(scene: Scene, step: float) -> Scene:
        nodes = list(scene.nodes)
        moved = {key: getattr(nodes[number], key) + sign * step for key, sign in by.items()}
        nodes[number] = replace(nodes[number], **moved)
        return replace(scene, nodes=tuple(nodes))

    return change


def _rod(key: str) -> Change:
    return lambda scene, step: with_rod(
        scene, **{key: getattr(scene.display.rod, key) * (1.0 + step) + step * UNIT[key]}
    )


def _size(key: str) -> Change:
    def change(scene: Scene, step: float) -> Scene:
        section = scene.display.rod.section
        return with_rod(scene, section=replace(section, **{key: getattr(section, key) * (1.0 + step)}))

    return change


UNIT = {"natural_curvature": 1.0, "lateral_curvature": 1.0, "youngs_modulus": 0.0}


def _down(axis: int) -> Change:
    def change(scene: Scene, step: float) -> Scene:
        down = np.array(scene.display.down) + step * np.eye(3)[axis]
        return replace(scene, display=replace(scene.display, down=tuple(float(part) for part in down)))

    return change


def _load(force: tuple[float, float], lateral: float) -> Change:
    def change(scene: Scene, step: float) -> Scene:
        return replace(scene, loads=(*scene.loads, Load(0, 0.37, (force[0] * step, force[1] * step), lateral * step)))

    return change


CHANGES: dict[str, Change] = {
    "height": _node(1, height=1.0),
    "left angle": _node(0, angle=1.0),
    "right angle": _node(1, angle=1.0),
    "left yaw": _node(0, yaw=1.0),
    "right yaw": _node(1, yaw=1.0),
    "left roll": _node(0, roll=1.0),
    "right roll": _node(1, roll=1.0),
    "length": lambda scene, step: with_length(scene, (scene.segments[0].length + step) * 1e3),
    "span": lambda scene, step: replace(scene, display=replace(scene.display, span=scene.display.span + step)),
    "clamp": lambda scene, step: replace(scene, display=replace(scene.display, clamp=scene.display.clamp + abs(step))),
    "push along": _load((1.0, 0.0), 0.0),
    "push up": _load((0.0, 1.0), 0.0),
    "push to the viewer": _load((0.0, 0.0), 1.0),
    **{f"gravity {axis}": _down(number) for number, axis in enumerate("xyz")},
    **{key: _size(key) for key in ("width", "thickness")},
    **{key: _rod(key) for key in UNIT},
}

SYMMETRIC = {
    "level": scene_of(*rolled(0.0, 0.0), 600.0),
    "level, no weight": bare(scene_of(*rolled(0.0, 0.0), 600.0)),
    "an S, no weight": bare(scene_of(Node(0.0, deg(65.0)), Node(0.0, deg(65.0)), 530.0)),
    "falls into the valley": scene_of(*rolled(0.0, 0.0), 600.0, (3.0, 3.0)),
    "buckled": scene_of(*rolled(0.0, 0.0), 850.0, (2.0, 2.4)),
    "strip on its side": bare(scene_of(*rolled(90.0, 90.0), 600.0, (10.0, 1.0))),
    "strip on its side, heavy": scene_of(*rolled(90.0, 90.0), 600.0, (10.0, 1.0)),
    "strip on its side, raised": bare(scene_of(*rolled(90.0, 90.0, 200.0), 600.0, (10.0, 1.0))),
    "strip by 45 deg": bare(scene_of(*rolled(45.0, 45.0), 600.0, (10.0, 1.0))),
    "strip on its head": bare(scene_of(*rolled(180.0, 180.0), 600.0, (10.0, 1.0))),
    "twisted by half a turn": bare(scene_of(*rolled(0.0, 180.0), 600.0)),
    "yawed": bare(scene_of(Node(0.0, 0.0, yaw=deg(30.0)), Node(0.0, 0.0, yaw=deg(-30.0)), 600.0)),
}


def nudged(scene: Scene, rng: np.random.Generator) -> Scene:
    """The scene with every input changed by a billionth, up or down."""
    for change in CHANGES.values():
        scene = change(scene, TINY * float(rng.choice([-1.0, 1.0])))
    return scene


PLAIN_ONES = ["level", "an S, no weight", "falls into the valley", "buckled"]
"""Of each kind one, which take the least time."""


@pytest.mark.parametrize("name", [*PLAIN_ONES, *campaign.only(each for each in SYMMETRIC if each not in PLAIN_ONES)])
def test_names_do_not_change_with_a_billionth_of_all_inputs(name: str) -> None:
    scene = SYMMETRIC[name]
    here, rng = names(scene), np.random.default_rng(3)
    assert here
    for _ in range(4):
        assert names(nudged(scene, rng)) == here


@pytest.mark.parametrize("name", PLAIN_ONES)
@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_names_do_not_change_with_a_billionth_of_any_input(name: str, change: Change) -> None:
    for step in (TINY, -TINY):
        assert names(change(SYMMETRIC[name], step)) == names(SYMMETRIC[name]), step


def test_names_of_random_scenes_do_not_change_with_a_billionth_of_all_inputs() -> None:
    rng = np.random.default_rng(412)
    for number in range(24):
        angles, yaws, rolls = (np.radians(rng.uniform(-size, size, 2)) for size in (50.0, 20.0, 90.0))
        in_space = number % 4 == 3
        nodes = [
            Node(0.0, float(a), yaw=in_space * float(y), roll=in_space * float(r))
            for a, y, r in zip(angles, yaws, rolls, strict=True)
        ]
        scene = scene_of(nodes[0], nodes[1], float(rng.uniform(560.0, 850.0)), (float(rng.uniform(2.4, 10.0)), 2.4))
        assert names(nudged(scene, rng)) == names(scene), number
