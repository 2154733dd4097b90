"""A clamped rod cut in space, its planar states lifted into that, and the stable state in space they lead to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from curveline.kernels.forms import Vector
from curveline.kernels.kernel import shipped
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.geometry.rotations import exponential, multiply
from curveline.rod.planar.approach import fitting_mesh
from curveline.rod.problem import Array, mesh
from curveline.rod.profile import TURN, laid_free
from curveline.rod.spatial.energy import Shape, SpatialRod, moved
from curveline.rod.spatial.relax import (
    Relaxed,
    RelaxEnding,
    descend,
    is_stable,
    largest_turn,
    lowest_mode,
    newton,
    settle,
)
from curveline.rod.spatial.rolling import roll_on
from curveline.rod.spatial.twisting import spread_twist, spun
from curveline.rod.states.equilibrium import Equilibrium
from curveline.rod.states.slack import is_straight, straight_edges
from curveline.units import deg

LIFT_EDGES = 24
"""Edges with which a lifted state is first relaxed."""
RESTING_EDGES = (LIFT_EDGES, 48, 96, 192)
"""Edges with which a state is tried before it is said to leave its plane."""
NUDGE = 0.05
"""Largest turn [rad] with which a state is pushed off a plane in which it is unstable."""
SMALLEST_PART = 1.0 / 256.0
"""Of what points out of the plane, the least that is added at a time."""
FALL = deg(2.0)
"""Roll [rad] by which a clamp is turned on where the rod falls."""
LARGEST_TURN = 0.5
"""An edge that turns by more than this [rad] while a part is added may belong to another branch."""


def clamp_tangents(segment: ClampedRod, tilts: Sequence[float] | Array = (0.0, 0.0)) -> Array:
    """Tangents (2, 3) of the clamps, whose bearings may be tilted."""
    clamps = zip((segment.start + float(tilts[0]), segment.end + float(tilts[1])), segment.yaw, strict=True)
    rows = [(math.cos(yaw) * math.cos(along), math.cos(yaw) * math.sin(along), math.sin(yaw)) for along, yaw in clamps]
    return np.array(rows)


def spatial_rod(segment: ClampedRod, edges: Array) -> SpatialRod:
    """The free rod cut into `edges (n,)`, in units of its length and of EI in the plane."""
    length, bearing = segment.free_length, segment.bearing
    unit = length**2 / bearing.stiffness
    forces = np.zeros((edges.size + 1, 3))
    carried = np.array([segment.weight_x, -bearing.weight, segment.weight_z]) * length * unit
    forces[:-1] += 0.5 * edges[:, None] * carried
    forces[1:] += 0.5 * edges[:, None] * carried
    for load in segment.loads:
        places = np.concatenate([[0.0], np.cumsum(edges)])
        free = (load.at * segment.length - 0.5 * bearing.clamp) / length
        forces[np.argmin(np.abs(places - free))] += np.array([load.x, load.y, load.z]) * unit
    stiffness = [bearing.lateral, bearing.stiffness, bearing.twisting, segment.section.stretching_stiffness * length**2]
    tangents = clamp_tangents(segment)
    ends = np.array([segment.start, segment.start + segment.turn])
    chord = np.array([*segment.chord, 0.0]) - 0.5 * bearing.clamp * (tangents[0] + tangents[1])
    return SpatialRod(
        edges=edges,
        stiffness=np.array(stiffness) / bearing.stiffness,
        natural=natural_of(segment, edges),
        forces=forces,
        chord=chord / length,
        frames=np.asarray(frames_of(ends, np.array(segment.yaw), np.array(segment.roll))),
        held=np.ones(3),
        bearings=(bearing.give / length, bearing.play, 0.5 * bearing.clamp / length),
    )


def natural_of(segment: ClampedRod, edges: Array) -> Array:
    """Rest curvatures about m1 and m2 and rest twist of the vertices between `edges (n,)`, (n+1, 3), times the length.

    In the plane they are what the free rod turns by from edge to edge, over the cell.
    """
    length = segment.free_length
    out = np.empty((edges.size + 1, 3))
    out[:] = -segment.lateral_curvature * length, segment.natural_curvature * length, 0.0
    if segment.is_unevenly_curved:
        halves = np.concatenate([[0.0], 0.5 * edges, [0.0]])
        out[:, 1] += rest_of(segment, edges)[TURN] / (halves[:-1] + halves[1:])
    return out


def rest_of(segment: ClampedRod, edges: Array) -> Array:
    """What vertices have when the rod is free, (3, n+1), but for what it has all along: see `profile`."""
    if not segment.is_unevenly_curved:
        return np.zeros((3, edges.size + 1))
    begin = segment.pose.begin + 0.5 * segment.clamp
    return np.asarray(laid_free(segment.bearing.profile, begin, segment.free_length, edges))


def frame(angle: float, yaw: float = 0.0, roll: float = 0.0) -> Array:
    """Quaternion (4,) of one frame: see `frames_of`."""
    return np.asarray(frames_of(np.array([angle]), np.array([yaw]), np.array([roll]))[0])


@shipped(Vector, Vector, Vector)
def frames_of(angles, yaws, rolls):
    """Quaternions (n, 4) of frames whose tangents have `angles` in the plane and `yaws` out of it, turned by `rolls`.

    In the plane m2 points to the viewer, along +z, and m1 across the rod to its left.
    """
    out = np.empty((angles.size, 4))
    turn, product, vector = np.empty(4), np.empty(4), np.empty(3)
    for j in range(angles.size):
        # Columns y, z, x: the axes that the frame of a tangent along +x has.
        out[j] = 0.5
        for axis, angle in ((1, angles[j]), (0, -yaws[j]), (2, rolls[j])):
            vector[:] = 0.0
            vector[axis] = angle
            exponential(vector, turn)
            multiply(out[j], turn, product)
            out[j] = product
    return out


def lifting_mesh(segment: ClampedRod, n: int) -> Array:
    """About `n` edges (m,) for a segment in space: equal ones for a straight rod, which stretches before it bends
    sharply at its clamps."""
    if is_straight(segment):
        return np.asarray(mesh(segment.scaled().at, straight_edges(segment, n)))
    return fitting_mesh(segment.scaled(), n)


def lift(segment: ClampedRod, state: Equilibrium, n: int = LIFT_EDGES) -> tuple[SpatialRod, Shape]:
    """The rod of `segment` on about `n` edges and in it the planar `state`, turned as linearly as the clamps' roll."""
    edges = lifting_mesh(segment, n)
    middles = np.cumsum(edges) - 0.5 * edges
    places = np.concatenate([[0.0], np.cumsum(state.edges)]) / state.rod.free_length
    angles = np.interp(middles, places, state.angles)
    roll = segment.roll[0] + (segment.roll[1] - segment.roll[0]) * middles
    frames = frames_of(angles, np.zeros(angles.size), roll)
    tilts = 0.0, 0.0
    if segment.has_giving_clamps:
        first, last = state.angles[[0, -1]].tolist()
        tilts = first - segment.start, last - segment.start - segment.turn
    return spatial_rod(segment, edges), Shape(_strains(segment, state, middles, angles), frames, tilts=tilts)


def _strains(segment: ClampedRod, state: Equilibrium, middles: Array, angles: Array) -> Array:
    """Axial strains (n,) of a planar state, from the forces: without them no rod would buckle under its thrust."""
    start = 0.5 * segment.clamp
    passed = -state.clamp_force[0] - np.outer(middles * segment.free_length, [0.0, -segment.weight])
    for load in segment.loads:
        passed[middles * segment.free_length > load.at * segment.length - start] -= (load.x, load.y)
    tension = passed[:, 0] * np.cos(angles) + passed[:, 1] * np.sin(angles)
    return np.asarray(tension / segment.section.stretching_stiffness)


def stays_in_plane(segment: ClampedRod, state: Equilibrium) -> bool:
    """True if the planar `state` is stable against all that a rod in space can do, were nothing to push it aside."""
    return is_stable(*lift(segment.part(0.0), state, 2 * LIFT_EDGES))


def relax_in_space(segment: ClampedRod, state: Equilibrium) -> tuple[SpatialRod, Relaxed]:
    """The stable state in space that the planar `state` leads to while what points out of the plane is added to it.

    First what lies in the plane is relaxed; where that is unstable, it is pushed off towards the viewer. Then the last
    clamp is rolled against the first. Parts that turn the rod by much are halved, as long as that helps, so that the
    branch is kept where there is one.
    """
    rod, shape, is_pushed = _rested(segment.part(0.0), state)
    if is_pushed:
        _, mode = lowest_mode(rod, shape)
        _, turn = moved(rod, shape, mode, 1.0)
        sideways = float(np.sum(mode[2::4]))
        way = -1.0 if sideways < 0.0 else 1.0
        shape, _ = moved(rod, shape, mode, way * NUDGE / turn)
    rod, relaxed = _aside(segment, rod, descend(rod, shape))
    if segment.is_flat:
        return rod, relaxed
    rod, relaxed = _rolled(rod, relaxed, segment.roll[1] - segment.roll[0])
    if relaxed.ending is not RelaxEnding.SETTLED:
        return rod, relaxed
    rod = spatial_rod(segment, rod.edges)
    settled = settle(rod, relaxed.shape)
    return rod, settled._replace(iterations=relaxed.iterations + settled.iterations)


def _rolled(rod: SpatialRod, relaxed: Relaxed, turn: float) -> tuple[SpatialRod, Relaxed]:
    """A rod whose last clamp is rolled on by `turn` [rad] and the state that this leads to, downhill at every fold."""
    while turn != 0.0 and relaxed.ending is RelaxEnding.SETTLED:
        shape, done, taken = roll_on(rod, relaxed.shape, turn)
        falls = math.copysign(min(abs(turn - done), FALL), turn)
        if done == turn:
            return _with_roll(rod, done), relaxed._replace(shape=shape, iterations=relaxed.iterations + taken)
        rod, turn = _with_roll(rod, done + falls), turn - done - falls
        fallen = descend(rod, spread_twist(rod, shape, falls))
        relaxed = fallen._replace(iterations=relaxed.iterations + taken + fallen.iterations)
    return rod, relaxed


def _with_roll(rod: SpatialRod, turn: float) -> SpatialRod:
    """The rod with its last clamp rolled on by `turn` [rad]."""
    return rod._replace(frames=np.array([rod.frames[0], spun(rod.frames[1], turn)]))


def _aside(segment: ClampedRod, rod: SpatialRod, relaxed: Relaxed) -> tuple[SpatialRod, Relaxed]:
    """A flat rod with all that points out of the plane added to it but what rolls its last clamp against the first."""
    unwound = replace(segment, roll=(segment.roll[0], segment.roll[0]))
    if unwound.is_flat:
        return rod, relaxed
    # A clamp must not turn so far at once that the rod could take it for a turn the other way.
    largest = min(1.0, 0.8 * LARGEST_TURN / max(map(abs, (*unwound.yaw, *unwound.roll, 1e-9))))
    share, step = 0.0, largest
    while share < 1.0 and relaxed.ending is RelaxEnding.SETTLED:
        now = min(1.0, share + step)
        nearer = spatial_rod(unwound.part(now), rod.edges)
        trial = descend(nearer, relaxed.shape)
        if step > SMALLEST_PART and (
            trial.ending is not RelaxEnding.SETTLED or largest_turn(trial.shape, relaxed.shape) > LARGEST_TURN
        ):
            step *= 0.5
            continue
        rod, relaxed, share = nearer, trial._replace(iterations=relaxed.iterations + trial.iterations), now
        step = min(2.0 * step, largest)
    return rod, relaxed


def _rested(segment: ClampedRod, state: Equilibrium) -> tuple[SpatialRod, Shape, bool]:
    """A flat segment's equilibrium near a planar state, on the fewest edges that hold it; True if none do.

    Near a bifurcation a lifted shape does not tell whether it is stable, and coarse edges leave the plane too early.
    """
    rests: list[tuple[SpatialRod, Shape]] = []
    for n in RESTING_EDGES:
        rod, shape = lift(segment, state, n)
        found = newton(rod, shape)
        if found.ending is RelaxEnding.SETTLED and largest_turn(found.shape, shape) < LARGEST_TURN:
            shape = found.shape
        if is_stable(rod, shape):
            return rod, shape, False
        rests.append((rod, shape))
    return *rests[0], True
