"""What must be known of a display to drive it, read without numpy: its axes in mm and degrees, its radio, its nodes."""

from __future__ import annotations

import math
from dataclasses import dataclass

from curveline.errors import InvalidInput
from curveline.scene import Axis, Display
from curveline.units import to_deg, to_mm

NODE_HZ = 48_000_000
"""Clock of a node's processor."""
EDGE_CYCLES = 139
"""Cycles that an encoder edge takes of it."""
MAX_EDGES_PER_S = NODE_HZ // EDGE_CYCLES // 3
"""Encoder edges of all axes together that a node can count.

They take a third of its processor. The rest is for control, frames and flash that is slower than the processor. Even if
all are edges of one encoder, each early or late by up to a quarter of their distance, no two come within one interrupt.
"""
LEAST_RATE = 1e-15
"""Counts per unit, speeds and accelerations below this are none: nothing may overflow that is divided by them."""
DATA_RATES = ("250kbps", "1Mbps", "2Mbps")
ADDRESS = r"^[0-9A-Fa-f]{10}$"
MAX_CHANNEL = 125
MAX_NODES = 128
DEFAULT_DISPLAY = "single"
"""The built-in display that commands take if none is named."""
AXES = ("extrude", "bias", "translate")
"""The order of a node's axes wherever they stand in a row: counts, frames, tables."""
UNITS = ("mm", "deg", "mm")
"""Of `AXES`, as people read them."""


@dataclass(frozen=True)
class AxisDrive:
    """How an axis moves: counts per mm or degree, and its speed and acceleration limits in those units."""

    counts_per_unit: float  # encoder counts per mm or degree
    speed: float  # mm or degrees per s
    acceleration: float  # mm or degrees per s^2
    low: float  # mm or degrees from home
    high: float  # mm or degrees from home

    def counts(self, value: float) -> int:
        """Nearest encoder count to a position in mm or degrees."""
        return round(value * self.counts_per_unit)

    def value(self, counts: int) -> float:
        """Position in mm or degrees of an encoder count."""
        return counts / self.counts_per_unit

    def seconds(self, distance: float) -> float:
        """Shortest time for a move over `distance`, from rest to rest, at limited speed and acceleration."""
        way = abs(distance)
        if way * self.acceleration > self.speed**2:
            return way / self.speed + self.speed / self.acceleration
        return 2.0 * math.sqrt(way / self.acceleration)


@dataclass(frozen=True)
class DriveSettings:
    """Everything the sender must know of a display: axes in the order of `AXES`, radio settings, addresses."""

    display: str  # by name
    digest: str  # of the display file
    axes: tuple[AxisDrive, AxisDrive, AxisDrive]  # extrude, bias, translate
    channel: int  # of the radio
    data_rate: str  # such as 1Mbps
    addresses: tuple[str, ...]  # left to right

    @property
    def node_count(self) -> int:
        """Number of nodes of the display."""
        return len(self.addresses)

    def check_node(self, number: int) -> None:
        """InvalidInput unless the display has a node with this number (from 1)."""
        if not 1 <= number <= self.node_count:
            raise InvalidInput(f"there is no node {number}: display {self.display!r} has nodes 1 to {self.node_count}")


def drive_settings(display: Display) -> DriveSettings:
    """What the sender must know of `display`, in mm and degrees."""
    drive, limits, rod = display.drive, display.limits, display.rod
    feed = to_mm(rod.total_length)
    return DriveSettings(
        display=display.name,
        digest=display.digest,
        axes=(
            _axis_drive(drive.extrude, to_mm(1.0), -feed, feed),
            _axis_drive(drive.bias, to_deg(1.0), to_deg(limits.angle.low), to_deg(limits.angle.high)),
            _axis_drive(drive.translate, to_mm(1.0), to_mm(limits.height.low), to_mm(limits.height.high)),
        ),
        channel=display.radio.channel,
        data_rate=display.radio.data_rate,
        addresses=display.radio.addresses,
    )


def _axis_drive(axis: Axis, unit: float, low: float, high: float) -> AxisDrive:
    """`axis` in a unit of which one SI unit holds `unit`."""
    return AxisDrive(axis.counts_per_unit / unit, axis.speed * unit, axis.acceleration * unit, low, high)
