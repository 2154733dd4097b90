"""Spatial rods to be set in motion, in units of their length and EI, and how to lead them to the edge of a snap."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from curveline.rod.problem import Array
from curveline.rod.spatial.energy import Shape, SpatialRod
from curveline.rod.spatial.lifting import frame
from curveline.rod.spatial.relax import RelaxEnding, descend, is_stable, newton

LATERAL, TWIST, STRETCH = 17.0, 3.0, 7.5e5
"""Of the strip of the built-in displays, 600 mm of it, over EI (and L^2)."""


def flat_rod(n: int, chord: tuple[float, float], ends: tuple[float, float]) -> SpatialRod:
    """A strip on n equal edges, held at both ends in the plane, without weight."""
    return SpatialRod(
        edges=np.full(n, 1.0 / n),
        stiffness=np.array([LATERAL, 1.0, TWIST, STRETCH]),
        natural=np.zeros((n + 1, 3)),
        forces=np.zeros((n + 1, 3)),
        chord=np.array([*chord, 0.0]),
        frames=np.array([frame(end) for end in ends]),
        held=np.ones(3),
    )


def flat_shape(angles: Array) -> Shape:
    """The unstretched shape in the plane with these tangent angles (n,)."""
    return Shape(np.zeros(angles.size), np.array([frame(angle) for angle in angles]))


def angles_of(shape: Shape) -> Array:
    """Tangent angles (n,) in the plane."""
    w, x, y, z = shape.frames.T
    return np.arctan2(2.0 * (y * z - w * x), 2.0 * (x * z + w * y))


def weighted(rod: SpatialRod, weight: float) -> SpatialRod:
    """The rod with a `weight` per length along -y."""
    forces = np.zeros_like(rod.forces)
    forces[:-1, 1] -= 0.5 * weight * rod.edges
    forces[1:, 1] -= 0.5 * weight * rod.edges
    return rod._replace(forces=forces)


def middles(n: int) -> Array:
    """Arc lengths of the middles of n equal edges."""
    return (np.arange(n) + 0.5) / n


def arch(rod: SpatialRod, side: float) -> Shape:
    """The stable arch of a rod, upwards (1) or downwards (-1)."""
    relaxed = descend(rod, flat_shape(side * 1.2 * np.sin(2.0 * math.pi * middles(rod.edges.size))))
    assert relaxed.ending is RelaxEnding.SETTLED
    return relaxed.shape


def fold_scene(kind: str, n: int) -> tuple[Callable[[float], SpatialRod], Shape]:
    """A scene of reference_values.md, section C, by its control value, and the arch at value 0 that will be lost.

    "one end" and "both ends" are turned against a downward arch, by degrees; "load" pushes an upward one at its middle.
    """
    ratio = 1.32 if kind == "both ends" else 1.2
    rod = flat_rod(n, (1.0 / ratio, 0.0), (0.0, 0.0))

    def at(value: float) -> SpatialRod:
        if kind == "load":
            forces = np.zeros((n + 1, 3))
            forces[n // 2, 1] = -value
            return rod._replace(forces=forces)
        turn = math.radians(value)
        return rod._replace(frames=np.array([frame(turn), frame(-turn if kind == "both ends" else 0.0)]))

    return at, arch(rod, 1.0 if kind == "load" else -1.0)


def last_stable(at: Callable[[float], SpatialRod], shape: Shape) -> tuple[float, Shape]:
    """How far the control value can grow until the state that is `shape` at 0 is lost, to 1e-4, and the state there."""
    value, step = 0.0, 4.0
    while step > 1e-4:
        found = newton(at(value + step), shape)
        turn = float(np.max(np.abs(angles_of(found.shape) - angles_of(shape))))
        if found.ending is RelaxEnding.SETTLED and is_stable(at(value + step), found.shape) and turn < 0.25:
            value, shape = value + step, found.shape
        else:
            step *= 0.5
    return value, shape
