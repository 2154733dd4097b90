"""For each back end a way to make one in a test: radio, air and nodes, with what can go wrong between them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from curveline.drive_settings import DriveSettings
from curveline.radio.interface import Radio, open_radio
from curveline.radio.mock.air import Weather
from curveline.radio.mock.display import MockRadio
from curveline.radio.mock.mock_node import FOR_EVER
from curveline.radio.node.machine import NodeMachine

from .dongle_host import Room, dongle_host, write_keys
from .spi_rig import SPEC, SpiRig, is_preloaded

SEED = 11


@dataclass(frozen=True)
class World:
    """One display with an open radio; `silence` makes a node (from 1) unreachable."""

    drive: DriveSettings
    radio: Radio
    spec: str
    folder: Path
    nodes: Callable[[], Sequence[NodeMachine]]
    silence: Callable[[int], object]

    def open(self) -> Radio:
        """Open the same radio once more."""
        return open_radio(self.spec, self.drive, self.folder)


@dataclass(frozen=True)
class Setting:
    """What a world is made of; `keys` is where a key file is to be, which the environment names."""

    folder: Path
    keys: Path
    drive: DriveSettings
    weather: Weather


@contextmanager
def mock_world(spec: str, setting: Setting) -> Iterator[World]:
    """The mock display."""
    weather = setting.weather
    chances = f"loss={weather.loss},dup={weather.duplicate},stale={weather.stale},corrupt={weather.corrupt}"
    if weather.noise:
        chances += f",noise={'+'.join(f'{number}@{share}' for number, share in weather.noise)}"
    if weather.margin is not None:
        chances += f",weak={weather.margin}"
    spec = f"mock:{spec}{chances},seed={SEED}"
    radio = open_radio(spec, setting.drive, setting.folder)
    assert isinstance(radio, MockRadio)

    def silence(number: int) -> None:
        radio._stations[number - 1].deaf_until_ms = FOR_EVER

    yield World(setting.drive, radio, spec, setting.folder, lambda: radio.nodes, silence)
    radio.close()


@contextmanager
def serial_world(setting: Setting) -> Iterator[World]:
    """The dongle's C core behind a pseudo-terminal."""
    site = write_keys(setting.keys, setting.drive)
    room = Room(setting.drive, site, setting.weather)
    spec = f"serial:{setting.folder / 'dongle'}"
    with dongle_host(setting.folder / "dongle", room):
        radio = open_radio(spec, setting.drive, setting.folder)
        addresses = [address.upper() for address in setting.drive.addresses]
        yield World(
            setting.drive,
            radio,
            spec,
            setting.folder,
            lambda: room.nodes,
            lambda number: room.antennas.pop(addresses[number - 1]),
        )
        radio.close()


@contextmanager
def spi_world(setting: Setting) -> Iterator[World]:
    """pyrf24, unmodified, on a register-level chip."""
    site = write_keys(setting.keys, setting.drive)
    rig = SpiRig(setting.folder, setting.drive, site, setting.weather, SEED)
    radio = open_radio(SPEC, setting.drive, setting.folder)
    yield World(
        setting.drive,
        radio,
        SPEC,
        setting.folder,
        lambda: [each.node for each in rig.nodes],
        lambda number: rig.nodes[number - 1].switch_off(),
    )
    radio.close()


Maker = Callable[[Setting], AbstractContextManager[World]]
WORLDS: dict[str, Maker] = {
    "mock": partial(mock_world, ""),
    "mock-realtime": partial(mock_world, "realtime,"),
    "serial": serial_world,
    "nrf24": spi_world,
}
"""Every back end, and how a test makes one."""

HERE = ["nrf24"] if is_preloaded() else [name for name in WORLDS if name != "nrf24"]
"""Those of this process: the shim has to be there from a process's beginning, see test_nrf24.py."""


@contextmanager
def world_of(name: str, folder: Path, drive: DriveSettings, weather: Weather) -> Iterator[World]:
    """A world of the back end `name`, whose files are in a folder of its own."""
    folder.mkdir(exist_ok=True)
    keys = folder / "site.json"
    before = os.environ.get("CURVELINE_KEYS")
    os.environ["CURVELINE_KEYS"] = str(keys)
    try:
        with WORLDS[name](Setting(folder, keys, drive, weather)) as world:
            yield world
    finally:
        del os.environ["CURVELINE_KEYS"]
        if before is not None:
            os.environ["CURVELINE_KEYS"] = before
