"""UPDATE and PROGRESS: a node's program, piece by piece, to the loader that lies in front of it."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum

from curveline.radio.protocol.codes import FrameKind, Reject
from curveline.radio.protocol.envelope import head, pack, verify
from curveline.radio.protocol.keys import FROM_HOST, FROM_NODE, tag

SECTOR_BYTES = 1024
PIECE_BYTES = 16
PIECES = SECTOR_BYTES // PIECE_BYTES
ALL_PIECES = (1 << PIECES) - 1
DESCRIPTION_PIECES = 2
DESCRIPTION_BYTES = DESCRIPTION_PIECES * PIECE_BYTES
DIGEST_BYTES = 16
SETTINGS_LAYOUT = 1
"""Number of the records of settings that programs of this release read."""
SECTOR_ALL, SECTOR_NONE = 254, 255
"""In the place of the sector that a loader waits for: it has all, or knows of no program."""
COUNTER_MOST = 0xFFFFFF
UPDATE_TAG = 0x7570
"""Run tag of a session with a loader."""

_UPDATE = struct.Struct(f"<BBHI{PIECE_BYTES}s")
_PROGRESS = struct.Struct("<BBHIQBBBBI")
_DESCRIPTION = struct.Struct("<16s3I")


class UpdatePlace(IntEnum):
    """Where a piece belongs, if it is none of a sector of the program; or what the loader is to do."""

    ASK = 240
    BEGIN = 241
    FINISH = 242
    LEAVE = 243
    DESCRIPTION = 255


class UpdateOutcome(IntEnum):
    """What became of the last thing that a loader was to do."""

    NONE = 0
    DONE = 1
    REFUSED = 2
    FLASH = 3
    DIGEST = 4


@dataclass(frozen=True, slots=True)
class UpdateFrame:
    """Host to loader: sixteen bytes for a place, or an order; `index` is that of the piece, from 0."""

    session: int
    counter: int
    place: int
    index: int = 0
    data: bytes = b""


@dataclass(frozen=True, slots=True)
class ProgressFrame:
    """Loader to host: the pieces that it has (bit 0 for the first) of the sector that it waits for.

    `outcome` is that of the last thing that was to be done, and `last` what that was: an order, or a sector to write.
    `marks`: 1 the program is whole, 2 it was started, 4 a host has been heard by it.
    """

    node: int
    session: int
    echo: int
    held: int
    sector: int
    outcome: UpdateOutcome
    marks: int
    last: int
    description: int


def encode_update(frame: UpdateFrame, key: bytes) -> bytes:
    """UPDATE under the session key."""
    which = frame.counter | frame.index << 24
    body = pack(_UPDATE, (head(FrameKind.UPDATE), frame.place, frame.session, which, frame.data))
    return body + tag(key, body, FROM_HOST)


def decode_update(payload: bytes, key: bytes) -> UpdateFrame | Reject:
    """UPDATE, or why it is none under `key`."""
    if (reject := verify(payload, FrameKind.UPDATE, key, FROM_HOST)) is not None:
        return reject
    _, place, session, which, data = _UPDATE.unpack_from(payload)
    return UpdateFrame(session, which & COUNTER_MOST, place, which >> 24, data)


def encode_progress(frame: ProgressFrame, key: bytes) -> bytes:
    """PROGRESS under the session key."""
    whose = head(FrameKind.PROGRESS), frame.node, frame.session, frame.echo
    told = frame.held, frame.sector, frame.outcome, frame.marks, frame.last, frame.description
    body = pack(_PROGRESS, (*whose, *told))
    return body + tag(key, body, FROM_NODE)


def decode_progress(payload: bytes, key: bytes) -> ProgressFrame | Reject:
    """PROGRESS, or why it is none under `key`."""
    if (reject := verify(payload, FrameKind.PROGRESS, key, FROM_NODE)) is not None:
        return reject
    _, node, session, echo, held, sector, outcome, marks, last, description = _PROGRESS.unpack_from(payload)
    if outcome not in set(map(int, UpdateOutcome)):
        return Reject.FIELD
    return ProgressFrame(node, session, echo, held, sector, UpdateOutcome(outcome), marks, last, description)


@dataclass(frozen=True, slots=True)
class ProgramFacts:
    """What a loader is told of a program: bytes, number of the firmware, layout of its settings, digest."""

    length: int
    number: int
    settings: int
    digest: bytes


def describe(facts: ProgramFacts) -> bytes:
    """The 32 bytes that say so; FNV-1a over the words comes first."""
    body = _DESCRIPTION.pack(facts.digest, facts.length, facts.number, facts.settings)
    total = 2166136261
    for word in struct.unpack("<7I", body):
        total = (total ^ word) * 16777619 & 0xFFFFFFFF
    return total.to_bytes(4, "little") + body


def described(data: bytes) -> ProgramFacts | None:
    """What a description says; None if it is none."""
    if len(data) != DESCRIPTION_BYTES:
        return None
    digest, length, number, settings = _DESCRIPTION.unpack(data[4:])
    facts = ProgramFacts(length, number, settings, digest)
    return facts if describe(facts) == data else None
