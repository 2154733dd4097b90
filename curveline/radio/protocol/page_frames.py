"""PAGE frames of the link protocol: facts about a node that are no secret, for whoever asks.

They are how a host learns the chip ids that the keys are derived from, and how two devices on one address are found.
Their key is open, so their tag proves only that a frame is whole.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from curveline.radio.protocol.codes import ATTEMPT_MASK, BODY_BYTES, BOOT_END, VERSION, FrameKind, NodeState, Reject
from curveline.radio.protocol.envelope import head, nonce_bytes, pack, verify
from curveline.radio.protocol.keys import FROM_HOST, FROM_NODE, OPEN_KEY, tag

WHO = 0
"""Number of the one page there is."""

_ASK = struct.Struct("<BBBxQ12x")
_PAGE = struct.Struct("<BBBxIIIHBBHH")


@dataclass(frozen=True, slots=True)
class AskFrame:
    """Host to node, or to whoever listens (EVERY_NODE): a question for facts that are no secret."""

    node: int
    nonce: int
    page: int = 0

    @property
    def handshake(self) -> int:
        """The nonce without its attempt counter."""
        return self.nonce & ~ATTEMPT_MASK


@dataclass(frozen=True, slots=True)
class PageFrame:
    """Node to host: which chip answers, and what it has refused; nothing in it is evidence, anybody can send it."""

    node: int
    chip: int
    firmware: int
    boot: int
    config_hash: int
    state: NodeState
    version: int = VERSION
    bad_tags: int = 0
    old_frames: int = 0
    page: int = 0


def encode_ask(frame: AskFrame) -> bytes:
    """PAGE, the question, under the open key."""
    body = pack(_ASK, (head(FrameKind.PAGE), frame.node, frame.page, frame.nonce))
    return body + tag(OPEN_KEY, body, FROM_HOST)


def decode_ask(payload: bytes) -> AskFrame | Reject:
    """The question of a PAGE, or why it is none."""
    if (reject := verify(payload, FrameKind.PAGE, OPEN_KEY, FROM_HOST)) is not None:
        return reject
    if payload[3] or any(payload[12:BODY_BYTES]):
        return Reject.FIELD
    _, node, page, nonce = _ASK.unpack_from(payload)
    return AskFrame(node, nonce, page)


def encode_page(frame: PageFrame, nonce: int) -> bytes:
    """PAGE, the answer, under the open key and the question's nonce; counts saturate at 16 bits."""
    counts = (min(frame.bad_tags, 0xFFFF), min(frame.old_frames, 0xFFFF))
    facts = (frame.chip, frame.firmware, frame.boot, frame.config_hash, frame.state, frame.version)
    body = pack(_PAGE, (head(FrameKind.PAGE), frame.node, frame.page, *facts, *counts))
    return body + tag(OPEN_KEY, body + nonce_bytes(nonce), FROM_NODE)


def decode_page(payload: bytes, nonce: int) -> PageFrame | Reject:
    """The answer of a PAGE to the question with `nonce`, or why it is none."""
    if (reject := verify(payload, FrameKind.PAGE, OPEN_KEY, nonce_bytes(nonce) + FROM_NODE)) is not None:
        return reject
    _, node, page, chip, firmware, boot, config_hash, mode, version, bad, old = _PAGE.unpack_from(payload)
    try:
        state = NodeState(mode)
    except ValueError:
        return Reject.FIELD
    if payload[3] or boot >= BOOT_END:
        return Reject.FIELD
    return PageFrame(node, chip, firmware, boot, config_hash, state, version, bad, old, page)
