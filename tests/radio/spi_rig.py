"""pyrf24 on modelled hardware: the preloaded shim, the host's chip, the ether, and nodes behind chips of their own.

It works only in a process that was started with the shim preloaded; `environment` is what such a process needs.
"""

from __future__ import annotations

import ctypes
import os
from pathlib import Path
from random import Random

from curveline.drive_settings import DriveSettings
from curveline.radio.mock.air import Weather
from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import MotorPlant
from curveline.radio.node.state import Identity, Memory
from curveline.radio.protocol.band import POWERS_DBM
from curveline.radio.protocol.keys import Site
from curveline.radio.protocol.motion import axes_of
from firmware.build import shared_library

from .chip import Chip, Packet
from .chip_node import ChipNode
from .chip_setup import Listener
from .chipbank import RF_SETUP
from .ether import Ether

CE, CSN = 22, 0
SPEC = f"nrf24:{CE},{CSN}"
NOISE_US = 1700
TRANSFER_US = 20
"""What one SPI transfer costs on a Raspberry Pi, about."""

_TRANSFER = ctypes.CFUNCTYPE(
    None, ctypes.c_int, ctypes.POINTER(ctypes.c_uint8), ctypes.POINTER(ctypes.c_uint8), ctypes.c_uint32
)
_LINE = ctypes.CFUNCTYPE(None, ctypes.c_uint32, ctypes.c_int)
_PASS = ctypes.CFUNCTYPE(None, ctypes.c_int64)
_KEPT: list[object] = []
"""Callbacks live as long as the process: C may call them at any time."""


def environment() -> dict[str, str]:
    """The environment of a process in which SPI and GPIO are modelled."""
    return {**os.environ, "LD_PRELOAD": str(shared_library("spi_shim", [Path(__file__).with_name("spi_shim.c")]))}


def is_preloaded() -> bool:
    """Whether this is such a process."""
    return hasattr(ctypes.CDLL(None), "shim_install")


class SpiRig:
    """The machine: one chip at CE 22, CSN 0, and the nodes of `drive` around it.

    With `ce_connected` False the chip's CE pin stays as it is. `devices` says whether SPI and GPIO are there; the SPI
    device is a file in `folder`, which can be locked.
    """

    def __init__(self, folder: Path, drive: DriveSettings, site: Site, weather: Weather, seed: int = 0) -> None:
        self.ether = Ether(weather.loss, weather.corrupt, seed)
        if weather.noise or weather.margin is not None:
            self.ether.noise, self.ether.jams = self._is_noisy, self._fades
        self.site = site
        self.ce_connected = True
        self._weather = weather
        self._random = Random(seed)
        self.chip = Chip(self.ether, "host")
        self.nodes = [self._new_node(number, drive, site) for number in range(1, drive.node_count + 1)]
        self.transfers = 0
        self._offset_us = 0
        self._library = ctypes.CDLL(None)
        self._files = {name: str(folder / name) for name in ("spidev", "gpiochip")}
        for path in self._files.values():
            Path(path).touch()
        self._install()

    def devices(self, *, spi: bool = True, gpio: bool = True) -> None:
        """Which devices there are."""
        paths = (self._files["spidev"] if spi else None, self._files["gpiochip"] if gpio else None)
        held = [None if path is None else ctypes.create_string_buffer(path.encode()) for path in paths]
        _KEPT.extend(held)
        self._library.shim_devices(*held)

    def header_is(self, number: int) -> None:
        """The board is a Raspberry Pi 5 whose header is this GPIO chip."""
        self._library.shim_header(ctypes.c_uint32(number))

    @property
    def spi_hz(self) -> int:
        """Clock of the bus at the last transfer."""
        return int(self._library.shim_speed_hz())

    def fail_transfers(self, count: int) -> None:
        """Let the next transfers on the bus fail."""
        self._library.shim_fail(ctypes.c_int(count))

    def _is_noisy(self, channel: int, now_us: int) -> bool:
        """WLAN sends for so long, or not, at a stretch."""
        return Random(now_us // NOISE_US).random() < self._weather.noise_on(channel)

    def _fades(self, sender: Chip, receiver: Chip, packet: Packet) -> bool:
        """What the sender's power and distance do to a packet."""
        power_dbm = list(POWERS_DBM.values())[sender.bank[RF_SETUP] >> 1 & 3]
        chance = Weather(margin=self._weather.margin).lost(packet.channel, power_dbm)
        return self._random.random() < chance

    def _new_node(self, number: int, drive: DriveSettings, site: Site) -> ChipNode:
        node = NodeMachine(Identity(number, site), axes_of(drive), MotorPlant((0, 0, 0)), Memory())
        address = bytes.fromhex(drive.addresses[number - 1])
        listener = Listener(self.ether, address, drive.data_rate, drive.channel)
        return ChipNode(listener, node, self._weather, self._random)

    def _install(self) -> None:
        callbacks = (_TRANSFER(self._transfer), _LINE(self._line), _PASS(self._pass))
        _KEPT.extend(callbacks)
        self.devices()
        passed = ctypes.c_int64(TRANSFER_US * 1000)
        self._library.shim_install.argtypes = [_TRANSFER, _LINE, _PASS, ctypes.c_int64]
        self._library.shim_passed_us.restype = ctypes.c_int64
        self._library.shim_install(*callbacks, passed)
        self._offset_us = self.ether.now_us - self._library.shim_passed_us()

    def _transfer(self, csn: int, sent: ctypes.Array[ctypes.c_uint8], got: object, length: int) -> None:
        self.transfers += 1
        data = ctypes.string_at(sent, length)
        answer = self.chip.command(data) if csn == CSN else bytes(length)
        ctypes.memmove(got, answer, length)  # type: ignore[arg-type]

    def _line(self, line: int, level: int) -> None:
        if line == CE and self.ce_connected:
            self.chip.ce = level

    def _pass(self, now_us: int) -> None:
        self.ether.advance(now_us + self._offset_us)
