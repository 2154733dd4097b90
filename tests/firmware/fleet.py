"""Nodes that run the real image, their radios, lossy air, and a host's radio: all on one virtual clock.

`Fleet` lets time pass for everything at once. `ChipRadio` is a `radio.interface.Radio` that drives a chip model as a
host's driver would, so that the real conductor can run against the real node program.
"""

from __future__ import annotations

from collections.abc import Sequence

from curveline.drive_settings import AxisDrive, DriveSettings
from curveline.radio.interface import Answer
from curveline.radio.protocol.keys import Site
from curveline.radio.protocol.node_settings import node_settings
from radio import chipbank as nrf
from radio.chip import PULSE_US, Chip
from radio.ether import Ether

from .image import Image
from .machine import BUTTON, LAMP_STEADY, MAIN_SLICE_US, Machine

SPARE, SETTINGS, STORE = 0xF000, 0xF400, 0xF800
MASTER = bytes(range(1, 17))
HOST_US = 300
"""Time that a host spends per exchange besides what the radios take."""
PATIENCE_US = 50_000
SETTING = {"250kbps": (0x26, 0x53), "1Mbps": (0x06, 0x13), "2Mbps": (0x0E, 0x13)}

AXES = (
    AxisDrive(221.3263, 20.0, 100.0, -20.0, 20.0),
    AxisDrive(69.5333, 45.0, 200.0, -4.0, 30.0),
    AxisDrive(221.3263, 10.0, 50.0, -2.0, 20.0),
)
"""As the built-in displays, but with little travel: homing is then a matter of seconds."""


def drive_table(count: int = 2, rate: str = "1Mbps") -> DriveSettings:
    """A display of `count` nodes."""
    addresses = tuple(f"C1C1C1C1{number:02X}" for number in range(1, count + 1))
    return DriveSettings("fleet", "digest", AXES, 76, rate, addresses)


def chip_id(uid: tuple[int, int, int]) -> int:
    """What a node makes of its 80 bits: FNV-1a in 32."""
    high, middle, low = uid
    value = 2166136261
    for byte in (high & 0xFFFF).to_bytes(2, "little") + middle.to_bytes(4, "little") + low.to_bytes(4, "little"):
        value = (value ^ byte) * 16777619 & 0xFFFFFFFF
    return value


def uid_of(number: int) -> tuple[int, int, int]:
    """The unique id of the microcontroller of node `number`."""
    return 0x3A00 + number, 0x4E453032 + number, 0x10018000 + 7 * number


class Fleet:
    """Machines and chips on one clock; node numbers count from 1."""

    def __init__(self, image: Image, drive: DriveSettings, *, loss: float = 0.0, seed: int = 1) -> None:
        self.drive = drive
        self.ether = Ether(loss, seed=seed)
        self.site = Site(MASTER, tuple(chip_id(uid_of(number)) for number in range(1, drive.node_count + 1)))
        self.chips = [Chip(self.ether, f"node {number}") for number in range(1, drive.node_count + 1)]
        self.machines = []
        for number, chip in enumerate(self.chips, start=1):
            machine = Machine(image, uid=uid_of(number), seed=seed + number)
            machine.write_flash(SETTINGS, node_settings(MASTER, drive, number).sector())
            machine.connect(chip)
            machine.power_cycle()
            self.machines.append(machine)

    def home(self, limit_us: int = 40_000_000) -> None:
        """Hold every node's button until it homes, and wait until all lamps burn steadily."""
        for machine in self.machines:
            machine.put_ends_at(-2.0 * AXES[2].counts_per_unit, -4.0 * AXES[1].counts_per_unit)
            machine.set_pin(BUTTON, 0)
        self.run(2_200_000)
        for machine in self.machines:
            machine.set_pin(BUTTON, 1)
        end = self.now_us + limit_us
        while not all(machine.lamp() == LAMP_STEADY for machine in self.machines):
            assert self.now_us < end, "homing does not end"
            self.run(100_000)

    @property
    def now_us(self) -> int:
        """The one time."""
        return self.ether.now_us

    def run(self, us: int) -> None:
        """Let so much time pass."""
        self.run_to(self.now_us + us)

    def run_to(self, until_us: int) -> None:
        """Let time pass until then."""
        while self.now_us < until_us:
            self.step(until_us)

    def step(self, until_us: int) -> None:
        """Let time pass to the next event of the air, or for a slice in which a processor works."""
        moment = min(until_us, self.ether.next_us() or until_us)
        busy = min(machine.quiet_until_us() for machine in self.machines)
        moment = max(self.now_us + 1, min(moment, max(busy, self.now_us + MAIN_SLICE_US)))
        for machine in self.machines:
            machine.run_to(moment)
        self.ether.advance(moment)


class ChipRadio:
    """A host's radio: one chip as sender, set up register by register, asked frame by frame."""

    def __init__(self, fleet: Fleet) -> None:
        self.site = fleet.site
        self.retries = 0
        self.polls = 0
        self._fleet = fleet
        self._chip = Chip(fleet.ether, "host")
        setup, retry = SETTING[fleet.drive.data_rate]
        for register, value in (
            (nrf.CONFIG, 0x0E),
            (nrf.EN_AA, 0x01),
            (nrf.EN_RXADDR, 0x01),
            (nrf.SETUP_RETR, retry),
            (nrf.RF_CH, fleet.drive.channel),
            (nrf.RF_SETUP, setup),
            (nrf.FEATURE, 0x06),
            (nrf.DYNPD, 0x01),
        ):
            self._chip.command(bytes([nrf.W_REGISTER | register, value]))
        fleet.run(2000)

    def exchange(self, frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
        """See Radio."""
        return [self._send(bytes.fromhex(address), payload) for address, payload in frames]

    def close(self) -> None:
        """See Radio."""

    def now_us(self) -> int:
        """See Radio."""
        return self._fleet.now_us

    def sleep_until(self, moment_us: int) -> None:
        """See Radio."""
        self._fleet.run_to(moment_us)

    def _send(self, address: bytes, payload: bytes) -> Answer:
        chip, fleet = self._chip, self._fleet
        fleet.run(HOST_US)
        for register in (nrf.TX_ADDR, nrf.RX_ADDR_P0):
            chip.command(bytes([nrf.W_REGISTER | register]) + address)
        chip.command(bytes([nrf.FLUSH_TX]))
        chip.command(bytes([nrf.FLUSH_RX]))
        chip.command(bytes([nrf.W_REGISTER | nrf.STATUS, nrf.FLAGS]))
        chip.command(bytes([nrf.W_TX_PAYLOAD]) + payload)
        chip.ce = 1
        fleet.run(PULSE_US + 1)
        chip.ce = 0
        limit = fleet.now_us + PATIENCE_US
        while chip.irq:
            assert fleet.now_us < limit, "the host's chip never finished"
            fleet.step(limit)
        self.polls += 1
        flags = chip.command(bytes([nrf.NOP]))[0]
        retries = chip.command(bytes([nrf.OBSERVE_TX, 0]))[1] & 0x0F
        self.retries += retries
        if flags & nrf.MAX_RT:
            return Answer(None, retries)
        if not flags & nrf.RX_DR:
            return Answer(b"", retries)
        width = chip.command(bytes([nrf.R_RX_PL_WID, 0]))[1]
        return Answer(chip.command(bytes([nrf.R_RX_PAYLOAD]) + bytes(width))[1:], retries)
