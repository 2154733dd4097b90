"""One move of the nodes of a segment: the rod is followed, and what it asks is weighed against the display's limits."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from curveline.rod.continuation import coarse_start, follow
from curveline.rod.equilibrium import Equilibrium
from curveline.rod.problem import Array
from curveline.rod.states import find_states
from curveline.rod.way import straight
from curveline.scene import Display, Node
from curveline.simulation import DEFAULT_TOLERANCE, clamped_rod
from curveline.units import to_deg, to_mm, to_nmm

STIFFEST = 4.0 * math.pi**2
"""Lowest eigenvalue of a straight clamped rod without load, in EI/L^2: the unit of stability margins."""

LEAST_STABILITY = 0.05
"""A followed state must keep this fraction of `STIFFEST`."""


@dataclass(frozen=True)
class Waypoint:
    """Where a step ends: what it is called, the two nodes, and the rod between their pivots."""

    action: str
    nodes: tuple[Node, Node]
    length: float  # [m]


@dataclass(frozen=True)
class Strain:
    """The most that a move asks of rod and motors."""

    curvature: float = 0.0  # [1/m]
    axial: float = 0.0  # [N] along the rod, at a node
    vertical: float = 0.0  # [N] on a node
    moment: float = 0.0  # [N m] about a pivot

    def worst(self, other: Strain) -> Strain:
        """The larger of each."""
        return Strain(
            max(self.curvature, other.curvature),
            max(self.axial, other.axial),
            max(self.vertical, other.vertical),
            max(self.moment, other.moment),
        )

    @property
    def force(self) -> float:
        """Largest force that a motor must give [N]."""
        return max(self.axial, self.vertical)


@dataclass(frozen=True)
class Passage:
    """A state followed along a move: how far, at what eigenvalue and strain; `angles`, `forces` restart it there."""

    reached: float
    lowest_eigenvalue: float
    strain: Strain
    angles: Array
    forces: Array


def states_at(display: Display, at: Waypoint) -> list[Equilibrium]:
    """The states that the display can show at a waypoint."""
    found = find_states(clamped_rod(display, at.nodes, at.length), DEFAULT_TOLERANCE)
    return [state for state in found if state.simple]


def pass_along(display: Display, before: Waypoint, after: Waypoint, start: tuple[Array, Array]) -> Passage:
    """Follow the state `start` (angles and multipliers) on the straight path from one waypoint to the next."""
    begin = clamped_rod(display, before.nodes, before.length)
    end = clamped_rod(display, after.nodes, after.length)
    branch = follow(straight(begin.pose, end.pose), begin.bearing, *start)
    if branch.samples.shape[0] == 0:
        return Passage(0.0, 0.0, Strain(), branch.phi, branch.multipliers)
    most = abs(branch.samples).max(axis=0)
    strain = Strain(float(most[2]), *(float(max(most[k], most[k + 3])) for k in (3, 4, 5)))
    return Passage(branch.reached, float(branch.samples[:, 1].min()), strain, branch.phi, branch.multipliers)


def start_of(state: Equilibrium) -> tuple[Array, Array]:
    """Where `pass_along` starts from a state."""
    return coarse_start(state)


def overload(display: Display, strain: Strain) -> str:
    """What a move asks beyond what rod and motors can give; empty if nothing."""
    rod, drive = display.rod, display.drive
    if strain.curvature > rod.max_curvature:
        return (
            f"the rod would bend to a radius of {to_mm(1.0 / strain.curvature):.0f} mm, "
            f"its strain allows {to_mm(1.0 / rod.max_curvature):.0f} mm"
        )
    if strain.axial > drive.max_force:
        return f"extruding takes {strain.axial:.1f} N, the motor gives {drive.max_force:.1f} N"
    if strain.vertical > drive.max_force:
        return f"holding the height takes {strain.vertical:.1f} N, the motor gives {drive.max_force:.1f} N"
    if strain.moment > drive.max_moment:
        return f"biasing takes {to_nmm(strain.moment):.0f} N mm, the motor gives {to_nmm(drive.max_moment):.0f} N mm"
    return ""


def utilisation(display: Display, strain: Strain) -> float:
    """The largest share of what rod or motors can give that a move asks for."""
    rod, drive = display.rod, display.drive
    return max(strain.curvature / rod.max_curvature, strain.force / drive.max_force, strain.moment / drive.max_moment)


def survey(display: Display, before: Waypoint, after: Waypoint, samples: int = 9) -> Strain:
    """The most that any state the display can show asks on the path, whichever of them the rod is in."""
    worst = Strain()
    for fraction in np.linspace(0.0, 1.0, samples):
        at = midway(before, after, float(fraction))
        for state in states_at(display, at):
            here = pass_along(display, at, at, start_of(state))
            worst = worst.worst(here.strain)
    return worst


def midway(before: Waypoint, after: Waypoint, fraction: float) -> Waypoint:
    """The waypoint on the straight path between two others."""

    def blend(first: float, second: float) -> float:
        return first + fraction * (second - first)

    left, right = (
        Node(blend(a.height, b.height), blend(a.angle, b.angle)) for a, b in zip(before.nodes, after.nodes, strict=True)
    )
    return Waypoint(after.action, (left, right), blend(before.length, after.length))


def describe(at: Waypoint) -> str:
    """A waypoint in words, for a refusal."""
    left, right = at.nodes
    return (
        f"length {to_mm(at.length):.1f} mm, angles {to_deg(left.angle):.1f} and {to_deg(right.angle):.1f} deg, "
        f"heights {to_mm(left.height):.1f} and {to_mm(right.height):.1f} mm"
    )
