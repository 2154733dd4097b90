"""Plans lead through a funnel to the wanted state, in numbers a display can follow, or are refused with the reason."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from curveline.drive_settings import AXES
from curveline.errors import EXIT_NO, EXIT_USAGE, Infeasible, InvalidInput
from curveline.plan_file import NodeTarget, Plan, from_json, to_json
from curveline.planning.tours import make_plan
from curveline.rod.states.planar_states import find_states
from curveline.scene import Display, Load, Node, Scene, Segment
from curveline.sections import Rectangle
from curveline.simulation.simulate import clamped_rod
from curveline.units import deg, mm, to_deg, to_mm
from playing import SHAPES, counts_of, next_plan, plan, scene

NAMES = list(SHAPES)
CHAIN = list(itertools.pairwise(NAMES))
FIVE = ["extrude", "bias", "extrude", "bias", "translate"]


def names_at(display: Display, targets: tuple[NodeTarget, ...]) -> list[str]:
    """States a display can show where the nodes have these targets, worked out from the counts alone."""
    per_mm = display.drive.extrude.counts_per_unit
    left, right = (
        Node(
            target.counts[2] / display.drive.translate.counts_per_unit,
            target.counts[1] / display.drive.bias.counts_per_unit,
        )
        for target in targets
    )
    length = display.span + (targets[0].counts[0] - targets[1].counts[0]) / per_mm
    return [state.name for state in find_states(clamped_rod(display, (left, right), length), 1e-5) if state.simple]


@pytest.mark.parametrize("name", NAMES)
def test_every_shape_is_planned_in_the_papers_five_steps(name: str) -> None:
    made, (segment,) = plan(name), scene(name).segments
    assert made.name == name
    assert made.wanted == (segment.state,)
    assert [step.action for step in made.steps] == FIVE
    assert [step.number for step in made.steps] == [1, 2, 3, 4, 5]
    assert counts_of(made.start) == ((0, 0, 0), (0, 0, 0))
    goal = made.steps[-1]
    for target, node in zip(goal.targets, scene(name).nodes, strict=True):
        assert target.bias_deg == pytest.approx(to_deg(node.angle))
        assert target.translate_mm == pytest.approx(to_mm(node.height))
    assert goal.lengths_mm == made.lengths_mm == (pytest.approx(to_mm(segment.length)),)
    assert all(step.states == (segment.state,) for step in made.steps[1:])


@pytest.mark.parametrize("name", NAMES)
def test_after_the_funnel_only_the_wanted_state_exists(name: str) -> None:
    made = plan(name)
    display, wanted = scene(name).display, made.wanted[0]
    first, second, *rest = [names_at(display, step.targets) for step in made.steps]
    assert sorted(first) == ["peak", "valley"]
    assert second == [wanted]
    assert all(wanted in names for names in rest)
    assert made.steps[1].margin >= 0.15
    assert "fold" in made.steps[1].margin_of


@pytest.mark.parametrize("name", NAMES)
def test_the_margin_of_the_funnel_is_the_bias_it_could_do_without(name: str) -> None:
    made = plan(name)
    display, bias = scene(name).display, made.steps[1]
    for spare, count in ((-0.03, 2), (0.01, 1)):
        share = (1.0 + spare) / (1.0 + bias.margin)
        left, right = (Node(0.0, share * deg(target.bias_deg)) for target in bias.targets)
        assert len(find_states(clamped_rod(display, (left, right), mm(bias.lengths_mm[0])), 1e-5)) == count


def every_plan() -> list[Plan]:
    return [*(plan(name) for name in NAMES), *(next_plan(after, before) for before, after in CHAIN)]


def test_counts_lengths_and_times_follow_from_the_targets() -> None:
    for made in every_plan():
        span = to_mm(scene(made.name).display.span)
        before = made.start
        for step in made.steps:
            slowest = 0.0
            for old, new in zip(before, step.targets, strict=True):
                ways = zip(position(old), position(new), new.counts, made.drive.axes, strict=True)
                for begin, end, counts, axis in ways:
                    assert counts == round(end * axis.counts_per_unit)
                    assert axis.low <= end <= axis.high
                    slowest = max(slowest, fastest(abs(end - begin), axis.speed, axis.acceleration))
            assert step.seconds == pytest.approx(slowest, abs=1.001e-3)
            assert step.seconds >= slowest - 1e-9
            left, right = step.targets
            assert step.lengths_mm == (pytest.approx(span + left.extrude_mm - right.extrude_mm),)
            before = step.targets
        assert made.seconds == pytest.approx(sum(step.seconds for step in made.steps))


def position(target: NodeTarget) -> tuple[float, ...]:
    return tuple(getattr(target, f"{axis}_{'deg' if axis == 'bias' else 'mm'}") for axis in AXES)


def fastest(way: float, speed: float, acceleration: float) -> float:
    """Time from rest to rest: a triangle or a trapezoid of speed, the area under which is the way."""
    peak = min(speed, math.sqrt(way * acceleration))
    return 2.0 * peak / acceleration + (way - peak**2 / acceleration) / peak if peak > 0.0 else 0.0


def test_rod_and_motors_are_never_asked_for_more_than_they_give() -> None:
    for made in every_plan():
        display = scene(made.name).display
        for step in made.steps:
            assert 0.0 < step.max_strain <= display.rod.max_strain
            assert 0.0 < step.max_force_N <= display.drive.max_force
            assert 0.0 < step.max_moment_Nmm <= 1e3 * display.drive.max_moment
            assert display.limits.length.contains(mm(step.lengths_mm[0]), 1e-9)
            assert step.margin >= 0.05


@pytest.mark.parametrize("name", NAMES[:3])
def test_plans_survive_their_file(name: str) -> None:
    assert from_json(to_json(plan(name)), "plan.json") == plan(name)


@pytest.mark.parametrize(("before", "after"), CHAIN)
def test_from_another_shape_the_display_first_returns_to_level(before: str, after: str) -> None:
    made = next_plan(after, before)
    assert counts_of(made.start) == counts_of(plan(before).steps[-1].targets)
    back = [step.action for step in made.steps[:-5]]
    heights = max(abs(target.translate_mm) for target in made.start)
    angles = max(abs(target.bias_deg) for target in made.start)
    assert back == ["level"] * (heights > 0.1) + ["neutral"] * (angles > 0.1)
    assert [step.action for step in made.steps[-5:]] == FIVE
    assert [step.number for step in made.steps] == list(range(1, len(made.steps) + 1))
    assert names_at(scene(after).display, made.steps[-4].targets) == [made.wanted[0]]
    if back:
        level = made.steps[len(back) - 1].targets
        assert max(abs(target.translate_mm) for target in level) == 0.0
        assert max(abs(target.bias_deg) for target in level) == (0.0 if "neutral" in back else angles)


BASE = "level-neutral-peak"


def posed(height: float, start: float, end: float, length: float, state: str) -> Scene:
    """A shape on the built-in display, in mm and deg."""
    nodes = (Node(0.0, deg(start)), Node(mm(height), deg(end)))
    return replace(scene(BASE), nodes=nodes, segments=(Segment(mm(length), state),))


def with_rod(**changes: Any) -> Scene:
    display = scene(BASE).display
    return replace(scene(BASE), display=replace(display, rod=replace(display.rod, **changes)))


def with_drive(**changes: float) -> Scene:
    display = scene(BASE).display
    return replace(scene(BASE), display=replace(display, drive=replace(display.drive, **changes)))


def loaded(newton: float) -> Scene:
    return replace(scene(BASE), loads=(Load(0, 0.5, (0.0, -newton)),))


BAND, SQUARE = Rectangle(0.03, 0.01), Rectangle(0.003, 0.003)

REFUSED: list[tuple[str, Callable[[], Scene], str]] = [
    ("no such state", lambda: posed(0, 60, -60, 560, "valley"), r"no stable valley at .*it has: peak"),
    ("too tight a bend", lambda: with_rod(max_strain=0.005), r"bend to a radius of \d+ mm, its strain allows 240 mm"),
    ("a thicker rod", lambda: with_rod(section=BAND, youngs_modulus=1e7), r"bend to a radius of \d+ mm"),
    ("weak extrude motor", lambda: with_drive(max_force=2.0), r"extruding takes [\d.]+ N, the motor gives 2.0 N"),
    ("weak bias motor", lambda: with_drive(max_moment=0.1), r"biasing takes \d+ N mm, the motor gives 100 N mm"),
    ("a square rod", lambda: with_rod(section=SQUARE), r"the peak at .* would leave the plane"),
    ("loads", lambda: loaded(9.0), r"snaps at 5\d % of its loads; it must withstand 125 %"),
    ("loads near the snap", lambda: loaded(4.5), r"snaps at 11\d % of its loads; it must withstand 125 %"),
]


@pytest.mark.parametrize(("what", "build", "reason"), REFUSED, ids=[row[0] for row in REFUSED])
def test_a_plan_that_is_not_safe_is_refused_with_the_reason(what: str, build: Callable[[], Scene], reason: str) -> None:
    with pytest.raises(Infeasible, match=reason) as caught:
        make_plan(build())
    assert caught.value.exit_code == EXIT_NO
    assert caught.value.hint
    assert caught.value.message.startswith(BASE)


def test_a_limit_that_leaves_no_room_for_a_funnel_is_said() -> None:
    display = scene(BASE).display
    limits = replace(display.limits, angle=replace(display.limits.angle, low=-0.1, high=0.1))
    with pytest.raises(Infeasible, match="no room for a funnel"):
        make_plan(replace(scene(BASE), display=replace(display, limits=limits)))


def test_loads_that_a_shape_withstands_change_no_move_and_count_in_its_last_step() -> None:
    laden = replace(scene(BASE), loads=(Load(0, 0.5, (0.0, -1.0)), Load(0, 0.3, (0.2, -0.5))))
    made, bare = make_plan(laden), plan(BASE)
    assert [step.targets for step in made.steps] == [step.targets for step in bare.steps]
    assert made.steps[:-1] == bare.steps[:-1]
    assert made.steps[-1].max_force_N > bare.steps[-1].max_force_N
    assert made.steps[-1].max_strain > bare.steps[-1].max_strain
    assert made.steps[-1].margin < bare.steps[-1].margin
    assert made.steps[-1].margin_of.endswith(" under the loads")


def test_where_the_recipe_fails_another_way_is_found() -> None:
    # At the goal the peak is stable, but not with level nodes, where the recipe passes.
    made = make_plan(posed(79, -29.1, 52.0, 626, "peak"))
    assert [step.action for step in made.steps[:3]] == ["extrude", "bias", "extrude"]
    assert [step.action for step in made.steps] != FIVE
    assert made.steps[-1].states == ("peak",)
    assert min(step.margin for step in made.steps) >= 0.05


def test_what_no_motor_of_a_node_can_do_is_invalid_input() -> None:
    flat = scene(BASE)
    left, right = flat.nodes
    leaning = replace(flat.display, down=(0.0, -0.8, -0.6))
    refused = {
        "yaw at node 1": replace(flat, nodes=(replace(left, yaw=0.1), right)),
        "roll at node 2": replace(flat, nodes=(left, replace(right, roll=-6.28))),
        "gravity that does not": replace(flat, display=leaning),
        "a rod curved out of": replace(
            flat, display=replace(flat.display, rod=replace(flat.display.rod, lateral_curvature=0.1))
        ),
    }
    for reason, unplanned in refused.items():
        with pytest.raises(InvalidInput, match=reason) as caught:
            make_plan(unplanned)
        assert caught.value.exit_code == EXIT_USAGE
        assert caught.value.hint
    assert replace(flat, display=replace(leaning, gravity=False)).beyond_the_plane == ()
