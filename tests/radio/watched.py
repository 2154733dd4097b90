"""A bench that holds every frame that leaves and every move that begins against the invariants of the protocol."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from curveline.plan_file import Plan, Step
from curveline.radio.host.actions import Phase, Policy, Send
from curveline.radio.mock.air import Weather
from curveline.radio.node.machine import NodeMachine
from curveline.radio.protocol.codes import FrameKind
from curveline.radio.protocol.motion import NodeMove, outside

from .bench import HOME, Bench, drive_table, target

STEPS = 12
QUICK = Policy(poll_ms=3, retry_ms=1)
LAYOUTS = ("alike", "apart", "still")
"""What the frames of a run have in common: the same targets for all nodes, others for each, or all as they stand."""
QUICK_STEP, SLOW_STEP = 0.05, 2.5
"""How long a step takes at least [s]."""


class Broken(AssertionError):
    """An invariant that does not hold; the message begins with its name."""


def require(holds: object, invariant: str) -> None:
    """Stop the simulation where an invariant is broken, not where its consequences show."""
    if not holds:
        raise Broken(invariant)


def layout_plan(count: int, steps: int, layout: str = "alike", seconds: float = QUICK_STEP) -> Plan:
    """Many steps to and fro."""

    def pose(step: int, node: int) -> tuple[float, float, float]:
        if layout == "still":
            return HOME
        sideways = 0.01 * node if layout == "apart" else 0.0
        return 0.2 * (step % 2) + sideways, 0.4 * (step % 3), 0.1

    made = tuple(
        Step(
            *(step + 1, "move", seconds, tuple(target(pose(step, node)) for node in range(count))),
            *((600.0,), ("peak",), 1.0, 1.0, "test", 0.01, 1.0, 1.0),
        )
        for step in range(steps)
    )
    return Plan("test", drive_table(count), (target(HOME),) * count, made, ("peak",), (600.0,))


class Watched(Bench):
    """Every invariant that can be seen from outside is checked as the run goes on; `begun` is what each node did."""

    def __init__(self, plan: Plan, seed: int, weather: Weather, policy: Policy = QUICK) -> None:
        random = Random(seed)
        paces: Callable[[], tuple[int, int, int]] = lambda: (  # noqa: E731
            random.randrange(700, 1001),
            random.randrange(700, 1001),
            random.randrange(700, 1001),
        )
        super().__init__(plan, weather, random=random, policy=policy, paces=paces)
        self.random = random
        self.begun: list[list[int]] = [[] for _ in self.nodes]
        self.departures = [0] * len(self.nodes)
        self.rebooted: set[int] = set()
        self.highest_release = 0
        self._facts = [(0, 0, 0)] * len(self.nodes)
        for index, plant in enumerate(self.plants):
            plant.follow = self._spy(index, plant.follow)  # type: ignore[method-assign]
        self.hooks.append(self.check_frame)

    def _spy(self, index: int, follow: Callable[[int, int, NodeMove], None]) -> Callable[[int, int, NodeMove], None]:
        def checked(now_ms: int, start_ms: int, move: NodeMove) -> None:
            if move.brake_ms is None:
                self.check_departure(index, self.nodes[index], move)
            follow(now_ms, start_ms, move)

        return checked

    def check_departure(self, index: int, node: NodeMachine, move: NodeMove) -> None:
        """A node sets off."""
        memory, session = node.memory, node._session
        self.departures[index] += 1
        require(memory.homed and not memory.estop and not memory.fault, "I3: motion while unhomed or in fault")
        require(session is not None and not session.closed, "I3: motion without a live session")
        held = session is not None and session.hold_gen & 1
        require(not held and not node._silent and not node._stopped, "I3: motion while held")
        owner = self.conductor.peers[index]
        if session is not None and session.key == owner.key:
            require(self.conductor.phase not in (Phase.PAUSED, Phase.DONE), "I3: motion while the host knows a pause")
        require(not outside(self.axes, move.target), "I5: motion out of the limits")
        self._check_order(index, memory.started, move)

    def _check_order(self, index: int, step: int, move: NodeMove) -> None:
        begun = self.begun[index]
        last = begun[-1] if begun else 0
        require(step in (last, last + 1) and step > 0, f"I2: step {step} after step {last}")
        if step > last:
            begun.append(step)
        wanted = self.plan.steps[step - 1].targets[index].counts
        require(move.target == wanted, f"I2: step {step} goes to {move.target}, the plan to {wanted}")
        require(step <= self.journalled(), f"I4: step {step} begins, the journal knows {self.journalled()}")
        sound = [each for number, each in enumerate(self.nodes) if number not in self.rebooted]
        started = max((each.memory.started for each in sound), default=0)
        finished = min((each.memory.finished for each in sound), default=0)
        require(started <= finished + 1, f"I1: step {started} begins, a node has finished {finished}")
        require(all(each.memory.staged >= each.memory.started for each in sound), "I1: a node without its target")

    def check_frame(self, send: Send) -> None:
        """A frame leaves; what the host knows of the node must not have fallen back."""
        peer = self.conductor.peers[send.node - 1]
        facts = (peer.started, peer.finished, peer.staged)
        before = self._facts[send.node - 1]
        require(all(map(int.__ge__, facts, before)), f"I4: what is known of node {send.node} falls back")
        self._facts[send.node - 1] = facts
        if send.payload[0] & 0xF == FrameKind.DRIVE:
            release = int.from_bytes(send.payload[8:10], "little")
            going = self.conductor.phase in (Phase.STAGING, Phase.RELEASED)
            require(release >= self.highest_release or not going, "I4: release falls")
            require(release <= self.journalled(), f"I4: release {release}, the journal knows {self.journalled()}")
            self.highest_release = max(release, self.highest_release)

    def journalled(self) -> int:
        """The last step whose release is on disk."""
        return next((each["step"] for each in reversed(self.records) if each["type"] == "release"), 0)

    def reboot(self, index: int, **memory: object) -> None:
        """See Bench; what the node did before does not count any more."""
        super().reboot(index, **memory)
        self.rebooted.add(index)

    def new_host(self, nonce: int = 0x66554433221100, policy: Policy | None = None) -> None:
        """See Bench."""
        super().new_host(nonce, policy or self.conductor.policy)
        self._facts = [(0, 0, 0)] * len(self.nodes)

    def finish(self) -> None:
        """To the end: all steps done once, in order, by all."""
        phase = self.run()
        halt = self.conductor.halt
        require(phase is Phase.DONE, f"I10: the run does not end but is halted: {halt and halt.message}")
        self.check_all_done()

    def check_all_done(self) -> None:
        """Whether every node has done all steps and stands where the plan ends."""
        for begun in self.begun:
            require(begun == list(range(1, len(self.plan.steps) + 1)), f"I2, I11: steps {begun}")
        goal = [each.counts for each in self.plan.steps[-1].targets]
        require(self.positions() == goal, "I2: the nodes stand elsewhere than the plan ends")
