"""Which two of the numbers of a segment run over a grid, and at what the others stand: keys with their units."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from curveline.atlases.entries import Array, with_begins
from curveline.atlases.sampling import longest
from curveline.errors import InvalidInput
from curveline.phrases import counted
from curveline.scene import Display
from curveline.shapes.toml_document import nearest, shown
from curveline.units import deg, mm, to_deg, to_mm

RISE, LEFT, RIGHT, ANGLE, LENGTH = "rise_mm", "left_deg", "right_deg", "angle_deg", "length_mm"
KEYS = (ANGLE, LEFT, RIGHT, RISE, LENGTH)
"""Height of the right node over the left one, angles of both, rod between them; `angle_deg` is the left one, the right
one being its mirror image."""
USUAL: Mapping[str, tuple[float, float, int] | None] = {ANGLE: None, LENGTH: None}
USUAL_COUNT = 41
MOST_POINTS = 1_000_000
FORM = "write KEY, or KEY=START:STOP:COUNT, such as angle_deg=0:60:31"
MILLIMETRES = "_mm"


@dataclass(frozen=True)
class AtlasAxis:
    """A number that runs from `start` to `stop`, both included, in `count` values, in the unit of its key."""

    key: str  # such as angle_deg
    start: float
    stop: float
    count: int

    def values(self) -> Array:
        """The values (count,), equally spaced, the ends exact."""
        return np.linspace(self.start, self.stop, self.count)

    def __str__(self) -> str:
        return f"{self.key} {self.start:g} to {self.stop:g} in {counted(self.count, 'value')}"


@dataclass(frozen=True)
class AtlasRequest:
    """What an atlas shows: two keys with their ranges, None for all that the display allows, and what others are `at`.

    Keys are rise_mm, left_deg, right_deg, length_mm, or angle_deg for both angles, the right one mirrored; a range is
    (start, stop, count). Of a key that is not named, the rise and the angles are 0, the length is between its limits.
    """

    over: Mapping[str, tuple[float, float, int] | None] = field(default_factory=lambda: dict(USUAL))  # what runs
    at: Mapping[str, float] = field(default_factory=dict)  # where others stand
    tolerance: float = 1e-4  # [m], largest error of a curve

    def __post_init__(self) -> None:
        if not 0.0 < self.tolerance < math.inf:
            hint = "choose a length above 0 in m, such as 1e-4"
            raise InvalidInput(f"no curve has a tolerance of {self.tolerance!r}", hint)


class Grid(NamedTuple):
    """The poses of an atlas: two axes, and the values of all keys that do not run, by their names."""

    display: Display
    axes: tuple[AtlasAxis, AtlasAxis]
    fixed: dict[str, float]

    def poses_at(self, first: Array, second: Array) -> Array:
        """Poses (m, 6) at values (m,) of both axes, in their units."""
        values = {**self.fixed, self.axes[0].key: first, self.axes[1].key: second}
        if ANGLE in values:
            values[LEFT], values[RIGHT] = values[ANGLE], -np.asarray(values[ANGLE])
        table = np.empty((len(first), 5))
        table[:, 0] = self.display.span
        for place, key in enumerate((RISE, LEFT, RIGHT, LENGTH), start=1):
            table[:, place] = np.asarray(values[key]) * (mm(1.0) if key.endswith(MILLIMETRES) else deg(1.0))
        return with_begins(table, self.display)

    def all_poses(self) -> Array:
        """The poses of the whole grid, the second axis running fastest."""
        first, second = np.meshgrid(*(axis.values() for axis in self.axes), indexing="ij")
        return self.poses_at(first.ravel(), second.ravel())


def grid_of(display: Display, request: AtlasRequest) -> Grid:
    """The grid that was asked for; InvalidInput for one that the display cannot have, or that is none."""
    limits = limits_of(display)
    for key in (*request.over, *request.at):
        if key not in KEYS:
            raise InvalidInput(f"a segment has no number {shown(key)}", f"{nearest(key, list(KEYS))}{_listed()}")
    if len(request.over) != 2:
        raise InvalidInput(f"an atlas is over two keys, not {len(request.over)}", _listed())
    named = [*request.over, *request.at]
    if twice := next((key for key in named if named.count(key) > 1), None):
        raise InvalidInput(f"{twice} runs, and stands still", "leave one of the two out")
    if ANGLE in named and (LEFT in named or RIGHT in named):
        raise InvalidInput(f"{ANGLE} is both angles", f"leave it out, or {LEFT} and {RIGHT}")
    first, second = (_axis(key, limits[key], numbers) for key, numbers in request.over.items())
    if first.count * second.count > MOST_POINTS:
        what = f"{first.count:,} times {second.count:,} points"
        raise InvalidInput(f"{what} are more than {MOST_POINTS:,}", "choose fewer values")
    fixed = {key: _within(key, float(value), limits[key]) for key, value in request.at.items()}
    angles = () if ANGLE in named else (LEFT, RIGHT)
    for key in (RISE, *angles, LENGTH):
        if key not in named:
            low, high = limits[key]
            fixed[key] = 0.5 * (low + high) if key == LENGTH else min(max(0.0, low), high)
    return Grid(display, (first, second), fixed)


def limits_of(display: Display) -> dict[str, tuple[float, float]]:
    """What a display allows of each key, in the unit of the key; InvalidInput if it leaves no rod between nodes."""
    limits = display.limits
    reach = to_mm(limits.height.high - limits.height.low)
    angle = to_deg(limits.angle.low), to_deg(limits.angle.high)
    least, most = max(limits.length.low, 0.0), longest(display)
    if not least < most:
        hint = f"a segment has at most {to_mm(most):.4g} mm of rod"
        raise InvalidInput(f"{display.name} has no range of lengths", hint)
    both = max(angle[0], -angle[1]), min(angle[1], -angle[0])
    return {
        RISE: (-reach, reach),
        LEFT: angle,
        RIGHT: angle,
        ANGLE: both if both[0] <= both[1] else (0.0, 0.0),
        LENGTH: (to_mm(least), to_mm(most)),
    }


def parsed_over(texts: Iterable[str]) -> dict[str, tuple[float, float, int] | None]:
    """Keys and their ranges, written as FORM says, also several with commas between them; InvalidInput for others."""
    over: dict[str, tuple[float, float, int] | None] = {}
    for text in (part.strip() for each in texts for part in each.split(",")):
        key, has_range, numbers = text.partition("=")
        key = key.strip()
        if key in over:
            raise InvalidInput(f"--over {shown(text)}: {key} is there twice", "name two keys")
        over[key] = _numbers(text, numbers) if has_range else None
    return over


def _numbers(text: str, numbers: str) -> tuple[float, float, int]:
    parts = numbers.split(":")
    try:
        start, stop, count = float(parts[0]), float(parts[1]), int(parts[2])
    except (ValueError, IndexError):
        raise InvalidInput(f"--over {shown(text)} is no range", FORM) from None
    if len(parts) != 3:
        raise InvalidInput(f"--over {shown(text)} is no range", FORM)
    return start, stop, count


def parsed_at(texts: Iterable[str]) -> dict[str, float]:
    """Values by their keys, written KEY=VALUE; InvalidInput for others."""
    at: dict[str, float] = {}
    for text in (part.strip() for each in texts for part in each.split(",")):
        key, _, value = text.partition("=")
        if key.strip() in at:
            raise InvalidInput(f"--at {shown(text)}: {key.strip()} is there twice", "name it once")
        try:
            at[key.strip()] = float(value)
        except ValueError:
            hint = "write KEY=VALUE, such as rise_mm=50"
            raise InvalidInput(f"--at {shown(text)} gives no number", hint) from None
    return at


def _listed() -> str:
    return f"there are {', '.join(KEYS)}"


def _axis(key: str, limits: tuple[float, float], numbers: tuple[float, float, int] | None) -> AtlasAxis:
    start, stop, count = numbers or (*limits, USUAL_COUNT)
    _within(key, start, limits)
    _within(key, stop, limits)
    if not start < stop or count < 2:
        raise InvalidInput(
            f"{key} does not run from {start:g} to {stop:g} in {counted(count, 'value')}",
            "give the lower end first, and 2 values or more" if numbers else f"the display allows one {key}: choose",
        )
    return AtlasAxis(key, float(start), float(stop), int(count))


def _within(key: str, value: float, limits: tuple[float, float]) -> float:
    low, high = limits
    slack = 1e-9 * max(abs(low), abs(high))
    if not low - slack <= value <= high + slack:
        raise InvalidInput(f"{key} = {value:g}: the display allows {low:.6g} to {high:.6g}", "stay within its limits")
    return value
