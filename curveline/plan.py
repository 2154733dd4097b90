"""Plans: the steps that bring a display into a shape, as data that is read without numpy.

A plan file is the contract between the workstation that plans and the small computer that sends. Lengths are in mm,
angles in degrees, and the motor targets are absolute encoder counts from home.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from curveline.errors import InvalidInput
from curveline.scene import Axis, Display
from curveline.units import to_deg, to_mm

FORMAT = 1
AXES = ("extrude", "bias", "translate")
"""The order of a node's axes wherever they stand in a row: counts, frames, tables."""


@dataclass(frozen=True)
class AxisDrive:
    """How an axis moves: counts per mm or degree, and its speed and acceleration limits in those units."""

    counts_per_unit: float
    speed: float
    acceleration: float
    low: float
    high: float

    def counts(self, value: float) -> int:
        """Nearest encoder count to a position in mm or degrees."""
        return round(value * self.counts_per_unit)

    def value(self, counts: int) -> float:
        """Position in mm or degrees of an encoder count."""
        return counts / self.counts_per_unit


@dataclass(frozen=True)
class DriveTable:
    """Everything the sender must know of a display: axes in the order of `AXES`, radio settings, addresses."""

    display: str
    digest: str
    axes: tuple[AxisDrive, AxisDrive, AxisDrive]
    channel: int
    data_rate: str
    addresses: tuple[str, ...]

    @property
    def node_count(self) -> int:
        """Number of nodes of the display."""
        return len(self.addresses)


@dataclass(frozen=True)
class NodeTarget:
    """Where a node's three axes go: rod fed to the right since home, tangent angle, pivot height."""

    extrude_mm: float
    bias_deg: float
    translate_mm: float
    counts: tuple[int, int, int]


@dataclass(frozen=True)
class Step:
    """One barrier-to-barrier move of all nodes, and what the rod does during it.

    `states` lists the states the rod can be in after the step (one name per segment, alternatives joined by `|`);
    `lowest_eigenvalue` is the smallest along the step, in units of EI/L^2; `margin` is what `margin_of` says.
    """

    number: int
    action: str
    seconds: float
    targets: tuple[NodeTarget, ...]
    lengths_mm: tuple[float, ...]
    states: tuple[str, ...]
    lowest_eigenvalue: float
    margin: float
    margin_of: str
    max_strain: float
    max_force_N: float
    max_moment_Nmm: float


@dataclass(frozen=True)
class Plan:
    """Steps from `start` to a wanted shape."""

    name: str
    drive: DriveTable
    start: tuple[NodeTarget, ...]
    steps: tuple[Step, ...]
    wanted: tuple[str, ...]
    lengths_mm: tuple[float, ...]
    provenance: Mapping[str, Any] = field(default_factory=dict)

    @property
    def seconds(self) -> float:
        """Expected time of all steps together, without the radio's share."""
        return math.fsum(step.seconds for step in self.steps)


def drive_table(display: Display) -> DriveTable:
    """What the sender must know of `display`, in mm and degrees."""
    drive, limits, rod = display.drive, display.limits, display.rod
    feed = to_mm(rod.total_length)
    return DriveTable(
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
