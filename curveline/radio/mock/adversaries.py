"""Whom a display may meet besides its host: another host with the keys, a second device, strangers, other firmware."""

from __future__ import annotations

from dataclasses import replace
from random import Random
from typing import Protocol

from curveline.radio.host.peer import Peer
from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.state import Identity
from curveline.radio.protocol.codes import (
    ATTEMPT_MASK,
    BODY_BYTES,
    FLAG_TAKEOVER,
    VERSION,
    FrameKind,
    NodeState,
    Reject,
)
from curveline.radio.protocol.envelope import head, kind_of
from curveline.radio.protocol.frames import HelloFrame, IdentFrame, decode_ident, encode_ident
from curveline.radio.protocol.page_frames import decode_ask, decode_page, encode_page

NEXT_VERSION = VERSION + 1
OLD_FIRMWARE = 2
FEED_MS = 100
DEADMAN_MS = 1000
REPLAYS = 500
"""Frames that an eavesdropper keeps of each node."""


class NextVersion(NodeMachine):
    """A node whose firmware speaks another version of the protocol and says so."""

    def receive(self, now_ms: int, payload: bytes) -> None:
        """See Node."""
        super().receive(now_ms, payload)
        kind = kind_of(self.ack)
        if kind is FrameKind.IDENT and kind_of(payload) is FrameKind.HELLO:
            nonce = int.from_bytes(payload[4:12], "little") & ~ATTEMPT_MASK
            ident = decode_ident(self.ack, self.identity.node_key, nonce)
            if not isinstance(ident, Reject):
                self.ack = encode_ident(replace(ident, version=NEXT_VERSION), self.identity.node_key, nonce)
        elif kind is FrameKind.PAGE and not isinstance(ask := decode_ask(payload), Reject):
            page = decode_page(self.ack, ask.handshake)
            if not isinstance(page, Reject):
                self.ack = encode_page(replace(page, version=NEXT_VERSION), ask.handshake)


class OldFirmware(NodeMachine):
    """A node of this protocol, but from before it could be tried out."""

    def receive(self, now_ms: int, payload: bytes) -> None:
        """See Node."""
        if kind_of(payload) in (FrameKind.SERVICE, FrameKind.SETTINGS):
            self.advance(now_ms)
        else:
            super().receive(now_ms, payload)


class Pair:
    """Two devices on one address: both hear everything, and one of them, by chance, drowns the other's answer."""

    def __init__(self, first: NodeMachine, second: NodeMachine, random: Random) -> None:
        self._both = (first, second)
        self._random = random

    @property
    def ack(self) -> bytes:
        """See Receiver."""
        return self._random.choice(self._both).ack

    def receive(self, now_ms: int, payload: bytes) -> None:
        """See Receiver."""
        for node in self._both:
            node.receive(now_ms, payload)

    def advance(self, now_ms: int) -> None:
        """See Receiver."""
        for node in self._both:
            node.advance(now_ms)


class Victim(Protocol):
    """A node that can be switched off and on: who it is, and what runs there now."""

    node: NodeMachine

    @property
    def identity(self) -> Identity:
        """Who it is."""
        ...


class Rival:
    """Another host that has the keys: takes a node over as soon as it stands still, and keeps it."""

    def __init__(self, victim: Victim, random: Random) -> None:
        identity = victim.identity
        nonce = random.getrandbits(64) & ~ATTEMPT_MASK
        self._victim = victim
        self._run = random.getrandbits(64)
        self._peer = Peer(identity.number, "", identity.node_key, nonce)
        self._fed_ms = -FEED_MS

    def act(self, now_ms: int) -> None:
        """Claim the node, or tell it that its owner is alive; by an antenna of its own, right beside the node."""
        node, peer = self._victim.node, self._peer
        if peer.session == 0:
            node.advance(now_ms)
            if node.move is None and node.state is not NodeState.MOVING:
                node.receive(now_ms, peer.hello(HelloFrame(0, 0, self._run, 0, DEADMAN_MS, FLAG_TAKEOVER)))
                ident = peer.take(node.ack)
                if isinstance(ident, IdentFrame):
                    peer.accept(ident, self._run)
        if peer.session and now_ms - self._fed_ms >= FEED_MS:
            self._fed_ms = now_ms
            node.receive(now_ms, peer.drive(0, 0, (0, (0, 0, 0), 0)))
            peer.take(node.ack)


def stranger_identity(identity: Identity, mask: int) -> Identity:
    """The same place in the row, but another chip, whose keys are other ones; `mask` says by which bits it differs."""
    chips = list(identity.site.chips)
    chips[identity.number - 1] ^= mask
    return Identity(identity.number, replace(identity.site, chips=tuple(chips)))


def forged(payload: bytes, random: Random) -> bytes:
    """What somebody without the keys makes of a frame that was overheard: all that can be read, and a guessed tag."""
    kind = random.choice((FrameKind.DRIVE, FrameKind.ESTOP, FrameKind.HELLO, FrameKind.STOP))
    known = payload[1 : random.choice((4, 8, BODY_BYTES))]
    body = (bytes([head(kind)]) + known + random.randbytes(BODY_BYTES))[:BODY_BYTES]
    return body + random.randbytes(len(payload) - BODY_BYTES)
