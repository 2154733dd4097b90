"""The real image over resets, power cuts and sags: what ends an emergency stop, and what a weak supply costs."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import pytest

from curveline.drive_settings import AXES
from curveline.driving.node_errands import NodePlace, watch
from curveline.errors import LinkError
from curveline.radio.protocol.codes import NodeState
from curveline.radio.protocol.node_settings import node_settings
from curveline.radio.protocol.service_frames import ServiceFrame

from .display import Rig
from .fleet import AXES as AXES_DRIVE
from .fleet import MASTER, SETTINGS
from .hand import Hand
from .image import Image
from .kl26 import (
    RESET_LOCKUP,
    RESET_LOW_VOLTAGE,
    RESET_PIN,
    RESET_POWER_ON,
    RESET_SOFTWARE,
    RESET_WATCHDOG,
)
from .machine import Machine
from .processor import RAM_BEGIN, RAM_END

STOP_US = 600_000
"""After so long a stop is written down in flash."""
STEADY_US = 100_000
"""After so long the supply counts as up."""
BROWN_OUT = dict.fromkeys(AXES, "brown-out")


@pytest.fixture
def rig(image: Image, homed_flash: bytes, tmp_path: Path) -> Rig:
    rig = Rig(image, homed_flash, tmp_path, count=1)
    rig.fleet.run(STEADY_US)
    return rig


@pytest.fixture
def machine(rig: Rig) -> Machine:
    return rig.machines[0]


def stop(rig: Rig, wait_us: int = STOP_US) -> None:
    """An emergency stop of the node at rest."""
    hand = Hand(rig.fleet, rig.radio)
    hand.status()
    hand.send(hand.peer.estop())
    rig.fleet.run(wait_us)


def state(rig: Rig) -> str:
    rig.fleet.run(20_000)
    return rig.status()[0].state


# What ends an emergency stop


@pytest.mark.parametrize("after_us", [0, 100, 1_000, 5_000, 50_000, 300_000])
def test_a_stop_ends_with_the_power_whenever_the_loader_pulses_the_reset_pin(
    rig: Rig, machine: Machine, after_us: int
) -> None:
    stop(rig)
    assert state(rig) == "estop"
    machine.power_cycle()
    rig.fleet.run(max(1, after_us))
    machine.reset(RESET_PIN)
    assert state(rig) == "ready"
    machine.reset(RESET_PIN)
    assert state(rig) == "ready"


@pytest.mark.parametrize(
    "shown", [RESET_POWER_ON, RESET_POWER_ON | RESET_PIN, RESET_PIN, RESET_PIN | RESET_LOW_VOLTAGE, 0]
)
def test_a_stop_ends_with_the_power_whatever_the_register_shows(rig: Rig, machine: Machine, shown: int) -> None:
    stop(rig)
    machine.power_cycle(cause=shown)
    low = bool(shown & RESET_LOW_VOLTAGE) and not shown & RESET_POWER_ON & ~RESET_LOW_VOLTAGE
    assert state(rig) == ("position-lost" if low else "ready")


RESETS = (RESET_PIN, RESET_WATCHDOG, RESET_LOW_VOLTAGE, RESET_LOCKUP, RESET_SOFTWARE, 0x04, 0x08, 0)


@pytest.mark.parametrize("cause", RESETS)
@pytest.mark.parametrize("wait_us", [3_000, STOP_US], ids=["not yet in flash", "in flash"])
def test_no_reset_ends_a_stop(rig: Rig, machine: Machine, cause: int, wait_us: int) -> None:
    stop(rig, wait_us)
    for _ in range(2):
        machine.reset(cause)
        assert state(rig) == "estop"


def test_a_stop_in_a_move_outlives_a_reset_at_once(rig: Rig, machine: Machine) -> None:
    hand = Hand(rig.fleet, rig.radio)
    hand.status()
    hand.poll(release=1, load=(1, (4000, 0, 0), 0))
    hand.poll(release=1, load=(1, (4000, 0, 0), 0))
    rig.fleet.run(200_000)
    assert abs(machine.motors[0].speed) > 500
    hand.send(hand.peer.estop())
    rig.fleet.run(2_000)
    for motor in machine.motors:
        motor.speed = 0.0  # a boot writes to the flash, which the model forbids while anything turns
    machine.reset(RESET_PIN)
    assert not machine.drivers_on
    assert state(rig) == "estop"


@pytest.mark.parametrize("spoiled", [range(RAM_BEGIN, RAM_END - 64), range(RAM_BEGIN + 0x1400, RAM_END)], ids=str)
def test_one_note_is_enough(rig: Rig, machine: Machine, spoiled: range) -> None:
    stop(rig)
    machine.cpu.write(spoiled.start, bytes(len(spoiled)))
    machine.reset(RESET_PIN)
    assert state(rig) == "estop"


@pytest.mark.parametrize("cause", [RESET_WATCHDOG, RESET_LOCKUP, RESET_SOFTWARE, 0x04, 0x08])
def test_a_program_that_has_gone_mad_over_its_notes_does_not_end_a_stop(rig: Rig, machine: Machine, cause: int) -> None:
    stop(rig)
    machine.cpu.write(RAM_BEGIN, bytes(RAM_END - RAM_BEGIN))
    machine.reset(cause)
    assert state(rig) == "estop"
    machine.reset(RESET_PIN)
    assert state(rig) == "estop", "the note is whole again"


def note(machine: Machine, name: str, *, stopped: bool, whole: bool = True) -> None:
    """Write one of the two notes: a word and its inverse; the inverse is another one unless it is to be whole."""
    word = 0x4C613B00 | stopped
    inverse = ~word & 0xFFFFFFFF if whole else word
    machine.cpu.write(machine.image.symbols[name], struct.pack("<2I", word, inverse))


@pytest.mark.parametrize("stopped", ["low_note", "top_note"])
def test_of_two_notes_that_differ_a_stop_counts(rig: Rig, machine: Machine, stopped: str) -> None:
    for name in ("low_note", "top_note"):
        note(machine, name, stopped=name == stopped)
    machine.reset(RESET_PIN)
    assert state(rig) == "estop"


def test_a_note_without_its_inverse_is_none(rig: Rig, machine: Machine) -> None:
    for name in ("low_note", "top_note"):
        note(machine, name, stopped=True, whole=False)
    machine.reset(RESET_PIN)
    assert state(rig) == "ready"


def test_a_loader_that_pulses_the_pin_after_power_on_hides_no_power_on(rig: Rig, machine: Machine) -> None:
    machine.power_cycle(cause=RESET_PIN)
    rig.fleet.run(STEADY_US)
    assert rig.status()[0].boot_cause == "power-on"


def test_a_short_cut_that_ram_outlives_ends_a_stop_only_if_the_register_shows_it(rig: Rig, machine: Machine) -> None:
    stop(rig)
    machine.power_cycle(ram_holds=True, cause=RESET_PIN)
    assert state(rig) == "estop", "nobody can tell it from a reset: leave it off for longer"
    machine.power_cycle(ram_holds=True)
    assert state(rig) == "ready"


# Low voltage


def test_the_levels_are_set_below_what_feeds_the_board_and_above_what_encoders_need(machine: Machine) -> None:
    power = machine.chip.power
    assert (power.reset_mv, power.warning_mv) == (2560, 2900)
    machine.reset(RESET_PIN)
    assert power.reset_mv == 2560, "only power-on falls back"


@pytest.mark.parametrize("mv", [3300, 2950, 3500])
def test_the_supply_is_measured(rig: Rig, machine: Machine, mv: int) -> None:
    machine.supply(mv)
    rig.fleet.run(250_000)
    seen = next(watch(NodePlace(rig.radio, rig.plan.drive, 1)))
    assert seen.supply_mv == pytest.approx(mv, abs=3)


def dip(rig: Rig, mv: int, us: int) -> None:
    rig.machines[0].supply(mv)
    rig.fleet.run(us)
    rig.machines[0].supply(3300)
    rig.fleet.run(2_000)


def test_the_shortest_dip_in_a_move_costs_the_position(rig: Rig, machine: Machine) -> None:
    error = rig.send_until_moving(lambda: dip(rig, 2850, 100))
    assert error.node == 1
    assert "the supply of node 1 sagged" in error.message
    rig.fleet.run(500_000)
    assert not any(motor.speed for motor in machine.motors)
    assert not machine.drivers_on
    (node,) = rig.status()
    assert (node.state, node.fault, node.unhomed) == ("position-lost", "brown-out", BROWN_OUT)
    assert machine.boots == 3, "nothing was reset"
    machine.power_cycle()
    assert state(rig) == "unhomed"


def test_a_supply_above_the_warning_level_costs_nothing(rig: Rig) -> None:
    rig.machines[0].supply(2950)
    assert rig.send().outcome == "done"


@pytest.mark.parametrize(("us", "lost"), [(5_000, False), (50_000, True)])
def test_at_rest_a_dip_may_be_short(rig: Rig, machine: Machine, us: int, lost: bool) -> None:
    dip(rig, 2700, us)
    (node,) = rig.status()
    if lost:
        assert (node.state, node.fault, node.unhomed) == ("position-lost", "brown-out", BROWN_OUT)
        rig.fleet.run(500_000)
        machine.power_cycle()
        assert state(rig) == "unhomed", "nor does a later boot believe it"
    else:
        assert (node.state, node.fault) == ("ready", "")


def test_nothing_is_homed_while_the_supply_is_low(rig: Rig, machine: Machine) -> None:
    machine.put_ends_at(-2.0 * 221.3263, -4.0 * 69.5333)
    hand = Hand(rig.fleet, rig.radio)
    hand.status()
    machine.supply(2800)
    rig.fleet.run(50_000)
    hand.home(0b111, order=1)
    assert hand.watch().state is NodeState.POSITION_LOST
    assert not any(motor.speed for motor in machine.motors)
    assert rig.status()[0].unhomed == BROWN_OUT
    machine.supply(3300)
    rig.fleet.run(50_000)
    hand = Hand(rig.fleet, rig.radio)
    hand.status()
    hand.home(0b111, order=1)
    assert hand.watch().state is NodeState.READY


def test_a_dip_ends_a_turn_without_a_loop(rig: Rig, machine: Machine) -> None:
    speeds = []

    def sag() -> None:
        speeds.append(abs(machine.motors[0].speed))
        machine.supply(2850)

    rig.fleet.ether.at(rig.fleet.now_us + 500_000, sag)
    with NodePlace(rig.radio, rig.plan.drive, 1).tried() as errand, pytest.raises(LinkError):
        errand.turn(ServiceFrame(0, 0, 0, axis=1, amount=350, rate=1000, span=1500))
    assert speeds[0] > 200
    rig.fleet.run(300_000)
    assert not any(motor.speed for motor in machine.motors)
    assert rig.status()[0].fault == "brown-out"


def test_a_dip_ends_a_search_without_a_zero(rig: Rig, machine: Machine) -> None:
    machine.motors[2].at = 3000.5
    machine.put_ends_at(-2.0 * 221.3263, -4.0 * 69.5333)
    hand = Hand(rig.fleet, rig.radio)
    hand.status()
    hand.home(0b100, order=1)
    rig.fleet.run(300_000)
    assert machine.motors[2].speed < -500
    dip(rig, 2850, 100)
    assert hand.watch().state is NodeState.POSITION_LOST
    rig.fleet.run(500_000)
    assert not any(motor.speed for motor in machine.motors)
    assert rig.status()[0].unhomed == BROWN_OUT


@pytest.mark.parametrize("mv", [2500, 2000, 1650])
def test_a_sag_below_what_encoders_and_radio_need_holds_the_node_in_reset(rig: Rig, machine: Machine, mv: int) -> None:
    rig.send_until_moving(lambda: machine.supply(mv))
    assert machine.chip.power.held
    assert not machine.drivers_on
    rig.fleet.run(1_000_000)
    machine.supply(3300)
    rig.fleet.run(20_000)
    (node,) = rig.status()
    assert (node.state, node.fault, node.boot_cause) == ("position-lost", "brown-out", "low-voltage")
    assert machine.watchdog_resets == 0


@pytest.mark.parametrize("level_lasts", [True, False], ids=["level lasts", "level falls back"])
@pytest.mark.parametrize("ms_per_V", [1, 30, 200])
def test_a_supply_that_rises_slowly_is_a_power_on(rig: Rig, machine: Machine, ms_per_V: int, level_lasts: bool) -> None:
    rise(rig, ms_per_V, level_lasts)
    (node,) = rig.status()
    assert (node.state, node.boot_cause) == ("ready", "power-on")
    assert node.boot <= 5, "numbers of boots are not for wasting"


def rise(rig: Rig, ms_per_V: int, level_lasts: bool) -> None:
    """Power away, and back at a rate."""
    (machine,) = rig.machines
    machine.chip.power.level_lasts = level_lasts
    machine.supply(0)
    rig.fleet.run(100_000)
    for mv in range(0, 3301, 50):
        machine.supply(mv)
        rig.fleet.run(50 * ms_per_V)
    rig.fleet.run(STEADY_US)


def test_contacts_that_bounce_at_power_on_cost_nothing_and_later_ones_do(rig: Rig, machine: Machine) -> None:
    machine.power_cycle()
    rig.fleet.run(10_000)
    machine.supply(2000)
    rig.fleet.run(3_000)
    machine.supply(3300)
    rig.fleet.run(STEADY_US)
    assert (rig.status()[0].state, rig.status()[0].boot_cause) == ("ready", "power-on")
    machine.supply(2000)
    rig.fleet.run(3_000)
    machine.supply(3300)
    assert state(rig) == "position-lost"


def test_a_stop_outlives_a_sag(rig: Rig, machine: Machine) -> None:
    stop(rig)
    machine.supply(1500)
    rig.fleet.run(100_000)
    machine.supply(3300)
    assert state(rig) == "estop"
    machine.supply(500)
    rig.fleet.run(100_000)
    machine.supply(3300)
    assert state(rig) == "unhomed", "the stop has ended, and the sag had cost the position"


# The cache of the flash


def test_what_was_written_is_read_back_at_once(image: Image, rig: Rig, machine: Machine) -> None:
    """A stale cache makes good writes look like failures: they would be tried again, and the flash given up."""
    written = machine.chip.words_programmed
    machine.power_cycle()
    assert state(rig) == "ready"
    assert machine.chip.words_programmed == written + 7, "one record, all but its mark"


# Positions and the settings that they were counted under


def flash_again(rig: Rig, machine: Machine, **changes: object) -> None:
    """Give the node other settings, by a loader that leaves the last pages as they are."""
    drive = replace(rig.plan.drive, **changes)  # type: ignore[arg-type]
    machine.write_flash(SETTINGS, node_settings(MASTER, drive, 1).sector())
    machine.power_cycle()


def test_a_position_under_other_settings_is_not_believed(rig: Rig, machine: Machine) -> None:
    bias = rig.plan.drive.axes[1]
    before = rig.status()[0].boot
    assert before is not None
    flash_again(rig, machine, axes=(AXES_DRIVE[0], replace(bias, low=bias.low - 1.0), AXES_DRIVE[2]))
    rig.fleet.run(20_000)
    who = Hand(rig.fleet, rig.radio).status()
    assert who.state is NodeState.UNHOMED
    rig.fleet.run(500_000)
    flash_again(rig, machine)
    rig.fleet.run(20_000)
    (node,) = rig.status()
    assert node.state == "unhomed", "nor under the old ones, once others were there"
    assert node.boot == before + 2, "boots are counted on all the same"


def test_a_position_outlives_settings_that_it_does_not_hang_on(rig: Rig, machine: Machine) -> None:
    slower = tuple(replace(axis, speed=axis.speed / 2) for axis in AXES_DRIVE)
    flash_again(rig, machine, axes=slower)
    assert state(rig) == "ready"
