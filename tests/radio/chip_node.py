"""A node's state machine behind a register-level chip: what the firmware's main loop does, in Python."""

from __future__ import annotations

from curveline.radio.node import Node

from .chip import Chip
from .chip_setup import Listener
from .ether import Ether

SERVE_US = 60
"""From an interrupt of the chip to the node's new answer."""
TICK_US = 2000


class ChipNode:
    """A node that listens on one address."""

    def __init__(self, ether: Ether, node: Node, address: bytes, rate: str, channel: int) -> None:
        self.node = node
        self._ether = ether
        self._listener = Listener(ether, address, rate, channel)
        self._loaded = b""
        self.chip.on_irq = self._interrupt
        self._tick()

    @property
    def chip(self) -> Chip:
        """Its radio chip."""
        return self._listener.chip

    def switch_off(self) -> None:
        """The radio goes silent; the node itself goes on, as one out of reach does."""
        self.chip.ce = 0

    def _interrupt(self, level: int) -> None:
        if level == 0:
            self._ether.at(self._ether.now_us + SERVE_US, self._serve)

    def _serve(self) -> None:
        now_ms = self._ether.now_us // 1000
        for payload in self._listener.heard():
            self.node.receive(now_ms, payload)
        self._load()

    def _tick(self) -> None:
        self.node.advance(self._ether.now_us // 1000)
        if self.node.ack is not self._loaded:
            self._load()
        self._ether.at(self._ether.now_us + TICK_US, self._tick)

    def _load(self) -> None:
        """Make the newest answer the only one; after every packet, for the chip drops what it takes for delivered."""
        self._loaded = self.node.ack
        if self._loaded:
            self._listener.reload(self._loaded)
