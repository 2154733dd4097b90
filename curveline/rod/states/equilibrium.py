"""Solve a clamped rod to equilibrium and refine it to a tolerance; what comes out is data, also when it fails."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, NamedTuple

import numpy as np

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.geometry.space_curve import SpaceCurve
from curveline.rod.geometry.vertex_table import ANGLE
from curveline.rod.planar.richardson import EIGENVALUE, interpolate
from curveline.rod.problem import Array
from curveline.rod.states.refined import (
    CLEARANCE,
    CROSSES,
    ENERGY,
    ERROR,
    FINEST,
    HEIGHT,
    ITERATIONS,
    LEFT_MOMENT,
    LEFT_X,
    MOST_EDGES,
    NEUTRAL,
    RIGHT_MOMENT,
    RIGHT_Y,
    SHARPEST,
    TAIL,
    UNSTABLE,
    WRAPS,
    placement_of,
    refined,
)

PLANAR = "planar"
EXTENSIBLE = "extensible"
SPATIAL = "spatial"
"""Names of the models, each contained in the next."""


class Disturbed(NamedTuple):
    """How a planar state answers to what its model leaves out, NaN for what nobody asked.

    A curve moves by inf where the state is lost then.
    """

    coarse_lateral: float  # lowest eigenvalue out of the plane [EI/L^2], on every other vertex of the curve
    fine_lateral: float  # the same on all vertices
    stretched: float  # [m], how far the curve moves where the rod may stretch
    weighed: float  # [m], how far it moves under the rod's weight
    spread: float  # [rad], how much the curve's directions differ


class Outcome(Enum):
    """How a solve ended; the value is the sentence shown to the user."""

    CONVERGED = "converged to the tolerance"
    COARSE = "the tolerance was not reached with the most vertices allowed: ask for a larger tolerance"
    LOST = "the state exists only on a coarse rod: it lies at a fold; change length or angles a little"
    UNREACHED = "no equilibrium in space was reached from the plane: ask for less roll, yaw or load out of the plane"
    UNWOUND = "on its way the rod would pass through itself: ask for less roll, yaw or load out of the plane"
    UNSTABLE = "an equilibrium, but not a stable one: the rod leaves it"
    BUCKLES = "stable in its plane, but not in space: the spatial model shows where the rod buckles to"


@dataclass(frozen=True)
class Equilibrium:
    """A state of a segment, in SI, in the frame of its left pivot.

    `vertices_table (m+1, 6)` holds position [m], tangent angle [rad], curvature [1/m], axial strain and its slope [1/m]
    at the ends of the unstretched `edges (m,)` [m] of the free rod; `vertices` counts those of the finest rod it was
    extrapolated from. Forces and moments are those of the clamps on the rod, where the free rod begins and ends. In the
    spatial model all this is seen from the front; `space` holds the curve itself, and the state `leaves_plane` if its
    planar one is unstable against that. It is `disturbed` by what its model leaves out as far as that was asked.
    """

    name: str  # such as peak or valley
    outcome: Outcome  # how the computation ended
    stable: bool  # whether it comes back when it is pushed a little
    wanted: bool  # whether the shape asks for it
    energy: float  # [J], bending, weight and loads; heights are counted from where the free rod begins
    error: float  # [m], estimated largest error of the curve
    vertices: int
    iterations: int  # of Newton's method
    lowest_eigenvalue: float  # of the second variation, in EI/L^2 of the free rod
    winding: int  # further full turns from clamp to clamp, counter-clockwise
    crosses_itself: bool  # whether the curve does
    wraps_clamp: bool  # whether it crosses a tail behind a clamp
    clearance: float  # [m] between parts of the curve that are not neighbours
    mean_height: float  # [m] over the chord
    clamp_force: Array  # (2, 2) [N]
    clamp_moment: Array  # (2,) [N m]
    max_curvature: float  # [1/m], away from the natural one
    vertices_table: Array = field(repr=False)
    edges: Array = field(repr=False)
    rod: ClampedRod = field(repr=False)  # the segment whose state it is
    model: str = PLANAR  # the one that was used
    leaves_plane: bool = False
    space: SpaceCurve | None = field(default=None, repr=False)
    disturbed: Disturbed | None = field(default=None, repr=False)

    def but(self, **changes: Any) -> Equilibrium:
        """The state with other values of some fields; one of another rod is no longer known to be disturbed.

        As `dataclasses.replace`, in a tenth of its time.
        """
        if "rod" in changes:
            changes.setdefault("disturbed", None)
        other = object.__new__(Equilibrium)
        other.__dict__.update(self.__dict__, **changes)
        return other

    @property
    def angles(self) -> Array:
        """Tangent angles (m+1,) [rad] at the vertices."""
        column: Array = self.vertices_table[:, ANGLE]
        return column

    @property
    def multipliers(self) -> Array:
        """Those of the planar rod in units of its length and EI, (2,): the force of the last clamp, reversed."""
        return -self.clamp_force[1] * (self.rod.free_length**2 / self.rod.stiffness)

    @property
    def simple(self) -> bool:
        """True if a planar display can show this state."""
        return self.is_untangled and not self.leaves_plane

    @property
    def is_untangled(self) -> bool:
        """True if the curve has no further turns and crosses neither itself nor the tails behind the clamps."""
        return self.winding == 0 and not self.crosses_itself and not self.wraps_clamp

    def start_on(self, edges: Array) -> tuple[Array, Array]:
        """Angles (n,) and multipliers (2,) from which Newton finds the state again on `edges (n,)` that sum to 1."""
        places = np.concatenate([[0.0], np.cumsum(self.edges)])
        middles = (np.cumsum(edges) - 0.5 * edges) * places[-1]
        return np.interp(middles, places, self.angles), self.multipliers

    def curve(self, points: int) -> Array:
        """`points` positions (points, 2) [m] in the plane, equally spaced in arc length from pivot to pivot."""
        if self.space is not None:
            return self.space.positions(points)[:, :2]
        rod = self.rod
        half = 0.5 * rod.clamp
        places = np.linspace(0.0, rod.length, points)
        out = np.empty((points, 2))
        interpolate(self.vertices_table, self.edges, places - half, out)
        start, end = self.angles[0], self.angles[-1]
        before = places < half
        out[before] = places[before, None] * [math.cos(start), math.sin(start)]
        after = places > rod.length - half
        back = (rod.length - places[after, None]) * [math.cos(end), math.sin(end)]
        out[after] = np.array(rod.chord) - back
        return out

    def depth(self, points: int) -> Array:
        """How far the positions of `curve` lie in front of the display's plane, (points,) [m]."""
        return np.zeros(points) if self.space is None else self.space.positions(points)[:, 2]


def refine(rod: ClampedRod, edges: Array, phi: Array, multipliers: Array, tolerance: float) -> Equilibrium:
    """Refine a coarse equilibrium, angles `phi (n,)` on `edges (n,)` and `multipliers (2,)`, to `tolerance` [m].

    Never raises for numerical reasons: see `Outcome`.
    """
    placement = placement_of(rod.pose, rod.bearing, rod.dead_loads()[1], rod.winding)
    table, places, facts = refined(rod.scaled(), (edges, phi, multipliers), placement, tolerance, MOST_EDGES)
    return equilibrium_of(rod, table, places, facts, tolerance)


def equilibrium_of(rod: ClampedRod, table: Array, places: Array, facts: Array, tolerance: float) -> Equilibrium:
    """The state that was refined to `tolerance` [m]: see `refined.refined` for the other three."""
    numbers: list[float] = facts.tolist()
    eigenvalue, unstable, error = numbers[EIGENVALUE], int(numbers[UNSTABLE]), numbers[ERROR]
    # Near a pitchfork the edges have lost a stability that their limit has, or have one that it has not.
    stable = unstable in (0, 1) and eigenvalue > NEUTRAL
    state: Equilibrium = object.__new__(Equilibrium)
    # As by its constructor, in a tenth of its time.
    state.__dict__.update(
        name="",
        outcome=_outcome(unstable, stable=stable, reached=error <= tolerance),
        stable=stable,
        wanted=False,
        energy=numbers[ENERGY],
        error=error,
        vertices=int(numbers[FINEST]) + 1,
        iterations=int(numbers[ITERATIONS]),
        lowest_eigenvalue=eigenvalue,
        winding=rod.winding,
        crosses_itself=numbers[CROSSES] > 0.0,
        wraps_clamp=numbers[WRAPS] > 0.0,
        clearance=numbers[CLEARANCE],
        mean_height=numbers[HEIGHT],
        clamp_force=facts[LEFT_X : RIGHT_Y + 1].reshape(2, 2),
        clamp_moment=facts[LEFT_MOMENT : RIGHT_MOMENT + 1],
        max_curvature=numbers[SHARPEST],
        vertices_table=table,
        edges=places,
        rod=rod,
        model=EXTENSIBLE if rod.is_extensible else PLANAR,
        leaves_plane=False,
        space=None,
        disturbed=None,
    )
    return state


def tail_of(rod: ClampedRod) -> float:
    """Length of the straight rod behind either end of the free rod that a curve must not cross [m]."""
    return rod.clamp + TAIL * math.hypot(*rod.chord)


def _outcome(unstable: int, *, stable: bool, reached: bool) -> Outcome:
    """How a refinement ended; `unstable` is negative where the equilibrium was lost."""
    if unstable < 0:
        return Outcome.LOST
    if not stable:
        return Outcome.UNSTABLE
    return Outcome.CONVERGED if reached else Outcome.COARSE
