"""Kirchhoff's rod with stretch by two methods that share nothing with the product: shooting, and descent in strains.

Shooting integrates position, quaternion, force and moment from the left clamp by the explicit method of order eight of
Dormand and Prince, and solves for the wrench there; the determinant of the pose's slope by that wrench, along the rod,
counts conjugate points, of which a stable rod has none (Hoffman, Manning and Paffenroth 2002). The descent has Legendre
coefficients of the three curvatures as its unknowns and minimises an augmented Lagrangian by L-BFGS: what it finds is
stable, or nearly. Units: the free length and EI in the plane.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.integrate._ivp import dop853_coefficients as dop

from curveline.rod.clamped_rod import ClampedRod

Array = NDArray[np.float64]
njit: Any = numba.njit(error_model="numpy", cache=True, no_cfunc_wrapper=True)  # they call nothing of other files

STAGES = dop.N_STAGES
A, B, C = dop.A[:STAGES, :STAGES].copy(), dop.B.copy(), dop.C[:STAGES].copy()
STATIONS = 64
"""Steps of the integrator, and places at which it is looked for conjugate points."""
EVEN = np.linspace(0.0, 1.0, STATIONS + 1)
FIRST_STATION = 6
"""Closer to the clamp every path is free of conjugate points, and the determinant is lost in rounding."""
DEGREES = 12
"""Legendre polynomials for each curvature in a descent."""
STEPS = 48
"""Of the descent's midpoint rule."""
MEMORY = 8
FLAT = 1e-5
"""Of the descent: steps that are remembered, and the largest slope that is taken for none."""
STEP = 1e-5
"""Change of a wrench's part with which slopes are taken."""


class Rod(NamedTuple):
    """A rod in units of its free length and EI; `stiffness (4,)` about m1, m2, t, and of stretch.

    `rest (3,)` curvatures, `weight (3,)` per length, `at (k,)` and `forces (k, 3)` the dead loads, clamps `first (4,)`
    and `last (4,)` as quaternions of frames m1, m2, t, the last one lifted along the way that their roll asks for. The
    rest curvature about m2 has a `profile (k, 3)` besides: place along the rod, value there, and slope.
    """

    stiffness: Array
    rest: Array
    weight: Array
    at: Array
    forces: Array
    chord: Array
    first: Array
    last: Array
    profile: Array


class Solution(NamedTuple):
    """An equilibrium: the `wrench (6,)` at its begin, stations' `poses (k, 7)`, and its number of conjugate points."""

    wrench: Array
    poses: Array
    conjugate: int

    @property
    def curve(self) -> Array:
        """Positions (k, 3)."""
        return self.poses[:, :3]


def product(a: Array, b: Array) -> Array:
    """Of two quaternions."""
    w = a[0] * b[0] - a[1:] @ b[1:]
    return np.concatenate([[w], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])])


def turned(axis: tuple[float, float, float], angle: float) -> Array:
    """Quaternion of a turn, not reduced by full turns."""
    return np.concatenate([[math.cos(angle / 2)], math.sin(angle / 2) * np.array(axis)])


def clamp(angle: float, yaw: float, roll: float) -> Array:
    """Frame of a clamp: m1 to the left of the rod, m2 to the viewer, t along it, as the segment's contract says."""
    level = np.array([0.5, 0.5, 0.5, 0.5])  # x, y, z become t, m1, m2
    for axis, turn in (((0.0, 1.0, 0.0), angle), ((1.0, 0.0, 0.0), -yaw), ((0.0, 0.0, 1.0), roll)):
        level = product(level, turned(axis, turn))
    return level


def rod_of(segment: ClampedRod) -> Rod:
    """The rod of a segment, from its data alone."""
    rod, bearing = segment, segment.bearing
    length, unit = rod.free_length, rod.free_length**2 / rod.stiffness
    ends = [clamp(rod.start, segment.yaw[0], segment.roll[0]), clamp(rod.end, segment.yaw[1], segment.roll[1])]
    tangents = [
        2.0 * np.array([q[1] * q[3] + q[0] * q[2], q[2] * q[3] - q[0] * q[1], q[0] ** 2 + q[3] ** 2 - 0.5])
        for q in ends
    ]
    rigid = np.array([bearing.lateral, bearing.stiffness, bearing.twisting])
    place, curvature, slope = bearing.profile.T
    place = (place - segment.pose.begin - 0.5 * rod.clamp) / length
    return Rod(
        np.array([*(rigid / rod.stiffness), rod.section.stretching_stiffness * unit]),
        np.array([-segment.lateral_curvature * length, rod.natural_curvature * length, 0.0]),
        np.array([rod.weight_x, -rod.weight, rod.weight_z]) * length * unit,
        np.array([(load.at * rod.length - 0.5 * rod.clamp) / length for load in segment.loads]),
        np.array([load[1:] for load in segment.loads]).reshape(-1, 3) * unit,
        (np.array([*rod.chord, 0.0]) - 0.5 * rod.clamp * (tangents[0] + tangents[1])) / length,
        *ends,
        np.column_stack([place, curvature * length, slope * length**2]),
    )


@njit
def bent_by(profile, at):
    """Value of a profile, a cubic between its rows and constant beyond them."""
    if profile.shape[0] == 0:
        return 0.0
    if at <= profile[0, 0] or profile.shape[0] == 1:
        return profile[0, 1]
    k = np.searchsorted(profile[:, 0], at) - 1
    if k == profile.shape[0] - 1:
        return profile[k, 1]
    h = profile[k + 1, 0] - profile[k, 0]
    t = (at - profile[k, 0]) / h
    value = (1.0 + 2.0 * t) * (1.0 - t) ** 2 * profile[k, 1] + t * t * (3.0 - 2.0 * t) * profile[k + 1, 1]
    return value + h * t * (1.0 - t) * ((1.0 - t) * profile[k, 2] - t * profile[k + 1, 2])


@njit
def rates(rod, at, y, out):
    """Slopes of position, quaternion, force and moment (13,) at a place along the rod."""
    w, x, v, z = y[3], y[4], y[5], y[6]
    m1 = (w * w + x * x - v * v - z * z, 2.0 * (x * v + w * z), 2.0 * (x * z - w * v))
    m2 = (2.0 * (x * v - w * z), w * w - x * x + v * v - z * z, 2.0 * (v * z + w * x))
    t = (2.0 * (x * z + w * v), 2.0 * (v * z - w * x), w * w - x * x - v * v + z * z)
    a = rod.rest[0] + (m1[0] * y[10] + m1[1] * y[11] + m1[2] * y[12]) / rod.stiffness[0]
    b = rod.rest[1] + bent_by(rod.profile, at) + (m2[0] * y[10] + m2[1] * y[11] + m2[2] * y[12]) / rod.stiffness[1]
    c = rod.rest[2] + (t[0] * y[10] + t[1] * y[11] + t[2] * y[12]) / rod.stiffness[2]
    stretched = 1.0 + (t[0] * y[7] + t[1] * y[8] + t[2] * y[9]) / rod.stiffness[3]
    for i in range(3):
        out[i] = stretched * t[i]
        out[7 + i] = -rod.weight[i]
    out[3] = 0.5 * (-x * a - v * b - z * c)
    out[4] = 0.5 * (w * a + v * c - z * b)
    out[5] = 0.5 * (w * b + z * a - x * c)
    out[6] = 0.5 * (w * c + x * b - v * a)
    out[10] = -(out[1] * y[9] - out[2] * y[8])
    out[11] = -(out[2] * y[7] - out[0] * y[9])
    out[12] = -(out[0] * y[8] - out[1] * y[7])


@njit
def integrated(rod, wrench, places):
    """Position and quaternion (k, 7) at `places (k,)`, the first 0, among which are those of the loads."""
    return integrated_whole(rod, wrench, places)[:, :7].copy()


@njit
def integrated_whole(rod, wrench, places):
    """Position, quaternion, force and moment (k, 13) at `places (k,)`, see `integrated`."""
    out = np.empty((places.size, 13))
    y, trial = np.zeros(13), np.empty(13)
    slopes = np.empty((STAGES, 13))
    y[3:7] = rod.first
    y[7:] = wrench
    out[0] = y
    for step in range(places.size - 1):
        for load in range(rod.at.size):
            if abs(places[step] - rod.at[load]) < 1e-12:
                y[7:10] -= rod.forces[load]
        h = places[step + 1] - places[step]
        for stage in range(STAGES):
            for i in range(13):
                trial[i] = y[i]
            for before in range(stage):
                if A[stage, before] != 0.0:
                    for i in range(13):
                        trial[i] += h * A[stage, before] * slopes[before, i]
            rates(rod, places[step] + h * C[stage], trial, slopes[stage])
        for stage in range(STAGES):
            for i in range(13):
                y[i] += h * B[stage] * slopes[stage, i]
        out[step + 1] = y
    return out


@njit
def slopes_of(rod, wrench, places):
    """Slopes (k, 6, 6) of position and turn by the wrench at `places (k,)`."""
    out = np.empty((places.size, 6, 6))
    for column in range(6):
        ahead, behind = wrench.copy(), wrench.copy()
        size = STEP * max(1.0, abs(wrench[column]))
        ahead[column] += size
        behind[column] -= size
        one, other = integrated(rod, ahead, places), integrated(rod, behind, places)
        for k in range(places.size):
            a, b = other[k, 3:], one[k, 3:]
            for i in range(3):
                out[k, i, column] = (one[k, i] - other[k, i]) / (2.0 * size)
            out[k, 3, column] = (a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2]) / size
            out[k, 4, column] = (a[0] * b[2] + a[1] * b[3] - a[2] * b[0] - a[3] * b[1]) / size
            out[k, 5, column] = (a[0] * b[3] - a[1] * b[2] + a[2] * b[1] - a[3] * b[0]) / size
    return out


def places_of(rod: Rod) -> Array:
    """Stations, with one under each load."""
    return np.unique(np.concatenate([EVEN, rod.at]))


def missed(rod: Rod, pose: Array) -> Array:
    """How far (6,) a pose is from the last clamp."""
    back = product(rod.last * np.array([1.0, -1.0, -1.0, -1.0]), pose[3:])
    return np.concatenate([pose[:3] - rod.chord, 2.0 * back[1:] * np.sign(back[0])])


def shoot(rod: Rod, wrench: Array, tries: int = 40) -> Solution | None:
    """The equilibrium that Newton's method, damped, reaches from a `wrench (6,)`; None if none is of this lift."""
    places = places_of(rod)
    poses = integrated(rod, wrench, places)
    gap = missed(rod, poses[-1])
    for _ in range(tries):
        if np.max(np.abs(gap)) < 1e-10:
            is_lifted = rod.last @ poses[-1, 3:] > 0.0
            kept = poses[np.isin(places, EVEN)]
            return Solution(wrench, kept, conjugates(rod, wrench, places)) if is_lifted else None
        slopes = slopes_of(rod, wrench, places)[-1]
        if not np.all(np.isfinite(slopes)) or abs(np.linalg.det(slopes)) < 1e-300:
            return None
        step = np.linalg.solve(slopes, gap)
        for part in 0.5 ** np.arange(10):
            trial = integrated(rod, wrench - part * step, places)
            left_over = missed(rod, trial[-1])
            if np.linalg.norm(left_over) < (1.0 - 0.2 * part) * np.linalg.norm(gap):
                break
        else:
            return None
        wrench, poses, gap = wrench - part * step, trial, left_over
    return None


def conjugates(rod: Rod, wrench: Array, places: Array) -> int:
    """Number of conjugate points, the end among them."""
    signs = np.sign(np.linalg.det(slopes_of(rod, wrench, places)[FIRST_STATION:]))
    return int(np.sum(signs[1:] != signs[:-1]))


MIDDLES = (np.arange(STEPS) + 0.5) / STEPS
BASIS = np.stack([np.polynomial.Legendre.basis(k)(2.0 * MIDDLES - 1.0) * math.sqrt(2 * k + 1) for k in range(DEGREES)])


@njit
def lagrangian(rod, coefficients, force, penalty, slope):
    """Augmented Lagrangian of `coefficients (3, DEGREES)`, its `slope` to be overwritten, and the pose's `gap (7,)`.

    `force (7,)` are the multipliers of position and quaternion at the end, whose difference counts as a whole.
    """
    h = 1.0 / STEPS
    u = np.dot(coefficients, BASIS)
    frames, turns = np.empty((STEPS + 1, 4)), np.empty((STEPS, 4))
    tangents = np.empty((STEPS, 3))
    frames[0] = rod.first
    place = np.zeros(3)
    total = 0.0
    halves = np.empty((STEPS, 4))
    weights = np.empty((STEPS, 3))
    carried, rests = np.zeros(3), np.empty((3, STEPS))
    for j in range(STEPS):
        rests[0, j], rests[2, j] = rod.rest[0], rod.rest[2]
        rests[1, j] = rod.rest[1] + bent_by(rod.profile, (j + 0.5) * h)
    for j in range(STEPS - 1, -1, -1):
        # What the turning of a step lifts: half of its own weight and all the loads beyond its middle.
        weights[j] = carried + 0.5 * h * rod.weight
        carried = carried + h * rod.weight
        for load in range(rod.at.size):
            reach = min(max((rod.at[load] - j * h) / h, 0.0), 1.0)
            weights[j] = weights[j] + reach * rod.forces[load]
    for j in range(STEPS):
        for axis in range(3):
            total += 0.5 * h * rod.stiffness[axis] * (u[axis, j] - rests[axis, j]) ** 2
        size = np.sqrt(u[0, j] ** 2 + u[1, j] ** 2 + u[2, j] ** 2)
        for part in range(2):
            angle = size * h * (0.25 if part == 0 else 0.5)
            scale = np.sin(angle) / max(size, 1e-12)
            to = halves if part == 0 else turns
            to[j, 0] = np.cos(angle)
            for axis in range(3):
                to[j, 1 + axis] = scale * u[axis, j]
        t = tangent(times(row(frames, j), row(halves, j)))
        for axis in range(3):
            tangents[j, axis] = t[axis]
            place[axis] += h * t[axis]
            total -= h * t[axis] * weights[j, axis]
        frames[j + 1] = times(row(frames, j), row(turns, j))
    gap = np.empty(7)
    gap[:3] = place - rod.chord
    gap[3:] = frames[STEPS] - rod.last
    for i in range(7):
        total += force[i] * gap[i] + 0.5 * penalty * gap[i] ** 2
    # Backwards: `pull` is the slope by the position of all beyond, `back` that by the frame.
    pull = force[:3] + penalty * gap[:3]
    ends = force[3:] + penalty * gap[3:]
    back = (ends[0], ends[1], ends[2], ends[3])
    by_u = np.empty((3, STEPS))
    for j in range(STEPS - 1, -1, -1):
        # The next frame is this one times the turn, and that in the middle of the step this one times half of it.
        here, half = row(frames, j), row(halves, j)
        asked = (h * (pull[0] - weights[j, 0]), h * (pull[1] - weights[j, 1]), h * (pull[2] - weights[j, 2]))
        by_middle = by_tangent(times(here, half), asked)
        by_turn, by_half = left(here, back), left(here, by_middle)
        one, other = right(row(turns, j), back), right(half, by_middle)
        back = (one[0] + other[0], one[1] + other[1], one[2] + other[2], one[3] + other[3])
        size = np.sqrt(u[0, j] ** 2 + u[1, j] ** 2 + u[2, j] ** 2)
        for axis in range(3):
            by_u[axis, j] = h * rod.stiffness[axis] * (u[axis, j] - rests[axis, j])
        for part in range(2):
            g = by_half if part == 0 else by_turn
            share = h * (0.25 if part == 0 else 0.5)
            angle = size * share
            safe = max(size, 1e-12)
            sine, cosine = np.sin(angle), np.cos(angle)
            along = (u[0, j] * g[1] + u[1, j] * g[2] + u[2, j] * g[3]) / safe
            for axis in range(3):
                unit = u[axis, j] / safe
                by_u[axis, j] += (
                    unit * (-sine * share * g[0] + (cosine * share - sine / safe) * along) + sine / safe * g[1 + axis]
                )
    slope[:] = np.dot(by_u, BASIS.T)
    return total, gap


@njit
def row(table, j):
    """A row of four as a tuple, which costs no memory."""
    return table[j, 0], table[j, 1], table[j, 2], table[j, 3]


@njit
def times(a, b):
    """Product of quaternions."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@njit
def left(a, g):
    """Slope by b of g . (a b): conj(a) g."""
    return times((a[0], -a[1], -a[2], -a[3]), g)


@njit
def right(b, g):
    """Slope by a of g . (a b): g conj(b)."""
    return times(g, (b[0], -b[1], -b[2], -b[3]))


@njit
def tangent(q):
    """Third column of the matrix of a quaternion."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), w * w - x * x - y * y + z * z


@njit
def by_tangent(q, g):
    """Slope by q of g . tangent(q)."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return (
        2.0 * (y * g[0] - x * g[1] + w * g[2]),
        2.0 * (z * g[0] - w * g[1] - x * g[2]),
        2.0 * (w * g[0] + z * g[1] - y * g[2]),
        2.0 * (x * g[0] + y * g[1] + z * g[2]),
    )


@njit
def minimised(rod, x, forces, steps):
    """Coefficients downhill from `x (3, DEGREES)`, and their pose's gap (7,): L-BFGS with backtracking.

    `forces` are the multipliers (7,) and the penalty; curvatures count by the root of their stiffness.
    """
    force, penalty = forces
    scale = np.empty((3, 1))
    for axis in range(3):
        scale[axis, 0] = 1.0 / np.sqrt(rod.stiffness[axis])
    slope, ahead = np.empty((3, DEGREES)), np.empty((3, DEGREES))
    moves, changes, products = np.zeros((MEMORY, 3 * DEGREES)), np.zeros((MEMORY, 3 * DEGREES)), np.zeros(MEMORY)
    kept = 0
    value, gap = lagrangian(rod, x, force, penalty, slope)
    for _ in range(steps):
        gradient = (slope * scale).reshape(-1)
        if np.max(np.abs(gradient)) < FLAT:
            break
        way, shares = -gradient, np.zeros(MEMORY)
        for back in range(min(kept, MEMORY)):
            k = (kept - 1 - back) % MEMORY
            shares[k] = np.dot(moves[k], way) / products[k]
            way = way - shares[k] * changes[k]
        if kept > 0:
            k = (kept - 1) % MEMORY
            way = way * (products[k] / np.dot(changes[k], changes[k]))
        else:
            way = way * min(1.0, 0.5 / np.sqrt(np.dot(way, way)))
        for back in range(min(kept, MEMORY) - 1, -1, -1):
            k = (kept - 1 - back) % MEMORY
            way = way + (shares[k] - np.dot(changes[k], way) / products[k]) * moves[k]
        downhill = np.dot(way, gradient)
        if downhill >= 0.0:
            kept = 0
            way, downhill = -gradient * min(1.0, 0.1 / np.sqrt(np.dot(gradient, gradient))), -1e-12
        size = min(1.0, 3.0 / np.sqrt(np.dot(way, way)))
        found = False
        for _ in range(25):
            trial = x + size * way.reshape((3, DEGREES)) * scale
            tried, missing = lagrangian(rod, trial, force, penalty, ahead)
            if tried < value + 1e-4 * size * downhill:
                found = True
                break
            size *= 0.5
        if not found:
            break
        move, change = size * way, (ahead * scale).reshape(-1) - gradient
        if np.dot(move, change) > 1e-12 * np.dot(move, move):
            k = kept % MEMORY
            moves[k], changes[k], products[k] = move, change, np.dot(move, change)
            kept += 1
        x, value, gap = trial, tried, missing
        slope[:] = ahead
    return x, gap


@njit
def settled(rod, x, noise):
    """Coefficients, force (7,) at the end and gap (7,) of a stable rod downhill from `x`; `noise (k, 3, DEGREES)`.

    Weak springs at the end would let the rod straighten, and straight rods are saddles: hence the noise, too.
    """
    force, penalty = np.zeros(7), 1000.0
    gap = np.full(7, np.inf)
    for turn in range(noise.shape[0]):
        x, gap = minimised(rod, x + noise[turn], (force, penalty), 60 if turn < 3 else 200)
        force = force + penalty * gap
        if np.max(np.abs(gap)) < 1e-6:
            break
    return x, force, gap


def descend(rod: Rod, coefficients: Array) -> Array | None:
    """The wrench (6,) at the begin of a stable rod that is downhill from curvatures' `coefficients`; or None."""
    noise = np.random.default_rng(1).normal(0.0, 0.02, (12, *coefficients.shape))
    noise[5:] = 0.0
    x, force, gap = settled(rod, coefficients, noise)
    if not np.max(np.abs(gap)) < 1e-2:
        return None
    strains = x @ np.array([math.sqrt(2 * k + 1) * (-1.0) ** k for k in range(DEGREES)])
    body = rod.stiffness[:3] * (strains - rod.rest - [0.0, bent_by(rod.profile, 0.0), 0.0])
    w, v = rod.first[0], rod.first[1:]
    moment = body + 2.0 * np.cross(v, np.cross(v, body) + w * body)
    push = -force[:3] + rod.weight + rod.forces.sum(axis=0)
    return np.concatenate([push, moment])


def linking(rod: Rod, solution: Solution) -> float:
    """Twist and writhe of the rod closed far behind the display, in turns, by Gauss's integral on its polygon."""
    q = solution.poses[:, 3:]
    between = np.einsum("ki,ki->k", q[:-1], q[1:]), q[:-1, 0] * q[1:, 3] - q[:-1, 3] * q[1:, 0]
    cross = q[:-1, 2] * q[1:, 1] - q[:-1, 1] * q[1:, 2]
    twist = float(np.sum(2.0 * np.arctan2(between[1] + cross, between[0])))
    ends = [np.array(tangent(q)) for q in (rod.first, rod.last)]
    behind = np.array([0.0, 0.0, -30.0])
    tails = solution.curve[0] - 0.3 * ends[0], solution.curve[-1] + 0.3 * ends[1]
    points = np.vstack([tails[0], solution.curve, tails[1], tails[1] + behind, tails[0] + behind])
    return twist / (2.0 * math.pi) + gauss(points)


@njit
def gauss(points):
    """Writhe of a closed polygon: the solid angles of all pairs of its edges (Banchoff 1976)."""
    count = points.shape[0]
    total = 0.0
    for i in range(count):
        a, b = points[i], points[(i + 1) % count]
        for j in range(i + 2, count):
            if (j + 1) % count == i:
                continue
            c, d = points[j], points[(j + 1) % count]
            total -= solid(c - a, d - a, d - b) + solid(c - a, d - b, c - b)
    return total / (2.0 * math.pi)


@njit
def solid(a, b, c):
    """Signed solid angle of a triangle."""
    x, y, z = np.sqrt(np.dot(a, a)), np.sqrt(np.dot(b, b)), np.sqrt(np.dot(c, c))
    volume = (
        a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    return 2.0 * np.arctan2(volume, x * y * z + np.dot(a, b) * z + np.dot(b, c) * x + np.dot(c, a) * y)
