"""A host that is moved by hand: one session with one node of a fleet, frame by frame."""

from __future__ import annotations

from curveline.radio.host.peer import NO_LOAD, Peer
from curveline.radio.host.queries import fresh_nonce
from curveline.radio.protocol.codes import DEADMAN_UNIT_MS, Counts, NodeState
from curveline.radio.protocol.frames import HelloFrame, IdentFrame, StatusFrame, StopFrame, encode_stop
from curveline.radio.protocol.motion import axes_of, config_hash

from .fleet import ChipRadio, Fleet

POLL_US = 100_000
TRIES = 20


class Hand:
    """A session that begins with the first `poll`; nothing is sent by itself."""

    def __init__(self, fleet: Fleet, radio: ChipRadio, *, run_tag: int = 0x1234, deadman_ms: int = 1000) -> None:
        assert deadman_ms % DEADMAN_UNIT_MS == 0
        self.fleet, self.radio = fleet, radio
        self.peer = Peer(1, fleet.drive.addresses[0], radio.site.node_key(1), fresh_nonce())
        self._hello = HelloFrame(1, 0, run_tag, config_hash(axes_of(fleet.drive)), deadman_ms)
        self._greet()

    def send(self, payload: bytes) -> IdentFrame | StatusFrame | None:
        """Transmit a frame; what the answer that was loaded before it proves."""
        (answer,) = self.radio.exchange([(self.peer.address, payload)])
        return self.peer.take(answer.payload) if answer.payload else None

    def poll(self, release: int = 0, hold: int = 0, load: tuple[int, Counts, int] = NO_LOAD) -> None:
        """A DRIVE."""
        self.send(self.peer.drive(release, hold, load))

    def status(self, hold: int = 0) -> StatusFrame:
        """The newest STATUS, which takes two polls to get here."""
        self.poll(hold=hold)
        self.poll(hold=hold)
        assert self.peer.status is not None
        return self.peer.status

    def home(self, axes: int, order: int) -> None:
        """A HOME."""
        self.send(self.peer.home(axes, order))

    def stop(self) -> None:
        """A STOP, which belongs to no session."""
        self.send(encode_stop(StopFrame(0), self.fleet.site.stop_key))

    def watch(self, limit_us: int = 30_000_000) -> StatusFrame:
        """Poll until the node is no longer homing; what it says then."""
        end = self.fleet.now_us + limit_us
        while (status := self.status()).state is NodeState.HOMING:
            assert self.fleet.now_us < end, "homing does not end"
            self.fleet.run(POLL_US)
        return status

    def _greet(self) -> None:
        for _ in range(TRIES):
            said = self.send(self.peer.hello(self._hello))
            if isinstance(said, IdentFrame):
                self.peer.accept(said, self._hello.run_tag)
                return
        raise AssertionError("the node does not answer")
