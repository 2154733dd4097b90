"""Synchronised trapezoids in integers: what a node's three axes do during one step.

All axes share one dimensionless path: speed rises for `ramp_ms`, stays, and falls for `ramp_ms`, so they leave and
arrive together. Set-points are exact functions of whole milliseconds; no product exceeds 64 bits, so the firmware can
repeat every value.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from hashlib import blake2s
from math import isqrt

from curveline.drive_settings import AXES, MAX_EDGES_PER_S, AxisDrive, DriveSettings
from curveline.errors import InvalidInput
from curveline.radio.protocol.codes import POSITION_LIMIT, Counts

LEAST_RATE = 100
MOST_RATE = 1_000_000
"""Speeds and accelerations [counts/s, counts/s^2] between which all products fit 64 bits."""


@dataclass(frozen=True)
class AxisLimits:
    """Limits of one axis in counts, counts/s and counts/s^2."""

    low: int
    high: int
    speed: int
    acceleration: int


Axes = tuple[AxisLimits, AxisLimits, AxisLimits]


def axes_of(drive: DriveSettings) -> Axes:
    """Limits that nodes of a display hold; travel ends where a STATUS frame could no longer report the position.

    InvalidInput for an axis too slow or too gentle for the 64 bits of the arithmetic, or beyond what can be reported,
    and for encoders that bring edges faster than a node counts them.
    """
    axes = extrude, bias, translate = [_axis_limits(*each) for each in zip(AXES, drive.axes, strict=True)]
    edges = sum(axis.speed for axis in axes)
    if edges > MAX_EDGES_PER_S:
        raise InvalidInput(
            f"at full speed the three encoders bring {edges:,} edges/s, and a node can count {MAX_EDGES_PER_S:,}",
            hint="lower the speeds or counts_per_turn in the [drive] section of the display file",
        )
    return extrude, bias, translate


def _axis_limits(name: str, axis: AxisDrive) -> AxisLimits:
    speed, acceleration = axis.speed * axis.counts_per_unit, axis.acceleration * axis.counts_per_unit
    if not all(LEAST_RATE <= rate < MOST_RATE + 1 for rate in (speed, acceleration)):
        raise InvalidInput(
            f"the {name} axis would move at {speed:.6g} counts/s and {acceleration:.6g} counts/s^2; "
            f"nodes can be told {LEAST_RATE} to {MOST_RATE}",
            hint="correct the [drive] section of the display file",
        )
    low, high = axis.low * axis.counts_per_unit, axis.high * axis.counts_per_unit
    if not (low <= POSITION_LIMIT and high >= -POSITION_LIMIT):
        raise InvalidInput(
            f"the {name} axis would stay between {axis.low:g} and {axis.high:g}, where no node can tell its position",
            hint="correct the [limits] section of the display file",
        )
    ends = round(max(low, -POSITION_LIMIT)), round(min(high, POSITION_LIMIT))
    return AxisLimits(*ends, int(speed), int(acceleration))


def config_hash(axes: Axes) -> int:
    """16 bits that differ when host and node disagree about limits."""
    packed = b"".join(struct.pack("<4q", axis.low, axis.high, axis.speed, axis.acceleration) for axis in axes)
    return int.from_bytes(blake2s(packed, digest_size=2).digest(), "little")


def outside(axes: Axes, target: Counts) -> int:
    """Number (from 1) of the first axis that `target` would take out of its limits, 0 if none."""
    for number, (axis, counts) in enumerate(zip(axes, target, strict=True), start=1):
        if not axis.low <= counts <= axis.high:
            return number
    return 0


@dataclass(frozen=True, slots=True)
class NodeMove:
    """A way from `start` to `target` in `duration_ms`; `brake_ms` is when it is broken off, if it is."""

    start: Counts
    target: Counts
    duration_ms: int
    ramp_ms: int
    brake_ms: int | None = None

    @property
    def length(self) -> int:
        """Path length in the units of `travelled`."""
        return 2 * self.ramp_ms * (self.duration_ms - self.ramp_ms)

    @property
    def end_ms(self) -> int:
        """When the axes stand still again, in ms from the start of the move."""
        if self.brake_ms is None:
            return self.duration_ms
        return self.brake_ms + self._speed(self.brake_ms)

    def braked(self, at_ms: int) -> NodeMove:
        """This move, slowed down from `at_ms` on at the rate of its own ramp; past the cruise that changes nothing."""
        if self.brake_ms is not None:
            return self
        return replace(self, brake_ms=min(max(at_ms, 0), self.duration_ms))

    def travelled(self, at_ms: int) -> int:
        """How far along the path the set-point is: twice the integral of speed, which rises by 1 per ms."""
        at_ms = min(max(at_ms, 0), self.duration_ms)
        if self.brake_ms is None or at_ms <= self.brake_ms:
            return self._unbraked(at_ms)
        speed = self._speed(self.brake_ms)
        braking = min(at_ms - self.brake_ms, speed)
        return self._unbraked(self.brake_ms) + 2 * speed * braking - braking * braking

    def at(self, at_ms: int) -> Counts:
        """Set-points `at_ms` after the start [counts]."""
        return self.axis_at(0, at_ms), self.axis_at(1, at_ms), self.axis_at(2, at_ms)

    def axis_at(self, index: int, at_ms: int) -> int:
        """Set-point of one axis (from 0) `at_ms` after the start [counts], rounded half away from the start."""
        length = self.length
        distance = self.target[index] - self.start[index]
        part = (2 * abs(distance) * self.travelled(at_ms) + length) // (2 * length)
        return self.start[index] + (part if distance > 0 else -part)

    def _speed(self, at_ms: int) -> int:
        return min(at_ms, self.ramp_ms, self.duration_ms - at_ms)

    def _unbraked(self, at_ms: int) -> int:
        if at_ms <= self.ramp_ms:
            return at_ms * at_ms
        if at_ms <= self.duration_ms - self.ramp_ms:
            return self.ramp_ms * (2 * at_ms - self.ramp_ms)
        return self.length - (self.duration_ms - at_ms) ** 2


def plan_move(start: Counts, target: Counts, axes: Axes, least_ms: int) -> NodeMove:
    """The quickest move within the limits of all axes, stretched at cruise speed to last `least_ms` at least.

    Peak speed of an axis is distance / (duration - ramp) and its acceleration distance / (ramp (duration - ramp)).
    """
    spread, product = 1, 1
    for begin, end, axis in zip(start, target, axes, strict=True):
        distance = abs(end - begin)
        spread = max(spread, _ceil_div(1000 * distance, axis.speed))
        product = max(product, _ceil_div(1_000_000 * distance, axis.acceleration))
    if spread * spread < product:
        spread = isqrt(product - 1) + 1
    ramp = _ceil_div(product, spread)
    return NodeMove(start, target, max(spread + ramp, least_ms), ramp)


def rest_ms(move: NodeMove) -> int:
    """Share of a braked move's duration that is still to be done [ms], rounded up."""
    return _ceil_div(move.duration_ms * (move.length - move.travelled(move.end_ms)), move.length)


def _ceil_div(number: int, divisor: int) -> int:
    return -(-number // divisor)
