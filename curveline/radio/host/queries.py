"""Questions to single nodes outside of any run: what they say of themselves, and of the last run they moved in."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from functools import partial
from typing import TypeVar

from curveline.drive_settings import DriveSettings
from curveline.radio.host.peer import Peer
from curveline.radio.interface import Radio
from curveline.radio.protocol.codes import ATTEMPT_MASK, Reject
from curveline.radio.protocol.frames import HelloFrame, IdentFrame, ReportFrame, decode_ident
from curveline.radio.protocol.motion import axes_of, config_hash

NONCE_BITS = 64
QUESTIONS = 40
"""Questions to a node before it counts as silent: at half of all packets lost one in 10^20 is missed."""
GAP_US = 2000

Said = TypeVar("Said", ReportFrame, IdentFrame)


def fresh_nonce() -> int:
    """A host nonce that was never used before, at its first attempt."""
    return secrets.randbits(NONCE_BITS) & ~ATTEMPT_MASK


def insist(radio: Radio, peer: Peer, question: HelloFrame, read: Callable[[bytes], Said | Reject]) -> Said | None:
    """Ask a node until it answers in a way that `read` accepts; None if it never does.

    Its answer arrives with the question after.
    """
    for _ in range(QUESTIONS):
        (answer,) = radio.exchange([(peer.address, peer.hello(question))])
        peer.tally.count(answer.payload, answer.retries)
        if answer.payload is None:
            radio.sleep_until(radio.now_us() + GAP_US)
            continue
        said = read(answer.payload)
        if not isinstance(said, Reject) and said.node == peer.number:
            return said
    return None


def was_last_run(radio: Radio, drive: DriveSettings, tag: int) -> bool:
    """Whether every node says that the run with this tag is the last one that a host has moved it in.

    A node forgets its run when it restarts, and when another one begins, whoever sends it. What is asked is the first
    half of a handshake: it moves nothing, takes nothing over, and costs a host that drives the node one answer.
    """
    config = config_hash(axes_of(drive))
    for number, address in enumerate(drive.addresses, start=1):
        nonce = fresh_nonce()
        peer = Peer(number, address, radio.site.node_key(number), nonce)
        ident = insist(
            radio,
            peer,
            HelloFrame(number, nonce, tag, config, 0),
            partial(decode_ident, key=peer.node_key, nonce=nonce),
        )
        if ident is None or not ident.same_run or ident.busy:
            return False
    return True
