"""Ends that are turned about their tangents: by how much a rod is twisted, and twist of any number of turns.

A clamp's frame is the same after a full turn; the turns are kept by the frames of the edges, each of which differs by
less than half a turn from the next.
"""

from __future__ import annotations

import math

import numpy as np

from curveline.kernels.kernel import njit, shipped
from curveline.rod.geometry.rotations import exponential, multiply
from curveline.rod.problem import Array
from curveline.rod.spatial.energy import Shape, SpatialRod, cell_of, relative
from curveline.rod.spatial.relax import Relaxed, RelaxEnding, descend
from curveline.rod.spatial.terms import twist

LARGEST_STEP = 0.5 * math.pi
"""Turn of an end [rad] between two relaxations: further ones may jump from one branch of states to another."""


@njit
def total_twist(rod, shape):
    """Angle [rad] by which the material frame turns about the rod from end to end, whole turns included."""
    single, q = np.empty(4), np.empty(4)
    total = 0.0
    for i in range(rod.edges.size + 1):
        _, share = cell_of(rod, i)
        relative(rod, shape, i, single, q)
        total += share * twist.angle(q)
    return total


def spun(frame: Array, angle: float) -> Array:
    """The `frame (4,)` turned by `angle` [rad] about its tangent."""
    c, s = math.cos(0.5 * angle), math.sin(0.5 * angle)
    w, x, y, z = frame.tolist()
    return np.array([w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s])


def twisted(rod: SpatialRod, shape: Shape, angle: float) -> tuple[SpatialRod, Shape]:
    """The rod with its last clamp turned by `angle` [rad] about its tangent, any number of turns, and a start for it.

    In the start the turn is spread evenly along the rod, so that no vertex twists by more than its share.
    """
    ends = np.array([rod.frames[0], spun(rod.frames[1], angle)])
    return rod._replace(frames=ends), spread_twist(rod, shape, angle)


@shipped(SpatialRod, Shape, float)
def spread_twist(rod, shape, angle):
    """The shape with its frames turned about their tangents by up to `angle` [rad], evenly along the rod."""
    n = rod.edges.size
    frames, turn, vector = np.empty((n, 4)), np.empty(4), np.zeros(3)
    whole, at = np.sum(rod.edges), 0.0
    for j in range(n):
        vector[2] = angle * (at + 0.5 * rod.edges[j]) / whole
        at += rod.edges[j]
        exponential(vector, turn)
        multiply(shape.frames[j], turn, frames[j])
    return Shape(shape.strain, frames, np.empty((0, 4)), shape.tilts)


def wind(rod: SpatialRod, shape: Shape, angle: float) -> tuple[SpatialRod, Relaxed]:
    """Turn the last clamp by `angle` [rad] about its tangent, relaxing to a stable state after every quarter turn.

    Ends early, with the rod and the relaxation that failed, where no stable state is found.
    """
    count = max(1, math.ceil(abs(angle) / LARGEST_STEP))
    iterations = 0
    relaxed = Relaxed(shape, RelaxEnding.SETTLED, 0, 0.0)
    for _ in range(count):
        rod, start = twisted(rod, relaxed.shape, angle / count)
        relaxed = descend(rod, start)
        iterations += relaxed.iterations
        if relaxed.ending is not RelaxEnding.SETTLED:
            break
    return rod, relaxed._replace(iterations=iterations)
