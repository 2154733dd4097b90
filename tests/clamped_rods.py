"""Rods between clamps for tests: made from what a paper gives of them, changed by name, given a section."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from curveline.rod.clamped_rod import ClampedRod, DeadLoad
from curveline.rod.problem import Bearing, Pose
from curveline.rod.section import Section

PLACES = {"start": "start", "end": "end", "length": "length"}
HOLDS = {"clamp": "clamp", "stiffness": "stiffness", "weight": "weight", "natural_curvature": "natural"}


@dataclass(frozen=True)
class Stock:
    """What rods are made of: all that their section gives them beside EI in the plane."""

    stretching_stiffness: float  # EA [N]
    thickness: float  # [m]
    gyration: float  # [m]
    weight: float  # [N/m]
    lateral_stiffness: float  # [N m^2]
    twisting_stiffness: float  # [N m^2]

    @property
    def section(self) -> Section:
        """The part of it that is called a section."""
        return Section(self.stretching_stiffness, self.thickness, self.gyration, self.weight)


def rod_between(
    chord: tuple[float, float],
    start: float,
    end: float,
    length: float,
    clamp: float,
    stiffness: float,
    weight: float,
    natural_curvature: float = 0.0,
    loads: Iterable[tuple[float, ...]] = (),
) -> ClampedRod:
    """A rod that is no more than a line and cannot leave its plane; `loads` are (fraction of the length, forces)."""
    pose = Pose(*map(float, (*chord, start, end, length)))
    bearing = Bearing(*map(float, (clamp, stiffness, weight, natural_curvature)))
    return ClampedRod(pose, bearing, dead(loads))


def dead(loads: Iterable[tuple[float, ...]]) -> tuple[DeadLoad, ...]:
    """Loads from (fraction of the length, forces)."""
    return tuple(DeadLoad(*map(float, load)) for load in loads)


def changed(rod: ClampedRod, **changes: Any) -> ClampedRod:
    """A rod with other values of what `rod_between` takes, of its `stretching` stiffness or of any field."""
    if "chord" in changes:
        x, y = map(float, changes.pop("chord"))
        rod = replace(rod, pose=rod.pose._replace(x=x, y=y))
    rod = replace(
        rod,
        pose=rod.pose._replace(**{PLACES[key]: float(changes.pop(key)) for key in PLACES if key in changes}),
        bearing=rod.bearing._replace(**{HOLDS[key]: float(changes.pop(key)) for key in HOLDS if key in changes}),
    )
    if "stretching" in changes:
        compliance = rod.stiffness / float(changes.pop("stretching"))
        rod = replace(rod, bearing=rod.bearing._replace(compliance=compliance))
    if "loads" in changes:
        changes["loads"] = dead(changes["loads"])
    return replace(rod, **changes)


def made_of(stock: Stock, rod: ClampedRod, **changes: Any) -> ClampedRod:
    """A rod with the section of a stock, which may leave its plane, and with other values as for `changed`."""
    bearing = rod.bearing._replace(lateral=float(stock.lateral_stiffness), twisting=float(stock.twisting_stiffness))
    return changed(replace(rod, section=stock.section, bearing=bearing), **changes)
