"""Of a shape that cannot be planned, the single number that is at fault, and its nearest value that would work.

    found = nearest(scene, segment, works)
    found.sentence          # angle of node 2 is at fault: with -48.3 deg instead of -60 deg it works

The search has two sieves. The coarse one asks of thousands of values only whether the wanted states exist, with their
margins, within what rod and motors give; the fine one is the caller's and may cost a whole plan, so that few see it.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from curveline.errors import Infeasible
from curveline.planning.goals import check_goal
from curveline.planning.proof import Prover
from curveline.scene import Display, Range, Scene
from curveline.units import deg, mm, to_deg, to_mm

Predicate = Callable[[Scene], str]
"""Why a scene does not work; empty if it does."""

LENGTH, ANGLE, HEIGHT = "length", "angle", "height"

FIRST = 1.0 / 256.0
"""The first step away from what was asked for, as a part of what the display's limits allow; a degree or two mm."""
GROWTH = 1.5
LARGEST = {1: 1.0 / 16.0, 2: 1.0 / 4.0}
"""The largest step, for one quantity and for two: values that work, but only between others, are not stepped over. Two
have four times as many ways."""
BEYOND = 1.0 / 32.0
"""The first change that is tried where nothing is wrong with the shape itself, only with the way to it."""
TRIES = 6


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

    @property
    def tick(self) -> float:
        """How finely it is sought: 0.1 mm or 0.1 deg."""
        return deg(0.1) if self.kind == ANGLE else mm(0.1)

    def __str__(self) -> str:
        return f"{self.kind} of {'segment' if self.kind == LENGTH else 'node'} {self.place + 1}"

    def shown(self, value: float) -> str:
        """A value with its unit."""
        number, unit = (to_deg(value), "deg") if self.kind == ANGLE else (to_mm(value), "mm")
        return f"{round(number, 2) + 0.0:g} {unit}"


@dataclass(frozen=True)
class Change:
    """A quantity, what was asked of it, and the nearest value that works."""

    quantity: Quantity
    asked: float
    nearest: float

    def __str__(self) -> str:
        return f"{self.quantity.shown(self.nearest)} instead of {self.quantity.shown(self.asked)}"


@dataclass(frozen=True)
class Advice:
    """What to change: one quantity, or two where no single one helps; `reason` says what is wrong without it."""

    changes: tuple[Change, ...]
    reason: str

    @property
    def sentence(self) -> str:
        """The advice in words."""
        if len(self.changes) == 1:
            (change,) = self.changes
            return f"{change.quantity} is at fault: with {change} it works"
        both = " and ".join(f"{change.quantity} of {change}" for change in self.changes)
        return f"no single number is at fault: with {both} it works"


@dataclass(frozen=True)
class _Ray:
    """Away from what was asked for, in one quantity or in several at once; `signs` say which way."""

    scene: Scene
    quantities: tuple[Quantity, ...]
    signs: tuple[int, ...]

    def values(self, change: float) -> tuple[float, ...]:
        """Values after a relative `change`, as a part of each quantity's limits, on whole ticks within them."""
        return tuple(self._value(*each, change) for each in zip(self.quantities, self.signs, strict=True))

    def _value(self, quantity: Quantity, sign: int, change: float) -> float:
        limits, tick = quantity.limits(self.scene.display), quantity.tick
        value = quantity.of(self.scene) + sign * change * (limits.high - limits.low)
        return min(max(round(value / tick) * tick, limits.low), limits.high)

    def at(self, change: float) -> Scene:
        """The scene after a relative change."""
        scene = self.scene
        for quantity, value in zip(self.quantities, self.values(change), strict=True):
            scene = quantity.put(scene, value)
        return scene

    @property
    def reach(self) -> float:
        """The relative change at which the first quantity is at its limit."""
        return min(self._room(*each) for each in zip(self.quantities, self.signs, strict=True))

    def _room(self, quantity: Quantity, sign: int) -> float:
        limits, value = quantity.limits(self.scene.display), quantity.of(self.scene)
        return (limits.high - value if sign > 0 else value - limits.low) / (limits.high - limits.low)

    def is_fine(self, low: float, high: float) -> bool:
        """True if nothing lies between two changes."""
        pairs = zip(self.quantities, self.values(low), self.values(high), strict=True)
        return all(abs(after - before) < 1.5 * quantity.tick for quantity, before, after in pairs)

    def first(self, works: Callable[[Scene], bool], begin: float) -> float | None:
        """The smallest change from `begin` on at which the scene works, as far as growing steps show; None if none."""
        low, reach = begin, self.reach
        step = FIRST
        while low < reach:
            high = min(low + step, reach)
            if works(self.at(high)):
                return self.closest(works, low, high)
            low, step = high, min(GROWTH * step, LARGEST[len(self.quantities)])
        return None

    def closest(self, works: Callable[[Scene], bool], low: float, high: float) -> float:
        """The smallest change that works between `low`, which does not, and `high`, which does."""
        while not self.is_fine(low, high):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if works(self.at(middle)) else (middle, high)
        return high


def nearest(scene: Scene, segment: int, works: Predicate, tries: int = TRIES) -> Advice | None:
    """The smallest change to `scene`, refused for its `segment` (from 0), that makes it work.

    Small in relation to what the display's limits allow; in one quantity that this segment has a part in, in two at
    once only where no single one helps; None where neither does. What is advised has been tried: `works`, which may
    cost a plan, sees at most so many scenes.
    """
    coarse, fine = _Sieve(scene, segment), _Fine(works, tries)
    reason = coarse.reason(scene)
    for rays in (_single(scene, segment), _double(scene, segment)):
        found = _search(list(rays), coarse, fine)
        if found is not None:
            ray, change = found
            changes = zip(ray.quantities, ray.values(change), strict=True)
            return Advice(tuple(Change(each, each.of(scene), value) for each, value in changes), reason)
    return None


def _single(scene: Scene, segment: int) -> Iterator[_Ray]:
    """Both ways in every quantity that a segment has a part in."""
    for quantity, sign in itertools.product(_quantities(segment), (1, -1)):
        yield _Ray(scene, (quantity,), (sign,))


def _double(scene: Scene, segment: int) -> Iterator[_Ray]:
    """All ways in two of these quantities at once; both heights together are none."""
    for pair in itertools.combinations(_quantities(segment), 2):
        for signs in itertools.product((1, -1), repeat=2):
            yield _Ray(scene, pair, signs)


def _quantities(segment: int) -> tuple[Quantity, ...]:
    ends = (segment, segment + 1)
    return (Quantity(LENGTH, segment), *(Quantity(kind, node) for kind in (ANGLE, HEIGHT) for node in ends))


def _search(rays: list[_Ray], coarse: _Sieve, fine: _Fine) -> tuple[_Ray, float] | None:
    """The ray with the smallest change that passes both sieves, and the change; None if none was found.

    Where the scene itself passes the coarse sieve, nothing tells how far to go: growing steps then show.
    """
    is_open = coarse.passes(rays[0].scene)
    queue: list[tuple[float, int, float | None]] = []
    for index, ray in enumerate(rays):
        if (change := ray.first(coarse.passes, BEYOND if is_open else 0.0)) is not None:
            heapq.heappush(queue, (change, index, 0.0 if is_open else None))
    while queue and fine.tries:
        change, index, refused = heapq.heappop(queue)
        ray = rays[index]
        if fine.passes(ray.at(change)):
            return ray, change if refused is None else ray.closest(fine.passes, refused, change)
        if (further := ray.first(coarse.passes, GROWTH * change)) is not None:
            heapq.heappush(queue, (further, index, change))
    return None


@dataclass
class _Fine:
    """The caller's sieve, which sees no more than so many scenes: all others fail."""

    works: Predicate
    tries: int

    def passes(self, scene: Scene) -> bool:
        """True if the scene works."""
        self.tries -= 1
        return self.tries >= 0 and not self.works(scene)


class _Sieve:
    """Whether the wanted states of a segment and its neighbours exist, within what rod and motors give.

    Of two neighbours on either side: a change reaches the first, whose far node bears the second, too.
    """

    def __init__(self, scene: Scene, segment: int) -> None:
        self._prover = Prover(scene.display, lambda: None)
        self._first = max(0, segment - 2)
        self._behind = segment + 3

    def passes(self, scene: Scene) -> bool:
        """True if nothing is wrong."""
        return not self.reason(scene)

    def reason(self, scene: Scene) -> str:
        """What is wrong; empty if nothing."""
        part = replace(
            scene,
            nodes=scene.nodes[self._first : self._behind + 1],
            segments=scene.segments[self._first : self._behind],
            loads=tuple(
                replace(load, segment=load.segment - self._first)
                for load in scene.loads
                if self._first <= load.segment < self._behind
            ),
        )
        try:
            check_goal(self._prover, part)
        except Infeasible as refusal:
            return refusal.message
        return ""
