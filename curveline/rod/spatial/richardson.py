"""From a relaxed spatial rod to a curve of known accuracy: levels of halved edges, as `planar.richardson`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from curveline.kernels.forms import Matrix
from curveline.kernels.kernel import leaf, shipped
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.geometry.closest_approach import nearest_parts
from curveline.rod.geometry.crossings import APART, crosses_itself, crosses_tails
from curveline.rod.geometry.hermite import integral
from curveline.rod.geometry.rotations import between, exponential, logarithm, matrix_of, multiply
from curveline.rod.geometry.space_curve import SpaceCurve, X, Y, Z
from curveline.rod.planar.richardson import ROUNDING
from curveline.rod.problem import Array, halved
from curveline.rod.profile import BEFORE, BENT, TURN, hidden_between
from curveline.rod.spatial.energy import (
    Shape,
    SpatialRod,
    cell_of,
    energy,
    moments,
    natural_at,
    positions,
    relative,
    turned_at,
)
from curveline.rod.spatial.lifting import (
    clamp_tangents,
    relax_in_space,
    rest_of,
    spatial_rod,
    stays_in_plane,
)
from curveline.rod.spatial.linking_number import turns
from curveline.rod.spatial.mouths import copy_mouth
from curveline.rod.spatial.reaction import clamp_forces
from curveline.rod.spatial.relax import NEUTRAL, Relaxed, RelaxEnding, is_stable, settle
from curveline.rod.spatial.stability import lowest_eigenvalue
from curveline.rod.spatial.terms import bend, loads
from curveline.rod.states.equilibrium import SPATIAL, Equilibrium, Outcome, tail_of

COLUMNS = 9
"""Of a table of vertices: position, its slope and its second derivative by the unstretched arc length."""
MOST_EDGES = 10_000
FEWEST_STEPS, MOST_STEPS, EDGES_MOVED = 60, 200, 60_000
"""Iterations on a level, fewer the more edges it has. It begins beside its equilibrium: of 4,000 levels one needed 52,
the next 18; a coarse one that is wound up may take 81, but on many edges no number is enough for what these are not."""
HONESTY = 0.3
"""Times the difference of two extrapolations the error of the finer one is reported; in the limit it is a fifteenth of
it, or a seventh where the stiffnesses of bending differ: the half vertices at the clamps then leave a cubic error."""
SUSPECT = 0.4
"""Where halving the edges leaves more than this of a change, the extrapolation is not to be trusted."""
SLIPPED = 1.0
"""Turns that a state may differ by from those asked for: clamps out of the plane make up half a one, a passage two."""


class Level(NamedTuple):
    """A rod in equilibrium at one resolution: vertices `table (n+1, 9)` and the numbers that are extrapolated with it.

    `bends (n+1,)` are the curvatures away from the natural one, `forces (2, 3)` and `moments (2, 3)` those of the
    clamps on the rod, then `energy` of strain and `potential` of the loads; `tilts (2,)` of bearings that give.
    """

    table: Array
    bends: Array
    forces: Array
    moments: Array
    energy: Array
    potential: Array
    eigenvalue: Array
    tilts: Array


class Climbed(NamedTuple):
    """A spatial state refined: its extrapolated `level` on `edges (m,)`, error estimate and what it took.

    Where the rod `passed` through itself on the way, the state is none of the segment's: see `link`.
    """

    level: Level
    edges: Array
    error: float
    is_stable: bool
    vertices: int
    iterations: int
    ending: RelaxEnding
    passed: bool


@shipped(SpatialRod, Shape, Matrix)
def vertex_table(rod, shape, rest):
    """Position, slope and second derivative by the unstretched arc length at every vertex: (n+1, 9).

    `rest (3, n+1)` is what vertices have when the rod is free, see `profile`: it bends about m2.
    """
    n = rod.edges.size
    mouth = np.empty(4)
    copy_mouth(rod, shape, 0, mouth)
    table = np.empty((n + 1, COLUMNS))
    table[:, :3] = positions(rod, shape)
    single, q, turn, halfway = np.empty(4), np.empty(4), np.empty(4), np.empty(4)
    vector, matrix = np.empty(3), np.empty((3, 3))
    for i in range(n + 1):
        before = mouth if i == 0 else shape.frames[i - 1]
        cell, _ = cell_of(rod, i)
        relative(rod, shape, i, single, q)
        logarithm(single, vector)
        share = 0.0 if i == 0 else 1.0 if i == n else rod.edges[i - 1] / (rod.edges[i - 1] + rod.edges[i])
        for axis in range(3):
            vector[axis] *= share
        vector[1] += rest[BEFORE, i] - share * rest[TURN, i]
        exponential(vector, turn)
        multiply(before, turn, halfway)
        matrix_of(halfway, matrix)
        scale = 2.0 * q[0] / (q[0] ** 2 + q[3] ** 2) / cell
        sharper = rest[BENT, i] - rest[TURN, i] / (cell * (0.5 if i == 0 or i == n else 1.0))
        left = max(i - 1, 0) if i < n else n - 2
        rate = (shape.strain[left + 1] - shape.strain[left]) * 2.0 / (rod.edges[left] + rod.edges[left + 1])
        strain = shape.strain[left] + 0.5 * rod.edges[left] * rate
        if i == 0:
            strain -= rod.edges[0] * rate
        elif i == n:
            strain += rod.edges[n - 1] * rate
        for axis in range(3):
            table[i, 3 + axis] = (1.0 + strain) * matrix[axis, 2]
            # A turn about m1 bends the rod against m2, a turn about m2 along m1.
            sideways = (scale * q[2] + sharper) * matrix[axis, 0] - scale * q[1] * matrix[axis, 1]
            table[i, 6 + axis] = (1.0 + strain) * sideways + rate * matrix[axis, 2]
    return table


@shipped(SpatialRod, Shape)
def vertex_bends(rod, shape):
    """Curvatures away from the natural one at the vertices, (n+1,)."""
    n = rod.edges.size
    out, single, q = np.empty(n + 1), np.empty(4), np.empty(4)
    for i in range(1, n):
        turned_at(rod, shape, i, single)
        out[i] = _bend(natural_at(rod, i), 0.5 * (rod.edges[i - 1] + rod.edges[i]), single)
    for end in range(2):
        relative(rod, shape, end * n, single, q)
        out[end * n] = _bend(natural_at(rod, end * n), rod.edges[end * (n - 1)], q)
    return out


@leaf
def _bend(natural, cell, q):
    """Curvature away from the natural one of a vertex that turns by `q (4,)` over a `cell`."""
    first, second = bend.turns(q)
    per = 1.0 / cell
    first, second = per * first - natural[0], per * second - natural[1]
    return np.sqrt(first * first + second * second)


@shipped(SpatialRod, Shape)
def refined(rod, shape):
    """The same curve on edges cut in two, by interpolation between the frames; clamps end it."""
    n = rod.edges.size
    strain, frames = np.empty(2 * n), np.empty((2 * n, 4))
    mouths = np.empty((2, 4))
    for end in range(2):
        copy_mouth(rod, shape, end, mouths[end])
    q, turn, vector = np.empty(4), np.empty(4), np.empty(3)
    for j in range(n):
        for side in range(2):
            at_clamp = (j == 0 and side == 0) or (j == n - 1 and side == 1)
            if side == 0:
                other = mouths[0] if j == 0 else shape.frames[j - 1]
            else:
                other = mouths[1] if j == n - 1 else shape.frames[j + 1]
            between(shape.frames[j], other, q)
            logarithm(q, vector)
            for axis in range(3):
                vector[axis] *= 0.5 if at_clamp else 0.25
            exponential(vector, turn)
            multiply(shape.frames[j], turn, frames[2 * j + side])
            strain[2 * j + side] = shape.strain[j]
    return Shape(strain, frames, np.empty((0, 4)), shape.tilts)


def _steps_on(edges: int) -> int:
    """How many iterations a level of so many edges is worth."""
    return max(FEWEST_STEPS, min(MOST_STEPS, EDGES_MOVED // edges))


def climb(segment: ClampedRod, rod: SpatialRod, relaxed: Relaxed, tolerance: float) -> Climbed:
    """Refine a state on the edges of `rod` until its error is below `tolerance`, in units of the length."""
    here = _level(segment, rod, relaxed.shape)
    best, places, error = here, rod.edges, math.inf
    iterations = relaxed.iterations
    change, lowest = math.inf, math.nan
    rungs = 1
    while relaxed.ending is RelaxEnding.SETTLED and 2 * rod.edges.size <= MOST_EDGES and error > tolerance:
        lowest_before, lowest = lowest, float(lowest_eigenvalue(rod, relaxed.shape))
        places = rod.edges
        finer = spatial_rod(segment, np.asarray(halved(rod.edges)))
        relaxed = settle(finer, refined(rod, relaxed.shape), _steps_on(finer.edges.size))
        rod = finer
        iterations += relaxed.iterations
        before, coarse, here = best, here, _level(segment, rod, relaxed.shape)
        best = _extrapolated(coarse, here)
        best = best._replace(eigenvalue=np.array(lowest + (lowest - lowest_before) / 3.0 if rungs > 1 else lowest))
        rungs += 1
        change_before, change = change, _gap(here.table, coarse.table)
        if rungs > 2:
            error = HONESTY * _gap(best.table, before.table) + ROUNDING + _hidden(segment, places)
            if change > SUSPECT * change_before:
                error = max(error, change)
    settled = relaxed.ending is RelaxEnding.SETTLED
    return Climbed(
        level=best,
        edges=places,
        error=error if settled else math.inf,
        is_stable=settled and is_stable(rod, relaxed.shape),
        vertices=rod.edges.size + 1,
        iterations=iterations,
        ending=relaxed.ending,
        passed=settled and not segment.is_flat and _lost_turns(segment, rod, relaxed.shape) > SLIPPED,
    )


def _hidden(segment: ClampedRod, edges: Array) -> float:
    """How far a rod that is bent unevenly may be from the curve through its vertices, in units of the length."""
    if not segment.is_unevenly_curved:
        return 0.0
    length, begin = segment.free_length, segment.pose.begin + 0.5 * segment.clamp
    return float(hidden_between(segment.bearing.profile, begin, length * edges)) / length


def _lost_turns(segment: ClampedRod, rod: SpatialRod, shape: Shape) -> float:
    """By how many turns a state differs from what the roll of the clamps puts into the rod."""
    return abs(turns(rod, shape) - (segment.roll[1] - segment.roll[0]) / (2.0 * math.pi))


def _level(segment: ClampedRod, rod: SpatialRod, shape: Shape) -> Level:
    """What a level contributes to the extrapolation; its eigenvalue, which costs most, is left open."""
    potential = loads.energy(positions(rod, shape), rod.forces)
    return Level(
        vertex_table(rod, shape, rest_of(segment, rod.edges)),
        vertex_bends(rod, shape),
        clamp_forces(rod, shape),
        moments(rod, shape),
        np.array(energy(rod, shape) - potential),
        np.array(potential),
        np.array(math.nan),
        np.array(shape.tilts),
    )


def _extrapolated(coarse: Level, fine: Level) -> Level:
    """Richardson: the limit for vanishing edges of values with an error in the square of the edge length."""
    pairs = zip(coarse, fine._replace(table=fine.table[::2], bends=fine.bends[::2]), strict=True)
    return Level(*(rough + (sharp - rough) * (4.0 / 3.0) for rough, sharp in pairs))


def _gap(fine: Array, coarse: Array) -> float:
    """Largest distance between the vertices of a coarse table and the same ones of a fine one."""
    return float(np.max(np.linalg.norm(fine[::2, :3] - coarse[:, :3], axis=1)))


def refine_in_space(segment: ClampedRod, state: Equilibrium, tolerance: float) -> Equilibrium:
    """The stable state in space to which the planar `state` leads, refined to `tolerance` [m].

    Never raises for numerical reasons: see `Outcome`.
    """
    rod, relaxed = relax_in_space(segment, state)
    found = refine_shape(segment, rod, relaxed, tolerance)
    return found.but(
        name=state.name,
        wanted=state.wanted,
        winding=state.winding,
        rod=state.rod,
        iterations=state.iterations + found.iterations,
        leaves_plane=not stays_in_plane(segment, state),
    )


def refine_shape(segment: ClampedRod, rod: SpatialRod, relaxed: Relaxed, tolerance: float) -> Equilibrium:
    """The state that has `relaxed` on the edges of `rod`, refined to `tolerance` [m]."""
    length = segment.free_length
    climbed = climb(segment, rod, relaxed, tolerance / length)
    space = _curve(segment, climbed)
    table = _front(space)
    level = climbed.level
    is_flat = space.depth < 0.5 * segment.section.thickness
    return Equilibrium(
        name="",
        outcome=_outcome(climbed, tolerance / length),
        stable=climbed.is_stable and not climbed.passed and float(level.eigenvalue) > -NEUTRAL,
        wanted=False,
        energy=float(level.energy + level.potential) * segment.stiffness / length,
        error=climbed.error * length,
        vertices=climbed.vertices,
        iterations=climbed.iterations,
        lowest_eigenvalue=float(level.eigenvalue),
        winding=segment.winding,
        crosses_itself=is_flat and bool(crosses_itself(table)),
        wraps_clamp=is_flat and bool(crosses_tails(table, tail_of(segment))),
        clearance=_clearance(space),
        mean_height=_mean_height(space),
        clamp_force=space.forces[:, :2].copy(),
        clamp_moment=space.moments[:, Z].copy(),
        max_curvature=float(np.max(level.bends)) / length,
        vertices_table=table,
        edges=space.edges,
        rod=segment,
        model=SPATIAL,
        space=space,
    )


def _outcome(climbed: Climbed, tolerance: float) -> Outcome:
    """How a refinement ended."""
    if climbed.ending is not RelaxEnding.SETTLED:
        return Outcome.UNREACHED
    if climbed.passed:
        return Outcome.UNWOUND
    if not climbed.is_stable:
        return Outcome.UNSTABLE
    return Outcome.CONVERGED if climbed.error <= tolerance else Outcome.COARSE


def _curve(segment: ClampedRod, climbed: Climbed) -> SpaceCurve:
    """The refined curve in SI, in the frame of the left pivot."""
    length, clamp = segment.free_length, segment.clamp
    tangents = clamp_tangents(segment)
    tilted = clamp_tangents(segment, climbed.level.tilts)
    table = climbed.level.table * np.repeat([length, 1.0, 1.0 / length], 3)
    table[:, :3] += 0.5 * clamp * tangents[0]
    force = segment.stiffness / length**2
    return SpaceCurve(
        table=table,
        edges=climbed.edges * length,
        tangents=tilted,
        chord=np.array([*segment.chord, 0.0]),
        length=segment.length,
        clamp=clamp,
        forces=climbed.level.forces * force,
        moments=climbed.level.moments * force * length,
    )


def _mean_height(space: SpaceCurve) -> float:
    """Mean distance of the free rod from the chord between the pivots as seen from the front, positive to its left [m].

    Slopes and second derivatives are those of the table: seen from the front, a rod in space is not as long as it is.
    """
    x, y = space.chord[:2]
    heights = x * space.coordinate(Y) - y * space.coordinate(X)
    return float(integral(heights, space.edges)) / max(math.hypot(x, y), 1e-300) / (space.length - space.clamp)


def _front(space: SpaceCurve) -> Array:
    """Table (m+1, 6) of the curve as it looks from the front: see `Equilibrium.vertices_table`."""
    slope, bend = space.slopes, space.bends
    speed = np.linalg.norm(slope, axis=1)
    angle = np.unwrap(np.arctan2(slope[:, Y], slope[:, X]))
    seen = np.maximum(slope[:, X] ** 2 + slope[:, Y] ** 2, 1e-300)
    turning = (slope[:, X] * bend[:, Y] - slope[:, Y] * bend[:, X]) / seen
    gain = np.sum(slope * bend, axis=1) / speed
    return np.column_stack([space.vertices[:, :Z], angle, turning, speed - 1.0, gain])


def _clearance(space: SpaceCurve) -> float:
    """Smallest distance in space between vertices that are not neighbours [m]."""
    places = space.vertices
    apart = max(2, int(APART * (len(places) - 1)))
    return float(nearest_parts(np.ascontiguousarray(places), apart, np.linalg.norm(places[-1] - places[0])))
