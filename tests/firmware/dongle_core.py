"""The dongle's C core and the driver of its radio chip, compiled for this machine, with Python on their other side."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

from curveline.radio.ports.dongle import PacketKind, Refusal, SendOutcome, Splitter, encode_packet

from .build import CORE, FIRMWARE, shared_library

UNIQUE = bytes(range(1, 17))
ADDRESS, PAYLOAD = 5, 32
SETTINGS = (76, 1, 5, 3, 500)
"""Channel, rate, address width, repeats, time between them; a power may follow."""
FULL_POWER = 3


class Settings(ctypes.Structure):
    _fields_ = (
        ("channel", ctypes.c_uint8),
        ("rate", ctypes.c_uint8),
        ("width", ctypes.c_uint8),
        ("retries", ctypes.c_uint8),
        ("delay_us", ctypes.c_uint16),
        ("power", ctypes.c_uint8),
    )

    def values(self) -> tuple[int, int, int, int, int]:
        return self.channel, self.rate, self.width, self.retries, self.delay_us


class Reply(ctypes.Structure):
    _fields_ = (("payload", ctypes.c_uint8 * PAYLOAD), ("length", ctypes.c_uint8), ("retries", ctypes.c_uint8))


BYTES = ctypes.POINTER(ctypes.c_uint8)
SELF = ctypes.c_void_p
CONFIGURE = ctypes.CFUNCTYPE(ctypes.c_bool, SELF, ctypes.POINTER(Settings))
TRANSMIT = ctypes.CFUNCTYPE(ctypes.c_int, SELF, BYTES, BYTES, ctypes.POINTER(Reply))
CARRIER = ctypes.CFUNCTYPE(ctypes.c_bool, SELF, ctypes.c_uint8)
EMIT = ctypes.CFUNCTYPE(ctypes.c_bool, SELF, BYTES, ctypes.c_size_t)
ACT = ctypes.CFUNCTYPE(None, SELF)
TRANSFER = ctypes.CFUNCTYPE(ctypes.c_uint8, SELF, ctypes.c_uint8)
ENABLE = ctypes.CFUNCTYPE(None, SELF, ctypes.c_bool)
WAIT = ctypes.CFUNCTYPE(None, SELF, ctypes.c_uint32)
NOW = ctypes.CFUNCTYPE(ctypes.c_uint32, SELF)


class RadioTable(ctypes.Structure):
    _fields_ = (("self", SELF), ("configure", CONFIGURE), ("transmit", TRANSMIT), ("carrier", CARRIER))


class LineTable(ctypes.Structure):
    _fields_ = (("self", SELF), ("emit", EMIT))


class PinsTable(ctypes.Structure):
    _fields_ = (
        ("self", SELF),
        ("select", ACT),
        ("transfer", TRANSFER),
        ("deselect", ACT),
        ("enable", ENABLE),
        ("wait_us", WAIT),
        ("now_us", NOW),
    )


@lru_cache(maxsize=1)
def library() -> ctypes.CDLL:
    sources = [CORE / "dongle.c", FIRMWARE / "dongle" / "sender.c", Path(__file__).parent / "dongle_sizes.c"]
    loaded = ctypes.CDLL(str(shared_library("dongle", sources, [f"-I{FIRMWARE / 'dongle'}"])))
    for name in ("cl_dongle_step", "cl_sender_configure", "cl_sender_carrier"):
        getattr(loaded, name).restype = ctypes.c_bool
    loaded.cl_dongle_crc.restype = ctypes.c_uint32
    loaded.cl_dongle_size.restype = loaded.cl_sender_size.restype = ctypes.c_size_t
    return loaded


Transmitter = Callable[[str, bytes], tuple[SendOutcome, bytes, int]]
"""What becomes of an address and a payload: outcome, answer, how often the chip repeated the packet."""


class Core:
    """One dongle; `transmit` is its air, `said` what it has told the host, `sent` and `configured` what it has done."""

    def __init__(self, transmit: Transmitter = lambda address, payload: (SendOutcome.ACKED, b"", 0)) -> None:
        self.transmit = transmit
        self.configure: Callable[..., bool] = lambda *settings: True
        self.said = bytearray()
        self.sent: list[tuple[str, bytes]] = []
        self.configured: list[tuple[int, int, int, int, int]] = []
        self.powers: list[int] = []
        self.carriers: set[int] = set()
        self.hears: Callable[[int], bool] = lambda channel: channel in self.carriers
        self.has_chip = True
        self.line_takes = True
        self.lied_length: int | None = None
        self._library = library()
        self._memory = ctypes.create_string_buffer(self._library.cl_dongle_size())
        self._radio = RadioTable(None, CONFIGURE(self._configure), TRANSMIT(self._transmit), CARRIER(self._carrier))
        self._line = LineTable(None, EMIT(self._emit))
        self._splitter = Splitter()
        self.start()

    def start(self) -> None:
        """Power on."""
        self._library.cl_dongle_init(self._memory, ctypes.byref(self._radio), ctypes.byref(self._line), UNIQUE)

    def feed(self, data: bytes) -> None:
        self._library.cl_dongle_feed(self._memory, data, ctypes.c_size_t(len(data)))

    def step(self, now_ms: int = 0) -> bool:
        return bool(self._library.cl_dongle_step(self._memory, ctypes.c_uint32(now_ms)))

    def abandon(self) -> None:
        self._library.cl_dongle_abandon(self._memory)

    def take(self) -> bytes:
        """What it has said since the last call."""
        said, self.said = bytes(self.said), bytearray()
        return said

    def bodies(self) -> list[bytes]:
        """The packets in what it has said since the last call."""
        return list(self._splitter.feed(self.take()))

    def ask(self, kind: int, rest: bytes = b"", number: int = 7) -> list[bytes]:
        """Make a request and let it be worked off; the bodies of all answers."""
        self.feed(encode_packet(bytes([kind, number]) + rest))
        while self.step():
            pass
        return self.bodies()

    def set_up(self) -> None:
        assert self.ask(PacketKind.CONFIGURE, settings_bytes()) == [bytes([PacketKind.CONFIGURED, 7])]

    def _configure(self, _: int, settings: Any) -> bool:
        self.configured.append(settings.contents.values())
        self.powers.append(settings.contents.power)
        return self.has_chip and self.configure(*self.configured[-1])

    def _transmit(self, _: int, address: Any, payload: Any, reply: Any) -> int:
        where = ctypes.string_at(address, ADDRESS).hex().upper()
        what = ctypes.string_at(payload, PAYLOAD)
        self.sent.append((where, what))
        if not self.has_chip:
            return SendOutcome.BROKEN
        outcome, answer, retries = self.transmit(where, what)
        ctypes.memmove(reply.contents.payload, answer, len(answer))
        reply.contents.length = len(answer) if self.lied_length is None else self.lied_length
        reply.contents.retries = retries
        return outcome

    def _carrier(self, _: int, channel: int) -> bool:
        return self.hears(channel)

    def _emit(self, _: int, data: Any, length: int) -> bool:
        if self.line_takes:
            self.said += ctypes.string_at(data, length)
        return self.line_takes


class ChipPins(Protocol):
    """The pins of the radio chip model."""

    ce: int

    def select(self) -> None: ...

    def transfer(self, byte: int) -> int: ...

    def deselect(self) -> None: ...


class Clock(Protocol):
    """The ether, as far as it is a clock."""

    now_us: int

    def advance(self, until_us: int) -> None: ...


BUS_US = 1
"""Time on the bus for one byte, at 8 MHz."""


class Sender:
    """The driver of the dongle's radio chip, on a modelled chip whose time passes with every byte on the bus."""

    def __init__(self, chip: ChipPins, ether: Clock) -> None:
        self._chip, self._ether = chip, ether
        self._library = library()
        self._memory = ctypes.create_string_buffer(self._library.cl_sender_size())
        self._pins = PinsTable(
            None,
            ACT(lambda _: chip.select()),
            TRANSFER(self._transfer),
            ACT(lambda _: chip.deselect()),
            ENABLE(self._enable),
            WAIT(lambda _, duration_us: ether.advance(ether.now_us + duration_us)),
            NOW(lambda _: ether.now_us & 0xFFFFFFFF),
        )
        self._library.cl_sender_init(self._memory, ctypes.byref(self._pins))

    def configure(self, *values: int) -> bool:
        settings = Settings(*(values or SETTINGS)[:5], *(values[5:] or (FULL_POWER,)))
        return bool(self._library.cl_sender_configure(self._memory, ctypes.byref(settings)))

    def transmit(self, address: str, payload: bytes) -> tuple[SendOutcome, bytes, int]:
        reply = Reply()
        outcome = self._library.cl_sender_transmit(self._memory, bytes.fromhex(address), payload, ctypes.byref(reply))
        return SendOutcome(outcome), bytes(reply.payload[: reply.length]), reply.retries

    def carrier(self, channel: int) -> bool:
        return bool(self._library.cl_sender_carrier(self._memory, ctypes.c_uint8(channel)))

    def _transfer(self, _: int, byte: int) -> int:
        self._ether.advance(self._ether.now_us + BUS_US)
        return self._chip.transfer(byte)

    def _enable(self, _: int, level: bool) -> None:
        self._chip.ce = int(level)


def settings_bytes(*values: int) -> bytes:
    *small, delay_us = values or SETTINGS
    return bytes(small) + delay_us.to_bytes(2, "little")


def schedule_bytes(frames: list[tuple[str, bytes]]) -> bytes:
    return bytes([len(frames)]) + b"".join(bytes.fromhex(address) + payload for address, payload in frames)


def refused(kind: int, why: Refusal, number: int = 7) -> list[bytes]:
    return [bytes([PacketKind.REFUSED, number, kind, why])]
