"""SERVICE and READING: what a host asks of one node that is being tried out, and what that sees of its own motors."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from curveline.radio.protocol.codes import (
    AXIS_COUNT,
    BODY_BYTES,
    FRAME_BYTES,
    READING_SAMPLES,
    TARGET_LIMIT,
    Counts,
    ErrandOutcome,
    FrameKind,
    ReadingPage,
    Reject,
    ServiceOperation,
    latest_clock,
    nearest_clock,
)
from curveline.radio.protocol.envelope import head, nonce_bytes, pack, verify
from curveline.radio.protocol.keys import FROM_HOST, FROM_NODE, tag

ORDERS = frozenset({ServiceOperation.JOG, ServiceOperation.TURN, ServiceOperation.PLACE})
"""Operations that a node carries out once for each order, however often it hears them."""
FLAG_UNHOMED = 16
FLAG_AT_ONCE = 32
LINE_DRIVER = 8
LINE_TURNING = 16
LINE_AWAKE = 32
FACT_BYTES = 12
"""Of a READING, after what all pages have."""

_SERVICE = struct.Struct("<BBHIBBBBiHH4x")
_READING = struct.Struct("<BBHIHBB12s")
_AXIS_FACTS = struct.Struct("<BHhHHBH")
_SAMPLES = struct.Struct(f"<{READING_SAMPLES}h")
_CODES = frozenset(map(int, ServiceOperation)), frozenset(map(int, ReadingPage)), frozenset(map(int, ErrandOutcome))


@dataclass(frozen=True, slots=True)
class ServiceFrame:
    """Host to node: an operation with what it needs, docs/radio-protocol.md; `axis` from 1, 0 for none."""

    clock: int
    session: int
    counter: int
    operation: ServiceOperation = ServiceOperation.LOOK
    order: int = 0
    axis: int = 0
    page: ReadingPage = ReadingPage.MOTORS
    unhomed: bool = False
    at_once: bool = False
    amount: int = 0
    rate: int = 0
    span: int = 0


@dataclass(frozen=True, slots=True)
class ReadingFrame:
    """Node to host: what became of the last order, and the facts of one page, still packed.

    `index` is the last order, the axis or the first sample, as the page has it.
    """

    node: int
    session: int
    echo: int
    clock: int
    page: ReadingPage
    outcome: ErrandOutcome
    index: int
    facts: bytes


@dataclass(frozen=True, slots=True)
class MotorFacts:
    """Page 0: encoder counts, lines, and the supply [mV], 0 if the chip cannot tell."""

    counts: Counts
    lines: int
    supply_mv: int

    @property
    def switches(self) -> tuple[bool, bool, bool]:
        """Which axes' switches are closed."""
        return bool(self.lines & 1), bool(self.lines & 2), bool(self.lines & 4)


@dataclass(frozen=True, slots=True)
class AxisFacts:
    """Page 1 of an axis (from 1): missed edges, duty and threshold [thousandths], lag [counts], kept samples, step."""

    axis: int
    missed: int
    duty: int
    lag: int
    threshold: int
    samples: int
    step: int


@dataclass(frozen=True, slots=True)
class LimitFacts:
    """Page 2: limits of an axis [counts, counts/s, counts/s^2]."""

    low: int
    high: int
    speed: int
    acceleration: int


def encode_service(frame: ServiceFrame, key: bytes) -> bytes:
    """SERVICE under the session key."""
    flags = frame.page | FLAG_UNHOMED * frame.unhomed | FLAG_AT_ONCE * frame.at_once
    body = pack(
        _SERVICE,
        (
            *(head(FrameKind.SERVICE), frame.clock & 0xFF, frame.session, frame.counter),
            *(frame.operation, frame.order, frame.axis, flags, frame.amount, frame.rate, frame.span),
        ),
    )
    return body + tag(key, body + nonce_bytes(frame.clock), FROM_HOST)


def decode_service(payload: bytes, key: bytes, now: int) -> ServiceFrame | Reject:
    """SERVICE, or why it is none under `key` at the time `now` [ticks]."""
    clock = latest_clock(payload[1], now) if len(payload) == FRAME_BYTES else 0
    if (reject := verify(payload, FrameKind.SERVICE, key, nonce_bytes(clock) + FROM_HOST)) is not None:
        return reject
    _, _, session, counter, operation, order, axis, flags, amount, rate, span = _SERVICE.unpack_from(payload)
    operations, pages, _ = _CODES
    page, needs_axis = flags & 0xF, operation in ORDERS
    known = operation in operations and page in pages and flags < 2 * FLAG_AT_ONCE
    if not known or not needs_axis <= axis <= AXIS_COUNT or abs(amount) > TARGET_LIMIT or any(payload[20:BODY_BYTES]):
        return Reject.FIELD
    whole = ServiceOperation(operation), order, axis, ReadingPage(page)
    marks = bool(flags & FLAG_UNHOMED), bool(flags & FLAG_AT_ONCE)
    return ServiceFrame(clock, session, counter, *whole, *marks, amount, rate, span)


def encode_reading(frame: ReadingFrame, key: bytes) -> bytes:
    """READING under the session key."""
    whose = head(FrameKind.READING), frame.node, frame.session, frame.echo, frame.clock & 0xFFFF
    body = pack(_READING, (*whose, frame.outcome << 4 | frame.page, frame.index, frame.facts))
    return body + tag(key, body + nonce_bytes(frame.clock), FROM_NODE)


def decode_reading(payload: bytes, key: bytes, known: int) -> ReadingFrame | Reject:
    """READING, or why it is none under `key`; `known` is a time of the node that is not far away [ticks]."""
    clock = nearest_clock(int.from_bytes(payload[8:10], "little"), known)
    if (reject := verify(payload, FrameKind.READING, key, nonce_bytes(clock) + FROM_NODE)) is not None:
        return reject
    _, node, session, echo, _, what, index, facts = _READING.unpack_from(payload)
    _, pages, outcomes = _CODES
    if what & 0xF not in pages or what >> 4 not in outcomes:
        return Reject.FIELD
    return ReadingFrame(node, session, echo, clock, ReadingPage(what & 0xF), ErrandOutcome(what >> 4), index, facts)


def pack_motors(facts: MotorFacts) -> bytes:
    """Page 0; counts beyond 24 bits saturate."""
    supply = min(facts.supply_mv, 0xFFFF).to_bytes(2, "little")
    return b"".join(_three(each) for each in facts.counts) + bytes([facts.lines]) + supply


def motors_in(facts: bytes) -> MotorFacts:
    """Page 0 of a READING."""
    x, y, z = (int.from_bytes(facts[at : at + 3], "little", signed=True) for at in (0, 3, 6))
    return MotorFacts((x, y, z), facts[9], int.from_bytes(facts[10:12], "little"))


def pack_axis(facts: AxisFacts) -> bytes:
    """Page 1; what does not fit saturates."""
    counted = [min(each, 0xFFFF) for each in (facts.missed, facts.lag, facts.threshold)]
    missed, lag, threshold = counted
    return _AXIS_FACTS.pack(facts.axis, missed, facts.duty, lag, threshold, facts.samples, facts.step)


def axis_in(facts: bytes) -> AxisFacts:
    """Page 1 of a READING."""
    return AxisFacts(*_AXIS_FACTS.unpack(facts))


def pack_limits(facts: LimitFacts) -> bytes:
    """Page 2."""
    return b"".join(_three(each) for each in (facts.low, facts.high, facts.speed, facts.acceleration))


def limits_in(facts: bytes) -> LimitFacts:
    """Page 2 of a READING."""
    return LimitFacts(*(int.from_bytes(facts[at : at + 3], "little", signed=True) for at in range(0, FACT_BYTES, 3)))


def pack_samples(samples: tuple[int, ...]) -> bytes:
    """Page 3."""
    return _SAMPLES.pack(*samples)


def samples_in(facts: bytes) -> tuple[int, ...]:
    """Page 3 of a READING."""
    return _SAMPLES.unpack(facts)


def _three(value: int) -> bytes:
    return max(-TARGET_LIMIT, min(TARGET_LIMIT, value)).to_bytes(3, "little", signed=True)
