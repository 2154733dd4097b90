"""Bytes <-> messages of the link protocol, docs/radio-protocol.md: one encoder and one decoder per frame.

Every frame is 32 bytes, little-endian: 24 bytes of body and a tag of 8. Decoders never raise on what the air brings;
they return a `Reject` that says why. Encoders raise InvalidInput for a value that does not fit its field.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import Enum, IntEnum
from hmac import compare_digest

from curveline.errors import InvalidInput
from curveline.radio.keys import FROM_HOST, FROM_NODE, tag

VERSION = 1
FRAME_BYTES = 32
BODY_BYTES = 24
EVERY_NODE = 0xFF
COUNTER_END = 2**31
"""A session is over when its counter gets here."""
HOLD_END = 254
"""The hold generation with which a host gives its session back."""
TARGET_LIMIT = 2**23 - 1
POSITION_UNIT = 8
"""Encoder counts per unit of a STATUS position; three 16-bit numbers then reach +-262,136 counts."""
POSITION_LIMIT = POSITION_UNIT * (2**15 - 1)
MOVE_MS_LIMIT = 0xFFFF
DEADMAN_UNIT_MS = 50
ATTEMPT_MASK = 0xFF
"""Bits of the host nonce that count attempts: they defeat the radio's repeat filter and stay out of all keys."""

FLAG_TAKEOVER = 1
FLAG_RESUME = 2
FLAG_QUERY = 4
FLAG_CLEAR = 8

_DRIVE = struct.Struct("<BBHIHH9sHB")
_STATUS = struct.Struct("<BBHIHHHHBBhhh")
_HELLO = struct.Struct("<BBBBQQHBB")
_IDENT = struct.Struct("<BBHQIIHBB")
_STOP = struct.Struct("<BBB21x")

Counts = tuple[int, int, int]
"""Encoder counts of a node's axes, in the order of `plan.AXES`."""


class Kind(IntEnum):
    """Low nibble of byte 0."""

    DRIVE = 1
    STATUS = 2
    HELLO = 3
    IDENT = 4
    PAGE = 5
    STOP = 6
    ESTOP = 7


class State(IntEnum):
    """What a node is doing; MOVING means that its motors turn, also while it brakes for a hold."""

    BOOT = 0
    UNHOMED = 1
    HOMING = 2
    READY = 3
    MOVING = 4
    HOLD = 5
    HOLD_LINK = 6
    FAULT = 7
    POSITION_LOST = 8
    ESTOP = 9


class Fault(IntEnum):
    """Why a node is in FAULT or POSITION_LOST."""

    NONE = 0
    CONFLICT = 1
    LIMIT = 2
    STALL = 3
    RUNAWAY = 4
    ENCODER = 5
    DRIVER = 6
    BROWN_OUT = 7


class Reject(Enum):
    """Why a payload is not the frame that was looked for."""

    LENGTH = "not 32 bytes"
    VERSION = "another protocol version"
    KIND = "another kind of frame"
    TAG = "wrong tag"
    FIELD = "a field with no meaning"


@dataclass(frozen=True, slots=True)
class Drive:
    """Host to node: poll, staging, release and keep-alive in one; target in absolute counts, step 0 is none."""

    node: int
    session: int
    counter: int
    release: int = 0
    load_step: int = 0
    target: Counts = (0, 0, 0)
    move_ms: int = 0
    hold_gen: int = 0


@dataclass(frozen=True, slots=True)
class Estop:
    """Host to node: stop and stay stopped until the power is cycled."""

    node: int
    session: int
    counter: int


@dataclass(frozen=True, slots=True)
class Status:
    """Node to host: facts that stay true; `position` in counts, rounded to 8; `fault_axis` from 1, 0 for none."""

    node: int
    session: int
    echo: int
    boot: int
    finished: int
    started: int
    staged: int
    state: State
    hold_low: int
    fault: Fault
    fault_axis: int
    position: Counts


@dataclass(frozen=True, slots=True)
class Hello:
    """Host to node: offer of a session, or with FLAG_QUERY a question that changes nothing."""

    node: int
    nonce: int
    run_tag: int
    config_hash: int
    deadman_ms: int
    flags: int = 0
    lowest: int = VERSION
    highest: int = VERSION

    @property
    def handshake(self) -> int:
        """The nonce without its attempt counter: what enters the keys."""
        return self.nonce & ~ATTEMPT_MASK


@dataclass(frozen=True, slots=True)
class Ident:
    """Node to host: who it is, and the session it offers; the boot number is the top of its nonce."""

    node: int
    session: int
    nonce: int
    chip: int
    firmware: int
    config_hash: int
    version: int
    state: State
    same_run: bool
    busy: bool

    @property
    def boot(self) -> int:
        """How often the node has been switched on."""
        return self.nonce >> 48


@dataclass(frozen=True, slots=True)
class Stop:
    """Host to all nodes: hold; the owner of the session can lift it."""

    purpose: int


def kind_of(payload: bytes) -> Kind | Reject:
    """What the first byte says a payload is; nothing is verified yet."""
    if len(payload) != FRAME_BYTES:
        return Reject.LENGTH
    if payload[0] >> 4 != VERSION:
        return Reject.VERSION
    try:
        return Kind(payload[0] & 0xF)
    except ValueError:
        return Reject.KIND


def encode_drive(frame: Drive, key: bytes) -> bytes:
    """DRIVE under the session key."""
    for counts in frame.target:
        if not -TARGET_LIMIT <= counts <= TARGET_LIMIT:
            raise InvalidInput(f"a target of {counts} counts does not fit the 24 bits of a DRIVE frame")
    target = b"".join(counts.to_bytes(3, "little", signed=True) for counts in frame.target)
    body = pack(
        _DRIVE,
        (
            *(head(Kind.DRIVE), frame.node, frame.session, frame.counter),
            *(frame.release, frame.load_step, target, frame.move_ms, frame.hold_gen),
        ),
    )
    return body + tag(key, body, FROM_HOST)


def decode_drive(payload: bytes, key: bytes) -> Drive | Reject:
    """DRIVE, or why it is none under `key`."""
    if (reject := verify(payload, Kind.DRIVE, key, FROM_HOST)) is not None:
        return reject
    _, node, session, counter, release, load_step, raw, move_ms, hold_gen = _DRIVE.unpack_from(payload)
    target = (
        int.from_bytes(raw[0:3], "little", signed=True),
        int.from_bytes(raw[3:6], "little", signed=True),
        int.from_bytes(raw[6:9], "little", signed=True),
    )
    if min(target) < -TARGET_LIMIT:
        return Reject.FIELD
    return Drive(node, session, counter, release, load_step, target, move_ms, hold_gen)


def encode_estop(frame: Estop, key: bytes) -> bytes:
    """ESTOP under the session key: the layout of DRIVE with everything after the counter zero."""
    fields = (head(Kind.ESTOP), frame.node, frame.session, frame.counter, 0, 0, bytes(9), 0, 0)
    body = pack(_DRIVE, fields)
    return body + tag(key, body, FROM_HOST)


def decode_estop(payload: bytes, key: bytes) -> Estop | Reject:
    """ESTOP, or why it is none under `key`."""
    if (reject := verify(payload, Kind.ESTOP, key, FROM_HOST)) is not None:
        return reject
    if any(payload[8:BODY_BYTES]):
        return Reject.FIELD
    _, node, session, counter = _DRIVE.unpack_from(payload)[:4]
    return Estop(node, session, counter)


def encode_status(frame: Status, key: bytes, nonce: int = 0) -> bytes:
    """STATUS under the session key, or as an answer to a query under the node key and the query's nonce."""
    x, y, z = (_position_units(counts) for counts in frame.position)
    body = pack(
        _STATUS,
        (
            *(head(Kind.STATUS), frame.node, frame.session, frame.echo, frame.boot),
            *(frame.finished, frame.started, frame.staged),
            *(frame.state << 4 | frame.hold_low, frame.fault_axis << 4 | frame.fault, x, y, z),
        ),
    )
    return body + tag(key, body + nonce_bytes(nonce), FROM_NODE)


def decode_status(payload: bytes, key: bytes, nonce: int = 0) -> Status | Reject:
    """STATUS, or why it is none under `key` and `nonce`."""
    if (reject := verify(payload, Kind.STATUS, key, nonce_bytes(nonce) + FROM_NODE)) is not None:
        return reject
    _, node, session, echo, boot, finished, started, staged, mode, fault, x, y, z = _STATUS.unpack_from(payload)
    try:
        state, cause = State(mode >> 4), Fault(fault & 0xF)
    except ValueError:
        return Reject.FIELD
    if fault >> 4 > len((x, y, z)) or min(x, y, z) < -POSITION_LIMIT // POSITION_UNIT:
        return Reject.FIELD
    position = (x * POSITION_UNIT, y * POSITION_UNIT, z * POSITION_UNIT)
    facts = (node, session, echo, boot, finished, started, staged)
    return Status(*facts, state, mode & 0xF, cause, fault >> 4, position)


def encode_hello(frame: Hello, key: bytes) -> bytes:
    """HELLO under the node key; the dead-man time travels in units of 50 ms, rounded up."""
    deadman = -(-frame.deadman_ms // DEADMAN_UNIT_MS)
    body = pack(
        _HELLO,
        (
            *(head(Kind.HELLO), frame.node, frame.lowest, frame.highest),
            *(frame.nonce, frame.run_tag, frame.config_hash, deadman, frame.flags),
        ),
    )
    return body + tag(key, body, FROM_HOST)


def decode_hello(payload: bytes, key: bytes) -> Hello | Reject:
    """HELLO, or why it is none under `key`."""
    if (reject := verify(payload, Kind.HELLO, key, FROM_HOST)) is not None:
        return reject
    _, node, lowest, highest, nonce, run_tag, config_hash, deadman, flags = _HELLO.unpack_from(payload)
    return Hello(node, nonce, run_tag, config_hash, deadman * DEADMAN_UNIT_MS, flags, lowest, highest)


def encode_ident(frame: Ident, key: bytes, nonce: int) -> bytes:
    """IDENT under the node key; the tag also covers the host's nonce, so that an old one is worth nothing."""
    mode = frame.state << 4 | frame.busy << 1 | frame.same_run
    body = pack(
        _IDENT,
        (
            *(head(Kind.IDENT), frame.node, frame.session, frame.nonce),
            *(frame.chip, frame.firmware, frame.config_hash, frame.version, mode),
        ),
    )
    return body + tag(key, body + nonce_bytes(nonce), FROM_NODE)


def decode_ident(payload: bytes, key: bytes, nonce: int) -> Ident | Reject:
    """IDENT, or why it is none under `key` for the handshake `nonce`."""
    if (reject := verify(payload, Kind.IDENT, key, nonce_bytes(nonce) + FROM_NODE)) is not None:
        return reject
    _, node, session, node_nonce, chip, firmware, config_hash, version, mode = _IDENT.unpack_from(payload)
    try:
        state = State(mode >> 4)
    except ValueError:
        return Reject.FIELD
    if mode & 0b1100:
        return Reject.FIELD
    return Ident(node, session, node_nonce, chip, firmware, config_hash, version, state, bool(mode & 1), bool(mode & 2))


def encode_stop(frame: Stop, key: bytes) -> bytes:
    """STOP under the stop key of the site."""
    body = pack(_STOP, (head(Kind.STOP), EVERY_NODE, frame.purpose))
    return body + tag(key, body, FROM_HOST)


def decode_stop(payload: bytes, key: bytes) -> Stop | Reject:
    """STOP, or why it is none under `key`."""
    if (reject := verify(payload, Kind.STOP, key, FROM_HOST)) is not None:
        return reject
    if payload[1] != EVERY_NODE or any(payload[3:BODY_BYTES]):
        return Reject.FIELD
    return Stop(payload[2])


def head(kind: Kind) -> int:
    """First byte of a frame."""
    return VERSION << 4 | kind


def pack(layout: struct.Struct, fields: tuple[int | bytes, ...]) -> bytes:
    """A frame body; InvalidInput for a value that does not fit its field."""
    try:
        return layout.pack(*fields)
    except struct.error as error:
        raise InvalidInput(f"a value does not fit its field in a radio frame: {error}") from None


def verify(payload: bytes, kind: Kind, key: bytes, trailer: bytes) -> Reject | None:
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
    """The nonce a tag covers besides the body; 0 stands for none, because a session's key is fresh by itself."""
    return nonce.to_bytes(8, "little") if nonce else b""


def _position_units(counts: int) -> int:
    """Nearest number of position units, saturated: a position that far out is reported as the end of the scale."""
    limit = POSITION_LIMIT // POSITION_UNIT
    return max(-limit, min(limit, (counts + POSITION_UNIT // 2) >> 3))
