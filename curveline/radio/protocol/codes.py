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

SERVICE_DEADMAN_MS = 300
"""A jog or a turn is refused to a host that may be silent for longer than this."""
BLINK_MS = 1000
"""How long a lamp flickers after a frame that asked for it."""
UNHOMED_COUNTS = 5000
"""How far an axis that is not homed may be jogged at once, and a quarter of its travel if that is less."""
TURN_DUTY = 350
TURN_COUNTS = 1000
TURN_MS = 1500
"""A turn without a loop is at most so strong [thousandths of full duty], long, and of that duration."""
TRACE_SAMPLES = 64
TRACE_MS = 4
"""Counts of a turned axis that a node keeps, and how far apart."""
READING_SAMPLES = 6
"""Of these, how many fit one READING."""

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
    SERVICE = 10
    READING = 11
    SETTINGS = 12
    UPDATE = 13
    PROGRESS = 14


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


class ServiceOperation(IntEnum):
    """What a SERVICE asks a node to do."""

    LOOK = 0
    BLINK = 1
    JOG = 2
    TURN = 3
    PLACE = 4


class ReadingPage(IntEnum):
    """Which facts a READING has."""

    MOTORS = 0
    AXIS = 1
    LIMITS = 2
    TRACE = 3
    SETTINGS = 4


class SettingsOperation(IntEnum):
    """What a SETTINGS brings, or asks a node to do; all but a piece are orders."""

    PIECE = 0
    STORE = 1
    TRY = 2
    KEEP = 3
    DROP = 4
    LOADER = 5


class ErrandOutcome(IntEnum):
    """What became of the last order of a SERVICE or a SETTINGS; from HELD on, why it was refused."""

    NONE = 0
    BUSY = 1
    DONE = 2
    ENDED = 3
    FAILED = 4
    HELD = 5
    UNHOMED = 6
    BEYOND = 7
    FAULTY = 8
    OCCUPIED = 9
    DEADMAN = 10


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
