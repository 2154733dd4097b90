"""Runs node.py through the sequences of events that the C harness in twin/ made and ran, and compares the outcome.

A sequence is a start (memory, sessions, limits, plant) and a few events. The C side makes it from a seed, runs the C
core through it and leaves one record per event and one at the end; the Python side must arrive at the same bytes.
"""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import PlantFault, PlantLook, Sought
from curveline.radio.node.settings_flash import SettingsStanding
from curveline.radio.node.state import Identity, Memory, NodeSession
from curveline.radio.node.workbench import Turn
from curveline.radio.protocol.codes import READING_SAMPLES, BootCause, Counts, ErrandOutcome, Fault
from curveline.radio.protocol.frames import HelloFrame
from curveline.radio.protocol.keys import Site
from curveline.radio.protocol.motion import Axes, AxisLimits, NodeMove
from curveline.radio.protocol.node_settings import SETTINGS_BYTES
from curveline.radio.protocol.settings_frames import PIECES, pieces_of

from . import build

FOLDER = build.HERE / "twin"
SOURCES = tuple(FOLDER / name for name in ("replay.c", "starts.c", "generate.c", "notes.c"))
CORE_SOURCES = tuple(
    build.CORE / name for name in ("blake2s.c", "keys.c", "frames.c", "motion.c", "node.c", "receive.c", "errand.c")
)

START = struct.Struct("<qqqqQ qQQ16sIHHHBBBBBB qQQ16sIHHHBBBBBB 3i3i3iiiiiIII 6H 3B3B 16B 6x")
EVENT = struct.Struct("<q32s4iBBBB4x")
SHORT = struct.Struct("<32s3iBBH")
FULL = struct.Struct("<8qQ 3i3i3i3i 4i 4i 10I 9H 3B17B 7B84s 7x")
MOST_EVENTS = 12
BATCH = 500

RECEIVE, ADVANCE, NOTICE, START_HOMING, STOP_HOMING, SHIFT, SETTLE, FAULT, SEARCH = range(9)
WHATS = ("receive", "advance", "notice", "start homing", "stop homing", "shift", "settle", "fault", "search")
FRAMES = (
    *("DRIVE", "HOME", "SERVICE", "SETTINGS", "ESTOP", "STOP", "HELLO", "repeated HELLO", "query", "PAGE"),
    "no node's frame",
)
SPOILS = (
    *("unspoiled", "flipped bit", "forged tag", "replayed", "other node", "other session", "odd field", "cut short"),
    *("old clock", "future clock", "wrapped clock"),
)

_AXES = (
    ((-221326, 221326, 4426, 22132), (-5215, 5215, 3128, 13906), (-48691, 48691, 2213, 11066)),
    ((-262136, 262136, 1000000, 1000000), (-262136, 262136, 100, 1000000), (-262136, 262136, 1000000, 100)),
    ((0, 1000, 100, 100), (-3, 3, 997, 1009), (-262136, -262000, 123456, 100)),
    ((-100000, 100000, 50000, 200000), (-90, 90, 6000, 40000), (0, 0, 100, 100)),
)
AXES: tuple[Axes, ...] = tuple(tuple(AxisLimits(*axis) for axis in axes) for axes in _AXES)  # type: ignore[misc]


def _identity(number: int, chip: int, firmware: int, master: bytes) -> Identity:
    return Identity(number, Site(master.ljust(16, b"\0"), (0,) * (number - 1) + (chip,)), firmware)


IDENTITIES = (
    _identity(1, 0xA0000001, 1, b""),
    _identity(3, 0xA0000003, 7, bytes(range(1, 17))),
    _identity(128, 0xFFFFFFFF, 0x01020304, b"\xff\xfe"),
)
NO_MOVE = NodeMove((0, 0, 0), (0, 0, 0), 0, 0, 0)


class ToldKeeper:
    """Takes all settings, and says of each order what the start says; twin/replay.c has the same."""

    def __init__(self, outcome: ErrandOutcome, *, on_trial: bool) -> None:
        self.outcome = outcome
        self.on_trial = on_trial
        self.stores = self.requests = self.keeps = self.drops = 0
        self.record = bytes(SETTINGS_BYTES)

    def standing(self) -> SettingsStanding:
        """See SettingsKeeper."""
        return SettingsStanding(self.on_trial, 0xFE00 + self.keeps, 0xFE00 + self.stores)

    def store(self, record: bytes) -> ErrandOutcome:
        """See SettingsKeeper."""
        self.record = record
        self.stores += 1
        return self.outcome

    def request(self) -> ErrandOutcome:
        """See SettingsKeeper."""
        self.requests += 1
        return self.outcome

    def keep(self) -> ErrandOutcome:
        """See SettingsKeeper."""
        self.keeps += 1
        return self.outcome

    def drop(self) -> None:
        """See SettingsKeeper."""
        self.drops += 1


class ToldPlant:
    """Axes that follow a move exactly, and do besides what the events say; twin/replay.c has the same."""

    def __init__(self, place: Counts, lag_ms: int, seek_ms: int, found: Counts, settings: ToldKeeper) -> None:
        self.settings = settings
        self.lag_ms = lag_ms
        self.seek_ms = seek_ms
        self.has_loader = bool(seek_ms & 1)
        self.found = found
        self.search: Sought | None = None
        self.axes = 0
        self.turn_wanted = Turn(0, 0, 0, 0)
        self.ends: int | None = None
        self.turns = self.places = 0
        self.seeks = self.give_ups = 0
        self.shift = (0, 0, 0)
        self.settles: int | None = None
        self.coming: PlantFault | None = None
        self.move: NodeMove | None = None
        self.follows = 0
        self._place = place
        self._start_ms = 0

    def follow(self, now_ms: int, start_ms: int, move: NodeMove) -> None:
        """See Plant; a new move begins where the axes are, so it takes up what had pushed them."""
        if now_ms == start_ms:
            self.shift = (0, 0, 0)
        self.move, self._start_ms = move, start_ms
        self.follows += 1
        self.settles = max(now_ms, start_ms + move.end_ms + self.lag_ms) if self.lag_ms >= 0 else None

    def positions(self, now_ms: int) -> Counts:
        """See Plant."""
        x, y, z = self._place if self.move is None else self.move.at(now_ms - self._start_ms)
        return x + self.shift[0], y + self.shift[1], z + self.shift[2]

    def settles_ms(self) -> int | None:
        """See Plant."""
        return self.settles

    def fault(self) -> PlantFault | None:
        """See Plant."""
        return self.coming

    def seek(self, now_ms: int, axes: int) -> None:
        """See Plant; what it comes to says nothing about the other axes."""
        self.axes = axes
        self.seeks += 1
        self.search = Sought(now_ms + self.seek_ms, self.found) if self.seek_ms >= 0 else None

    def sought(self) -> Sought | None:
        """See Plant."""
        return self.search

    def give_up(self, now_ms: int) -> None:
        """See Plant."""
        self.search = self.ends = None
        self.give_ups += 1

    def turn(self, now_ms: int, turn: Turn) -> None:
        """See Plant."""
        self.turn_wanted = turn
        self.turns += 1
        self.ends = now_ms + self.seek_ms if self.seek_ms >= 0 else None

    def turned_ms(self) -> int | None:
        """See Plant."""
        return self.ends

    def place(self, now_ms: int, axis: int, counts: int) -> None:
        """See Plant."""
        by = counts - self.positions(now_ms)[axis - 1]
        x, y, z = (each + by * (number == axis) for number, each in enumerate(self.shift, start=1))
        self.shift = (x, y, z)
        self.places += 1

    def look(self, now_ms: int, axis: int, first: int) -> PlantLook:
        """See Plant."""
        return PlantLook(
            *(self.positions(now_ms), self.follows & 0x2F, 3300 + self.places, axis + self.seeks, -axis, 7 * axis),
            *(self.give_ups + 9, self.turns, tuple(10 * axis - first - number for number in range(READING_SAMPLES))),
        )


class WatchedNode(NodeMachine):
    """A node that counts how often an answer is loaded, as the C one does for its radio."""

    loads = -1
    """The empty answer that a node is made with is none."""
    _loaded = b""

    @property
    def ack(self) -> bytes:
        """The loaded answer."""
        return self._loaded

    @ack.setter
    def ack(self, payload: bytes) -> None:
        self._loaded = payload
        self.loads += 1


def _session(facts: tuple[Any, ...]) -> NodeSession | None:
    heard_ms, handshake, run_tag, key, counter, number, release, deadman_ms, *rest = facts
    flags, hold_gen, exists, closed, owns_run, order = rest
    if not exists:
        return None
    hello = HelloFrame(0, handshake, run_tag, 0, deadman_ms, flags)
    return NodeSession(number, key, hello, counter, release, hold_gen, heard_ms, bool(closed), bool(owns_run), order)


def begin(start: tuple[Any, ...]) -> WatchedNode:
    """The node that a start describes, with a ToldPlant."""
    now_ms, window_ms, deaf_until_ms, fault_ms, run_tag = start[:5]
    target, next_target, place, (move_ms, lag_ms, seek_ms, trial_ms) = (
        start[33:36],
        start[36:39],
        start[39:42],
        start[42:46],
    )
    noise, boot, offers, finished, started, staged, next_ms, bad_tags, old_frames = start[46:55]
    unhomed, found, (homing, estop, fault, fault_axis, cause) = start[55:58], start[58:61], start[61:66]
    silent, stopped, lift_above, in_window, who, axes, turning, on_trial, pieces, keeps, _ = start[66:]
    memory = Memory(
        *(boot, BootCause(cause), noise, offers, unhomed, homing, bool(estop), Fault(fault), fault_axis, fault_ms),
        *(run_tag, finished, started, staged, target, move_ms, next_target, next_ms),
    )
    plant = ToldPlant(place, lag_ms, seek_ms, found, ToldKeeper(ErrandOutcome(keeps), on_trial=bool(on_trial)))
    if homing:
        plant.seek(now_ms, homing)
    node = WatchedNode(IDENTITIES[who], AXES[axes], plant, memory)
    if turning:
        plant.turn(now_ms, Turn(1, 0, 0, 0))
        node.turning, node.outcome = True, ErrandOutcome.BUSY
    node._session, node._pending = _session(start[5:19]), _session(start[19:33])
    if node._session is not None:
        held = pieces_of(bytes(3 * at + who & 0xFF for at in range(SETTINGS_BYTES)))
        node._session.pieces = {index: held[index] for index in range(PIECES) if pieces >> index & 1}
    node.trial_ends_ms = now_ms + trial_ms if trial_ms else 0
    node._silent, node._stopped, node._lift_above = bool(silent), bool(stopped), lift_above
    tally = node.tally
    tally.bad_tags, tally.old_frames, tally._in_window = bad_tags, old_frames, in_window
    tally._window_ms, tally._deaf_until_ms = window_ms, deaf_until_ms
    return node


def do(node: NodeMachine, event: tuple[Any, ...]) -> None:
    """Let one event happen."""
    now_ms, payload, a, b, c, _, what, length, _, _ = event
    plant = node.plant
    assert isinstance(plant, ToldPlant)
    if what == RECEIVE:
        node.receive(now_ms, payload[:length])
    elif what == ADVANCE:
        node.advance(now_ms)
    elif what == NOTICE:
        node.notice(now_ms)
    elif what == START_HOMING:
        node.start_homing(now_ms, a)
    elif what == STOP_HOMING:
        node.stop_homing(now_ms)
    elif what == SHIFT:
        plant.shift = (plant.shift[0] + a, plant.shift[1] + b, plant.shift[2] + c)
    elif what == SETTLE:
        plant.settles = now_ms + b if a else None
    elif what == FAULT:
        plant.coming = PlantFault(now_ms + c, Fault(a), b) if a else None
    elif what == SEARCH:
        plant.search = Sought(now_ms + b, (c & 15, c >> 4 & 15, c >> 8 & 15)) if a else None
        plant.ends = now_ms + b if a else None


def look(node: WatchedNode, now_ms: int) -> bytes:
    """What shows after every event: the loaded answer, the set-points, the state, how often answers were loaded."""
    ack = node.ack
    return SHORT.pack(ack, *node.setpoint(now_ms), len(ack), node.state, node.loads & 0xFFFF)


def look_closely(node: NodeMachine) -> bytes:
    """All that the node keeps, after the last event."""
    memory, tally, session, plant = node.memory, node.tally, node._session, node.plant
    assert isinstance(plant, ToldPlant)
    move, turn = plant.move or NO_MOVE, plant.turn_wanted
    told = plant.settings
    heard_ms = counter = number = release = hold_gen = closed = owns_run = order = pieces = 0
    if session is not None:
        heard_ms, counter, number = session.heard_ms, session.counter, session.number
        release, hold_gen, closed = session.release, session.hold_gen, session.closed
        owns_run, order = session.owns_run, session.order
        pieces = sum(1 << index for index in session.pieces)
    return FULL.pack(
        *(-1 if node._next_ms is None else node._next_ms, node.move_start_ms, heard_ms),
        *(tally._window_ms, tally._deaf_until_ms, memory.fault_ms, node.blink_until_ms),
        *(node.trial_ends_ms, memory.run_tag),
        *(*memory.target, *memory.next_target, *move.start, *move.target),
        *(memory.move_ms, move.duration_ms, move.ramp_ms, -1 if move.brake_ms is None else move.brake_ms),
        *(turn.axis | turn.at_once << 8, turn.duty, turn.counts, turn.span_ms),
        *(memory.noise, counter, tally.floods, plant.follows),
        *(memory.boot, memory.offers, plant.seeks, plant.give_ups, plant.turns, plant.places),
        *(memory.finished, memory.started, memory.staged, memory.next_ms),
        *(min(tally.bad_tags, 0xFFFF), min(tally.old_frames, 0xFFFF), number, release),
        0 if node._pending is None else node._pending.number,
        *memory.unhomed,
        *(plant.axes, memory.homing, memory.estop, memory.fault, memory.fault_axis, node.move is not None),
        *(node._silent, node._stopped, node._lift_above, hold_gen, closed, tally._in_window, owns_run, order),
        *(node.jogging, node.turning, node.outcome, node.on_trial, node.leaves, pieces),
        *(told.stores, told.requests, told.keeps, told.drops, told.record),
    )


def replay(start: tuple[Any, ...], events: Sequence[tuple[Any, ...]]) -> bytes:
    """What the Python node makes of a sequence."""
    node = begin(start)
    seen = []
    for event in events:
        do(node, event)
        seen.append(look(node, event[0]))
    seen.append(look_closely(node))
    return b"".join(seen)


@dataclass
class Difference:
    """A sequence of which the two made different things."""

    seed: int
    start: tuple[Any, ...]
    events: list[tuple[Any, ...]]


class Harness:
    """The C side, compiled; sequence `seed` is the same wherever it is made."""

    def __init__(self, library: Path) -> None:
        self._c = ctypes.CDLL(str(library))
        self._c.twin_batch.restype = self._c.twin_replay.restype = ctypes.c_size_t
        self._c.twin_batch.argtypes = [ctypes.c_uint64, ctypes.c_uint] + 3 * [ctypes.c_char_p]
        self._c.twin_replay.argtypes = 3 * [ctypes.c_char_p]
        self._c.twin_outcome.restype = ctypes.c_char_p
        self._starts = ctypes.create_string_buffer(BATCH * START.size)
        self._events = ctypes.create_string_buffer(BATCH * MOST_EVENTS * EVENT.size)
        self._seen = ctypes.create_string_buffer(BATCH * (MOST_EVENTS * SHORT.size + FULL.size))

    def compare(self, first: int, count: int) -> Difference | None:
        """The first difference among sequences `first` to `first + count - 1`."""
        for begin_at in range(first, first + count, BATCH):
            if (found := self._compare_batch(begin_at, min(BATCH, first + count - begin_at))) is not None:
                return found
        return None

    def _compare_batch(self, first: int, count: int) -> Difference | None:
        size = self._c.twin_batch(first, count, self._starts, self._events, self._seen)
        seen, at = self._seen.raw[:size], 0
        events = EVENT.iter_unpack(self._events.raw)
        for seed, start in enumerate(START.iter_unpack(self._starts.raw[: count * START.size]), start=first):
            own = list(islice(events, start[-1]))
            expected = replay(start, own)
            if seen[at : at + len(expected)] != expected:
                return Difference(seed, start, own)
            at += len(expected)
        assert at == size
        return None

    def replay(self, start: tuple[Any, ...], events: Sequence[tuple[Any, ...]]) -> bytes:
        """What the C node makes of a sequence."""
        packed = START.pack(*start[:-1], len(events))
        size = self._c.twin_replay(packed, b"".join(EVENT.pack(*event) for event in events), self._seen)
        return self._seen.raw[:size]

    def differs(self, start: tuple[Any, ...], events: Sequence[tuple[Any, ...]]) -> bool:
        """Whether the two make different things of a sequence."""
        return self.replay(start, events) != replay(start, events)

    def shrunk(self, found: Difference) -> Difference:
        """The same difference with as few events as leaving some out can do."""
        events = list(found.events)
        for index in reversed(range(len(events))):
            fewer = events[:index] + events[index + 1 :]
            if self.differs(found.start, fewer):
                events = fewer
        return Difference(found.seed, found.start, events)

    def noted(self) -> dict[str, int]:
        """How often what happened in all sequences that this harness has run."""
        names = []
        while (name := self._c.twin_outcome(len(names))) is not None:
            names.append(name.decode())
        names += [f"state {number}" for number in range(16)] + [f"fault {number}" for number in range(8)]
        names += [f"errand {outcome.name}" for outcome in ErrandOutcome]
        names += WHATS
        names += [f"{frame}, {spoil}" for frame in FRAMES for spoil in SPOILS]
        counts = (ctypes.c_uint * len(names))()
        self._c.twin_noted(counts)
        return dict(zip(names, counts, strict=True))


def describe(harness: Harness, found: Difference) -> str:
    """The shrunk trace of a difference, and what the two sides show after each event."""
    found = harness.shrunk(found)
    lines = [f"sequence {found.seed}, shrunk to {len(found.events)} events; start {found.start}"]
    ours, theirs = replay(found.start, found.events), harness.replay(found.start, found.events)
    for number, event in enumerate(found.events):
        at = number * SHORT.size
        lines.append(_event_line(event))
        lines += _differing_lines(SHORT, ours[at : at + SHORT.size], theirs[at : at + SHORT.size])
    at = len(found.events) * SHORT.size
    lines += ["at the end", *_differing_lines(FULL, ours[at:], theirs[at:])]
    return "\n".join(lines)


def _event_line(event: tuple[Any, ...]) -> str:
    now_ms, payload, *args, what, length, frame, spoil = event
    if what == RECEIVE:
        return f"{now_ms} ms: {FRAMES[frame]}, {SPOILS[spoil]}: {payload[:length].hex()}"
    return f"{now_ms} ms: {WHATS[what]} {args}"


def _differing_lines(layout: struct.Struct, ours: bytes, theirs: bytes) -> Iterator[str]:
    if ours != theirs:
        yield f"    python {[each.hex() if isinstance(each, bytes) else each for each in layout.unpack(ours)]}"
        yield f"    C      {[each.hex() if isinstance(each, bytes) else each for each in layout.unpack(theirs)]}"


def library(core: Sequence[Path] = CORE_SOURCES, flags: Sequence[str] = ()) -> Path:
    """The harness compiled with the C core, or with another version of it."""
    return build.shared_library("twin", [*SOURCES, *core], [f"-I{FOLDER}", *flags])


def library_with(source: Path, flags: Sequence[str]) -> Path:
    """The harness with another version of one file of the core; what is the same each time is compiled once."""
    rest = [each for each in (*SOURCES, *CORE_SOURCES) if each.name != source.name]
    flags = [f"-I{FOLDER}", *flags]
    return build.shared_library("twin", [source, *(build.object_file(each, flags) for each in rest)], flags)
