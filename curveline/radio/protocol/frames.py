"""Bytes <-> messages of the link protocol, docs/radio-protocol.md: one encoder and one decoder per frame.

Every frame is 32 bytes, little-endian: 24 bytes of body and a tag of 8. Decoders never raise on what the air brings;
they return a `Reject` that says why. Encoders raise InvalidInput for a value that does not fit its field.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from curveline.errors import InvalidInput
from curveline.radio.protocol.codes import (
    ATTEMPT_MASK,
    AXIS_COUNT,
    BODY_BYTES,
    BOOT_END,
    CAUSES,
    DEADMAN_UNIT_MS,
    EVERY_NODE,
    FAULTS,
    FRAME_BYTES,
    POSITION_LIMIT,
    POSITION_UNIT,
    REASONS,
    STATES,
    TARGET_LIMIT,
    VERSION,
    BootCause,
    Counts,
    Fault,
    FrameKind,
    NodeState,
    Reject,
    latest_clock,
    nearest_clock,
)
from curveline.radio.protocol.envelope import head, nonce_bytes, pack, verify
from curveline.radio.protocol.keys import FROM_HOST, FROM_NODE, tag

_DRIVE = struct.Struct("<BBHIHH9sHB")
_ESTOP = struct.Struct("<BBHI16x")
_HOME = struct.Struct("<BBHIBB14x")
_STATUS = struct.Struct("<BBHIHHHHBBhhh")
_HELLO = struct.Struct("<BBBBQQHBB")
_IDENT = struct.Struct("<BBHIIIIHBB")
_REPORT = struct.Struct("<BBIHHHBBhhhHH")
_STOP = struct.Struct("<BBB21x")


class NodeNonce(NamedTuple):
    """What a node puts into a session key: its boot, the offers it has made since, and noise taken at boot.

    No two offers of a device have the same, until a new program is loaded into it; then only the noise differs.
    """

    boot: int
    offers: int
    noise: int

    @property
    def session(self) -> int:
        """Number by which frames name the session that is offered; never 0."""
        return (self.offers - 1) % 0xFFFF + 1


@dataclass(frozen=True, slots=True)
class DriveFrame:
    """Host to node: poll, staging, release and keep-alive in one; target in absolute counts, step 0 is none.

    `clock` is the newest time of the node that its host has heard [ticks].
    """

    clock: int
    session: int
    counter: int
    release: int = 0
    load_step: int = 0
    target: Counts = (0, 0, 0)
    move_ms: int = 0
    hold_gen: int = 0


@dataclass(frozen=True, slots=True)
class EstopFrame:
    """Host to node: stop and stay stopped until the power is cycled; it is never too old."""

    node: int
    session: int
    counter: int


@dataclass(frozen=True, slots=True)
class HomeFrame:
    """Host to node: find the zeros of `axes` (bit 0 for the first); `order` grows with every wish of a session."""

    clock: int
    session: int
    counter: int
    axes: int
    order: int


@dataclass(frozen=True, slots=True)
class StatusFrame:
    """Node to host: facts that stay true; `position` in counts, rounded to 8; `fault_axis` from 1, 0 for none.

    `clock` is the node's own when this was written; of steps it names those of the session's run.
    """

    node: int
    session: int
    echo: int
    clock: int
    finished: int
    started: int
    staged: int
    state: NodeState
    hold_low: int
    fault: Fault
    fault_axis: int
    position: Counts


@dataclass(frozen=True, slots=True)
class ReportFrame:
    """Node to whoever has its key and asks: how it is, what became of its last run, and since when it is in fault.

    `axes` says per axis why it is not homed: NOT_HOMED or a fault, 0 if it is. `fault_s` saturates at 65,535. `stopped`
    is set from a STOP until a host lifts it, `turning` as long as a motor may turn, `on_trial` while its settings are.
    """

    node: int
    boot: int
    cause: BootCause
    finished: int
    started: int
    staged: int
    state: NodeState
    hold_low: int
    fault: Fault
    fault_axis: int
    position: Counts
    axes: tuple[int, int, int]
    fault_s: int
    stopped: bool = False
    turning: bool = False
    on_trial: bool = False


@dataclass(frozen=True, slots=True)
class HelloFrame:
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
class IdentFrame:
    """Node to host: the session it offers, made of its nonce; `clock` is its time [ticks]."""

    node: int
    nonce: NodeNonce
    clock: int
    config_hash: int
    version: int
    state: NodeState
    same_run: bool
    busy: bool
    stopped: bool = False
    on_trial: bool = False

    @property
    def boot(self) -> int:
        """How often the node has been switched on."""
        return self.nonce.boot

    @property
    def session(self) -> int:
        """Number of the offered session."""
        return self.nonce.session


@dataclass(frozen=True, slots=True)
class StopFrame:
    """Host to all nodes: hold; the owner of the session can lift it."""

    purpose: int


def encode_drive(frame: DriveFrame, key: bytes) -> bytes:
    """DRIVE under the session key."""
    for counts in frame.target:
        if not -TARGET_LIMIT <= counts <= TARGET_LIMIT:
            raise InvalidInput(f"a target of {counts} counts does not fit the 24 bits of a DRIVE frame")
    target = b"".join(counts.to_bytes(3, "little", signed=True) for counts in frame.target)
    body = pack(
        _DRIVE,
        (
            *(head(FrameKind.DRIVE), frame.clock & 0xFF, frame.session, frame.counter),
            *(frame.release, frame.load_step, target, frame.move_ms, frame.hold_gen),
        ),
    )
    return body + tag(key, body + nonce_bytes(frame.clock), FROM_HOST)


def decode_drive(payload: bytes, key: bytes, now: int) -> DriveFrame | Reject:
    """DRIVE, or why it is none under `key` at the time `now` [ticks]."""
    clock = latest_clock(payload[1], now) if len(payload) == FRAME_BYTES else 0
    if (reject := verify(payload, FrameKind.DRIVE, key, nonce_bytes(clock) + FROM_HOST)) is not None:
        return reject
    _, _, session, counter, release, load_step, raw, move_ms, hold_gen = _DRIVE.unpack_from(payload)
    target = (
        int.from_bytes(raw[0:3], "little", signed=True),
        int.from_bytes(raw[3:6], "little", signed=True),
        int.from_bytes(raw[6:9], "little", signed=True),
    )
    if min(target) < -TARGET_LIMIT:
        return Reject.FIELD
    return DriveFrame(clock, session, counter, release, load_step, target, move_ms, hold_gen)


def encode_home(frame: HomeFrame, key: bytes) -> bytes:
    """HOME under the session key."""
    fields = (head(FrameKind.HOME), frame.clock & 0xFF, frame.session, frame.counter, frame.axes, frame.order)
    body = pack(_HOME, fields)
    return body + tag(key, body + nonce_bytes(frame.clock), FROM_HOST)


def decode_home(payload: bytes, key: bytes, now: int) -> HomeFrame | Reject:
    """HOME, or why it is none under `key` at the time `now` [ticks]."""
    clock = latest_clock(payload[1], now) if len(payload) == FRAME_BYTES else 0
    if (reject := verify(payload, FrameKind.HOME, key, nonce_bytes(clock) + FROM_HOST)) is not None:
        return reject
    _, _, session, counter, axes, order = _HOME.unpack_from(payload)
    if not 0 < axes < 1 << AXIS_COUNT or any(payload[10:BODY_BYTES]):
        return Reject.FIELD
    return HomeFrame(clock, session, counter, axes, order)


def encode_estop(frame: EstopFrame, key: bytes) -> bytes:
    """ESTOP under the session key."""
    body = pack(_ESTOP, (head(FrameKind.ESTOP), frame.node, frame.session, frame.counter))
    return body + tag(key, body, FROM_HOST)


def decode_estop(payload: bytes, key: bytes) -> EstopFrame | Reject:
    """ESTOP, or why it is none under `key`."""
    if (reject := verify(payload, FrameKind.ESTOP, key, FROM_HOST)) is not None:
        return reject
    if any(payload[8:BODY_BYTES]):
        return Reject.FIELD
    _, node, session, counter = _ESTOP.unpack_from(payload)
    return EstopFrame(node, session, counter)


def encode_status(frame: StatusFrame, key: bytes) -> bytes:
    """STATUS under the session key."""
    x, y, z = (_position_units(counts) for counts in frame.position)
    body = pack(
        _STATUS,
        (
            *(head(FrameKind.STATUS), frame.node, frame.session, frame.echo, frame.clock & 0xFFFF),
            *(frame.finished, frame.started, frame.staged),
            *(frame.state << 4 | frame.hold_low, frame.fault_axis << 4 | frame.fault, x, y, z),
        ),
    )
    return body + tag(key, body + nonce_bytes(frame.clock), FROM_NODE)


def decode_status(payload: bytes, key: bytes, known: int) -> StatusFrame | Reject:
    """STATUS, or why it is none under `key`; `known` is a time of the node that is not far away [ticks]."""
    clock = nearest_clock(int.from_bytes(payload[8:10], "little"), known)
    if (reject := verify(payload, FrameKind.STATUS, key, nonce_bytes(clock) + FROM_NODE)) is not None:
        return reject
    _, node, session, echo, _, finished, started, staged, mode, trouble, *units = _STATUS.unpack_from(payload)
    found = _condition(mode, trouble, units)
    if found is None:
        return Reject.FIELD
    state, hold_low, fault, axis, position = found
    return StatusFrame(node, session, echo, clock, finished, started, staged, state, hold_low, fault, axis, position)


def encode_report(frame: ReportFrame, key: bytes, nonce: int) -> bytes:
    """REPORT under the node key and the nonce of the query, so that an old one is worth nothing."""
    x, y, z = (_position_units(counts) for counts in frame.position)
    homing = sum(each << 4 * index for index, each in enumerate(frame.axes))
    homing |= frame.stopped << 12 | frame.turning << 13 | frame.on_trial << 14
    body = pack(
        _REPORT,
        (
            *(head(FrameKind.REPORT), frame.node, frame.boot | frame.cause << 24),
            *(frame.finished, frame.started, frame.staged),
            *(frame.state << 4 | frame.hold_low, frame.fault_axis << 4 | frame.fault, x, y, z),
            *(homing, min(frame.fault_s, 0xFFFF)),
        ),
    )
    return body + tag(key, body + nonce_bytes(nonce), FROM_NODE)


def decode_report(payload: bytes, key: bytes, nonce: int) -> ReportFrame | Reject:
    """REPORT, or why it is none under `key` for the query with `nonce`."""
    if (reject := verify(payload, FrameKind.REPORT, key, nonce_bytes(nonce) + FROM_NODE)) is not None:
        return reject
    _, node, start, finished, started, staged, mode, trouble, x, y, z, homing, fault_s = _REPORT.unpack_from(payload)
    found = _condition(mode, trouble, (x, y, z))
    axes = (homing & 15, homing >> 4 & 15, homing >> 8 & 15)
    if found is None or homing >> 15 or start >> 24 not in CAUSES or not REASONS.issuperset(axes):
        return Reject.FIELD
    facts = (node, start % BOOT_END, BootCause(start >> 24), finished, started, staged)
    flags = (bool(homing >> bit & 1) for bit in (12, 13, 14))
    return ReportFrame(*facts, *found, axes, fault_s, *flags)


def _condition(mode: int, trouble: int, units: Sequence[int]) -> tuple[NodeState, int, Fault, int, Counts] | None:
    """State, hold, fault, its axis and position out of the fields of a STATUS or a REPORT; None for nonsense."""
    if mode >> 4 not in STATES or trouble & 0xF not in FAULTS or trouble >> 4 > AXIS_COUNT:
        return None
    if min(units) < -POSITION_LIMIT // POSITION_UNIT:
        return None
    x, y, z = (each * POSITION_UNIT for each in units)
    return NodeState(mode >> 4), mode & 0xF, Fault(trouble & 0xF), trouble >> 4, (x, y, z)


def encode_hello(frame: HelloFrame, key: bytes) -> bytes:
    """HELLO under the node key; the dead-man time travels in units of 50 ms, rounded up."""
    deadman = -(-frame.deadman_ms // DEADMAN_UNIT_MS)
    whom = head(FrameKind.HELLO), frame.node, frame.lowest, frame.highest
    body = pack(_HELLO, (*whom, frame.nonce, frame.run_tag, frame.config_hash, deadman, frame.flags))
    return body + tag(key, body, FROM_HOST)


def decode_hello(payload: bytes, key: bytes) -> HelloFrame | Reject:
    """HELLO, or why it is none under `key`."""
    if (reject := verify(payload, FrameKind.HELLO, key, FROM_HOST)) is not None:
        return reject
    _, node, lowest, highest, nonce, run_tag, config_hash, deadman, flags = _HELLO.unpack_from(payload)
    return HelloFrame(node, nonce, run_tag, config_hash, deadman * DEADMAN_UNIT_MS, flags, lowest, highest)


def encode_ident(frame: IdentFrame, key: bytes, nonce: int) -> bytes:
    """IDENT under the node key; the tag also covers the host's nonce, so that an old one is worth nothing."""
    mode = frame.state << 4 | frame.on_trial << 3 | frame.stopped << 2 | frame.busy << 1 | frame.same_run
    own = frame.nonce
    body = pack(
        _IDENT,
        (
            *(head(FrameKind.IDENT), frame.node, frame.session, own.offers, own.boot, own.noise),
            *(frame.clock & 0xFFFFFFFF, frame.config_hash, frame.version, mode),
        ),
    )
    return body + tag(key, body + nonce_bytes(nonce), FROM_NODE)


def decode_ident(payload: bytes, key: bytes, nonce: int) -> IdentFrame | Reject:
    """IDENT, or why it is none under `key` for the handshake `nonce`."""
    if (reject := verify(payload, FrameKind.IDENT, key, nonce_bytes(nonce) + FROM_NODE)) is not None:
        return reject
    _, node, session, offers, boot, noise, clock, config_hash, version, mode = _IDENT.unpack_from(payload)
    own = NodeNonce(boot, offers, noise)
    if mode >> 4 not in STATES or boot >= BOOT_END or session != own.session:
        return Reject.FIELD
    flags = (bool(mode & bit) for bit in (1, 2, 4, 8))
    return IdentFrame(node, own, clock, config_hash, version, NodeState(mode >> 4), *flags)


def encode_stop(frame: StopFrame, key: bytes) -> bytes:
    """STOP under the stop key of the site."""
    body = pack(_STOP, (head(FrameKind.STOP), EVERY_NODE, frame.purpose))
    return body + tag(key, body, FROM_HOST)


def decode_stop(payload: bytes, key: bytes) -> StopFrame | Reject:
    """STOP, or why it is none under `key`."""
    if (reject := verify(payload, FrameKind.STOP, key, FROM_HOST)) is not None:
        return reject
    if payload[1] != EVERY_NODE or any(payload[3:BODY_BYTES]):
        return Reject.FIELD
    return StopFrame(payload[2])


def _position_units(counts: int) -> int:
    """Nearest number of position units, saturated: a position that far out is reported as the end of the scale."""
    limit = POSITION_LIMIT // POSITION_UNIT
    return max(-limit, min(limit, (counts + POSITION_UNIT // 2) >> 3))
