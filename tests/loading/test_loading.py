"""Pushing a shape: reference curves and loads, symmetry's trap, what it lands in, stiffness, maps, refusals."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import curveline
from clamped_rods import changed
from curveline.errors import Infeasible, InvalidInput
from curveline.loading.load_map import load_map
from curveline.loading.pushes import Push, direction_of, most_on, stand_of
from curveline.loading.results import document
from curveline.loading.snap_through import Loading, limit_of, load
from curveline.rod.states.planar_states import find_states
from curveline.scene import Display, Load, Node, Scene, Segment
from curveline.sections import Rectangle
from curveline.shapes.files import read_display
from curveline.units import deg, mm

HERE = Path(__file__).parents[1]
SHAPES = HERE.parent / "shapes"
CASES = json.loads((HERE / "data" / "reference_cases.json").read_text())["load"]
NEAR = 0.005
"""What the issue asks of loads and curves, relative."""


def bare_display(stiffness: float = 1.0, span: float = 0.5) -> Display:
    """A display with point clamps and a weightless rod of the given EI [N m^2]."""
    display = read_display("single")
    modulus = stiffness / display.rod.bending_stiffness * display.rod.youngs_modulus
    return replace(display, clamp=0.0, gravity=False, span=span, rod=replace(display.rod, youngs_modulus=modulus))


def case_scene(case: dict[str, Any]) -> Scene:
    """A load case of the reference as a shape."""
    nodes = Node(0.0, case["theta1"]), Node(case["y"], case["theta2"])
    return Scene(case["id"], bare_display(span=case["x2"]), nodes, (Segment(case["L"], "peak"),))


def arch(stiffness: float = 1.0, length: float = 0.6) -> Scene:
    """A weightless clamped arch, L/X = 1.2 if its length is 0.6 m."""
    return Scene("arch", bare_display(stiffness), (Node(0.0, 0.0), Node(0.0, 0.0)), (Segment(length, "peak"),))


def shape(name: str) -> Scene:
    return curveline.read_shape(SHAPES / f"{name}.toml")


@pytest.fixture(scope="module", params=CASES, ids=lambda case: case["id"])
def pushed(request: pytest.FixtureRequest) -> tuple[dict[str, Any], Loading]:
    case = request.param
    return case, load(case_scene(case), Push(at=case["s_fraction"], step=case["P_snap"] / 100.0))


def test_the_reference_snaps_where_and_how_it_says(pushed: tuple[dict[str, Any], Loading]) -> None:
    case, loading = pushed
    assert loading.snap is not None
    assert loading.snap.force == pytest.approx(case["P_snap"], rel=NEAR)
    assert loading.snap.kind == case["kind"]
    assert loading.rows[-1][0] == loading.snap.force
    assert [landing[:2] for landing in loading.snap.landings] == [("valley", "valley")]


def test_the_whole_curve_is_that_of_the_reference(pushed: tuple[dict[str, Any], Loading]) -> None:
    case, loading = pushed
    forces, deflections = np.array(loading.rows).T
    assert np.all(np.diff(forces) > 0.0)
    rows = [row for row in case["curve"] if row[4] > 0.0 and row[1] < deflections[-1]]
    assert len(rows) >= 5
    for force, deflection, *_ in rows:
        # A load as a function of the deflection is smooth at a fold, too.
        assert np.interp(deflection, deflections, forces) == pytest.approx(force, rel=NEAR, abs=1e-9)


def test_the_branch_goes_on_as_the_reference_does(pushed: tuple[dict[str, Any], Loading]) -> None:
    case, loading = pushed
    assert loading.snap is not None
    past = np.array([point[:2] for point in loading.branch if point.unstable])
    curve = CubicSpline(past[:, 1], past[:, 0])
    unstable = (row for row in case["curve"] if row[4] < 0.0)
    rows = [row for row in takewhile(lambda row: row[0] > 0.0, unstable) if row[1] > past[0, 1]]
    assert len(rows) >= 5
    for force, deflection, *_ in rows:
        assert float(curve(deflection)) == pytest.approx(force, abs=NEAR * loading.snap.force)


def test_a_symmetric_push_does_not_stay_on_the_dead_branch() -> None:
    unit = 1.0 / 0.6**2
    centred = load(arch(), Push(step=5.0)).snap
    beside = load(arch(), Push(at=0.502, step=5.0)).snap
    assert centred is not None
    assert beside is not None
    assert centred.kind == "bifurcation"
    assert centred.force / unit == pytest.approx(59.91928012574, rel=NEAR)
    assert beside.kind == "fold"
    assert beside.force / unit == pytest.approx(56.3289, rel=NEAR)


def test_stiffness_is_the_slope_of_the_curve_and_what_single_states_say() -> None:
    scene = shape("staggered-up-peak")
    loading = load(scene, Push(at=0.4, direction="1,-1", step=0.01, most=0.05))
    assert loading.stiffness is not None
    forces, deflections = np.array(loading.rows).T
    slope = np.polynomial.polynomial.polyfit(deflections, forces, 3)[1]
    assert loading.stiffness == pytest.approx(slope, rel=1e-5)
    places = []
    for force in (0.02, -0.02):
        rod = changed(loading.stand.rod, loads=((0.4, force * math.sqrt(0.5), -force * math.sqrt(0.5)),))
        (peak,) = (state for state in find_states(rod, 1e-7) if state.name == "peak")
        places.append(peak.curve(1001)[400])
    moved = (places[0] - places[1]) @ [math.sqrt(0.5), -math.sqrt(0.5)]
    assert loading.stiffness == pytest.approx(0.04 / moved, rel=1e-3)


def test_what_the_load_does_is_what_the_rod_takes_up() -> None:
    loading = load(shape("level-up-peak"), Push(at=0.3, step=0.05, most=4.0))
    forces, deflections = np.array(loading.rows).T
    begin = loading.stand.place(loading.stand.state)[1] - loading.stand.rod.free_start[1]
    # The energy counts the load's potential from where the free rod begins.
    gained = loading.last.energy - loading.stand.state.energy
    assert gained - forces[-1] * (begin - deflections[-1]) == pytest.approx(np.trapezoid(forces, deflections), rel=1e-4)


def test_the_neutral_peak_snaps_to_the_valley_and_a_pull_does_not() -> None:
    scene = shape("level-neutral-peak")
    told: list[int] = []
    down = load(scene, Push(), told.append)
    assert told[0] == 0
    assert told[-1] == 100
    assert told == sorted(told)
    assert down.snap is not None
    assert [landing[:2] for landing in down.snap.landings] == [("valley", "valley")]
    assert down.stand.state.name == "peak"
    assert [force for force, _ in down.rows[:-1]] == [0.5 * number for number in range(len(down.rows) - 1)]
    pull = load(scene, Push(direction="0,2"))
    assert pull.snap is None
    assert pull.rows[-1][0] == 20.0
    assert all(deflection > 0.0 for _, deflection in pull.rows[1:])
    assert pull.stiffness == pytest.approx(down.stiffness, rel=1e-6)
    pulled_back = load(scene, Push(direction="0,1", state="valley"))
    assert pulled_back.snap is not None
    assert pulled_back.snap.landings[0][:2] == ("peak", "peak")


def test_loads_of_the_file_stay_on() -> None:
    bare = load(shape("level-up-peak"), Push(at=0.4))
    loaded_scene = replace(shape("level-up-peak"), loads=(Load(0, 0.4, (0.0, -1.5)), Load(0, 0.7, (0.0, 0.0))))
    loaded = load(loaded_scene, Push(at=0.4))
    assert bare.snap is not None
    assert loaded.snap is not None
    assert loaded.snap.force + 1.5 == pytest.approx(bare.snap.force, rel=1e-5)
    beyond = replace(loaded_scene, loads=(Load(0, 0.4, (0.0, -1.05 * bare.snap.force)),))
    with pytest.raises(
        Infeasible, match="the peak does not withstand the loads in the file; under them there is valley"
    ):
        load(beyond, Push())


def test_a_segment_among_several_is_pushed_as_if_alone() -> None:
    single = shape("staggered-up-peak")
    display = read_display("quad")
    flat = Node(0.0, 0.0)
    short = Segment(mm(580.0), "peak")
    scene = Scene("row", display, (flat, *single.nodes, flat, flat), (short, single.segments[0], short, short))
    one, among = load(single, Push(at=0.6)), load(scene, Push(segment=1, at=0.6))
    assert one.snap is not None
    assert among.snap is not None
    assert among.snap.force == pytest.approx(one.snap.force, rel=1e-9)
    assert among.stand.origin == (pytest.approx(0.5), single.nodes[0].height)


def test_a_narrow_rod_leaves_its_plane_before_it_snaps() -> None:
    display = read_display("single")
    level = Node(0.0, 0.0), Node(0.0, 0.0)
    scene = Scene("strip", display, level, (Segment(mm(600.0), "peak"),))
    assert load(scene, Push()).leaves_plane is None
    narrow = replace(display, rod=replace(display.rod, section=Rectangle(mm(3.0), mm(2.4))))
    loading = load(replace(scene, display=narrow), Push(step=0.1))
    assert loading.leaves_plane is not None
    assert loading.snap is not None
    point = load_map(replace(scene, display=narrow), Push(), 3).points[1]
    assert point.at == 0.5
    assert point.leaves_plane == pytest.approx(loading.leaves_plane, rel=1e-3)
    for factor, stays in ((0.97, True), (1.03, False)):
        loaded = replace(scene, display=narrow, loads=(Load(0, 0.5, (0.0, -factor * loading.leaves_plane)),))
        (segment,) = curveline.simulate(loaded, model="planar")
        (peak,) = (state for state in segment.states if state.mean_height > 0.0)
        assert peak.leaves_plane is not stays


def test_directions() -> None:
    assert direction_of("down", 0.3) == (0.0, -1.0)
    assert direction_of("3,-4", 0.3) == pytest.approx((0.6, -0.8))
    for angle, expected in ((0.0, (0.0, -1.0)), (deg(60.0), (math.sqrt(0.75), -0.5)), (deg(180.0), (0.0, -1.0))):
        assert direction_of("normal", angle) == pytest.approx(expected, abs=1e-12)
    stand = stand_of(shape("level-up-peak"), Push(at=0.2, direction="normal"))
    before, after = stand.state.curve(1001)[[199, 201]]
    assert (after - before) @ stand.toward == pytest.approx(0.0, abs=1e-6)
    assert stand.toward[1] < 0.0


@pytest.mark.parametrize("text", ["", "up", "1", "1,2,3", "0,0", "nan,1", "inf,0", "a,b"])
def test_a_direction_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(InvalidInput, match="points nowhere"):
        direction_of(text, 0.0)


def test_what_cannot_be_pushed_is_refused() -> None:
    scene = shape("level-up-peak")
    for push, message in (
        (Push(segment=1), "there is no segment 2"),
        (Push(segment=-1), "there is no segment 0"),
        (Push(at=0.01), "inside a node's bearing"),
        (Push(at=0.99), "inside a node's bearing"),
        (Push(at=math.nan), "inside a node's bearing"),
        (Push(step=1e-4, most=20.0), "more than 10000 rows"),
        (Push(step=math.nan), "never ends"),
        (Push(most=math.inf), "never ends"),
    ):
        with pytest.raises(InvalidInput, match=message):
            load(scene, push)
    with pytest.raises(InvalidInput, match="does not tell what a finger does"):
        load_map(scene, Push(most=3.0), 5)
    with pytest.raises(InvalidInput, match="yaw at node 1, and pushing is computed in the plane"):
        load(replace(scene, nodes=(replace(scene.nodes[0], yaw=0.1), scene.nodes[1])), Push())
    with pytest.raises(Infeasible, match="has no stable middle-1 to push; there is peak and valley"):
        load(scene, Push(state="middle-1"))


def test_the_largest_push_suits_the_rod() -> None:
    assert most_on(stand_of(shape("level-up-peak"), Push()).rod) == 20.0
    assert most_on(stand_of(arch(1.0), Push()).rod) == 2000.0
    assert most_on(stand_of(arch(1e-4), Push()).rod) == pytest.approx(0.2)
    assert load(shape("level-up-peak"), Push(at=0.4)).push.step == 0.5


def test_a_map_knows_the_weakest_point_and_where_a_finger_is_too_strong() -> None:
    scene = shape("level-up-peak")
    told: list[int] = []
    found = load_map(scene, Push(direction="normal"), 8, told.append)
    assert told == list(range(1, 9))
    assert found.weakest is not None
    assert found.weakest.force is not None
    strengths = [math.inf if point.force is None else point.force for point in found.points]
    assert found.weakest.force < min(strengths)
    for at, force in [(found.weakest.at, found.weakest.force), (found.points[3].at, strengths[3])]:
        alone = load(scene, Push(at=at, direction="normal"))
        assert alone.snap is not None
        assert alone.snap.force == pytest.approx(force, rel=1e-5)
    for beside in (found.weakest.at - 0.004, found.weakest.at + 0.004):
        limit = limit_of(stand_of(scene, Push(at=beside, direction="normal")), 20.0)
        assert limit is not None
        assert limit.force > found.weakest.force
    searching, lightly, firmly = found.verdicts
    assert searching.everywhere
    assert lightly.everywhere
    for begin, end in firmly.stretches:
        for at, yields in ((begin - 0.01, False), (begin + 0.01, True), (end - 0.01, True), (end + 0.01, False)):
            assert (limit_of(stand_of(scene, Push(at=at, direction="normal")), 5.0) is not None) == yields


def test_two_ways_off_a_bifurcation_that_differ_are_both_told() -> None:
    loading = load(shape("level-up-peak"), Push(step=3.0))
    assert loading.snap is not None
    (one,) = loading.snap.landings
    other = one._replace(name="peak", released="peak")
    found = document(replace(loading, snap=replace(loading.snap, landings=(one, other))))
    assert (found["lands_in"], found["released_in"]) == ("valley|peak", "valley|peak")
    assert [way["lands_in"] for way in found["ways"]] == ["valley", "peak"]
    assert len(found["landed_mm"]) == 2


def test_rows_come_as_near_to_the_snap_as_they_are_asked_to() -> None:
    scene = replace(shape("level-up-peak"), display=bare_display(80.0 * 0.028224))
    push = Push(at=0.12, step=1.0)
    limit = limit_of(stand_of(scene, push), 2000.0)
    assert limit is not None
    push = push._replace(step=limit.force / 40.0 * (1.0 - 1e-5), most=2000.0)
    loading = load(scene, push)
    assert len(loading.rows) == 42
    forces, deflections = np.array(loading.rows).T
    assert np.all(np.diff(deflections) > 0.0)
    assert forces[-2] == pytest.approx(forces[-1], rel=2e-5)


def test_a_nearly_straight_rod_is_let_stretch_where_that_matters() -> None:
    scene = replace(arch(0.028224), nodes=(Node(0.0, 0.0), Node(0.0, 0.0)), segments=(Segment(mm(503.0), "peak"),))
    push = Push(at=0.45, step=0.02)
    free, stiff = load(scene, push), load(scene, push._replace(model="planar"))
    assert (free.stand.state.model, stiff.stand.state.model) == ("extensible", "planar")
    assert free.snap is not None
    assert stiff.snap is not None
    assert 0.01 < 1.0 - free.snap.force / stiff.snap.force < 0.2
    assert free.snap.landings[0][:2] == ("valley", "valley")
    for loading in (free, stiff):
        assert loading.snap is not None
        deflections = np.array(loading.rows)[:, 1]
        assert np.all(np.diff(deflections) > 0.0)
        past = np.array([(point.force, point.deflection) for point in loading.branch])
        # The row at the snap-through lies at the top of the branch that was traced over it.
        curve = CubicSpline(past[:, 1], past[:, 0])
        assert float(curve(deflections[-1])) == pytest.approx(loading.snap.force, rel=1e-4)
        assert float(curve(deflections[-1], 1)) == pytest.approx(0.0, abs=0.02 * loading.stiffness)
    for force in (0.98, 1.01):
        loaded = replace(scene, loads=(Load(0, 0.45, (0.0, -force * free.snap.force)),))
        (segment,) = curveline.simulate(loaded, model="extensible")
        assert any(state.name == "peak" for state in segment.states) == (force < 1.0)
    with pytest.raises(InvalidInput, match="a push has no model 'spatial'"):
        load(scene, push._replace(model="spatial"))
