"""The mock's motors: exact, slow and stuck axes."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from curveline.radio.node.plant import MUTE_MS, RUNAWAY_COUNTS, STALL_MS, MotorPlant
from curveline.radio.protocol.codes import Fault
from curveline.radio.protocol.motion import axes_of, plan_move

from .bench import drive_table

AXES = axes_of(drive_table())
MOVE = plan_move((0, 0, 0), (10000, 1000, 500), AXES, 0)


def test_an_exact_plant_is_where_the_set_point_is() -> None:
    plant = MotorPlant((0, 0, 0))
    plant.follow(1000, 1000, MOVE)
    assert plant.positions(0) == (0, 0, 0)
    for elapsed in range(0, MOVE.duration_ms + 100, 17):
        assert plant.positions(1000 + elapsed) == MOVE.at(elapsed)
    assert plant.settles_ms() == 1000 + MOVE.duration_ms
    assert plant.spans() == [(1000, 1000 + MOVE.duration_ms)]


def test_a_plant_that_never_moved_rests_where_it_was_put() -> None:
    plant = MotorPlant((1, 2, 3))
    assert plant.positions(10**6) == (1, 2, 3)
    assert plant.settles_ms() is None
    assert plant.fault() is None
    assert plant.spans() == []


@given(st.integers(100, 1000), st.integers(0, 5000))
def test_a_slow_axis_comes_late_but_exactly(pace: int, brake_ms: int) -> None:
    plant = MotorPlant((0, 0, 0), (pace, 1000, 1000))
    plant.follow(0, 0, MOVE)
    settles = plant.settles_ms()
    assert settles is not None
    assert abs(settles - 1000 * MOVE.duration_ms / pace) <= 1
    assert plant.positions(settles) == MOVE.target
    if pace < 900:
        assert plant.positions(settles - 200) != MOVE.target
        assert plant.positions(MOVE.duration_ms)[1:] == MOVE.target[1:]
    if brake_ms < settles:
        before = plant.positions(brake_ms)
        plant.follow(brake_ms, 0, MOVE.braked(brake_ms))
        assert plant.positions(brake_ms) == before
        end = plant.settles_ms()
        assert end is not None
        assert end - brake_ms <= 1000 * MOVE.ramp_ms / pace + 2
        assert plant.positions(end) == plant.positions(end + 1000)


def test_the_axis_with_the_longest_way_gets_stuck_half_way() -> None:
    plant = MotorPlant((0, 0, 0))
    plant.trouble = Fault.STALL
    plant.follow(0, 0, MOVE)
    half = MOVE.duration_ms // 2
    assert plant.settles_ms() is None
    fault = plant.fault()
    assert fault is not None
    assert (fault.at_ms, fault.fault, fault.axis) == (half + STALL_MS, Fault.STALL, 1)
    assert plant.positions(fault.at_ms)[0] == MOVE.at(half)[0]
    assert plant.positions(fault.at_ms)[1] > MOVE.at(half)[1]
    plant.follow(fault.at_ms, 0, MOVE.braked(fault.at_ms))
    end = plant.settles_ms()
    assert end is not None
    assert plant.positions(end)[0] == MOVE.at(half)[0]
    assert plant.positions(end)[1] < MOVE.target[1]


def test_an_encoder_that_falls_mute_is_noticed_sooner_than_a_stall() -> None:
    plant = MotorPlant((0, 0, 0))
    plant.trouble = Fault.ENCODER
    plant.follow(0, 0, MOVE)
    fault = plant.fault()
    assert fault is not None
    assert (fault.at_ms, fault.fault, fault.axis) == (MOVE.duration_ms // 2 + MUTE_MS, Fault.ENCODER, 1)
    assert plant.positions(fault.at_ms)[0] == MOVE.at(MOVE.duration_ms // 2)[0]


def test_a_runaway_goes_against_its_command_until_it_is_braked() -> None:
    plant = MotorPlant((0, 0, 0), (500, 1000, 1000))
    plant.trouble = Fault.RUNAWAY
    plant.follow(0, 0, MOVE)
    fault = plant.fault()
    assert fault is not None
    assert (fault.fault, fault.axis) == (Fault.RUNAWAY, 1)
    assert plant.positions(fault.at_ms - 2)[0] > -RUNAWAY_COUNTS >= plant.positions(fault.at_ms)[0]
    assert plant.settles_ms() is None
    before = plant.positions(fault.at_ms)
    plant.follow(fault.at_ms, 0, MOVE.braked(fault.at_ms))
    assert plant.positions(fault.at_ms) == before
    end = plant.settles_ms()
    assert end is not None
    assert plant.positions(end)[0] < before[0]


def test_what_befalls_the_whole_drive_names_no_axis() -> None:
    for trouble in (Fault.DRIVER, Fault.BROWN_OUT):
        plant = MotorPlant((0, 0, 0))
        plant.trouble = trouble
        plant.follow(100, 100, MOVE)
        fault = plant.fault()
        assert fault is not None
        assert (fault.at_ms, fault.fault, fault.axis) == (100 + MOVE.duration_ms // 2, trouble, 0)
        assert plant.positions(fault.at_ms) == MOVE.at(MOVE.duration_ms // 2)
        plant.trouble = Fault.NONE
        plant.follow(5000, 5000, MOVE)
        assert plant.fault() is None
