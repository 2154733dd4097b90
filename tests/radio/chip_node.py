"""A node's state machine behind a register-level chip: what the firmware's main loop does, in Python."""

from __future__ import annotations

from random import Random

from curveline.radio.mock.air import Weather
from curveline.radio.node.machine import NodeMachine

from .chip_setup import Listener

SERVE_US = 60
"""From an interrupt of the chip to the node's new answer."""
TICK_US = 2000


class ChipNode:
    """A node behind a listening chip; of the weather it makes packets that come twice and answers that are old."""

    def __init__(self, listener: Listener, node: NodeMachine, weather: Weather, random: Random) -> None:
        self.node = node
        self.listener = listener
        self._ether = listener.ether
        self._weather = weather
        self._random = random
        self._loaded = b""
        listener.chip.on_irq = self._interrupt
        self._tick()

    def switch_off(self) -> None:
        """The radio goes silent; the node itself goes on, as one out of reach does."""
        self.listener.chip.ce = 0

    def _interrupt(self, level: int) -> None:
        if level == 0:
            self._ether.at(self._ether.now_us + SERVE_US, self._serve)

    def _serve(self) -> None:
        now_ms = self._ether.now_us // 1000
        for payload in self.listener.heard():
            self.node.receive(now_ms, payload)
            if self._chance(self._weather.duplicate):
                self.node.receive(now_ms, payload)
        self._load()

    def _tick(self) -> None:
        self.node.advance(self._ether.now_us // 1000)
        if self.node.ack is not self._loaded:
            self._load()
        self._ether.at(self._ether.now_us + TICK_US, self._tick)

    def _load(self) -> None:
        """Make the newest answer the only one; after every packet, for the chip drops what it takes for delivered."""
        if self._loaded and self._chance(self._weather.stale):
            self.listener.load(self.node.ack)  # behind the ones that are loaded already
        elif self.node.ack:
            self.listener.reload(self.node.ack)
        self._loaded = self.node.ack

    def _chance(self, part: float) -> bool:
        return bool(part) and self._random.random() < part
