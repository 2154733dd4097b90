"""Visits every state of a world, breadth first: a violation is found with the shortest way to it."""

from __future__ import annotations

from array import array
from collections import deque
from dataclasses import dataclass

from .world import Setup, State, Violation, World


@dataclass(frozen=True)
class Found:
    """What a search came to: states visited, and the invariant that failed with the way there, empty if none."""

    setup: Setup
    states: int
    violation: str = ""
    trace: tuple[str, ...] = ()

    def __str__(self) -> str:
        steps = "".join(f"\n  {number}. {words}" for number, words in enumerate(self.trace, start=1))
        return f"{self.setup.name}: {self.violation or 'no violation'} in {self.states} states{steps}"


def explore(setup: Setup, limit: int = 2_000_000) -> Found:
    """Every state that can be reached, or the first violation: of an invariant, or of the promise that runs end."""
    world = World(setup)
    first = world.start()
    numbers: dict[State, int] = {first: 0}
    order: list[State] = [first]
    parents = array("i", [-1])
    fair_from, fair_to = array("i"), array("i")
    waiting = deque([0])
    while waiting:
        number = waiting.popleft()
        state = order[number]
        try:
            world.check(state)
            for _, after, fair in world.moves(state):
                found = numbers.get(after)
                if found is None:
                    found = numbers[after] = len(order)
                    order.append(after)
                    parents.append(number)
                    waiting.append(found)
                if fair:
                    fair_from.append(number)
                    fair_to.append(found)
        except Violation as violation:
            return Found(setup, len(order), str(violation), _trace(world, order, parents, number))
        if len(order) > limit:
            raise AssertionError(f"{setup.name} has more than {limit} states")
    stuck = _stuck(world, order, fair_from, fair_to)
    if stuck is not None:
        trace = _trace(world, order, parents, stuck)
        return Found(setup, len(order), "I10: from here the run cannot end any more", trace)
    return Found(setup, len(order))


def _stuck(world: World, order: list[State], fair_from: array[int], fair_to: array[int]) -> int | None:
    """The first state from which no way leads to the end on which nothing goes wrong; None if there is none."""
    ends = bytearray(world.ends(state) for state in order)
    changed = True
    while changed:
        changed = False
        for edge in range(len(fair_from) - 1, -1, -1):
            if ends[fair_to[edge]] and not ends[fair_from[edge]]:
                ends[fair_from[edge]] = changed = True
    stuck = ends.find(0)
    return None if stuck < 0 else stuck


def _trace(world: World, order: list[State], parents: array[int], number: int) -> tuple[str, ...]:
    """How to get to a state, in words."""
    words: list[str] = []
    while parents[number] >= 0:
        before = parents[number]
        label = next(label for label, after, _ in world.moves(order[before]) if after == order[number])
        words.append(world.words(label))
        number = before
    return tuple(reversed(words))
