"""Where on a grid states come and go: between neighbouring points that have unlike many of them.

From the point that has more, each state is followed to the other: it ends at a fold or a bifurcation, which is located
for the continuous rod; or the rod gets taut. Where none can be followed to its end the way is halved.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from curveline.atlases.entries import Array, Entries, states_at
from curveline.atlases.grid import Grid
from curveline.atlases.tasks import Doer
from curveline.listening import Heard
from curveline.rod.branches.control_path import straight_path
from curveline.rod.branches.special_points import SpecialKind, critical
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.problem import Pose
from curveline.rod.states.slack import is_slack
from curveline.units import mm

PRECISE = 0.01
"""How exactly a fold is located, in the unit of its axis: mm or degrees."""
FOLD, BIFURCATION, TAUT, END = "fold", "bifurcation", "taut", "end"
"""How a state ends: where there is no rod to spare any more it is taut; an end is none of these."""
ROUGH = mm(0.1)
"""Of curves that are only counted [m]."""
SURE = 1e-9
"""Fraction of a passage to which it is known where the rod gets taut."""
AT_ONCE = 8
"""Passages of a task."""

Counts = npt.NDArray[np.int64]


class Folds(NamedTuple):
    """Places between neighbouring points of a grid where the number of stable states changes.

    `places (f, 2)` are values of the two axes, in their units; along the axis on which a place is between points it is
    off by at most its `errors (f,)`, as far as that can be estimated. `kinds (f,)` are "fold", "bifurcation", "taut" or
    "end". `before` and `after (f,)` count the states at the lower and the upper one of both points. `lines (l, 2)` say
    which two are neighbours on a line, by their numbers from 0.
    """

    places: Array
    errors: Array
    kinds: npt.NDArray[np.str_]
    before: Counts
    after: Counts
    lines: Counts

    def count(self, kind: str) -> int:
        """How many there are of a kind."""
        return int(np.count_nonzero(self.kinds == kind))

    @property
    def largest_error(self) -> float:
        """Of all places, in mm or degrees; 0 if there are none."""
        return float(self.errors.max(initial=0.0))


class _Edges(NamedTuple):
    """Pairs of neighbouring points of which one has more states: grid numbers (e, 2) of the lower one, and the axis."""

    lower: Counts
    axis: Counts


class Passage(NamedTuple):
    """The way from a pose with more states to one with fewer, how many that has, and the former's states to follow."""

    rich: Pose
    poor: Pose
    fewer: int
    begins: tuple[tuple[Array, Array], ...]  # angles (n,) [rad] and multipliers (2,) of each
    precise: float  # fraction of the way to which the end of one is wanted


class PassageTask(NamedTuple):
    """Passages on which a state ends."""

    rod: ClampedRod
    passages: tuple[Passage, ...]
    tolerance: float

    def perform(self) -> list[tuple[float, float, str]]:
        """Of each passage the fraction at which a state ends, the error of that, and how it ends."""
        return [_followed(self.rod, each) or _halved(self, each) for each in self.passages]


def located(grid: Grid, rod: ClampedRod, entries: Entries, doer: Doer, heard: Heard) -> Folds:
    """The folds of a grid, given the states at all its points; one is told between two neighbouring points.

    Where both have as many states, none is looked for. `heard` is told how many were found.
    """
    first, second = (axis.values() for axis in grid.axes)
    size = len(first), len(second)
    counts = np.bincount(entries["pose"], minlength=len(first) * len(second)).reshape(size)
    edges = _edges(counts)
    upper = edges.lower + np.eye(2, dtype=np.int64)[edges.axis]
    before, after = counts[tuple(edges.lower.T)], counts[tuple(upper.T)]
    flips = (after > before)[:, None]
    rich, poor = np.where(flips, upper, edges.lower), np.where(flips, edges.lower, upper)
    values = [np.column_stack([first[each[:, 0]], second[each[:, 1]]]) for each in (rich, poor)]
    precise = PRECISE / np.abs(values[1] - values[0]).max(axis=1)
    poses = [grid.poses_at(each[:, 0], each[:, 1]).tolist() for each in values]
    begins = np.searchsorted(entries["pose"], np.arange(len(first) * len(second) + 1))
    passages = []
    for number, point in enumerate((rich @ [size[1], 1]).tolist()):
        states = entries[begins[point] : begins[point + 1]]
        held = tuple((state["angles"].copy(), state["multipliers"].copy()) for state in states)
        ends = Pose(*poses[0][number]), Pose(*poses[1][number])
        passages.append(Passage(*ends, int(min(before[number], after[number])), held, float(precise[number])))
    met = _ends_of(passages, rod, doer, heard)
    fractions = np.array([each[0] for each in met]).reshape(-1, 1)
    return Folds(
        values[0] + fractions * (values[1] - values[0]),
        np.array([each[1] for each in met]) * PRECISE / precise,
        np.array([each[2] for each in met], dtype=np.str_),
        before,
        after,
        _lines(edges, (before, after), size),
    )


def _ends_of(passages: list[Passage], rod: ClampedRod, doer: Doer, heard: Heard) -> list[tuple[float, float, str]]:
    """Where on each passage a state ends."""
    held = replace(rod, bearing=rod.bearing.held_in_plane())
    tasks = [
        PassageTask(held, tuple(passages[begin : begin + AT_ONCE]), ROUGH) for begin in range(0, len(passages), AT_ONCE)
    ]
    met: list[tuple[float, float, str]] = []
    for found in doer(tasks):
        met += found
        heard(len(met))
    return met


def _followed(rod: ClampedRod, passage: Passage) -> tuple[float, float, str] | None:
    """The first end of a state that is met by following each; None if none is."""
    way, met = _slack_part(rod, passage), []
    path = straight_path(passage.rich, _pose_at(passage, way))
    for phi, multipliers in passage.begins if way > 0.0 else ():
        point = critical(path, rod.bearing, phi, multipliers, passage.precise)
        if point.kind in (SpecialKind.FOLD, SpecialKind.BIFURCATION):
            met.append((way * point.fraction, way * point.error, point.kind.value))
    if not met and 0.0 < way < 1.0:
        return way, SURE, TAUT
    return min(met, default=None)


def _slack_part(rod: ClampedRod, passage: Passage) -> float:
    """Up to which fraction of a passage there is rod to spare; 0 if there is none where it begins."""
    low, high = 0.0, 1.0
    if is_slack(rod.moved_to(passage.poor)) or not is_slack(rod.moved_to(passage.rich)):
        return float(is_slack(rod.moved_to(passage.rich)))
    while high - low > SURE:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_slack(rod.moved_to(_pose_at(passage, middle))) else (low, middle)
    return low


def _pose_at(passage: Passage, fraction: float) -> Pose:
    """The pose at a fraction of a passage."""
    ends = zip(passage.rich, passage.poor, strict=True)
    return Pose(*(begin + fraction * (end - begin) for begin, end in ends))


def _halved(task: PassageTask, passage: Passage) -> tuple[float, float, str]:
    """The place on a passage from which on there are fewer states, by halving it."""
    low, high = 0.0, 1.0
    while high - low > 2.0 * passage.precise:
        middle = 0.5 * (low + high)
        if len(states_at(task.rod.moved_to(_pose_at(passage, middle)), task.tolerance)) > passage.fewer:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high), 0.5 * (high - low), END


def _edges(counts: Counts) -> _Edges:
    """Where neighbouring points have unlike many states."""
    across = np.argwhere(counts[1:] != counts[:-1])
    up = np.argwhere(counts[:, 1:] != counts[:, :-1])
    axis = np.repeat([0, 1], [len(across), len(up)])
    return _Edges(np.concatenate([across, up]), axis)


def _lines(edges: _Edges, counts: tuple[Counts, Counts], size: tuple[int, int]) -> Counts:
    """Which folds are neighbours: both on the rim of a cell, and between as many states and fewer."""
    rims: dict[tuple[int, int, int], list[int]] = {}
    rows = zip(edges.lower.tolist(), edges.axis.tolist(), counts[0].tolist(), counts[1].tolist(), strict=True)
    for number, ((i, j), axis, before, after) in enumerate(rows):
        for cell in ((i, j), (i, j - 1) if axis == 0 else (i - 1, j)):
            if 0 <= cell[0] < size[0] - 1 and 0 <= cell[1] < size[1] - 1:
                for level in range(min(before, after), max(before, after)):
                    rims.setdefault((*cell, level), []).append(number)
    # Two of a cell, or all four: then its lower left corner is cut off, and the one across.
    pairs = [pair for met in rims.values() for pair in ((met,) if len(met) == 2 else (met[0::2], met[1::2]))]
    return np.array(sorted(map(tuple, pairs)), dtype=np.int64).reshape(-1, 2)
