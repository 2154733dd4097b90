"""The air between host and nodes, and the radio chips at both ends, as the nRF24L01+ behaves: lossy and seeded.

Modelled per direction: loss, corruption that the chip's CRC does not see; further: duplicates made by the host's
library, answers that are older than they should be, hardware retries, and the receiver's filter, which drops a packet
whose 2-bit id and CRC equal those of the one before, while its hardware still acknowledges it.

Noise is WLAN: on its 20 MHz somebody sends for a part of the time, and a packet is lost with that chance, either way. A
weak link fades as Rayleigh has it, packet by packet: of those that arrive with a margin of so many dB in the mean, the
part 1 - exp(-1 / margin) is too weak. The host's power counts on the way there; nodes always answer with all of theirs.
"""

from __future__ import annotations

from binascii import crc_hqx
from collections import deque
from dataclasses import dataclass, field
from math import exp
from random import Random
from typing import Protocol

from curveline.radio.protocol.air_time import PACKET_BITS, RATES_KBPS, RETRIES, TURN_US
from curveline.radio.protocol.band import CHANNELS, FULL_POWER, POWERS_DBM, wlan_span

HOST_US = 600
"""Time the host spends per exchange: bus transfers to the chip and the library around them."""
QUEUE = 3
"""Answers that a receiver's queue holds at most."""


@dataclass(frozen=True)
class Weather:
    """Chances per packet: lost or corrupted in each direction, sent twice by the library, answered out of the past.

    `noise` are WLAN channels and the part of the time for which somebody sends on them; `margin` [dB] is by how much a
    packet at full power is stronger than it must be, in the mean, None for one that is always strong enough.
    """

    loss: float = 0.0
    duplicate: float = 0.0
    stale: float = 0.0
    corrupt: float = 0.0
    noise: tuple[tuple[int, float], ...] = ()
    margin: float | None = None

    def noise_on(self, channel: int) -> float:
        """For what part of the time somebody sends on a channel of ours."""
        quiet = 1.0
        for number, share in self.noise:
            quiet *= 1.0 - share * (channel in wlan_span(number))
        return 1.0 - quiet

    def lost(self, channel: int, power_dbm: int) -> float:
        """The chance that a packet does not arrive which is sent on a channel with some power."""
        if not self.noise and self.margin is None:
            return self.loss
        arrives = (1.0 - self.loss) * (1.0 - self.noise_on(channel))
        return 1.0 - arrives * (1.0 if self.margin is None else exp(-(10.0 ** (-(self.margin + power_dbm) / 10.0))))


class Receiver(Protocol):
    """A node as its radio sees it."""

    @property
    def ack(self) -> bytes:
        """The loaded answer."""
        ...

    def receive(self, now_ms: int, payload: bytes) -> None:
        """A packet that passed the filter."""
        ...

    def advance(self, now_ms: int) -> None:
        """Time has come to `now_ms`."""
        ...


@dataclass
class Antenna:
    """The receiving chip of one node."""

    node: Receiver
    last: tuple[int, int] = (-1, -1)
    answer: bytes = b""
    past: deque[bytes] = field(default_factory=lambda: deque(maxlen=QUEUE))


@dataclass(frozen=True)
class Heard:
    """What an exchange came to: the answer's payload or None, how often the chip repeated, and how long it took."""

    payload: bytes | None
    retries: int
    took_us: int


class Air:
    """One sending chip and the way to every node; `channel` and `power` are what the chip is set to."""

    def __init__(self, weather: Weather, data_rate: str, random: Random) -> None:
        self.weather = weather
        self.random = random
        self._packet_id = 0
        self.channel = 0
        self.power = FULL_POWER
        self.tune(data_rate)

    def tune(self, data_rate: str) -> None:
        """Send at another rate from now on."""
        self._way_us = PACKET_BITS * 1000 // RATES_KBPS[data_rate] + TURN_US
        self._delay_us = max(500, self._way_us + 250)

    def carriers(self) -> list[int]:
        """The channels on which somebody else sends just now."""
        chances = (self.weather.noise_on(channel) for channel in range(CHANNELS))
        return [channel for channel, chance in enumerate(chances) if chance and self.random.random() < chance]

    def reset(self) -> None:
        """The sending chip restarts and numbers its packets from the beginning."""
        self._packet_id = 0

    def unheard(self) -> Heard:
        """What sending to an address comes to on which nobody listens."""
        return Heard(None, RETRIES, HOST_US + (1 + RETRIES) * (self._way_us + self._delay_us))

    def exchange(self, antenna: Antenna, payload: bytes, now_us: int) -> Heard:
        """Send `payload` at `now_us`."""
        heard = self._transmit(antenna, payload, now_us + HOST_US)
        if self.weather.duplicate and self.random.random() < self.weather.duplicate:
            again = self._transmit(antenna, payload, now_us + HOST_US + heard.took_us)
            heard = Heard(again.payload, heard.retries + again.retries, heard.took_us + again.took_us)
        return Heard(heard.payload, heard.retries, heard.took_us + HOST_US)

    def _transmit(self, antenna: Antenna, payload: bytes, start_us: int) -> Heard:
        chance = self.random.random
        out = self.weather.lost(self.channel, POWERS_DBM[self.power])
        back = self.weather.lost(self.channel, POWERS_DBM[FULL_POWER])
        self._packet_id = self._packet_id + 1 & 3
        took_us = 0
        for attempt in range(1 + RETRIES):
            took_us += self._way_us
            if not out or chance() >= out:
                answer = self._arrive(antenna, payload, (start_us + took_us) // 1000)
                if not back or chance() >= back:
                    return Heard(self._spoilt(answer), attempt, took_us + self._way_us)
            took_us += self._delay_us
        return Heard(None, RETRIES, took_us)

    def _arrive(self, antenna: Antenna, payload: bytes, now_ms: int) -> bytes:
        """The receiving chip: its answer was loaded before the packet came, a repeat gets the same answer again."""
        antenna.node.advance(now_ms)
        key = (self._packet_id, crc_hqx(payload, 0xFFFF))
        if key != antenna.last:
            antenna.last = key
            antenna.answer = self._loaded(antenna)
            antenna.node.receive(now_ms, self._spoilt(payload))
        return antenna.answer

    def _loaded(self, antenna: Antenna) -> bytes:
        fresh = antenna.node.ack
        if self.weather.stale and antenna.past and self.random.random() < self.weather.stale:
            return self.random.choice(antenna.past)
        antenna.past.append(fresh)
        return fresh

    def _spoilt(self, payload: bytes) -> bytes:
        if not self.weather.corrupt or not payload or self.random.random() >= self.weather.corrupt:
            return payload
        bit = self.random.randrange(8 * len(payload))
        spoilt = bytearray(payload)
        spoilt[bit >> 3] ^= 1 << (bit & 7)
        return bytes(spoilt)
