"""Every frame that a node ever heard, heard once more: later in its run, in a resumed one, in another, after a restart.

STOP is not among them: it needs no freshness, because it brings nodes to a hold that their owner lifts. A frame that
was lost is none either: heard late, it is merely late.
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace
from random import Random

import pytest

from curveline.radio.host.actions import Phase, Send
from curveline.radio.host.conductor import Conductor
from curveline.radio.host.resume import resume_point
from curveline.radio.mock.air import Weather
from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import MotorPlant
from curveline.radio.node.state import HOMED, Identity, Memory, NodeTally
from curveline.radio.protocol.codes import FrameKind, NodeState
from curveline.radio.protocol.envelope import kind_of
from curveline.radio.protocol.motion import Axes

from .bench import HOME, Bench, make_plan, target

POSES = [(0.4, 0.5, 0.1), (0.2, 0.0, 0.3), (0.3, 0.2, 0.0)]


class Hearing(NodeMachine):
    """A node that writes down what it hears."""

    def __init__(self, past: list[bytes], identity: Identity, axes: Axes, plant: MotorPlant, memory: Memory) -> None:
        super().__init__(identity, axes, plant, memory)
        self.past = past

    def receive(self, now_ms: int, payload: bytes) -> None:
        self.past.append(payload)
        super().receive(now_ms, payload)


class Haunted(Bench):
    """A bench in which every frame of before is heard again before each new one, by a copy of the node."""

    def __init__(self, weather: Weather | None = None) -> None:
        self.past: dict[int, list[bytes]] = {1: [], 2: []}
        self.replayed = 0
        super().__init__(make_plan(poses=POSES, seconds=0.1), weather, random=Random(7))
        self.hooks.append(self.haunt)

    def new_node(self, index: int, memory: Memory) -> NodeMachine:
        return Hearing(self.past[index + 1], Identity(index + 1, self.site), self.axes, self.plants[index], memory)

    def haunt(self, send: Send) -> None:
        node = self.nodes[send.node - 1]
        node.advance(self.now_ms)
        copy = deepcopy(node)
        before = essence(copy)
        for payload in self.past[send.node]:
            copy.tally = NodeTally()  # a flood of forgeries would make it deaf to the rest
            copy.receive(self.now_ms, payload)
            assert essence(copy) == before, f"{kind_of(payload)} {payload.hex()} has an effect at {self.now_ms} ms"
            self.replayed += 1

    def kinds(self) -> set[object]:
        return {kind_of(payload) for past in self.past.values() for payload in past}

    def go_back(self, nonce: int) -> None:
        """Another host, another run: from the end of the first one home."""
        plan = replace(make_plan(poses=[HOME], seconds=0.1), start=(target(POSES[-1]),) * 2)
        self.plan, self.conductor = plan, Conductor(plan, self.site, nonce)


def essence(node: NodeMachine) -> tuple[object, ...]:
    """All that decides what a node does; an offer that nobody can take up is not part of it."""
    memory = {name: value for name, value in vars(node.memory).items() if name != "offers"}
    session = None if node._session is None else dict(vars(node._session))
    flags = (node._silent, node._stopped, node._lift_above)
    return memory, session, flags, node.state, node.move, node.move_start_ms


@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_nothing_of_a_run_has_an_effect_later_in_it_nor_in_the_next(loss: float) -> None:
    bench = Haunted(Weather(loss))
    assert bench.run() is Phase.DONE
    bench.go_back(0x99AA00)
    assert bench.run() is Phase.DONE
    assert bench.positions() == [target(HOME).counts] * 2
    assert bench.kinds() == {FrameKind.HELLO, FrameKind.DRIVE}
    assert bench.replayed > 1000


def test_nor_in_a_run_that_another_host_resumes() -> None:
    bench = Haunted()
    bench.run_to(Phase.RELEASED, 2)
    bench.run_for(60)
    point = resume_point(bench.plan, bench.records)
    bench.now_us += 3_000_000
    bench.conductor = Conductor(bench.plan, bench.site, 0x99AA00, resume=point)
    assert bench.run() is Phase.DONE
    assert bench.positions() == [target(POSES[-1]).counts] * 2
    assert bench.replayed > 400


def test_nor_does_an_emergency_stop_stop_another_run() -> None:
    bench = Haunted()
    bench.run_to(Phase.RELEASED, 1)
    bench.conductor.hold(bench.now_ms)
    bench.run_to(Phase.PAUSED)
    bench.conductor.estop(bench.now_ms)
    assert bench.run() is Phase.HALTED
    assert {node.state for node in bench.nodes} == {NodeState.ESTOP}
    assert FrameKind.ESTOP in bench.kinds()
    for index, plant in enumerate(bench.plants):
        bench.reboot(index, unhomed=HOMED, estop=False)
        plant._home, plant._past, plant._begins = (0, 0, 0), [], []
    bench.conductor = Conductor(bench.plan, bench.site, 0x99AA00)
    assert bench.run() is Phase.DONE
    assert bench.positions() == [target(POSES[-1]).counts] * 2
