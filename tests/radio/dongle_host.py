"""The dongle's C core behind a pseudo-terminal, with modelled air and nodes on its other side, in real time.

`unplug` closes the terminal as a pulled plug would; `plug` gives it another one under the same name, in which the
dongle starts anew. Nodes live on meanwhile.
"""

from __future__ import annotations

import os
import select
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from random import Random

from curveline.drive_settings import DriveSettings
from curveline.radio.mock.air import Air, Antenna, Weather
from curveline.radio.mock.display import mock_site
from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import MotorPlant
from curveline.radio.node.state import HOMED, NOWHERE, Identity, Memory
from curveline.radio.ports.dongle import SendOutcome
from curveline.radio.protocol.band import POWERS_DBM
from curveline.radio.protocol.keys import Site
from curveline.radio.protocol.motion import axes_of
from curveline.radio.site.key_file import adopt, new_site
from firmware.dongle_core import Core

PAUSE_S = 0.0005


def write_keys(path: Path, drive: DriveSettings) -> Site:
    """A key file for the display."""
    chips = {address: 0x2000 + number for number, address in enumerate(drive.addresses, start=1)}
    return adopt(new_site(path), chips).site(drive)


class Room:
    """Air, nodes and their motors, by the clock on the wall; the time that packets are in the air is left out."""

    def __init__(self, drive: DriveSettings, site: Site | None = None, weather: Weather | None = None) -> None:
        self.site = site or mock_site(drive)
        self.axes = axes_of(drive)
        self.air = Air(weather or Weather(), drive.data_rate, Random(7))
        self.air.channel = drive.channel
        self.plants = [MotorPlant((0, 0, 0)) for _ in drive.addresses]
        self.nodes = [self._new_node(index, Memory()) for index in range(drive.node_count)]
        self.antennas = {
            address.upper(): Antenna(node) for address, node in zip(drive.addresses, self.nodes, strict=True)
        }
        self._begin_ns = time.monotonic_ns()

    @property
    def airs(self) -> list[Air]:
        return [self.air]

    @property
    def now_us(self) -> int:
        return (time.monotonic_ns() - self._begin_ns) // 1000

    def reboot(self, index: int) -> None:
        """Switch a node off and on."""
        old, now_ms = self.nodes[index], self.now_us // 1000
        if old.move is not None:
            self.plants[index].follow(now_ms, old.move_start_ms, old.move.braked(now_ms - old.move_start_ms))
        fresh = self._new_node(index, Memory(boot=old.memory.boot + 1, unhomed=HOMED if old.move is None else NOWHERE))
        list(self.antennas.values())[index].node = self.nodes[index] = fresh

    def transmit(self, address: str, payload: bytes) -> tuple[SendOutcome, bytes, int]:
        """What a transmission comes to."""
        antenna = self.antennas.get(address)
        heard = self.air.unheard() if antenna is None else self.air.exchange(antenna, payload, self.now_us)
        if heard.payload is None:
            return SendOutcome.NOTHING, b"", heard.retries
        return SendOutcome.ACKED, heard.payload, heard.retries

    def positions(self) -> list[tuple[int, int, int]]:
        return [plant.positions(self.now_us // 1000) for plant in self.plants]

    def _new_node(self, index: int, memory: Memory) -> NodeMachine:
        return NodeMachine(Identity(index + 1, self.site), self.axes, self.plants[index], memory)


@dataclass(frozen=True)
class Pull:
    """The dongle goes away after `frames` more transmissions, with only a `share` of its answers said, for `gap_s`.

    One that `hangs` keeps its port, but hears and says nothing.
    """

    frames: int
    share: float = 1.0
    gap_s: float = 0.0
    hangs: bool = False


class DongleHost:
    """A dongle at `path`; a thread carries the bytes.

    `mute` lets it hear nothing, `before` is said before each of its answers, `piece` is how many bytes it takes or says
    at once, `pull` when it goes away next, `on_gone` what happens then, and `gone_at` when it last was.
    """

    def __init__(self, path: Path, room: Room) -> None:
        self.path = path
        self.room = room
        self.core = Core(self._transmit)
        if any(air.weather.noise for air in room.airs):
            self.core.hears = lambda channel: any(channel in air.carriers() for air in room.airs)
        self.mute = False
        self.pull: Pull | None = None
        self.gone_at = 0.0
        self.on_gone: Callable[[], None] = lambda: None
        self._frames = 0
        self._back_at: float | None = None
        self.before = b""
        self.piece = 4096
        self._master = -1
        self._lock = threading.Lock()
        self._ends = False
        self._woken, self._wake = os.pipe()
        self.plug()
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()

    def plug(self) -> None:
        """Plug the dongle in."""
        with self._lock:
            self._master, slave = os.openpty()
            tty.setraw(slave)
            name = os.ttyname(slave)
            os.close(slave)
            os.set_blocking(self._master, False)
            self.core.start()
            self.core.take()
            fresh = self.path.with_suffix(".new")
            fresh.symlink_to(name)
            os.replace(fresh, self.path)
        os.write(self._wake, b"!")

    def unplug(self) -> None:
        """Pull the plug."""
        with self._lock:
            if self._master >= 0:
                self.path.unlink()
                os.close(self._master)
                self._master = -1

    def close(self) -> None:
        self._ends = True
        os.write(self._wake, b"!")
        self._thread.join()
        self.unplug()
        os.close(self._woken)
        os.close(self._wake)

    def _transmit(self, address: str, payload: bytes) -> tuple[SendOutcome, bytes, int]:
        self._frames += 1
        for air in self.room.airs:
            air.power = list(POWERS_DBM)[self.core.powers[-1]]
        return self.room.transmit(address, payload)

    def _carry(self) -> None:
        while not self._ends:
            master = self._master
            with suppress(OSError, ValueError):  # the plug may be pulled at any time
                ready, _, _ = select.select([self._woken, *([master] if master >= 0 else [])], [], [], 0.01)
                if self._woken in ready:
                    os.read(self._woken, 100)
            if self._back_at is not None and time.monotonic() >= self._back_at:
                self._return()
            with self._lock:
                if self._master >= 0:
                    self._serve()

    def _serve(self) -> None:
        try:
            data = os.read(self._master, self.piece)
        except OSError:  # nothing has come, or nobody has the port open
            time.sleep(PAUSE_S)
            return
        if self.mute:
            return
        self.core.feed(data)
        while not self._is_due() and self.core.step(self.room.now_us // 1000 & 0xFFFFFFFF):
            pass
        said = self.core.take()
        if self._is_due():
            self._go_away(said)
        elif said:
            self._say(self.before + said)

    def _is_due(self) -> bool:
        return self.pull is not None and self._frames >= self.pull.frames

    def _go_away(self, said: bytes) -> None:
        assert self.pull is not None
        pull, self.pull, self._frames = self.pull, None, 0
        self._say(said[: round(len(said) * pull.share)])
        self.gone_at = time.monotonic()
        self._back_at = self.gone_at + pull.gap_s
        self.on_gone()
        if pull.hangs:
            self.core.abandon()
            self.mute = True
        else:
            self.path.unlink()
            os.close(self._master)
            self._master = -1

    def _return(self) -> None:
        self._back_at = None
        if self.mute:
            self.mute = False
        else:
            self.plug()

    def _say(self, data: bytes) -> None:
        while data:
            try:
                data = data[os.write(self._master, data[: self.piece]) :]
            except BlockingIOError:
                time.sleep(PAUSE_S)
            except OSError:
                return


@contextmanager
def dongle_host(path: Path, room: Room) -> Iterator[DongleHost]:
    """A dongle plugged in at `path`."""
    host = DongleHost(path, room)
    try:
        yield host
    finally:
        host.close()
