"""The snap-through load over all points of a shape's curve: the weakest, and where it yields to a finger."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from curveline.errors import InvalidInput
from curveline.kernels.compile_time import clock
from curveline.loading.pushes import Push, Stand, most_on, stand_of
from curveline.loading.snap_through import before, leaves_plane, limit_of
from curveline.notebook import html_of, svg_of
from curveline.scene import Scene
from curveline.units import to_mm

SEARCHING = 1.0
"""Force [N] of a finger that searches for a target: most people use less (paper, section VI, its reference [40])."""
CONTOUR = (2.0, 5.0)
"""Forces [N] of a finger that follows a contour (paper, section VI, its reference [41])."""
FORCES = (SEARCHING, *CONTOUR)

GOLDEN = 0.5 * (5.0**0.5 - 1.0)
NARROWING = 12
"""Sections of the interval around the weakest point of the grid: to a three-hundredth of it."""
HALVINGS = 7
"""Of the interval of the grid in which a stretch that yields begins or ends: to a hundredth of it."""
NEARLY = 1.05
"""Points of the grid this near to the weakest, as a factor of its load, are looked at more closely, too."""
ALIKE = 2e-6
"""Loads that differ by less, relatively, are the same."""


class MapPoint(NamedTuple):
    """A point of the curve, as a fraction of arc length and in the display's frame [m], and what it bears.

    `force` [N] is that of snap-through, None if it bears the most; `kind` is empty then. From `leaves_plane` [N] on the
    rod would not stay in the display's plane; None if it does until then.
    """

    at: float  # fraction
    x: float  # [m]
    y: float  # [m]
    force: float | None
    error: float  # [N] of the force
    kind: str
    leaves_plane: float | None


class Verdict(NamedTuple):
    """Whether the shape withstands a force [N] anywhere: the stretches, as fractions of arc length, on which not."""

    force: float  # [N]
    stretches: tuple[tuple[float, float], ...]  # (from, to), none if it withstands

    @property
    def everywhere(self) -> bool:
        """True if it does."""
        return not self.stretches


@dataclass(frozen=True)
class LoadMap:
    """What every point of a shape's curve bears; `weakest` is None if all bear the most."""

    scene: Scene  # what was pushed
    push: Push  # which way and how far
    stand: Stand  # the rod that is pushed
    points: tuple[MapPoint, ...]  # left to right
    weakest: MapPoint | None
    verdicts: tuple[Verdict, ...]  # against the loads of a finger
    seconds: float  # [s]

    def _repr_svg_(self) -> str | None:
        return svg_of("curveline.figures.loads:draw", self)

    def _repr_html_(self) -> str:
        rows = [(each.at, to_mm(each.x), to_mm(each.y), each.force or "-", each.kind) for each in self.points]
        return html_of(self.scene.name, [("at", "x mm", "y mm", "snaps at N", "how"), *rows], self._repr_svg_())


class _Mapping:
    """What the points of a segment's curve bear; each is pushed on its own."""

    def __init__(self, scene: Scene, push: Push) -> None:
        self.scene = scene
        self.stand = stand_of(scene, push)
        # A finger presses as it does, however soft the rod.
        self.push = push._replace(most=push.most or max(most_on(self.stand.rod), FORCES[-1]))

    def point(self, at: float) -> MapPoint:
        """What one point bears; whether the rod stays in its plane is not looked at."""
        stand = self.stand.moved_to(at, self.push.direction)
        limit = limit_of(stand, self.push.most)
        x, y = stand.seen(stand.place(stand.state))
        if limit is None:
            return MapPoint(at, x, y, None, 0.0, "", None)
        return MapPoint(at, x, y, limit.force, limit.error, limit.kind, None)

    def looked_at(self, point: MapPoint) -> MapPoint:
        """The same point, and whether the rod stays in its plane until that snaps."""
        stand = self.stand.moved_to(point.at, self.push.direction)
        last = self.push.most if point.force is None else before(point.force)
        return point._replace(leaves_plane=leaves_plane(stand, last))

    def weakest(self, points: Sequence[MapPoint]) -> MapPoint | None:
        """The weakest point of the curve, between those of the grid, too."""
        least = min(map(_strength, points))
        if least == np.inf:
            return None
        found = next(point for point in points if _strength(point) <= (1.0 + ALIKE) * least)
        limit = NEARLY * _strength(found)
        for left, middle, right in zip(points, points[1:], points[2:], strict=False):
            if _strength(left) >= _strength(middle) <= _strength(right) and _strength(middle) < limit:
                between = self._narrowed(left.at, right.at)
                # Of two points that are as weak, as on a symmetric curve, the left one.
                if _strength(between) < (1.0 - ALIKE) * _strength(found):
                    found = self.looked_at(between)
        return found

    def _narrowed(self, low: float, high: float) -> MapPoint:
        """The weakest point of an interval that has but one, by the golden section."""
        inner = [self.point(high - GOLDEN * (high - low)), self.point(low + GOLDEN * (high - low))]
        for _ in range(NARROWING):
            if _strength(inner[0]) <= _strength(inner[1]):
                high = inner[1].at
                inner = [self.point(high - GOLDEN * (high - low)), inner[0]]
            else:
                low = inner[0].at
                inner = [inner[1], self.point(low + GOLDEN * (high - low))]
        return min(inner, key=_strength)

    def stretches(self, points: Sequence[MapPoint], force: float) -> Iterator[tuple[float, float]]:
        """Where the curve snaps through under a force [N] or less, as fractions of arc length."""
        begin: float | None = points[0].at if _strength(points[0]) < force else None
        for left, right in pairwise(points):
            if begin is None and _strength(right) < force:
                begin = self._border(left, right, force)
            elif begin is not None and _strength(right) >= force:
                yield begin, self._border(left, right, force)
                begin = None
        if begin is not None:
            yield begin, points[-1].at

    def _border(self, left: MapPoint, right: MapPoint, force: float) -> float:
        """Between two points, one of which withstands a force [N] and the other does not, where that changes."""
        low, high = left, right
        for _ in range(HALVINGS):
            middle = self.point(0.5 * (low.at + high.at))
            is_like_low = (_strength(middle) < force) == (_strength(low) < force)
            low, high = (middle, high) if is_like_low else (low, middle)
        return 0.5 * (low.at + high.at)


def _strength(point: MapPoint) -> float:
    return np.inf if point.force is None else point.force


def load_map(scene: Scene, push: Push, count: int, progress: Callable[[int], object] = lambda _: None) -> LoadMap:
    """Push `count` points of a curve one after another, equally spaced over the free rod, to snap-through or the most.

    `push.at` plays no part. InvalidInput and Infeasible as `load`, and for a most that a finger exceeds.
    """
    if 0.0 < push.most < FORCES[-1]:
        message = f"a map to {push.most:g} N does not tell what a finger does to the curve"
        raise InvalidInput(message, f"map to {FORCES[-1]:g} N or more")
    begin = clock()
    mapping = _Mapping(scene, push._replace(at=0.5))
    bearing = 0.5 * scene.display.clamp / scene.segments[push.segment].length
    points = []
    for number in range(1, count + 1):
        along = number / (count + 1)
        # Written so that half of the way is half, which decides what a symmetric curve does.
        points.append(mapping.looked_at(mapping.point(along + bearing * (1.0 - 2.0 * along))))
        progress(number)
    weakest = mapping.weakest(points)
    known = sorted({*points, *([weakest] if weakest else [])}, key=lambda point: point.at)
    verdicts = tuple(Verdict(force, tuple(mapping.stretches(known, force))) for force in FORCES)
    return LoadMap(scene, mapping.push, mapping.stand, tuple(points), weakest, verdicts, seconds=clock() - begin)
