"""The firmware's servo on modelled motors: how well it follows, and which fault it finds how fast.

Bounds are in counts: 221 are a millimetre of the rack axes, 69.5 a degree of the bias axis.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from random import Random

import pytest

from curveline.calibrating.step_response import SHIPPED, StepResponse, tuning_of

from . import build, long_run
from .rig import BANDS, CHECKED, DRIVER, ENCODER, REENGAGES, RUNAWAY, STALL, Motor, Rig

MM = 221


@pytest.fixture
def rig() -> Iterator[Rig]:
    with Rig() as made:
        yield made


def stays_off(rig: Rig, ms: int) -> bool:
    """Whether no motor runs for a while."""
    rig.wait(ms)
    return min(rig.seen.off_ms) >= ms


# Following


def test_a_free_axis_follows_within_a_few_counts(rig: Rig) -> None:
    random = Random(1)
    for _ in range(20):
        target = [random.randint(-4000, 4000) for _ in range(3)]
        rig.plan(target)
        rig.arrive()
        assert (rig.seen.fault, rig.positions) == (0, target)
        assert max(rig.seen.worst) <= 8
        assert stays_off(rig, 300)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(
    ("load", "behind", "rests"),
    [(long_run.MOST_LOAD, 0.4 * MM, max(REENGAGES)), (long_run.LIGHT_LOAD, 0.2 * MM, max(BANDS))],
)
def test_long_random_moves_of_unlike_motors(seed: int, load: float, behind: float, rests: int) -> None:
    """Loads that friction cannot hold may push a resting axis out of the band, not out of reach."""
    worst, off = long_run.shake(Random(seed), 200, load)
    print(f"seed {seed}, load {load}: {worst} counts behind at worst, {off} off at rest")
    assert worst <= behind
    assert off <= rests


def test_a_steady_load_is_worked_off_within_half_a_second_without_swinging(rig: Rig) -> None:
    rig.plan([20_000, 0, 0])
    rig.run(2000)
    rig.motors[0].load = -0.2
    rig.run(500)
    assert rig.errors[0] <= 6
    for _ in range(300):
        rig.run(1)
        assert rig.errors[0] <= 8


def test_a_push_during_the_move_costs_little_and_is_made_good(rig: Rig) -> None:
    target = [8000, 1000, 2000]
    rig.plan(target)
    rig.run(900)
    rig.motors[0].load = -0.3
    rig.run(200)
    rig.motors[0].load = 0.0
    rig.arrive()
    assert (rig.seen.fault, rig.positions) == (0, target)
    assert 20 < rig.seen.worst[0] < 0.5 * MM


def test_an_axis_that_could_not_keep_up_does_not_overshoot(rig: Rig) -> None:
    """What the PWM could not give is not asked for later."""
    rig.plan([9000, 0, 0])
    rig.run(400)
    rig.motors[0].load = -0.5
    rig.run(250)
    assert rig.seen.pwm[0] == 2400
    rig.motors[0].load = 0.0
    beyond = 0
    while rig.seen.settled_ms < 0:
        rig.run(1)
        beyond = max(beyond, rig.counts[0] - rig.seen.setpoint[0])
    assert rig.seen.fault == 0
    assert beyond < 0.5 * MM


def test_axes_arrive_together_and_leave_together(rig: Rig) -> None:
    """Progress along the way differs by no more than a hundredth between axes, whatever their distances."""
    target = [6000, -1500, 2500]
    rig.plan(target)
    while rig.seen.settled_ms < 0:
        rig.run(10)
        shares = [count / goal for count, goal in zip(rig.counts, target, strict=True)]
        assert max(shares) - min(shares) < 0.01
    assert rig.positions == target


def test_motors_far_from_the_expected_one_do_not_swing(rig: Rig) -> None:
    """Half the time constant or twice, 15 % more or less speed: the set-point is never far."""
    for constant in (0.015, 0.06):
        for speed in (5900, 8000):
            for motor in rig.motors:
                motor.time_constant, motor.counts_per_s = constant, speed
            target = [-rig.counts[0] + 3000, 800, -rig.counts[2] - 2000]
            rig.plan(target)
            rig.arrive()
            assert rig.seen.fault == 0
            assert max(rig.seen.worst) < 0.35 * MM, (constant, speed, list(rig.seen.worst))
            assert stays_off(rig, 500)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_gains_that_are_suggested_for_a_motor_suit_it(rig: Rig, seed: int) -> None:
    """Of any motor whose gains lie within the bounds: it follows, and does not swing."""
    random, suited = Random(seed), 0
    while suited < 12:
        speed, constant = random.uniform(4000.0, 15000.0), random.uniform(0.008, 0.070)
        responses = [StepResponse(duty, (), speed * duty, constant, 0.0) for duty in (0.2, -0.2, 0.34, -0.34)]
        found = tuning_of(1, "bias", responses)
        if set(found.cut) - {"kick"}:
            continue
        suited += 1
        for axis, motor in enumerate(rig.motors):
            motor.time_constant, motor.counts_per_s = constant, speed
            rig.gain(axis, tuple({**found.gains, "kick": SHIPPED["kick"]}.values()))
        rig.plan([-rig.counts[0] + 3000, random.randint(-900, 900), -rig.counts[2] - 2000])
        rig.arrive()
        assert rig.seen.fault == 0
        assert max(rig.seen.worst) < 0.1 * MM, (speed, constant, found.gains, list(rig.seen.worst))
        assert stays_off(rig, 500), (speed, constant, found.gains)


# At rest


@pytest.mark.parametrize("axis", range(3))
def test_off_within_the_band_and_on_again_well_outside_it(rig: Rig, axis: int) -> None:
    motor = rig.motors[axis]
    assert stays_off(rig, 100)
    for _ in range(REENGAGES[axis]):
        motor.position += 1
        assert stays_off(rig, 5)
    motor.position += 1
    rig.run(1)
    assert rig.seen.pwm[axis] < 0
    rig.run(1000)
    assert rig.errors[axis] <= BANDS[axis]
    assert stays_off(rig, 500)


def test_no_more_than_the_play_of_the_band_under_a_load_that_turns_the_motor(rig: Rig) -> None:
    """A load beyond friction pushes the axis out; it is brought back each time, and never gets far."""
    rig.motors[0].load = 0.15
    for _ in range(5000):
        rig.run(1)
        assert rig.errors[0] <= 2 * REENGAGES[0]
    assert rig.seen.fault == 0


# Faults


def seized(play: float) -> Callable[[Motor], None]:
    """The axis is held; the motor has the play of the gears, less than a millimetre, to turn in."""

    def seize(motor: Motor) -> None:
        motor.low, motor.high = motor.position - play / 2, motor.position + play / 2

    return seize


def obstacle(motor: Motor) -> None:
    motor.high = motor.position


def with_(**values: float) -> Callable[[Motor], None]:
    def change(motor: Motor) -> None:
        for name, value in values.items():
            setattr(motor, name, value)

    return change


FAULTS = {
    "jammed": (seized(44), STALL, 250),
    "jammed with little play": (seized(12), STALL, 250),
    "against an obstacle": (obstacle, STALL, 250),
    "motor seized altogether": (seized(0), ENCODER, 250),
    "encoder dead": (with_(encoder=0), ENCODER, 250),
    "one channel dead": (with_(encoder=2), ENCODER, 250),
    "counts jump": (with_(jump=60), ENCODER, 1),
    "counts jump back": (with_(jump=-60), ENCODER, 1),
    "wires crossed": (with_(wiring=-1), RUNAWAY, 150),
}


@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_every_fault_is_found_in_time(rig: Rig, name: str, axis: int) -> None:
    """In the middle of a move, at full speed."""
    harm, fault, limit_ms = FAULTS[name]
    target = [0, 0, 0]
    target[axis] = 5000
    rig.plan(target)
    rig.run(600)
    began_ms, place = rig.seen.now_ms, rig.motors[axis].position
    harm(rig.motors[axis])
    rig.arrive()
    assert (rig.seen.fault, rig.seen.fault_axis) == (fault, axis + 1)
    assert rig.seen.fault_ms - began_ms <= limit_ms
    assert abs(rig.motors[axis].position - place) < 4 * MM


@pytest.mark.parametrize("name", ["encoder dead", "one channel dead", "motor seized altogether", "wires crossed"])
def test_faults_there_from_the_start(rig: Rig, name: str) -> None:
    harm, fault, _ = FAULTS[name]
    harm(rig.motors[0])
    rig.plan([-3000, 0, 0])
    rig.arrive()
    assert rig.seen.fault == fault
    assert rig.seen.fault_ms <= 300
    assert abs(rig.motors[0].position) < (0.5 if fault == RUNAWAY else 3) * MM


def test_a_creeping_axis_is_a_stall(rig: Rig) -> None:
    """It gives counts, so the encoder lives, but less than a twentieth of what is asked for."""
    rig.plan([8000, 0, 0])
    rig.run(500)
    rig.motors[0].counts_per_s = 100
    began_ms = rig.seen.now_ms
    rig.arrive()
    assert rig.seen.fault == STALL
    assert 150 <= rig.seen.fault_ms - began_ms <= 300


def test_an_axis_too_slow_to_keep_step_is_a_fault(rig: Rig) -> None:
    rig.motors[0].counts_per_s = 3000
    rig.plan([30_000, 0, 0])
    rig.arrive()
    assert rig.seen.fault == STALL
    assert 5 * MM < rig.errors[0] < 8 * MM


def test_a_short_pull_at_the_drivers_pin_is_forgiven_a_long_one_is_not(rig: Rig) -> None:
    rig.plan([8000, 1000, 0])
    rig.run(400)
    for low_ms, fault in ((2, 0), (2, 0), (3, DRIVER)):
        rig.seen.driver_low_ms = low_ms
        rig.run(20)
        assert rig.seen.fault == fault
    assert rig.seen.fault_axis == 0
    assert list(rig.seen.pwm) == [0, 0, 0]


@pytest.mark.parametrize("name", FAULTS)
def test_after_a_fault_the_motor_is_shorted_for_50_ms_then_free_and_stays_off(rig: Rig, name: str) -> None:
    harm, _, _ = FAULTS[name]
    rig.plan([8000, 0, 0])
    rig.run(600)
    harm(rig.motors[0])
    rig.arrive()
    for ms in range(100):
        assert rig.seen.pwm[0] == 0
        assert rig.coasts(0) == (ms >= 50) or ms == 49
        rig.run(1)
    rig.wait(3000)
    assert rig.seen.off_ms[0] > 3000


BENCHES = [f"tests.firmware.test_{name}" for name in ("drive", "homing", "store")]
PROGRAMS = (["tests.firmware.long_run", "7"], ["pytest", "-q", "-p", "no:cacheprovider", "--pyargs", *BENCHES])


@pytest.mark.parametrize("program", PROGRAMS, ids=["long run", "other tests"])
def test_no_undefined_behaviour(program: list[str]) -> None:
    """In processes of their own, because what the checks find ends them."""
    done = subprocess.run(
        [sys.executable, "-m", *program],
        capture_output=True,
        text=True,
        check=False,
        cwd=build.FIRMWARE.parent,
        env={**os.environ, CHECKED: "1"},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "faults found" in done.stdout or " passed" in done.stdout
