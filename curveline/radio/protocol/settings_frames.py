"""SETTINGS: new settings for one node, in pieces that nobody but it can read, and what is to be done with them."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

from curveline.radio.protocol.codes import (
    FRAME_BYTES,
    FrameKind,
    Reject,
    SettingsOperation,
    latest_clock,
)
from curveline.radio.protocol.envelope import head, nonce_bytes, pack, verify
from curveline.radio.protocol.keys import FROM_HOST, derive, tag
from curveline.radio.protocol.node_settings import SETTINGS_BYTES

PIECES = 6
PIECE_BYTES = SETTINGS_BYTES // PIECES
ALL_PIECES = (1 << PIECES) - 1
TRIAL_MS = 30_000
"""How long a node runs under new settings before it returns to the old ones, unless it is told to keep them."""

_FRAME = struct.Struct(f"<BBHIBB{PIECE_BYTES}s")
_FACTS = struct.Struct("<BBHBH5x")
_OPERATIONS = frozenset(map(int, SettingsOperation))


@dataclass(frozen=True, slots=True)
class SettingsFrame:
    """Host to node: an operation; `index` is the number of the piece, from 0, or the order. A repr shows no piece."""

    clock: int
    session: int
    counter: int
    operation: SettingsOperation
    index: int
    piece: bytes = field(default=bytes(PIECE_BYTES), repr=False)


@dataclass(frozen=True, slots=True)
class SettingsFacts:
    """Page 4: pieces held (bit 0 for the first), and what the node runs under.

    `stored` is the generation that is stored and was not tried, `generation` itself if there is none.
    """

    pieces: int
    on_trial: bool
    generation: int
    left_s: int
    stored: int


def encode_settings(frame: SettingsFrame, key: bytes) -> bytes:
    """SETTINGS under the session key; a piece is hidden by bytes that no other frame of the session has."""
    is_piece = frame.operation is SettingsOperation.PIECE
    piece = _hidden(frame.piece, key, frame.counter) if is_piece else bytes(PIECE_BYTES)
    whose = head(FrameKind.SETTINGS), frame.clock & 0xFF, frame.session, frame.counter
    body = pack(_FRAME, (*whose, frame.operation, frame.index, piece))
    return body + tag(key, body + nonce_bytes(frame.clock), FROM_HOST)


def decode_settings(payload: bytes, key: bytes, now: int) -> SettingsFrame | Reject:
    """SETTINGS, or why it is none under `key` at the time `now` [ticks]."""
    clock = latest_clock(payload[1], now) if len(payload) == FRAME_BYTES else 0
    if (reject := verify(payload, FrameKind.SETTINGS, key, nonce_bytes(clock) + FROM_HOST)) is not None:
        return reject
    _, _, session, counter, operation, index, piece = _FRAME.unpack_from(payload)
    if operation not in _OPERATIONS:
        return Reject.FIELD
    is_piece = operation == SettingsOperation.PIECE
    if (index >= PIECES) if is_piece else any(piece):
        return Reject.FIELD
    plain = _hidden(piece, key, counter) if is_piece else piece
    return SettingsFrame(clock, session, counter, SettingsOperation(operation), index, plain)


def pack_settings(facts: SettingsFacts) -> bytes:
    """Page 4 of a READING."""
    return _FACTS.pack(facts.pieces, facts.on_trial, facts.generation, facts.left_s, facts.stored)


def settings_facts_in(facts: bytes) -> SettingsFacts:
    """Page 4 of a READING."""
    pieces, trial, generation, left_s, stored = _FACTS.unpack(facts)
    return SettingsFacts(pieces, bool(trial), generation, left_s, stored)


def pieces_of(record: bytes) -> list[bytes]:
    """A record as it is sent."""
    return [record[at : at + PIECE_BYTES] for at in range(0, SETTINGS_BYTES, PIECE_BYTES)]


def _hidden(piece: bytes, key: bytes, counter: int) -> bytes:
    """A piece made unreadable, or readable again."""
    stream = derive(key, b"settings", counter.to_bytes(4, "little"))
    return bytes(one ^ other for one, other in zip(piece, stream, strict=False))
