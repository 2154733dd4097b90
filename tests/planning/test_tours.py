"""From shape to shape and home again: directly where the state is kept, else through a funnel; played, it is so."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from curveline.errors import InvalidInput
from curveline.plan_file import Plan, from_json, to_json
from curveline.planning.tours import make_home_plan, make_plan, make_round_trip, make_tour, start_at
from curveline.replay.playback import replay
from curveline.scene import STRAIGHT
from playing import SHAPES, Counts, counts_of, motion, scene
from rows import row

from .boxes import uneven_motion

LONE = [name for name in SHAPES if len(scene(name).segments) == 1]
PEAKS = [name for name in LONE if name.endswith("peak")]
VALLEYS = [name for name in LONE if name.endswith("valley")]
SINGLE = scene(LONE[0]).display
FUNNEL = "bias past the fold"


@cache
def tour_of(*names: str) -> Plan:
    return make_tour([scene(name) for name in names])


def stretches(of: Plan) -> Iterator[Plan]:
    """A tour in parts, each up to the step that completes a shape."""
    begin, steps = of.start, []
    for step in of.steps:
        steps.append(step)
        if step.shape:
            yield replace(of, name=step.shape, start=begin, steps=tuple(steps))
            begin, steps = step.targets, []
    assert not steps


def funnels(of: Plan) -> int:
    return sum(step.margin_of.startswith(FUNNEL) for step in of.steps)


def check_arrival(of: Plan, name: str) -> None:
    """The last step ends where the shape has its nodes and lengths."""
    counts, states = start_at(scene(name))
    assert counts_of(of.steps[-1].targets) == counts
    assert of.steps[-1].states == states


def test_all_shapes_in_a_row_are_shown_one_after_the_other_however_unevenly_nodes_move() -> None:
    tour = tour_of(*LONE)
    chance = np.random.default_rng(6)
    for uneven in (False, True):
        shown: tuple[str, ...] = ("",)
        names = []
        for stretch in stretches(tour):
            names.append(stretch.name)
            check_arrival(stretch, stretch.name)
            played = replay(SINGLE, uneven_motion(stretch, chance) if uneven else motion(stretch, lag=0.4), shown)
            shown = played.states
            assert shown == tuple(segment.state for segment in scene(stretch.name).segments)
        assert names == LONE
    assert tour.wanted == shown
    assert tour.name == ", ".join(LONE)
    assert [step.number for step in tour.steps] == list(range(1, len(tour.steps) + 1))


@pytest.mark.parametrize("names", [PEAKS, VALLEYS, PEAKS[::-1]], ids=["peaks", "valleys", "back"])
def test_among_shapes_of_one_state_the_way_is_direct(names: list[str]) -> None:
    first, *others = stretches(tour_of(*names))
    assert funnels(first) == 1
    shown: tuple[str, ...] = first.wanted
    for stretch in others:
        assert funnels(stretch) == 0
        assert len(stretch.steps) <= 3
        played = replay(SINGLE, motion(stretch, lag=0.3), shown)
        assert played.snaps == ()
        assert played.start == played.states == shown


@pytest.mark.parametrize(("before", "after"), list(itertools.pairwise(LONE))[::5])
def test_to_another_state_the_way_leads_through_the_funnel(before: str, after: str) -> None:
    there, back = (list(stretches(tour_of(*pair)))[1] for pair in ((before, after), (after, before)))
    for stretch, shown in ((there, before), (back, after)):
        assert funnels(stretch) == 1
        played = replay(SINGLE, motion(stretch), start_at(scene(shown))[1])
        assert len(played.snaps) == 1


@pytest.mark.parametrize("known", [(), ("",), ("middle-1",), ("straight",), ("nonsense",)])
def test_from_a_state_that_is_not_known_the_way_leads_through_the_funnel(known: tuple[str, ...]) -> None:
    counts, (state,) = start_at(scene(PEAKS[0]))
    sure, unsure = (make_plan(scene(PEAKS[1]), counts, shows) for shows in ((state,), known))
    assert (funnels(sure), funnels(unsure)) == (0, 1)
    # Whatever it was, it ends as it should.
    for shown in ("peak", "valley"):
        assert replay(SINGLE, motion(unsure), (shown,)).states == unsure.wanted


def test_one_unknown_segment_of_a_row_sends_all_of_it_through_funnels() -> None:
    scene_of_row = row(3)
    counts, states = start_at(scene_of_row)
    goal = replace(row(3, seed=8), display=scene_of_row.display)
    for shows in (states, (*states[:2], "")):
        made = make_plan(goal, counts, shows)
        assert (funnels(made) > 0) == (shows != states)
        assert replay(scene_of_row.display, motion(made, lag=0.1), states).states == made.wanted


def counts_at(feed_mm: float, *nodes: tuple[float, float]) -> tuple[Counts, ...]:
    """Nodes at heights [mm] and angles [deg]; the first has fed `feed_mm` to the right, the second as much back."""
    drive = SINGLE.drive
    sides = (feed_mm, -feed_mm)
    return tuple(
        (
            round(1e-3 * feed * drive.extrude.counts_per_unit),
            round(np.radians(angle) * drive.bias.counts_per_unit),
            round(1e-3 * height * drive.translate.counts_per_unit),
        )
        for feed, (height, angle) in zip(sides, nodes, strict=True)
    )


FAR = {
    "low and crossed": counts_at(190.0, (-200.0, 70.0), (150.0, 60.0)),
    "pushed together": counts_at(200.0, (0.0, -70.0), (0.0, 75.0)),
    "hardly any rod": counts_at(3.0, (0.0, 0.0), (0.0, 0.0)),
    "off the middle": tuple(
        (each[0] + 40_000, each[1], each[2]) for each in counts_at(100.0, (50.0, 5.0), (60.0, 9.0))
    ),
}


@pytest.mark.parametrize("where", FAR)
def test_from_anywhere_a_shape_is_reached_and_home_is(where: str) -> None:
    for goal in (PEAKS[3], VALLEYS[6]):
        made = make_plan(scene(goal), FAR[where])
        assert counts_of(made.start) == FAR[where]
        check_arrival(made, goal)
        for shown in ("peak", "valley"):
            assert replay(SINGLE, uneven_motion(made, np.random.default_rng(2)), (shown,)).states == made.wanted
    home = make_home_plan(SINGLE, FAR[where])
    assert counts_of(home.steps[-1].targets) == ((0, 0, 0), (0, 0, 0))
    assert replay(SINGLE, motion(home), ("peak",)).states == (STRAIGHT,)


@pytest.mark.parametrize("name", LONE)
def test_from_every_shape_the_display_goes_home(name: str) -> None:
    counts, states = start_at(scene(name))
    for known in (states, ()):
        made = make_home_plan(SINGLE, counts, known)
        assert made.wanted == (STRAIGHT,)
        assert made.lengths_mm == (pytest.approx(500.0),)
        assert made.steps[-1].states == (STRAIGHT,)
        assert counts_of(made.steps[-1].targets) == ((0, 0, 0), (0, 0, 0))
        for shown in ("peak", "valley"):
            assert replay(SINGLE, uneven_motion(made, np.random.default_rng(1)), (shown,)).states == (STRAIGHT,)


def test_a_round_trip_comes_home_after_its_shapes() -> None:
    names = (PEAKS[1], VALLEYS[4])
    made = make_round_trip([scene(name) for name in names])
    assert [step.shape for step in made.steps if step.shape] == [*names, "home"]
    assert counts_of(made.steps[-1].targets) == counts_of(made.start) == ((0, 0, 0), (0, 0, 0))
    assert replay(SINGLE, motion(made, lag=0.3)).states == made.wanted == (STRAIGHT,)


def test_a_tour_of_two_displays_is_refused() -> None:
    with pytest.raises(InvalidInput, match="is for display row-2, not single") as caught:
        make_tour([scene(LONE[0]), row(2)])
    assert caught.value.hint


def test_what_was_proven_and_where_shapes_are_complete_survives_the_file() -> None:
    made = tour_of(*PEAKS)
    again = from_json(to_json(made), "plan.json")
    assert again == made
    assert [step.shape for step in again.steps if step.shape] == PEAKS
    assert [step.corners for step in again.steps] == [step.corners for step in made.steps]
    assert sum(step.corners for step in again.steps) > 50
