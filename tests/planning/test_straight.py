"""Segments that are to be straight: planned without a funnel, also beside curved ones; what cannot be, and why."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from curveline.errors import Infeasible
from curveline.plan_file import Plan
from curveline.planning.reachability import entry_to
from curveline.planning.reproof import prove_again
from curveline.planning.tours import make_plan, make_round_trip, make_tour, start_at
from curveline.planning.verification import Verifier
from curveline.replay.monte_carlo import Setup, run_trials
from curveline.replay.playback import replay
from curveline.scene import Load, Node, Scene, Segment
from curveline.shapes.files import read_display
from curveline.simulation.simulate import simulate
from curveline.units import deg, mm
from playing import counts_of, motion

from .boxes import uneven_motion

DISPLAYS = {count: read_display(name) for count, name in ((2, "single"), (5, "quad"))}
SPAN = 500.0
ROOF = math.degrees(math.atan2(50.0, SPAN))
SLANTED = math.hypot(SPAN, 50.0)


def shape(heights: Sequence[float], angles: Sequence[float], lengths: Sequence[float], states: str) -> Scene:
    """A shape in mm and degrees, whose segments are `straight`, `peak` or `valley`: s, p or v."""
    names = [{"s": "straight", "p": "peak", "v": "valley"}[each] for each in states]
    nodes = tuple(Node(mm(height), deg(angle)) for height, angle in zip(heights, angles, strict=True))
    segments = tuple(Segment(mm(length), name) for length, name in zip(lengths, names, strict=True))
    return Scene(states, DISPLAYS[len(nodes)], nodes, segments)


def line(count: int, begin: float, rise: float) -> Scene:
    """Nodes on a line that rises from node to node, and points along it."""
    along, length = math.degrees(math.atan2(rise, SPAN)), math.hypot(SPAN, rise)
    heights = [begin + rise * node for node in range(count)]
    return shape(heights, [along] * count, [length] * (count - 1), "s" * (count - 1))


def waves(count: int, height: float) -> Scene:
    """Half waves between level nodes: parabolas, which a rod without tension takes; straight if they are low."""
    slope, spare = 4.0 * height / SPAN, 8.0 * height**2 / (3.0 * SPAN)
    angles = [math.degrees(slope) * (-1) ** node for node in range(count)]
    states = "s" * (count - 1) if spare < 0.2 else "".join("pv"[segment % 2] for segment in range(count - 1))
    return shape([0.0] * count, angles, [SPAN + spare] * (count - 1), states)


SHAPES = {
    "home": line(2, 0.0, 0.0),
    "raised": line(2, 100.0, 0.0),
    "slanted": line(2, 0.0, 150.0),
    "row raised": line(5, 150.0, 0.0),
    "row rising": line(5, 0.0, 30.0),
    "row falling": line(5, 200.0, -45.0),
    "peak between": shape([0] * 5, [0] * 5, [500, 600, 500, 500], "spss"),
    "both between": shape([0, 0, 50, 50, 0], [0] * 5, [500, 620, 500, 620], "spsv"),
    "roof": shape(
        [100, 150, 150, 100, 50], [ROOF, ROOF, -ROOF, -ROOF, -ROOF], [SLANTED, 560, SLANTED, SLANTED], "spss"
    ),
    "straight end": shape([0] * 5, [20, -20, 20, 0, 0], [560, 560, 560, 500], "pvps"),
    **{f"waves of {height} mm": waves(5, height) for height in (2, 4, 6)},
    **{f"wave of {height} mm": waves(2, height) for height in (2, 3, 4, 5, 6, 8, 10)},
}


def states_of(scene: Scene) -> tuple[str, ...]:
    return tuple(segment.state for segment in scene.segments)


@pytest.mark.parametrize("name", SHAPES)
def test_it_is_planned_and_ends_there_however_unevenly_nodes_move(name: str) -> None:
    scene = SHAPES[name]
    plan = make_plan(scene)
    assert plan.wanted == plan.steps[-1].states == states_of(scene)
    assert counts_of(plan.steps[-1].targets) == start_at(scene)[0]
    chance = np.random.default_rng(5)
    frames = [motion(plan), *(uneven_motion(plan, chance) for _ in range(4))]
    assert all(replay(scene.display, each).states == plan.wanted for each in frames)
    prove_again(plan, scene.display)


@pytest.mark.parametrize("name", ["raised", "row falling", "roof", "waves of 6 mm"])
def test_it_is_left_for_home_again(name: str) -> None:
    scene = SHAPES[name]
    plan = make_round_trip([scene])
    assert plan.wanted == ("straight",) * len(scene.segments)
    assert plan.name == f"{scene.name}, home"
    there = next(step for step in plan.steps if step.shape == scene.name)
    assert there.states == states_of(scene)
    chance = np.random.default_rng(6)
    for _ in range(3):
        assert replay(scene.display, uneven_motion(plan, chance)).states == plan.wanted


def test_a_straight_shape_alone_does_not_end_home() -> None:
    assert make_plan(SHAPES["raised"]).name == "s"


def test_a_level_line_at_home_is_one_step_and_a_raised_one_takes_a_detour() -> None:
    assert [step.action for step in make_plan(SHAPES["home"]).steps] == ["move"]
    assert [step.action for step in make_plan(SHAPES["raised"]).steps] == ["extrude", "translate", "extrude"]


@pytest.mark.parametrize(
    ("height", "angle", "spare", "state"),
    [
        (0, 0.6, -0.03, "s"),
        (2, 1.45, 0.06, "s"),
        (4, 1.7, 0.11, "s"),
        (6, 2.39, 0.2, "s"),
        (7, 2.69, 0.25, "s"),
        (8, 2.87, 0.35, "p"),
        (10, 3.58, 0.5, "p"),
        (-2, -0.73, -0.03, "s"),
        (-5, -1.76, 0.11, "s"),
        (-7, -2.45, 0.24, "s"),
        (-10, -3.6, 0.5, "v"),
    ],
)
def test_low_waves_are_shown_to_half_a_millimetre(height: float, angle: float, spare: float, state: str) -> None:
    """What is drawn is half a sine over the span, which hardly has more rod than the line below it."""
    scene = shape([0, 0], [angle, -angle], [SPAN + spare], state)
    make_plan(scene)
    (segment,) = simulate(scene)
    assert segment.wanted is not None
    x, y = segment.wanted.curve(201).T
    assert np.max(np.abs(y - mm(height) * np.sin(math.pi * x / mm(SPAN)))) < mm(0.5)


def funnels(plan: Plan) -> int:
    return sum(step.margin_of.startswith("bias past the fold") for step in plan.steps)


def test_nothing_straight_goes_through_a_funnel() -> None:
    assert funnels(make_plan(SHAPES["row falling"])) == 0
    assert funnels(make_plan(SHAPES["both between"])) == 1
    assert funnels(make_plan(SHAPES["straight end"])) == 2


def test_from_shape_to_shape() -> None:
    names = ["roof", "row rising", "waves of 2 mm", "both between", "row falling"]
    scenes = [SHAPES[name] for name in names]
    plan = make_tour(scenes)
    shown = [step.states for step in plan.steps if step.shape]
    assert shown == [states_of(scene) for scene in scenes]
    chance = np.random.default_rng(7)
    assert replay(scenes[0].display, uneven_motion(plan, chance)).states == plan.wanted
    again = make_plan(SHAPES["row rising"], *start_at(SHAPES["roof"]))
    assert again.granted == ("", "peak", "", "")
    assert again.wanted == ("straight",) * 4


def test_from_a_known_curve_the_rod_is_taken_in_as_it_lies() -> None:
    plan = make_plan(SHAPES["raised"], *start_at(shape([0, 0], [20, -20], [600], "p")))
    assert [step.states for step in plan.steps] == [("peak",)] * (len(plan.steps) - 1) + [("straight",)]
    assert plan.granted == ("peak",)
    prove_again(plan, SHAPES["raised"].display)
    # In any state the rod of this row asks more of a node between two segments than its motor gives.
    row = shape([0] * 5, [20, 0, 0, 0, -20], [600] * 4, "pppp")
    assert make_plan(SHAPES["row raised"], *start_at(row)).wanted == ("straight",) * 4


def test_the_step_that_ends_there_counts_what_the_straight_rod_asks() -> None:
    last = make_plan(waves(2, 2.0)).steps[-1]
    assert last.max_force_N > 0.5
    assert last.max_strain > 1e-4
    # A wave that is pushed is nearer to losing its stability than the straight line that margins are counted in.
    assert (last.margin_of, last.margin < 1.0) == ("stability", True)
    level = make_plan(SHAPES["home"]).steps[-1]
    assert (level.margin_of, level.margin) == ("stability; any state will do", 1.0)


def test_no_mixture_of_uneven_progress_pulls_harder_than_the_motors() -> None:
    # At home the rod has nothing for nodes that are turned this far, while they are not fed yet.
    scene = waves(2, 6.0)
    most = scene.display.drive.max_force
    early = replace(scene, segments=(replace(scene.segments[0], length=scene.display.span),))
    (state,) = simulate(early)[0].states
    assert np.hypot(*state.clamp_force[1]) > most
    plan = make_plan(scene)
    assert len(plan.steps) > 1
    assert max(step.max_force_N for step in plan.steps) <= most


def test_runs_with_errors_end_straight() -> None:
    scene = SHAPES["roof"]
    runs = list(run_trials(Setup(scene.display, make_plan(scene)), range(1, 41)))
    assert sum(run.endings == states_of(scene) for run in runs) >= 38


@pytest.mark.parametrize(
    ("scene", "words", "advice"),
    [
        (
            shape([0, 0], [0, 0], [500.0], "p"),
            "segment 1 has no peak at length 500.0 mm, angles 0.0 and 0.0 deg, right node 0.0 mm above the left, it is "
            'straight: it has no rod to spare: write state = "straight", or give it more than 500.24 mm of rod to bend',
            "length of segment 1 is at fault",
        ),
        (
            shape([0, 0], [0, 0], [508.0], "s"),
            "segment 1 is not straight at length 508.0 mm, angles 0.0 and 0.0 deg, right node 0.0 mm above the left: "
            "the 8 mm of rod that it has to spare bend it: give it the 500 mm that lead straight from node to node, or "
            "ask for a peak or a valley",
            "length of segment 1 is at fault: with 500 mm instead of 508 mm it works",
        ),
        (
            shape([0, 0], [0, 0], [500.2], "s"),
            "segment 1 need not be straight at length 500.2 mm, angles 0.0 and 0.0 deg, right node 0.0 mm above the "
            "left: the 0.2 mm of rod that it has to spare let it lie on either side: give it the 500 mm that lead "
            "straight from node to node, or ask for a peak or a valley",
            "length of segment 1 is at fault: with 500 mm instead of 500.2 mm it works",
        ),
        (
            shape([0, 0], [0, 0], [500.2], "p"),
            "segment 1 has so little rod to spare at length 500.2 mm, angles 0.0 and 0.0 deg, right node 0.0 mm above "
            "the left that play decides whether it is the peak: give it more than 500.24 mm",
            "length of segment 1 is at fault",
        ),
        (
            shape([0, 30], [0, 0], [500.9], "s"),
            "the shape itself: at node 1 extruding takes 14.6 N, the motor gives 8.0 N",
            "is at fault",
        ),
        (
            shape([0, 0], [8, 0], [500.1], "s"),
            "segment 1 is not straight at length 500.1 mm, angles 8.0 and 0.0 deg, right node 0.0 mm above the left: "
            "its nodes point 8.17 deg past each other, and a straight rod takes 5 deg at most: turn them towards the "
            "line between them, at -0.166 deg",
            "is at fault",
        ),
        (
            shape([0, 30], [3.4, 3.4], [500.5], "s"),
            "segment 1 is not straight at length 500.5 mm, angles 3.4 and 3.4 deg, right node 30.0 mm above the left: "
            "it is 0.399 mm too short: give it the 500.899 mm that lead straight from node to node",
            "length of segment 1 is at fault: with 500.9 mm instead of 500.5 mm it works",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_plain_words(scene: Scene, words: str, advice: str) -> None:
    with pytest.raises(Infeasible) as refusal:
        make_plan(scene)
    assert refusal.value.message == f"{scene.name}: {words}"
    assert advice in refusal.value.hint


def test_loads_bend_what_is_straight_and_too_large_ones_are_refused() -> None:
    level = SHAPES["home"]
    plan = make_plan(replace(level, loads=(Load(0, 0.5, (0.0, -0.1)),)))
    assert plan.steps[-1].max_moment_Nmm > make_plan(level).steps[-1].max_moment_Nmm + 1.0
    with pytest.raises(Infeasible, match="under its loads: at node"):
        make_plan(replace(level, loads=(Load(0, 0.5, (0.0, -20.0)),)))
    strong = replace(level.display, gravity=False, drive=replace(level.display.drive, max_force=100.0))
    with pytest.raises(Infeasible, match="of its loads the rod is not sure to stay straight"):
        make_plan(replace(level, display=strong, loads=(Load(0, 0.5, (-60.0, 0.0)),)))


def test_a_plan_is_not_proven_for_a_rod_that_need_not_be_straight() -> None:
    # The weight of the rod leaves it no choice.
    scene = shape([0, 0], [0, 0], [500.1], "s")
    plan = make_plan(scene)
    prove_again(plan, scene.display)
    with pytest.raises(Infeasible, match="segment 1 need not be straight"):
        prove_again(plan, replace(scene.display, gravity=False))


def test_the_entry_to_straight_segments_is_open() -> None:
    for name, kind in (
        ("row falling", "straight"),
        ("roof", "row of peaks"),
        ("straight end", "row of valleys and peaks"),
    ):
        scene = SHAPES[name]
        entry = entry_to(Verifier(scene.display, lambda: None), scene)
        assert (entry.kind, entry.is_open) == (kind, True)
