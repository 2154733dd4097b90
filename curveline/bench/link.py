"""The radio link in figures: the real host and the specified nodes in modelled air, on virtual time.

How long a poll takes comes from a model of each back end: the air time of a 32-byte frame and its answer at 2 Mbit/s,
and what the host spends around it. No radio is involved. Only the figures of this machine's processor are real time.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from random import Random

from curveline.bench.measurement import Measurement
from curveline.drive_settings import AxisDrive, DriveSettings
from curveline.plan_file import NodeTarget, Plan, Step
from curveline.radio.host.actions import Finished, Phase, Policy, Poll, Sleep, Write
from curveline.radio.host.conductor import Conductor
from curveline.radio.mock.air import HOST_US, Air, Antenna, Heard, Weather
from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import MotorPlant
from curveline.radio.node.state import Identity, Memory
from curveline.radio.protocol.keys import ZERO_MASTER, Site
from curveline.radio.protocol.motion import axes_of

COUNTS = (2, 8, 32, 64)
SEED = 20260101
DATA_RATE = "2Mbps"
AXIS = AxisDrive(200.0, 20.0, 100.0, -100.0, 100.0)
STEP_S = 0.05
STEPS = 60
POLL_US = 1190
"""A poll over SPI without loss."""
FLAT_OUT = Policy(poll_ms=0, retry_ms=0)
"""Polls as fast as the back end can."""


@dataclass(frozen=True)
class BackEnd:
    """A timing model: what the host spends per exchange and per frame in it [us], besides the time in the air."""

    name: str
    exchange_us: int
    frame_us: int
    note: str


BACK_ENDS = (BackEnd("nrf24", 0, HOST_US, "model; mock too"), BackEnd("serial", 2000, 50, "model"))


@dataclass
class Spent:
    """What a run took: polls, virtual time, processor time of the host and of all, and how long steps waited."""

    polls: int = 0
    virtual_us: int = 0
    host_s: float = 0.0
    all_s: float = 0.0
    latencies_ms: list[int] = field(default_factory=list)


def rows() -> Iterator[Measurement]:
    """All figures, one after the other as they are measured."""
    yield from _rates()
    yield from _cost_of_loss()
    yield from _latencies()
    yield from _processor()


def _rates() -> Iterator[Measurement]:
    """How often each node is polled if the host does nothing else."""
    for back_end in BACK_ENDS:
        for loss in (0.0, 0.3):
            for count in COUNTS:
                spent = _run(_plan(count, max(1, 16 // count)), back_end, Weather(loss), FLAT_OUT)
                rate = 1e6 * spent.polls / spent.virtual_us / count
                yield Measurement(
                    f"{back_end.name}, {count} nodes, {_percent(loss)}",
                    rate,
                    "/s",
                    "",
                    f"polls per node, {back_end.note}",
                )


def _cost_of_loss() -> Iterator[Measurement]:
    """Polls per step of short moves, against those in perfect air."""
    for count in (2, 8):
        plan = _plan(count, STEPS)
        perfect = _run(plan, BACK_ENDS[0], Weather(), Policy()).polls
        for loss, goal in ((0.3, "<= 1.15"), (0.5, "<= 1.5")):
            ratio = _run(plan, BACK_ENDS[0], Weather(loss), Policy()).polls / perfect
            yield Measurement(f"polls a step, {count} nodes, {_percent(loss)}", ratio, "x", goal, "over no loss, model")


def _latencies() -> Iterator[Measurement]:
    """From the last node's arrival to the last node's departure; the goal is two rounds of polls."""
    for count in (8, 32):
        for loss in (0.0, 0.3):
            spent = _run(_plan(count, STEPS), BACK_ENDS[0], Weather(loss), Policy())
            waits = sorted(spent.latencies_ms)
            goal = "" if loss else f"<= {2 * count * POLL_US / 1000:.0f}"
            for name, share in (("p50", 0.5), ("p99", 0.99)):
                wait = waits[min(len(waits) - 1, int(share * len(waits)))]
                yield Measurement(f"release, {count} nodes, {_percent(loss)}, {name}", wait, "ms", goal, "nrf24, model")


def _processor() -> Iterator[Measurement]:
    """What this machine does in real time."""
    spent = [_run(_plan(8, STEPS), BACK_ENDS[0], Weather(0.3), Policy()) for _ in range(3)]
    host = min(1e6 * each.host_s / each.polls for each in spent)
    rate = max(each.polls / each.all_s for each in spent)
    yield Measurement("host processor per poll", host, "us", "< 100", "this machine, best of 3")
    yield Measurement("simulated polls", rate, "/s", "", "this machine, best of 3")


def _percent(loss: float) -> str:
    return f"{100 * loss:.0f} % loss" if loss else "no loss"


def _plan(count: int, steps: int) -> Plan:
    """Short moves to and fro by all nodes."""

    def target(millimetres: float) -> NodeTarget:
        return NodeTarget(millimetres, 0.0, 0.0, (AXIS.counts(millimetres), 0, 0))

    drive = DriveSettings(
        "bench", "bench", (AXIS, AXIS, AXIS), 76, DATA_RATE, tuple(f"C1C1C1C1{n:02X}" for n in range(count))
    )
    facts = ((600.0,), ("peak",), 1.0, 1.0, "bench", 0.01, 1.0, 1.0)
    made = tuple(
        Step(number, "move", STEP_S, (target(0.5 * (number % 2)),) * count, *facts) for number in range(1, steps + 1)
    )
    return Plan("bench", drive, (target(0.0),) * count, made, ("peak",), (600.0,))


def _run(plan: Plan, back_end: BackEnd, weather: Weather, policy: Policy) -> Spent:
    """Take modelled nodes through a plan, to its end."""
    run = _TimedRun(plan, back_end, weather, policy)
    begin = time.process_time()
    while run.turn():
        pass
    run.spent.all_s = time.process_time() - begin
    run.spent.latencies_ms = run.latencies_ms()
    return run.spent


class _TimedRun:
    """Host, air and nodes in one process; the clock goes by the model of the back end."""

    def __init__(self, plan: Plan, back_end: BackEnd, weather: Weather, policy: Policy) -> None:
        drive = plan.drive
        site = Site(ZERO_MASTER, tuple(range(1, drive.node_count + 1)))
        self.spent = Spent()
        self._back_end = back_end
        self._plants = [MotorPlant(start.counts) for start in plan.start]
        self._antennas = [
            Antenna(NodeMachine(Identity(number, site), axes_of(drive), plant, Memory()))
            for number, plant in enumerate(self._plants, start=1)
        ]
        self._air = Air(weather, drive.data_rate, Random(SEED))
        self._conductor = Conductor(plan, site, 0, policy)
        self._heard: list[tuple[int, Heard]] = []

    def turn(self) -> bool:
        """One action of the host; False when it has ended."""
        begin = time.process_time()
        now_ms = self.spent.virtual_us // 1000
        for node, heard in self._heard:
            self._conductor.heard(now_ms, node, heard.payload, heard.retries)
        self._heard.clear()
        action = self._conductor.next(now_ms)
        if isinstance(action, Write):
            self._conductor.written(now_ms)
        self.spent.host_s += time.process_time() - begin
        if isinstance(action, Sleep):
            self.spent.virtual_us = max(self.spent.virtual_us, 1000 * action.until_ms)
        elif isinstance(action, Poll):
            self._poll(action)
        elif isinstance(action, Finished):
            assert self._conductor.phase is Phase.DONE, self._conductor.halt
            return False
        return True

    def _poll(self, action: Poll) -> None:
        self.spent.virtual_us += self._back_end.exchange_us
        for each in action.sends:
            heard = self._air.exchange(self._antennas[each.node - 1], each.payload, self.spent.virtual_us)
            self.spent.virtual_us += heard.took_us - HOST_US + self._back_end.frame_us
            self.spent.polls += 1
            self._heard.append((each.node, heard))

    def latencies_ms(self) -> list[int]:
        """For each step but the first: from the last arrival of the one before to the last departure."""
        steps = list(zip(*(plant.spans() for plant in self._plants), strict=True))
        return [max(begin for begin, _ in after) - max(end for _, end in before) for before, after in pairwise(steps)]
