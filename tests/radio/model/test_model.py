"""Every state of host, nodes and network is visited: the invariants hold in each, and from each the run can end."""

from __future__ import annotations

from dataclasses import replace

import pytest

from .nodes import Node
from .search import explore
from .setups import CAUGHT_BY, LARGE, MISTAKES, MODELS
from .world import Setup, World

STATES: dict[str, int] = {}


def named(setup: Setup) -> str:
    return setup.name


@pytest.mark.parametrize(
    "setup", [*MODELS, *(pytest.param(each, marks=pytest.mark.campaign) for each in LARGE)], ids=named
)
def test_no_state_breaks_an_invariant_and_every_run_can_end(setup: Setup) -> None:
    found = explore(setup)
    print(found)
    assert not found.violation, str(found)
    STATES[setup.name] = found.states


@pytest.mark.parametrize("setup", MISTAKES, ids=named)
def test_a_mistake_is_found(setup: Setup) -> None:
    found = explore(replace(setup, bugs=frozenset({setup.name})))
    print(found)
    assert found.violation.partition(":")[0] == CAUGHT_BY[setup.name], str(found)


def test_the_models_are_large_enough() -> None:
    """All models together; a part of them alone is not judged."""
    print(f"{sum(STATES.values())} states in {len(STATES)} models")
    assert len(STATES) < len(MODELS) or sum(STATES.values()) >= 300_000


def reached_nodes(setup: Setup) -> set[Node]:
    """Everything that nodes of a setup ever are, and the check that a frame's essence does the same to them."""
    world = World(setup)
    first = world.start()
    seen, waiting = {first}, [first]
    while waiting:
        for _, after, _ in world.moves(waiting.pop()):
            if after not in seen:
                seen.add(after)
                waiting.append(after)
    for station in world.stations.things:
        for frame in station.net:
            essence = world.rules.essence(station.node, frame)
            assert world.rules.receive(station.node, frame) == world.rules.receive(station.node, essence)
    return {station.node for station in world.stations.things}


@pytest.mark.parametrize(
    "setup",
    [
        Setup("crash", nodes=1, steps=2, lives=2),
        Setup("hold", nodes=1, steps=1, holds=2),
        Setup("silence", nodes=1, steps=2, silences=True, restarts=1),
        Setup("pair", nodes=2, steps=1),
    ],
    ids=named,
)
def test_forgetting_spent_frames_forgets_no_behaviour(setup: Setup) -> None:
    """The same node states are reached whether the network keeps whole frames or what can still come of them."""
    assert reached_nodes(replace(setup, unreduced=True)) == reached_nodes(setup)
