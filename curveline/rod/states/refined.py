"""Kernel that refines an equilibrium and brings it into SI, with what there is to say of its curve as a whole."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.kernels.forms import Matrix, Vector
from curveline.kernels.kernel import leaf, njit, shipped
from curveline.rod.geometry.crossings import clearance, crosses_itself, crosses_tails
from curveline.rod.geometry.hermite import integral
from curveline.rod.geometry.vertex_table import ANGLE, CURVATURE, STRAIN_SLOPE, X, Y
from curveline.rod.planar.richardson import (
    ACROSS,
    FIRST_BEND,
    LAST_BEND,
    LOAD_POTENTIAL,
    SCALARS,
    STRAIN_ENERGY,
    UP,
    climb_levels,
)
from curveline.rod.problem import Bearing, Pose, ScaledRod
from curveline.rod.profile import expanded, interval_at, turned_between

MOST_EDGES = 50_000
TAIL = 0.2
"""Length of the straight tails behind the clamps, as a fraction of the chord, that a curve must not cross."""

NEUTRAL = 1e-6
"""Lowest eigenvalue in EI/L^2 that rounding cannot tell from none: that of a loop which slides along a taut rod."""
SAME_CURVE = 1e-5
"""Curves that are nearer to each other than this part of the length, beside their errors, are one: the next ones that a
search tells apart, at its coarsest, are a hundred times as far away."""
CLEARLY = 0.01
"""Difference of mean heights over the length that no error in these explains: they are sums over 48 edges or more."""

LEVEL = 1e-6
"""Mean height over the length, beside its error, that does not tell one side of a rod from the other: what a change of
a billionth in any number of a scene makes of it, a hundred times over, and more near a fold."""

ERROR, UNSTABLE, ITERATIONS, FINEST = range(SCALARS, SCALARS + 4)
"""The numbers of a refined equilibrium, after those of `richardson`: the error [m], unstable directions (-1 if it was
lost), Newton iterations, the finest level's edges."""
ENERGY, HEIGHT, CROSSES, WRAPS, CLEARANCE, SHARPEST, SPREAD = range(SCALARS + 4, SCALARS + 11)
"""Further: energy [J], mean height over the chord [m], whether it crosses itself and its tails, its clearance [m], its
largest curvature away from the natural one [1/m], how far its directions differ [rad]."""
LEFT_X, LEFT_Y, RIGHT_X, RIGHT_Y, LEFT_MOMENT, RIGHT_MOMENT = range(SCALARS + 11, SCALARS + 17)
"""Further: forces [N] and moments [N m] of the clamps on the rod."""
NUMBERS = SCALARS + 17


class Placement(NamedTuple):
    """What a curve has in SI, where its left pivot is the origin.

    The free length, its natural curvature [1/m], stiffness EI [N m^2], weight [N], the sum of its loads [N], how far it
    turns from clamp to clamp [rad], but for what its `profile (k, 3)` turns by; the straight tails behind the clamps, a
    clamp's length, and the right pivot [m]; where of the profile's material the free rod begins [m].
    """

    length: float
    natural: float
    stiffness: float
    weight: float
    push: float
    lift: float
    turn: float
    tail: float
    clamp: float
    chord_x: float
    chord_y: float
    profile: Matrix
    begin: float


@shipped(Pose, Bearing, Matrix, int)
def placement_of(pose, bearing, forces, winding):
    """The `Placement` of a rod that bears dead loads `forces (m, 2)` [N], with so many further turns."""
    length = pose.length - bearing.clamp
    begin = pose.begin + 0.5 * bearing.clamp
    push = lift = 0.0
    for i in range(forces.shape[0]):
        push += forces[i, 0]
        lift += forces[i, 1]
    return Placement(
        length,
        bearing.natural,
        bearing.stiffness,
        bearing.weight * length,
        push,
        lift,
        pose.end - pose.start + 2.0 * np.pi * winding - turned_between(bearing.profile, begin, begin + length),
        bearing.clamp + TAIL * np.hypot(pose.x, pose.y),
        bearing.clamp,
        pose.x,
        pose.y,
        bearing.profile,
        begin,
    )


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


@leaf
def _sharpest(table, edges, placement):
    """Largest curvature away from the natural one [1/m], of vertices in units of the length and `edges (m,)` [m]."""
    profile, place, row, sharpest = placement.profile, placement.begin, 0, 0.0
    for j in range(table.shape[0]):
        own = placement.natural
        if profile.shape[0] > 0:
            row = interval_at(profile, place, row)
            own += expanded(profile, row, place)[0]
        sharpest = max(sharpest, abs(table[j, CURVATURE] / placement.length - own))
        place += edges[j] if j < edges.size else 0.0
    return sharpest


@njit
def in_metres(table, edges, placement, numbers):
    """Bring a `table (m+1, 6)` in units of the free length into SI, and look at the curve as a whole.

    The `edges (m,)` lie between its vertices [m]; what there is to say goes to the `numbers`.
    """
    inverse = 1.0 / placement.length
    half = 0.5 * placement.clamp
    start_x, start_y = half * np.cos(table[0, ANGLE]), half * np.sin(table[0, ANGLE])
    sharpest = _sharpest(table, edges, placement)
    least, most = table[0, ANGLE], table[0, ANGLE]
    for j in range(table.shape[0]):
        table[j, X] = table[j, X] * placement.length + start_x
        table[j, Y] = table[j, Y] * placement.length + start_y
        table[j, CURVATURE] *= inverse
        table[j, STRAIN_SLOPE] *= inverse
        least, most = min(least, table[j, ANGLE]), max(most, table[j, ANGLE])
    area = _area_under(table, edges, (placement.chord_x, placement.chord_y))
    numbers[HEIGHT] = area / (max(np.hypot(placement.chord_x, placement.chord_y), 1e-300) * placement.length)
    numbers[CROSSES] = 1.0 if crosses_itself(table) else 0.0
    numbers[WRAPS] = 1.0 if crosses_tails(table, placement.tail) else 0.0
    numbers[CLEARANCE] = clearance(table)
    numbers[SHARPEST] = sharpest
    numbers[SPREAD] = most - least


@leaf
def wrench(placement, numbers):
    """Fill in energy, forces and moments from the scalars of the extrapolation.

    The multipliers are the end's force, reversed; the energy is that of bending about the natural curvature, and the
    potential of weight and loads.
    """
    length, natural, stiffness = placement.length, placement.natural, placement.stiffness
    unit = stiffness / length**2
    across, up = -numbers[ACROSS] * unit, -numbers[UP] * unit
    numbers[LEFT_X], numbers[LEFT_Y] = -placement.push - across, placement.weight - placement.lift - up
    numbers[RIGHT_X], numbers[RIGHT_Y] = across, up
    numbers[LEFT_MOMENT] = -stiffness * (numbers[FIRST_BEND] / length - natural)
    numbers[RIGHT_MOMENT] = stiffness * (numbers[LAST_BEND] / length - natural)
    numbers[ENERGY] = (numbers[STRAIN_ENERGY] + numbers[LOAD_POTENTIAL]) * stiffness / length
    numbers[ENERGY] += stiffness * natural * (0.5 * natural * length - placement.turn)


@shipped(ScaledRod, tuple[Vector, Vector, Vector], Placement, float, int)
def refined(rod, coarse, placement, tolerance, most_edges):
    """Refine a `coarse` equilibrium, edges and angles (n,) and multipliers (2,), until its error is below `tolerance`.

    In metres; `most_edges` end that, too. Returns vertices (m+1, 6) and the edges (m,) between them in SI, and what
    there is to say of it, (`NUMBERS`,). Overwrites angles and multipliers.
    """
    edges, phi, multipliers = coarse
    table, scalars, places, estimate, unstable, iterations, finest = climb_levels(
        rod, edges, phi, multipliers, tolerance / placement.length, most_edges
    )
    numbers = np.empty(NUMBERS)
    for i in range(SCALARS):
        numbers[i] = scalars[i]
    numbers[ERROR], numbers[UNSTABLE] = estimate * placement.length, unstable
    numbers[ITERATIONS], numbers[FINEST] = iterations, finest
    places = places * placement.length
    in_metres(table, places, placement, numbers)
    wrench(placement, numbers)
    return table, places, numbers
