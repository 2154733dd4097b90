"""The firmware's homing on modelled axes: finds the zero from anywhere, and never runs for ever."""

from __future__ import annotations

import ctypes
from functools import lru_cache
from random import Random
from types import TracebackType

import pytest

from curveline.radio.protocol.codes import NOT_HOMED

from . import build
from .rig import CORE, DRIVER, ENCODER, RUNAWAY, STALL, Motor, Triple, compiled

EXTRUDE, BIAS, TRANSLATE = range(3)
BUSY, DONE, FAILED = 1, 2, 3
HOMED = (0, 0, 0)
SWITCH = 1
WORKS, NEVER_CLOSES, NEVER_OPENS, WANDERS = range(4)
PLACES = (0, -5215, -48_700)
"""What the axes are to call the place of their switch or stop."""
MOST_MS = 400_000


class Seen(ctypes.Structure):
    """The bench of homing_rig.c as far as tests look at it."""

    _fields_ = (
        ("now_ms", ctypes.c_int64),
        *((name, Triple) for name in ("switch_at", "bounce_ms", "broken", "reasons")),
        *((name, ctypes.c_int32) for name in ("status", "phase", "driver_low")),
        ("random", ctypes.c_uint32),
        ("pwm", ctypes.c_int16 * 3),
    )


class Axis(ctypes.Structure):
    """cl_homing_axis."""

    _fields_ = (
        ("servo", ctypes.c_void_p),
        *((name, ctypes.c_int32) for name in ("place", "reach")),
        *((name, ctypes.c_int16) for name in ("seek", "approach", "back_off", "agree")),
        ("direction", ctypes.c_int8),
        ("home", ctypes.c_uint8),
    )


@lru_cache
def library() -> ctypes.CDLL:
    loaded = compiled("homing", [*CORE, build.CORE / "homing.c", build.HERE / "homing_rig.c"])
    loaded.bench_new.restype = ctypes.POINTER(Seen)
    loaded.bench_motor.restype = ctypes.POINTER(Motor)
    loaded.bench_axis.restype = ctypes.POINTER(Axis)
    loaded.bench_run.restype = ctypes.c_int64
    loaded.bench_run.argtypes = [ctypes.c_void_p, ctypes.c_int64]
    return loaded


class Bench:
    """Three axes: rails from -1000 to 90,000 counts of the motor, switches closed below 0."""

    def __init__(self, seed: int = 1) -> None:
        self._c = library()
        self._self = self._c.bench_new(seed)
        self.motors = [self._c.bench_motor(self._self, axis).contents for axis in range(3)]
        self.axes = [self._c.bench_axis(self._self, axis).contents for axis in range(3)]
        for axis, place in enumerate(PLACES):
            self.axes[axis].place = place
            self.motors[axis].low, self.motors[axis].high = -1000.0, 90_000.0
        self.motors[BIAS].low, self.motors[BIAS].high = 0.0, 11_000.0

    def __enter__(self) -> Bench:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._c.bench_free(self._self)

    @property
    def seen(self) -> Seen:
        return self._self.contents

    @property
    def reasons(self) -> tuple[int, ...]:
        """Why the axes are not homed."""
        return tuple(self.seen.reasons)

    @property
    def positions(self) -> list[int]:
        at = Triple()
        self._c.bench_positions(self._self, at)
        return list(at)

    def put(self, *at: float) -> None:
        for motor, place in zip(self.motors, at, strict=True):
            motor.position = place

    def start(self, *axes: int) -> None:
        self._c.bench_start(self._self, sum(1 << axis for axis in axes))

    def run(self, ms: int) -> int:
        return int(self._c.bench_run(self._self, ms))

    def abort(self) -> None:
        self._c.bench_abort(self._self)

    def home(self, *axes: int) -> int:
        """Home the axes; the status it ends with."""
        self.start(*axes)
        if self.seen.status == BUSY:
            assert self.run(MOST_MS) < MOST_MS, f"still busy in phase {self.seen.phase}"
        return int(self.seen.status)

    def error(self, axis: int) -> float:
        """By how many counts the axis mistakes its place; switches and stops are at 0 of the motors."""
        return self.positions[axis] - (self.motors[axis].position + PLACES[axis])


@pytest.mark.parametrize("seed", range(12))
def test_every_axis_finds_its_zero_from_anywhere(seed: int) -> None:
    random = Random(seed)
    with Bench(seed) as bench:
        bench.axes[EXTRUDE].home = SWITCH
        for name in ("direction", "reach", "seek", "approach", "back_off", "agree"):
            setattr(bench.axes[EXTRUDE], name, getattr(bench.axes[TRANSLATE], name))
        bench.put(random.uniform(-900, 30_000), random.uniform(0, 11_000), random.uniform(-900, 30_000))
        for motor in bench.motors:
            motor.counts_per_s, motor.stiction = random.uniform(6000, 8000), random.uniform(0.05, 0.12)
            motor.friction, motor.load = 0.8 * motor.stiction, random.uniform(-0.04, 0.04)
        assert bench.home(EXTRUDE, BIAS, TRANSLATE) == DONE
        assert bench.reasons == HOMED, f"reasons {bench.reasons}"
        errors = [bench.error(axis) for axis in range(3)]
        assert max(abs(error) for error in errors) <= 11, f"{errors}: more than 0.05 mm"
        assert list(bench.seen.pwm) == [0, 0, 0]


def test_homing_twice_finds_the_same_place() -> None:
    with Bench() as bench:
        places = []
        for start in (5000.0, 20_000.0, -500.0, 3.0):
            bench.motors[TRANSLATE].position = start
            assert bench.home(TRANSLATE) == DONE
            places.append(bench.error(TRANSLATE))
        assert max(places) - min(places) <= 11


def test_an_axis_on_its_switch_leaves_it_first() -> None:
    with Bench() as bench:
        bench.put(0, 0, 19_700.0)
        bench.seen.switch_at[TRANSLATE] = 20_000
        bench.start(TRANSLATE)
        bench.run(50)
        assert bench.seen.pwm[TRANSLATE] > 0
        assert bench.home(TRANSLATE) == DONE
        assert abs(bench.error(TRANSLATE) + 20_000) <= 11


def test_the_operators_place_is_taken_at_once() -> None:
    with Bench() as bench:
        bench.axes[EXTRUDE].place = 1234
        bench.put(777.5, 0, 0)
        bench.start(EXTRUDE)
        assert (bench.seen.status, bench.positions[EXTRUDE]) == (DONE, 1234)


def test_only_the_axis_whose_turn_it_is_moves_and_gently() -> None:
    with Bench() as bench:
        bench.put(0, 4000, 4000)
        bench.start(EXTRUDE, BIAS, TRANSLATE)
        turns = []
        while bench.seen.status == BUSY:
            bench.run(1)
            running = [axis for axis in range(3) if bench.seen.pwm[axis]]
            assert len(running) <= 1
            assert max(abs(pwm) for pwm in bench.seen.pwm) <= 840
            turns += [axis for axis in running if axis not in turns]
        assert turns == [TRANSLATE, BIAS]


@pytest.mark.parametrize("bounce_ms", [0, 1, 4, 20])
def test_switches_may_bounce(bounce_ms: int) -> None:
    for seed in range(5):
        with Bench(seed) as bench:
            bench.put(0, 0, 3000)
            bench.seen.bounce_ms[TRANSLATE] = bounce_ms
            assert bench.home(TRANSLATE) == DONE
            assert abs(bench.error(TRANSLATE)) <= 11 + bounce_ms


def test_a_bouncing_switch_is_not_believed_before_it_rests() -> None:
    """Noise of fewer ms than it takes to believe a contact never ends the search."""
    with Bench(3) as bench:
        bench.put(0, 0, 20_000)
        bench.start(TRANSLATE)
        for _ in range(200):
            bench.run(20)
            bench.seen.switch_at[TRANSLATE] = 90_000
            bench.seen.bounce_ms[TRANSLATE] = 0
            bench.run(4)
            bench.seen.switch_at[TRANSLATE] = 0
        assert (bench.seen.status, bench.seen.phase) == (BUSY, 1)


def reasons_of(bench: Bench, *axes: int, status: int = DONE) -> tuple[int, ...]:
    """Home the axes; why they are not."""
    assert bench.home(*axes) == status
    assert list(bench.seen.pwm) == [0, 0, 0]
    return bench.reasons


def only(axis: int, reason: int) -> tuple[int, ...]:
    """The reasons if one axis has one."""
    return tuple(reason if index == axis else 0 for index in range(3))


def test_a_missing_switch_ends_at_the_stop() -> None:
    with Bench() as bench:
        bench.put(0, 0, 5000)
        bench.seen.broken[TRANSLATE] = NEVER_CLOSES
        assert reasons_of(bench, TRANSLATE) == only(TRANSLATE, STALL)
        assert bench.seen.now_ms < 10_000


def test_a_missing_switch_and_no_stop_ends_with_the_reach() -> None:
    with Bench() as bench:
        bench.motors[TRANSLATE].low = -1e9
        bench.seen.broken[TRANSLATE] = NEVER_CLOSES
        bench.axes[TRANSLATE].reach = 8000
        assert reasons_of(bench, TRANSLATE) == only(TRANSLATE, STALL)
        assert -8100 <= bench.motors[TRANSLATE].position <= -7900


def test_a_motor_that_barely_turns_ends_with_the_time() -> None:
    with Bench() as bench:
        bench.put(0, 0, 5000)
        bench.motors[TRANSLATE].counts_per_s = 600
        bench.axes[TRANSLATE].reach = 5000
        assert reasons_of(bench, TRANSLATE) == only(TRANSLATE, STALL)
        assert bench.seen.now_ms == pytest.approx(2 * 5000 / 1.328 + 1000, abs=5)


def test_a_switch_that_stays_closed_is_a_fault() -> None:
    with Bench() as bench:
        bench.put(0, 0, 5000)
        bench.seen.broken[TRANSLATE] = NEVER_OPENS
        assert reasons_of(bench, TRANSLATE) == only(TRANSLATE, STALL)
        assert bench.motors[TRANSLATE].position < 5000 + 6 * 443


def test_a_switch_that_wanders_is_not_trusted() -> None:
    found = 0
    for seed in range(8):
        with Bench(seed) as bench:
            bench.put(0, 0, 4000 + 300 * seed)
            bench.seen.broken[TRANSLATE] = WANDERS
            found += reasons_of(bench, TRANSLATE) == only(TRANSLATE, ENCODER)
    assert found >= 1


def test_an_obstacle_on_the_way_is_a_stall() -> None:
    with Bench() as bench:
        bench.put(0, 0, 5000)
        bench.motors[TRANSLATE].low = 3000
        assert reasons_of(bench, TRANSLATE) == only(TRANSLATE, STALL)


@pytest.mark.parametrize("axis", [BIAS, TRANSLATE])
@pytest.mark.parametrize("encoder", [0, 2])
def test_a_dead_encoder_is_not_taken_for_a_stop(axis: int, encoder: int) -> None:
    with Bench() as bench:
        bench.put(0, 5000, 5000)
        bench.motors[axis].encoder = encoder
        assert reasons_of(bench, axis) == only(axis, ENCODER)
        assert bench.seen.now_ms < 1000


@pytest.mark.parametrize("axis", [BIAS, TRANSLATE])
def test_crossed_wires_are_found(axis: int) -> None:
    with Bench() as bench:
        bench.put(0, 5000, 5000)
        bench.motors[axis].wiring = -1
        assert reasons_of(bench, axis, status=FAILED) == only(axis, RUNAWAY)
        assert abs(bench.motors[axis].position - 5000) < 221


def test_an_encoder_that_dies_on_the_way_is_found() -> None:
    with Bench() as bench:
        bench.put(0, 0, 9000)
        bench.start(TRANSLATE)
        bench.run(2000)
        bench.motors[TRANSLATE].encoder = 0
        bench.run(1000)
        assert (bench.seen.status, bench.reasons) == (DONE, only(TRANSLATE, ENCODER))


# One axis without a zero


@pytest.mark.parametrize("encoder", [0, 2])
def test_an_axis_that_is_given_up_does_not_keep_the_others_from_their_zeros(encoder: int) -> None:
    with Bench() as bench:
        bench.put(777, 4000, 4000)
        bench.motors[TRANSLATE].encoder = encoder
        assert reasons_of(bench, EXTRUDE, BIAS, TRANSLATE) == only(TRANSLATE, ENCODER)
        assert abs(bench.error(BIAS)) <= 11
        assert bench.positions[EXTRUDE] == PLACES[EXTRUDE]


def test_an_axis_that_is_given_up_keeps_its_count() -> None:
    with Bench() as bench:
        bench.put(0, 4000, 5000)
        bench.motors[TRANSLATE].low = 3000
        assert reasons_of(bench, BIAS, TRANSLATE) == only(TRANSLATE, STALL)
        assert abs(bench.positions[TRANSLATE] - bench.motors[TRANSLATE].position) <= 1


def test_every_axis_may_be_given_up() -> None:
    with Bench() as bench:
        bench.put(0, 5000, 5000)
        bench.motors[BIAS].encoder = 0
        bench.seen.broken[TRANSLATE] = NEVER_CLOSES
        assert reasons_of(bench, BIAS, TRANSLATE) == (0, ENCODER, STALL)


@pytest.mark.parametrize("axis", [BIAS, TRANSLATE])
def test_of_axes_that_are_not_asked_for_nothing_is_said_and_nothing_moves(axis: int) -> None:
    other = BIAS + TRANSLATE - axis
    with Bench() as bench:
        bench.put(0, 5000, 5000)
        bench.motors[other].encoder = 0
        assert reasons_of(bench, axis) == (0, 0, 0)
        assert bench.motors[other].position == 5000


def test_a_runaway_is_the_end_also_for_those_that_have_not_had_their_turn() -> None:
    with Bench() as bench:
        bench.put(0, 4000, 4000)
        bench.motors[TRANSLATE].wiring = -1
        assert reasons_of(bench, EXTRUDE, BIAS, TRANSLATE, status=FAILED) == (NOT_HOMED, NOT_HOMED, RUNAWAY)
        assert bench.motors[BIAS].position == 4000


def test_a_runaway_leaves_the_zeros_that_were_found_before() -> None:
    with Bench() as bench:
        bench.put(0, 4000, 4000)
        bench.motors[BIAS].wiring = -1
        assert reasons_of(bench, BIAS, TRANSLATE, status=FAILED) == only(BIAS, RUNAWAY)
        assert abs(bench.error(TRANSLATE)) <= 11


def test_a_failing_driver_ends_it() -> None:
    with Bench() as bench:
        bench.put(0, 0, 9000)
        bench.start(BIAS, TRANSLATE)
        bench.run(100)
        bench.seen.driver_low = 2
        bench.run(100)
        assert bench.seen.status == BUSY
        bench.seen.driver_low = 10
        bench.run(100)
        assert (bench.seen.status, bench.reasons) == (FAILED, (0, DRIVER, DRIVER))


def test_an_aborted_homing_lets_go() -> None:
    with Bench() as bench:
        bench.put(0, 0, 9000)
        bench.start(TRANSLATE)
        bench.run(100)
        assert bench.seen.pwm[TRANSLATE] != 0
        bench.abort()
        bench.run(1)
        assert (bench.seen.status, list(bench.seen.pwm)) == (0, [0, 0, 0])
