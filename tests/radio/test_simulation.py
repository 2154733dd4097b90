"""Host, air and nodes together under seeded faults: the invariants of docs/radio-protocol.md hold at every poll.

What happens in a scenario comes from its seed: `python -m tests.radio.scenarios NAME SEED` repeats one.
"""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from curveline.radio.host.actions import Phase, Policy, Write
from curveline.radio.host.stop_causes import Cause
from curveline.radio.mock.air import Weather
from curveline.radio.protocol.frames import StopFrame, encode_stop

from .scenarios import LOSSES, SCENARIOS, make
from .watched import LAYOUTS, STEPS, Watched, layout_plan

COUNTS = range(1, 17)
RUNS = {"lossy": 12, "restarted": 40, "killed": 30, "paused": 12, "held": 16, "cut_off": 12, "silenced": 80}
RUNS |= {"misled": 10, "haunted": 12, "rivals": 60, "withheld": 40, "visited": 24}
"""Seeds of each scenario; the campaign has many more."""
POLLS: Counter[str] = Counter()
WHOLE = len(COUNTS) * (len(LOSSES) + len(LAYOUTS)) + sum(RUNS.values())
TOTAL = 200_000


def count_polls(bench: Watched) -> None:
    """Add a run to the sum that is judged at the end."""
    POLLS["polls"] += bench.polls
    POLLS["runs"] += 1


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("count", COUNTS)
def test_every_run_ends_and_breaks_no_invariant(count: int, loss: float) -> None:
    """Counts that are multiples of four would starve if two polls in turn could ever be equal."""
    seed = 1000 * count + int(100 * loss)
    print(f"seed {seed}")
    bench = Watched(layout_plan(count, STEPS), seed, Weather(loss, duplicate=0.05, stale=0.1, corrupt=0.01))
    bench.finish()
    count_polls(bench)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("count", COUNTS)
def test_the_repeat_filter_starves_nobody_in_perfect_air(count: int, layout: str) -> None:
    """Whatever the frames of neighbours and of following polls have in common."""
    bench = Watched(layout_plan(count, STEPS, layout), 1, Weather())
    bench.finish()
    count_polls(bench)
    for peer in bench.conductor.peers:
        assert peer.tally.lost == 0
        assert peer.tally.polls < 80 * STEPS


@pytest.mark.parametrize(
    ("name", "seed"), [pytest.param(name, seed, id=f"{name}-{seed}") for name in RUNS for seed in range(RUNS[name])]
)
def test_a_scenario_breaks_no_invariant(name: str, seed: int) -> None:
    print(f"python -m tests.radio.scenarios {name} {seed}")
    POLLS["polls"] += SCENARIOS[name](seed)
    POLLS["runs"] += 1


@pytest.mark.parametrize("loss", [0.3, 0.5])
@pytest.mark.parametrize("count", [2, 8])
def test_loss_costs_few_polls(count: int, loss: float) -> None:
    """Polls per step against those in perfect air: at most 1.15 times at 30 % lost in each direction, 1.5 at 50 %."""
    spent = []
    for each in (0.0, loss):
        bench = Watched(layout_plan(count, 60), 7, Weather(each), Policy())
        bench.finish()
        spent.append(bench.polls)
    print(f"{spent[1] / spent[0]:.3f} times the polls")
    assert spent[1] <= {0.3: 1.15, 0.5: 1.5}[loss] * spent[0]


@pytest.mark.parametrize("seed", range(8))
def test_a_bad_day(seed: int) -> None:
    """Half of everything lost, a third duplicated or stale."""
    Watched(layout_plan(3, STEPS), seed, Weather(0.5, duplicate=0.3, stale=0.3, corrupt=0.05)).finish()


class Operation(RuleBasedStateMachine):
    """Whatever an operator, the air and the mains do, in any order that hypothesis can think of."""

    FATAL = frozenset({Cause.REBOOT, Cause.STOPPED, Cause.HELD, Cause.SUSPENDED, Cause.SILENT, Cause.DEAF, Cause.BUSY})

    @initialize(seed=st.integers(0, 2**16))
    def begin(self, seed: int) -> None:
        self.bench = make(seed)
        self.lives = 0

    def going(self) -> bool:
        """Whether the run has not come to an end."""
        return self.bench.conductor.phase not in (Phase.DONE, Phase.HALTED)

    @precondition(going)
    @rule(turns=st.integers(1, 60))
    def work(self, turns: int) -> None:
        for _ in range(turns):
            self.bench.turn()

    @precondition(going)
    @rule()
    def hold(self) -> None:
        self.bench.conductor.hold(self.bench.now_ms)

    @rule()
    def go_on(self) -> None:
        self.bench.conductor.resume(self.bench.now_ms)

    @rule(lapse_ms=st.integers(1, 3000))
    def sleep(self, lapse_ms: int) -> None:
        self.bench.now_us += 1000 * lapse_ms

    @rule()
    def stop_all(self) -> None:
        for node in self.bench.nodes:
            node.receive(self.bench.now_ms, encode_stop(StopFrame(0), self.bench.site.stop_key))

    @rule(which=st.integers(0, 7))
    def cut_power(self, which: int) -> None:
        self.bench.reboot(which % len(self.bench.nodes))

    @precondition(lambda self: self.going() and self.bench.records and self.bench.records[-1]["type"] != "end")
    @rule(written=st.booleans())
    def kill(self, written: bool) -> None:
        action = self.bench.conductor.next(self.bench.now_ms)
        if written and isinstance(action, Write) and action.record["type"] not in ("halt", "end"):
            self.bench.records.append(dict(action.record))
        if self.bench.records[-1]["type"] != "halt":
            self.lives += 1
            self.bench.new_host(self.lives << 8)

    @invariant()
    def an_end_is_an_end(self) -> None:
        if hasattr(self, "bench") and self.bench.conductor.phase is Phase.DONE and not self.bench.rebooted:
            self.bench.check_all_done()
        if hasattr(self, "bench") and self.bench.conductor.halt is not None:
            assert self.bench.conductor.halt.cause in self.FATAL, self.bench.conductor.halt

    def teardown(self) -> None:
        if hasattr(self, "bench"):
            self.bench.conductor.resume(self.bench.now_ms)
            self.bench.run(lambda: self.bench.conductor.phase is Phase.PAUSED)


TestOperation = Operation.TestCase
TestOperation.settings = settings(
    max_examples=25, stateful_step_count=25, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True
)


def test_enough_was_simulated() -> None:
    """The matrix and the scenarios are at least 200,000 polls; a part of them alone is not judged."""
    print(f"{POLLS['polls']} polls in {POLLS['runs']} runs")
    assert POLLS["runs"] < WHOLE or POLLS["polls"] >= TOTAL
