"""Every stable state of a segment in space: descents from many curves, then all that a roll of the last clamp meets.

Energy descent from any set of curves misses states whose basin is tiny near a fold. Whatever was met is therefore
followed up and down the roll of the last clamp, over two turns and more, in steps that are halved where it would jump;
where it falls at a fold, what it falls into is followed both ways, too. What is met at the roll asked for is a state.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from curveline.kernels.kernel import njit, shipped
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.geometry.rotations import between, exponential, logarithm, multiply
from curveline.rod.planar.approach import fitting_mesh
from curveline.rod.problem import Array, halved
from curveline.rod.spatial.energy import Shape, SpatialRod, energy, positions
from curveline.rod.spatial.lifting import spatial_rod
from curveline.rod.spatial.linking_number import turns
from curveline.rod.spatial.relax import NEUTRAL, Relaxed, RelaxEnding, descend, largest_turn, settle
from curveline.rod.spatial.richardson import SLIPPED, refined
from curveline.rod.spatial.stability import lowest_eigenvalue
from curveline.rod.spatial.twisting import spread_twist, spun
from curveline.units import deg

EDGES = 48
FLAT_EDGES = 24
"""Edges to search with; in a flat segment, all but the states out of the plane are known from it."""
SAME = 1e-4
"""Vertices of two relaxed shapes that are nearer to each other than this part of the length are the same."""
ALIKE = 1e-7
"""Energies of relaxed shapes that differ by less, relative, are the same."""
STEP = deg(15.0)
"""Roll [rad] from one place of a survey to the next."""
RANGE = 4.0 * math.pi
BEYOND = deg(120.0)
"""Roll [rad] up to which all is followed, and by how much beyond what is asked for if that is more."""
JUMP = 0.35
"""An edge that turns by more than this [rad] beside what the roll itself turns it by may have left its branch."""
FINER = 2
"""Times that edges are halved to look closer at a fold."""
LEAST_PART = 1.0 / 16.0
"""Of a step, below which a jump is a fall."""
WORK = 400_000
"""Edges times iterations of one search, most of a second: of rods that bend in thin layers not all are tried."""
ITERATIONS = 80
OFF = 0.1
"""Turn of the first direction [rad] out of the plane: no start is as symmetric as the scene."""
BUMP = 2.5
"""Turn [rad] of a rod's middle about itself against its ends."""
LEAST_SLACK = 0.02


class Sides(NamedTuple):
    """Towards which sides arches go: `number` of them in a `whole` angle about the chord [rad], with which `bumps`."""

    whole: float
    number: int
    bumps: tuple[float, ...]


ALL_SIDES = Sides(2.0 * math.pi, 8, (0.0, BUMP, -BUMP))
ONE_SIDE = Sides(math.pi, 3, (BUMP, -BUMP))
"""Of a flat segment, whose states come in twins, and whose arches in the plane are known."""
Relaxing = Callable[[SpatialRod, Shape, int], Relaxed]


class Curve(NamedTuple):
    """A start: what tangents are turned by [rad] from the shortest way from clamp to clamp.

    An `arch` towards `direction` about the chord, counted from up to the viewer, and a `bump`, by which the middle is
    rolled against both ends: a strip's states often differ by the side that their middle turns up.
    """

    direction: float
    arch: float
    bump: float


class Met(NamedTuple):
    """A shape that was met, where its vertices are (n+1, 3), and its energy."""

    vertices: Array
    energy: float
    shape: Shape

    def is_near(self, other: Met) -> bool:
        """True if two shapes are the same."""
        return bool(np.max(np.abs(self.vertices - other.vertices)) < SAME)

    def is_alike(self, other: Met) -> bool:
        """True if two shapes may differ by a motion that costs nothing, such as turning a round rod's arch."""
        return abs(self.energy - other.energy) < ALIKE * max(abs(self.energy), 1.0)


@dataclass
class _Survey:
    """Shapes that were met, by the number of `STEP`s of roll beyond what is asked for, and the work done.

    `lost` are those that fell just before what is asked for, and where they last were.
    """

    segment: ClampedRod
    rod: SpatialRod
    places: range
    met: dict[int, list[Met]] = field(default_factory=dict)
    lost: list[tuple[int, Shape]] = field(default_factory=list)
    work: int = 0

    def rod_at(self, place: float) -> SpatialRod:
        """The rod with its last clamp rolled further, by `place` steps."""
        return self.rod._replace(frames=np.array([self.rod.frames[0], spun(self.rod.frames[1], place * STEP)]))

    def relax(self, place: float, shape: Shape, relaxing: Relaxing) -> Shape | None:
        """The stable shape that a shape leads to; None if none is reached."""
        relaxed = relaxing(self.rod_at(place), shape, ITERATIONS)
        self.work += relaxed.iterations * self.rod.edges.size
        return relaxed.shape if relaxed.ending is RelaxEnding.SETTLED else None

    def add(self, place: int, shape: Shape) -> bool:
        """Keep a shape; False if it was met before."""
        rod = self.rod_at(place)
        here = Met(np.asarray(positions(rod, shape)), float(energy(rod, shape)), shape)
        others = self.met.setdefault(place, [])
        if any(here.is_near(other) for other in others):
            return False
        if any(here.is_alike(other) for other in others) and lowest_eigenvalue(rod, shape) < NEUTRAL:
            return False
        others.append(here)
        return True

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
    rod = spatial_rod(segment, fitting_mesh(segment.scaled(), FLAT_EDGES if is_flat else EDGES))
    survey = _Survey(segment, rod, _places(segment.roll[1] - segment.roll[0]))
    for own, shape in seeds:
        _take(survey, _on(rod, own, shape), settle)
    known = len(survey.met.get(0, []))
    for curve in starts(rod, ONE_SIDE if is_flat else ALL_SIDES):
        if survey.work < WORK:
            _take(survey, started(segment, rod, curve), descend)
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


def _on(rod: SpatialRod, own: SpatialRod, shape: Shape) -> Shape | None:
    """A shape of its `own` rod on the edges of `rod`; None if these cannot be had by halving."""
    while own.edges.size < rod.edges.size:
        shape = refined(own, shape)
        own = own._replace(edges=np.repeat(0.5 * own.edges, 2))
    return shape if own.edges.size == rod.edges.size else None


def _take(survey: _Survey, shape: Shape | None, relaxing: Relaxing) -> None:
    """Keep what a start leads to, if that has the turns asked for."""
    relaxed = None if shape is None else survey.relax(0, shape, relaxing)
    if relaxed is not None and survey.add(0, relaxed) and not survey.keeps_turns(0, relaxed):
        survey.drop_last(0)


def _survey_roll(survey: _Survey) -> None:
    """Follow all shapes both ways, and all that they fall into."""
    queue = [(0, met.shape, way) for met in survey.met.get(0, []) for way in (1, -1)]
    while queue and survey.work < WORK:
        fallen = _follow(survey, *queue.pop(0))
        if fallen is not None:
            queue += [(*fallen, 1), (*fallen, -1)]


def _follow(survey: _Survey, place: int, shape: Shape, way: int) -> tuple[int, Shape] | None:
    """Follow a shape until it meets what is known or the end; what it falls into, and where, if that is new."""
    while place + way in survey.places and survey.work < WORK:
        ahead, fell = _step(survey, place, shape, way)
        if place + way == 0 and fell:
            survey.lost.append((place, shape))
        place += way
        if ahead is None or not survey.add(place, ahead):
            return None
        if fell and not survey.keeps_turns(place, ahead):
            survey.drop_last(place)
            return None
        if fell:
            return place, ahead
        shape = ahead
    return None


def _looked_closer(survey: _Survey, place: int, shape: Shape) -> list[Resting]:
    """What finer edges keep of a shape that fell on the way from a neighbouring `place`: these move folds a little."""
    rod = survey.rod
    for _ in range(FINER):
        shape = refined(survey.rod_at(place)._replace(edges=rod.edges), shape)
        rod = spatial_rod(survey.segment, np.asarray(halved(rod.edges)))
    fine = _Survey(survey.segment, rod, survey.places)
    here = fine.relax(place, shape, settle)
    if here is None:
        return []
    ahead, fell = _step(fine, place, here, -place)
    return [] if ahead is None or fell else [(rod, ahead)]


def _step(survey: _Survey, place: int, shape: Shape, way: int) -> tuple[Shape | None, bool]:
    """The shape one place on, None if there is none, and whether it fell there."""
    done, part = 0.0, 1.0
    fell = False
    while done < 1.0:
        part = min(part, 1.0 - done)
        start = spread_twist(survey.rod, shape, way * part * STEP)
        ahead = survey.relax(place + way * (done + part), start, settle)
        jumped = ahead is None or largest_turn(ahead, start) > JUMP
        if jumped and part > LEAST_PART:
            part *= 0.5
            continue
        if ahead is None:
            return None, True
        shape, fell = ahead, fell or jumped
        done += part
        part *= 2.0
    return shape, fell


def starts(rod: SpatialRod, sides: Sides) -> Iterator[Curve]:
    """Curves from which descents lead to most states."""
    slack = 2.0 * math.sqrt(max(1.0 - float(np.linalg.norm(rod.chord)), LEAST_SLACK))
    for side in range(sides.number):
        for bump in sides.bumps:
            yield Curve(OFF + sides.whole / sides.number * side, slack, bump)


def started(segment: ClampedRod, rod: SpatialRod, curve: Curve) -> Shape:
    """The shape of a start."""
    frames = started_frames(rod, segment.roll[1] - segment.roll[0], curve)
    return Shape(np.zeros(rod.edges.size), frames)


@njit
def across_chord(chord):
    """Unit vectors across a chord (3,): up in the display's plane, and from there a quarter turn towards the viewer."""
    along = np.array([1.0, 0.0, 0.0])
    reach = np.sqrt(np.sum(chord**2))
    if np.hypot(chord[0], chord[1]) > 1e-9:
        along = chord / reach
    level = np.hypot(along[0], along[1])
    up = np.array([-along[1] / level, along[0] / level, 0.0])
    front = np.array([-along[2] * up[1], along[2] * up[0], level])
    return up, front


@shipped(SpatialRod, float, Curve)
def started_frames(rod, roll, curve):
    """Frames (n, 4) of a start: those of the shortest way from clamp to clamp, twisted evenly, and turned."""
    n = rod.edges.size
    first, last, q, turn, product = rod.frames[0], np.empty(4), np.empty(4), np.empty(4), np.empty(4)
    way, vector, out = np.empty(3), np.zeros(3), np.empty((n, 4))
    vector[2] = -roll
    exponential(vector, turn)
    multiply(rod.frames[1], turn, last)
    between(first, last, q)
    logarithm(q, way)
    up, front = across_chord(rod.chord)
    c, s = np.cos(curve.direction), np.sin(curve.direction)
    at = 0.0
    for j in range(n):
        middle = at + 0.5 * rod.edges[j]
        at += rod.edges[j]
        for axis in range(3):
            vector[axis] = middle * way[axis]
        exponential(vector, turn)
        multiply(first, turn, q)
        vector[0] = vector[1] = 0.0
        vector[2] = middle * roll + curve.bump * np.sin(np.pi * middle)
        exponential(vector, turn)
        multiply(q, turn, product)
        # An arch towards a direction turns about what lies across it.
        bent = curve.arch * np.sin(2.0 * np.pi * middle)
        for axis in range(3):
            vector[axis] = bent * (c * front[axis] - s * up[axis])
        exponential(vector, turn)
        multiply(turn, product, out[j])
    return out
