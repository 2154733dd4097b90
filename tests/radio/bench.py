"""Displays, plans and a test bench for the radio tests: conductor, air and nodes in one process, on virtual time."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from random import Random

from curveline.drive_settings import AxisDrive, DriveSettings
from curveline.plan_file import NodeTarget, Plan, Step
from curveline.radio.host.actions import Action, Finished, Phase, Policy, Poll, Record, Send, Sleep, Write
from curveline.radio.host.conductor import Conductor
from curveline.radio.host.resume import resume_point
from curveline.radio.mock.air import Air, Antenna, Heard, Weather
from curveline.radio.mock.display import mock_site
from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import MotorPlant
from curveline.radio.node.state import NOWHERE, Identity, Memory
from curveline.radio.protocol.codes import Counts
from curveline.radio.protocol.motion import NodeMove, axes_of

AXES = (
    AxisDrive(221.3263, 20.0, 100.0, -1000.0, 1000.0),
    AxisDrive(69.5333, 45.0, 200.0, -75.0, 75.0),
    AxisDrive(221.3263, 10.0, 50.0, -220.0, 220.0),
)
HOME = (0.0, 0.0, 0.0)
POSES = ((10.0, 0.0, 0.0), (10.0, 20.0, 0.0), (30.0, -10.0, 5.0))


def drive_table(count: int = 2, name: str = "test") -> DriveSettings:
    addresses = tuple(f"C1C1C1C1{number:02X}" for number in range(1, count + 1))
    return DriveSettings(name, "digest", AXES, 76, "1Mbps", addresses)


def target(pose: Sequence[float]) -> NodeTarget:
    extrude, bias, translate = pose
    counts = (AXES[0].counts(extrude), AXES[1].counts(bias), AXES[2].counts(translate))
    return NodeTarget(extrude, bias, translate, counts)


def make_plan(count: int = 2, poses: Sequence[Sequence[float]] = POSES, seconds: float = 1.5) -> Plan:
    """All nodes go through the same poses, starting at home."""
    steps = tuple(
        Step(number, "move", seconds, (target(pose),) * count, (600.0,), ("peak",), 1.0, 1.0, "test", 0.01, 1.0, 1.0)
        for number, pose in enumerate(poses, start=1)
    )
    return Plan("test", drive_table(count), (target(HOME),) * count, steps, ("peak",), (600.0,))


def short_plan(count: int, steps: int) -> Plan:
    """Many quick steps to and fro."""
    return make_plan(count, [(0.2 * (step % 2), 0.4 * (step % 3), 0.1) for step in range(steps)], seconds=0.05)


class RestingPlant(MotorPlant):
    """Motors that remember where they came to rest: nodes ask for their place at every poll, and mostly they rest."""

    _rest: tuple[int, Counts] | None = None

    def follow(self, now_ms: int, start_ms: int, move: NodeMove) -> None:
        """See Plant."""
        self._rest = None
        super().follow(now_ms, start_ms, move)

    def positions(self, now_ms: int) -> Counts:
        """See Plant."""
        if self._rest is not None and now_ms >= self._rest[0]:
            return self._rest[1]
        counts = super().positions(now_ms)
        end_ms = self.settles_ms()
        if end_ms is not None and now_ms >= end_ms:
            self._rest = (end_ms, counts)
        return counts


class Bench:
    """A conductor that sends through modelled air to modelled nodes; `hooks` see every Send before it leaves.

    The classes of node and host can be replaced by others, to see what a mistake in them does.
    """

    node_class = NodeMachine
    host_class = Conductor

    def __init__(
        self,
        plan: Plan,
        weather: Weather | None = None,
        *,
        random: Random | None = None,
        policy: Policy | None = None,
        paces: Callable[[], tuple[int, int, int]] = lambda: (1000, 1000, 1000),
    ) -> None:
        self.plan = plan
        self.site = mock_site(plan.drive)
        self.axes = axes_of(plan.drive)
        self.now_us = 0
        self.polls = 0
        self.records: list[Record] = []
        self.hooks: list[Callable[[Send], object]] = []
        self.write_error = ""
        self.deaf: set[int] = set()
        self.air = Air(weather or Weather(), plan.drive.data_rate, random or Random(0))
        self.plants = [RestingPlant(start.counts, paces()) for start in plan.start]
        self.nodes = [self.new_node(index, Memory()) for index in range(len(self.plants))]
        self.antennas = [Antenna(node) for node in self.nodes]
        self.conductor = self.host_class(plan, self.site, 0x1122334455667700, policy)

    @property
    def now_ms(self) -> int:
        return self.now_us // 1000

    def new_node(self, index: int, memory: Memory) -> NodeMachine:
        return self.node_class(Identity(index + 1, self.site), self.axes, self.plants[index], memory)

    def reboot(self, index: int, **memory: object) -> None:
        """Switch a node off and on."""
        old = self.nodes[index]
        if old.move is not None:
            self.plants[index].follow(self.now_ms, old.move_start_ms, old.move.braked(self.now_ms - old.move_start_ms))
        unhomed = old.memory.unhomed if old.move is None else NOWHERE
        fields = {"boot": old.memory.boot + 1, "unhomed": unhomed, **memory}
        self.nodes[index] = self.antennas[index].node = self.new_node(index, Memory(**fields))  # type: ignore[arg-type]

    def turn(self) -> bool:
        """Do what the conductor wants once; False when it has ended."""
        return self.act(self.conductor.next(self.now_ms))

    def act(self, action: Action) -> bool:
        """Do one thing; False when nothing is left to do."""
        if isinstance(action, Poll):
            self.poll(action)
        elif isinstance(action, Sleep):
            self.now_us = max(self.now_us, action.until_ms * 1000)
        elif isinstance(action, Write) and self.write_error:
            self.conductor.unwritten(self.now_ms, self.write_error)
        elif isinstance(action, Write):
            self.records.append(dict(action.record))
            self.conductor.written(self.now_ms)
        return not isinstance(action, Finished)

    def poll(self, action: Poll) -> None:
        """As a radio does it: all frames of a batch are out before the first answer is looked at."""
        answers = [self.send(each) for each in action.sends]
        for each, heard in zip(action.sends, answers, strict=True):
            self.conductor.heard(self.now_ms, each.node, heard.payload, heard.retries)

    def send(self, action: Send) -> Heard:
        for hook in self.hooks:
            hook(action)
        self.polls += 1
        if action.node - 1 in self.deaf:
            heard = self.air.unheard()
        else:
            heard = self.air.exchange(self.antennas[action.node - 1], action.payload, self.now_us)
        self.now_us += heard.took_us
        return heard

    def new_host(self, nonce: int = 0x66554433221100, policy: Policy | None = None) -> None:
        """Another host goes on with the run by the records that the first one left; nodes and air stay as they are."""
        records = json.loads(json.dumps(self.records))
        self.conductor = self.host_class(self.plan, self.site, nonce, policy, resume_point(self.plan, records))

    def run(self, until: Callable[[], bool] | None = None, limit_ms: int = 600_000) -> Phase:
        """Turn until the run has ended or `until` holds."""
        while not (until is not None and until()) and self.turn():
            assert self.now_ms < limit_ms, f"still {self.conductor.phase} after {self.now_ms} ms"
        return self.conductor.phase

    def run_to(self, phase: Phase, step: int = 0) -> None:
        """Turn until the conductor is in `phase` (of `step`)."""
        reached = self.run(lambda: self.conductor.phase is phase and step in (0, self.conductor.step))
        assert reached is phase, (reached, self.conductor.halt)

    def run_for(self, duration_ms: int) -> None:
        """Turn for a while."""
        end_ms = self.now_ms + duration_ms
        self.run(lambda: self.now_ms >= end_ms)

    def positions(self) -> list[Counts]:
        return [plant.positions(self.now_ms) for plant in self.plants]
