"""The stable states of one segment of a display between nodes that stand anywhere: a row each, alike for all uses.

A row has what a state asks of motors, and from what Newton's method finds it again, so that no search is needed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from curveline.errors import InvalidInput
from curveline.planning.actuator_loads import MOMENT, clamp_loads_of_state
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.choice import SearchRequest, beyond, model_states
from curveline.rod.problem import Pose, mesh
from curveline.rod.states.equilibrium import EXTENSIBLE, Equilibrium
from curveline.rod.states.planar_states import find_states
from curveline.rod.states.slack import is_straight
from curveline.scene import PEAK, Display, Node, Scene, Segment
from curveline.simulation.simulate import scene_rod

Array = npt.NDArray[np.float64]
Entries = npt.NDArray[np.void]

POINTS = 33
"""Positions of a curve, equally spaced from pivot to pivot."""
EDGES = 48
"""Edges of the angles from which Newton's method begins."""
ENTRY = np.dtype(
    [
        ("pose", "<i8"),  # its number, from 0
        ("name", "<U24"),  # such as peak or valley
        ("simple", "?"),  # whether a planar display can show it
        ("energy", "<f8"),  # [J]
        ("mean_height", "<f8"),  # [m] over the chord
        ("error", "<f8"),  # [m]
        ("lowest_eigenvalue", "<f8"),  # [EI/L^2]
        ("max_curvature", "<f8"),  # [1/m], away from the natural one
        ("loads", "<f8", (6,)),  # as of `planning.actuator_loads.ClampLoads` [N, N, N m] of the left and the right node
        ("curve", "<f8", (POINTS, 2)),  # [m], seen from the left pivot
        ("angles", "<f8", (EDGES,)),  # [rad]
        ("multipliers", "<f8", (2,)),
    ]
)
NO_LOADS: Array = np.zeros(0)
MOMENTS = np.array([MOMENT, 3 + MOMENT])
FORCES = np.setdiff1d(np.arange(6), MOMENTS)


class PoseTask(NamedTuple):
    """Poses (m, 6) of a rod whose states are to be found, curves to `tolerance` [m]; the first has a number."""

    rod: ClampedRod
    poses: Array
    tolerance: float
    first: int = 0

    def perform(self) -> Entries:
        """The stable states (s,), those of a pose from the highest down; see `ENTRY`."""
        rows = [
            _row(self.first + place, state)
            for place, pose in enumerate(self.poses.tolist())
            for state in states_at(self.rod.moved_to(Pose(*pose)), self.tolerance)
        ]
        return np.array(rows, dtype=ENTRY)


def level_scene(display: Display) -> Scene:
    """A display with all its nodes level and its rod straight."""
    nodes = (Node(0.0, 0.0),) * display.node_count
    return Scene(display.name, display, nodes, (Segment(display.span, PEAK),) * (display.node_count - 1))


def segment_rod(display: Display) -> ClampedRod:
    """The rod between two nodes of a display, to be moved to any pose; InvalidInput for one that leaves its plane."""
    rod = scene_rod(level_scene(display), 0)
    if rod.needs_space:
        what = " and ".join(beyond(rod))
        raise InvalidInput(f"an atlas is of planar states, and {display.name} has {what}", "simulate its shapes")
    return rod


def with_begins(poses: Array, display: Display) -> Array:
    """The `poses (m, 5)` with where of the rod's material they begin, tails alike, 0 for a rod that is even: (m, 6)."""
    begins = np.zeros((len(poses), 1))
    if display.rod.profile is not None:
        begins = 0.5 * (display.rod.total_length - poses[:, 4:5])
    return np.ascontiguousarray(np.hstack([poses, begins]))


def states_at(rod: ClampedRod, tolerance: float) -> list[Equilibrium]:
    """The stable states of a rod, as it stretches where it has none to spare."""
    if not is_straight(rod):
        return find_states(rod, tolerance)
    found = model_states(rod, SearchRequest(tolerance, (0,), EXTENSIBLE)).states
    return [state for state in found if state.stable]


def _row(pose: int, state: Equilibrium) -> tuple[object, ...]:
    angles, multipliers = state.start_on(mesh(NO_LOADS, EDGES))
    return (
        pose,
        state.name,
        state.simple,
        state.energy,
        state.mean_height,
        state.error,
        state.lowest_eigenvalue,
        state.max_curvature,
        clamp_loads_of_state(state).low,
        state.curve(POINTS),
        angles,
        multipliers,
    )


def force_of(entries: Entries) -> Array:
    """The largest force that a state asks of a motor, extruding or lifting, (s,) [N]."""
    most: Array = np.abs(entries["loads"][:, FORCES]).max(axis=1)
    return most


def moment_of(entries: Entries) -> Array:
    """The largest moment that a state asks of a motor, (s,) [N m]."""
    most: Array = np.abs(entries["loads"][:, MOMENTS]).max(axis=1)
    return most


def share_of(entries: Entries, display: Display) -> Array:
    """The largest share of what rod or motors can give that a state asks for, (s,)."""
    drive, bends = display.drive, entries["max_curvature"] / display.rod.max_curvature
    share: Array = np.maximum.reduce(
        [bends, force_of(entries) / drive.max_force, moment_of(entries) / drive.max_moment]
    )
    return share
