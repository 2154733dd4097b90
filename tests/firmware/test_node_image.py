"""The real Cortex-M0+ image, run instruction by instruction: it carries out plans, and it stops when it must."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

import pytest

from curveline.drive_settings import AXES
from curveline.errors import LinkError
from curveline.radio.host.link import Control, OperatorRequest, Progress, read_status
from curveline.radio.protocol.codes import BOOT_END
from curveline.radio.protocol.node_settings import node_settings
from curveline.radio.site.intel_hex import with_settings
from hexfile import bytes_of

from .display import POSES, Rig, records, sealed
from .fleet import MASTER, SETTINGS, SPARE, STORE, ChipRadio, Fleet, drive_table
from .image import Image, make, read_image
from .kl26 import RESET_LOCKUP, RESET_LOW_VOLTAGE, RESET_PIN, RESET_POWER_ON, RESET_SOFTWARE, RESET_WATCHDOG
from .machine import LAMP_STEADY, NFAULT

FLASH_LIMIT, RAM_LIMIT = 45056, 5632
BAND = 24
"""Counts from its target within which an axis may rest: 0.1 mm, and one for the rounding of the model."""
STEADY_US = 100_000
"""After so long the supply counts as up."""
HANG = b"\xfe\xe7"
"""A branch to itself."""
UNDEFINED = b"\x00\xde"


@pytest.fixture
def rig(image: Image, homed_flash: bytes, tmp_path: Path) -> Rig:
    return Rig(image, homed_flash, tmp_path)


@pytest.fixture
def single(image: Image, homed_flash: bytes, tmp_path: Path) -> Rig:
    return Rig(image, homed_flash, tmp_path, count=1)


def test_the_build_says_how_large_the_program_is_and_keeps_it_within_limits(image_folder: Path) -> None:
    (image_folder / "node.hex").unlink()
    done = make(image_folder)
    match = re.search(r"flash (\d+) of (\d+) bytes; RAM (\d+) of (\d+) bytes", done.stdout)
    assert match, done.stdout + done.stderr
    flash, flash_limit, ram, ram_limit = map(int, match.groups())
    assert (flash_limit, ram_limit) == (FLASH_LIMIT, RAM_LIMIT)
    assert flash <= FLASH_LIMIT
    assert ram <= RAM_LIMIT
    assert (image_folder / "node.hex").is_file()
    for limit in (f"FLASH_LIMIT={flash - 1}", f"RAM_LIMIT={ram - 1}"):
        (image_folder / "node.hex").unlink(missing_ok=True)
        assert make(image_folder, limit).returncode != 0, limit
        assert not (image_folder / "node.hex").exists()
    assert make(image_folder).returncode == 0


def test_the_hex_file_holds_what_the_linker_wrote(image: Image, image_folder: Path) -> None:
    memory = bytearray(b"\xff" * 0x10000)
    for at, byte in bytes_of((image_folder / "node.hex").read_text()).items():
        memory[at] = byte
    gap = slice(0xC0, 0x400)  # between vectors and flash configuration linkers fill with what they like
    assert not any(memory[gap].strip(b"\xff"))
    memory[gap] = image.flash[gap]
    assert bytes(memory) == image.flash
    assert memory[0x400:0x410] == b"\xff" * 12 + bytes.fromhex("def9ffff"), "a chip with another word here is locked"
    assert memory[SPARE:] == b"\xff" * (0x10000 - SPARE), "settings and positions are not the program's to bring"


def test_a_node_flashed_with_its_own_hex_file_answers(image: Image, image_folder: Path) -> None:
    fleet = Fleet(image, drive_table(2))
    machine = fleet.machines[1]
    machine.write_flash(0, b"\xff" * 0x10000)
    text = with_settings((image_folder / "node.hex").read_text(), "node.hex", node_settings(MASTER, fleet.drive, 2))
    for address, byte in bytes_of(text).items():
        machine.write_flash(address, bytes([byte]))
    machine.power_cycle()
    fleet.run(50_000)
    assert [node.state for node in read_status(ChipRadio(fleet), fleet.drive)] == ["unhomed"] * 2


def test_the_core_builds_for_this_machine(tmp_path: Path) -> None:
    done = make(tmp_path, "native")
    assert done.returncode == 0, done.stdout + done.stderr
    assert os.path.getsize(tmp_path / "libcore.so") > 10_000


def test_it_boots_at_48_mhz_with_the_motors_asleep_and_the_watchdog_on(image: Image) -> None:
    fleet = Fleet(image, drive_table(1))
    fleet.run(50_000)
    (machine,) = fleet.machines
    chip = machine.chip
    assert chip.core_hz == 48_000_000
    assert [chip.pwm_hz(timer) for timer in range(3)] == [20_000.0] * 3
    assert chip.systick_period == 48_000
    assert chip.cop_ms == 256
    assert chip.priority(31) < chip.priority(-1), "encoder edges come before the tick"
    assert not machine.drivers_on
    assert not machine.cpu.crashes


@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_two_nodes_take_a_plan_to_its_end(image: Image, homed_flash: bytes, tmp_path: Path, loss: float) -> None:
    rig = Rig(image, homed_flash, tmp_path, loss=loss)
    for machine in rig.machines:
        machine.cpu.paint_stack()
    report = rig.send()
    assert (report.outcome, report.steps_done) == ("done", len(POSES))
    assert (rig.radio.retries > 10) == (loss > 0), "loss makes radios repeat"
    goal = rig.plan.steps[-1].targets[0].counts
    for machine, node in zip(rig.machines, report.nodes, strict=True):
        assert node.finished == len(POSES)
        assert max(abs(at - wanted) for at, wanted in zip(machine.counts, goal, strict=True)) <= BAND
        assert machine.watchdog_resets == 0
        assert machine.cpu.stack_used() <= 0.75 * (image.symbols["stack_end"] - image.symbols["stack_begin"])


@pytest.mark.parametrize("rate", ["250kbps", "2Mbps"])
def test_it_talks_at_the_other_rates_too(image: Image, rate: str) -> None:
    fleet = Fleet(image, drive_table(1, rate))
    fleet.run(50_000)
    (node,) = read_status(ChipRadio(fleet), fleet.drive)
    assert node.state == "unhomed"


def test_a_node_that_was_never_homed_refuses_to_move(image: Image, tmp_path: Path) -> None:
    rig = Rig(image, b"", tmp_path, count=1)
    with pytest.raises(LinkError, match="node 1 does not know where it is"):
        rig.send()
    (machine,) = rig.machines
    assert machine.counts == (0, 0, 0)
    assert not machine.drivers_on
    rig.fleet.run(8_000_000)
    assert machine.lamp() == 1


@pytest.mark.parametrize("damage", ["none", "bit", "cut"])
def test_without_whole_settings_nothing_moves_and_nobody_answers(image: Image, homed_flash: bytes, damage: str) -> None:
    fleet = Fleet(image, drive_table(1))
    (machine,) = fleet.machines
    if damage == "bit":
        machine.write_flash(SETTINGS + 20, bytes([machine.flash[SETTINGS + 20] ^ 0x10]))
    else:
        begin = SETTINGS + (0 if damage == "none" else 40)
        machine.write_flash(begin, b"\xff" * (SETTINGS + 1024 - begin))
    machine.write_flash(STORE, homed_flash)
    machine.power_cycle()
    fleet.run(12_000_000)
    assert machine.lamp() == 2
    assert not machine.drivers_on
    (node,) = read_status(ChipRadio(fleet), fleet.drive)
    assert node.state == "silent"


def test_a_position_survives_the_power_and_boots_are_counted(image: Image, homed_flash: bytes, tmp_path: Path) -> None:
    rig = Rig(image, homed_flash, tmp_path, count=1)
    rig.send()
    (before,) = rig.status()
    rig.fleet.run(1_500_000)
    (machine,) = rig.machines
    for boot in range(before.boot + 1, before.boot + 40):  # more than a sector holds
        machine.power_cycle()
        rig.fleet.run(30_000)
        (node,) = rig.status()
        assert (node.state, node.boot) == ("ready", boot)
        assert node.counts is not None
        assert max(abs(at - true) for at, true in zip(node.counts, machine.counts, strict=True)) <= 4
    assert machine.chip.erases > 0


def test_power_lost_in_a_move_leaves_the_position_unknown(rig: Rig) -> None:
    (before, _) = rig.status()
    error = rig.send_until_moving(rig.machines[0].power_cycle)
    assert error.node == 1
    assert "restarted" in error.message
    (after, other) = rig.status()
    assert (after.state, after.boot) == ("unhomed", before.boot + 1)
    assert not rig.machines[0].drivers_on
    assert other.state == "hold"


def test_a_brown_out_costs_the_position_even_at_rest(single: Rig) -> None:
    (machine,) = single.machines
    single.fleet.run(STEADY_US)
    machine.reset(RESET_LOW_VOLTAGE)
    single.fleet.run(20_000)
    (node,) = single.status()
    assert (node.state, node.fault, node.boot_cause) == ("position-lost", "brown-out", "low-voltage")
    assert node.unhomed == dict.fromkeys(AXES, "brown-out")
    assert not machine.drivers_on
    machine.power_cycle()
    single.fleet.run(20_000)
    (node,) = single.status()
    assert (node.state, node.boot_cause) == ("unhomed", "power-on")
    assert node.unhomed == dict.fromkeys(AXES, "not homed")


@pytest.mark.parametrize(
    ("reset", "cause"),
    [
        *((RESET_PIN, "pin"), (RESET_WATCHDOG, "watchdog"), (RESET_LOCKUP, "hang"), (RESET_SOFTWARE, "software")),
        *((RESET_LOW_VOLTAGE | RESET_PIN, "low-voltage"), (RESET_POWER_ON | RESET_PIN, "power-on"), (0x08, "unknown")),
    ],
)
def test_a_node_says_why_it_started(single: Rig, reset: int, cause: str) -> None:
    single.fleet.run(STEADY_US)
    single.machines[0].reset(reset)
    single.fleet.run(20_000)
    (node,) = single.status()
    assert node.boot_cause == cause
    assert node.state == ("position-lost" if cause == "low-voltage" else "ready")


def test_a_jammed_motor_is_a_stall_at_the_host(rig: Rig) -> None:
    error = rig.send_until_moving(rig.machines[0].motors[0].jam)
    assert error.node == 1
    assert "stalled" in error.message
    assert "extrude" in error.message
    rig.fleet.run(500_000)
    (node, other) = rig.status()
    assert (node.state, node.fault) == ("fault", "stall (extrude)")
    assert other.state == "hold"
    assert not rig.machines[0].drivers_on


def test_a_driver_in_trouble_stops_the_node(rig: Rig) -> None:
    error = rig.send_until_moving(lambda: rig.machines[0].set_pin(NFAULT, 0))
    assert error.node == 1
    assert "motor driver" in error.message
    assert not rig.machines[0].drivers_on


def test_an_encoder_that_falls_silent_loses_the_position(rig: Rig) -> None:
    error = rig.send_until_moving(lambda: rig.machines[0].cut_encoder(0))
    assert error.node == 1
    assert "lost its position" in error.message
    rig.fleet.run(500_000)
    assert abs(rig.machines[0].motors[0].speed) < 1.0
    assert not rig.machines[0].drivers_on


class HostGone(Exception):
    """Stands for the death of the host program."""


def test_when_the_host_falls_silent_the_nodes_hold(rig: Rig) -> None:
    def die(progress: Progress) -> None:
        if abs(rig.machines[0].motors[0].speed) > 500:
            raise HostGone

    with pytest.raises(HostGone):
        rig.send(die)
    assert any(motor.speed for motor in rig.machines[0].motors)
    rig.fleet.run(3_000_000)
    for node, machine in zip(rig.status(), rig.machines, strict=True):
        assert node.state in ("hold-link", "hold")
        assert not any(motor.speed for motor in machine.motors)


@pytest.mark.parametrize("function", ["link_serve", "motors_tick"])
def test_a_program_that_hangs_is_reset_by_the_watchdog(single: Rig, function: str) -> None:
    (machine,) = single.machines
    (before,) = single.status()
    machine.cpu.patch(function, HANG)
    single.fleet.run(240_000)
    assert machine.watchdog_resets == 0
    single.fleet.run(40_000)
    assert machine.watchdog_resets == 1
    single.fleet.run(20_000)
    (after,) = single.status()
    assert (after.state, after.boot) == ("ready", before.boot + 1)
    assert (before.boot_cause, after.boot_cause) == ("power-on", "watchdog")


def test_a_program_that_goes_astray_stops_the_motors_at_once(rig: Rig) -> None:
    machine = rig.machines[0]

    def crash() -> None:
        machine.cpu.may_crash = True
        machine.cpu.patch("link_serve", UNDEFINED)
        rig.fleet.run(2_000)
        assert machine.cpu.crashes == 1
        assert not machine.drivers_on

    error = rig.send_until_moving(crash)
    assert error.node == 1
    assert "restarted" in error.message
    assert machine.watchdog_resets == 1
    assert rig.status()[0].state == "unhomed"


def test_an_emergency_stop_outlives_a_reset_but_not_the_power_switch(single: Rig) -> None:
    (machine,) = single.machines
    control = Control()

    def stop(progress: Progress) -> None:
        if abs(machine.motors[0].speed) > 500:
            control.ask(OperatorRequest.ESTOP)

    with pytest.raises(LinkError, match="emergency stop"):
        single.send(stop, control)
    single.fleet.run(1_000_000)
    assert single.status()[0].state == "estop"
    assert not machine.drivers_on
    machine.reset(RESET_WATCHDOG)
    single.fleet.run(20_000)
    assert single.status()[0].state == "estop"
    machine.power_cycle()
    single.fleet.run(20_000)
    assert single.status()[0].state == "ready"


def test_a_node_that_has_counted_its_boots_to_the_end_stays_off_the_air(image: Image, homed_flash: bytes) -> None:
    fleet = Fleet(image, drive_table(1))
    (machine,) = fleet.machines
    machine.write_flash(STORE, with_boot(homed_flash, BOOT_END - 2))
    machine.power_cycle()
    fleet.run(50_000)
    (node,) = read_status(ChipRadio(fleet), fleet.drive)
    assert (node.state, node.boot) == ("ready", BOOT_END - 1)
    machine.power_cycle()
    fleet.run(12_000_000)
    (node,) = read_status(ChipRadio(fleet), fleet.drive)
    assert node.state == "silent"
    assert machine.lamp() == 7
    assert not machine.drivers_on


def with_boot(flash: bytes, boot: int) -> bytes:
    """The store with another boot number in all of its records."""
    changed = bytearray(flash)
    for at in records(flash):
        changed[at + 20 : at + 23] = boot.to_bytes(3, "little")
    return sealed(changed)


def test_an_answer_stays_loaded_whatever_comes_in(single: Rig) -> None:
    single.status()
    address = single.plan.drive.addresses[0]
    junk = [(address, bytes([each]) * 32) for each in range(5)]
    assert all(answer.payload for answer in single.radio.exchange(junk))


def test_a_radio_chip_that_forgets_is_set_up_again(single: Rig) -> None:
    (machine,) = single.machines
    single.fleet.chips[0].reset()
    assert single.status()[0].state == "silent"
    single.fleet.run(1_100_000)
    assert single.status()[0].state == "ready"
    assert machine.watchdog_resets == 0


def test_a_radio_that_is_not_there_yet_is_waited_for(single: Rig) -> None:
    (machine,) = single.machines
    (chip,) = single.fleet.chips
    chip.unplugged = 0xFF
    machine.power_cycle()
    single.fleet.run(9_000_000)
    assert machine.lamp() == 3
    chip.unplugged = None
    chip.reset()
    single.fleet.run(200_000)
    assert single.status()[0].state == "ready"
    single.fleet.run(2_500_000)
    assert machine.lamp() == LAMP_STEADY


@pytest.mark.parametrize("mhz", [3, 1])
def test_a_slower_bus_to_the_radio_is_a_matter_of_the_build(
    image_folder: Path, homed_flash: bytes, tmp_path: Path, mhz: int
) -> None:
    folder = tmp_path / "image"
    shutil.copytree(image_folder, folder)
    done = make(folder, f"SPI_MHZ={mhz}")
    assert done.returncode == 0, done.stdout + done.stderr
    rig = Rig(read_image(folder / "node.elf"), homed_flash, tmp_path, count=1)
    assert [node.state for node in rig.status()] == ["ready"]
    assert rig.machines[0].chip.spi_hz == mhz * 1_000_000
    assert rig.send().outcome == "done"


def test_a_bus_at_another_rate_is_refused_by_the_build(tmp_path: Path) -> None:
    done = make(tmp_path, "SPI_MHZ=12")
    assert done.returncode != 0
    assert "SPI_MHZ is 6, 3 or 1" in done.stdout + done.stderr
