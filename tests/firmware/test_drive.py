"""The firmware's drive: set-points to the count, what the node is told, and what ends a fault."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from random import Random

import pytest

from curveline.radio.protocol.motion import AxisLimits, plan_move, rest_ms

from . import build
from .rig import AXES, BANDS, CORE, DRIVER, ENCODER, REENGAGES, STALL, Rig, compiled

LIMITS = tuple(AxisLimits(*axis) for axis in AXES)
UNBRAKED = -1


@pytest.fixture
def rig() -> Iterator[Rig]:
    with Rig() as made:
        yield made


# Set-points


def walker() -> ctypes.CDLL:
    sources = [source for source in CORE if source.stem in ("blake2s", "motion", "track")]
    return compiled("walk", [*sources, build.HERE / "walk.c"])


def random_move(random: Random) -> list[int]:
    """Numbers of a cl_move: extreme ones, and ones as nodes make them."""
    reach = random.choice((3, 300, 30_000, 260_000))
    start = tuple(random.randint(-reach, reach) for _ in range(3))
    target = tuple(random.randint(-reach, reach) for _ in range(3))
    fastest = random.choice((100, 5000, 1_000_000))
    axes = tuple(AxisLimits(-reach, reach, fastest, random.choice((fastest, 5 * fastest))) for _ in range(3))
    if fastest == 100:
        target = tuple(begin + (end - begin) % 500 for begin, end in zip(start, target, strict=True))
    if fastest == 1_000_000:
        axes = tuple(AxisLimits(-reach, reach, fastest, fastest) for _ in range(3))
    move = plan_move(start, target, axes, random.choice((0, 0, 100, 3000)))  # type: ignore[arg-type]
    return [*start, *target, move.duration_ms, move.ramp_ms, UNBRAKED]


def test_walked_set_points_are_the_computed_ones_to_the_count() -> None:
    """Also after a brake that becomes known late, after missed ms, and at speeds no motor has."""
    loaded, seed = walker(), 11
    random = Random(seed)
    braked = 0
    for _ in range(400):
        move = random_move(random)
        stride = random.choice((1, 1, 1, 2, 7, 100))
        brake = random.choice((UNBRAKED, random.randint(0, move[6])))
        late = random.choice((0, 0, 1, 3, 50))
        braked += brake != UNBRAKED
        numbers = [*move, stride, brake, late]
        assert loaded.walk_differs((ctypes.c_int32 * 12)(*numbers)) == -1, f"seed {seed}: {numbers}"
    assert braked > 100


def test_walked_speeds_are_those_of_the_set_points() -> None:
    """As well as 64 ms of whole counts can tell."""
    loaded = walker()
    for start, target in (((0, 0, 0), (8000, -1500, 3000)), ((100, 5, -7), (-90_000, 5, 30_000))):
        move = plan_move(start, target, LIMITS, 0)  # type: ignore[arg-type]
        numbers = [*start, *target, move.duration_ms, move.ramp_ms, UNBRAKED]
        assert loaded.walk_speed_error((ctypes.c_int32 * 9)(*numbers)) <= 20 + 22132 * 16 // 1000


# What the node is told


def test_positions_are_encoder_counts_on_the_way_and_the_target_at_rest(rig: Rig) -> None:
    """With real encoders an axis rests a few counts off; the node compares for equality."""
    for motor in rig.motors:
        motor.stiction, motor.friction = 0.12, 0.11
    unequal = False
    random = Random(5)
    for _ in range(40):
        target = [random.randint(-400, 400) for _ in range(3)]
        rig.plan(target, 300)
        rig.run(150)
        assert rig.positions == rig.counts
        rig.arrive()
        assert rig.positions == target
        unequal = unequal or rig.counts != target
    assert unequal


def test_an_axis_pushed_out_of_its_band_is_reported_where_it_is(rig: Rig) -> None:
    rig.plan([500, 0, 0])
    rig.arrive()
    while abs(rig.counts[0] - 500) <= REENGAGES[0]:
        assert rig.positions == [500, 0, 0]
        rig.motors[0].position += 8
        rig.run(1)
    assert rig.positions[0] == rig.counts[0]
    rig.wait(1000)
    assert rig.positions == [500, 0, 0]


def test_arrival_is_told_once_and_only_after_the_set_point(rig: Rig) -> None:
    rig.plan([2000, 300, -500])
    took = rig.arrive()
    move = plan_move((0, 0, 0), (2000, 300, -500), LIMITS, 0)  # type: ignore[arg-type]
    assert move.duration_ms + 10 <= took <= move.duration_ms + 60
    assert rig.seen.settled_ms == rig.seen.now_ms
    assert rig.run(5000) == 5000
    assert rig.still


def test_a_move_to_where_the_axes_are_ends_at_once(rig: Rig) -> None:
    rig.wait(100)
    rig.plan([0, 0, 0])
    assert rig.arrive() <= 30
    assert max(rig.seen.off_ms) >= 100


@pytest.mark.parametrize("at_ms", [1, 57, 200, 600, 1250])
def test_a_broken_off_move_comes_to_rest_at_its_set_point_and_can_be_finished(rig: Rig, at_ms: int) -> None:
    target = [5000, -1000, 1500]
    rig.plan(target)
    rig.run(at_ms)
    rig.brake()
    rig.arrive()
    assert rig.positions == list(rig.seen.setpoint)
    assert max(abs(error) for error in rig.errors) <= max(BANDS)
    rig.plan(target)
    rig.arrive()
    assert (rig.seen.fault, rig.positions) == (0, target)


def test_the_rest_of_a_broken_off_move_is_what_the_specification_says(rig: Rig) -> None:
    """The positions told are those that node.py reckons with, so both plan the same rest."""
    target = (5000, -1000, 1500)
    rig.plan(target)
    rig.run(500)
    rig.brake()
    rig.arrive()
    move = plan_move((0, 0, 0), target, LIMITS, 0).braked(500)  # type: ignore[arg-type]
    assert tuple(rig.positions) == move.at(move.end_ms)
    assert rest_ms(move) > 0


def test_an_axis_with_no_way_to_go_keeps_its_motor_off(rig: Rig) -> None:
    rig.wait(50)
    rig.plan([4000, 0, 0])
    rig.arrive()
    assert rig.seen.off_ms[1] > 1000
    assert rig.seen.off_ms[2] > 1000


def test_missed_ticks_do_no_harm(rig: Rig) -> None:
    """The processor stands still while its flash is written; the motors go on."""
    rig.plan([6000, 500, 1000])
    random = Random(9)
    while rig.seen.settled_ms < 0 and rig.seen.fault == 0:
        rig.run(random.randint(1, 20))
        rig.skip(random.randint(1, 6))
    assert (rig.seen.fault, rig.positions) == (0, [6000, 500, 1000])


# Faults


def test_the_other_axes_brake_in_step_and_the_failed_one_is_told_where_it_is(rig: Rig) -> None:
    rig.plan([6000, 1200, 1500])
    rig.run(700)
    rig.motors[0].low, rig.motors[0].high = rig.motors[0].position - 30, rig.motors[0].position
    rig.arrive()
    assert (rig.seen.fault, rig.seen.fault_axis, rig.seen.settled_ms) == (STALL, 1, -1)
    rig.brake()
    rig.seen.fault = 0
    while rig.seen.settled_ms < 0:
        rig.run(1000)
    assert rig.positions[1:] == list(rig.seen.setpoint)[1:]
    assert rig.positions[0] == rig.counts[0]
    assert rig.still


def test_a_fault_that_the_node_knows_ends_with_its_next_move(rig: Rig) -> None:
    rig.plan([6000, 0, 0])
    rig.run(700)
    rig.motors[0].low, rig.motors[0].high = rig.motors[0].position - 30, rig.motors[0].position
    rig.arrive()
    rig.brake()
    rig.wait(500)
    assert rig.seen.fault == STALL
    rig.motors[0].low, rig.motors[0].high = -1e9, 1e9
    rig.plan([6000, 300, 100])
    rig.arrive()
    assert (rig.seen.fault, rig.positions) == (0, [6000, 300, 100])


def test_a_fault_at_rest_belongs_to_the_next_move_which_comes_to_nothing(rig: Rig) -> None:
    """The node asks only while it moves."""
    rig.wait(100)
    rig.fail(ENCODER, 2)
    rig.wait(100)
    rig.plan([3000, 0, 0])
    begun_ms = rig.seen.now_ms
    assert (rig.seen.fault, rig.seen.fault_axis) == (ENCODER, 2)
    assert rig.seen.fault_ms == begun_ms
    rig.brake()
    rig.wait(500)
    assert rig.seen.settled_ms >= begun_ms
    assert max(abs(count) for count in rig.counts) <= 1


def test_a_failing_driver_stops_all_axes_until_the_next_move(rig: Rig) -> None:
    rig.plan([6000, 1200, 1500])
    rig.run(700)
    rig.seen.driver_low_ms = 5000
    rig.arrive()
    assert (rig.seen.fault, rig.seen.fault_axis) == (DRIVER, 0)
    rig.brake()
    rig.wait(1000)
    assert min(rig.seen.off_ms) >= 1000
    assert rig.positions == rig.counts
    assert rig.seen.settled_ms > 0
    rig.plan([6000, 1200, 1500])
    rig.arrive()
    assert rig.seen.fault == DRIVER
    rig.seen.driver_low_ms = 0
    rig.brake()
    rig.wait(200)
    rig.plan([6000, 1200, 1500])
    rig.arrive()
    assert (rig.seen.fault, rig.positions) == (0, [6000, 1200, 1500])


def test_an_axis_that_never_finds_its_place_is_a_stall(rig: Rig) -> None:
    """It trembles about its set-point: neither still nor far off, so nothing else would notice."""
    rig.plan([3000, 0, 0])
    rig.run(100)
    rig.motors[0].encoder, rig.motors[0].phase = 3, 25
    rig.arrive()
    assert (rig.seen.fault, rig.seen.fault_axis) == (STALL, 1)
    move = plan_move((0, 0, 0), (3000, 0, 0), LIMITS, 0)  # type: ignore[arg-type]
    assert 2900 <= rig.seen.fault_ms - move.duration_ms <= 3200


def test_placing_the_drive_ends_moves_and_faults(rig: Rig) -> None:
    rig.motors[0].encoder = 0
    rig.plan([3000, 0, 0])
    rig.arrive()
    assert rig.seen.fault == ENCODER
    rig.motors[0].encoder = 1
    rig.place([100, -50, 7])
    rig.wait(100)
    assert (rig.positions, rig.still) == ([100, -50, 7], True)
    rig.plan([400, 0, 0])
    rig.arrive()
    assert (rig.seen.fault, rig.positions) == (0, [400, 0, 0])
