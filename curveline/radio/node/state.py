"""What a node keeps: its identity, what it remembers of its run and its faults, and the session it belongs to."""

from __future__ import annotations

from dataclasses import dataclass, field

from curveline.radio.protocol.codes import ALL_AXES, NOT_HOMED, BootCause, Counts, Fault, Reject
from curveline.radio.protocol.frames import HelloFrame, NodeNonce
from curveline.radio.protocol.keys import Site

FIRMWARE = 4
FLOOD = 50
FLOOD_WINDOW_MS = 1000
DEAF_MS = 100
"""More than `FLOOD` bad tags within the window that the first of them opens make a node ignore frames for so long."""
LIFT = 2
"""The hold generation with which a host lets go the nodes that it has taken over under a hold."""
LOST_POSITION = frozenset({Fault.ENCODER, Fault.BROWN_OUT})
"""Faults after which the counts cannot be trusted: only homing clears them."""
Reasons = tuple[int, int, int]
"""Per axis why it is not homed: NOT_HOMED or a fault, 0 if it is."""
HOMED: Reasons = (0, 0, 0)
NOWHERE: Reasons = (NOT_HOMED, NOT_HOMED, NOT_HOMED)


def with_reason(reasons: Reasons, axes: int, reason: int) -> Reasons:
    """The reasons with another one for `axes` (bit 0 for the first)."""
    x, y, z = (reason if axes >> index & 1 else each for index, each in enumerate(reasons))
    return x, y, z


@dataclass(frozen=True)
class Identity:
    """Who a node is: its number in the row, and the keys of its site."""

    number: int
    site: Site
    firmware: int = FIRMWARE
    node_key: bytes = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "node_key", self.site.node_key(self.number))

    @property
    def chip(self) -> int:
        """Unique id of the node's microcontroller."""
        return self.site.chips[self.number - 1]


@dataclass
class Memory:
    """What a node knows besides its session; `target` belongs to the started step, `next_target` to the staged one.

    `homing` are the axes (bit 0 for the first) that are finding their zeros now; `fault_ms` is when `fault` was met.
    """

    boot: int = 1
    cause: BootCause = BootCause.POWER_ON
    noise: int = 0
    offers: int = 0
    unhomed: Reasons = HOMED
    homing: int = 0
    estop: bool = False
    fault: Fault = Fault.NONE
    fault_axis: int = 0
    fault_ms: int = 0
    run_tag: int = 0
    finished: int = 0
    started: int = 0
    staged: int = 0
    target: Counts = (0, 0, 0)
    move_ms: int = 0
    next_target: Counts = (0, 0, 0)
    next_ms: int = 0

    @property
    def homed(self) -> bool:
        """Whether the node knows where all its axes are."""
        return self.unhomed == HOMED

    @property
    def nonce(self) -> NodeNonce:
        """The node's part of the key of the session that it offered last."""
        return NodeNonce(self.boot, self.offers, self.noise)

    def restarted(self, *, rested: bool) -> Memory:
        """What is left after the power went and came; a node that was not at rest cannot trust its counts any more."""
        return Memory(boot=self.boot + 1, unhomed=self.unhomed if rested else NOWHERE)

    def lose(self, fault: Fault, axis: int) -> None:
        """A fault has put the counts of an axis (from 1, 0 for all) in doubt."""
        lost = 1 << axis - 1 if axis else ALL_AXES
        self.unhomed = with_reason(self.unhomed, lost, fault)

    def forget_fault(self) -> None:
        """The reason for the fault is gone, or somebody says so."""
        self.fault, self.fault_axis, self.fault_ms = Fault.NONE, 0, 0

    def forget_run(self) -> None:
        """Nothing has been done of any run."""
        self.finished = self.started = self.staged = 0
        self.move_ms = 0


@dataclass
class NodeSession:
    """One host's claim on the node, offered or live.

    `owns_run` says that the run which the node remembers is this host's: it was resumed, or has staged a step here.
    """

    number: int
    key: bytes = field(repr=False)
    hello: HelloFrame
    counter: int = 0
    release: int = 0
    hold_gen: int = 0
    heard_ms: int = 0
    closed: bool = False
    owns_run: bool = False
    order: int = 0
    pieces: dict[int, bytes] = field(default_factory=dict, repr=False)
    """Pieces of other settings that came in this session, by their number."""
    stopped: bool = False
    """Somebody stopped the node after this session was offered: taking it up does not end that."""

    @property
    def expires_ms(self) -> int:
        """When the host will have been silent for too long: its dead-man time after what it last heard of the node."""
        return self.heard_ms + self.hello.deadman_ms


@dataclass
class NodeTally:
    """What a node counts for diagnosis; a flood of bad tags makes it deaf for a while, so that it can do its work."""

    bad_tags: int = 0
    old_frames: int = 0
    floods: int = 0
    _window_ms: int = -FLOOD_WINDOW_MS
    _in_window: int = 0
    _deaf_until_ms: int = 0

    def refuse(self, now_ms: int, reject: Reject) -> None:
        """Count a frame that was not accepted, if its tag was why."""
        if reject is not Reject.TAG:
            return
        self.bad_tags += 1
        if now_ms - self._window_ms >= FLOOD_WINDOW_MS:
            self._window_ms, self._in_window = now_ms, 0
        self._in_window += 1
        if self._in_window > FLOOD:
            self.floods += 1
            self._deaf_until_ms, self._in_window = now_ms + DEAF_MS, 0

    def is_flooded(self, now_ms: int) -> bool:
        """Whether frames are to be ignored now."""
        return now_ms < self._deaf_until_ms
