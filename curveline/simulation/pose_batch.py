"""The states of one rod between nodes that stand anywhere: many poses at once, on threads, a row per state.

Nothing but numbers is made of a pose whose rod has no difficulties, which is most of them; a state itself, with its
curve, and bounds on what the model leaves out are there on demand.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from curveline.errors import InvalidInput
from curveline.listening import SILENT, Listener
from curveline.notebook import html_of
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.choice import AUTO, ModelledStates, SearchRequest, beyond, model_states
from curveline.rod.planar.richardson import EIGENVALUE
from curveline.rod.problem import Pose
from curveline.rod.states.equilibrium import EXTENSIBLE, Equilibrium
from curveline.rod.states.identity import MIDDLE, PEAK, VALLEY
from curveline.rod.states.plain_states import Asked, plain_batch
from curveline.rod.states.planar_states import find_states
from curveline.rod.states.refined import (
    CLEARANCE,
    CROSSES,
    ENERGY,
    ERROR,
    HEIGHT,
    LEFT_X,
    LEVEL,
    RIGHT_MOMENT,
    SHARPEST,
    WRAPS,
)
from curveline.rod.states.slack import are_straight, is_straight
from curveline.scene import Display, Scene
from curveline.simulation.simulate import DEFAULT_TOLERANCE, scene_rod
from curveline.system.portable import cores

Array = npt.NDArray[np.float64]

CHUNK = 128
"""Poses that a thread takes at once: some 10 ms of work."""
TAKEN = (ENERGY, HEIGHT, ERROR, EIGENVALUE, CLEARANCE, SHARPEST, CROSSES, WRAPS, *range(LEFT_X, RIGHT_MOMENT + 1))
"""Of the numbers of a state, those that a row has."""
HEAD = ("pose", "state", "energy mJ", "mean height mm", "error mm")


class _Rows(NamedTuple):
    """States of some poses: how many each has, their names, their numbers (s, len(TAKEN))."""

    counts: npt.NDArray[np.int64]
    names: list[str]
    numbers: Array


@dataclass(frozen=True)
class PoseStates:
    """Every stable state that a planar rod has at each of many poses: arrays with a value per state.

    Of a rod without any to spare those that it has as it stretches: one that is called straight, or two. In SI and in
    the frame of the left pivot, as `Equilibrium` has them; of the states at a pose the highest is first.
    """

    rod: ClampedRod  # the rod at the pose of the shape
    poses: Array  # (m, 6): x, y [m], angles of the left and right clamp [rad], length of rod, where it begins [m]
    tolerance: float  # [m]
    pose: npt.NDArray[np.int64]  # (s,), the number of its pose, from 0
    name: npt.NDArray[np.str_]  # (s,), such as peak or valley
    energy: Array  # (s,) [J]
    mean_height: Array  # (s,) [m]
    error: Array  # (s,) [m], estimated largest error of the curve
    lowest_eigenvalue: Array  # (s,) [EI/L^2]
    clearance: Array  # (s,) [m]
    max_curvature: Array  # (s,) [1/m]
    crosses_itself: npt.NDArray[np.bool_]  # (s,)
    wraps_clamp: npt.NDArray[np.bool_]  # (s,)
    clamp_force: Array  # (s, 2, 2) [N]
    clamp_moment: Array  # (s, 2) [N m]

    def __len__(self) -> int:
        return len(self.poses)

    def rod_at(self, pose: int) -> ClampedRod:
        """The rod at the pose of this number."""
        return self.rod.moved_to(Pose(*self.poses[pose].tolist()))

    def states(self, pose: int) -> list[Equilibrium]:
        """The states at one pose, with their curves."""
        return _states_of(self.rod_at(pose), self.tolerance)

    def modelled(self, pose: int, model: str = AUTO) -> ModelledStates:
        """The states at one pose by the smallest model that they allow, with bounds on what it leaves out."""
        return model_states(self.rod_at(pose), SearchRequest(self.tolerance, (0,), model))

    def _repr_html_(self) -> str:
        columns = (self.pose, self.name, 1e3 * self.energy, 1e3 * self.mean_height, 1e3 * self.error)
        rows = zip(*(column.tolist() for column in columns), strict=True)
        return html_of(f"{len(self.pose)} states at {len(self)} poses", [HEAD, *rows])


def states_at_poses(
    scene: Scene, poses: npt.ArrayLike, tolerance: float = DEFAULT_TOLERANCE, jobs: int | None = None,
    listener: Listener = SILENT,
) -> PoseStates:  # fmt: skip
    """Every stable planar state of the rod of a `scene` with one segment, at `poses (m, 5)`, to `tolerance` [m].

    Of a pose: where the right pivot is, seen from the left one [m], the clamps' angles [rad], the length of rod [m].
    Of a rod whose natural curvature varies along it they may be (m, 6): where it begins, by the arc length from the
    rod's left end [m]; else both tails are equally long.
    `jobs` threads share the work, one per core for None or 0; the answer does not depend on them. Raises InvalidInput
    for poses of another form, and for a scene that a planar rod cannot show.
    """
    rod = _planar_rod(scene)
    table = _with_begins(_checked(poses), scene.display)
    if not 0.0 < tolerance < math.inf:
        raise InvalidInput(f"no curve has a tolerance of {tolerance!r}", "choose a length above 0 in m, such as 1e-4")
    listener.computing()
    work = partial(_rows_of, rod, tolerance)
    found = [work(table[:0])]  # what runs first loads the kernels, which threads would do several times
    chunks = [table[begin : begin + CHUNK] for begin in range(0, len(table), CHUNK)]
    done = 0
    with listener.progress("simulating", len(table)) as heard, ThreadPoolExecutor(max(1, jobs or cores())) as threads:
        waiting = [threads.submit(work, chunk) for chunk in chunks]
        try:
            for each in waiting:
                found.append(each.result())
                done += found[-1].counts.size
                heard(done)
        except BaseException:
            threads.shutdown(cancel_futures=True)
            raise
    return _gathered(rod, table, tolerance, found)


def _planar_rod(scene: Scene) -> ClampedRod:
    if len(scene.segments) != 1:
        hint = "take a shape of two nodes, or simulate this one"
        raise InvalidInput(f"poses are of one segment, and this shape has {len(scene.segments)}", hint)
    rod = scene_rod(scene, 0)
    if rod.needs_space:
        what = " and ".join(beyond(rod))
        raise InvalidInput(
            f"the states at poses are planar, and this shape has {what}", "simulate its shapes one by one"
        )
    return rod


def _checked(poses: npt.ArrayLike) -> Array:
    """The poses as an array (m, 5), or (m, 6), of finite numbers."""
    hint = "a row per pose: x, y [m], angles of both clamps [rad], length of rod [m]"
    try:
        table = np.ascontiguousarray(poses, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"these poses are no numbers: {error}", hint) from None
    if table.ndim != 2 or table.shape[1] not in (len(Pose._fields) - 1, len(Pose._fields)):
        raise InvalidInput(f"poses are an array (m, 5), not {table.shape}", hint)
    if bad := np.flatnonzero(~np.isfinite(table).all(axis=1)).tolist():
        raise InvalidInput(f"pose {bad[0]} is not finite, counted from 0: {table[bad[0]].tolist()}", hint)
    return table


def _with_begins(poses: Array, display: Display) -> Array:
    """The `poses (m, 5 or 6)` with where of the rod's material they begin, in the middle if they do not say it: (m, 6).

    One that is alike all along begins at 0.
    """
    begins = 0.5 * (display.rod.total_length - poses[:, 4:5])
    if display.rod.profile is None:
        begins[:] = 0.0
    elif poses.shape[1] == len(Pose._fields):
        begins = poses[:, 5:]
    return np.ascontiguousarray(np.hstack([poses[:, :5], begins]))


def _rows_of(rod: ClampedRod, tolerance: float, poses: Array) -> _Rows:
    """The states at some poses; those whose rods have difficulties are looked at one by one."""
    asked = Asked(tolerance, math.nan, math.nan, sideways=False)
    counts, states = plain_batch(poses, rod.bearing, *rod.dead_loads(), asked)
    numbers = states[:, TAKEN]
    names = names_of(counts, states, poses)
    straight = are_straight(poses, rod.bearing)
    pieces, all_names, done = [], [], 0
    ends = np.cumsum(counts)
    begins, looked_at = ends - counts, np.flatnonzero((counts == 0) | straight)
    for place, begin, end in zip(looked_at.tolist(), begins[looked_at].tolist(), ends[looked_at].tolist(), strict=True):
        others = _states_of(rod.moved_to(Pose(*poses[place].tolist())), tolerance)
        pieces += [numbers[done:begin], np.array([_numbers(each) for each in others]).reshape(-1, len(TAKEN))]
        all_names += [*names[done:begin], *(each.name for each in others)]
        counts[place], done = len(others), end
    return _Rows(counts, all_names + names[done:], np.concatenate([*pieces, numbers[done:]]))


def _states_of(rod: ClampedRod, tolerance: float) -> list[Equilibrium]:
    """The planar states of a rod, or those that it has as it stretches if it has none to spare."""
    if is_straight(rod):
        return list(model_states(rod, SearchRequest(tolerance, (0,), EXTENSIBLE)).states)
    return find_states(rod, tolerance)


def _numbers(state: Equilibrium) -> list[float]:
    """What a row has of a state, see TAKEN."""
    return [
        *(state.energy, state.mean_height, state.error, state.lowest_eigenvalue, state.clearance, state.max_curvature),
        *(float(state.crosses_itself), float(state.wraps_clamp), *state.clamp_force.ravel(), *state.clamp_moment),
    ]


def names_of(counts: npt.NDArray[np.int64], states: Array, poses: Array) -> list[str]:
    """Names of the states of rods without difficulties: their order tells, of a single one the side."""
    first = np.repeat(np.cumsum(counts) - counts, counts)
    rank, last = np.arange(len(states)) - first, np.repeat(counts, counts) - 1
    doubt = states[:, ERROR] + LEVEL * np.repeat(poses[:, 4], counts)
    height = states[:, HEIGHT]
    peak = (rank == 0) & ((last > 0) | (height > doubt))
    valley = (rank == last) & ((last > 0) | (height < -doubt))
    places = np.maximum(rank, 1).tolist()
    return [
        PEAK if up else VALLEY if down else f"{MIDDLE}-{place}"
        for up, down, place in zip(peak.tolist(), valley.tolist(), places, strict=True)
    ]


def _gathered(rod: ClampedRod, poses: Array, tolerance: float, found: list[_Rows]) -> PoseStates:
    counts = np.concatenate([each.counts for each in found])
    numbers = np.concatenate([each.numbers for each in found])
    energy, height, error, eigenvalue, clearance, sharpest, crosses, wraps = (numbers[:, i].copy() for i in range(8))
    return PoseStates(
        rod=rod,
        poses=poses,
        tolerance=tolerance,
        pose=np.repeat(np.arange(len(poses)), counts),
        name=np.array([name for each in found for name in each.names], dtype=np.str_),
        energy=energy,
        mean_height=height,
        error=error,
        lowest_eigenvalue=eigenvalue,
        clearance=clearance,
        max_curvature=sharpest,
        crosses_itself=crosses > 0.0,
        wraps_clamp=wraps > 0.0,
        clamp_force=numbers[:, 8:12].reshape(-1, 2, 2),
        clamp_moment=numbers[:, 12:].copy(),
    )
