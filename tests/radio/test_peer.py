"""What the host makes of the answers of one node."""

from __future__ import annotations

from dataclasses import replace

from curveline.radio.host.peer import Peer
from curveline.radio.protocol.codes import Fault, NodeState
from curveline.radio.protocol.frames import HelloFrame, IdentFrame, NodeNonce, StatusFrame, encode_ident, encode_status
from curveline.radio.protocol.keys import session_key

NODE_KEY = b"n" * 16
NONCE = 0x1100
RUN = 9
IDENT = IdentFrame(1, NodeNonce(3, 5, 0), 7, 8, 2, NodeState.READY, False, False)
STATUS = StatusFrame(1, 5, 10, 9, 1, 2, 3, NodeState.MOVING, 0, Fault.NONE, 0, (80, 0, 0))


def make_peer() -> Peer:
    peer = Peer(1, "C1", NODE_KEY, NONCE)
    peer.accept(IDENT, RUN)
    peer.counter = 100
    return peer


def payload(status: StatusFrame) -> bytes:
    return encode_status(status, session_key(NODE_KEY, NONCE, IDENT.nonce, RUN))


def test_an_older_status_adds_facts_and_takes_none_back() -> None:
    peer = make_peer()
    assert peer.take(payload(STATUS)) == STATUS
    older = replace(STATUS, echo=4, finished=0, started=1, staged=1, state=NodeState.READY, position=(0, 0, 0))
    assert peer.take(payload(older)) == older
    assert peer.status == STATUS
    assert (peer.finished, peer.started, peer.staged) == (1, 2, 3)
    same_echo = replace(STATUS, finished=2, state=NodeState.READY)
    peer.take(payload(same_echo))
    assert peer.status == same_echo
    assert peer.finished == 2


def test_what_proves_nothing_is_dropped_and_wrong_tags_are_counted() -> None:
    peer = make_peer()
    good = payload(STATUS)
    for bad in (b"", good[:-1], bytes(32), payload(replace(STATUS, session=6)), payload(replace(STATUS, node=2))):
        assert peer.take(bad) is None
    assert peer.take(payload(replace(STATUS, echo=101))) is None, "it echoes what was never sent"
    assert peer.tally.bad_tags == 0
    assert peer.take(good[:-1] + bytes([good[-1] ^ 1])) is None
    assert peer.take(encode_ident(IDENT, b"x" * 16, NONCE)) is None
    assert peer.tally.bad_tags == 2
    assert peer.take(encode_ident(replace(IDENT, node=2), NODE_KEY, NONCE)) is None
    assert peer.status is None
    assert Peer(1, "C1", NODE_KEY, NONCE).take(good) is None, "no session yet"


def test_an_ident_is_taken_for_any_attempt_of_its_handshake() -> None:
    peer = make_peer()
    template = HelloFrame(0, 0, RUN, 8, 1000)
    seen = {peer.hello(template) for _ in range(256)}
    assert len(seen) == 256
    assert peer.take(encode_ident(IDENT, NODE_KEY, NONCE)) == IDENT
    assert peer.boot == 3


def test_keys_do_not_show() -> None:
    assert "nnnn" not in repr(make_peer())
