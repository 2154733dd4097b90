"""The talk between host and USB dongle, docs/dongle-protocol.md: packets, and what is asked and answered in them.

Nothing here knows what a serial port is: a `Line` carries bytes and tells the time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol
from zlib import crc32

from curveline.errors import LinkError
from curveline.radio.interface import Answer
from curveline.radio.protocol.air_time import PACKET_BITS, RATES_KBPS, RETRIES, TURN_US
from curveline.radio.protocol.band import CHANNELS, FULL_POWER, POWERS_DBM

VERSION = 1
CRC_BYTES = 4
ADDRESS_BYTES = 5
CAN_SET_POWER = 2
"""The bit of a dongle's capabilities that says so."""
PACKET_LIMIT = 700
"""Bytes between two zeros after which nothing that a dongle says can be meant."""

HELLO_S = 0.15
HELLOS = 6
"""How long an introduction waits for an answer, and how often it is made: a mute device is told within a second."""
ANSWER_S = 0.1
"""What USB, and a dongle with other things to do, may add to the time that the radio needs."""
SCAN_S = 0.5
BELATED_BYTES = 4096
"""What may have gathered while this process was kept from running: more than all answers to one request."""
DELAY_US = {"250kbps": 1500, "1Mbps": 500, "2Mbps": 500}
"""Time between repeats: what an acknowledgement with 32 bytes in it needs."""

FLASH_HINT = "flash the dongle with the firmware of this release of curveline: firmware/dongle/README.md"
CHIP_LOST = "its radio chip does not answer"
CHIP_HINT = "check the wiring and the supply of the nRF24L01+ on the dongle; it needs 10 uF across its 3.3 V"


class PacketKind(IntEnum):
    """Byte 0 of a packet."""

    HELLO = 0x01
    CONFIGURE = 0x02
    SCHEDULE = 0x03
    SCAN = 0x04
    IDENT = 0x81
    CONFIGURED = 0x82
    RESULT = 0x83
    SCANNED = 0x84
    REFUSED = 0xFF


class Refusal(IntEnum):
    """Why a dongle refused a request."""

    UNKNOWN = 1
    MALFORMED = 2
    UNCONFIGURED = 3
    CHIP = 4


class SendOutcome(IntEnum):
    """What one transmission came to."""

    NOTHING = 0
    ACKED = 1
    BROKEN = 2


class LineLost(Exception):
    """The dongle cannot be used any more; the text says how that showed, `hint` what may help."""

    def __init__(self, text: str, hint: str = "") -> None:
        super().__init__(text)
        self.hint = hint


class LineSilent(LineLost):
    """The line is there, but the dongle says nothing."""


class Line(Protocol):
    """Bytes to and from a dongle; both ways raise LineLost."""

    def write(self, data: bytes) -> None:
        """Send; returns soon."""
        ...

    def read(self) -> bytes:
        """What has come, after a short wait if nothing has; empty if nothing did."""
        ...

    def now_s(self) -> float:
        """Time that only grows."""
        ...

    def close(self) -> None:
        """Give the line back."""
        ...


@dataclass(frozen=True)
class DongleIdent:
    """What a dongle says of itself."""

    version: int
    capabilities: int
    firmware: int
    bad_packets: int
    unique: bytes


def encode_packet(body: bytes) -> bytes:
    """`body` with its checksum, stuffed so that it holds no zero, between zeros."""
    packet = bytearray(b"\0")
    for chunk in (body + crc32(body).to_bytes(CRC_BYTES, "little")).split(b"\0"):
        rest = chunk
        while len(rest) >= 0xFE:
            packet += b"\xff" + rest[:0xFE]
            rest = rest[0xFE:]
        packet.append(len(rest) + 1)
        packet += rest
    return bytes(packet) + b"\0"


def decode_packet(packet: bytes) -> bytes | None:
    """The body of what stood between two zeros, None if it is damaged."""
    data = bytearray()
    at = 0
    while at < len(packet):
        end = at + packet[at]
        if end > len(packet):
            return None
        data += packet[at + 1 : end]
        if end < len(packet) and packet[at] != 0xFF:
            data.append(0)
        at = end
    body, checksum = bytes(data[:-CRC_BYTES]), bytes(data[-CRC_BYTES:])
    return body if len(body) >= 2 and crc32(body).to_bytes(CRC_BYTES, "little") == checksum else None


class Splitter:
    """Finds the packets in what comes off a line, in pieces of any size, between any rubbish."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> Iterator[bytes]:
        """Bodies of the whole packets that end in `data`."""
        *packets, rest = (self._rest + data).split(b"\0")
        self._rest = rest[:PACKET_LIMIT]
        for packet in packets:
            body = decode_packet(packet)
            if body is not None:
                yield body


def frame_s(data_rate: str) -> float:
    """The longest time that the radio needs for one frame: all repeats, and no answer."""
    way_us = PACKET_BITS * 1000 // RATES_KBPS[data_rate] + TURN_US
    return (1 + RETRIES) * (way_us + DELAY_US[data_rate]) / 1e6


class Dongle:
    """A dongle at the other end of a line; methods raise LineLost if it is not there, LinkError if it refuses."""

    def __init__(self, line: Line, name: str) -> None:
        self.line = line
        self.name = name
        self._splitter = Splitter()
        self._inbox: list[bytes] = []
        self._id = 0
        self._quiet_s = ANSWER_S

    def introduce(self, tries: int = HELLOS) -> DongleIdent:
        """Ask who it is; LinkError if it speaks another version."""
        for _ in range(tries):
            self._ask(PacketKind.HELLO, bytes([VERSION, VERSION]))
            try:
                body = self._answer(PacketKind.IDENT, HELLO_S)
            except LineSilent:
                continue
            if len(body) > 2 and body[2] != VERSION:
                raise LinkError(f"the dongle at {self.name} speaks version {body[2]}, this host {VERSION}", FLASH_HINT)
            if len(body) >= 29:
                number = int.from_bytes
                return DongleIdent(
                    version=body[2],
                    capabilities=number(body[4:6], "little"),
                    firmware=number(body[6:10], "little"),
                    bad_packets=number(body[11:13], "little"),
                    unique=body[13:29],
                )
        raise LineSilent("it does not answer as a dongle would")

    def configure(self, channel: int, data_rate: str, power: str = FULL_POWER) -> None:
        """Set up its radio; LinkError if its chip does not answer. A dongle that knows only full power is told none."""
        rate = list(RATES_KBPS).index(data_rate)
        delay = DELAY_US[data_rate].to_bytes(2, "little")
        last = b"" if power == FULL_POWER else bytes([list(POWERS_DBM).index(power)])
        self._ask(PacketKind.CONFIGURE, bytes([channel, rate, ADDRESS_BYTES, RETRIES]) + delay + last)
        self._quiet_s = ANSWER_S + frame_s(data_rate)
        self._answer(PacketKind.CONFIGURED, self._quiet_s)

    def exchange(self, frames: Sequence[tuple[str, bytes]]) -> list[Answer]:
        """Have frames sent in order; what came back for each."""
        listed = b"".join(bytes.fromhex(address) + payload for address, payload in frames)
        self._ask(PacketKind.SCHEDULE, bytes([len(frames)]) + listed)
        return [self._result(index) for index in range(len(frames))]

    def scan(self) -> list[int]:
        """The channels on which there is a carrier just now, whoever's it is."""
        self._ask(PacketKind.SCAN, b"")
        bits = int.from_bytes(self._answer(PacketKind.SCANNED, SCAN_S)[2:], "little")
        return [channel for channel in range(CHANNELS) if bits >> channel & 1]

    def _result(self, index: int) -> Answer:
        body = self._answer(PacketKind.RESULT, self._quiet_s)
        if len(body) < 6 or body[2] != index or len(body) != 6 + body[5]:
            raise LineLost("an answer of it was lost on the way")
        outcome, retries, payload = body[3], body[4], body[6:]
        if outcome == SendOutcome.BROKEN:
            raise LineLost(CHIP_LOST, CHIP_HINT)
        return Answer(payload if outcome == SendOutcome.ACKED else None, retries)

    def _ask(self, kind: PacketKind, rest: bytes) -> None:
        """Send a request; answers to earlier ones no longer count, wherever they are."""
        self._id = self._id + 1 & 0xFF
        self.line.write(encode_packet(bytes([kind, self._id]) + rest))

    def _answer(self, kind: PacketKind, limit_s: float) -> bytes:
        """The next packet about the last request; LineSilent if none comes in time.

        A host that was kept from running finds that time is up and the answer is there: what has come is read first.
        Something that never stops talking is no dongle.
        """
        deadline = self.line.now_s() + limit_s
        belated = 0
        while True:
            while self._inbox:
                body = self._inbox.pop(0)
                if body[1] != self._id:
                    continue
                if body[0] == PacketKind.REFUSED:
                    raise self._refusal(body)
                if body[0] == kind:
                    return body
            is_late = self.line.now_s() >= deadline
            data = self.line.read()
            belated += len(data) if is_late else 0
            if is_late and (not data or belated > BELATED_BYTES):
                raise LineSilent("it does not answer any more")
            self._inbox.extend(self._splitter.feed(data))

    def _refusal(self, body: bytes) -> Exception:
        why = body[3] if len(body) > 3 else 0
        if why == Refusal.UNCONFIGURED:
            return LineLost("it has restarted")
        if why == Refusal.CHIP:
            return LineLost(CHIP_LOST, CHIP_HINT)
        return LinkError(f"the dongle at {self.name} refused a request of kind {body[2:3].hex()} ({why})", FLASH_HINT)
