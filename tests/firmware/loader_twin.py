"""The loader in C, on this machine with its flash in memory, beside its Python specification: lives of nodes.

A life is made of frames that a host, a stranger or a recording may send, of resets, and of power that fails in the
flash. After each frame both must have the same answer loaded and the same in flash. After a power cut it may hold what
was there before the frame or after it, or less; then the specification goes on from there.
"""

from __future__ import annotations

import ctypes
from copy import deepcopy
from dataclasses import dataclass, replace
from hashlib import blake2s
from pathlib import Path
from random import Random

from curveline.radio.node.loader import SECTORS, LoaderMachine, ProgramStore, facts_in
from curveline.radio.node.state import Identity
from curveline.radio.protocol.codes import BODY_BYTES, FLAG_CLEAR, FLAG_QUERY, BootCause
from curveline.radio.protocol.frames import HelloFrame, NodeNonce, encode_hello
from curveline.radio.protocol.keys import FROM_HOST, Site, session_key, tag
from curveline.radio.protocol.node_settings import node_settings
from curveline.radio.protocol.update_frames import (
    COUNTER_MOST,
    DESCRIPTION_BYTES,
    PIECE_BYTES,
    PIECES,
    SECTOR_BYTES,
    SECTOR_NONE,
    ProgramFacts,
    UpdateFrame,
    UpdatePlace,
    describe,
    encode_update,
)
from curveline.radio.site.program_file import DESCRIPTION_AT, PROGRAM_AT

from . import build
from .fleet import drive_table

RIG = build.HERE / "loader_rig"
UPDATE = build.FIRMWARE / "loader" / "update.c"
CORE = ("blake2s.c", "keys.c", "frames.c", "store.c", "crc32.c", "settings_record.c", "settings_store.c")
MARKS = 64
WHOLE, TRIED, KEPT = 60, 61, 62
SETTINGS_AT = 0xF400
MASTER = bytes(range(16))
NUMBER = 2
SIZES = (*(256, 260, 1020, 1024, 1024) * 3, 1028, 2048, 49 * 1024, 252, 258, 49 * 1024 + 4)
"""Of programs that are described; the last ones make no sense."""
BLANK = b"\xff" * 4


class Memory(ctypes.Structure):
    """As in rig.c."""

    _fields_ = (
        ("operations", ctypes.c_int64),
        ("cut_after", ctypes.c_int64),
        ("off", ctypes.c_int32),
        ("misuse", ctypes.c_int32),
        ("random", ctypes.c_uint32),
        ("flash", ctypes.c_uint8 * 0x10000),
        ("doubt", ctypes.c_uint8 * 0x4000),
    )


def library(folder: Path, text: str, flags: tuple[str, ...] = ()) -> ctypes.CDLL:
    """The loader with this text of update.c."""
    merged = folder / "loader.c"
    merged.write_text(text + (RIG / "rig.c").read_text())
    found = (f"-I{RIG}", f"-I{UPDATE.parent}", f"-I{build.FIRMWARE / 'node'}")
    core = [build.object_file(build.CORE / name) for name in CORE]
    c = ctypes.CDLL(str(build.shared_library("loader", [merged, *core], (*found, *flags))))
    c.rig_memory.restype = ctypes.POINTER(Memory)
    c.rig_start.restype = c.chip_id.restype = ctypes.c_uint32
    c.update_receive.argtypes = (ctypes.c_char_p, ctypes.c_uint8, ctypes.c_int64)
    for name in ("update_runnable", "update_kept", "update_try", "update_over"):
        getattr(c, name).restype = ctypes.c_bool
    return c


@dataclass(frozen=True)
class Sent:
    """A program as a host has it; `data` may be another than the one that `description` is of."""

    description: bytes
    data: bytes


class Differs(AssertionError):
    """The two do not agree."""


class Life:
    """One node, in C and in Python, and those who send to it."""

    def __init__(self, c: ctypes.CDLL, seed: int) -> None:
        self.random = Random(seed)
        self._c = c
        self._memory: Memory = c.rig_memory().contents
        self._answer = (ctypes.c_uint8 * 32).in_dll(c, "update_answer")
        self.identity = Identity(NUMBER, Site(MASTER, (0, c.chip_id())))
        self.key = self.identity.node_key
        self.now_ms = self.random.choice((0, 1000, 2**31, 2**38))
        self.boot = 0
        self.store = ProgramStore.flashed(4)
        self.sessions: list[tuple[int, bytes]] = []
        self.recorded: list[bytes] = []
        self.counter = 0
        self.programs = [self._program() for _ in range(3)]
        self.at_hand = self.programs[0]
        self.handshake = 0
        self.seen: dict[str, int] = {}
        self._manufacture()
        self.machine = self._start()

    def _program(self) -> Sent:
        random = self.random
        length = random.choice(SIZES)
        data = random.choice((b"\xff\xff\xff\xff", random.randbytes(4))) * (length // 4) + bytes(length % 4)
        digest = blake2s(data, key=self.key, digest_size=16).digest()
        layout = random.choice((1,) * 9 + (2,))
        description = describe(ProgramFacts(length, random.randrange(9), layout, digest))
        if random.random() < 0.05:
            description = description[:-1] + b"?"
        if random.random() < 0.15:
            data = bytes([data[0] ^ 1]) + data[1:]
        return Sent(description, data)

    def _manufacture(self) -> None:
        """What a cable brings."""
        ctypes.memset(ctypes.byref(self._memory), 0, ctypes.sizeof(Memory))
        self._memory.cut_after, self._memory.random = -1, self.random.getrandbits(32)
        ctypes.memset(self._memory.flash, 0xFF, 0x10000)
        self._write(SETTINGS_AT, node_settings(MASTER, drive_table(NUMBER), NUMBER, 0).sector())
        self._write(DESCRIPTION_AT, self.store.description)
        self._write(PROGRAM_AT, self.store.sectors[0])
        for mark in (0, WHOLE, TRIED, KEPT):
            self._write(DESCRIPTION_AT + MARKS + 4 * mark, bytes(4))

    def _write(self, at: int, data: bytes) -> None:
        ctypes.memmove(ctypes.byref(self._memory.flash, at), data, len(data))

    def _read(self, at: int, length: int) -> bytes:
        return bytes(self._memory.flash[at : at + length])

    # Resets

    def _start(self) -> LoaderMachine:
        """The loader goes on the air, after as many tries as the power needs."""
        c, cause = self._c, self.random.choice(list(BootCause))
        noise = self.random.getrandbits(32)
        while True:
            c.rig_forget()
            boot = int(c.rig_start(noise, int(cause)))
            if boot and not self._memory.off:
                break
            self._memory.cut_after = -1
            self._note("cut at the start")
        assert boot > self.boot, "a boot number came twice"
        self.boot = boot
        self.sessions, self.counter = [], 0
        return LoaderMachine(self.identity, NodeNonce(boot, 0, noise), self.store, cause)

    def reset(self) -> None:
        """As firmware/loader/start.c decides; a program that is started hears a host, or does not."""
        c, random = self._c, self.random
        c.rig_forget()
        self._same(bool(c.update_runnable()), self.store.is_runnable, "runnable")
        self._same(bool(c.update_kept()), self.store.kept, "kept")
        if random.random() < 0.8 and c.update_runnable():
            before = deepcopy(self.store)
            good = c.update_kept() or c.update_try()
            self.store.start()
            self._note("started")
            if self._memory.off:
                self._look(before)
            else:
                self._same(good, True, "tried")
            if self.store.tried and not self._memory.off and random.random() < 0.4:
                self.store.kept = True
                self._write(DESCRIPTION_AT + MARKS + 4 * KEPT, bytes(4))
        self._memory.cut_after = -1
        self._check_flash()
        self.machine = self._start()

    def fail_soon(self) -> None:
        """The power will fail within some operations of the flash."""
        self._memory.cut_after = self._memory.operations + self.random.choice(
            (0, 1, 5, 9, 200, self.random.randrange(400))
        )

    def _look(self, before: ProgramStore) -> None:
        """After a power cut: what the flash holds is no more than there was, or there was to be."""
        after, self.store = self.store, self._found(before)
        found = self.store
        known = [each for each in (before, after) if each.description == found.description]
        self._note("cut, " + ("as it was" if found == before else "done" if found == after else "less"))
        if not known:
            self._same(found.facts, None, "a description that nobody has sent")
        for sector, data in found.sectors.items():
            is_known = found.facts is None or data in [each.sectors.get(sector) for each in known]
            self._same(is_known, True, f"sector {sector} marked")
        for mark in ("whole", "kept", "tried"):
            may = any(getattr(each, mark) for each in known)
            self._same(getattr(found, mark) and found.facts is not None and not may, False, f"{mark} marked")

    def _found(self, before: ProgramStore) -> ProgramStore:
        marks = self._read(DESCRIPTION_AT + MARKS, 256)
        is_set = [marks[at : at + 4] != BLANK for at in range(0, 256, 4)]
        store = before
        store.description = self._read(DESCRIPTION_AT, DESCRIPTION_BYTES)
        at = (sector for sector in range(SECTORS) if is_set[sector])
        sectors = {sector: self._read(PROGRAM_AT + SECTOR_BYTES * sector, SECTOR_BYTES) for sector in at}
        return replace(store, sectors=sectors, whole=is_set[WHOLE], tried=is_set[TRIED], kept=is_set[KEPT])

    # Frames

    def say(self, payload: bytes, rest: bytes = b"") -> None:
        """Send a frame to both, and compare them; `rest` lies behind it in memory."""
        self.now_ms += self.random.choice((0, 1, 64, 1000))
        before = deepcopy(self.store) if self._memory.cut_after >= 0 else self.store
        self._c.update_receive((payload + rest).ljust(32), len(payload), self.now_ms)
        self.machine.receive(self.now_ms, payload)
        self.recorded.append(payload)
        if self._memory.off:
            self._look(before)
            self._memory.cut_after = -1
            self.machine = self._start()
            return
        self._same(bytes(self._answer), self.machine.ack or bytes(32), "answer")
        self._same(bool(self._c.update_over()), self.machine.over, "over")
        self._check_flash()

    def _check_flash(self) -> None:
        store = self.store
        marks = bytearray(BLANK * 64)
        for mark in (*store.sectors, *(at for at, on in self._marks() if on)):
            marks[4 * mark : 4 * mark + 4] = bytes(4)
        found = bytearray(self._read(DESCRIPTION_AT + MARKS, 256))
        for at in range(0, 256, 4):
            if self._memory.doubt[(DESCRIPTION_AT + MARKS + at) // 4] and found[at : at + 4] != BLANK:
                found[at : at + 4] = bytes(4)
        self._same(bytes(found), bytes(marks), "marks")
        self._same(self._read(DESCRIPTION_AT, DESCRIPTION_BYTES), store.description, "description")
        for sector in list(store.sectors)[-1:]:
            self._same(self._read(PROGRAM_AT + SECTOR_BYTES * sector, SECTOR_BYTES), store.sectors[sector], "sector")
        self._same(self._memory.misuse, 0, "a word was programmed twice")

    def _marks(self) -> tuple[tuple[int, bool], ...]:
        return (WHOLE, self.store.whole), (TRIED, self.store.tried), (KEPT, self.store.kept)

    def _same(self, c: object, python: object, what: str) -> None:
        if c != python:
            raise Differs(f"{what}: {c!r} in C, {python!r} in Python, after {len(self.recorded)} frames")

    def _note(self, what: str) -> None:
        self.seen[what] = self.seen.get(what, 0) + 1

    # Those who send

    def hello(self) -> None:
        """A handshake, new or repeated, a query, one with another key or for another node."""
        random = self.random
        fresh = random.random() < 0.8 or not self.handshake
        self.handshake = random.getrandbits(64) & ~0xFF if fresh else self.handshake
        nonce, tag = self.handshake | random.randrange(3), random.choice((0x7570, random.getrandbits(64)))
        flags = random.choice((0,) * 6 + (FLAG_QUERY, FLAG_CLEAR))
        node = NUMBER if random.random() < 0.9 else 3
        frame = HelloFrame(node, nonce, tag, random.getrandbits(16), 1000, flags)
        offers = self.machine._nonce.offers
        self.say(encode_hello(frame, self.key if random.random() < 0.9 else bytes(16)))
        self._note("query" if flags == FLAG_QUERY else "hello")
        if self.machine._nonce.offers != offers:
            if random.random() < 0.9:
                self.counter = 0
            session = session_key(self.key, self.handshake, self.machine._nonce, tag)
            self.sessions.append((self.machine._nonce.session, session))

    def update(self, place: int, index: int = 0, data: bytes = bytes(PIECE_BYTES)) -> None:
        """A frame of the newest session mostly, spoiled sometimes."""
        random = self.random
        if not self.sessions:
            self.hello()
        if not self.sessions:
            return
        number, key = self.sessions[-1] if random.random() < 0.97 else random.choice(self.sessions)
        self.counter += random.choice((1,) * 40 + (0, 2, -1))
        counter = max(0, self.counter) if random.random() < 0.998 else random.choice((0, COUNTER_MOST, 0xFFFF))
        payload = encode_update(UpdateFrame(number, counter, place, index, data), key)
        spoil = random.random()
        if spoil < 0.01:
            at = random.randrange(256)
            payload = (int.from_bytes(payload, "little") ^ 1 << at).to_bytes(32, "little")
        elif spoil < 0.015:
            at = random.randrange(32)
            self.say(payload[:at], payload[at:])
            return
        elif spoil < 0.02 and self.recorded:
            payload = random.choice(self.recorded)
        elif spoil < 0.025:
            return
        elif spoil < 0.03:
            body = bytes([payload[0] ^ 1 << random.randrange(8)]) + payload[1:BODY_BYTES]
            payload = body + tag(key, body, FROM_HOST)
        self.say(payload)

    def describe(self) -> None:
        """What is to come; then that it begins."""
        random, whole = self.random, self.at_hand.description
        odd = ((1, 0), (0, 0, 1), (0,), (1,), (0, 1, 2), (0, 1, 63), (0, 1, 64))
        parts = (0, 1) if random.random() < 0.8 else random.choice(odd)
        self.at_hand = self.at_hand if random.random() < 0.6 else random.choice(self.programs)
        for index in parts:
            data = whole[PIECE_BYTES * index : PIECE_BYTES * (index + 1)].ljust(PIECE_BYTES, b"\0")
            self.update(UpdatePlace.DESCRIPTION, index, data)
        if random.random() < 0.9:
            self.update(UpdatePlace.BEGIN)
        self._note(f"begin {self.machine._outcome.name}")

    def fill(self) -> None:
        """The pieces of the sector that is waited for, in any order."""
        random, sector = self.random, self.machine._sector
        if sector >= SECTORS:
            return
        places = list(range(PIECES))
        if random.random() < 0.5:
            random.shuffle(places)
        rounds, before = random.choice((1, 2, 2)), len(self.store.sectors)
        for index in places * rounds:
            if sector != self.machine._sector:
                break
            if self.machine._held >> index & 1 and random.random() < 0.98:
                continue
            at = SECTOR_BYTES * sector + PIECE_BYTES * index
            self.update(sector, index, self.at_hand.data[at : at + PIECE_BYTES].ljust(PIECE_BYTES, b"\0"))
        self._note("sector" if len(self.store.sectors) > before else "no sector")

    def finish(self) -> None:
        """That it is all."""
        self.update(UpdatePlace.FINISH)
        self._note(f"finish {self.machine._outcome.name}")

    def leave(self) -> None:
        """That it may start."""
        self.update(UpdatePlace.LEAVE)
        self._note(f"leave {self.machine._outcome.name}")
        if self.machine.over and self.random.random() < 0.7:
            self.reset()

    def stray(self) -> None:
        """A frame that fits nothing: any place, noise, a recording, the counter's end."""
        random = self.random
        kind = random.randrange(5)
        if kind == 0:
            self.update(
                random.choice((random.randrange(256), SECTOR_NONE, 48, 49)), random.randrange(70), random.randbytes(16)
            )
        elif kind == 1:
            self.say(random.choice((b"\x2d", b"\x23", b"\x1d", b"\x25")) + random.randbytes(31))
        elif kind == 2 and self.recorded:
            for payload in random.choices(self.recorded, k=5):
                self.say(payload)
        elif kind == 3:
            self.update(UpdatePlace.ASK)
        else:
            self.at_hand = random.choice(self.programs)

    def live(self, acts: int) -> None:
        """So many things happen, mostly in the order of an update."""
        random = self.random
        usual = (self.hello, self.describe, self.fill, self.fill, self.finish, self.leave)
        step = 0
        for _ in range(acts):
            if random.random() < 0.75:
                usual[step % len(usual)]()
                step += 1
            else:
                random.choice((self.stray, self.stray, *usual, self.reset, *(self.fail_soon,) * 4))()
        facts = facts_in(self.store.description)
        if facts is not None and self.store.is_runnable and facts.digest != bytes(16):
            self._same(self.store.is_as_described(self.key), True, "a program that may start is the one described")
