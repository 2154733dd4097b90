"""What all frames of the link have in common: a head that says what they are, and a tag that says whose."""

from __future__ import annotations

import struct
from hmac import compare_digest

from curveline.errors import InvalidInput
from curveline.radio.protocol.codes import BODY_BYTES, FRAME_BYTES, VERSION, FrameKind, Reject
from curveline.radio.protocol.keys import tag


def kind_of(payload: bytes) -> FrameKind | Reject:
    """What the first byte says a payload is; nothing is verified yet."""
    if len(payload) != FRAME_BYTES:
        return Reject.LENGTH
    if payload[0] >> 4 != VERSION:
        return Reject.VERSION
    try:
        return FrameKind(payload[0] & 0xF)
    except ValueError:
        return Reject.KIND


def head(kind: FrameKind) -> int:
    """First byte of a frame."""
    return VERSION << 4 | kind


def pack(layout: struct.Struct, fields: tuple[int | bytes, ...]) -> bytes:
    """A frame body; InvalidInput for a value that does not fit its field."""
    try:
        return layout.pack(*fields)
    except struct.error as error:
        raise InvalidInput(f"a value does not fit its field in a radio frame: {error}") from None


def verify(payload: bytes, kind: FrameKind, key: bytes, trailer: bytes) -> Reject | None:
    """None if `payload` is a frame of this kind with a good tag; `trailer` is what the tag covers besides the body."""
    found = kind_of(payload)
    if isinstance(found, Reject):
        return found
    if found is not kind:
        return Reject.KIND
    if not compare_digest(tag(key, payload[:BODY_BYTES], trailer), payload[BODY_BYTES:]):
        return Reject.TAG
    return None


def nonce_bytes(nonce: int) -> bytes:
    """The nonce or the time that a tag covers besides the body; 0 stands for none."""
    return (nonce & 0xFFFFFFFFFFFFFFFF).to_bytes(8, "little") if nonce else b""
