"""The control half of the firmware's core on modelled motors, in virtual time; rig.c is the bench itself."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from types import TracebackType

from . import build

CORE = tuple(build.CORE / f"{name}.c" for name in ("blake2s", "drive", "motion", "servo", "track"))
LINEAR = (-260_000, 260_000, 4426, 22132)
BIAS = (-5215, 5215, 3129, 13906)
LIFT = (-48_700, 48_700, 2213, 11066)
AXES = (LINEAR, BIAS, LIFT)
"""Limits of the axes in counts, counts/s and counts/s^2: 20 mm/s, 45 deg/s, 10 mm/s."""

BANDS = (22, 10, 22)
REENGAGES = (66, 31, 66)
STALL, RUNAWAY, ENCODER, DRIVER = 3, 4, 5, 6

Triple = ctypes.c_int32 * 3
Limits = (ctypes.c_int32 * 4) * 3


class Motor(ctypes.Structure):
    """A modelled motor; see rig.c for what the fields mean."""

    _fields_ = (
        *((name, ctypes.c_double) for name in ("counts_per_s", "time_constant", "stiction", "friction", "load")),
        *((name, ctypes.c_double) for name in ("low", "high", "position", "speed")),
        *((name, ctypes.c_int32) for name in ("wiring", "encoder", "count", "jump", "phase")),
    )


class Report(ctypes.Structure):
    """What the bench saw."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("now_ms", "settled_ms", "fault_ms", "driver_low_ms")),
        *((name, ctypes.c_int32) for name in ("fault", "fault_axis")),
        *((name, Triple) for name in ("worst", "off_ms", "setpoint")),
        ("pwm", ctypes.c_int16 * 3),
    )


CHECKED = "CURVELINE_CHECKED"
"""Environment variable that has the benches compiled with checks for undefined behaviour; what they find is the end."""


def compiled(name: str, sources: Sequence[Path]) -> ctypes.CDLL:
    """A bench as a library. Of the checks gcc reports what it finds, the other compiler just stops."""
    if CHECKED not in os.environ:
        path = build.shared_library(name, sources, ["-lm"])
    elif gcc := build.gcc():
        checks = ["-fsanitize=undefined", "-fno-sanitize-recover=all", "-lm"]
        path = build.shared_library(name, sources, checks, [gcc])
    else:
        checks = ["-fsanitize=undefined", "-fsanitize-trap=undefined", "-lm"]
        path = build.shared_library(name, sources, checks, build.zig())
    return ctypes.CDLL(str(path))


@lru_cache
def library() -> ctypes.CDLL:
    """The bench of the drive."""
    loaded = compiled("rig", [*CORE, build.HERE / "rig.c"])
    loaded.rig_new.restype = ctypes.POINTER(Report)
    loaded.rig_motor.restype = ctypes.POINTER(Motor)
    loaded.rig_run.restype = ctypes.c_int64
    loaded.rig_run.argtypes = loaded.rig_skip.argtypes = [ctypes.c_void_p, ctypes.c_int64]
    loaded.rig_still.restype = loaded.rig_coasts.restype = ctypes.c_bool
    return loaded


class Rig:
    """Three motors on a drive."""

    def __init__(self) -> None:
        self._c = library()
        self._self = self._c.rig_new()
        self.motors = [self._c.rig_motor(self._self, axis).contents for axis in range(3)]

    def __enter__(self) -> Rig:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._c.rig_free(self._self)

    @property
    def seen(self) -> Report:
        return self._self.contents

    @property
    def counts(self) -> list[int]:
        return [motor.count for motor in self.motors]

    @property
    def errors(self) -> list[int]:
        return [abs(motor.count - at) for motor, at in zip(self.motors, self.seen.setpoint, strict=True)]

    @property
    def positions(self) -> list[int]:
        at = Triple()
        self._c.rig_positions(self._self, at)
        return list(at)

    @property
    def still(self) -> bool:
        return bool(self._c.rig_still(self._self))

    def coasts(self, axis: int) -> bool:
        return bool(self._c.rig_coasts(self._self, axis))

    def place(self, at: Sequence[int]) -> None:
        self._c.rig_place(self._self, Triple(*at))

    def plan(self, target: Sequence[int], least_ms: int = 0, axes: Sequence[Sequence[int]] = AXES) -> None:
        """Set off for `target`, as the node would."""
        limits = Limits(*((ctypes.c_int32 * 4)(*axis) for axis in axes))
        self._c.rig_plan(self._self, Triple(*target), limits, least_ms)

    def gain(self, axis: int, gains: Sequence[int]) -> None:
        """Other gains for an axis: proportional, integral, damping, forward, lead_ms, kick."""
        self._c.rig_gain(self._self, axis, (ctypes.c_int16 * 6)(*gains))

    def brake(self) -> None:
        self._c.rig_brake(self._self)

    def fail(self, fault: int, axis: int) -> None:
        self._c.rig_fail(self._self, fault, axis)

    def run(self, ms: int) -> int:
        """Let up to `ms` pass, less if there is news; how many did."""
        return int(self._c.rig_run(self._self, ms))

    def skip(self, ms: int) -> None:
        """Let `ms` pass without a tick."""
        self._c.rig_skip(self._self, ms)

    def wait(self, ms: int) -> None:
        """Let `ms` pass, news or not."""
        while ms > 0:
            ms -= self.run(ms)

    def arrive(self, limit_ms: int = 60_000) -> int:
        """Run until the drive says that the move has ended or failed; how long that took."""
        passed = 0
        while self.seen.settled_ms < 0 and self.seen.fault == 0:
            passed += self.run(limit_ms - passed)
            assert passed < limit_ms, f"no news within {limit_ms} ms; off by {self.errors}, PWM {list(self.seen.pwm)}"
        return passed
