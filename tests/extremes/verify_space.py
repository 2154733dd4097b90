"""Checks a state in space by an ODE: Kirchhoff's rod with stretch, shot from the left clamp to the right one.

Directors m1, m2, t turn with the body's rates u: t' = u2 m1 - u1 m2. N and M are what the rod beyond s puts on the rod
before s: N' = -(weight), M' = -r' x N, r' = (1 + N.t / EA) t (Antman 2005, Nonlinear Problems of Elasticity, ch. 8).
Shooting starts from the forces and moments that the state claims; its Jacobian along the rod counts conjugate points,
which tells stable states from others (Hoffman, Manning and Paffenroth 2002).
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.states.equilibrium import Equilibrium

Array = NDArray[np.float64]

STATIONS = 61


class SpaceCheck(NamedTuple):
    """What is true of a state in space: largest error [m], conjugate points inside, the wrench's relative change."""

    error: float
    conjugate: int
    corrected: float


def clamp_directors(angle: float, yaw: float, roll: float) -> Array:
    """Columns m1, m2, t of a clamp."""
    along = np.array([math.cos(angle), math.sin(angle), 0.0])
    left, front = np.array([-math.sin(angle), math.cos(angle), 0.0]), np.array([0.0, 0.0, 1.0])
    tangent = math.cos(yaw) * along + math.sin(yaw) * front
    second = math.cos(yaw) * front - math.sin(yaw) * along
    turned = (math.cos(roll) * left + math.sin(roll) * second, math.cos(roll) * second - math.sin(roll) * left)
    return np.column_stack([*turned, tangent])


def integrate(segment: ClampedRod, wrench: Array, places: Array) -> tuple[Array, Array]:
    """Positions (k, 3) and directors (k, 3, 3) at `places (k,)` [m] of the free rod, from N and M (6,) at its begin."""
    rod, bearing = segment, segment.bearing
    rigid = np.array([bearing.lateral, bearing.stiffness, bearing.twisting])
    rest = np.array([-segment.lateral_curvature, rod.natural_curvature, 0.0])
    weight = np.array([rod.weight_x, -rod.weight, rod.weight_z])

    def slope(_: float, y: Array) -> Array:
        directors, force, moment = y[3:12].reshape(3, 3), y[12:15], y[15:18]
        rate = rest + directors.T @ moment / rigid
        tangent = directors[:, 2]
        along = (1.0 + force @ tangent / rod.section.stretching_stiffness) * tangent
        turn = directors @ np.array([[0.0, -rate[2], rate[1]], [rate[2], 0.0, -rate[0]], [-rate[1], rate[0], 0.0]])
        return np.concatenate([along, turn.ravel(), -weight, -np.cross(along, force)])

    first = clamp_directors(rod.start, segment.yaw[0], segment.roll[0])
    y = np.concatenate([np.zeros(3), first.ravel(), wrench])
    at_loads = [load.at * rod.length - 0.5 * rod.clamp for load in rod.loads]
    borders = [0.0, *at_loads, float(places[-1])]
    found = np.empty((places.size, 18))
    for number, (begin, end) in enumerate(pairwise(borders)):
        inside = (places >= begin) & (places <= end)
        ticks = np.unique(np.append(places[inside], end))
        run = solve_ivp(slope, (begin, end), y, "DOP853", ticks, rtol=1e-11, atol=1e-12)
        assert run.success
        found[inside] = run.y.T[np.searchsorted(ticks, places[inside])]
        y = run.y[:, -1].copy()
        if number < len(at_loads):
            y[12:15] -= np.array(segment.loads[number][1:])
    return found[:, :3], found[:, 3:12].reshape(-1, 3, 3)


def misses(segment: ClampedRod, position: Array, directors: Array) -> Array:
    """How far (6,) the rod's end is from the right clamp: position over length, and a rotation vector."""
    rod = segment
    tangents = [clamp_directors(a, y, 0.0)[:, 2] for a, y in zip((rod.start, rod.end), segment.yaw, strict=True)]
    chord = np.array([*rod.chord, 0.0]) - 0.5 * rod.clamp * (tangents[0] + tangents[1])
    last = clamp_directors(rod.start + rod.turn, segment.yaw[1], segment.roll[1])
    turn = Rotation.from_matrix(last.T @ directors).as_rotvec()
    return np.concatenate([(position - chord) / rod.free_length, turn])


def jacobians(segment: ClampedRod, wrench: Array, places: Array, units: Array) -> Array:
    """Slopes (k, 6, 6) of position over length and rotation by the wrench over `units (6,)`, at `places (k,)`."""
    out = np.empty((places.size, 6, 6))
    for column in range(6):
        poses = []
        for sign in (1.0, -1.0):
            moved = wrench.copy()
            moved[column] += sign * 1e-5 * units[column]
            poses.append(integrate(segment, moved, places))
        (after, turned), (before, unturned) = poses
        out[:, :3, column] = (after - before) / (2e-5 * segment.free_length)
        out[:, 3:, column] = Rotation.from_matrix(unturned.transpose(0, 2, 1) @ turned).as_rotvec() / 2e-5
    return out


def check_in_space(state: Equilibrium, segment: ClampedRod) -> SpaceCheck:
    """Compare a state with the exact solution beside it; AssertionError with what is wrong."""
    space, rod = state.space, segment
    assert space is not None
    for values in (space.table, space.forces, space.moments, [state.energy, state.error]):
        assert np.all(np.isfinite(values)), "a number is not finite"
    length = rod.free_length
    claimed = -np.concatenate([space.forces[0], space.moments[0]])
    units = np.repeat([rod.stiffness / length**2, rod.stiffness / length], 3)
    places = np.linspace(0.0, length, STATIONS)
    wrench = claimed.copy()
    for _ in range(8):
        curve, directors = integrate(segment, wrench, places)
        missed = misses(segment, curve[-1], directors[-1])
        if np.max(np.abs(missed)) < 1e-9:
            break
        slopes = jacobians(segment, wrench, places[[0, -1]], units)[-1]
        wrench = wrench - units * np.linalg.solve(slopes, missed)
    else:
        raise AssertionError("there is no exact equilibrium near this state")
    corrected = float(np.max(np.abs(wrench - claimed) / units)) / max(1.0, float(np.max(np.abs(claimed) / units)))
    # Close to the clamp every path is free of conjugate points, and the determinant is lost in rounding.
    signs = np.sign(np.linalg.det(jacobians(segment, wrench, places, units)[6:]))
    conjugate = int(np.sum(signs[1:] != signs[:-1]))
    begin = 0.5 * rod.clamp * clamp_directors(rod.start, segment.yaw[0], 0.0)[:, 2]
    table = space.table[:, :3]
    vertices = np.concatenate([[0.0], np.cumsum(space.edges)])
    exact, _ = integrate(segment, wrench, np.minimum(vertices, length))
    return SpaceCheck(float(np.max(np.linalg.norm(exact + begin - table, axis=1))), conjugate, corrected)
