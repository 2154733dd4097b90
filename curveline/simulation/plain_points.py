"""Points of a sweep at which no rod has difficulties: all their states at once, as arrays with a row per state.

That is most points of most sweeps. A point is plain if every segment of it is a planar rod whose states one kernel
finds, if all of these stay in their plane, and if stretch is within the tolerance: then `simulate` comes to the very
same numbers. The others are left to it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.choice import AUTO, beyond
from curveline.rod.models.model_error import HONESTY, SAFETY, STRAIGHT, asked_of
from curveline.rod.planar.lateral import PRECISION
from curveline.rod.states.equilibrium import PLANAR
from curveline.rod.states.plain_curves import STATES_PER_ROD, plain_curves
from curveline.rod.states.plain_states import COARSE_LATERAL, FINE_LATERAL, MOVED_BY_STRETCH, MOVED_BY_WEIGHT
from curveline.rod.states.refined import ERROR, SPREAD
from curveline.rod.states.slack import are_straight
from curveline.simulation.pose_batch import names_of
from curveline.simulation.results import Settings
from curveline.simulation.simulate import scene_rod
from curveline.simulation.sweep import Sweep
from curveline.simulation.swept_poses import Array, Numbers, SweptPoses
from curveline.units import to_mm

SCENE_POINTS = 201 * 128
"""Points of curves that are computed at once, of one state per point of the sweep: some 10 ms of work, and 1 MB."""
MOST_AT_ONCE = 128
Flags = npt.NDArray[np.bool_]


class PlainStates(NamedTuple):
    """The states at some points of a sweep, in the order of points and segments, of each the highest first.

    `facts (s, PLAIN_NUMBERS)` are the numbers of the kernel; `curves (s, k, 2)` [mm] in the display's frame, k being 0
    if nobody wants them; `seconds` is what a point took.
    """

    point: Numbers  # (s,) from 1
    segment: Numbers  # (s,) from 0
    name: npt.NDArray[np.str_]  # (s,)
    wanted: Flags  # (s,)
    facts: Array
    curves: Array
    seconds: float

    def part(self, begin: int, end: int) -> PlainStates:
        """The states at the points from `begin` up to `end`, which is none of them."""
        return self.of_rows(slice(*np.searchsorted(self.point, [begin, end]).tolist()))

    def of_rows(self, rows: Any) -> PlainStates:
        """Some of the states; `rows` as arrays are indexed."""
        name, wanted, facts = self.name[rows], self.wanted[rows], self.facts[rows]
        return PlainStates(self.point[rows], self.segment[rows], name, wanted, facts, self.curves[rows], self.seconds)

    @classmethod
    def joined(cls, parts: Sequence[PlainStates]) -> PlainStates:
        """The states of all segments in order, given those of each."""
        if len(parts) == 1:
            return parts[0]
        columns = [np.concatenate(each) for each in zip(*(part[:-1] for part in parts), strict=True)]
        point, segment, name, wanted, facts, curves = columns
        order = np.argsort(point, kind="stable")
        return cls(point, segment, name, wanted, facts, curves, parts[0].seconds).of_rows(order)


class PlainSweep:
    """A sweep of rods in their plane, and how it is to be simulated; `with_curves` if somebody wants these."""

    def __init__(self, sweep: Sweep, settings: Settings, *, with_curves: bool) -> None:
        self.sweep = sweep
        self.settings = settings
        self.points = settings.points if with_curves else 0

    @staticmethod
    def fits(sweep: Sweep, settings: Settings) -> bool:
        """True if points of a sweep can be plain, asked for like this."""
        scene = sweep.file.scene
        if sweep.poses is None or settings.model not in (AUTO, PLANAR) or tuple(settings.windings) != (0,):
            return False
        if scene.display.rod.relaxation is not None:
            # What its set could do is asked of each point.
            return False
        return not settings.explained and not any(beyond(scene_rod(scene, i)) for i in range(len(scene.segments)))

    @cached_property
    def rods(self) -> tuple[ClampedRod, ...]:
        """The rods of the shape as it stands in its file, left to right."""
        scene = self.sweep.file.scene
        return tuple(scene_rod(scene, index) for index in range(len(scene.segments)))

    @property
    def poses(self) -> SweptPoses:
        """Those that the sweep runs through."""
        found = self.sweep.poses
        assert found is not None, "asked of a sweep that does not fit"
        return found

    @property
    def at_once(self) -> int:
        """Points that are best computed together."""
        return max(1, min(MOST_AT_ONCE, SCENE_POINTS // max(1, self.points)))

    def states(self, numbers: Numbers) -> tuple[Flags, PlainStates]:
        """Which of the points `numbers (m,)`, from 1 and rising, are plain, and the states at those."""
        found = [self._of_segment(index, numbers) for index in range(len(self.rods))]
        is_plain = np.logical_and.reduce([counts > 0 for counts, _ in found])
        kept = [states if is_plain.all() else states.of_rows(np.repeat(is_plain, counts)) for counts, states in found]
        return is_plain, PlainStates.joined(kept)

    def _of_segment(self, index: int, numbers: Numbers) -> tuple[Numbers, PlainStates]:
        """How many states a segment has at points (m,), 0 for one that is not plain, and the states."""
        rod, wanted = self.rods[index], self.sweep.file.scene.segments[index].state
        poses, pivots = self.poses.poses(index, numbers - 1), self.poses.pivots(index, numbers - 1)
        curves = np.empty((STATES_PER_ROD * numbers.size, self.points, 2))
        asked = asked_of(rod, self.settings.tolerance)
        counts, facts = plain_curves((poses, pivots), rod.bearing, rod.dead_loads(), asked, curves)
        names = np.array(names_of(counts, facts, poses), dtype=np.str_)
        in_mm: Any = to_mm(curves[: len(facts)])  # type: ignore[arg-type]
        at, segment = np.repeat(np.arange(numbers.size), counts), np.full(len(facts), index)
        states = PlainStates(numbers[at], segment, names, names == wanted, facts, in_mm, 0.0)
        straight = are_straight(poses, rod.bearing)[at]
        sound = (
            ~straight
            & self._are_plain(facts, is_weighed=not math.isnan(asked.weight))
            & np.isfinite(in_mm).all(axis=(1, 2))
        )
        if sound.all():
            return counts, states
        is_whole = np.ones(numbers.size, dtype=np.bool_)
        is_whole[at[~sound]] = False
        return counts * is_whole, states.of_rows(is_whole[at])

    def _are_plain(self, facts: Array, *, is_weighed: bool) -> Flags:
        """True for the states that `model_states` takes as the planar model has them."""
        coarse, fine, moved = facts[:, COARSE_LATERAL], facts[:, FINE_LATERAL], facts[:, MOVED_BY_STRETCH]
        lowest = fine + (fine - coarse) / 3.0
        plain: Flags = lowest > HONESTY * np.abs(fine - coarse) + PRECISION * np.abs(fine)
        stretch = SAFETY * moved if self.settings.model == AUTO else 0.0
        plain &= np.isfinite(moved) & (facts[:, ERROR] + stretch <= self.settings.tolerance)
        if is_weighed:
            plain &= np.isfinite(facts[:, MOVED_BY_WEIGHT])
        return plain & (facts[:, SPREAD] < STRAIGHT)
