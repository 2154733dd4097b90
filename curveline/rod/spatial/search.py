"""Every stable state of a segment in space: descents from many curves, then all that a roll of the last clamp meets.

Energy descent from any set of curves misses states whose basin is tiny near a fold. Whatever was met is therefore
followed up and down the roll of the last clamp, over two turns and more, in steps that are halved where it would jump;
where it falls at a fold, what it falls into is followed both ways, too. What is met at the roll asked for is a state.
Few edges have their folds elsewhere: where a shape falls just before the roll asked for, or a descent passes where next
to no force is left over, finer edges are asked.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.problem import Array, halved
from curveline.rod.spatial.energy import Shape, SpatialRod, energy, positions
from curveline.rod.spatial.lifting import lifting_mesh, spatial_rod
from curveline.rod.spatial.linking_number import turns
from curveline.rod.spatial.relax import NEUTRAL, Relaxed, RelaxEnding, descend, settle
from curveline.rod.spatial.richardson import SLIPPED, refined
from curveline.rod.spatial.rolling import BESIDE, roll_on, roll_through
from curveline.rod.spatial.stability import lowest_eigenvalue
from curveline.rod.spatial.starts import ALL_SIDES, ONE_SIDE, Sides, descended, starts
from curveline.rod.spatial.twisting import spread_twist, spun
from curveline.units import deg

EDGES = 48
FLAT_EDGES = 24
"""Edges to search with; in a flat segment, all but the states out of the plane are known from it."""
SAME = 1e-4
"""Vertices of two relaxed shapes that are nearer to each other than this part of the length are the same."""
ALIKE = 1e-7
"""Energies of relaxed shapes that differ by less, relative, are the same."""
ROUND = 1e-3
"""Stiffnesses of bending that differ by less, relative, are those of a round rod."""
STEP = deg(30.0)
"""Roll [rad] from one place of a survey to the next."""
RANGE = 4.0 * math.pi
BEYOND = deg(120.0)
"""Roll [rad] up to which all is followed, and by how much beyond what is asked for if that is more."""
NEXT = deg(15.0)
"""Roll [rad] within which finer edges may have another fold."""
FINER = 2
"""Times that edges are halved to look closer at a fold."""
WORK = 400_000
"""Edges times iterations of one search, most of a second: of rods that bend in thin layers not all are tried."""
ITERATIONS = 80


Relaxing = Callable[[SpatialRod, Shape, int], Relaxed]


class Met(NamedTuple):
    """A shape that was met, where its vertices are (n+1, 3), its `middle` one among them, and its energy."""

    vertices: Array
    middle: tuple[float, ...]
    energy: float
    shape: Shape

    def is_near(self, other: Met) -> bool:
        """True if two shapes are the same."""
        apart = max(abs(here - there) for here, there in zip(self.middle, other.middle, strict=True))
        return apart < SAME and bool(np.max(np.abs(self.vertices - other.vertices)) < SAME)

    def is_alike(self, other: Met) -> bool:
        """True if two shapes may differ by a motion that costs nothing, such as turning a round rod's arch."""
        return abs(self.energy - other.energy) < ALIKE * max(abs(self.energy), 1.0)


@dataclass
class _Survey:
    """Shapes that were met, by the number of `STEP`s of roll beyond what is asked for, and the work done.

    `lost` are those that fell just before what is asked for, and where they last were, and what descents have passed.
    """

    segment: ClampedRod
    rod: SpatialRod
    places: range
    met: dict[int, list[Met]] = field(default_factory=dict)
    lost: list[tuple[float, Shape]] = field(default_factory=list)
    work: int = 0
    rods: dict[float, SpatialRod] = field(default_factory=dict)

    def rod_at(self, place: float) -> SpatialRod:
        """The rod with its last clamp rolled further, by `place` steps."""
        if place not in self.rods:
            frames = np.array([self.rod.frames[0], spun(self.rod.frames[1], place * STEP)])
            self.rods[place] = self.rod._replace(frames=frames)
        return self.rods[place]

    def relax(self, place: float, shape: Shape, relaxing: Relaxing) -> Shape | None:
        """The stable shape that a shape leads to; None if none is reached."""
        relaxed = relaxing(self.rod_at(place), shape, ITERATIONS)
        self.work += relaxed.iterations * self.rod.edges.size
        return relaxed.shape if relaxed.ending is RelaxEnding.SETTLED else None

    def roll_on(self, place: int, shape: Shape, way: int) -> tuple[list[tuple[Shape, Array]], float, Shape]:
        """What a stable shape becomes at place after place, with its vertices; where it comes to at most, as what."""
        count = len(self.ahead(place, way))
        *shapes, vertices, last, done, work = roll_through(self.rod_at(place), shape, way * STEP, count, BESIDE)
        self.work += work * self.rod.edges.size
        reached = [_shape_of(each) for each in zip(*shapes, strict=True)]
        return list(zip(reached, vertices, strict=True)), place + done / STEP, last

    def ahead(self, place: int, way: int) -> range:
        """The places after one, on the way."""
        return range(place + way, self.places.stop if way > 0 else self.places.start - 1, way)

    def add(self, place: int, shape: Shape, vertices: Array | None = None) -> bool:
        """Keep a shape, whose vertices may be known; False if it was met before."""
        rod = self.rod_at(place)
        vertices = np.asarray(positions(rod, shape)) if vertices is None else vertices
        here = Met(vertices, tuple(vertices[len(vertices) // 2].tolist()), self._energy(rod, shape), shape)
        others = self.met.setdefault(place, [])
        if any(here.is_near(other) for other in others):
            return False
        is_round = not math.isnan(here.energy)
        if is_round and any(here.is_alike(other) for other in others) and lowest_eigenvalue(rod, shape) < NEUTRAL:
            return False
        others.append(here)
        return True

    def _energy(self, rod: SpatialRod, shape: Shape) -> float:
        """The energy of a shape of a round rod, the only one that motions without cost are known of."""
        first, second = rod.stiffness[:2]
        return float(energy(rod, shape)) if abs(first - second) < ROUND * second else math.nan

    def drop_last(self, place: int) -> None:
        """Forget the shape that was added last."""
        self.met[place].pop()

    def keeps_turns(self, place: int, shape: Shape) -> bool:
        """True if a shape has the turns that the clamps put into it: see `link`."""
        asked = self.segment.roll[1] - self.segment.roll[0] + place * STEP
        return abs(turns(self.rod_at(place), shape) - asked / (2.0 * math.pi)) <= SLIPPED


Resting = tuple[SpatialRod, Shape]
"""A stable shape, and the rod that is cut as it is."""


def search_in_space(segment: ClampedRod, seeds: Sequence[Resting]) -> list[Resting]:
    """Stable shapes of a segment that are none of the `seeds`."""
    is_flat = segment.is_nearly_flat
    rod = spatial_rod(segment, lifting_mesh(segment, FLAT_EDGES if is_flat else EDGES))
    survey = _Survey(segment, rod, _places(segment.roll[1] - segment.roll[0]))
    for own, shape in seeds:
        relaxed = _settled(survey, own, shape)
        if relaxed is not None:
            _keep(survey, relaxed)
    known = len(survey.met.get(0, []))
    _take_starts(survey, ONE_SIDE if is_flat else ALL_SIDES)
    if not is_flat:
        _survey_roll(survey)
    met = [(rod, met.shape) for met in survey.met.get(0, [])[known:]]
    return met + [closer for place, shape in survey.lost for closer in _looked_closer(survey, place, shape)]


def _places(roll: float) -> range:
    """Places of a survey: from no roll to `RANGE` and `BEYOND` what is asked for, at most `RANGE` to either side."""
    ends = (0.0, math.copysign(RANGE, roll))
    least = min(*ends, roll - BEYOND) - roll
    most = max(*ends, roll + BEYOND) - roll
    return range(math.floor(max(least, -RANGE) / STEP), math.ceil(min(most, RANGE) / STEP) + 1)


def _settled(survey: _Survey, own: SpatialRod, shape: Shape) -> Shape | None:
    """What a shape of its `own` rod becomes on the edges of a survey; None if these cannot be had by halving."""
    while own.edges.size < survey.rod.edges.size:
        shape = refined(own, shape)
        own = own._replace(edges=np.repeat(0.5 * own.edges, 2))
    return survey.relax(0, shape, settle) if own.edges.size == survey.rod.edges.size else None


def _keep(survey: _Survey, shape: Shape) -> None:
    """Keep a shape if it is new, and has the turns asked for."""
    if survey.add(0, shape) and not survey.keeps_turns(0, shape):
        survey.drop_last(0)


def _take_starts(survey: _Survey, sides: Sides) -> None:
    """Keep what descents from arches lead to."""
    rod, roll = survey.rod, survey.segment.roll[1] - survey.segment.roll[0]
    curves = np.array(list(starts(rod, sides)))
    known = np.array([met.shape.frames for met in survey.met.get(0, [])]).reshape(-1, rod.edges.size, 4)
    *shapes, work, passed = descended(rod, roll, curves, known, WORK // rod.edges.size)
    survey.lost += [(0.0, Shape(np.zeros(rod.edges.size), frames)) for frames in passed]
    survey.work += work * rod.edges.size
    for shape in zip(*shapes, strict=True):
        _keep(survey, _shape_of(shape))


def _shape_of(parts: Sequence[Array]) -> Shape:
    """A shape of what kernels give of it: strain, frames, turns and tilts (2,)."""
    strain, frames, turned, (first, last) = parts
    return Shape(strain, frames, turned, (first, last))


def _survey_roll(survey: _Survey) -> None:
    """Follow all shapes both ways, and all that they fall into."""
    queue = [(0, met.shape, way) for met in survey.met.get(0, []) for way in (1, -1)]
    while queue and survey.work < WORK:
        fallen = _follow(survey, *queue.pop(0))
        if fallen is not None:
            queue += [(*fallen, 1), (*fallen, -1)]


def _follow(survey: _Survey, place: int, shape: Shape, way: int) -> tuple[int, Shape] | None:
    """Follow a shape until it meets what is known or the end; what it falls into, and where, if that is new."""
    shapes, reached, last = survey.roll_on(place, shape, way)
    for each, vertices in shapes:
        place += way
        if not (survey.add(0, _at_rest(survey, each)) if place == 0 else survey.add(place, each, vertices)):
            return None
    if not survey.ahead(place, way):
        return None
    place += way
    if place == 0 and abs(reached) * STEP < NEXT:
        survey.lost.append((reached, last))
    fallen = survey.relax(place, spread_twist(survey.rod, last, (place - reached) * STEP), descend)
    if fallen is None or not survey.add(place, fallen):
        return None
    if not survey.keeps_turns(place, fallen):
        survey.drop_last(place)
        return None
    return place, fallen


def _at_rest(survey: _Survey, shape: Shape) -> Shape:
    """What a shape comes to rest in that was followed to the roll asked for, with little force left over."""
    rest = survey.relax(0, shape, settle)
    if rest is None:
        survey.lost.append((0.0, shape))
    return rest or shape


def _looked_closer(survey: _Survey, place: float, shape: Shape) -> list[Resting]:
    """What finer edges keep of a shape that fell at a `place`, or was passed there: these move folds a little."""
    rod = survey.rod
    for _ in range(FINER):
        shape = refined(survey.rod_at(place)._replace(edges=rod.edges), shape)
        rod = spatial_rod(survey.segment, np.asarray(halved(rod.edges)))
    fine = _Survey(survey.segment, rod, survey.places)
    here = fine.relax(place, shape, settle)
    if here is None:
        return []
    ahead, done, _ = roll_on(fine.rod_at(place), here, -place * STEP)
    return [(rod, ahead)] if done == -place * STEP else []
