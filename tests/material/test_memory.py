"""The memory of a rod against closed forms: a strip on a drum, superposition, what cancels and what fades."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from curveline.errors import InvalidInput
from curveline.material.memory import RodMemory, arc_height, fading, seconds_until_flat
from curveline.material.relaxation import Relaxation, power_law

WEEK = 604_800.0
LENGTH = 2.0
DRUM = 1.0 / 0.06
"""Curvature of a drum of 60 mm."""


def rod(law: Relaxation | None = None) -> RodMemory:
    return RodMemory.new(law or power_law(), LENGTH)


def test_a_strip_of_a_standard_linear_solid_on_a_drum_for_a_week_then_free() -> None:
    # With one term the free rod's memory obeys m' = -(1 - f) m / t.
    time, fraction = 40_000.0, 0.35
    on_drum = rod(Relaxation((time,), (fraction,))).held(DRUM, WEEK)
    gone = DRUM * -math.expm1(-WEEK / time)
    for after in (0.0, 1.0, 600.0, 40_000.0, WEEK):
        exact = fraction * gone * math.exp(-(1.0 - fraction) * after / time)
        np.testing.assert_allclose(on_drum.free(after).set_curvature, exact, rtol=1e-12)


def test_two_terms_recover_as_the_roots_of_their_equation_say() -> None:
    times, fractions = (100.0, 5000.0), (0.2, 0.3)
    held = rod(Relaxation(times, fractions)).held(DRUM, 1000.0)
    rates = np.array([[(fractions[j] - (i == j)) / times[i] for j in range(2)] for i in range(2)])
    trace, product = np.trace(rates), np.linalg.det(rates)
    slow, fast = 0.5 * (trace + math.sqrt(trace**2 - 4 * product)), 0.5 * (trace - math.sqrt(trace**2 - 4 * product))
    start = held.bends[:, 0]
    for after in (1.0, 100.0, 3000.0):
        # exp(A t) by Sylvester's formula.
        spread = (math.exp(slow * after) - math.exp(fast * after)) / (slow - fast)
        matrix = math.exp(fast * after) * np.eye(2) + spread * (rates - fast * np.eye(2))
        np.testing.assert_allclose(held.free(after).bends[:, 0], matrix @ start, rtol=1e-10)


@pytest.mark.parametrize("seconds", [1e-9, 1.0, 3600.0, 1e7])
def test_a_bend_that_changes_evenly_is_exact(seconds: float) -> None:
    law = power_law()
    begun = rod().held(2.0, 60.0)
    ours = begun.bent(3.0, -1.0, seconds).bends[:, 0]
    for time, before, after in zip(law.times, begun.bends[:, 0], ours, strict=True):
        steps = np.linspace(0.0, seconds, 20_001)
        bend = 3.0 - 4.0 * steps / seconds
        weight = np.exp((steps - seconds) / time) / time
        exact = before * math.exp(-seconds / time) + float(np.trapezoid(bend * weight, steps))
        # Of a step that is far longer than the time of a term, the last part alone counts.
        if seconds < 1000.0 * time:
            assert after == pytest.approx(exact, rel=1e-4, abs=1e-9)
        else:
            assert after == pytest.approx(-1.0 + 4.0 * time / seconds, rel=1e-6)


def test_a_free_rod_fades_as_its_equations_do_in_small_steps() -> None:
    law = power_law()
    times, fractions = np.array(law.times), np.array(law.fractions)
    memories = rod().held(DRUM, 28_800.0).bends[:, 0]
    stepped = solve_ivp(
        lambda _, now: (fractions @ now - now) / times, (0.0, 7200.0), memories, "Radau", rtol=1e-9, atol=1e-12
    )
    np.testing.assert_allclose(fading(law, 7200.0) @ memories, stepped.y[:, -1], rtol=1e-7)


def test_a_history_is_the_sum_of_its_parts() -> None:
    # Boltzmann: the set is that of each bend from when it began, less that from when it ended.
    law = power_law()
    history = [(3.0, 600.0), (-2.0, 7200.0), (0.0, 100.0), (5.0, 40.0)]
    memory, end = rod(law), sum(seconds for _, seconds in history)
    for bend, seconds in history:
        memory = memory.held(bend, seconds)
    expected, begun = 0.0, 0.0
    for bend, seconds in history:
        expected += bend * (law.modulus(end - begun - seconds) - law.modulus(end - begun))
        begun += seconds
    np.testing.assert_allclose(memory.set_curvature, expected, rtol=1e-11)


@pytest.mark.parametrize("how", ["held", "free", "straight"])
def test_eight_hours_are_four_and_four(how: str) -> None:
    first = rod().held(np.linspace(-3.0, 7.0, 401), 500.0)
    advance = {
        "held": lambda memory, seconds: memory.held(4.0, seconds),
        "free": lambda memory, seconds: memory.free(seconds),
        "straight": lambda memory, seconds: memory.straight(seconds),
    }[how]
    at_once, twice = advance(first, 28_800.0), advance(advance(first, 14_400.0), 14_400.0)
    np.testing.assert_allclose(twice.bends, at_once.bends, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(advance(first, 0.0).bends.round(9), first.bends.round(9))


def test_a_shape_and_its_mirror_image_cancel_where_they_are_as_recent() -> None:
    bends = np.sin(np.linspace(0.0, 20.0, 401))
    here, there = rod().held(bends, 3600.0), rod().held(-bends, 3600.0)
    np.testing.assert_array_equal(here.set_curvature, -there.set_curvature)
    np.testing.assert_allclose(0.5 * (here.bends + there.bends), 0.0, atol=1e-15)
    # One after the other: after as long in the mirror image the later one has won; after a moment of it the first has.
    after = rod().held(bends, 3600.0).held(-bends, 3600.0).set_curvature
    assert (after @ bends) < 0.0 < (rod().held(bends, 3600.0).held(-bends, 60.0).set_curvature @ bends)
    assert np.linalg.norm(after) < 0.9 * np.linalg.norm(here.set_curvature)


def test_the_set_grows_towards_the_sum_of_the_fractions_and_fades_to_nothing() -> None:
    law = power_law()
    sets = [float(rod(law).held(1.0, 10.0**decade).set_curvature[0]) for decade in range(11)]
    assert sets == sorted(sets)
    assert sets[-1] == pytest.approx(math.fsum(law.fractions), rel=1e-9)
    held = rod(law).held(1.0, 3600.0)
    for fade in (held.free, held.straight):
        left = [float(fade(10.0**decade).set_curvature[0]) for decade in range(12)]
        assert left == sorted(left, reverse=True)
        assert left[-1] < 1e-6
    # A rod that is held straight forgets faster than one that lies free.
    assert held.straight(3600.0).set_curvature[0] < held.free(3600.0).set_curvature[0]


def test_only_what_lies_between_bearings_takes_a_set() -> None:
    memory = rod()
    places = np.linspace(0.75, 1.25, 2001)
    curvature, angle = 4.0, 4.0 * (places - 0.75)
    bends = memory.mean_bends([(places, angle)])
    inside = (memory.places > 0.7551) & (memory.places < 1.2449)
    outside = (memory.places < 0.7449) | (memory.places > 1.2551)
    np.testing.assert_allclose(bends[inside], curvature, rtol=1e-9)
    np.testing.assert_array_equal(bends[outside], 0.0)
    # The whole turn is kept, wherever the ends of the piece lie between two places.
    for begin in (0.75, 0.7513, 0.7537):
        turned = memory.mean_bends([(places - 0.75 + begin, angle)])
        widths = np.full(turned.size, memory.places[1])
        widths[[0, -1]] *= 0.5
        assert turned @ widths == pytest.approx(angle[-1], rel=1e-12)
    # Two pieces with a bearing that gives between them: what jumps there is no bend of the rod.
    second = (np.linspace(1.3, 1.8, 2001), np.linspace(0.4, -1.0, 2001))
    both = memory.mean_bends([(places, angle), second])
    np.testing.assert_allclose(both, bends + memory.mean_bends([second]), atol=1e-12)
    assert np.all(both[(memory.places > 1.2551) & (memory.places < 1.2949)] == 0.0)


def test_means_over_places_converge_with_the_square_of_their_distance() -> None:
    fine = np.linspace(0.0, LENGTH, 200_001)
    errors = []
    for spacing in (0.02, 0.01, 0.005):
        memory = RodMemory.new(power_law(), LENGTH, spacing)
        bends = memory.mean_bends([(fine, np.sin(9.0 * fine))])
        errors.append(np.max(np.abs(bends - 9.0 * np.cos(9.0 * memory.places))[1:-1]))
    orders = np.diff(np.log(errors)) / math.log(0.5)
    np.testing.assert_allclose(orders, 2.0, atol=0.1)


def test_what_a_place_stands_for_lies_in_a_piece_as_far_as_it_does() -> None:
    memory = rod()
    inside = memory.within(0.75, 1.2513)
    assert inside @ np.full(401, 0.005) == pytest.approx(1.2513 - 0.75)
    assert set(np.unique(inside.round(9))) == {0.0, 0.5, 0.76, 1.0}
    assert np.all(memory.within(-1.0, 3.0) == 1.0)
    assert np.all(memory.within(1.0, 1.0) == 0.0)


def test_the_curvature_of_the_rod_as_made_is_no_bend() -> None:
    memory = rod()
    assert np.all(memory.mean_bends([], natural=0.3) == -0.3)
    places = np.linspace(0.0, LENGTH, 2001)
    np.testing.assert_allclose(memory.mean_bends([(places, 0.3 * places)], natural=0.3), 0.0, atol=1e-12)


def test_the_height_of_an_arc_is_that_of_a_circle() -> None:
    memory = rod()
    flat = np.full(memory.places.size, 0.1)
    assert arc_height(memory.places, flat, 0.5) == pytest.approx(0.1 * 0.5**2 / 8.0, rel=1e-3)
    assert arc_height(memory.places, flat, 10.0) == pytest.approx(0.1 * LENGTH**2 / 8.0, rel=1e-3)
    assert arc_height(memory.places, -flat, 0.5) == arc_height(memory.places, flat, 0.5)


def test_how_long_a_rod_is_held_straight_until_it_lies_flat() -> None:
    law = Relaxation((1000.0,), (0.3,))
    memory = rod(law).held(2.0, 1e6)
    height = arc_height(memory.places, memory.set_curvature, 0.5)
    assert seconds_until_flat(memory, 0.1 * height, 0.5) == pytest.approx(1000.0 * math.log(10.0), rel=0.02)
    assert seconds_until_flat(memory, 2.0 * height, 0.5) == 0.0
    assert seconds_until_flat(memory, 1e-9 * height, 0.5) == math.inf


def test_places_are_at_most_so_far_apart_as_asked() -> None:
    assert rod().places.size == 401
    assert RodMemory.new(power_law(), 2.001).places.size == 402
    assert RodMemory.new(power_law(), 0.001).places.size == 2


@pytest.mark.parametrize("length", [0.0, -1.0, math.nan, math.inf])
def test_a_rod_without_a_length_is_refused(length: float) -> None:
    with pytest.raises(InvalidInput, match="no rod is"):
        RodMemory.new(power_law(), length)


@pytest.mark.parametrize("spacing", [0.0, -0.1, math.nan, 1e-9])
def test_places_that_make_no_sense_are_refused(spacing: float) -> None:
    with pytest.raises(InvalidInput, match="does not remember every"):
        RodMemory.new(power_law(), LENGTH, spacing)


@pytest.mark.parametrize("bend", [math.nan, math.inf, [1.0, 2.0], np.zeros((401, 1))])
def test_bends_that_make_no_sense_are_refused(bend) -> None:
    with pytest.raises(InvalidInput):
        rod().held(bend, 1.0)


@pytest.mark.parametrize(
    "piece", [([0.0], [0.0]), ([0.0, 0.0], [0.0, 1.0]), ([0.0, 1.0], [0.0]), ([0.0, 1.0], [0.0, math.nan])]
)
def test_pieces_that_make_no_sense_are_refused(piece) -> None:
    with pytest.raises(InvalidInput, match="piece of rod"):
        rod().mean_bends([piece])
