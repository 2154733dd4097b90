"""A segment in space: its spatial rod, its planar states lifted into it, and the stable spatial state they lead to."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from curveline.rod._jit import njit
from curveline.rod.geometry.rotations import exponential, multiply
from curveline.rod.planar.approach import fitting_mesh
from curveline.rod.problem import Array, Bearing, Pose
from curveline.rod.section import Section
from curveline.rod.spatial.energy import Shape, SpatialRod, moved
from curveline.rod.spatial.relax import Relaxed, RelaxEnding, descend, is_stable, largest_turn, lowest_mode, newton
from curveline.rod.states.equilibrium import ClampedRod, Equilibrium

LIFT_EDGES = 24
"""Edges with which a lifted state is first relaxed."""
RESTING_EDGES = (LIFT_EDGES, 48, 96, 192)
"""Edges with which a state is tried before it is said to leave its plane."""
NUDGE = 0.05
"""Largest turn [rad] with which a state is pushed off a plane in which it is unstable."""
SMALLEST_PART = 1.0 / 256.0
"""Of what points out of the plane, the least that is added at a time."""
NEARLY = 1e-6
"""What points out of the plane, in rad and units of EI over powers of the length, that no more than rounds a scene."""
LARGEST_TURN = 0.5
"""An edge that turns by more than this [rad] while a part is added may belong to another branch."""


@dataclass(frozen=True)
class SpatialSegment:
    """One segment as the physics sees it in space, in SI; x and y span the display's plane, z points to the viewer.

    `rod` is what of it lies in the plane, where a state starts from; `weight` and `loads` are all there is. `yaw` turns
    the clamps' tangents out of the plane towards +z, then `roll` turns the clamps about their tangents. `loads` are
    (fraction of the length, force) in order of the fraction; `lateral_curvature` is the free rod's towards +z.
    """

    rod: ClampedRod
    section: Section
    yaw: tuple[float, float] = (0.0, 0.0)  # [rad]
    roll: tuple[float, float] = (0.0, 0.0)  # [rad]
    weight: tuple[float, float, float] = (0.0, 0.0, 0.0)  # [N/m]
    loads: tuple[tuple[float, float, float, float], ...] = ()  # force in [N]
    lateral_curvature: float = 0.0  # [1/m]

    @property
    def is_flat(self) -> bool:
        """True if nothing points out of the plane."""
        sideways = (*self.yaw, self.roll[1] - self.roll[0], self.roll[0], self.weight[2], self.lateral_curvature)
        return not any(sideways) and not any(load[3] for load in self.loads)

    @property
    def bearing(self) -> Bearing:
        """What stays the same when the nodes move, in the plane and out of it."""
        lateral, twisting = self.section.lateral_stiffness, self.section.twisting_stiffness
        return self.rod.bearing._replace(lateral=lateral, twisting=twisting)

    def moved_to(self, pose: Pose) -> SpatialSegment:
        """The same segment with its nodes elsewhere in the plane."""
        x, y, start, end, length = pose
        return replace(self, rod=replace(self.rod, chord=(x, y), start=start, end=end, length=length))

    @property
    def is_nearly_flat(self) -> bool:
        """True if what points out of the plane is no more than changes of a billionth make of nothing."""
        forces = (self.weight[2] * self.rod.free_length, *(load[3] for load in self.loads))
        turned = (*self.yaw, *self.roll, self.lateral_curvature * self.rod.free_length)
        return max(map(abs, (*turned, *(force * self._unit for force in forces)))) < NEARLY

    @property
    def needs_space(self) -> bool:
        """True if a planar model, whose weight points straight down, leaves out more of the scene than rounding."""
        return not self.is_nearly_flat or abs(self.weight[0]) * self.rod.free_length * self._unit >= NEARLY

    @property
    def _unit(self) -> float:
        """One over the unit of force, EI / L^2."""
        return self.rod.free_length**2 / self.rod.stiffness

    def part(self, share: float) -> SpatialSegment:
        """The same segment with a `share` of all that points out of the plane."""
        return replace(
            self,
            yaw=(share * self.yaw[0], share * self.yaw[1]),
            roll=(share * self.roll[0], share * self.roll[1]),
            weight=(*self.weight[:2], share * self.weight[2]),
            loads=tuple((at, x, y, share * z) for at, x, y, z in self.loads),
            lateral_curvature=share * self.lateral_curvature,
        )

    def edges(self, n: int) -> Array:
        """Edges (m,) of the free rod in units of its length, with a vertex under each load.

        About `n` equal ones, or where the rod bends in layers as many as those take.
        """
        at = np.array([load[0] for load in self.loads])
        places = (at * self.rod.length - 0.5 * self.rod.clamp) / self.rod.free_length
        forces = np.array([load[1:3] for load in self.loads]).reshape(-1, 2) * self.rod.free_length**2
        return fitting_mesh(self.rod.scaled()._replace(at=places, forces=forces / self.rod.stiffness), n)

    def clamp_frames(self) -> Array:
        """Frames (2, 4) of the clamps."""
        ends = (self.rod.start, self.rod.start + self.rod.turn)
        return np.asarray(frames_of(np.array(ends), np.array(self.yaw), np.array(self.roll)))

    def clamp_tangents(self) -> Array:
        """Tangents (2, 3) of the clamps."""
        along, yaw = np.array([self.rod.start, self.rod.end]), np.array(self.yaw)
        return np.column_stack([np.cos(yaw) * np.cos(along), np.cos(yaw) * np.sin(along), np.sin(yaw)])

    def spatial_rod(self, edges: Array) -> SpatialRod:
        """The free rod cut into `edges (n,)`, in units of its length and of EI in the plane."""
        rod, length = self.rod, self.rod.free_length
        unit = length**2 / rod.stiffness
        forces = np.zeros((edges.size + 1, 3))
        carried = np.array(self.weight) * length * unit
        forces[:-1] += 0.5 * edges[:, None] * carried
        forces[1:] += 0.5 * edges[:, None] * carried
        places = np.concatenate([[0.0], np.cumsum(edges)])
        for at, *force in self.loads:
            free = (at * rod.length - 0.5 * rod.clamp) / length
            forces[np.argmin(np.abs(places - free))] += np.array(force) * unit
        section = self.section
        stiffness = [section.lateral_stiffness, rod.stiffness, section.twisting_stiffness]
        stretch = section.stretching_stiffness * length**2
        tangents = self.clamp_tangents()
        chord = np.array([*rod.chord, 0.0]) - 0.5 * rod.clamp * (tangents[0] + tangents[1])
        return SpatialRod(
            edges=edges,
            stiffness=np.array([*stiffness, stretch]) / rod.stiffness,
            natural=np.array([-self.lateral_curvature * length, rod.natural_curvature * length, 0.0]),
            forces=forces,
            chord=chord / length,
            frames=self.clamp_frames(),
            held=np.ones(3),
        )


def frame(angle: float, yaw: float = 0.0, roll: float = 0.0) -> Array:
    """Quaternion (4,) of one frame: see `frames_of`."""
    return np.asarray(frames_of(np.array([angle]), np.array([yaw]), np.array([roll]))[0])


@njit
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


def lift(segment: SpatialSegment, state: Equilibrium, n: int = LIFT_EDGES) -> tuple[SpatialRod, Shape]:
    """The rod of `segment` on about `n` edges and in it the planar `state`, turned as linearly as the clamps' roll."""
    edges = segment.edges(n)
    middles = np.cumsum(edges) - 0.5 * edges
    places = np.concatenate([[0.0], np.cumsum(state.edges)]) / state.rod.free_length
    angles = np.interp(middles, places, state.angles)
    roll = segment.roll[0] + (segment.roll[1] - segment.roll[0]) * middles
    frames = frames_of(angles, np.zeros(angles.size), roll)
    return segment.spatial_rod(edges), Shape(_strains(segment, state, middles, angles), frames)


def _strains(segment: SpatialSegment, state: Equilibrium, middles: Array, angles: Array) -> Array:
    """Axial strains (n,) of a planar state, from the forces: without them no rod would buckle under its thrust."""
    rod = segment.rod
    passed = -state.clamp_force[0] - np.outer(middles * rod.free_length, [0.0, -rod.weight])
    for at, *force in rod.loads:
        passed[middles * rod.free_length > at * rod.length - 0.5 * rod.clamp] -= force
    tension = passed[:, 0] * np.cos(angles) + passed[:, 1] * np.sin(angles)
    return np.asarray(tension / segment.section.stretching_stiffness)


def stays_in_plane(segment: SpatialSegment, state: Equilibrium) -> bool:
    """True if the planar `state` is stable against all that a rod in space can do, were nothing to push it aside."""
    return is_stable(*lift(segment.part(0.0), state, 2 * LIFT_EDGES))


def relax_in_space(segment: SpatialSegment, state: Equilibrium) -> tuple[SpatialRod, Relaxed]:
    """The stable state in space that the planar `state` leads to while what points out of the plane is added to it.

    First what lies in the plane is relaxed; where that is unstable, it is pushed off towards the viewer. Parts that
    turn the rod by much are halved, as long as that helps, so that the branch is kept where there is one.
    """
    rod, shape, is_pushed = _rested(segment.part(0.0), state)
    if is_pushed:
        _, mode = lowest_mode(rod, shape)
        _, turn = moved(rod, shape, mode, 1.0)
        sideways = float(np.sum(mode[2::4]))
        way = -1.0 if sideways < 0.0 else 1.0
        shape, _ = moved(rod, shape, mode, way * NUDGE / turn)
    relaxed = descend(rod, shape)
    if segment.is_flat:
        return rod, relaxed
    # A clamp must not turn so far at once that the rod could take it for a turn the other way.
    largest = min(1.0, 0.8 * LARGEST_TURN / max(map(abs, (*segment.yaw, *segment.roll, 1e-9))))
    share, step = 0.0, largest
    while share < 1.0 and relaxed.ending is RelaxEnding.SETTLED:
        now = min(1.0, share + step)
        nearer = segment.part(now).spatial_rod(rod.edges)
        trial = descend(nearer, relaxed.shape)
        if step > SMALLEST_PART and (
            trial.ending is not RelaxEnding.SETTLED or largest_turn(trial.shape, relaxed.shape) > LARGEST_TURN
        ):
            step *= 0.5
            continue
        rod, relaxed, share = nearer, trial._replace(iterations=relaxed.iterations + trial.iterations), now
        step = min(2.0 * step, largest)
    return rod, relaxed


def _rested(segment: SpatialSegment, state: Equilibrium) -> tuple[SpatialRod, Shape, bool]:
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
