"""The executable specification of a node's loader: it takes a program in place of the one that the node has.

firmware/loader repeats it in C; docs/firmware-update.md has the reasons. Frames and milliseconds go in, one loaded
answer comes out, as with the node itself.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from hashlib import blake2s

from curveline.radio.node.state import NOWHERE, Identity
from curveline.radio.protocol.codes import (
    FLAG_QUERY,
    OFFERS_END,
    VERSION,
    BootCause,
    Fault,
    FrameKind,
    NodeState,
    Reject,
    clock_of,
)
from curveline.radio.protocol.envelope import kind_of
from curveline.radio.protocol.frames import (
    IdentFrame,
    NodeNonce,
    ReportFrame,
    decode_hello,
    encode_ident,
    encode_report,
)
from curveline.radio.protocol.keys import session_key
from curveline.radio.protocol.update_frames import (
    ALL_PIECES,
    DESCRIPTION_BYTES,
    DESCRIPTION_PIECES,
    DIGEST_BYTES,
    PIECE_BYTES,
    PIECES,
    SECTOR_ALL,
    SECTOR_BYTES,
    SECTOR_NONE,
    SETTINGS_LAYOUT,
    ProgramFacts,
    ProgressFrame,
    UpdateFrame,
    UpdateOutcome,
    UpdatePlace,
    decode_update,
    describe,
    described,
    encode_progress,
)

SECTORS = 49
"""As many as a program has room for."""


PATIENCE_MS = 20_000
BLANK_DESCRIPTION = b"\xff" * DESCRIPTION_BYTES
LEAST_BYTES = 256
"""A program has vectors."""


@dataclass
class ProgramStore:
    """What the flash holds of a program: its description, sectors that are whole, and the marks; at first, nothing."""

    description: bytes = BLANK_DESCRIPTION
    sectors: dict[int, bytes] = field(default_factory=dict)
    whole: bool = False
    tried: bool = False
    kept: bool = False

    @classmethod
    def flashed(cls, number: int) -> ProgramStore:
        """A little program that came by a cable, without a digest: nobody had the key."""
        description = describe(ProgramFacts(LEAST_BYTES, number, SETTINGS_LAYOUT, bytes(DIGEST_BYTES)))
        return cls(description, {0: bytes(SECTOR_BYTES)}, whole=True, tried=True, kept=True)

    @property
    def facts(self) -> ProgramFacts | None:
        """What the description says, None if there is none that makes sense."""
        return facts_in(self.description)

    @property
    def wanted(self) -> int:
        """The first sector that is not there, SECTOR_ALL if all are, SECTOR_NONE without a description."""
        facts = self.facts
        if facts is None:
            return SECTOR_NONE
        count = -(-facts.length // SECTOR_BYTES)
        return next((sector for sector in range(count) if sector not in self.sectors), SECTOR_ALL)

    def begin(self, description: bytes) -> None:
        """Another program is to come; one that is described alike goes on, unless it was started and never heard."""
        if description != self.description or (self.tried and not self.kept):
            self.description, self.sectors = description, {}
            self.whole = self.tried = self.kept = False

    @property
    def progress(self) -> tuple[int, ...]:
        """Numbers that differ whenever the flash does; a sector is written once between two beginnings."""
        head = int.from_bytes(self.description[:4], "little")
        return head, len(self.sectors), self.whole, self.tried, self.kept

    @property
    def is_runnable(self) -> bool:
        """Whether the program may start."""
        return self.facts is not None and self.whole and (self.kept or not self.tried)

    def start(self) -> bool:
        """Whether the program starts after a reset at which nobody asked for the loader; it is tried then."""
        starts = self.is_runnable
        self.tried = self.tried or starts
        return starts

    def is_as_described(self, key: bytes) -> bool:
        """Whether what is there has the digest that it was described with."""
        facts = self.facts
        assert facts is not None
        data = b"".join(self.sectors[sector] for sector in sorted(self.sectors))[: facts.length]
        return blake2s(data, key=key, digest_size=DIGEST_BYTES).digest() == facts.digest


class LoaderMachine:
    """The loader of one node; `over` once its host is done with it."""

    def __init__(
        self, identity: Identity, nonce: NodeNonce, store: ProgramStore, cause: BootCause = BootCause.UNKNOWN
    ) -> None:
        self.identity = identity
        self.cause = cause
        self.store = store
        self.ack = b""
        self.over = False
        self._nonce = nonce
        self._heard_ms: int | None = None
        self._offered: tuple[int, int, bytes] | None = None
        """Handshake, number and key of the session that was offered last."""
        self._live: tuple[int, bytes] | None = None
        self._counter = 0
        self._sector, self._held, self._pieces = store.wanted, 0, bytearray(SECTOR_BYTES)
        self._outcome, self._last = UpdateOutcome.NONE, int(UpdatePlace.ASK)

    @property
    def offers(self) -> int:
        """How many radio sessions were offered since the start."""
        return self._nonce.offers

    def advance(self, now_ms: int) -> None:
        """Without any frame for a while a program that may start does."""
        if self._heard_ms is None:
            self._heard_ms = now_ms
        if now_ms - self._heard_ms >= PATIENCE_MS and self.store.is_runnable:
            self.over = True

    def receive(self, now_ms: int, payload: bytes) -> None:
        """Take a payload from the radio; anything but a good frame changes nothing."""
        self._heard_ms = now_ms
        kind = kind_of(payload)
        if kind is FrameKind.HELLO:
            self._on_hello(now_ms, payload)
        elif kind is FrameKind.UPDATE:
            self._on_update(payload)

    def _on_hello(self, now_ms: int, payload: bytes) -> None:
        hello = decode_hello(payload, self.identity.node_key)
        if isinstance(hello, Reject) or hello.node != self.identity.number:
            return
        if hello.flags & FLAG_QUERY:
            self.ack = encode_report(self._report(), self.identity.node_key, hello.handshake)
            return
        if self._offered is None or self._offered[0] != hello.handshake:
            if self._nonce.offers == OFFERS_END - 1:
                return
            self._nonce = NodeNonce(self._nonce.boot, self._nonce.offers + 1, self._nonce.noise)
            key = session_key(self.identity.node_key, hello.handshake, self._nonce, hello.run_tag)
            self._offered = hello.handshake, self._nonce.session, key
        self.ack = encode_ident(self._ident(now_ms), self.identity.node_key, hello.handshake)

    def _report(self) -> ReportFrame:
        """Of its program's state it knows nothing."""
        return ReportFrame(
            *(self.identity.number, self._nonce.boot, self.cause, 0, 0, 0, NodeState.BOOT, 0, Fault.NONE, 0),
            *((0, 0, 0), NOWHERE, 0),
        )

    def _ident(self, now_ms: int) -> IdentFrame:
        return IdentFrame(
            node=self.identity.number,
            nonce=self._nonce,
            clock=clock_of(now_ms),
            config_hash=0,
            version=VERSION,
            state=NodeState.BOOT,
            same_run=False,
            busy=False,
        )

    def _on_update(self, payload: bytes) -> None:
        frame = self._admitted(payload)
        if frame is None or self._live is None:
            return
        if frame.counter > self._counter:
            self._counter = frame.counter
            self._obey(frame)
        self.ack = encode_progress(self._progress(self._live[0]), self._live[1])

    def _admitted(self, payload: bytes) -> UpdateFrame | None:
        """A frame of the live session, or of the offered one, which becomes the live one by it."""
        number = int.from_bytes(payload[2:4], "little")
        if self._live is not None and self._live[0] == number:
            frame = decode_update(payload, self._live[1])
            if not isinstance(frame, Reject):
                return frame
        if self._offered is None or self._offered[1] != number:
            return None
        frame = decode_update(payload, self._offered[2])
        if isinstance(frame, Reject):
            return None
        self._live, self._offered = self._offered[1:], None
        self._counter = 0
        self._outcome, self._last = UpdateOutcome.NONE, int(UpdatePlace.ASK)
        self._look_again()
        return frame

    def _look_again(self) -> None:
        self._sector, self._held = self.store.wanted, 0

    def _obey(self, frame: UpdateFrame) -> None:
        orders = {
            UpdatePlace.BEGIN: self._begin,
            UpdatePlace.FINISH: self._finish,
            UpdatePlace.LEAVE: self._leave,
        }
        if frame.place < SECTORS or frame.place == UpdatePlace.DESCRIPTION:
            self._take(frame)
        elif frame.place in orders:
            self._last = frame.place
            self._outcome = orders[UpdatePlace(frame.place)]()

    def _take(self, frame: UpdateFrame) -> None:
        if frame.place == UpdatePlace.DESCRIPTION and self._sector != SECTOR_NONE:
            self._sector, self._held = SECTOR_NONE, 0
        if frame.place != self._sector or frame.index >= PIECES:
            return
        self._pieces[PIECE_BYTES * frame.index : PIECE_BYTES * (frame.index + 1)] = frame.data
        self._held |= 1 << frame.index
        if self._sector < SECTORS and self._held == ALL_PIECES:
            self._last, self._outcome = self._sector, UpdateOutcome.DONE
            self.store.sectors[self._sector] = bytes(self._pieces)
            self._look_again()

    def _begin(self) -> UpdateOutcome:
        if self._sector != SECTOR_NONE:
            return UpdateOutcome.DONE  # said once more
        description = bytes(self._pieces[: DESCRIPTION_PIECES * PIECE_BYTES])
        if self._held != (1 << DESCRIPTION_PIECES) - 1 or facts_in(description) is None:
            return UpdateOutcome.REFUSED
        self.store.begin(description)
        self._look_again()
        return UpdateOutcome.DONE

    def _finish(self) -> UpdateOutcome:
        store = self.store
        if store.wanted != SECTOR_ALL:
            return UpdateOutcome.REFUSED
        if not store.whole and not store.is_as_described(self.identity.node_key):
            store.begin(BLANK_DESCRIPTION)
            self._look_again()
            return UpdateOutcome.DIGEST
        store.whole = True
        return UpdateOutcome.DONE

    def _leave(self) -> UpdateOutcome:
        self.over = self.store.is_runnable
        return UpdateOutcome.DONE if self.over else UpdateOutcome.REFUSED

    def _progress(self, session: int) -> ProgressFrame:
        store = self.store
        marks = store.whole | store.tried << 1 | store.kept << 2
        head = int.from_bytes(store.description[:4], "little")
        return ProgressFrame(
            *(self.identity.number, session, self._counter, self._held, self._sector),
            *(self._outcome, marks, self._last, head),
        )


def facts_in(description: bytes) -> ProgramFacts | None:
    """What a description says, None if that is no program for this node."""
    facts = described(description)
    if facts is None or not LEAST_BYTES <= facts.length <= SECTORS * SECTOR_BYTES or facts.length % 4:
        return None
    return facts if facts.settings == SETTINGS_LAYOUT else None
