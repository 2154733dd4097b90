"""The model is honest: whatever the real host and nodes do in random runs, it allows."""

from __future__ import annotations

from random import Random

import pytest

from curveline.radio.host.actions import Phase, Write
from curveline.radio.mock.air import Weather

from ..mutants import Mistake, mutant, with_body
from .follow import Followed

RUNS = 40
STRANGERS = (
    Mistake("a step starts a little early", "node.machine", ">= memory.staged and", "+ 1 >= memory.staged and"),
    Mistake(
        "any go lifts the dead-man", "node.body", "self._lift_above = self._session.hold_gen", "self._lift_above = -1"
    ),
    Mistake(
        "the barrier is not waited for", "host.conductor", "peer.finished < self.step]", "peer.started < self.step]"
    ),
    Mistake("a hold is a go", "host.conductor", "self._hold_gen |= 1", "self._hold_gen |= 2"),
)
"""Changes of the code that the model does not know of."""


def follow(seed: int, bench_class: type[Followed] = Followed) -> Followed:
    """One run of 3 steps in which now and then something happens, up to its end or its halt."""
    random = Random(seed)
    weather = Weather(random.choice((0.0, 0.2, 0.5)), duplicate=0.05, stale=0.2, corrupt=0.02)
    bench = bench_class(random.choice((1, 2, 3)), 3, seed, weather)
    lives = 0
    while bench.act(bench.conductor.next(bench.now_ms)):
        assert bench.now_ms < 200_000, "it does not end"
        dice = random.random()
        if dice < 0.01:
            bench.hold()
        elif bench.conductor.phase is Phase.PAUSED and dice < 0.5:
            bench.go_on()
        elif dice < 0.011:
            bench.now_us += random.randrange(2_000_000)
        elif dice < 0.0125:
            bench.broadcast_stop()
        elif dice < 0.013:
            bench.reboot(random.randrange(len(bench.nodes)))
        elif dice < 0.02 and lives < 4 and bench.records:
            lives += 1
            action = bench.conductor.next(bench.now_ms)
            if isinstance(action, Write) and random.random() < 0.5:
                bench.act(action)
            bench.new_host((seed * 8 + lives) << 8)
    return bench


@pytest.mark.parametrize("seed", range(RUNS))
def test_what_the_code_does_the_model_allows(seed: int) -> None:
    bench = follow(seed)
    print(f"seed {seed}: {bench.checked} steps compared, {bench.conductor.phase}, {bench.conductor.halt}")
    assert bench.checked > 20


@pytest.mark.parametrize("mistake", STRANGERS, ids=lambda mistake: mistake.name)
def test_code_that_does_otherwise_is_noticed(mistake: Mistake) -> None:
    class Strange(Followed):
        pass

    module = mutant(mistake)
    if mistake.module == "node.machine":
        Strange.node_class = module.NodeMachine
    elif mistake.module == "node.body":
        Strange.node_class = with_body(module)
    else:
        Strange.host_class = module.Conductor
    with pytest.raises(AssertionError, match=r"differ|allows|held") as found:
        follow_all(Strange)
    print(found.value)


def follow_all(bench_class: type[Followed]) -> None:
    """The runs above, with other code."""
    for seed in range(RUNS):
        follow(seed, bench_class)
