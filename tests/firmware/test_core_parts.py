"""The parts of the C core one by one: hash, frames' numbers, moves, and what they need of a small processor."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Iterator
from enum import IntEnum
from hashlib import blake2s
from pathlib import Path
from random import Random

import pytest

from curveline.radio.node import state
from curveline.radio.protocol import codes, keys, motion, page_frames, service_frames, settings_frames
from curveline.radio.protocol.motion import AxisLimits, NodeMove

from . import build
from .twin import CORE_SOURCES

SEED = 20261122


class Bytes(ctypes.Structure):
    _fields_ = (("at", ctypes.c_char_p), ("length", ctypes.c_size_t))


class Limits(ctypes.Structure):
    _fields_ = tuple((name, ctypes.c_int32) for name in ("low", "high", "speed", "acceleration"))


Counts = ctypes.c_int32 * 3


class CMove(ctypes.Structure):
    _fields_ = (
        *(("start", Counts), ("target", Counts)),
        *(("duration_ms", ctypes.c_int32), ("ramp_ms", ctypes.c_int32), ("brake_ms", ctypes.c_int32)),
    )


@pytest.fixture(scope="module")
def core() -> ctypes.CDLL:
    library = ctypes.CDLL(str(build.shared_library("core", CORE_SOURCES)))
    library.cl_blake2s.argtypes = [Bytes, Bytes, ctypes.c_char_p, ctypes.c_size_t]
    library.cl_config_hash.restype = ctypes.c_uint16
    library.cl_outside.restype = ctypes.c_uint8
    library.cl_move_brake.argtypes = [ctypes.c_void_p, ctypes.c_int64]
    library.cl_move_at.argtypes = [ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p]
    return library


# Hash


@pytest.mark.parametrize("key_length", range(33))
def test_blake2s_is_that_of_hashlib(core: ctypes.CDLL, key_length: int) -> None:
    random = Random(SEED + key_length)
    key = random.randbytes(key_length)
    digest = ctypes.create_string_buffer(32)
    for length in range(201):
        message, size = random.randbytes(length), random.randint(1, 32)
        core.cl_blake2s(Bytes(key, key_length), Bytes(message, length), digest, size)
        assert digest.raw[:size] == blake2s(message, digest_size=size, key=key).digest()


# Numbers of the wire


def defined(header: str) -> dict[str, int]:
    """Names and numbers of a header's #defines and enums, as far as they are plain numbers."""
    text = (build.CORE / header).read_text()
    found = re.findall(r"#define (CL_\w+) (\w+)(?:u|\b)", text) + re.findall(r"\b(CL_\w+) = (\w+)", text)
    return {name: int(value.rstrip("u"), 0) for name, value in found if value[0].isdigit()}


@pytest.mark.parametrize(
    ("prefix", "enum"),
    [
        *(("CL_KIND_", codes.FrameKind), ("CL_STATE_", codes.NodeState)),
        *(("CL_FAULT_", codes.Fault), ("CL_CAUSE_", codes.BootCause)),
        *(("CL_OPERATION_", codes.ServiceOperation), ("CL_PAGE_", codes.ReadingPage)),
        *(("CL_SETTINGS_", codes.SettingsOperation), ("CL_OUTCOME_", codes.ErrandOutcome)),
    ],
)
def test_codes_are_those_of_python(prefix: str, enum: type[IntEnum]) -> None:
    ours = {name.removeprefix(prefix): code for name, code in defined("frames.h").items() if name.startswith(prefix)}
    assert ours == {member.name: int(member) for member in enum}


def test_flags_and_limits_are_those_of_python() -> None:
    numbers = defined("frames.h") | defined("keys.h") | defined("motion.h") | defined("node.h")
    enums = (
        "CL_KIND_",
        "CL_STATE_",
        "CL_FAULT_",
        "CL_CAUSE_",
        "CL_OPERATION_",
        "CL_SETTINGS_",
        "CL_PAGE_",
        "CL_OUTCOME_",
    )
    places = (codes, keys, motion, state, page_frames, service_frames, settings_frames)
    compared = set()
    for name, number in numbers.items():
        if name.startswith(enums) or name == "CL_AXES":
            continue
        assert [getattr(place, name[3:]) for place in places if hasattr(place, name[3:])][:1] == [number], name
        compared.add(name[3:])
    assert {name for name in vars(codes) if name.startswith("FLAG_")} <= compared
    assert {"VERSION", "COUNTER_END", "HOLD_END", "TARGET_LIMIT", "POSITION_LIMIT", "FLOOD", "DEAF_MS"} <= compared
    assert {"CLOCK_SHIFT", "DRIVE_CLOCK_BITS", "BOOT_END", "OFFERS_END", "NOT_HOMED", "ALL_AXES"} <= compared


def test_the_program_and_the_specification_are_of_one_firmware() -> None:
    text = (build.FIRMWARE / "node" / "program.h").read_text()
    assert f"#define FIRMWARE {state.FIRMWARE}u\n" in text


GOOD, REJECT_KIND, REJECT_TAG = range(3)


def test_a_decoder_takes_its_own_kind_of_frame_only(core: ctypes.CDLL) -> None:
    key = bytes(range(16))
    keyed, frame = ctypes.create_string_buffer(32), ctypes.create_string_buffer(128)
    core.cl_tag_key(keyed, key)
    now = ctypes.c_int64(0)
    decoders = {
        1: lambda payload, keyed, frame: core.cl_decode_drive(payload, keyed, now, frame),
        3: core.cl_decode_hello,
        5: core.cl_decode_ask,
        7: core.cl_decode_estop,
        9: lambda payload, keyed, frame: core.cl_decode_home(payload, keyed, now, frame),
        10: lambda payload, keyed, frame: core.cl_decode_service(payload, keyed, now, frame),
    }
    for head in (*range(0x20, 0x30), 0x31, 0x11, 0x01):
        axes = 1 if head & 0xF == codes.FrameKind.HOME else 0
        body = bytes((head, *7 * (0,), axes, *15 * (0,)))
        payload = body + keys.tag(key, body, keys.FROM_HOST)
        for own, decode in decoders.items():
            assert decode(payload, keyed, frame) == (GOOD if head == 0x20 | own else REJECT_KIND)
            spoiled = payload[:31] + bytes((payload[31] ^ 1,))
            assert decode(spoiled, keyed, frame) == (REJECT_TAG if head == 0x20 | own else REJECT_KIND)
        assert (core.cl_decode_stop(payload, keyed) == REJECT_KIND) == (head != 0x26)


# Moves


def random_axis(random: Random) -> AxisLimits:
    low, high = sorted(random.randint(-codes.POSITION_LIMIT, codes.POSITION_LIMIT) for _ in range(2))
    speed, acceleration = (
        random.choice((motion.LEAST_RATE, motion.MOST_RATE, random.randint(motion.LEAST_RATE, motion.MOST_RATE)))
        for _ in range(2)
    )
    return AxisLimits(low, high, speed, acceleration)


def random_moves(count: int) -> Iterator[tuple[motion.Axes, NodeMove]]:
    """Moves as nodes make them, from places that are out of bounds too."""
    random = Random(SEED)
    for number in range(count):
        axes = (random_axis(random), random_axis(random), random_axis(random))
        reach = 2 * codes.POSITION_LIMIT if number % 4 == 0 else 300
        target = tuple(random.choice((axis.low, axis.high, random.randint(axis.low, axis.high))) for axis in axes)
        start = tuple(
            max(-2 * codes.POSITION_LIMIT, min(2 * codes.POSITION_LIMIT, counts + random.randint(-reach, reach)))
            for counts in target
        )
        least_ms = random.choice((0, 1, random.randint(0, 0xFFFF), random.randint(0, 7_000_000)))
        yield axes, motion.plan_move(start, target, axes, least_ms)  # type: ignore[arg-type]


def c_limits(axes: motion.Axes) -> ctypes.Array[Limits]:
    return (Limits * 3)(*(Limits(axis.low, axis.high, axis.speed, axis.acceleration) for axis in axes))


def facts(move: CMove) -> NodeMove:
    brake_ms = None if move.brake_ms == -1 else move.brake_ms
    return NodeMove(tuple(move.start), tuple(move.target), move.duration_ms, move.ramp_ms, brake_ms)  # type: ignore[arg-type]


def same_places(core: ctypes.CDLL, ours: NodeMove, theirs: CMove, moments: list[int]) -> None:
    at = Counts()
    for moment in moments:
        core.cl_move_at(ctypes.byref(theirs), moment, at)
        assert tuple(at) == ours.at(moment), (ours, moment)


def test_moves_are_those_of_python(core: ctypes.CDLL) -> None:
    random = Random(SEED)
    for axes, ours in random_moves(4000):
        theirs = CMove(Counts(*ours.start))
        core.cl_plan_move(ctypes.byref(theirs), Counts(*ours.target), c_limits(axes), ours.duration_ms)
        assert facts(theirs) == ours
        end, ramp = ours.duration_ms, ours.ramp_ms
        edges = [-(2**40), -1, 0, 1, ramp - 1, ramp, ramp + 1, end - ramp, end - 1, end, end + 1, 2**40]
        same_places(core, ours, theirs, [*edges, *(random.randint(0, end) for _ in range(4))])
        assert core.cl_move_end_ms(ctypes.byref(theirs)) == ours.end_ms
        brake_ms = random.choice((*edges, random.randint(0, end), random.randint(0, end)))
        ours = ours.braked(brake_ms)
        core.cl_move_brake(ctypes.byref(theirs), brake_ms)
        core.cl_move_brake(ctypes.byref(theirs), brake_ms + 1)
        assert facts(theirs) == ours
        assert core.cl_move_end_ms(ctypes.byref(theirs)) == ours.end_ms
        assert core.cl_move_rest_ms(ctypes.byref(theirs)) == motion.rest_ms(ours)
        same_places(core, ours, theirs, [*edges, *(random.randint(0, end) for _ in range(4))])


def test_the_least_move_time_is_taken_from_the_limits(core: ctypes.CDLL) -> None:
    for axes, ours in random_moves(2000):
        theirs = CMove(Counts(*ours.start))
        core.cl_plan_move(ctypes.byref(theirs), Counts(*ours.target), c_limits(axes), 0)
        assert facts(theirs) == motion.plan_move(ours.start, ours.target, axes, 0)


def test_limits_and_their_hash_are_those_of_python(core: ctypes.CDLL) -> None:
    random = Random(SEED)
    for axes, move in random_moves(1000):
        limits = c_limits(axes)
        assert core.cl_config_hash(limits) == motion.config_hash(axes)
        target = tuple(counts + random.randint(-1, 1) for counts in move.target)
        assert core.cl_outside(limits, Counts(*target)) == motion.outside(axes, target)  # type: ignore[arg-type]


@pytest.mark.parametrize("duration_ms", [2_000, 65_536, 147_797_420, 2**31 - 1])
def test_what_is_left_of_a_braked_move_is_that_of_python_for_days(core: ctypes.CDLL, duration_ms: int) -> None:
    for brake_ms in (0, 1, 999, 1_000, duration_ms // 3, duration_ms - 1):
        move = NodeMove((6_391_035, 0, 0), (-8_388_607, 0, 0), duration_ms, 1_000, brake_ms)
        theirs = CMove(Counts(*move.start), Counts(*move.target), duration_ms, 1_000, brake_ms)
        assert core.cl_move_rest_ms(ctypes.byref(theirs)) == motion.rest_ms(move)


# What it needs of the processor it is made for

SMALL = ("-target", "thumb-freestanding-eabi", "-mcpu=cortex_m0plus", "-isystem", str(build.FIRMWARE / "node" / "libc"))
NODE_BYTES = 1536


def test_the_core_fits_a_small_processor(tmp_path: Path) -> None:
    source = tmp_path / "size.c"
    source.write_text(f'#include "node.h"\n_Static_assert(sizeof(cl_node) < {NODE_BYTES}, "too large");\n')
    for each in (source, *CORE_SOURCES):
        arguments = [*build.zig(), *SMALL, *build.STANDARD, *build.WARNINGS, "-c", str(each)]
        build.run_compiler([*arguments, "-o", str(tmp_path / f"{each.stem}.o")])
    source.write_text(source.read_text().replace(str(NODE_BYTES), "256"))
    with pytest.raises(build.CompilerError, match="too large"):
        build.run_compiler([*build.zig(), *SMALL, *build.STANDARD, "-c", str(source), "-o", str(tmp_path / "size.o")])
