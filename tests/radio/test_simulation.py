"""Host, air and nodes together under seeded faults: the invariants of docs/radio-protocol.md hold at every poll."""

from __future__ import annotations

from random import Random

import pytest

from curveline.radio.actions import Phase, Policy, Send
from curveline.radio.air import Weather
from curveline.radio.frames import Drive, Kind, decode_drive, kind_of
from curveline.radio.motion import Move, outside
from curveline.radio.node import Node

from .bench import Bench, short_plan

STEPS = 12
LOSSES = (0.0, 0.1, 0.3, 0.5)
POLLS = {"total": 0, "runs": 0}
QUICK = Policy(poll_ms=3, retry_ms=1)


class Watched(Bench):
    """A bench that checks every frame that leaves and every move that begins."""

    def __init__(self, count: int, seed: int, weather: Weather) -> None:
        random = Random(seed)
        super().__init__(
            short_plan(count, STEPS),
            weather,
            random=random,
            policy=QUICK,
            paces=lambda: tuple(random.randrange(700, 1001) for _ in range(3)),
        )
        self.hooks.append(self.check_frame)
        self.begun: list[list[int]] = [[] for _ in self.nodes]
        self.highest_release = 0
        for index, plant in enumerate(self.plants):
            plant.follow = self.spy(index, plant.follow)  # type: ignore[method-assign]

    def spy(self, index: int, follow):
        def checked(now_ms: int, start_ms: int, move: Move) -> None:
            node = self.nodes[index]
            if move.brake_ms is None:
                self.check_departure(node, move)
                self.begun[index].append(node.memory.started)
            follow(now_ms, start_ms, move)

        return checked

    def check_departure(self, node: Node, move: Move) -> None:
        memory, session = node.memory, node._session
        assert memory.homed, "I3"
        assert not memory.estop, "I3"
        assert not memory.fault, "I3"
        assert session is not None, "I3"
        assert not session.closed, "I3"
        assert not session.hold_gen & 1, "I3"
        assert not node._silent, "I3"
        assert not outside(self.axes, move.target), "I5"
        started = [each.memory.started for each in self.nodes]
        finished = [each.memory.finished for each in self.nodes]
        assert max(started) <= min(finished) + 1, "I1"
        assert memory.started <= self.journalled(), "I4"
        assert all(each.memory.staged >= memory.started for each in self.nodes), "somebody has not got its target"

    def check_frame(self, send: Send) -> None:
        if kind_of(send.payload) is not Kind.DRIVE:
            return
        frame = decode_drive(send.payload, self.conductor.peers[send.node - 1].key)
        assert isinstance(frame, Drive)
        assert self.highest_release <= frame.release <= self.journalled(), "I4"
        self.highest_release = frame.release

    def journalled(self) -> int:
        return max((record["step"] for record in self.records if record["type"] == "release"), default=0)

    def finish(self) -> None:
        assert self.run() is Phase.DONE, f"I10: {self.conductor.halt}"
        POLLS["total"] += self.polls
        POLLS["runs"] += 1
        for begun in self.begun:
            assert begun == list(range(1, STEPS + 1)), "I2"
        goal = [target.counts for target in self.plan.steps[-1].targets]
        assert self.positions() == goal


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("count", range(1, 17))
def test_every_run_ends_and_breaks_no_invariant(count: int, loss: float) -> None:
    """Counts that are multiples of four would starve if two polls in turn could ever be equal."""
    seed = 1000 * count + int(100 * loss)
    print(f"seed {seed}")
    Watched(count, seed, Weather(loss, duplicate=0.05, stale=0.1, corrupt=0.01)).finish()


@pytest.mark.parametrize("seed", range(8))
def test_a_bad_day(seed: int) -> None:
    """Half of everything lost, a third duplicated or stale."""
    Watched(3, seed, Weather(0.5, duplicate=0.3, stale=0.3, corrupt=0.05)).finish()


@pytest.mark.parametrize("count", [4, 8, 12, 16])
def test_the_repeat_filter_starves_nobody_in_perfect_air(count: int) -> None:
    bench = Watched(count, 1, Weather())
    bench.finish()
    for peer in bench.conductor.peers:
        assert peer.tally.lost == 0
        assert peer.tally.polls < 80 * STEPS


@pytest.mark.parametrize("seed", range(12))
def test_a_restart_at_any_moment_halts_the_run(seed: int) -> None:
    random = Random(seed)
    bench = Watched(3, seed, Weather(random.choice(LOSSES)))
    bench.run_to(Phase.STAGING)
    bench.run_for(random.randrange(1500))
    assert bench.conductor.phase in (Phase.STAGING, Phase.RELEASED)
    victim = random.randrange(3)
    bench.reboot(victim)
    started = [node.memory.started for node in bench.nodes]
    assert bench.run() is Phase.HALTED
    assert bench.conductor.halt is not None
    assert (bench.conductor.halt.cause.name, bench.conductor.halt.node) == ("REBOOT", victim + 1)
    assert bench.nodes[victim].memory.started == 0
    for before, node in zip(started, bench.nodes, strict=True):
        assert node.memory.started <= max(before, bench.journalled())


@pytest.mark.parametrize("seed", range(6))
def test_pauses_at_random_moments_cost_nothing_but_time(seed: int) -> None:
    random = Random(seed)
    bench = Watched(3, seed, Weather(0.2))
    bench.run_to(Phase.STAGING)
    for _ in range(6):
        bench.run_for(random.randrange(250))
        if random.random() < 0.5:
            bench.conductor.hold(bench.now_ms)
        else:
            bench.conductor.pause()
        bench.run_to(Phase.PAUSED)
        assert all(node.move is None for node in bench.nodes)
        bench.run_for(random.randrange(300))
        bench.conductor.resume(bench.now_ms)
    assert bench.run() is Phase.DONE
    goal = [target.counts for target in bench.plan.steps[-1].targets]
    assert bench.positions() == goal


def test_recorded_frames_have_no_effect_when_they_come_again() -> None:
    """Each DRIVE of a run, sent again to its node at random moments of the same and of the next session."""
    random = Random(5)
    recorded: list[Send] = []

    def replay(send: Send) -> None:
        if kind_of(send.payload) is Kind.DRIVE:
            recorded.append(send)
        old = random.choice(recorded[:-1] or [send])
        node = bench.nodes[old.node - 1]
        if old.payload != send.payload:
            node.advance(bench.now_ms)
            before = (node.ack, vars(node.memory).copy(), node.state)
            node.receive(bench.now_ms, old.payload)
            assert (node.ack, vars(node.memory), node.state) == before, "I6"

    bench = Watched(3, 5, Weather(0.2))
    bench.hooks.append(replay)
    bench.finish()
    nodes, recorded_before = bench.nodes, len(recorded)
    bench = Watched(3, 6, Weather(0.2))
    bench.hooks.append(replay)
    for fresh, old in zip(bench.nodes, nodes, strict=True):
        fresh.memory.offers = old.memory.offers
    bench.finish()
    assert len(recorded) > recorded_before > 300


def test_enough_was_simulated() -> None:
    """The matrix above is at least 60,000 polls; a part of it alone is not judged."""
    print(f"{POLLS['total']} polls in {POLLS['runs']} runs")
    assert POLLS["runs"] < 16 * len(LOSSES) or POLLS["total"] > 60_000
