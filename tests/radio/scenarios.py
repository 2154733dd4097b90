"""Seeded runs in which something goes wrong; each returns how many polls it took, and raises if an invariant breaks.

`python -m tests.radio.scenarios NAME SEED` repeats one. In CI a few seeds of each are run, in the campaign many.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from random import Random

from curveline.errors import InvalidInput
from curveline.radio.host.actions import Phase, Policy, Poll, Send, Write
from curveline.radio.host.conductor import Conductor
from curveline.radio.host.stop_causes import Cause
from curveline.radio.mock.air import Air, Heard, Weather
from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import MotorPlant
from curveline.radio.node.state import Identity, Memory
from curveline.radio.protocol.codes import FrameKind
from curveline.radio.protocol.motion import NodeMove

from .visits import keep_back, look_in
from .watched import LAYOUTS, QUICK, SLOW_STEP, STEPS, Watched, layout_plan, require

LOSSES = (0.0, 0.1, 0.3, 0.5)
RESUMED = 10
"""One silence in so many is followed to the end of the run."""
JITTER_US = 400
"""How unevenly a host works."""
TOLD_MS = 2000
"""A second host must know by then who owns the nodes."""
LOST_MS = 6
"""What a poll takes at most, at 1 Mbit/s with all repeats."""
HOLD_MS = 50
"""How much later than its dead-man time a node may begin to brake."""


def make(seed: int, bench_class: type[Watched] = Watched) -> Watched:
    """A run of one to eight nodes in some weather; what varies comes from the seed."""
    random = Random(seed)
    plan = layout_plan(random.choice((1, 2, 2, 3, 3, 4, 8)), STEPS, random.choice(LAYOUTS[:2]))
    chances = {"duplicate": random.choice((0.0, 0.05, 0.3)), "stale": random.choice((0.0, 0.1, 0.3))}
    return bench_class(plan, seed, Weather(random.choice(LOSSES), **chances, corrupt=random.choice((0.0, 0.02))))


def make_slow(seed: int, bench_class: type[Watched]) -> Watched:
    """A run whose few steps take longer than a dead-man time."""
    random = Random(seed)
    plan = layout_plan(random.choice((1, 2, 3, 5)), 3, LAYOUTS[0], SLOW_STEP)
    weather = Weather(random.choice(LOSSES), stale=random.choice((0.0, 0.1)), corrupt=random.choice((0.0, 0.02)))
    return bench_class(plan, seed, weather, Policy())


def filtered(seed: int, bench_class: type[Watched] = Watched) -> int:
    """Perfect air and four, eight, ... nodes: every poll of a node would carry the same id."""
    bench = bench_class(layout_plan(4 * (1 + seed % 4), STEPS, LAYOUTS[seed % 3]), seed, Weather())
    bench.finish()
    return bench.polls


def lossy(seed: int, bench_class: type[Watched] = Watched) -> int:
    """Nothing goes wrong but the air."""
    bench = make(seed, bench_class)
    bench.finish()
    return bench.polls


def restarted(seed: int, bench_class: type[Watched] = Watched) -> int:
    """A node restarts at a random moment: the run is halted for it, and the node does not move again."""
    bench = make(seed, bench_class)
    bench.run_to(Phase.STAGING)
    bench.run_for(bench.random.randrange(1000))
    if bench.conductor.phase in (Phase.CLOSING, Phase.DONE):
        return bench.polls
    victim = bench.random.randrange(len(bench.nodes))
    was_moving = bench.nodes[victim].move is not None
    bench.reboot(victim)
    began = len(bench.begun[victim])
    phase, halt = bench.run(), bench.conductor.halt
    if phase is Phase.DONE:  # it had nothing left to say
        bench.check_all_done()
        return bench.polls
    require(phase is Phase.HALTED and halt is not None, "I2: a restart does not halt the run")
    require(
        halt is not None and (halt.cause, halt.node) == (Cause.REBOOT, victim + 1),
        f"I2: halted for {halt and halt.cause.name}",
    )
    require(len(bench.begun[victim]) == began, "I3: a node moves after its restart")
    require(bench.nodes[victim].memory.homed != was_moving, "I3: a node that was moving believes in its position")
    return bench.polls


def killed(seed: int, bench_class: type[Watched] = Watched) -> int:
    """The host is killed at up to three random moments, and another one goes on by the record: nothing is lost."""
    bench = make(seed, bench_class)
    random = bench.random
    lives = 0
    while lives < 3:
        bench.run_for(random.randrange(700))
        if bench.conductor.phase in (Phase.DONE, Phase.CLOSING):
            break
        action = bench.conductor.next(bench.now_ms)
        if isinstance(action, Write) and random.random() < 0.5:
            bench.records.append(dict(action.record))
        if random.random() < 0.3:
            bench.now_us += random.randrange(3_000_000)
        if not bench.records:
            continue
        if bench.records[-1]["type"] == "end":
            bench.check_all_done()
            return bench.polls
        lives += 1
        bench.new_host((seed * 8 + lives) << 8)
    bench.finish()
    return bench.polls


def paused(seed: int, bench_class: type[Watched] = Watched) -> int:
    """The operator holds and pauses as he likes: it costs nothing but time."""
    bench = make(seed, bench_class)
    random = bench.random
    bench.run_to(Phase.STAGING)
    for _ in range(4):
        bench.run_for(random.randrange(150))
        if bench.conductor.phase in (Phase.DONE, Phase.CLOSING):
            break
        if random.random() < 0.7:
            bench.conductor.hold(bench.now_ms)
        else:
            bench.conductor.pause()
        if bench.run(lambda: bench.conductor.phase is Phase.PAUSED) is not Phase.PAUSED:
            break
        require(all(node.move is None for node in bench.nodes), "I3: a node moves during a pause")
        bench.run_for(random.randrange(300))
        bench.conductor.resume(bench.now_ms)
    bench.finish()
    return bench.polls


def held(seed: int, bench_class: type[Watched] = Watched) -> int:
    """Ctrl-C at a random moment of a move: the next frame of each node says hold, and all stand soon after."""
    bench = make(seed, bench_class)
    bench.run(lambda: any(node.move is not None for node in bench.nodes) or bench.conductor.phase is Phase.DONE)
    bench.run_for(bench.random.randrange(60))
    if bench.conductor.phase not in (Phase.STAGING, Phase.RELEASED):
        return bench.polls
    poll_ms = LOST_MS * (2 if bench.air.weather.duplicate else 1)
    cycle_ms = max(QUICK.poll_ms, poll_ms * len(bench.nodes))
    ramp_ms = max((_slowest_ms(node.move) for node in bench.nodes if node.move is not None), default=0)
    asked_ms = bench.now_ms
    bench.conductor.hold(asked_ms)
    told: dict[int, int] = {}
    bench.hooks.append(lambda send: told.setdefault(send.node, bench.now_ms) if send.payload[23] & 1 else None)
    bench.run(lambda: len(told) == len(bench.nodes))
    first_ms, last_ms = min(told.values()) - asked_ms, max(told.values()) - asked_ms
    require(first_ms <= cycle_ms, f"{first_ms} ms until the first hold")
    require(last_ms <= 2 * cycle_ms, f"{last_ms} ms until all were sent a hold")
    bench.run(lambda: all(node.move is None for node in bench.nodes) and bench.conductor.phase is Phase.PAUSED)
    worst_ms = (2 if bench.air.weather.loss <= 0.3 else 8) * cycle_ms + ramp_ms
    rest_ms = max(plant.settles_ms() or 0 for plant in bench.plants)
    require(rest_ms - asked_ms <= worst_ms, f"{rest_ms - asked_ms} ms until all stand, {worst_ms} allowed")
    bench.conductor.resume(bench.now_ms)
    bench.finish()
    return bench.polls


def silenced(seed: int, bench_class: type[Watched] = Watched) -> int:
    """The host falls silent at a random moment: every node stands still in time, and does not go on by itself."""
    bench = make_slow(seed, bench_class)
    bench.run_to(Phase.STAGING)
    bench.run_for(bench.random.randrange(3000))
    for index, node in enumerate(bench.nodes):
        session = node._session
        if session is None or session.closed:
            return bench.polls
        limit_ms = session.heard_ms + session.hello.deadman_ms + HOLD_MS
        node.advance(limit_ms)
        require(node.move is None or node.move.brake_ms is not None, "I8: a node runs on in silence")
        still_ms = limit_ms + (_slowest_ms(node.move) if node.move else 0)
        node.advance(still_ms)
        plant = bench.plants[index]
        place = plant.positions(still_ms)
        require(all(plant.positions(still_ms + later) == place for later in (1, 50, 5000)), "I8: a node does not stop")
        bench.now_us = max(bench.now_us, still_ms * 1000)
    began = [list(each) for each in bench.begun]
    bench.now_us += 1_000_000
    phase = bench.run()
    require(phase in (Phase.HALTED, Phase.DONE), f"I8: {phase} after a silence")
    require(bench.begun == began, "I8: a node goes on after a silence although nobody has said so")
    if phase is Phase.HALTED and seed % RESUMED == 0:
        _take_up(bench, seed)
    return bench.polls


def _slowest_ms(move: NodeMove) -> int:
    """How long the slowest axis of the simulation takes to slow down: 0.7 of the commanded speed."""
    return -(-10 * move.ramp_ms // 7) + 1


def cut_off(seed: int, bench_class: type[Watched] = Watched) -> int:
    """One node hears nothing for longer than its dead-man time: it holds, and does not go on by itself."""
    bench = make_slow(seed, bench_class)
    bench.run_to(Phase.STAGING)
    bench.run_for(bench.random.randrange(6000))
    if bench.conductor.phase in (Phase.CLOSING, Phase.DONE):
        return bench.polls
    victim = bench.random.randrange(len(bench.nodes))
    node = bench.nodes[victim]
    bench.deaf.add(victim)
    deadman_ms = bench.conductor._pace.deadman_ms
    bench.run_for(bench.random.choice((deadman_ms - 60, deadman_ms + HOLD_MS)) + bench.random.randrange(1000) % 500)
    bench.deaf.clear()
    node.advance(bench.now_ms)
    if not node._silent:
        return bench.polls
    require(node.move is None or node.move.brake_ms is not None, "I8: a node runs on in silence")
    departures = bench.departures[victim]
    phase = bench.run(lambda: bench.conductor.phase in (Phase.HALTED, Phase.CLOSING))
    if phase is Phase.CLOSING:
        return bench.polls
    require(
        bench.departures[victim] == departures, "I3, I8: a node goes on after a silence although nobody has said so"
    )
    _take_up(bench, seed)
    return bench.polls


def misled(seed: int, bench_class: type[Watched] = Watched) -> int:
    """A faulty host changes its mind about a target that a node has taken already: the node refuses."""
    bench = make(seed, bench_class)
    victim = bench.random.randrange(len(bench.nodes))
    memory = bench.nodes[victim].memory
    bench.run_to(Phase.RELEASED, bench.random.randrange(1, STEPS))
    bench.run(lambda: memory.staged > memory.started)
    loads = [list(each) for each in bench.conductor._loads]
    step, (x, y, z), move_ms = loads[memory.staged - 1][victim]
    loads[memory.staged - 1][victim] = (step, (x + 5, y, z), move_ms)
    bench.conductor._loads = tuple(tuple(each) for each in loads)
    bench.run()
    halt = bench.conductor.halt
    require(halt is None or halt.cause is Cause.CONFLICT, f"I2: halted for {halt and halt.cause} instead of a conflict")
    return bench.polls


def haunted(seed: int, bench_class: type[Watched] = Watched) -> int:
    """All that a host has sent comes again, in the run and after the nodes have restarted: nothing happens."""
    bench = make(seed, bench_class)
    recorded: list[Send] = []
    times: list[int] = []

    def again(send: Send) -> None:
        recorded.append(send)
        times.append(bench.now_ms)
        old = bench.random.choice(recorded)
        if old.payload[0] & 0xF == FrameKind.DRIVE:
            _replay(bench, old)

    bench.hooks.append(again)
    bench.finish()
    restarted = [
        bench.node_class(Identity(index + 1, bench.site), bench.axes, MotorPlant(start.counts), Memory(boot=2))
        for index, start in enumerate(bench.plan.start)
    ]
    for now_ms, send in zip(times, recorded, strict=True):  # a node that is switched on has its clock at 0 again
        node = restarted[send.node - 1]
        node.receive(now_ms, send.payload)
        require(node.memory.started == 0, "I6: a node that has restarted obeys frames of before")
    return bench.polls


def _replay(bench: Watched, send: Send) -> None:
    """A frame that its node has heard, or a later one, comes once more."""
    node = bench.nodes[send.node - 1]
    node.advance(bench.now_ms)
    session = node._session
    if session is None or int.from_bytes(send.payload[4:8], "little") > session.counter:
        return
    before = (vars(node.memory).copy(), node.state, vars(session).copy())
    node.receive(bench.now_ms, send.payload)
    require(before == (vars(node.memory), node.state, vars(session)), "I6: a frame of before has an effect")


def _take_up(bench: Watched, seed: int) -> None:
    """Another host goes on by the record, if the halt allows it."""
    for attempt in range(3):
        try:
            bench.new_host((seed * 8 + attempt) << 8)
        except InvalidInput:
            break
        bench.run()
        if bench.conductor.phase is Phase.DONE:
            bench.check_all_done()
            break
        halt = bench.conductor.halt
        require(halt is not None and halt.cause is Cause.BUSY, f"I10: a resumed run is halted: {halt and halt.message}")


def rivals(seed: int, bench_class: type[Watched] = Watched) -> int:
    """Two hosts want the same nodes: no step is mixed, and one that does not get them knows so in time."""
    return Rivals(seed, bench_class.node_class, bench_class.host_class).play()


def withheld(seed: int, bench_class: type[Watched] = Watched) -> int:
    """Frames that were jammed and kept come after the host fell silent: nobody moves on for them."""
    bench = make_slow(seed, bench_class)
    bench.run_to(Phase.STAGING)
    keep_back(bench)
    return bench.polls


def visited(seed: int, bench_class: type[Watched] = Watched) -> int:
    """A host that is refused leaves a run that was broken off as it was."""
    bench = make(seed, bench_class)
    bench.run_to(Phase.STAGING)
    look_in(bench)
    return bench.polls


class Rivals:
    """Two hosts with plans and radios of their own, and the same nodes."""

    def __init__(self, seed: int, node_class: type[NodeMachine], host_class: type[Conductor]) -> None:
        self.random = random = Random(seed)
        count, steps = random.choice((2, 3, 4)), random.choice((4, 8, 16))
        self.benches = [
            Watched(layout_plan(count, steps + which, LAYOUTS[which]), seed + which, Weather(random.choice(LOSSES)))
            for which in range(2)
        ]
        self.begin_ms = [0, random.randrange(1500)]
        first, second = self.benches
        second.nodes, second.antennas, second.plants = first.nodes, first.antennas, first.plants
        for bench in self.benches:
            takeover = random.random() < 0.5
            policy = Policy(poll_ms=3, retry_ms=1, takeover=takeover)
            bench.air = Air(bench.air.weather, bench.plan.drive.data_rate, random)
            bench.conductor = host_class(bench.plan, bench.site, random.getrandbits(48) << 8, policy)
        for index in range(count):
            node = node_class(first.nodes[index].identity, first.axes, first.plants[index], first.nodes[index].memory)
            first.nodes[index] = first.antennas[index].node = node
            first.plants[index].follow = self._spy(index, type(first.plants[index]).follow)  # type: ignore[method-assign]
        self.over_ms = [-1, -1]
        self.claimed: bool | None = None
        """Whether the first host had all nodes before the second one asked."""
        self.pending: list[list[Send]] = [[], []]
        self.answers: list[list[tuple[int, Heard]]] = [[], []]

    def _spy(self, index: int, follow: Callable[..., None]) -> Callable[[int, int, NodeMove], None]:
        def checked(now_ms: int, start_ms: int, move: NodeMove) -> None:
            if move.brake_ms is None:
                self._check_departure(index, move)
            follow(self.benches[0].plants[index], now_ms, start_ms, move)

        return checked

    def _check_departure(self, index: int, move: NodeMove) -> None:
        nodes = self.benches[0].nodes
        run = nodes[index].memory.run_tag
        owner = next(bench for bench in self.benches if bench.conductor.run_tag == run)
        step = nodes[index].memory.started
        wanted = owner.plan.steps[step - 1].targets[index].counts
        require(move.target == wanted, f"I7: step {step} of one host goes where the other wants it")
        require(step <= owner.journalled(), f"I4: step {step} begins, the journal knows {owner.journalled()}")
        for other in nodes:
            require(other.move is None or other.memory.run_tag == run, "I7: two hosts move nodes at the same time")
        owned = [each.memory.run_tag == run for each in nodes]
        taken_ms = [each._session.heard_ms for each in nodes if each._session is not None]
        require(
            all(owned) or (owner.conductor.released == step and len(taken_ms) == len(nodes)),
            "I7: nodes are not all its own",
        )
        mine = [each.memory for each in nodes if each.memory.run_tag == run]
        require(max(each.started for each in mine) <= min(each.finished for each in mine) + 1, "I1: steps apart")

    def play(self) -> int:
        """Both to their ends, frame by frame, each with a clock of its own: nobody waits for the other's radio."""
        clocks_us = [begin * 1000 for begin in self.begin_ms]
        while min(self.over_ms) < 0:
            which = min((each for each in range(2) if self.over_ms[each] < 0), key=clocks_us.__getitem__)
            clocks_us[which] = self._turn(which, clocks_us[which]) + self.random.randrange(JITTER_US)
            require(clocks_us[which] < 120_000_000, "I10: two hosts never end")
        self._judge()
        return sum(bench.polls for bench in self.benches)

    def _turn(self, which: int, clock_us: int) -> int:
        """One frame or one decision of one host; the time after it."""
        bench = self.benches[which]
        bench.now_us = max(bench.now_us, clock_us)
        if which == 1 and self.claimed is None:
            self.claimed = bool(self.benches[0].records)
        if self.pending[which]:
            each = self.pending[which].pop(0)
            self.answers[which].append((each.node, bench.send(each)))
            return bench.now_us
        for node, heard in self.answers[which]:
            bench.conductor.heard(bench.now_ms, node, heard.payload, heard.retries)
        self.answers[which].clear()
        action = bench.conductor.next(bench.now_ms)
        if isinstance(action, Poll):
            self.pending[which] = list(action.sends)
        elif not bench.act(action):
            self.over_ms[which] = bench.now_ms
        return bench.now_us

    def _judge(self) -> None:
        for which, bench in enumerate(self.benches):
            halt = bench.conductor.halt
            took_ms = self.over_ms[which] - self.begin_ms[which]
            if halt is not None and halt.cause is Cause.BUSY:
                require(took_ms <= TOLD_MS, f"I7: told after {took_ms} ms that the nodes have an owner")
            done = bench.conductor.phase is Phase.DONE
            require(done == any(each["type"] == "end" for each in bench.records), "I11: an end that was not reached")
        first, second = self.benches
        if self.claimed and not second.conductor.policy.takeover:
            require(first.conductor.phase is Phase.DONE, "I10: a host that only asks keeps another from working")


SCENARIOS: dict[str, Callable[..., int]] = {
    "filtered": filtered,
    "lossy": lossy,
    "held": held,
    "restarted": restarted,
    "killed": killed,
    "paused": paused,
    "silenced": silenced,
    "cut_off": cut_off,
    "misled": misled,
    "haunted": haunted,
    "rivals": rivals,
    "withheld": withheld,
    "visited": visited,
}


if __name__ == "__main__":
    print(SCENARIOS[sys.argv[1]](int(sys.argv[2])), "polls")
