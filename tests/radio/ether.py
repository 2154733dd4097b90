"""The air between register-level chips: a seeded, lossy, corrupting medium with a clock of its own, in microseconds.

Nothing happens by itself: `advance` lets the clock go on and does what falls due; `next_us` tells when that will be, so
that an emulator can run its processor up to there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from heapq import heappop, heappush
from itertools import count
from random import Random

from .chip import Chip, Packet


@dataclass(eq=False)
class Flight:
    """A packet in the air; two that overlap on one channel spoil each other."""

    sender: Chip
    packet: Packet
    start_us: int
    spoilt: bool = False


class Ether:
    """Connects chips; `loss` is the chance that a packet does not arrive at a receiver, acknowledgements included,
    `corrupt` that one bit of its payload is wrong and the CRC has not noticed.

    `jams` can lose packets on purpose: it is asked with sender, receiver and packet. `noise` says whether somebody
    else sends on a channel at a time [us]; what is sent meanwhile is lost. `sent` counts all packets.
    """

    def __init__(self, loss: float = 0.0, corrupt: float = 0.0, seed: int = 0) -> None:
        self.now_us = 0
        self.loss = loss
        self.corrupt = corrupt
        self.jams: Callable[[Chip, Chip, Packet], bool] | None = None
        self.noise: Callable[[int, int], bool] = lambda channel, now_us: False
        self.sent = 0
        self._random = Random(seed)
        self._order = count()
        self._events: list[tuple[int, int, Callable[[], None]]] = []
        self._chips: list[Chip] = []
        self._flights: list[Flight] = []

    # The clock

    def at(self, moment_us: int, event: Callable[[], None]) -> None:
        """Let `event` happen at `moment_us`; events of one moment happen in the order they were asked for."""
        heappush(self._events, (max(moment_us, self.now_us), next(self._order), event))

    def next_us(self) -> int | None:
        """When the next thing is due, None if nothing is."""
        return self._events[0][0] if self._events else None

    def advance(self, until_us: int) -> None:
        """Let the time come to `until_us`."""
        while self._events and self._events[0][0] <= until_us:
            moment_us, _, event = heappop(self._events)
            self.now_us = max(self.now_us, moment_us)
            event()
        self.now_us = max(self.now_us, until_us)

    # The air

    def join(self, chip: Chip) -> None:
        """See Medium."""
        self._chips.append(chip)

    def transmit(self, sender: Chip, packet: Packet) -> None:
        """See Medium."""
        flight = Flight(sender, packet, self.now_us)
        for other in self._flights:
            if other.packet.channel == packet.channel:
                other.spoilt = flight.spoilt = True
        self._flights.append(flight)
        self.sent += 1
        self.at(self.now_us + packet.air_us, partial(self._land, flight))

    def has_carrier(self, listener: Chip, channel: int) -> bool:
        """See Medium."""
        chips = any(each.packet.channel == channel and each.sender is not listener for each in self._flights)
        return chips or self.noise(channel, self.now_us)

    def _land(self, flight: Flight) -> None:
        self._flights.remove(flight)
        ends_us = (flight.start_us, self.now_us)
        flight.spoilt = flight.spoilt or any(self.noise(flight.packet.channel, each) for each in ends_us)
        listening = [
            chip for chip in self._chips if chip is not flight.sender and chip.hears(flight.packet, flight.start_us)
        ]
        flight.sender.sent(flight.packet)
        for chip in listening:
            if not flight.spoilt and not self._loses(flight, chip):
                chip.take(self._worn(flight.packet))

    def _loses(self, flight: Flight, chip: Chip) -> bool:
        if self.jams is not None and self.jams(flight.sender, chip, flight.packet):
            return True
        return bool(self.loss) and self._random.random() < self.loss

    def _worn(self, packet: Packet) -> Packet:
        if not self.corrupt or not packet.payload or self._random.random() >= self.corrupt:
            return packet
        payload = bytearray(packet.payload)
        bit = self._random.randrange(8 * len(payload))
        payload[bit >> 3] ^= 1 << (bit & 7)
        return replace(packet, payload=bytes(payload))
