"""The numbers of the link protocol, docs/radio-protocol.md: limits, flags, states, faults, and a node's clock."""

from __future__ import annotations

from enum import Enum, IntEnum

VERSION = 2
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
CLOCK_SHIFT = 6
"""A node's clock ticks every 2**6 = 64 ms of the time since it was switched on."""
DRIVE_CLOCK_BITS = 8
STATUS_CLOCK_BITS = 16
"""Low bits of the clock that these frames carry; their tags cover all of it."""
BOOT_END = 1 << 24
"""Boot numbers are below; a node that comes here stays off the air for good."""
OFFERS_END = 1 << 32
"""Offers in one boot are below; a node that comes here makes none until its power is switched off and on."""
NOT_HOMED = 15
"""In the place of the fault that keeps an axis from being homed: nobody has homed it, or it is being homed."""
ATTEMPT_MASK = 0xFF
"""Bits of the host nonce that count attempts: they defeat the radio's repeat filter and stay out of all keys."""

FLAG_TAKEOVER = 1
FLAG_RESUME = 2
FLAG_QUERY = 4
FLAG_CLEAR = 8

AXIS_COUNT = 3
ALL_AXES = 0b111
Counts = tuple[int, int, int]
"""Encoder counts of a node's axes, in the order of `plan.AXES`."""


class FrameKind(IntEnum):
    """Low nibble of byte 0."""

    DRIVE = 1
    STATUS = 2
    HELLO = 3
    IDENT = 4
    PAGE = 5
    STOP = 6
    ESTOP = 7
    REPORT = 8
    HOME = 9


class NodeState(IntEnum):
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


TURNING = frozenset({NodeState.MOVING, NodeState.HOMING})
"""States in which motors turn."""


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


class BootCause(IntEnum):
    """Why a node started last."""

    UNKNOWN = 0
    POWER_ON = 1
    PIN = 2
    LOW_VOLTAGE = 3
    WATCHDOG = 4
    HANG = 5
    SOFTWARE = 6


STATES = frozenset(map(int, NodeState))
FAULTS = frozenset(map(int, Fault))
CAUSES = frozenset(map(int, BootCause))
REASONS = FAULTS | {NOT_HOMED}
"""What may keep an axis from being homed; 0 says that it is."""


class Reject(Enum):
    """Why a payload is not the frame that was looked for."""

    LENGTH = "not 32 bytes"
    VERSION = "another protocol version"
    KIND = "another kind of frame"
    TAG = "wrong tag"
    FIELD = "a field with no meaning"


def plain_name(code: Enum) -> str:
    """A state, a fault or a cause as people read it: `hold-link`."""
    return code.name.lower().replace("_", "-")


def clock_of(now_ms: int) -> int:
    """Ticks of a node's clock `now_ms` after it was switched on."""
    return now_ms >> CLOCK_SHIFT


def latest_clock(low: int, now: int) -> int:
    """The last tick not after `now` whose low bits a DRIVE carries; below 0 if there has been none yet."""
    return now - ((now - low) & ((1 << DRIVE_CLOCK_BITS) - 1))


def nearest_clock(low: int, known: int) -> int:
    """The tick nearest to `known` whose low bits a STATUS carries."""
    half = 1 << (STATUS_CLOCK_BITS - 1)
    return max(0, known + ((low - known + half) & (2 * half - 1)) - half)
