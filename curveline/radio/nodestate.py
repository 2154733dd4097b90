"""What a node keeps: its identity, what it remembers of its run and its faults, and the session it belongs to."""

from __future__ import annotations

from dataclasses import dataclass, field

from curveline.radio.frames import Counts, Fault, Hello
from curveline.radio.keys import Site

FIRMWARE = 1
LOST_POSITION = frozenset({Fault.ENCODER, Fault.BROWN_OUT})
"""Faults after which the counts cannot be trusted: only homing clears them."""


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
    """What a node knows besides its session; `target` belongs to the started step, `next_target` to the staged one."""

    boot: int = 1
    noise: int = 0
    offers: int = 0
    homed: bool = True
    homing: bool = False
    estop: bool = False
    fault: Fault = Fault.NONE
    fault_axis: int = 0
    run_tag: int = 0
    finished: int = 0
    started: int = 0
    staged: int = 0
    target: Counts = (0, 0, 0)
    move_ms: int = 0
    next_target: Counts = (0, 0, 0)
    next_ms: int = 0


@dataclass
class Session:
    """One host's claim on the node, offered or live."""

    number: int
    key: bytes = field(repr=False)
    hello: Hello
    counter: int = 0
    release: int = 0
    hold_gen: int = 0
    heard_ms: int = 0
    closed: bool = False


@dataclass
class Tally:
    """What a node counts for diagnosis."""

    bad_tags: int = 0
    old_counters: int = 0
