"""What a host does to single nodes outside of any run: forget a fault, find the zeros of axes.

It takes the node as a run would, by a handshake and sessions of the same frames, but stages no step: what the node has
done of its last run stays known, and can be resumed, until homing voids it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

from curveline.drive_settings import DriveSettings
from curveline.radio.host.actions import Policy
from curveline.radio.host.link import Halted, ignore
from curveline.radio.host.peer import NO_LOAD, Peer
from curveline.radio.host.polling import BUSY_MS, Pace
from curveline.radio.host.preflight import check_ident
from curveline.radio.host.queries import fresh_nonce, insist
from curveline.radio.host.scan import explain
from curveline.radio.host.stop_causes import Cause, Halt
from curveline.radio.interface import Radio
from curveline.radio.protocol.codes import (
    ALL_AXES,
    ATTEMPT_MASK,
    FLAG_CLEAR,
    FLAG_QUERY,
    HOLD_END,
    NodeState,
    Reject,
    plain_name,
)
from curveline.radio.protocol.frames import (
    HelloFrame,
    IdentFrame,
    ReportFrame,
    StatusFrame,
    decode_ident,
    decode_report,
)
from curveline.radio.protocol.motion import axes_of, config_hash

POLL_US = 20_000
SILENCE_US = 5_000_000
"""A node that has not been heard for so long is given up; it has stopped by itself by then."""
BEGIN_US = 1_000_000
"""So long a node may go on without having begun what it was ordered."""
CLOSE_POLLS = 25
GREETING = 4
"""One frame in so many is a HELLO until the node has answered under its session."""
ORDER = 1
"""Number of the one order that a session gives; a STATUS says that it was taken."""

Watcher = Callable[[StatusFrame], None]


def report_of(radio: Radio, drive: DriveSettings, number: int) -> ReportFrame:
    """What node `number` (from 1) says of itself; LinkError if it says nothing."""
    peer = peer_of(radio, drive, number)
    question = HelloFrame(number, peer.nonce, 0, 0, 0, FLAG_QUERY)

    def read(payload: bytes) -> ReportFrame | Reject:
        return decode_report(payload, peer.node_key, peer.nonce & ~ATTEMPT_MASK)

    report = insist(radio, peer, question, read)
    if report is None:
        raise halted(radio, drive, Halt(why_silent(peer), number))
    return report


def clear_fault(radio: Radio, drive: DriveSettings, number: int) -> ReportFrame:
    """Make a node forget its fault, if that has left its position known; what it says then.

    LinkError if it does not answer or belongs to another host.
    """
    with claimed(radio, drive, number, FLAG_CLEAR):
        pass
    return report_of(radio, drive, number)


def home_axes(
    radio: Radio, drive: DriveSettings, number: int, axes: int = ALL_AXES, watcher: Watcher = ignore
) -> ReportFrame:
    """Let a node find the zeros of `axes` (bit 0 for the first) and go there; what it says then.

    `watcher` is told every status. The node stops when this ends, however it does: KeyboardInterrupt is the operator's
    wish. LinkError if it does not answer, does not begin, or belongs to another host.
    """
    with claimed(radio, drive, number) as claim:
        claim.home(axes, watcher)
    return report_of(radio, drive, number)


@contextmanager
def claimed(radio: Radio, drive: DriveSettings, number: int, flags: int = 0) -> Iterator[Claim]:
    """A node for as long as this lasts; it is told to hold and given back in any case."""
    claim = Claim(radio, drive, number)
    claim.begin(flags)
    try:
        yield claim
    finally:
        claim.give_back()


class Claim:
    """The session of one node."""

    deadman_ms = 0
    """After which the node stops; 0 for that of a run."""
    checks_limits = True
    """Whether the node must hold the limits of the display."""

    def __init__(self, radio: Radio, drive: DriveSettings, number: int) -> None:
        self._radio = radio
        self._drive = drive
        self._peer = peer_of(radio, drive, number)
        self._heard_us = radio.now_us()
        self._hello = HelloFrame(number, self._peer.nonce, 0, 0, 0)

    def begin(self, flags: int) -> None:
        """Take the node, which stands; LinkError if it is another's, or not as it should be."""
        peer, config = self._peer, config_hash(axes_of(self._drive))
        owner_ms = Pace(Policy(), 1, self._drive.data_rate).deadman_ms
        deadman_ms = self.deadman_ms or owner_ms
        self._hello = HelloFrame(peer.number, peer.nonce, 0, config, deadman_ms, flags)

        def read(payload: bytes) -> IdentFrame | Reject:
            return decode_ident(payload, peer.node_key, peer.nonce & ~ATTEMPT_MASK)

        end_us = self._radio.now_us() + 1000 * (owner_ms + BUSY_MS)
        while (ident := insist(self._radio, peer, self._hello, read)) is None or ident.busy:
            if ident is None:
                raise self._halted(Halt(why_silent(peer), peer.number))
            if self._radio.now_us() > end_us:
                raise self._halted(Halt(Cause.BUSY, peer.number))
            self._radio.sleep_until(self._radio.now_us() + POLL_US)
        fitting = ident if self.checks_limits else replace(ident, config_hash=config, on_trial=False)
        if (halt := check_ident(fitting, peer, config)) is not None:
            raise self._halted(halt)
        peer.accept(ident, 0)
        self._until(lambda status: status.state is not NodeState.MOVING, lambda: peer.drive(0, 0, NO_LOAD))

    def home(self, axes: int, watcher: Watcher) -> None:
        """Order it, and wait until it has ended one way or another."""
        peer, begin_us = self._peer, self._radio.now_us()

        def ended(status: StatusFrame) -> bool:
            watcher(status)
            is_late = self._radio.now_us() - begin_us > BEGIN_US
            return (status.staged == ORDER or is_late) and status.state is not NodeState.HOMING

        status = self._until(ended, lambda: peer.home(axes, ORDER))
        if status.staged != ORDER:
            detail = f"it is {plain_name(status.state)}"
            cause = Cause.LATCHED if status.state is NodeState.ESTOP else Cause.UNHEEDED
            raise self._halted(Halt(cause, peer.number, detail=detail))

    def give_back(self) -> None:
        """End the session; whatever turns comes to rest."""
        first = self._peer.counter + 1
        for _ in range(CLOSE_POLLS):
            status = self._exchange(self._peer.drive(0, HOLD_END, NO_LOAD))
            if status is not None and status.echo >= first:
                break

    def _until(self, holds: Callable[[StatusFrame], bool], frame: Callable[[], bytes]) -> StatusFrame:
        """Poll with `frame` until a status that answers one of these polls is as wanted."""
        self._peer.mark = self._peer.counter + 1
        self._heard_us = self._radio.now_us()
        while True:
            status = self._exchange(self._next(frame))
            if status is not None and status.echo >= self._peer.mark and holds(status):
                return status
            if self._radio.now_us() - self._heard_us > SILENCE_US:
                raise self._halted(Halt(Cause.SILENT, self._peer.number, detail=" any more"))
            self._radio.sleep_until(self._radio.now_us() + POLL_US)

    def _next(self, frame: Callable[[], bytes]) -> bytes:
        """A frame of the session; now and then HELLO once more, as long as nobody has answered under the session."""
        peer = self._peer
        asks = peer.status is None and peer.tally.polls % GREETING == 0
        return peer.hello(self._hello) if asks else frame()

    def _exchange(self, payload: bytes) -> StatusFrame | None:
        peer = self._peer
        (answer,) = self._radio.exchange([(peer.address, payload)])
        peer.tally.count(answer.payload, answer.retries)
        return self._heard(answer.payload or b"")

    def _heard(self, payload: bytes) -> StatusFrame | None:
        """What an answer proves, if it is the status of the session."""
        peer = self._peer
        fact = peer.take(payload)
        if isinstance(fact, IdentFrame) and peer.is_replaced_by(fact):
            if fact.stopped and not peer.was_stopped:
                raise self._halted(Halt(Cause.STOPPED, peer.number))
            peer.accept(fact, 0)
        if not isinstance(fact, StatusFrame):
            return None
        self._heard_us = self._radio.now_us()
        return fact

    def _halted(self, halt: Halt) -> Halted:
        return halted(self._radio, self._drive, halt)


def peer_of(radio: Radio, drive: DriveSettings, number: int) -> Peer:
    """Node `number` (from 1) as a host knows it that has not asked it anything; InvalidInput if there is none."""
    drive.check_node(number)
    return Peer(number, drive.addresses[number - 1], radio.site.node_key(number), fresh_nonce())


def why_silent(peer: Peer) -> Cause:
    """Of a node that has not said what it should: nothing at all, or something under another key."""
    return Cause.UNTRUSTED if peer.tally.answered else Cause.SILENT


def halted(radio: Radio, drive: DriveSettings, halt: Halt) -> Halted:
    """What stops a host, with the reason for it, if that can be found."""
    return Halted(explain(radio, drive, halt))
