"""One node of the mock display: its board, state machine, motors and antenna, and what may be odd about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from random import Random

from curveline.radio.mock.adversaries import Pair
from curveline.radio.mock.air import Air, Antenna, Heard, Receiver
from curveline.radio.mock.board import Board
from curveline.radio.node.loader import LoaderMachine
from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import MotorPlant
from curveline.radio.node.settings_flash import TRIED, ModelFlash, PowerCut, SettingsFlash
from curveline.radio.node.state import FIRMWARE, NOWHERE, Identity, Memory
from curveline.radio.protocol.codes import FRAME_BYTES, BootCause, FrameKind
from curveline.radio.protocol.envelope import kind_of
from curveline.radio.protocol.keys import Site
from curveline.radio.protocol.motion import Axes
from curveline.radio.protocol.node_settings import NodeSettings

FOR_EVER = 2**62
START_MS = 120
"""How long a node that starts anew hears nothing."""


def _nothing() -> None:
    pass


@dataclass(frozen=True)
class Ear:
    """On what somebody listens, or sends: channel, data rate, and an address in capitals."""

    channel: int
    data_rate: str
    address: str


class Station:
    """What can be odd is set before `power_up`: another kind of node, other settings, another chip, a cloned radio."""

    def __init__(self, board: Board, plant: MotorPlant, memory: Memory) -> None:
        self.board = board
        self.plant = plant
        self.memory = memory
        self.node: NodeMachine
        self.kind: type[NodeMachine] = NodeMachine
        self.chip = board.chip
        self.flash = board.flash
        self.twin: NodeMachine | None = None
        self.is_clone = False
        self.deaf_until_ms = 0
        self.dead_switches = 0
        """Axes whose switch a finger cannot close, bit 0 for the first."""
        self.pressed = 0
        """Axes whose switch a finger holds closed."""
        self.driven = False
        """Whether a host has taken the node over since it was switched on here."""
        self.changed: Callable[[], None] = _nothing
        """Told whenever the node has started, and may listen elsewhere."""
        self.loader: LoaderMachine | None = None
        """What hears frames in the place of the node."""
        self.program = board.program
        facts = self.program.facts
        self.firmware = FIRMWARE if facts is None else facts.number
        plant.has_loader = True
        self._odd: list[bytearray] | None = None
        self.settings = self._begin(restarted=board.trial_ms > 0)

    @property
    def is_restless(self) -> bool:
        """Whether it may start anew by itself."""
        return self.node.on_trial or self.node.leaves or self.loader is not None

    @property
    def identity(self) -> Identity:
        """Who the node is."""
        number = self.settings.number
        return Identity(number, Site(self.settings.master, (self.chip,) * number), self.firmware)

    @property
    def axes(self) -> Axes:
        """The limits that it holds."""
        return self.settings.axes

    @property
    def ear(self) -> Ear:
        """On what it listens."""
        return Ear(self.settings.channel, self.settings.data_rate, self.settings.address)

    def spoil(self, settings: NodeSettings) -> None:
        """Somebody has flashed it with other settings; between commands that is forgotten, unless they change again."""
        cut_at = self.flash.cut_at
        self.flash = Board.flashed(self.chip, settings).flash
        self.flash.cut_at = cut_at
        self._odd = [bytearray(cells) for cells in self.flash.sectors]
        self.settings = self._begin()

    def power_up(self, random: Random) -> None:
        """Switch the node on; one whose trial was going on when the display was closed goes on with it."""
        self.memory.noise = random.getrandbits(32)
        self.plant.settings = self.keeper
        self.node = self.kind(self.identity, self.axes, self.plant, self.memory)
        self.node.trial_ends_ms, self.board.trial_ms = self.board.trial_ms, 0
        receiver: Receiver = self.node if self.twin is None else Pair(self.node, self.twin, random)
        self.loader = None
        if self.board.in_loader:
            self.loader = LoaderMachine(self.identity, self.memory.nonce, self.program, self.memory.cause)
            receiver = self.loader
        self.antenna = Antenna(receiver)

    def restart(self, now_ms: int, random: Random, *, by_itself: bool = False) -> None:
        """Power fails and comes back: motors stop, and a node that was moving cannot trust its counts any more.

        Or the node starts anew `by_itself`: then it tries what it was asked to. Its loader decides whether its program
        starts, which is then of the number that it was described with.
        """
        old, under = self.node, self.settings.place
        if old.move is not None:
            self.plant.follow(now_ms, old.move_start_ms, old.move.braked(now_ms - old.move_start_ms))
        self.plant.give_up(now_ms)
        self.memory = old.memory.restarted(rested=not old.is_turning)
        if by_itself:
            self.memory.estop, self.memory.cause = old.memory.estop, BootCause.SOFTWARE
        self.settings = self._begin(restarted=by_itself)
        self.board.in_loader = (by_itself and old.seeks_loader) or not self.program.start()
        if self.loader is not None and not self.board.in_loader and self.program.facts is not None:
            self.firmware = self.program.facts.number
        if self.settings.place != under:
            self.memory.unhomed = NOWHERE
        self.power_up(random)

    def catch_up(self, now_ms: int, random: Random) -> None:
        """Let time pass; a node that wants to start anew does, and stays stopped if it was stopped for good."""
        self.node.advance(now_ms)
        if self.loader is not None:
            self.loader.advance(now_ms)
            self.memory.offers = self.loader.offers
        if self.node.leaves or (self.loader is not None and self.loader.over):
            self.restart(now_ms, random, by_itself=True)
            self.deaf_until_ms = max(self.deaf_until_ms, now_ms + START_MS)

    def lying(self, now_ms: int) -> Board:
        """The board, for somebody who puts it aside now; a trial goes on when it is switched on again."""
        flash = self.board.flash if self.flash.sectors == self._odd else self.flash
        standing = self.keeper.standing()
        if not standing.on_trial:
            same = flash is self.board.flash and not self.board.trial_ms
            return self.board if same else replace(self.board, flash=flash, trial_ms=0)
        flash = ModelFlash([bytearray(cells) for cells in flash.sectors])
        for cells in flash.sectors:
            if bytes(cells[TRIED : TRIED + 4]) == bytes(4) and bytes(cells[TRIED + 4 : TRIED + 8]) != bytes(4):
                cells[TRIED : TRIED + 4] = b"\xff\xff\xff\xff"
        left_ms = self.node.trial_ends_ms - now_ms
        return replace(self.board, flash=flash, trial_ms=max(1, left_ms))

    def _begin(self, *, restarted: bool = False) -> NodeSettings:
        """What the board runs under from now on; a power cut while it starts is one more start."""
        self.keeper = SettingsFlash(self.flash)
        try:
            settings = self.keeper.start(restarted=restarted)
        except PowerCut:
            return self._begin()
        assert settings is not None
        self.changed()
        return settings

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
        try:
            heard = air.exchange(self.antenna, payload, now_us)
        except PowerCut:
            self.restart(now_us // 1000, air.random)
            self.deaf_until_ms = max(self.deaf_until_ms, now_us // 1000 + START_MS)
            return air.unheard()
        answer = self.node.ack
        if self.loader is None and kind_of(answer) in (FrameKind.STATUS, FrameKind.READING):
            self.program.kept = True
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
