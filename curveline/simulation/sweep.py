"""A shape whose numbers run through ranges: every combination is checked like a file, then simulated like one."""

from __future__ import annotations

import itertools
import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property
from typing import NamedTuple

from curveline.errors import InvalidInput
from curveline.phrases import counted
from curveline.rod.states.equilibrium import Outcome
from curveline.scene import Scene
from curveline.shapes.files import ShapeFile
from curveline.shapes.toml_document import shown
from curveline.shapes.toml_location import KeyPath
from curveline.simulation.batch import Task
from curveline.simulation.results import ShapeReport
from curveline.simulation.swept_poses import SweptPoses
from curveline.system.files import AnyPath

MOST_POINTS = 1_000_000
"""Boundary conditions of one sweep: three hours of computing, ten minutes of them to be told of a bad one."""

MOST_LISTED = 12
"""Keys that a hint names; a display of five nodes has 24."""

FORM = "write KEY=START:STOP:COUNT, such as nodes.1.angle_deg=-60:60:41"


@dataclass(frozen=True)
class SweepAxis:
    """A number of a shape file that runs from `start` to `stop`, both included, in `count` values, in its own unit."""

    key: str
    path: KeyPath
    start: float
    stop: float
    count: int

    def values(self) -> list[float]:
        """The values, equally spaced, the ends exact."""
        steps = max(1, self.count - 1)
        between = [self.start + (self.stop - self.start) * index / steps for index in range(self.count)]
        return [*between[:-1], self.stop]

    def __str__(self) -> str:
        return f"{self.key} {self.start:g} to {self.stop:g} in {counted(self.count, 'value')}"


class Sweep:
    """All combinations of the values of some axes, the last axis running fastest, in the file of a shape."""

    def __init__(self, path: AnyPath, axes: Sequence[str]) -> None:
        """The sweep over `axes`, as FORM says; InvalidInput about the file, or the first axis that cannot be used."""
        self.file = ShapeFile.at(path)
        known = {_key(place): place for place in self.file.numbers()}
        self.axes = tuple(_axis(text, known) for text in axes)
        keys = Counter(axis.key for axis in self.axes)
        for key, times in keys.items():
            if times > 1:
                raise InvalidInput(f"--sweep {key} is given {times} times", "give every key one range")
        if len(self) > MOST_POINTS:
            hint = f"at most {MOST_POINTS:,}: choose smaller counts, or several sweeps"
            raise InvalidInput(f"these ranges have {len(self):,} combinations", hint)

    def __len__(self) -> int:
        return math.prod(axis.count for axis in self.axes)

    def tasks(self) -> Iterator[Task]:
        """Every point of the grid, to be simulated."""
        for number, values in self._points():
            yield self._task(number, values)

    def task(self, number: int) -> Task:
        """The point of this number, from 1, to be simulated."""
        values: list[float] = []
        left = number - 1
        for axis in reversed(self.axes):
            left, index = divmod(left, axis.count)
            values.insert(0, axis.values()[index])
        return self._task(number, tuple(values))

    @cached_property
    def poses(self) -> SweptPoses | None:
        """The points as poses; None for a sweep over something else."""
        scene = self.file.scene
        if not SweptPoses.fit(scene, [axis.path for axis in self.axes]):
            return None
        return SweptPoses(scene, [(axis.path, axis.values()) for axis in self.axes])

    def check(self, observe: Callable[[int], object]) -> None:
        """Hold every point against the rules for shape files; InvalidInput names the key and the first bad point.

        `observe` is told now and then how many points have been looked at.
        """
        bad = seen = 0
        first: InvalidInput | None = None
        for number, values in self._doubtful():
            try:
                self._scene(values)
            except InvalidInput as error:
                bad += 1
                first = first or self._complaint(number, values, error)
            observe(seen := number)
        if seen < len(self):
            observe(len(self))
        if first is not None:
            rest = f" ({bad:,} of {len(self):,} points cannot be used)" if len(self) > 1 else ""
            raise InvalidInput(first.message + rest, first.hint)

    def _doubtful(self) -> Iterator[tuple[int, tuple[float, ...]]]:
        """The points that may break a rule.

        Rules on a single number are ranges: what its least and its largest value keep to, all do. Rules on several
        numbers are looked at for all points at once.
        """
        if self.poses is None or not all(map(self._is_in_range, self.axes)):
            return self._points()
        return itertools.compress(self._points(), (~self.poses.reach()).tolist())

    def _is_in_range(self, axis: SweepAxis) -> bool:
        """True if the file with the least value of an axis is in order, and with the largest."""
        try:
            for value in (min(axis.values()), max(axis.values())):
                self.file.varied({axis.path: value})
        except InvalidInput:
            return False
        return True

    def _task(self, number: int, values: tuple[float, ...]) -> Task:
        swept = tuple((axis.key, value) for axis, value in zip(self.axes, values, strict=True))
        return Task(self.file.scene.path, self._scene(values), number, swept)

    def _points(self) -> Iterator[tuple[int, tuple[float, ...]]]:
        return enumerate(itertools.product(*(axis.values() for axis in self.axes)), start=1)

    def _scene(self, values: tuple[float, ...]) -> Scene:
        return self.file.varied({axis.path: value for axis, value in zip(self.axes, values, strict=True)})

    def _complaint(self, number: int, values: tuple[float, ...], error: InvalidInput) -> InvalidInput:
        """The first problem of a point, as one of the command line: the file itself is in order."""
        point = ", ".join(f"{axis.key}={value:g}" for axis, value in zip(self.axes, values, strict=True))
        found = error.diagnostics[0]
        return InvalidInput(f"--sweep: at point {number:,}, {point}: {found.message}", found.hint)


def _axis(text: str, known: dict[str, KeyPath]) -> SweepAxis:
    key, has_range, numbers = text.partition("=")
    parts = numbers.split(":")
    if not has_range or len(parts) != 3:
        raise InvalidInput(f"--sweep {shown(text)} is no range", FORM)
    if key not in known:
        hint = f"{_meant(key, list(known))}this file has {_listed(list(known))}"
        raise InvalidInput(f"--sweep {shown(key)}: there is no such number in the file", hint)
    try:
        start, stop, count = float(parts[0]), float(parts[1]), int(parts[2])
    except ValueError:
        raise InvalidInput(
            f"--sweep {shown(text)}: START and STOP must be numbers, COUNT a whole number", FORM
        ) from None
    if not (math.isfinite(start) and math.isfinite(stop)):
        raise InvalidInput(f"--sweep {shown(text)}: START and STOP must be finite", FORM)
    if count < 1 or (count == 1) != (start == stop):
        hint = "a range has at least 2 values; a fixed value is written START:START:1"
        raise InvalidInput(f"--sweep {shown(text)}: no {counted(count, 'value')} from {start:g} to {stop:g}", hint)
    return SweepAxis(key, known[key], start, stop, count)


def _key(path: KeyPath) -> str:
    """A key path as it is typed, with arrays counted from 1: `nodes.2.angle_deg`."""
    return ".".join(str(part + 1) if isinstance(part, int) else part for part in path)


def _meant(key: str, known: Sequence[str]) -> str:
    """The first part of a hint: the known key that was probably meant, with the nearest numbers that there are."""
    names = list(dict.fromkeys(_words(each) for each in known))
    words = _words(key)
    close = get_close_matches(words, names, n=1) or [
        name for name in names if words and words in name.split(".", 1)[-1]
    ]
    if not close:
        return ""
    numbers = [int(number) for number in re.findall(r"(?:^|[.\[])(\d{1,9})", key)]
    alike = [each for each in known if _words(each) == close[0]]
    likeliest = min(alike, key=lambda each: [abs(a - b) for a, b in zip(_numbers(each), numbers, strict=False)])
    why = "tables are counted from 1: " if 0 in numbers else ""
    return f"{why}did you mean {likeliest}? "


def _words(key: str) -> str:
    """A key without its numbers, in small letters: `nodes.angle_deg`."""
    return ".".join(re.findall(r"[a-z_]+", key[:100].lower()))


def _numbers(key: str) -> list[int]:
    return [int(part) for part in key.split(".") if part.isdecimal()]


def _listed(keys: list[str]) -> str:
    return ", ".join(keys[:MOST_LISTED]) + (", ..." if len(keys) > MOST_LISTED else "")


class Digest(NamedTuple):
    """What a summary needs to know of one segment at one point, or at several that are alike."""

    states: str  # kinds of its stable states
    lowest: float  # eigenvalue of its stable states
    highest: float  # eigenvalue of its stable states
    error: float  # [m], the largest
    has_wanted: bool  # whether the wanted state exists
    short: frozenset[Outcome]  # how states ended that did not converge
    points: int = 1  # alike in states, `has_wanted` and `short`, that it stands for


def kinds_of(names: Iterable[str]) -> str:
    """The kinds of states that have these names; further crossings and loops are many, and count as one kind."""
    return ", ".join(dict.fromkeys(name.partition("-")[0] for name in names)) or "none"


def digests(task: Task, report: ShapeReport) -> tuple[Digest, ...]:
    """A maker: the digest of every segment."""
    found = []
    for segment in report.segments:
        values = [state.lowest_eigenvalue for state in segment.states] or [math.nan]
        error = max((state.error for state in segment.states), default=0.0)
        short = frozenset(state.outcome for state in segment.states) - {Outcome.CONVERGED}
        names = kinds_of(state.name for state in segment.states)
        found.append(Digest(names, min(values), max(values), error, segment.wanted is not None, short))
    return tuple(found)


@dataclass
class Group:
    """Points at which a segment has the same kinds of stable states."""

    points: int = 0  # how many
    lowest: float = math.inf  # lowest eigenvalue, least
    highest: float = -math.inf  # lowest eigenvalue, most
    error: float = 0.0  # [m]

    def add(self, digest: Digest) -> None:
        """Count what a digest stands for."""
        self.points += digest.points
        self.lowest = min(self.lowest, digest.lowest)
        self.highest = max(self.highest, digest.highest)
        self.error = max(self.error, digest.error)


@dataclass
class SweepTally:
    """What the points of a sweep came to, segment by segment."""

    groups: list[dict[str, Group]]  # per segment, by the names of the states
    unwanted: list[int]
    """Points without the wanted state, per segment."""
    short: Counter[Outcome] = field(default_factory=Counter)  # points by why a state is short of the tolerance
    """Points with a state that ended so."""
    good: int = 0  # points as asked for
    without: int = 0  # points without a wanted state
    failed: int = 0  # points that could not be simulated

    @classmethod
    def of(cls, segments: int) -> SweepTally:
        """An empty one for a shape of so many segments."""
        return cls([{} for _ in range(segments)], [0] * segments)

    def add(self, point: Sequence[Digest]) -> None:
        """Count one point, by the digests of its segments, or as many as each of these stands for."""
        count = point[0].points
        for index, digest in enumerate(point):
            self.groups[index].setdefault(digest.states, Group()).add(digest)
            self.unwanted[index] += 0 if digest.has_wanted else count
        without = not all(digest.has_wanted for digest in point)
        short = frozenset[Outcome]().union(*(digest.short for digest in point))
        self.without += count if without else 0
        self.short.update(dict.fromkeys(short, count))
        self.good += 0 if without or short else count
