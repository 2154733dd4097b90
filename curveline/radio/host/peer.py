"""The host's view of one node: what it was told, what it said last, and how well it is heard."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from curveline.radio.protocol.codes import ATTEMPT_MASK, Counts, FrameKind, Reject
from curveline.radio.protocol.envelope import kind_of
from curveline.radio.protocol.frames import (
    DriveFrame,
    EstopFrame,
    HelloFrame,
    HomeFrame,
    IdentFrame,
    StatusFrame,
    decode_ident,
    decode_status,
    encode_drive,
    encode_estop,
    encode_hello,
    encode_home,
)
from curveline.radio.protocol.keys import session_key
from curveline.radio.protocol.service_frames import ReadingFrame, ServiceFrame, decode_reading, encode_service
from curveline.radio.protocol.settings_frames import SettingsFrame, encode_settings

NO_LOAD: tuple[int, Counts, int] = (0, (0, 0, 0), 0)
"""Nothing to stage: step, target and move time of a DRIVE that only asks."""
STRANGE = 3
"""Answers in a row that are no status of the session, after which a node is asked who it is."""


@dataclass
class LinkTally:
    """Link statistics of one node: polls sent, answered with an acknowledgement, lost, repeated by the radio chip."""

    polls: int = 0  # sent
    answered: int = 0  # with a whole answer
    lost: int = 0  # polls without one
    retries: int = 0  # frames sent again
    bad_tags: int = 0  # answers under another key

    def count(self, payload: bytes | None, retries: int) -> None:
        """One more poll, and what came back for it, None if nothing did."""
        self.polls += 1
        self.retries += retries
        if payload is None:
            self.lost += 1
        else:
            self.answered += 1


@dataclass
class Peer:
    """One node as the host knows it; facts only ever grow (`started`, `finished`, `staged`) or are the newest."""

    number: int
    address: str
    node_key: bytes = field(repr=False)
    nonce: int
    """Host nonce of the present handshake, attempts included."""
    key: bytes = field(default=b"", repr=False)
    session: int = 0
    counter: int = 0
    clock: int = 0
    """The newest time of the node that was heard [its ticks]; frames carry it as proof that they are fresh."""
    ident: IdentFrame | None = None
    status: StatusFrame | None = None
    started: int = 0
    finished: int = 0
    staged: int = 0
    due_ms: int = 0
    heard_ms: int = 0
    ident_ms: int = -(2**31)
    mark: int = 0
    """First counter of the present phase: an echo of it or later answers this phase."""
    unheard: int = 0
    """Polls since the last STATUS of this session."""
    strange: int = 0
    """Answers in a row that were no STATUS of this session; see STRANGE."""
    busy: bool = False
    was_stopped: bool = False
    """Whether a STOP held the node before its first offer: whoever sends after that, lifts it."""
    gone: bool = False
    """Lost for this session: nothing is expected of it any more."""
    tally: LinkTally = field(default_factory=LinkTally)

    @property
    def boot(self) -> int:
        """Boot number the session began with, 0 before."""
        return self.ident.boot if self.ident is not None else 0

    @property
    def newest(self) -> tuple[int, int]:
        """Echo and time of the newest STATUS: one that has neither above these was said before, or is a recording."""
        return (-1, -1) if self.status is None else (self.status.echo, self.status.clock)

    def hello(self, template: HelloFrame) -> bytes:
        """The next attempt of the handshake; each differs from the one before, or the radio might drop it."""
        self.nonce = (self.nonce & ~ATTEMPT_MASK) | (self.nonce + 1 & ATTEMPT_MASK)
        return encode_hello(replace(template, node=self.number, nonce=self.nonce), self.node_key)

    def drive(self, release: int, hold_gen: int, load: tuple[int, Counts, int]) -> bytes:
        """The next DRIVE: release and hold as levels, `load` = (step, target, move_ms)."""
        self.counter += 1
        step, target, move_ms = load
        frame = DriveFrame(self.clock, self.session, self.counter, release, step, target, move_ms, hold_gen)
        return encode_drive(frame, self.key)

    def home(self, axes: int, order: int) -> bytes:
        """The next HOME: find the zeros of `axes`, bit 0 for the first; one order is carried out once."""
        self.counter += 1
        return encode_home(HomeFrame(self.clock, self.session, self.counter, axes, order), self.key)

    def service(self, wanted: ServiceFrame) -> bytes:
        """The next SERVICE: what is wanted, with the time, session and counter of now."""
        self.counter += 1
        frame = replace(wanted, clock=self.clock, session=self.session, counter=self.counter)
        return encode_service(frame, self.key)

    def settings(self, wanted: SettingsFrame) -> bytes:
        """The next SETTINGS: what is wanted, with the time, session and counter of now."""
        self.counter += 1
        frame = replace(wanted, clock=self.clock, session=self.session, counter=self.counter)
        return encode_settings(frame, self.key)

    def reading(self, payload: bytes) -> ReadingFrame | None:
        """The READING of this session that a payload is, if it is one; the node's time is taken from it."""
        if kind_of(payload) is not FrameKind.READING or int.from_bytes(payload[2:4], "little") != self.session:
            return None
        reading = decode_reading(payload, self.key, self.clock)
        if isinstance(reading, Reject) or reading.node != self.number or reading.echo > self.counter:
            return None
        self.clock = max(self.clock, reading.clock)
        return reading

    def estop(self) -> bytes:
        """The next ESTOP."""
        self.counter += 1
        return encode_estop(EstopFrame(self.number, self.session, self.counter), self.key)

    def take(self, payload: bytes) -> IdentFrame | StatusFrame | None:
        """What a payload proves about this node; what proves nothing is counted and dropped."""
        kind = kind_of(payload)
        if kind is FrameKind.IDENT:
            return self._take_ident(payload)
        if kind is not FrameKind.STATUS or not self.key:
            return None
        if int.from_bytes(payload[2:4], "little") != self.session:
            return None
        status = decode_status(payload, self.key, self.clock)
        if isinstance(status, Reject):
            self.tally.bad_tags += status is Reject.TAG
            return None
        if status.node != self.number or status.echo > self.counter:
            return None
        return self._merge(status)

    def is_replaced_by(self, ident: IdentFrame) -> bool:
        """Whether somebody's HELLO has replaced the offer before it was taken up, and this is a new one to take."""
        is_newer = self.ident is not None and ident.nonce.offers > self.ident.nonce.offers
        return self.status is None and is_newer and not ident.busy

    def accept(self, ident: IdentFrame, run_tag: int) -> None:
        """Enter the session that the node offered."""
        self.was_stopped = ident.stopped if self.ident is None else self.was_stopped
        self.ident = ident
        self.session = ident.session
        self.key = session_key(self.node_key, self.nonce & ~ATTEMPT_MASK, ident.nonce, run_tag)
        self.counter, self.mark, self.strange = 0, 1, 0
        self.clock = ident.clock

    def _take_ident(self, payload: bytes) -> IdentFrame | None:
        ident = decode_ident(payload, self.node_key, self.nonce & ~ATTEMPT_MASK)
        if isinstance(ident, Reject):
            self.tally.bad_tags += ident is Reject.TAG
            return None
        if ident.node != self.number:
            return None
        self.clock = max(self.clock, ident.clock)
        return ident

    def _merge(self, status: StatusFrame) -> StatusFrame:
        """Take over the facts of a STATUS; an older one than the newest seen adds what it knows and no more."""
        self.started = max(self.started, status.started)
        self.finished = max(self.finished, status.finished)
        self.staged = max(self.staged, status.staged)
        self.clock = max(self.clock, status.clock)
        if (status.echo, status.clock) >= self.newest:
            self.status = status
        return status
