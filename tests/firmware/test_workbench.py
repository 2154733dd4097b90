"""A turn without a loop: the C workbench and its specification ask for the same duty, whatever the encoders say."""

from __future__ import annotations

import ctypes
from pathlib import Path
from random import Random

import pytest

from curveline.radio.node.workbench import Turn, Workbench
from curveline.radio.protocol.codes import (
    READING_SAMPLES,
    TRACE_SAMPLES,
    TURN_COUNTS,
    TURN_DUTY,
    TURN_MS,
)

from . import build

SEED = 20261130
TURNS = 400
MISTAKES = (
    ("far >= bench->turn.counts", "far > bench->turn.counts"),
    ("bench->at_ms > bench->turn.span_ms", "bench->at_ms >= bench->turn.span_ms"),
    ("bench->driver_ms > DRIVER_MS", "bench->driver_ms >= DRIVER_MS"),
    ("|| bench->rest_ms != 0", ""),
    ("if (enough < most) duty = enough;", "duty = enough;"),
    ("bench->turn.at_once || bench->threshold != 0", "bench->threshold != 0"),
    ("far >= LIFE_COUNTS", "far > LIFE_COUNTS"),
    ("at < bench->samples ? bench->trace[at] : 0", "bench->trace[at % CL_TRACE_SAMPLES]"),
)

Counts = ctypes.c_int32 * 3


class CTurn(ctypes.Structure):
    _fields_ = (
        *(("axis", ctypes.c_uint8), ("at_once", ctypes.c_bool), ("duty", ctypes.c_int16)),
        *(("counts", ctypes.c_uint16), ("span_ms", ctypes.c_uint16)),
    )


class CWorkbench(ctypes.Structure):
    _fields_ = (
        *(("turn", CTurn), ("begin", Counts), ("duty", ctypes.c_int16), ("threshold", ctypes.c_uint16)),
        *((name, ctypes.c_uint16) for name in ("at_ms", "rest_ms", "driver_ms", "sample_ms")),
        *(("busy", ctypes.c_bool), ("samples", ctypes.c_uint8), ("trace", ctypes.c_int16 * TRACE_SAMPLES)),
    )


def loaded(source: Path) -> ctypes.CDLL:
    library = ctypes.CDLL(str(build.shared_library("workbench", [source], [f"-I{build.CORE}"])))
    library.cl_workbench_tick.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_bool]
    library.cl_workbench_tick.restype = ctypes.c_int16
    return library


def random_turn(random: Random) -> Turn:
    duty = random.choice((TURN_DUTY, -TURN_DUTY, random.randint(1, TURN_DUTY), -random.randint(1, TURN_DUTY)))
    counts, span = random.randint(1, TURN_COUNTS), random.choice((TURN_MS, random.randint(1, 300), 1))
    return Turn(random.randint(1, 3), duty, counts, span, random.random() < 0.4)


def differs(library: ctypes.CDLL, random: Random) -> bool:
    """Whether the two part in one random turn."""
    turn, ours, theirs = random_turn(random), Workbench(), CWorkbench()
    at = [random.choice((0, 2**31 - 5, random.randint(-(2**31), 2**31 - 1))) for _ in range(3)]
    ours.start(turn, (0, 0, 0))
    start = CTurn(turn.axis, turn.at_once, turn.duty, turn.counts, turn.span_ms)
    library.cl_workbench_start(ctypes.byref(theirs), ctypes.byref(start), Counts(*at))
    gone, pace, trouble = [0, 0, 0], random.choice((0.0, 0.01, 0.4, 3.0)), random.random() < 0.2
    for _ in range(TURN_MS + 100):
        for axis in range(3):
            gone[axis] += round(random.gauss(0.0, pace)) + round(pace * random.random() * (axis == turn.axis - 1))
        fault = trouble and random.random() < 0.4
        wrapped = Counts(*(each + way for each, way in zip(at, gone, strict=True)))
        duty = library.cl_workbench_tick(ctypes.byref(theirs), wrapped, fault)
        if duty != ours.tick((gone[0], gone[1], gone[2]), driver_fault=fault) or ours.busy != theirs.busy:
            return True
    first = random.randint(0, 255)
    some = (ctypes.c_int16 * READING_SAMPLES)()
    library.cl_workbench_samples(ctypes.byref(theirs), ctypes.c_uint8(first), some)
    known = [*ours.samples[first : first + READING_SAMPLES], *READING_SAMPLES * [0]][:READING_SAMPLES]
    kept = list(theirs.trace[: theirs.samples])
    return (ours.threshold, ours.samples, known) != (theirs.threshold, kept, list(some))


def test_both_turn_alike() -> None:
    library, random = loaded(build.CORE / "workbench.c"), Random(SEED)
    assert not any(differs(library, random) for _ in range(TURNS))


@pytest.mark.parametrize(("right", "wrong"), MISTAKES)
def test_a_mistake_is_found(tmp_path: Path, right: str, wrong: str) -> None:
    text = (build.CORE / "workbench.c").read_text()
    assert text.count(right) == 1, "the mistake no longer fits the code"
    (tmp_path / "workbench.c").write_text(text.replace(right, wrong))
    library, random = loaded(tmp_path / "workbench.c"), Random(SEED)
    assert any(differs(library, random) for _ in range(TURNS))
