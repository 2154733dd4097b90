"""One node of the mock display: its state machine, motors and antenna, and what may be odd about it."""

from __future__ import annotations

from dataclasses import replace
from random import Random

from curveline.radio.mock.adversaries import Pair
from curveline.radio.mock.air import Air, Antenna, Heard, Receiver
from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import MotorPlant
from curveline.radio.node.state import Identity, Memory
from curveline.radio.protocol.codes import FRAME_BYTES, FrameKind
from curveline.radio.protocol.envelope import kind_of
from curveline.radio.protocol.motion import Axes

FOR_EVER = 2**62


class Station:
    """What can be odd is set before `power_up`: another kind of node, other limits, another chip, a cloned radio."""

    def __init__(self, identity: Identity, axes: Axes, plant: MotorPlant, memory: Memory) -> None:
        self.identity = identity
        self.axes = axes
        self.plant = plant
        self.memory = memory
        self.node: NodeMachine
        self.kind: type[NodeMachine] = NodeMachine
        self.twin: NodeMachine | None = None
        self.is_clone = False
        self.deaf_until_ms = 0
        self.channel: int | None = None
        """Where it listens, None for where its host sends."""
        self.driven = False
        """Whether a host has taken the node over since it was switched on here."""

    def power_up(self, random: Random) -> None:
        """Switch the node on."""
        self.memory.noise = random.getrandbits(32)
        self.node = self.kind(self.identity, self.axes, self.plant, self.memory)
        receiver: Receiver = self.node if self.twin is None else Pair(self.node, self.twin, random)
        self.antenna = Antenna(receiver)

    def restart(self, now_ms: int, random: Random) -> None:
        """Power fails and comes back: motors stop, and a node that was moving cannot trust its counts any more."""
        old = self.node
        if old.move is not None:
            self.plant.follow(now_ms, old.move_start_ms, old.move.braked(now_ms - old.move_start_ms))
        self.plant.give_up(now_ms)
        self.memory = old.memory.restarted(rested=not old.is_turning)
        self.power_up(random)

    def intrude(self, now_ms: int, payload: bytes) -> None:
        """A packet of somebody else's, who sends with packet ids of his own and does not care for the answer."""
        if now_ms >= self.deaf_until_ms:
            self.antenna.last = (-1, -1)
            self.antenna.node.receive(now_ms, payload)

    def exchange(self, air: Air, payload: bytes, now_us: int) -> Heard:
        """A packet of the host's; what came back. A cloned radio chip filters no repeats and sends half an answer."""
        if now_us // 1000 < self.deaf_until_ms:
            return air.unheard()
        if self.is_clone:
            self.antenna.last = (-1, -1)
        heard = air.exchange(self.antenna, payload, now_us)
        answer = self.node.ack
        if kind_of(payload) is FrameKind.DRIVE and kind_of(answer) is FrameKind.STATUS and answer[2:4] != bytes(2):
            self.driven = True
        return replace(heard, payload=heard.payload[: FRAME_BYTES // 2]) if self.is_clone and heard.payload else heard

    def has_half_done(self, step: int, now_ms: int) -> bool:
        """Whether the node has half of its move of `step` behind it, in a session that began here."""
        node = self.node
        owner = node._session
        if not self.driven or owner is None or not owner.owns_run or node.memory.started < step:
            return False
        if node.memory.started > step or node.move is None:
            return node.memory.finished >= step
        return 2 * (now_ms - node.move_start_ms) >= node.move.duration_ms
