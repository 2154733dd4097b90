"""Faults that a mock display can be asked for: a row of `MISHAPS` each, with the form of its setting and what it does.

The table follows the faults that the link must survive or explain; `tests/radio/test_faults.py` holds every row to its
message.
"""

from __future__ import annotations

import errno
from collections import defaultdict, deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from random import Random

from curveline.radio.host.journal import SystemDisk
from curveline.radio.interface import RadioGone
from curveline.radio.mock.adversaries import (
    OLD_FIRMWARE,
    REPLAYS,
    NextVersion,
    OldFirmware,
    Rival,
    forged,
    stranger_identity,
)
from curveline.radio.mock.air import Air
from curveline.radio.mock.mock_node import FOR_EVER, Station
from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import MotorPlant
from curveline.radio.node.state import NOWHERE, Memory
from curveline.radio.protocol.codes import Fault
from curveline.radio.protocol.frames import StopFrame, encode_stop

SILENCE_MS = 3000
RESET_MS = 200
REPLUG_MS = 2500
"""Longer than the dead-man time: the nodes hold meanwhile."""
SLEEP_MS = 10_000
STRAY_CHANNEL = 23
"""Where a node listens that has the settings of another display."""


class Form(Enum):
    """How the setting of a mishap is written."""

    NODE_STEP = "=<node>@step<number>"
    NODE = "=<node>"
    NODE_WORD = "=<node>@word<number>"
    STEP = "@step<number>"
    FULL_STEP = "=full@step<number>"
    CHANCE = "=<number from 0 to below 1>"
    AXIS_NODE = "=<axis>@<node>"


@dataclass(frozen=True)
class Mishap:
    """What was asked for: a key of `MISHAPS`, and node, step or word, axis (from 1) or chance as its form has them."""

    key: str
    node: int = 0
    step: int = 0
    chance: float = 0.0
    axis: int = 0


@dataclass
class MishapStage:
    """The display that mishaps befall."""

    stations: Sequence[Station]
    air: Air
    random: Random
    rivals: list[Rival] = field(default_factory=list)
    heard: Mapping[int, deque[bytes]] = field(default_factory=lambda: defaultdict(lambda: deque(maxlen=REPLAYS)))
    gone_until_ms: int = 0
    asleep_until_ms: int = 0
    disk_is_full: bool = False

    def station(self, mishap: Mishap) -> Station:
        """The node that a mishap is about."""
        return self.stations[mishap.node - 1]


@dataclass(frozen=True)
class Packet:
    """A packet about to be sent to a node (from 1), 0 for an address that none has."""

    now_ms: int
    node: int
    payload: bytes


Prepare = Callable[[MishapStage, Mishap], None]
Strike = Callable[[MishapStage, Mishap, int], None]
Meddle = Callable[[MishapStage, Mishap, Packet], None]


@dataclass(frozen=True)
class MishapRow:
    """A mishap: what people are told of it, and what it does.

    It acts before power is switched on, when half of its step is done, or before every packet.
    """

    form: Form
    text: str
    prepare: Prepare | None = None
    strike: Strike | None = None
    meddle: Meddle | None = None


class Troubles:
    """The mishaps of one display, each waiting for its moment."""

    def __init__(self, mishaps: Sequence[Mishap], stage: MishapStage) -> None:
        self._stage = stage
        self._mishaps = [(mishap, MISHAPS[mishap.key]) for mishap in mishaps]
        self._waiting = [mishap for mishap, row in self._mishaps if row.strike]
        for mishap, row in self._mishaps:
            if row.prepare is not None:
                row.prepare(stage, mishap)

    def before(self, packet: Packet) -> None:
        """Let happen what is due before a packet leaves."""
        if not self._mishaps:
            return
        for mishap in [each for each in self._waiting if self._is_due(each, packet.now_ms)]:
            self._waiting.remove(mishap)
            strike = MISHAPS[mishap.key].strike
            assert strike is not None
            strike(self._stage, mishap, packet.now_ms)
        for rival in self._stage.rivals:
            rival.act(packet.now_ms)
        for mishap, row in self._mishaps:
            if row.meddle is not None:
                row.meddle(self._stage, mishap, packet)

    @property
    def asleep_until_ms(self) -> int:
        """Until when the host's computer sleeps, in the midst of an exchange."""
        return self._stage.asleep_until_ms

    def gone(self, now_ms: int) -> RadioGone | None:
        """What to raise while the radio itself is away."""
        until_ms = self._stage.gone_until_ms
        if now_ms >= until_ms:
            return None
        hint = "plug it in again; the nodes hold by themselves until a run goes on"
        return RadioGone("the radio does not answer this computer any more", hint, may_return=until_ms < FOR_EVER)

    def _is_due(self, mishap: Mishap, now_ms: int) -> bool:
        """At one node when it has half of the step done, at the whole display when the first node has."""
        stations = [self._stage.station(mishap)] if mishap.node else self._stage.stations
        return any(station.has_half_done(mishap.step, now_ms) for station in stations)


class MockDisk(SystemDisk):
    """The disk under a run's record, full when a mishap says so."""

    def __init__(self, stage: MishapStage) -> None:
        self._stage = stage

    def write(self, descriptor: int, data: bytes, offset: int) -> int:
        """See Disk."""
        if self._stage.disk_is_full:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(descriptor, data, offset)


def _fails(fault: Fault) -> Meddle:
    """The node's motors run into `fault` in the step that was named."""

    def meddle(stage: MishapStage, mishap: Mishap, packet: Packet) -> None:
        station = stage.station(mishap)
        if station.node.memory.staged == mishap.step:
            station.plant.trouble = fault
        elif station.plant.trouble is fault:
            station.plant.trouble = Fault.NONE

    return meddle


def _reboot(stage: MishapStage, mishap: Mishap, now_ms: int) -> None:
    stage.station(mishap).restart(now_ms, stage.random)


def _off(stage: MishapStage, mishap: Mishap, now_ms: int) -> None:
    stage.station(mishap).restart(now_ms, stage.random)
    stage.station(mishap).deaf_until_ms = FOR_EVER


def _silence(stage: MishapStage, mishap: Mishap, now_ms: int) -> None:
    stage.station(mishap).deaf_until_ms = now_ms + SILENCE_MS


def _jam(stage: MishapStage, mishap: Mishap, now_ms: int) -> None:
    for station in stage.stations:
        station.deaf_until_ms = FOR_EVER


def _reset(stage: MishapStage, mishap: Mishap, now_ms: int) -> None:
    stage.air.reset()
    for station in stage.stations:
        station.deaf_until_ms = max(station.deaf_until_ms, now_ms + RESET_MS)


def _gone(stage: MishapStage, mishap: Mishap, now_ms: int) -> None:
    stage.gone_until_ms = FOR_EVER


def _replug(stage: MishapStage, mishap: Mishap, now_ms: int) -> None:
    stage.gone_until_ms = now_ms + REPLUG_MS


def _sleep(stage: MishapStage, mishap: Mishap, now_ms: int) -> None:
    stage.asleep_until_ms = now_ms + SLEEP_MS


def _stop(stage: MishapStage, mishap: Mishap, now_ms: int) -> None:
    for station in stage.stations:
        station.intrude(now_ms, encode_stop(StopFrame(0), station.identity.site.stop_key))


def _disk(stage: MishapStage, mishap: Mishap, now_ms: int) -> None:
    stage.disk_is_full = True


def _taken(stage: MishapStage, mishap: Mishap, now_ms: int) -> None:
    stage.rivals.append(Rival(stage.station(mishap), stage.random))


def _busy(stage: MishapStage, mishap: Mishap) -> None:
    stage.rivals.append(Rival(stage.station(mishap), stage.random))


def _unhomed(stage: MishapStage, mishap: Mishap) -> None:
    stage.station(mishap).memory.unhomed = NOWHERE


def _wired(name: str) -> Prepare:
    """The board is built wrong: one more axis in the set `name` of its wiring."""

    def prepare(stage: MishapStage, mishap: Mishap) -> None:
        wiring = stage.station(mishap).plant.wiring
        setattr(wiring, name, getattr(wiring, name) | 1 << mishap.axis - 1)

    return prepare


def _away(stage: MishapStage, mishap: Mishap) -> None:
    for station in stage.stations[mishap.node - 1 :]:
        station.deaf_until_ms = FOR_EVER


def _open(stage: MishapStage, mishap: Mishap) -> None:
    stage.station(mishap).dead_switches |= 1 << mishap.axis - 1


def _supply(stage: MishapStage, mishap: Mishap) -> None:
    stage.station(mishap).plant.wiring.is_sagging = True


def _key(stage: MishapStage, mishap: Mishap) -> None:
    station = stage.station(mishap)
    station.spoil(replace(station.settings, master=bytes(each ^ 0xA5 for each in station.settings.master)))


def _channel(stage: MishapStage, mishap: Mishap) -> None:
    station = stage.station(mishap)
    station.spoil(replace(station.settings, channel=STRAY_CHANNEL))


def _no_loader(stage: MishapStage, mishap: Mishap) -> None:
    stage.station(mishap).plant.has_loader = False


def _firmware(stage: MishapStage, mishap: Mishap) -> None:
    station = stage.station(mishap)
    station.kind, station.firmware = OldFirmware, OLD_FIRMWARE


def _cut(stage: MishapStage, mishap: Mishap) -> None:
    flash = stage.station(mishap).flash
    flash.cut_at = flash.done + mishap.step


def _estop(stage: MishapStage, mishap: Mishap) -> None:
    stage.station(mishap).memory.estop = True


def _version(stage: MishapStage, mishap: Mishap) -> None:
    stage.station(mishap).kind = NextVersion


def _config(stage: MishapStage, mishap: Mishap) -> None:
    station = stage.station(mishap)
    extrude, bias, translate = station.axes
    station.spoil(replace(station.settings, axes=(extrude, bias, replace(translate, high=translate.high - 1))))


def _chip(stage: MishapStage, mishap: Mishap) -> None:
    stage.station(mishap).chip ^= 1


def _twin(stage: MishapStage, mishap: Mishap) -> None:
    station = stage.station(mishap)
    memory = Memory(noise=stage.random.getrandbits(32))
    station.twin = NodeMachine(stranger_identity(station.identity, 2), station.axes, MotorPlant((0, 0, 0)), memory)


def _clone(stage: MishapStage, mishap: Mishap) -> None:
    stage.station(mishap).is_clone = True


def _stranger(stage: MishapStage, mishap: Mishap, packet: Packet) -> None:
    if packet.node and stage.random.random() < mishap.chance:
        stage.stations[packet.node - 1].intrude(packet.now_ms, forged(packet.payload, stage.random))


def _replay(stage: MishapStage, mishap: Mishap, packet: Packet) -> None:
    past = stage.heard[packet.node]
    if packet.node and past and stage.random.random() < mishap.chance:
        stage.stations[packet.node - 1].intrude(packet.now_ms, stage.random.choice(past))
    past.append(packet.payload)


MISHAPS: Mapping[str, MishapRow] = {
    "stall": MishapRow(Form.NODE_STEP, "a motor is blocked", meddle=_fails(Fault.STALL)),
    "encoder": MishapRow(Form.NODE_STEP, "an encoder gives no counts any more", meddle=_fails(Fault.ENCODER)),
    "runaway": MishapRow(Form.NODE_STEP, "a motor turns the wrong way", meddle=_fails(Fault.RUNAWAY)),
    "driver": MishapRow(Form.NODE_STEP, "the motor driver reports a fault", meddle=_fails(Fault.DRIVER)),
    "brownout": MishapRow(Form.NODE_STEP, "the supply sags", meddle=_fails(Fault.BROWN_OUT)),
    "reboot": MishapRow(Form.NODE_STEP, "a node restarts", strike=_reboot),
    "off": MishapRow(Form.NODE_STEP, "a node loses power for good", strike=_off),
    "silence": MishapRow(Form.NODE_STEP, "a node hears nothing for 3 s", strike=_silence),
    "taken": MishapRow(Form.NODE_STEP, "another host takes a node over", strike=_taken),
    "jam": MishapRow(Form.STEP, "no node hears or answers any more", strike=_jam),
    "reset": MishapRow(Form.STEP, "the radio's chip restarts and comes back", strike=_reset),
    "gone": MishapRow(Form.STEP, "the radio is unplugged", strike=_gone),
    "replug": MishapRow(Form.STEP, "the radio is unplugged for 2.5 s", strike=_replug),
    "sleep": MishapRow(Form.STEP, "this computer sleeps for 10 s", strike=_sleep),
    "stop": MishapRow(Form.STEP, "somebody else stops the display", strike=_stop),
    "disk": MishapRow(Form.FULL_STEP, "the disk under the run's record is full", strike=_disk),
    "unhomed": MishapRow(Form.NODE, "a node has not been homed", prepare=_unhomed),
    "absent": MishapRow(Form.AXIS_NODE, "a motor is not connected", prepare=_wired("absent")),
    "reversed": MishapRow(Form.AXIS_NODE, "a motor's two wires are exchanged", prepare=_wired("reversed")),
    "swapped": MishapRow(Form.AXIS_NODE, "an encoder is in the socket of the next axis", prepare=_wired("swapped")),
    "noisy": MishapRow(Form.AXIS_NODE, "an encoder loses edges", prepare=_wired("noisy")),
    "loose": MishapRow(Form.AXIS_NODE, "an encoder gives counts now and then", prepare=_wired("loose")),
    "gear": MishapRow(Form.AXIS_NODE, "a motor has another gear", prepare=_wired("geared")),
    "switch": MishapRow(Form.AXIS_NODE, "a switch is always closed", prepare=_wired("stuck_switches")),
    "open": MishapRow(Form.AXIS_NODE, "a switch never closes", prepare=_open),
    "away": MishapRow(Form.NODE, "a node and all to the right of it are switched off", prepare=_away),
    "supply": MishapRow(Form.NODE, "the supply sags while a motor turns", prepare=_supply),
    "key": MishapRow(Form.NODE, "a node has the key of another site", prepare=_key),
    "cut": MishapRow(Form.NODE_WORD, "the power fails in the midst of a word of settings", prepare=_cut),
    "channel": MishapRow(Form.NODE, "a node listens on another channel", prepare=_channel),
    "firmware": MishapRow(Form.NODE, "a node has older firmware", prepare=_firmware),
    "noloader": MishapRow(Form.NODE, "a node has no loader in front of its program", prepare=_no_loader),
    "estop": MishapRow(Form.NODE, "a node was stopped for good", prepare=_estop),
    "version": MishapRow(Form.NODE, "a node has firmware for another protocol", prepare=_version),
    "config": MishapRow(Form.NODE, "a node holds other limits", prepare=_config),
    "chip": MishapRow(Form.NODE, "another device stands in a node's place", prepare=_chip),
    "twin": MishapRow(Form.NODE, "two devices listen on one address", prepare=_twin),
    "busy": MishapRow(Form.NODE, "another host is sending to a node", prepare=_busy),
    "clone": MishapRow(Form.NODE, "a node's radio chip is a bad copy", prepare=_clone),
    "stranger": MishapRow(Form.CHANCE, "a forged frame before a packet", meddle=_stranger),
    "replay": MishapRow(Form.CHANCE, "an old frame once more before a packet", meddle=_replay),
}
