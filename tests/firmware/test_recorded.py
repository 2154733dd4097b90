"""Somebody records what a host sends, keeps it back, and sends it again: nothing moves that should not."""

from __future__ import annotations

import ctypes
from functools import lru_cache
from pathlib import Path

import pytest

from curveline.radio.host.peer import NO_LOAD, Peer
from curveline.radio.protocol.codes import ATTEMPT_MASK, FrameKind, NodeState
from curveline.radio.protocol.envelope import kind_of
from curveline.radio.protocol.frames import HelloFrame, IdentFrame, StatusFrame, encode_hello
from curveline.radio.protocol.keys import Site

from . import build
from .display import Rig
from .hand import Hand
from .image import Image
from .twin import CORE_SOURCES

MASTER, CHIP, BOOT, NOISE = bytes(range(16)), 0xA0000001, 7, 0x55AA55AA
TARGET = (4000, 0, 0)
SESSIONS = 0xFFFF
"""Session numbers there are."""
HELLOS = 70_000


# Frames that are kept back, on the image


@pytest.fixture
def single(image: Image, homed_flash: bytes, tmp_path: Path) -> Rig:
    return Rig(image, homed_flash, tmp_path, count=1)


def test_drives_that_are_delivered_late_do_not_keep_the_motors_turning(single: Rig) -> None:
    (machine,), fleet = single.machines, single.fleet
    hand = Hand(fleet, single.radio)
    hand.poll(release=1, load=(1, TARGET, 20_000))
    for _ in range(15):
        hand.poll(release=1)
        fleet.run(100_000)
    assert machine.motors[0].speed > 100, "fresh frames keep it moving for longer than the dead-man time"
    hand.status()
    kept = [hand.peer.drive(1, 0, NO_LOAD) for _ in range(20)]
    kept += [hand.peer.drive(1, 2, NO_LOAD) for _ in range(10)]
    clock = hand.peer.clock
    moving = []
    for payload in kept:
        hand.send(payload)
        fleet.run(100_000)
        moving.append(machine.motors[0].speed > 100)
    assert moving[5], "they are good until a dead-man time after what the host had heard"
    assert not any(moving[13:])
    assert hand.peer.clock > clock + 30, "old frames are answered with the time"
    assert hand.status().state is NodeState.HOLD_LINK
    assert hand.status(hold=2).state is NodeState.MOVING


# Sessions that were, on the C core


@lru_cache
def library() -> ctypes.CDLL:
    loaded = ctypes.CDLL(str(build.shared_library("node_bench", [*CORE_SOURCES, build.HERE / "node_bench.c"])))
    loaded.bench_new.restype = ctypes.c_void_p
    loaded.bench_moves.restype = ctypes.c_bool
    loaded.bench_answer.restype = ctypes.c_size_t
    for name in ("free", "moves", "bad_tags"):
        getattr(loaded, f"bench_{name}").argtypes = [ctypes.c_void_p]
    loaded.bench_answer.argtypes = [ctypes.c_void_p, ctypes.c_char_p]
    loaded.bench_receive.argtypes = [ctypes.c_void_p, ctypes.c_int64, ctypes.c_char_p, ctypes.c_size_t]
    return loaded


class Bench:
    """A homed node of the C core, at one moment of its time."""

    def __init__(self, boot: int = BOOT) -> None:
        self._c = library()
        self._self = self._c.bench_new(MASTER, CHIP, boot, NOISE)
        self.now_ms = 1000

    def __del__(self) -> None:
        self._c.bench_free(self._self)

    def hear(self, payload: bytes) -> bytes:
        """Take a frame; the answer that is loaded then."""
        self._c.bench_receive(self._self, self.now_ms, payload, len(payload))
        answer = ctypes.create_string_buffer(32)
        size = self._c.bench_answer(self._self, answer)
        return answer.raw[:size]

    @property
    def moves(self) -> bool:
        return bool(self._c.bench_moves(self._self))

    @property
    def bad_tags(self) -> int:
        return int(self._c.bench_bad_tags(self._self))


def host() -> Peer:
    site = Site(MASTER, (CHIP,))
    return Peer(1, "C1C1C1C101", site.node_key(1), 0x1234567890ABCD00)


def hello(peer: Peer, nonce: int) -> bytes:
    return encode_hello(HelloFrame(1, nonce, 0x77, 0, 1000), peer.node_key)


def recorded_run(bench: Bench) -> tuple[bytes, list[bytes]]:
    """A host that makes the node move and gives it back: its HELLO, and its DRIVEs."""
    peer = host()
    greeting = hello(peer, peer.nonce)
    ident = peer.take(bench.hear(greeting))
    assert isinstance(ident, IdentFrame)
    peer.accept(ident, 0x77)
    drives = [peer.drive(1, 0, (1, TARGET, 0)), peer.drive(1, 0, NO_LOAD)]
    for payload in drives:
        assert isinstance(peer.take(bench.hear(payload)), StatusFrame)
    assert bench.moves
    bench.now_ms += 5000
    assert kind_of(bench.hear(drives[0])) is FrameKind.STATUS
    assert not bench.moves
    return greeting, drives


def offer_number(answer: bytes) -> int:
    assert kind_of(answer) is FrameKind.IDENT
    return int.from_bytes(answer[2:4], "little")


def test_seventy_thousand_hellos_bring_no_old_session_back() -> None:
    """Only the keys are in the way here: session numbers come again, and no time passes that would make frames old."""
    bench = Bench()
    peer = host()
    peer.key = b""
    nonce = peer.nonce
    greeting = hello(peer, nonce)
    ident = peer.take(bench.hear(greeting))
    assert isinstance(ident, IdentFrame)
    peer.accept(ident, 0x77)
    recorded = [peer.drive(1, 0, (1, TARGET, 0)), peer.drive(1, 0, NO_LOAD)]
    others = [hello(peer, nonce ^ 1 << 40), hello(peer, nonce ^ 1 << 41)]
    met = 0
    for count in range(2, HELLOS):
        again = (count - 1) % SESSIONS == 0
        number = offer_number(bench.hear(greeting if again else others[count % 2]))
        assert (number == ident.session) == again
        if again:
            met += 1
            before = bench.bad_tags
            for payload in recorded:
                bench.hear(payload)
            assert bench.bad_tags == before + len(recorded)
            assert not bench.moves
    assert met == 1


def test_a_recorded_run_moves_a_node_again_neither_at_once_nor_after_its_hello() -> None:
    bench = Bench()
    greeting, drives = recorded_run(bench)
    for payload in (*drives, greeting, *drives):
        bench.hear(payload)
        assert not bench.moves


@pytest.mark.parametrize("apart", [1, 1 << 8, 1 << 16])
def test_another_boot_makes_other_keys_even_if_its_noise_were_the_same(apart: int) -> None:
    recorded = recorded_run(Bench())
    bench = Bench(BOOT + apart)
    for payload in (recorded[0], *recorded[1]):
        bench.hear(payload)
        assert not bench.moves
    assert bench.bad_tags == len(recorded[1])


def test_only_attempts_of_one_handshake_get_the_same_offer() -> None:
    bench, peer = Bench(), host()
    first = bench.hear(hello(peer, peer.nonce))
    assert bench.hear(hello(peer, peer.nonce | ATTEMPT_MASK))[2:] == first[2:]
    assert offer_number(bench.hear(hello(peer, peer.nonce + ATTEMPT_MASK + 1))) == offer_number(first) + 1


def test_what_an_emergency_stop_of_an_offered_session_leaves_loaded_is_of_this_moment() -> None:
    bench, peer = Bench(), host()
    bench.now_ms = 10 * 3_600_000
    ident = peer.take(bench.hear(hello(peer, peer.nonce)))
    assert isinstance(ident, IdentFrame)
    peer.accept(ident, 0x77)
    bench.hear(peer.estop())
    bench.now_ms += 100
    status = peer.take(bench.hear(b""))
    assert isinstance(status, StatusFrame)
    assert status.state is NodeState.ESTOP
    assert status.clock >= ident.clock
