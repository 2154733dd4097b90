"""Solve a clamped rod to equilibrium and refine it to a tolerance; what comes out is data, also when it fails."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np

from curveline.kernels.forms import Matrix, Vector
from curveline.kernels.kernel import njit, shipped
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.geometry.crossings import clearance, crosses_itself, crosses_tails
from curveline.rod.geometry.hermite import integral
from curveline.rod.geometry.space_curve import SpaceCurve
from curveline.rod.geometry.vertex_table import ANGLE, CURVATURE, STRAIN_SLOPE, X, Y
from curveline.rod.planar.richardson import (
    ACROSS,
    EIGENVALUE,
    FIRST_CURVATURE,
    LAST_CURVATURE,
    LOAD_POTENTIAL,
    STRAIN_ENERGY,
    UP,
    climb_levels,
    interpolate,
)
from curveline.rod.problem import Array

MOST_EDGES = 50_000
PLANAR = "planar"
EXTENSIBLE = "extensible"
SPATIAL = "spatial"
"""Names of the models, each contained in the next."""

NEUTRAL = 1e-6
"""Lowest eigenvalue in EI/L^2 that rounding cannot tell from none: that of a loop which slides along a taut rod."""
TAIL = 0.2
"""Length of the straight tails behind the clamps, as a fraction of the chord, that a curve must not cross."""


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
    planar one is unstable against that.
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

    def but(self, **changes: Any) -> Equilibrium:
        """The state with other values of some fields.

        As `dataclasses.replace`, in a tenth of its time: no field depends on another one.
        """
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
        before = places < half
        out[before] = places[before, None] * [math.cos(rod.start), math.sin(rod.start)]
        after = places > rod.length - half
        back = (rod.length - places[after, None]) * [math.cos(rod.end), math.sin(rod.end)]
        out[after] = np.array(rod.chord) - back
        return out

    def depth(self, points: int) -> Array:
        """How far the positions of `curve` lie in front of the display's plane, (points,) [m]."""
        return np.zeros(points) if self.space is None else self.space.positions(points)[:, 2]


def refine(rod: ClampedRod, edges: Array, phi: Array, multipliers: Array, tolerance: float) -> Equilibrium:
    """Refine a coarse equilibrium, angles `phi (n,)` on `edges (n,)` and `multipliers (2,)`, to `tolerance` [m].

    Never raises for numerical reasons: see `Outcome`.
    """
    length = rod.free_length
    table, levelled, places, estimate, unstable, iterations, finest = climb_levels(
        rod.scaled(), edges, phi, multipliers, tolerance / length, MOST_EDGES
    )
    scalars: list[float] = levelled.tolist()
    # A copy: a state that is lost has the edges it came with.
    places = places * length
    frame = (length, tail_of(rod), rod.natural_curvature)
    crosses, wraps, apart, area, sharpest = _in_metres(table, places, frame, rod.free_start, rod.chord)
    # Near a pitchfork the edges have lost a stability that their limit has, or have one that it has not.
    stable = unstable in (0, 1) and scalars[EIGENVALUE] > NEUTRAL
    force, moment = _clamp_wrench(rod, scalars)
    return Equilibrium(
        name="",
        outcome=_outcome(unstable, stable=stable, reached=estimate * length <= tolerance),
        stable=stable,
        wanted=False,
        energy=_energy(rod, scalars),
        error=float(estimate * length),
        vertices=finest + 1,
        iterations=iterations,
        lowest_eigenvalue=scalars[EIGENVALUE],
        winding=rod.winding,
        crosses_itself=crosses,
        wraps_clamp=wraps,
        clearance=apart,
        mean_height=area / max(math.hypot(*rod.chord), 1e-300) / length,
        clamp_force=force,
        clamp_moment=moment,
        max_curvature=sharpest,
        vertices_table=table,
        edges=places,
        rod=rod,
        model=EXTENSIBLE if rod.is_extensible else PLANAR,
    )


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


def _clamp_wrench(rod: ClampedRod, scalars: list[float]) -> tuple[Array, Array]:
    """Forces (2, 2) [N] and moments (2,) [N m] of the clamps on the rod; the multipliers are the end's, reversed."""
    length, natural = rod.free_length, rod.natural_curvature
    unit = rod.stiffness / length**2
    across, up = -scalars[ACROSS] * unit, -scalars[UP] * unit
    push, lift = math.fsum(load.x for load in rod.loads), math.fsum(load.y for load in rod.loads)
    first, last = (scalars[place] / length - natural for place in (FIRST_CURVATURE, LAST_CURVATURE))
    moments = [-rod.stiffness * first, rod.stiffness * last]
    return np.array([[-push - across, rod.weight * length - lift - up], [across, up]]), np.array(moments)


def _energy(rod: ClampedRod, scalars: list[float]) -> float:
    """Bending energy about the natural curvature plus the potential of weight and loads [J]."""
    length = rod.free_length
    natural = rod.natural_curvature
    energy = (scalars[STRAIN_ENERGY] + scalars[LOAD_POTENTIAL]) * rod.stiffness / length
    energy += rod.stiffness * natural * (0.5 * natural * length - rod.turn)
    return energy


@njit
def _area_under(table, edges, chord):
    """Integral over the arc length of the distance from the line along `chord`, times the chord's length [m^3].

    `table (m+1, 6)` holds the vertices between which the `edges (m,)` lie.
    """
    rows = np.empty((table.shape[0], 3))
    for j in range(table.shape[0]):
        x, y, angle, curvature, strain, gain = table[j]
        cosine, sine = np.cos(angle), np.sin(angle)
        along, across = chord[0] * cosine + chord[1] * sine, chord[0] * sine - chord[1] * cosine
        rows[j, 0] = chord[0] * y - chord[1] * x
        rows[j, 1] = (1.0 + strain) * across
        rows[j, 2] = gain * across + (1.0 + strain) * curvature * along
    return integral(rows, edges)


@shipped(Matrix, Vector, tuple[float, float, float], tuple[float, float], tuple[float, float])
def _in_metres(table, edges, frame, start, chord):
    """Bring a `table (m+1, 6)` in units of the free length into SI, and look at the curve as a whole.

    `frame` holds the free length and that of a tail [m], and the natural curvature [1/m]; `start` is where the free rod
    begins, `edges (m,)` lie between its vertices [m]. Returns whether it crosses itself and whether its tails, its
    clearance [m], the area under it, and its largest curvature [1/m] away from the natural one.
    """
    length, tail, natural = frame
    inverse = 1.0 / length
    sharpest = 0.0
    for j in range(table.shape[0]):
        table[j, X] = table[j, X] * length + start[0]
        table[j, Y] = table[j, Y] * length + start[1]
        table[j, CURVATURE] *= inverse
        table[j, STRAIN_SLOPE] *= inverse
        sharpest = max(sharpest, abs(table[j, CURVATURE] - natural))
    area = _area_under(table, edges, chord)
    return crosses_itself(table), crosses_tails(table, tail), clearance(table), area, sharpest
