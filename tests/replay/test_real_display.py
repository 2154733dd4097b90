"""What a display may be in truth: drawn once a run, after all that was drawn before, and what it does to the rod."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from curveline.errors import InvalidInput
from curveline.plan_file import Plan
from curveline.planning.tours import make_plan
from curveline.replay import monte_carlo
from curveline.replay.kept_curvature import with_kept
from curveline.replay.monte_carlo import Errors, Setup, course_of, draw, play_run
from curveline.replay.playback import known_state, name_of
from curveline.replay.real_display import SHARES, held_back, real_display
from curveline.rod.branches.quasi_static import State
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.showable import showable_states
from curveline.rod.natural_curvature import NaturalCurvature
from curveline.scene import Display, DisplayErrors, Profile, Range, Scene
from curveline.simulation.simulate import DEFAULT_TOLERANCE
from curveline.units import deg, mm, nmm
from playing import next_plan, plan, scene

DISPLAY = scene("level-up-peak").display
NONE = Errors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
WIDE = DisplayErrors(
    stiffness=Range(-0.3, 0.1),
    mass=Range(-0.1, 0.2),
    clamp_stiffness=Range(nmm(25.0) / deg(1.0), math.inf),
    clamp_play=Range(0.0, deg(1.0)),
    clamp=Range(0.0, mm(20.0)),
    span=Range(mm(-2.0), mm(2.0)),
    friction=Range(0.0, mm(1.0)),
    set_share=Range(-0.05, 0.1),
)


def reals(display: Display, errors: DisplayErrors, count: int) -> list[Display]:
    source = np.random.default_rng(1)
    drawn = (source.uniform(0.0, 1.0, (2, len(SHARES))) for _ in range(count))
    return [real_display(display, errors, shares, more[:1]).gaps[0] for shares, more in drawn]


def test_what_is_drawn_of_a_display_changes_nothing_of_what_was_drawn_before() -> None:
    setup = Setup(DISPLAY, plan("level-up-peak"), ranges=WIDE)
    nodes, steps = len(setup.plan.start), len(setup.plan.steps)
    source, draws = np.random.default_rng(7), draw(setup, 7)
    assert np.array_equal(draws.offsets, source.standard_normal((nodes, 3)))
    assert np.array_equal(draws.scales, source.standard_normal(nodes))
    assert np.array_equal(draws.bows, source.standard_normal(nodes - 1))
    assert np.array_equal(draws.plays, source.uniform(-1.0, 1.0, (steps + 1, nodes, 3)))
    assert np.array_equal(draws.delays, source.uniform(0.0, 1.0, (2, steps, nodes, 3)))


def test_without_ranges_the_display_is_the_files() -> None:
    setup = Setup(DISPLAY, plan("level-up-peak"))
    run = course_of(setup, draw(setup, 3))
    assert run.real.gaps == (DISPLAY,)
    assert run.real.gaps[0] is DISPLAY
    assert run.real.friction == 0.0


def test_ranges_of_a_file_hold_unless_there_are_others() -> None:
    mine = replace(DISPLAY, errors=DisplayErrors(clamp=Range(0.0, 0.01), mass=Range(-0.1, 0.1)))
    setup = Setup(mine, plan("level-up-peak"), ranges=DisplayErrors(mass=Range(0.2, 0.3), friction=Range(0.0, 0.001)))
    assert setup.display_errors.given == {
        "mass": Range(0.2, 0.3),
        "clamp": Range(0.0, 0.01),
        "friction": Range(0.0, 0.001),
    }


def test_ranges_are_filled_evenly() -> None:
    rod = DISPLAY.rod
    found = reals(DISPLAY, WIDE, 2000)
    values = {
        "stiffness": ([each.rod.bending_stiffness / rod.bending_stiffness - 1.0 for each in found], -0.3, 0.1),
        "twist": ([each.rod.twisting_stiffness / rod.twisting_stiffness - 1.0 for each in found], -0.3, 0.1),
        "mass": ([each.rod.mass_per_length / rod.mass_per_length - 1.0 for each in found], -0.1, 0.2),
        # In the compliance, which has no infinite end.
        "give": ([nmm(25.0) / deg(1.0) / each.clamp_stiffness for each in found], 0.0, 1.0),
        "play": ([each.clamp_play for each in found], 0.0, deg(1.0)),
        "clamp": ([each.clamp for each in found], 0.0, mm(20.0)),
        "span": ([each.span - DISPLAY.span for each in found], mm(-2.0), mm(2.0)),
    }
    for drawn, low, high in values.values():
        parts = (np.array(drawn) - low) / (high - low)
        assert np.all((parts > -1e-9) & (parts < 1.0 + 1e-9))
        assert np.sort(parts) == pytest.approx(np.linspace(0.0, 1.0, len(parts)), abs=0.05)


def test_a_range_of_one_value_is_that_value() -> None:
    exact = DisplayErrors(clamp=Range(0.0, 0.0), clamp_stiffness=Range(math.inf, math.inf), span=Range(0.001, 0.001))
    for each in reals(replace(DISPLAY, clamp_stiffness=1.0), exact, 5):
        assert (each.clamp, each.clamp_stiffness) == (0.0, math.inf)
        assert each.span == DISPLAY.span + 0.001


def test_every_gap_has_a_span_of_its_own_and_nothing_else() -> None:
    gaps = real_display(DISPLAY, WIDE, np.full(len(SHARES), 0.3), np.array([0.0, 0.5, 1.0])).gaps
    assert [each.span - DISPLAY.span for each in gaps] == pytest.approx([-0.002, 0.0, 0.002])
    assert len({replace(each, span=0.0) for each in gaps}) == 1


def test_a_wider_gap_takes_the_rod_that_goes_straight_through_it() -> None:
    # At home the rod lies straight between the rails, wherever these are.
    setup = Setup(DISPLAY, plan("level-up-peak"), NONE, DisplayErrors(span=Range(mm(3.0), mm(3.0))))
    run = course_of(setup, draw(setup, 1))
    assert run.rod(0, 0).pose.x == pytest.approx(DISPLAY.span + mm(3.0))
    assert run.rod(0, 0).pose.length == pytest.approx(DISPLAY.span + mm(3.0))
    fed = setup.targets[-1, 0, 0] - setup.targets[-1, 1, 0]
    assert run.rod(0, -1).pose.length == pytest.approx(DISPLAY.span + mm(3.0) + fed)


def test_friction_holds_the_rod_back_either_way() -> None:
    up = np.linspace(0.0, 10.0, 21)
    feeds = np.concatenate([up, up[::-1]])[:, None]
    rod = held_back(feeds, 1.5)
    forth, back = rod[:21, 0], rod[21:, 0]
    assert forth == pytest.approx(np.maximum(up - 1.5, 0.0))
    # It turns round with the motor only after twice the dead band.
    assert back == pytest.approx(np.minimum(up[::-1] + 1.5, 8.5))
    # Small ways back and forth do not move it at all.
    assert held_back(np.array([[0.0], [1.0], [-1.0], [0.5]]), 1.5) == pytest.approx(np.zeros((4, 1)))
    assert held_back(feeds, 0.0) is feeds


def test_friction_costs_length_of_rod() -> None:
    setup = Setup(DISPLAY, plan("level-up-peak"), NONE, DisplayErrors(friction=Range(mm(1.0), mm(1.0))))
    exact = replace(setup, ranges=DisplayErrors())
    lengths = [course_of(each, draw(each, 1)).rod(0, -1).pose.length for each in (exact, setup)]
    # Both nodes feed towards the segment, and each holds a millimetre back.
    assert lengths[0] - lengths[1] == pytest.approx(mm(2.0))


@pytest.mark.parametrize("name", ["level-up-peak", "staggered-asymmetric-valley"])
def test_states_of_the_real_display_have_the_names_of_a_search(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    setup = Setup(DISPLAY, plan(name), Errors(angle=deg(4.0)), WIDE)
    quick = [play_run(setup, seed) for seed in range(40)]

    class Searched:
        def __init__(self, rod: ClampedRod) -> None:
            pass

        def state(self, rod: ClampedRod, name: str) -> State | None:
            return known_state(rod, name)

        def name_of(self, rod: ClampedRod, held: State | None) -> str:
            return name_of(rod, held)

    monkeypatch.setattr(monte_carlo, "Landmarks", Searched)
    assert [play_run(replace(setup), seed) for seed in range(40)] == quick


def test_errors_of_the_display_count_for_the_smallest_errors() -> None:
    made = plan("level-up-peak")
    plainly, really = Setup(DISPLAY, made, NONE), Setup(DISPLAY, made, NONE, WIDE)
    sizes = np.array([[play_run(each, seed).size for seed in range(5)] for each in (plainly, really)])
    assert not np.any(sizes[0] == sizes[1])
    # A share that is drawn counts like a deviation: one on average.
    assert np.mean([play_run(really, seed).size ** 2 for seed in range(200)]) == pytest.approx(1.0, abs=0.08)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"clamp": Range(0.02, 0.01)}, "clamp has no range"),
        ({"stiffness": Range(-1.0, 0.0)}, "no display can have"),
        ({"mass": Range(math.nan, 0.0)}, "mass has no range"),
        ({"friction": Range(-0.001, 0.001)}, "no display can have"),
        ({"clamp_stiffness": Range(0.0, 1.0)}, "no display can have"),
        ({"clamp_play": Range(0.0, math.inf)}, "no display can have"),
    ],
)
def test_ranges_that_mean_nothing_are_refused(wrong: dict[str, Range], said: str) -> None:
    with pytest.raises(InvalidInput, match=said) as refusal:
        DisplayErrors(**wrong)
    assert refusal.value.hint


@pytest.mark.parametrize("wrong", [{"clamp": Range(0.0, 0.6)}, {"span": Range(-0.49, 0.0)}, {"span": Range(-9.0, 0.0)}])
def test_bearings_that_leave_no_rod_free_are_refused(wrong: dict[str, Range]) -> None:
    with pytest.raises(InvalidInput, match="of rod in a bearing") as refusal:
        Setup(DISPLAY, plan("level-up-peak"), ranges=DisplayErrors(**wrong))
    assert "must leave some rod free" in (refusal.value.hint or "")


def near_its_limit(right: float) -> Scene:
    """An asymmetric peak that ceases to be at 50.5 deg of its right node [rad]."""
    at = scene("level-asymmetric-peak")
    return replace(at, nodes=(at.nodes[0], replace(at.nodes[1], angle=right)))


def ends_as(made: Plan, share: float) -> str:
    """How a plan ends, without errors of nodes, whose rod keeps a share of a curvature."""
    (ending,) = play_run(Setup(DISPLAY, made, NONE, DisplayErrors(set_share=Range(share, share))), 1).endings
    return ending


def test_a_rod_that_was_in_the_valley_does_not_hold_the_peak() -> None:
    # An independent solver has the limit at 36.3 deg with a tenth of a valley's curvature, at 57.9 with a peak's.
    for right, ending in ((34.0, "peak"), (42.0, "valley")):
        made = make_plan(near_its_limit(deg(right)))
        assert ends_as(made, 0.0) == "peak"
        assert ends_as(made, 0.1) == ending
        assert ends_as(made, -0.1) == "peak"


def test_of_a_plan_from_a_shape_the_rod_keeps_that_shape() -> None:
    made = next_plan("level-asymmetric-peak", "level-up-peak")
    assert made.granted == ("",)
    known = replace(made, shows=("peak",))
    ranges = DisplayErrors(set_share=Range(0.0, 0.1))
    for each, name, at in ((made, "valley", -1), (known, "peak", 0)):
        kept = Setup(DISPLAY, each, NONE, ranges).kept
        assert kept is not None
        run = course_of(Setup(DISPLAY, each, NONE), draw(Setup(DISPLAY, each), 1))
        segment = run.rod(0, at)
        state = showable_states(segment, DEFAULT_TOLERANCE).called(name)
        assert state is not None
        assert max(map(abs, kept.values)) == pytest.approx(state.max_curvature, rel=0.01)
        # Counted from the rod's left end, which lies 750 mm before the left node at home.
        begin = 0.75 - float(run.values[at, 0, 0]) + 0.5 * DISPLAY.clamp
        assert kept.places[1] == pytest.approx(begin)
        assert kept.places[-2] == pytest.approx(begin + segment.free_length)
        assert kept.values[0] == kept.values[-1] == 0.0
    assert Setup(DISPLAY, made, NONE).kept is None


def test_what_is_kept_comes_on_top_of_what_the_file_says() -> None:
    kept = Profile((0.8, 0.9, 1.0), (0.0, 4.0, 0.0))
    plain, curved = (
        with_kept(replace(DISPLAY.rod, profile=own), kept, 0.25).profile
        for own in (None, Profile((0.5, 1.5), (1.0, 3.0)))
    )
    assert plain == Profile(kept.places, (0.0, 1.0, 0.0))
    assert curved is not None
    assert curved.places == (0.5, 0.8, 0.9, 1.0, 1.5)
    own_there = NaturalCurvature(np.array([0.5, 1.5]), np.array([1.0, 3.0]))(np.array(curved.places))
    assert curved.values == pytest.approx(own_there + np.array([0.0, 0.0, 1.0, 0.0, 0.0]))


def test_rows_keep_what_each_segment_was_in() -> None:
    shape = scene("roofline")
    made = plan("roofline")
    kept = Setup(shape.display, made, NONE, DisplayErrors(set_share=Range(0.0, 0.2))).kept
    assert kept is not None
    assert list(kept.places) == sorted(kept.places)
    total = shape.display.rod.total_length
    assert 0.0 < kept.places[0] < kept.places[-1] < total
