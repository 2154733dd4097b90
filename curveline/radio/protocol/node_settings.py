"""What a node is told of itself: its number, where it listens, its master key, its limits; one record of 84 bytes."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from zlib import crc32

from curveline.drive_settings import MAX_CHANNEL, DriveSettings
from curveline.errors import InvalidInput
from curveline.radio.protocol.air_time import RATES_KBPS
from curveline.radio.protocol.codes import EVERY_NODE
from curveline.radio.protocol.keys import KEY_BYTES
from curveline.radio.protocol.motion import LEAST_RATE, MOST_RATE, Axes, AxisLimits, axes_of

MOST_NUMBER = EVERY_NODE - 1
SETTINGS_MAGIC = b"CLN2"
NO_SETTINGS = bytes(4)
"""What a cable puts into the other sector, so that nothing older is found there."""
GENERATIONS = 1 << 16
"""Generations are counted modulo this; the newer of two is the one that is less than half of it ahead."""

_SETTINGS = struct.Struct(f"<4sHBBB5sH{KEY_BYTES}s")
_AXIS = struct.Struct("<iiII")
SETTINGS_BYTES = _SETTINGS.size + 3 * _AXIS.size + 4


@dataclass(frozen=True)
class NodeSettings:
    """Settings of one node; the master key never shows in a repr."""

    number: int  # of the node in its row, from 1
    data_rate: str  # such as 1Mbps
    channel: int  # of the radio
    address: str  # ten hexadecimal digits in capitals
    master: bytes = field(repr=False)  # key of the site, 16 bytes
    axes: Axes  # limits in counts
    generation: int = 0  # grows by one with every change over the air; 0 from a cable

    @property
    def place(self) -> tuple[int, ...]:
        """What positions hang on: whose motors they are of, and where their travel ends."""
        return self.number, *(end for axis in self.axes for end in (axis.low, axis.high))

    def record(self) -> bytes:
        """The 84 bytes of a record, little-endian.

        Magic, size with checksum u16, number u8, data rate u8 (0 250 kbps, 1 1 Mbps, 2 2 Mbps), channel u8, address
        5 bytes in the order of its digits, generation u16, master key 16 bytes; per axis low and high i32, speed and
        acceleration u32 in counts; CRC-32 of all before.
        """
        rate, address = list(RATES_KBPS).index(self.data_rate), bytes.fromhex(self.address)
        whose = SETTINGS_MAGIC, SETTINGS_BYTES, self.number, rate, self.channel, address
        body = _SETTINGS.pack(*whose, self.generation, self.master)
        for axis in self.axes:
            body += _AXIS.pack(axis.low, axis.high, axis.speed, axis.acceleration)
        return body + crc32(body).to_bytes(4, "little")

    def sector(self) -> bytes:
        """What a cable puts into the sector of the settings: the record, neither requested nor tried, but kept."""
        return self.record() + 2 * b"\xff\xff\xff\xff" + bytes(4)


def node_settings(master: bytes, drive: DriveSettings, number: int, generation: int = 0) -> NodeSettings:
    """What node `number` (from 1) of a display must know before it can be reached; InvalidInput if there is none."""
    last = min(drive.node_count, MOST_NUMBER)
    if not 1 <= number <= last:
        raise InvalidInput(f"there is no node {number}: display {drive.display!r} has nodes 1 to {last}")
    address = drive.addresses[number - 1].upper()
    return NodeSettings(number, drive.data_rate, drive.channel, address, master, axes_of(drive), generation)


def settings_in(record: bytes) -> NodeSettings | None:
    """The settings that a record holds, None unless it is whole and makes sense to a node."""
    if len(record) != SETTINGS_BYTES or int.from_bytes(record[-4:], "little") != crc32(record[:-4]):
        return None
    magic, size, number, rate, channel, address, generation, master = _SETTINGS.unpack_from(record)
    if magic != SETTINGS_MAGIC or size != SETTINGS_BYTES or not 1 <= number <= MOST_NUMBER:
        return None
    if rate >= len(RATES_KBPS) or channel > MAX_CHANNEL:
        return None
    x, y, z = (AxisLimits(*_AXIS.unpack_from(record, _SETTINGS.size + index * _AXIS.size)) for index in range(3))
    if not all(_is_sound(axis) for axis in (x, y, z)):
        return None
    place = number, list(RATES_KBPS)[rate], channel, address.hex().upper()
    return NodeSettings(*place, master, (x, y, z), generation)


def is_newer(generation: int, than: int) -> bool:
    """Whether a generation comes after another one, by the shorter way round."""
    return 0 < (generation - than) % GENERATIONS < GENERATIONS // 2


def _is_sound(axis: AxisLimits) -> bool:
    rates = axis.speed, axis.acceleration
    return axis.low <= axis.high and all(LEAST_RATE <= rate <= MOST_RATE for rate in rates)
