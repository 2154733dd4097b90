"""One state followed through a picture: the way of a bar near it, the elastic curve along that, the rod to a part of a
pixel."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from curveline.cameras.setup import SeenNode
from curveline.rod.states.equilibrium import Equilibrium
from curveline.scene import Scene
from curveline.simulation.simulate import scene_rod
from curveline.tracing import bars
from curveline.tracing.families import ElasticCurve, Family, Targets, distances, family_of
from curveline.tracing.lines import SeenLine, line_through, strip_of
from curveline.tracing.sections import front, silhouette
from curveline.tracing.smoothing import Smoothed, smoothed
from curveline.tracing.windows import Sight, Windows, measured, window_places
from curveline.units import mm

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

BESIDE_NODE = mm(4.0)
"""What beside the silhouette of a node is not looked at."""
WAYS, ENOUGH = 2, 0.7
"""How many ways of bars are looked at, the likeliest first: a shadow may be as like a bar as the rod is. One along
which so much of the rod is seen is the right one."""
LEAST = mm(40.0)
"""No less of a curve is looked at."""
LIKE_A_BAR = 0.25
"""A column of a way whose likeness is less says nothing."""
ROUGH = mm(4.0), mm(1.5)
"""How far the columns of a way are taken to be off, one after the other."""
REACHES = mm(7.0), mm(3.0), mm(1.6)
"""How far from the curve so far the rod is measured, one after the other."""
SPREADS = mm(0.8), mm(0.35), mm(0.15)
"""What is added to what windows say of their own error then."""
LIKE_THE_ROD = 0.5
"""A window whose likeness is less says nothing."""
LEAST_ERROR = mm(0.05)
"""Of any point."""
BLURS = np.array([0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8])
"""[mm] that are tried."""
BLUR_REACH = mm(1.0)


@dataclass(frozen=True, eq=False)
class TracingTask:
    """What is followed: a state of a segment, in a picture."""

    scene: Scene
    index: int  # of the segment, from 0
    state: Equilibrium
    node: SeenNode
    noise: float  # grey levels of a pixel


@dataclass(frozen=True, eq=False)
class FollowedState:
    """What became of following a state: the elastic curve near it, and what windows along that say."""

    state: Equilibrium
    predicted: SeenLine
    way: Array  # (k, 2) [m] of the bar near the prediction
    elastic: ElasticCurve
    rod: Array  # (n, 2) [m] where it is at every window, as windows and smoothness have it
    windows: Windows
    smooth: Smoothed
    blur: float  # [m]
    way_likeness: float

    @property
    def used(self) -> Flags:
        """Which windows show the rod."""
        return self.smooth.used

    @property
    def cover(self) -> float:
        """The part of the visible rod that windows show."""
        return float(np.mean(self.used)) if len(self.used) else 0.0

    @property
    def support(self) -> float:
        """How much says that the rod is there: the part that is seen, less where that is less like the rod."""
        return float(np.mean(self.windows.likeness * self.used)) if len(self.used) else 0.0

    @property
    def rodlike(self) -> float:
        """The part of the windows that show something like the rod, wherever."""
        return float(np.mean(self.windows.likeness > LIKE_THE_ROD)) if len(self.used) else 0.0

    @property
    def from_model(self) -> float:
        """How far the elastic curve is from the state as it was predicted [m], root of the mean square."""
        return float(np.sqrt(np.mean(np.sum((self.elastic.points - self.predicted.points) ** 2, axis=1))))

    @property
    def sigma(self) -> float:
        """The standard error of a point [m], but for what is wrong with the camera's place."""
        own = np.mean(self.smooth.sigma[self.used] ** 2)
        # Where the rod is as light as what is behind it, nothing is told at all, which is no error of the others.
        shared = np.median(self.windows.alike[self.used]) ** 2
        return float(np.sqrt(own + shared + LEAST_ERROR**2))

    @property
    def points(self) -> Array:
        """Where windows show the rod (k, 2) [m]."""
        points: Array = self.rod[self.used]
        return points


class Reached(NamedTuple):
    """The visible part of a curve."""

    low: float  # [m] arc length
    high: float


def visible(line: SeenLine, task: TracingTask) -> Reached:
    """From where to where a line is beyond the silhouettes of the nodes at its ends."""
    span, sizes = task.scene.display.span, (task.node.half_width + BESIDE_NODE, task.node.half_height + BESIDE_NODE)
    hidden = np.zeros(len(line.points), dtype=bool)
    for number in (task.index, task.index + 1):
        away = np.abs(line.points - [number * span, task.scene.nodes[number].height])
        hidden |= (away[:, 0] < sizes[0]) & (away[:, 1] < sizes[1])
    seen = np.flatnonzero(~hidden)
    if not len(seen):
        return Reached(0.0, 0.0)
    return Reached(float(line.places[seen[0]]), float(line.places[seen[-1]]))


def followed(sight: Sight, task: TracingTask) -> FollowedState | None:
    """A state followed as well as it can be; None if it has no elastic curves around it, or next to nothing is seen."""
    scene, index = task.scene, task.index
    origin = (index * scene.display.span, scene.nodes[index].height)
    family = family_of(scene_rod(scene, index), task.state, origin)
    first = family.first()
    if first is None:
        return None
    predicted = line_through(first.points)
    low, high = visible(predicted, task)
    if high - low < LEAST:
        return None
    columns, across, found = _columns(sight, predicted, (low, high), task.noise)
    best: FollowedState | None = None
    for _ in range(WAYS):
        way = bars.best_way(found, across)
        trusted = way.likeness > LIKE_A_BAR
        points = columns.beside(way.off)
        elastic = first
        for sigma in ROUGH:
            elastic = family.fitted(elastic, Targets(points[trusted], np.full(int(trusted.sum()), sigma)))
        one = _measured(sight, task, family, elastic, (predicted, points, float(way.likeness.mean())))
        if one is not None and (best is None or one.support > best.support):
            best = one
        if best is not None and best.cover > ENOUGH:
            break
        found = bars.without(found, across, way)
    return best


def _columns(sight: Sight, line: SeenLine, reached: tuple[float, float], noise: float) -> tuple[SeenLine, Array, Array]:
    """The middles of columns beside a line, the rows across it, and how like a bar each place is."""
    fine = 4
    places = np.arange(reached[0], reached[1], bars.STEP / fine)
    places = places[: len(places) // fine * fine]
    across = np.arange(-bars.BAND, bars.BAND + 0.5 * bars.ACROSS, bars.ACROSS)
    strip = strip_of(sight.grey, sight.view, line.at(places), across, front(sight.seen))
    strip = strip.reshape(len(across), -1, fine).mean(axis=2)
    columns = line.at(places.reshape(-1, fine).mean(axis=1))
    return columns, across, bars.likeness(strip, across, silhouette(sight.seen, sight.view, columns), noise)


def _measured(
    sight: Sight, task: TracingTask, family: Family, elastic: ElasticCurve, before: tuple[SeenLine, Array, float]
) -> FollowedState | None:
    """The elastic curve nearer and nearer to what windows show, and the rod beside it."""
    seen = replace(sight, blur=sight.blur or max(sight.pixel, mm(0.5)))
    windows: Windows | None = None
    for reach, spread in zip(REACHES, SPREADS, strict=True):
        line = line_through(elastic.points)
        low, high = visible(line, task)
        if high - low < LEAST:
            return None
        places = window_places(sight.seen, low, high)
        if windows is not None and not sight.blur:
            seen = replace(seen, blur=_blur(seen, line, places, windows))
        windows = measured(seen, line, places, reach)
        good = windows.likeness > LIKE_THE_ROD
        line = line.at(windows.places)
        points = line.beside(windows.off)
        elastic = family.fitted(elastic, Targets(points[good], np.hypot(windows.sigma[good], spread)))
    if windows is None:
        return None
    off, _ = distances(elastic, Targets(points, np.ones(len(points))))
    smooth = smoothed(windows.places, off, windows.sigma, good)
    rod = line.beside(windows.off + smooth.off - off)
    predicted, way, likeness = before
    return FollowedState(task.state, predicted, way, elastic, rod, windows, smooth, seen.blur, likeness)


def _blur(sight: Sight, line: SeenLine, places: Array, windows: Windows) -> float:
    """How blurred the picture is there: as the windows that are most like the rod have it."""
    order = np.argsort(-windows.likeness[: len(places)])[: max(6, len(places) // 3)]
    some = places[np.sort(order[order < len(places)])]
    left = []
    for blur in mm(1.0) * BLURS:
        tried = measured(replace(sight, blur=float(blur)), line, some, BLUR_REACH)
        left.append(float(np.median(1.0 - tried.likeness)))
    best = int(np.argmin(left))
    return float(mm(1.0) * BLURS[best])
