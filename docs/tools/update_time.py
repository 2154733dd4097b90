"""How long a node's firmware update would take over the air, as docs/firmware-update.md describes it.

    python docs/tools/update_time.py

It is a model, quicker than the emulated chip: the air is that of the mock display, of the loader there is what bears on
time (pieces, sectors, a flash that stops everything), and frames carry no tags.
"""

from __future__ import annotations

import math
import struct
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from random import Random
from statistics import mean

from curveline.radio.mock.air import QUEUE, Air, Antenna, Weather

SECTOR_BYTES, WORD_BYTES, PIECE_BYTES = 1024, 4, 16
PIECES = SECTOR_BYTES // PIECE_BYTES
ALL_PIECES = (1 << PIECES) - 1
IMAGE_BYTES = 44 * 1024
"""The largest program that a node may have."""
SEEDS = range(5)
PIECE, ASK = 14, 13


@dataclass(frozen=True)
class FlashTimes:
    """How long the flash keeps the processor waiting."""

    erase_us: int  # for a sector
    word_us: int  # for a word that is programmed

    @property
    def sector_us(self) -> int:
        """To erase a sector and to fill it."""
        return self.erase_us + SECTOR_BYTES // WORD_BYTES * self.word_us


FLASHES = {"typical": FlashTimes(14_000, 65), "slowest": FlashTimes(114_000, 145)}
"""From the chip's data sheet."""


@dataclass
class LoaderModel:
    """What the loader does with pieces: keeps those of one sector, programs it when it is whole, is deaf meanwhile."""

    sectors: int  # of the image
    flash: FlashTimes  # how fast
    sector: int = 0  # the one that is being collected
    held: int = 0  # pieces of it, one bit each
    busy_until_us: int = 0  # the flash is at work
    now_us: int = 0  # of the host
    ack: bytes = b""  # see Receiver; what was loaded when the flash was last at rest
    _waiting: deque[bytes] = field(default_factory=lambda: deque(maxlen=QUEUE))

    def advance(self, now_ms: int) -> None:
        """See Receiver."""
        while self._waiting and self.now_us >= self.busy_until_us:
            self._take(self._waiting.popleft())
        if self.now_us >= self.busy_until_us:
            self.ack = struct.pack("<BQ23x", self.sector, self.held)

    def receive(self, now_ms: int, payload: bytes) -> None:
        """See Receiver; its queue holds three packets, and what comes when it is full is lost."""
        if len(self._waiting) < QUEUE:
            self._waiting.append(payload)
        self.advance(now_ms)

    def _take(self, payload: bytes) -> None:
        kind, sector, piece = struct.unpack_from("<3B", payload)
        if kind != PIECE or sector != self.sector:
            return
        self.held |= 1 << piece
        if self.held == ALL_PIECES:
            self.busy_until_us = self.now_us + self.flash.sector_us
            self.sector, self.held = self.sector + 1, 0


@dataclass
class HostModel:
    """Sends what is missing of the sector that the node last named, each piece once per round; asks in between."""

    sectors: int  # of the image
    sector: int = 0  # the one that the node waits for
    held: int = 0  # pieces of it that the node has
    _round: list[int] = field(default_factory=list)
    _counter: int = 0

    def hear(self, answer: bytes | None) -> None:
        """What the node says it has; an answer is one exchange old and never takes back what a later one said."""
        if not answer:
            return
        sector, held = struct.unpack_from("<BQ", answer)
        if sector > self.sector:
            self.sector, self.held, self._round = sector, 0, []
        if sector == self.sector:
            self.held |= held

    def frames(self) -> Iterator[bytes]:
        """Frames until the node has all sectors: a round of what is missing, then a question, as answers are late."""
        while self.sector < self.sectors:
            missing = [piece for piece in range(PIECES) if not self.held >> piece & 1]
            sector = self.sector
            for piece in missing:
                if self.sector == sector and not self.held >> piece & 1:
                    yield self._frame(PIECE, piece)
            yield self._frame(ASK, 0)

    def _frame(self, kind: int, piece: int) -> bytes:
        self._counter += 1
        return struct.pack("<3BxI24x", kind, self.sector, piece, self._counter)


def update_s(rate: str, loss: float, flash: FlashTimes, seed: int) -> float:
    """Seconds from the first piece to the answer that says that all are there."""
    sectors = math.ceil(IMAGE_BYTES / SECTOR_BYTES)
    air, node, host = Air(Weather(loss), rate, Random(seed)), LoaderModel(sectors, flash), HostModel(sectors)
    antenna, now_us = Antenna(node), 0
    for payload in host.frames():
        node.now_us = now_us
        heard = air.exchange(antenna, payload, now_us)
        now_us += heard.took_us
        host.hear(heard.payload)
    return now_us / 1e6


def main() -> None:
    """Print a row per data rate and loss."""
    print(f"{IMAGE_BYTES} bytes in {IMAGE_BYTES // PIECE_BYTES} pieces, mean of {len(SEEDS)} seeds")
    print("data rate  loss     flash typical   slowest")
    for rate in ("250kbps", "1Mbps", "2Mbps"):
        for loss in (0.0, 0.1, 0.3):
            row = [mean(update_s(rate, loss, flash, seed) for seed in SEEDS) for flash in FLASHES.values()]
            print(f"{rate:9}  {loss:3.0%}  {row[0]:14.1f} s {row[1]:7.1f} s")


if __name__ == "__main__":
    main()
