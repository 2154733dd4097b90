"""What the conductor tells its caller to do, its phases, and the times it works with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from curveline.radio.protocol.codes import FLAG_CLEAR, FLAG_TAKEOVER

Record = Mapping[str, Any]
"""Body of one journal record."""


class Phase(Enum):
    """Where a run stands."""

    DISCOVER = "discover"
    PREFLIGHT = "preflight"
    STAGING = "staging"
    RELEASED = "released"
    CLOSING = "closing"
    DONE = "done"
    PAUSING = "pausing"
    PAUSED = "paused"
    HALTING = "halting"
    HALTED = "halted"


@dataclass(frozen=True)
class Policy:
    """Times of the host [ms], and what the operator allows it."""

    poll_ms: int = 20  # between two polls of a node
    retry_ms: int = 4  # until a lost frame is sent again
    lost_poll_ms: int = 100  # between polls of a node that does not answer
    probe_ms: int = 300  # of silence, after which a node is doubted
    silence_ms: int = 1000  # after which a node holds without its host, at least
    budget_ms: int = 5000  # within which nodes must be ready, or be heard again
    settle_ms: int = 2000  # within which nodes must confirm the end
    slack_ms: int = 1000  # by which a step may be late, besides half its time
    takeover: bool = False  # take nodes over from another host, if all stand
    clear_faults: bool = False  # have nodes forget faults whose reason is gone

    @property
    def flags(self) -> int:
        """What a HELLO asks of the nodes on the operator's behalf."""
        return FLAG_TAKEOVER * self.takeover | FLAG_CLEAR * self.clear_faults


@dataclass(frozen=True, slots=True)
class Send:
    """One frame to one node."""

    node: int
    address: str
    payload: bytes


@dataclass(frozen=True, slots=True)
class Poll:
    """Exchange these frames, one to a node, and report the answers in the same order."""

    sends: tuple[Send, ...]


@dataclass(frozen=True, slots=True)
class Sleep:
    """Nothing is to be done before `until_ms`."""

    until_ms: int


@dataclass(frozen=True, slots=True)
class Write:
    """Put `record` on disk and report it."""

    record: Record


@dataclass(frozen=True, slots=True)
class Finished:
    """The run has ended; `phase` says how."""


Action = Poll | Sleep | Write | Finished
