"""Funnels: only the wanted state is left in them, with a reserve that is measured by hand."""

from __future__ import annotations

from functools import cache

import pytest

from curveline.planning.funnels import IN_A_ROW, LONE, Funnel, FunnelSearch, rounds_of
from curveline.planning.layout import Box
from curveline.planning.verification import LEAST_PAST_FOLD, Refused, Verifier
from curveline.rod.branches.control_path import between
from curveline.rod.problem import Pose
from curveline.rod.states.planar_states import find_states
from curveline.shapes.files import read_display
from curveline.units import deg

STATES = ("peak", "valley")


def nobody() -> None:
    pass


@cache
def verifier(name: str) -> Verifier:
    return Verifier(read_display(name), nobody)


@cache
def funnels(name: str, wanted: tuple[str, ...]) -> tuple[list[Funnel], list[Refused]]:
    search = FunnelSearch(verifier(name), wanted)
    return list(search), search.refusals()


CASES = [("single", ("peak",)), ("single", ("valley",)), ("quad", ("peak", "valley", "valley", "peak"))]


def level(name: str, funnel: Funnel) -> Pose:
    return Pose(verifier(name).display.span, 0.0, 0.0, 0.0, funnel.length)


def biased(name: str, funnel: Funnel, state: str) -> Pose:
    """The pose of the first segment of a row that the funnel takes into a state."""
    count = verifier(name).display.node_count
    start, end, *others = funnel.angles((state,) * (count - 1), range(1), (0.0,) * count)
    assert others == [0.0] * (count - 2)
    return level(name, funnel)._replace(start=start, end=end)


def names(name: str, pose: Pose) -> list[str]:
    return [state.name for state in find_states(verifier(name).rod(pose), 1e-5) if state.simple]


@pytest.mark.parametrize(("name", "wanted"), CASES)
def test_in_a_gate_only_the_wanted_state_is_left_and_before_it_both(name: str, wanted: tuple[str, ...]) -> None:
    found, _ = funnels(name, wanted)
    assert len(found) >= 3
    for funnel, state in [(funnel, state) for funnel in found[:3] for state in set(wanted)]:
        inside, before = biased(name, funnel, state), level(name, funnel)
        margin = verifier(name).past_fold(inside, state)
        assert margin >= max(LEAST_PAST_FOLD, funnel.headroom)
        assert names(name, inside) == [state]
        gone = 1.0 / (1.0 + margin)
        assert names(name, between(before, inside, gone + 0.005)) == [state]
        assert names(name, between(before, inside, gone - 0.02)) == list(STATES)


@pytest.mark.parametrize(("name", "wanted"), CASES)
def test_a_gate_is_within_what_display_and_motors_allow(name: str, wanted: tuple[str, ...]) -> None:
    limits = verifier(name).display.limits
    found, refusals = funnels(name, wanted)
    for funnel in found:
        assert limits.length.contains(funnel.length)
        assert max(map(abs, funnel.biases)) <= limits.angle.high
        assert (funnel.biases[0] == 0.0) == (len(wanted) > 1)
        assert funnel.headroom < 1.0
    assert found[0].headroom > 0.1
    assert all(refusal.message.startswith("step 2 (bias): ") and refusal.step == 2 for refusal in refusals)
    if len(wanted) == 1:
        assert [funnel.headroom for funnel in found] == sorted((funnel.headroom for funnel in found), reverse=True)
    else:
        assert found[0].headroom >= 0.75 * max(funnel.headroom for funnel in found)


def test_weight_makes_the_way_into_a_peak_the_longer_one() -> None:
    for funnel in funnels("quad", STATES)[0][:2]:
        peak, valley = (verifier("quad").past_fold(biased("quad", funnel, state), state) for state in STATES)
        assert LEAST_PAST_FOLD <= peak < valley


def test_too_little_bias_is_no_funnel() -> None:
    single = verifier("single")
    funnel = funnels("single", ("peak",))[0][0]
    inside, before = biased("single", funnel, "peak"), level("single", funnel)
    margin = single.past_fold(inside, "peak")
    with pytest.raises(Refused, match="not only the peak exists"):
        single.past_fold(between(before, inside, 0.9 / (1.0 + margin)), "peak")
    with pytest.raises(Refused, match="not only the valley exists"):
        single.past_fold(inside, "valley")
    # Past the fold, but with too small a reserve.
    near = between(before, inside, 1.08 / (1.0 + margin))
    assert single.past_fold(near, "peak") == pytest.approx(0.08, abs=0.005)
    with pytest.raises(Refused, match="ceases to exist only 8 % before the end of the bias"):
        single.funnel(before, near, Box(before, near), "peak")


def test_neighbours_never_go_through_a_funnel_together_and_everyone_does_once() -> None:
    for count in range(1, 9):
        rounds = rounds_of(("peak",) * count)
        assert sorted(segment for members in rounds for segment in members) == list(range(count))
        for members in rounds:
            assert all(abs(one - other) != 1 for one in members for other in members)
    assert len(rounds_of(("valley",))) == 1


def test_what_is_to_be_straight_goes_through_no_funnel() -> None:
    wanted = ("straight", "peak", "straight", "straight", "valley", "straight")
    assert rounds_of(wanted) == ((4,), (1,))
    assert rounds_of(("straight", "peak", "straight")) == ((1,),)
    assert rounds_of(("straight",) * 5) == ()


def test_a_gate_turns_the_nodes_of_its_segments_alone() -> None:
    funnel = Funnel((IN_A_ROW[0] * deg(30.0), IN_A_ROW[1] * deg(30.0)), 0.6, 0.3)
    before = (0.01, 0.02, 0.03, 0.04, 0.05)
    wanted = ("peak", "valley", "valley", "peak")
    first, second = rounds_of(wanted)
    assert funnel.angles(wanted, first, before) == pytest.approx((0.0, -deg(30.0), 0.0, deg(30.0), 0.05))
    assert funnel.angles(wanted, second, before) == pytest.approx((0.01, 0.0, deg(30.0), 0.0, -deg(30.0)))
    lone = Funnel((LONE[0] * deg(30.0), LONE[1] * deg(30.0)), 0.6, 0.3)
    assert lone.angles(("peak",), range(1), (0.0, 0.0)) == pytest.approx((deg(30.0), -deg(30.0)))


@pytest.mark.parametrize(("name", "wanted"), CASES)
def test_few_funnels_are_proven_for_the_best_which_come_as_if_all_were(name: str, wanted: tuple[str, ...]) -> None:
    search = FunnelSearch(verifier(name), wanted)
    first = next(iter(search))
    assert sum(search.is_proven(place) for place in range(30)) <= 6
    found = [first, *search]
    best = max(funnel.headroom for funnel in found)

    def rank(funnel: Funnel) -> tuple[bool, float, float]:
        if len(wanted) == 1:
            return False, 0.0, -funnel.headroom
        return funnel.headroom < 0.75 * best, abs(funnel.biases[1]), -funnel.headroom

    assert found == sorted(found, key=rank)
    assert len(found) + len(search.refusals()) == 30


@pytest.mark.parametrize("name", ["single", "quad"])
def test_what_a_glance_shows_is_close(name: str) -> None:
    for funnel in funnels(name, ("peak",) if name == "single" else STATES)[0]:
        for state in STATES[:1] if name == "single" else STATES:
            inside, before = biased(name, funnel, state), level(name, funnel)
            margin, gone = verifier(name).past_fold(inside, state), verifier(name).glance(before, inside, 0.98).gone
            assert 1.0 / gone - 1.0 == pytest.approx(margin, abs=2e-3 * (1.0 + margin) ** 2)
