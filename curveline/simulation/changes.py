"""Changes to the numbers of a scene: which there are, and the smallest of them that makes it work.

    found = Hunt(rays_of(scene, quantities), works, tries).next()
    found.changes           # angle of node 2: -48.3 deg instead of -60 deg

What is tried is what is printed: values are numbers of a shape file, in mm or degrees, with a decimal at most.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace

from curveline.scene import Display, Range, Scene
from curveline.simulation.simulate import begin_of
from curveline.units import deg, mm, to_deg, to_mm

LENGTH, ANGLE, HEIGHT = "length", "angle", "height"

FIRST = 1.0 / 256.0
"""The first step away from what was asked for, as a part of what the display's limits allow; a degree or two mm."""
GROWTH = 1.5
LARGEST = {1: 1.0 / 16.0, 2: 1.0 / 4.0}
"""The largest step, for one quantity and for two: values that work, but only between others, are not stepped over. Two
have four times as many ways."""
PER_UNIT = 10
"""Values that are tried per millimetre or degree."""

Predicate = Callable[[Scene], bool]


@dataclass(frozen=True)
class Quantity:
    """A number of a scene: the length of a segment, or the angle or height of a node, counted from 0."""

    kind: str
    place: int

    def of(self, scene: Scene) -> float:
        """Its value in SI."""
        if self.kind == LENGTH:
            return scene.segments[self.place].length
        node = scene.nodes[self.place]
        return node.angle if self.kind == ANGLE else node.height

    def put(self, scene: Scene, value: float) -> Scene:
        """The same scene with another value."""
        if self.kind == LENGTH:
            segments = list(scene.segments)
            segments[self.place] = replace(segments[self.place], length=value)
            return replace(scene, segments=tuple(segments))
        nodes = list(scene.nodes)
        old = nodes[self.place]
        nodes[self.place] = replace(old, angle=value) if self.kind == ANGLE else replace(old, height=value)
        return replace(scene, nodes=tuple(nodes))

    def limits(self, display: Display) -> Range:
        """What the display allows."""
        allowed = display.limits
        return {LENGTH: allowed.length, ANGLE: allowed.angle, HEIGHT: allowed.height}[self.kind]

    def written(self, value: float) -> float:
        """A value in SI as a number of a shape file, in mm or degrees."""
        return to_deg(value) if self.kind == ANGLE else to_mm(value)

    def read(self, number: float) -> float:
        """A number of a shape file in SI."""
        return deg(number) if self.kind == ANGLE else mm(number)

    def near(self, value: float, display: Display) -> float:
        """The value nearest to another that a file can give in a few digits and the display allows."""
        limits = self.limits(display)
        low, high = math.ceil(self._ticks(limits.low) - SLACK), math.floor(self._ticks(limits.high) + SLACK)
        return self.read(min(max(round(self._ticks(value)), low), high) / PER_UNIT)

    def _ticks(self, value: float) -> float:
        return self.written(value) * PER_UNIT

    @property
    def tick(self) -> float:
        """How finely it is sought: 0.1 mm or 0.1 deg, in SI."""
        return self.read(1.0 / PER_UNIT)

    def __str__(self) -> str:
        return f"{self.kind} of {'segment' if self.kind == LENGTH else 'node'} {self.place + 1}"

    def shown(self, value: float) -> str:
        """A value with its unit."""
        return f"{round(self.written(value), 2) + 0.0:g} {'deg' if self.kind == ANGLE else 'mm'}"


SLACK = 1e-6
"""Part of a tick that going to SI and back may cost."""


@dataclass(frozen=True)
class Change:
    """A quantity, what was asked of it, and the nearest value that works."""

    quantity: Quantity
    asked: float
    nearest: float

    def __str__(self) -> str:
        return f"{self.quantity.shown(self.nearest)} instead of {self.quantity.shown(self.asked)}"


@dataclass(frozen=True)
class Ray:
    """Away from what was asked for, in one quantity or in several at once; `signs` say which way."""

    scene: Scene
    quantities: tuple[Quantity, ...]
    signs: tuple[int, ...]

    def values(self, change: float) -> tuple[float, ...]:
        """Values after a relative `change`, as a part of each quantity's limits, within these."""
        return tuple(self._value(*each, change) for each in zip(self.quantities, self.signs, strict=True))

    def _value(self, quantity: Quantity, sign: int, change: float) -> float:
        limits = quantity.limits(self.scene.display)
        value = quantity.of(self.scene) + sign * change * (limits.high - limits.low)
        return quantity.near(value, self.scene.display)

    def at(self, change: float) -> Scene:
        """The scene after a relative change."""
        scene = self.scene
        for quantity, value in zip(self.quantities, self.values(change), strict=True):
            scene = quantity.put(scene, value)
        return scene

    def changes(self, change: float) -> tuple[Change, ...]:
        """What a relative change is, quantity by quantity."""
        pairs = zip(self.quantities, self.values(change), strict=True)
        return tuple(Change(quantity, quantity.of(self.scene), value) for quantity, value in pairs)

    @property
    def reach(self) -> float:
        """The relative change at which the first quantity is at its limit."""
        return min(self._room(*each) for each in zip(self.quantities, self.signs, strict=True))

    def _room(self, quantity: Quantity, sign: int) -> float:
        limits, value = quantity.limits(self.scene.display), quantity.of(self.scene)
        return (limits.high - value if sign > 0 else value - limits.low) / (limits.high - limits.low)

    @property
    def largest(self) -> float:
        """The largest step along it."""
        return LARGEST[len(self.quantities)]

    def is_fine(self, low: float, high: float) -> bool:
        """True if nothing lies between two changes."""
        pairs = zip(self.quantities, self.values(low), self.values(high), strict=True)
        return all(abs(after - before) < 1.5 * quantity.tick for quantity, before, after in pairs)

    def closest(self, works: Predicate, low: float, high: float) -> float:
        """The smallest change that works between `low`, which does not, and `high`, which does."""
        while not self.is_fine(low, high):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if works(self.at(middle)) else (middle, high)
        return high


def part_of(scene: Scene, segments: range) -> Scene:
    """The scene of some neighbouring `segments` alone, from 0, as far as there are such."""
    first, behind = max(segments.start, 0), min(segments.stop, len(scene.segments))
    loads = (replace(load, segment=load.segment - first) for load in scene.loads if first <= load.segment < behind)
    return replace(
        scene,
        begin=begin_of(scene, first),
        nodes=scene.nodes[first : behind + 1],
        segments=scene.segments[first:behind],
        loads=tuple(loads),
    )


def single_rays(scene: Scene, quantities: Iterable[Quantity]) -> Iterator[Ray]:
    """Both ways in every quantity."""
    for quantity, sign in itertools.product(quantities, (1, -1)):
        yield Ray(scene, (quantity,), (sign,))


def double_rays(scene: Scene, quantities: Iterable[Quantity]) -> Iterator[Ray]:
    """All ways in two quantities at once."""
    for pair in itertools.combinations(quantities, 2):
        for signs in itertools.product((1, -1), repeat=2):
            yield Ray(scene, pair, signs)


@dataclass
class Counted:
    """A predicate that sees no more than so many scenes: all others fail."""

    works: Predicate
    tries: int

    def __call__(self, scene: Scene) -> bool:
        """True if the scene works."""
        self.tries -= 1
        return self.tries >= 0 and self.works(scene)


@dataclass(order=True, frozen=True)
class _Look:
    """How far a ray has been looked along: nothing works up to `low`; `change` is the first that does, if known."""

    low: float
    ray: int
    step: float = field(compare=False, default=FIRST)
    change: float | None = field(compare=False, default=None)


class Hunt:
    """The smallest changes along any of some `rays` with which a scene `works`, one after another.

    All rays are looked along at once, in steps that grow, so that no more is tried than what the smallest change takes.
    Nothing up to a change of `begin` is tried.
    """

    def __init__(self, rays: Iterable[Ray], works: Counted, begin: float = 0.0) -> None:
        self._rays = list(rays)
        self._works = works
        self._queue = [_Look(begin, index) for index, _ in enumerate(self._rays)]
        heapq.heapify(self._queue)

    def next(self) -> tuple[Ray, float] | None:
        """The ray with the next smallest change, and the change; None where there is no other, or no try left."""
        while self._queue and self._works.tries > 0:
            look = heapq.heappop(self._queue)
            ray = self._rays[look.ray]
            if look.change is not None:
                heapq.heappush(self._queue, _Look(GROWTH * look.change, look.ray))
                return ray, look.change
            if (further := self._further(ray, look)) is not None:
                heapq.heappush(self._queue, further)
        return None

    def _further(self, ray: Ray, look: _Look) -> _Look | None:
        """One step along a ray; None at its end."""
        high = min(look.low + look.step, ray.reach)
        if high <= look.low:
            return None
        if self._works(ray.at(high)):
            change = ray.closest(self._works, look.low, high)
            return _Look(change, look.ray, change=change)
        return _Look(high, look.ray, min(GROWTH * look.step, ray.largest))
