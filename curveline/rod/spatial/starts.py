"""Curves from which descents lead to most states in space, and the shapes that these come to rest in."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from curveline.kernels.forms import Matrix, Stack
from curveline.kernels.kernel import njit, shipped
from curveline.rod.geometry.rotations import between, exponential, logarithm, multiply
from curveline.rod.spatial.descent import SETTLED, descent, is_known
from curveline.rod.spatial.energy import Shape, SpatialRod

OFF = 0.1
"""Turn of the first direction [rad] out of the plane: no start is as symmetric as the scene."""
BUMP = 2.5
"""Turn [rad] of a rod's middle about itself against its ends."""
LEAST_SLACK = 0.02
ITERATIONS = 80
"""Of a descent, at most."""
NEAR = 0.01
"""Half the square of half the turn of an edge [rad] within which frames are beside each other."""


class Sides(NamedTuple):
    """Towards which sides arches go: `number` of them in a `whole` angle about the chord [rad], with which `bumps`."""

    whole: float
    number: int
    bumps: tuple[float, ...]


ALL_SIDES = Sides(2.0 * math.pi, 6, (0.0, BUMP, -BUMP))
ONE_SIDE = Sides(math.pi, 3, (BUMP, -BUMP))
"""Of a flat segment, whose states come in twins, and whose arches in the plane are known."""


class Curve(NamedTuple):
    """A start: what tangents are turned by [rad] from the shortest way from clamp to clamp.

    An `arch` towards `direction` about the chord, counted from up to the viewer, and a `bump`, by which the middle is
    rolled against both ends: a strip's states often differ by the side that their middle turns up.
    """

    direction: float
    arch: float
    bump: float


def starts(rod: SpatialRod, sides: Sides) -> Iterator[Curve]:
    """Curves from which descents lead to most states."""
    slack = 2.0 * math.sqrt(max(1.0 - float(np.linalg.norm(rod.chord)), LEAST_SLACK))
    for side in range(sides.number):
        for bump in sides.bumps:
            yield Curve(OFF + sides.whole / sides.number * side, slack, bump)


@njit
def across_chord(chord):
    """Unit vectors across a chord (3,): up in the display's plane, and from there a quarter turn towards the viewer."""
    along = np.array([1.0, 0.0, 0.0])
    reach = np.sqrt(np.sum(chord**2))
    if np.hypot(chord[0], chord[1]) > 1e-9:
        along = chord / reach
    level = np.hypot(along[0], along[1])
    up = np.array([-along[1] / level, along[0] / level, 0.0])
    front = np.array([-along[2] * up[1], along[2] * up[0], level])
    return up, front


@njit
def started_frames(rod, roll, curve):
    """Frames (n, 4) of a start: those of the shortest way from clamp to clamp, twisted evenly, and turned."""
    n = rod.edges.size
    first, last, q, turn, product = rod.frames[0], np.empty(4), np.empty(4), np.empty(4), np.empty(4)
    way, vector, out = np.empty(3), np.zeros(3), np.empty((n, 4))
    vector[2] = -roll
    exponential(vector, turn)
    multiply(rod.frames[1], turn, last)
    between(first, last, q)
    logarithm(q, way)
    up, front = across_chord(rod.chord)
    c, s = np.cos(curve.direction), np.sin(curve.direction)
    at = 0.0
    for j in range(n):
        middle = at + 0.5 * rod.edges[j]
        at += rod.edges[j]
        for axis in range(3):
            vector[axis] = middle * way[axis]
        exponential(vector, turn)
        multiply(first, turn, q)
        vector[0] = vector[1] = 0.0
        vector[2] = middle * roll + curve.bump * np.sin(np.pi * middle)
        exponential(vector, turn)
        multiply(q, turn, product)
        # An arch towards a direction turns about what lies across it.
        bent = curve.arch * np.sin(2.0 * np.pi * middle)
        for axis in range(3):
            vector[axis] = bent * (c * front[axis] - s * up[axis])
        exponential(vector, turn)
        multiply(turn, product, out[j])
    return out


@shipped(SpatialRod, float, Matrix, Stack, int)
def descended(rod, roll, curves, known, iterations):
    """What the stable shapes have to which starts lead, and the work.

    Strains (k, n), frames (k, n, 4), turns (k, n+1, 4) and tilts (k, 2).

    Last are frames (p, n, 4) that descents have passed where little force was left over, in no shape's neighbourhood.
    `curves (m, 3)` are the starts, for clamps that are rolled by `roll` [rad] against each other; shapes are left out
    whose frames are those of one before or are `known (h, n, 4)`. All take no more than so many `iterations`.
    """
    n, before, count = rod.edges.size, known.shape[0], curves.shape[0]
    frames, strain, turns = np.empty((before + count, n, 4)), np.empty((count, n)), np.empty((count, n + 1, 4))
    passed, here, tilts = np.empty((count, n, 4)), np.empty((n, 4)), np.empty((count, 2))
    frames[:before] = known
    met, work, beside = 0, 0, 0
    for curve in curves:
        begun = started_frames(rod, roll, Curve(curve[0], curve[1], curve[2]))
        start = Shape(np.zeros(n), begun, np.empty((0, 4)), (0.0, 0.0))
        most = min(ITERATIONS, iterations - work)
        shape, ending, taken, _, has_passed = descent(rod, start, most, frames[: before + met], here)
        work += taken
        if ending == SETTLED:
            frames[before + met], strain[met], turns[met] = shape.frames, shape.strain, shape.turns
            tilts[met, 0], tilts[met, 1] = shape.tilts
            met += 1
        if has_passed and not (is_known(here, frames[: before + met], NEAR) or is_known(here, passed[:beside], NEAR)):
            passed[beside] = here
            beside += 1
    shapes = strain[:met].copy(), frames[before : before + met].copy(), turns[:met].copy()
    return shapes[0], shapes[1], shapes[2], tilts[:met].copy(), work, passed[:beside].copy()
