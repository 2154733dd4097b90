"""From a shape file to the states of its segments: units, origins, terms, what is left out, which state is wanted."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import curveline
from curveline.errors import InvalidInput
from curveline.scene import Load, Node, Scene, Segment
from curveline.shapes.files import read_display
from curveline.simulation.simulate import scene_rod, simulate
from curveline.units import deg, mm

HERE = Path(__file__).parents[1]
SHAPES = sorted((HERE.parent / "shapes").glob("*-*.toml"))
"""The paper's, of one segment: they are named for boundary conditions and state."""
REFERENCE = {case["id"]: case for case in json.loads((HERE / "data" / "reference_display.json").read_text())["cases"]}
IDS = {
    "level-neutral": "P1",
    "staggered-neutral": "P2",
    "level-up": "P3",
    "staggered-up": "P4",
    "level-down": "P5",
    "staggered-down": "P6",
    "level-asymmetric": "P7",
    "staggered-asymmetric": "P8",
}
QUAD = Scene(
    "wave",
    read_display("quad"),
    tuple(Node(mm(height), deg(angle)) for height, angle in ((0, 0), (50, 20), (-40, -10), (0, 30), (20, 0))),
    tuple(
        Segment(mm(length), state) for length, state in ((580, "peak"), (600, "valley"), (590, "peak"), (610, "peak"))
    ),
)


@pytest.mark.parametrize("path", SHAPES, ids=lambda path: path.stem)
def test_every_shape_exists_as_the_reference_says(path: Path) -> None:
    (segment,) = curveline.simulate(curveline.read_shape(path), tolerance=1e-4)
    name, _, wanted = path.stem.rpartition("-")
    case = REFERENCE[IDS[name]]
    assert segment.length == pytest.approx(case["L"])
    assert segment.terms == ("bend", "gravity")
    assert [state.name for state in segment.states] == ["peak", "valley"]
    assert [state.wanted for state in segment.states] == [wanted == "peak", wanted == "valley"]
    assert segment.wanted is not None
    assert segment.wanted.name == segment.wanted_name == wanted
    for state in segment.states:
        (answer,) = (answer for answer in case["states"] if answer["name"] == state.name)
        assert state.error <= 1e-4
        assert state.rod.stiffness == pytest.approx(case["EI"])
        assert state.rod.weight == pytest.approx(case["weight_per_length"])
        assert state.energy == pytest.approx(answer["energy"], rel=3e-5)
        assert state.clamp_force[0] == pytest.approx(-np.array(answer["force"]), rel=1e-4, abs=1e-5)
        middle = state.curve(201)[100]
        assert middle == pytest.approx([answer["x"][100], answer["y"][100]], abs=1e-5)


def test_segments_of_a_row_stand_beside_each_other() -> None:
    segments = simulate(QUAD)
    assert len(segments) == 4
    for index, segment in enumerate(segments):
        left, right = QUAD.nodes[index], QUAD.nodes[index + 1]
        assert segment.origin == (pytest.approx(index * 0.5), left.height)
        assert segment.length == QUAD.segments[index].length
        for state in segment.states:
            assert state.rod.chord == pytest.approx((0.5, right.height - left.height))
            assert (state.rod.start, state.rod.end) == (left.angle, right.angle)
        assert [state.name for state in segment.states if state.wanted] in ([], [segment.wanted_name])
    assert sum(segment.wanted is not None for segment in segments) >= 3


def test_loads_act_on_their_own_segment_only() -> None:
    loaded = replace(QUAD, loads=(Load(1, 0.7, (0.0, -0.2)), Load(1, 0.3, (0.1, -0.1))))
    plain, heavy = simulate(QUAD), simulate(loaded)
    assert [segment.terms for segment in heavy] == [
        ("bend", "gravity"), ("bend", "gravity", "loads"), ("bend", "gravity"), ("bend", "gravity"),
    ]  # fmt: skip
    for index in (0, 2, 3):
        np.testing.assert_array_equal(plain[index].states[0].curve(11), heavy[index].states[0].curve(11))
    state = heavy[1].states[0]
    assert state.rod.loads == ((0.3, 0.1, -0.1, 0.0), (0.7, 0.0, -0.2, 0.0))
    weight = state.rod.weight * state.rod.free_length
    assert state.clamp_force.sum(axis=0) == pytest.approx([-0.1, 0.3 + weight])


def test_without_gravity_the_rod_is_weightless_and_what_that_costs_is_said() -> None:
    scene = curveline.read_shape(SHAPES[0])
    flat = replace(scene, display=replace(scene.display, gravity=False))
    (with_weight,), (without,) = simulate(scene), simulate(flat)
    assert "gravity" not in with_weight.left_out
    assert without.terms == ("bend",)
    assert without.left_out["gravity"].why
    for heavy, light in zip(with_weight.states, without.states, strict=True):
        assert light.rod.weight == 0.0
        moved = float(np.max(np.linalg.norm(heavy.curve(101) - light.curve(101), axis=1)))
        assert 1e-4 < moved <= without.left_out["gravity"].bound


def test_a_segment_in_space_has_all_that_the_scene_says_of_it() -> None:
    rod = replace(QUAD.display.rod, lateral_curvature=0.3)
    display = replace(QUAD.display, down=(0.0, -0.8, 0.6), rod=rod)
    nodes = (*QUAD.nodes[:2], Node(mm(-40), deg(-10), deg(20), deg(400)), *QUAD.nodes[3:])
    scene = replace(
        QUAD, display=display, nodes=nodes, loads=(Load(1, 0.7, (0.1, -0.2), 0.3), Load(1, 0.3, (0.0, 0.4)))
    )
    space = scene_rod(scene, 1)
    assert (space.yaw, space.roll) == ((0.0, deg(20)), (0.0, deg(400)))
    assert (space.weight_x, space.weight_z) == pytest.approx((0.0, 0.6 * rod.weight_per_length))
    assert space.loads == ((0.3, 0.0, 0.4, 0.0), (0.7, 0.1, -0.2, 0.3))
    assert space.lateral_curvature == 0.3
    assert [forces.tolist() for forces in space.dead_loads()] == [[0.3, 0.7], [[0.0, 0.4], [0.1, -0.2]]]
    assert space.weight == pytest.approx(0.8 * rod.weight_per_length)
    assert (space.bearing.lateral, space.bearing.twisting) == (rod.lateral_bending_stiffness, rod.twisting_stiffness)
    assert scene_rod(QUAD, 1).is_flat


def test_full_turns_that_both_clamps_make_are_not_made() -> None:
    rolled = {
        (3600.0, 3600.0): (0.0, 0.0),
        (0.0, 3600.0): (-1800.0, 1800.0),
        (-800.0, -750.0): (-80.0, -30.0),
        (360.0, 359.0): (360.0, 359.0),
    }
    for (left, right), expected in rolled.items():
        nodes = (Node(0.0, 0.0, 0.0, deg(left)), Node(0.0, 0.0, 0.0, deg(right)))
        scene = Scene("rolled", read_display("single"), nodes, (Segment(mm(600), "peak"),))
        assert scene_rod(scene, 0).roll == pytest.approx(tuple(map(deg, expected)), abs=1e-9)


def test_the_models_agree_where_nothing_points_out_of_the_plane_and_stretch_is_small() -> None:
    scene = curveline.read_shape(SHAPES[0])
    (planar,), (extensible,), (spatial,) = (simulate(scene, model=name) for name in ("planar", "extensible", "spatial"))
    assert [segment.model for segment in (planar, extensible, spatial)] == ["planar", "extensible", "spatial"]
    assert set(planar.terms) < set(extensible.terms) < set(spatial.terms)
    for flat, stretched, free in zip(planar.states, extensible.states, spatial.states, strict=True):
        assert (flat.model, stretched.model, free.model) == ("planar", "extensible", "spatial")
        assert (flat.name, flat.wanted) == (stretched.name, stretched.wanted) == (free.name, free.wanted)
        moved = float(np.max(np.linalg.norm(flat.curve(101) - stretched.curve(101), axis=1)))
        assert 1e-6 < moved < planar.left_out["stretch"].bound
        assert float(np.max(np.linalg.norm(free.curve(101) - stretched.curve(101), axis=1))) <= free.error
        assert float(np.max(np.abs(free.depth(101)))) < 1e-9


def test_what_points_out_of_the_plane_asks_for_the_spatial_model() -> None:
    scene = curveline.read_shape(SHAPES[0])
    pushed = replace(scene, loads=(Load(0, 0.5, (0.0, 0.0), 0.5),))
    (segment,) = simulate(pushed)
    assert segment.model == "spatial"
    assert segment.wanted is not None
    assert 0.005 < float(np.max(segment.wanted.depth(101))) < 0.2
    assert [each.model for each in simulate(scene)] == ["planar"]


def test_an_unknown_model_is_refused_with_the_known_ones() -> None:
    with pytest.raises(InvalidInput, match="no model 'flat'") as caught:
        simulate(QUAD, model="flat")
    assert caught.value.hint == "choose one of auto, planar, extensible, spatial"


def test_what_is_left_out_is_bounded_by_the_worst_state() -> None:
    (segment,) = simulate(curveline.read_shape(SHAPES[0]))
    assert set(segment.left_out) == {"stretch", "twist", "contact"}
    assert 0.0 < segment.left_out["stretch"].bound < 1e-4
    assert segment.left_out["twist"].bound == 0.0
    assert segment.left_out["contact"].bound == 0.0
    assert all(bound.why for bound in segment.left_out.values())


def test_a_wanted_state_that_does_not_exist_is_none() -> None:
    scene = curveline.read_shape(SHAPES[0])
    tilted = replace(scene, nodes=(Node(0.0, deg(60)), Node(0.0, deg(-60))), segments=(Segment(mm(560), "valley"),))
    (segment,) = simulate(tilted)
    assert [state.name for state in segment.states] == ["peak"]
    assert segment.wanted is None


def test_loops_are_listed_on_request_and_never_wanted() -> None:
    scene = curveline.read_shape(SHAPES[-1])
    (plain,), (looped,) = simulate(scene), simulate(scene, windings=(0, 1, -1))
    assert [state.name for state in looped.states[:2]] == [state.name for state in plain.states]
    assert len(looped.states) > len(plain.states)
    assert not any(state.wanted or state.simple for state in looped.states[2:])


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-8])
def test_tolerance_is_met(tolerance: float) -> None:
    (segment,) = curveline.simulate(curveline.read_shape(SHAPES[0]), tolerance=tolerance)
    assert all(state.error <= tolerance for state in segment.states)
