"""Runs through a dongle that goes away and comes back: no step is lost, doubled, or done without a record."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from random import Random

import pytest

from campaign import only
from curveline.errors import InvalidInput
from curveline.plan_file import Plan
from curveline.radio.host.actions import Policy, Record
from curveline.radio.host.journal import Journal, ReopenedJournal, SystemDisk, new_run
from curveline.radio.host.link import Control, Halted, OperatorRequest, RunReport, resume_plan, send_plan
from curveline.radio.host.stop_causes import Cause
from curveline.radio.interface import Answer, Radio, RadioGone
from curveline.radio.mock.air import Weather
from curveline.radio.ports import serial as serial_radio
from curveline.radio.ports.serial import SerialRadio
from curveline.radio.protocol.motion import NodeMove

from .bench import make_plan, short_plan
from .dongle_host import DongleHost, Pull, Room, dongle_host

DETECTED_S = 0.2
SCHEDULING_S = 1.0
"""What a busy machine may add to what is measured by the clock on the wall; test_serial.py has the requirement itself,
on a clock in which only our own time-outs pass."""

QUICK = Policy(poll_ms=3, retry_ms=1, silence_ms=300)
PATIENT = Policy(poll_ms=3, retry_ms=1, silence_ms=1500)
STEPS = 10
PULLS = 50
CAMPAIGN = 400
SEED = 15


class Watched:
    """A room in which every departure is checked against the record of the run."""

    def __init__(self, room: Room) -> None:
        self.room = room
        self.begun: list[list[int]] = [[] for _ in room.nodes]
        self.wrong: list[str] = []
        self.released = 0
        for index, plant in enumerate(room.plants):
            plant.follow = self._spy(index, plant.follow)  # type: ignore[method-assign]

    def listen(self, journal: Journal) -> None:
        """Learn of the releases that are on disk."""
        append = journal.append

        def spy(record: Record) -> None:
            append(record)
            if record["type"] == "release":
                self.released = max(self.released, record["step"])

        journal.append = spy  # type: ignore[method-assign]

    def check_end(self, plan: Plan) -> None:
        assert self.wrong == []
        assert self.begun == [list(range(1, len(plan.steps) + 1))] * len(self.begun)
        assert self.room.positions() == [target.counts for target in plan.steps[-1].targets]

    def _spy(self, index: int, follow: Callable[[int, int, NodeMove], None]) -> Callable[[int, int, NodeMove], None]:
        def checked(now_ms: int, start_ms: int, move: NodeMove) -> None:
            if move.brake_ms is None:
                self._check(index)
            follow(now_ms, start_ms, move)

        return checked

    def _check(self, index: int) -> None:
        """A node sets off: for a step, or for the rest of one in which it was held."""
        memories = [node.memory for node in self.room.nodes]
        own = memories[index]
        if self.begun[index][-1:] != [own.started]:
            self.begun[index].append(own.started)
        checks = {
            "I1": max(memory.started for memory in memories) <= min(memory.finished for memory in memories) + 1,
            "I3": own.homed and not own.fault and not own.estop,
            "I4": own.started <= self.released,
            "a step is done once": own.finished == own.started - 1,
            "all have their target": all(memory.staged >= own.started for memory in memories),
        }
        self.wrong += [f"node {index + 1}, step {own.started}: {name}" for name, holds in checks.items() if not holds]


class Pulled:
    """A radio whose dongle goes away again and again while it is used; it measures how soon that is noticed.

    On a busy machine the thread that plays the dongle may be late enough to be taken for gone: that is no measurement.
    """

    def __init__(self, radio: SerialRadio, host: DongleHost, draw: Callable[[], Pull | None]) -> None:
        self.site = radio.site
        self.now_us, self.sleep_until, self.close = radio.now_us, radio.sleep_until, radio.close
        self.noticed_s: list[float] = []
        self.hung_s: list[float] = []
        self._radio, self._host, self._draw = radio, host, draw
        self._last: Pull | None = None
        self._drawn_at = 0.0

    def exchange(self, frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
        was_there = self._radio.gone_since_us is None
        if was_there and self._host.pull is None and frames:
            self._drawn_at = time.monotonic()
            self._last = self._host.pull = self._draw()
        try:
            return self._radio.exchange(frames)
        except RadioGone:
            if was_there and self._last is not None and self._host.gone_at > self._drawn_at:
                (self.hung_s if self._last.hangs else self.noticed_s).append(time.monotonic() - self._host.gone_at)
            raise


def draw_from(random: Random) -> Callable[[], Pull]:
    """Most gaps are short, some outlast the nodes' patience, and now and then the dongle hangs."""

    def draw() -> Pull:
        gap_s = random.uniform(0.35, 0.5) if random.random() < 0.06 else random.uniform(0.0, 0.03)
        return Pull(random.randrange(30), random.random(), gap_s, hangs=random.random() < 0.08)

    return draw


def once(pull: Pull) -> Callable[[], Pull | None]:
    return iter([pull, *[None] * 100_000]).__next__


def attempt(plan: Plan, radio: Radio, journal: Journal, control: Control | None = None) -> RunReport:
    """Send, or resume."""
    control = control or Control(QUICK)
    with closing(journal):
        if isinstance(journal, ReopenedJournal):
            return resume_plan(plan, radio, journal, control=control)
        return send_plan(plan, radio, journal, control=control)


def carry_through(plan: Plan, radio: Radio, journal: Journal, watched: Watched) -> tuple[RunReport, int]:
    """Send, and resume whenever the nodes have held meanwhile, for the dongle's sake or a busy machine's; how often."""
    resumed = 0
    while True:
        watched.listen(journal)
        try:
            return attempt(plan, radio, journal), resumed
        except Halted as halted:
            if halted.halt.cause not in (Cause.HELD, Cause.SUSPENDED):
                raise
            resumed += 1
        journal = ReopenedJournal(journal.path.parent, QuickDisk())


class QuickDisk(SystemDisk):
    """A disk that keeps nobody waiting: how long a real one takes is not what these tests are about."""

    def sync(self, descriptor: int) -> None:
        """Nothing here is to outlive the machine."""


@pytest.fixture
def journal(tmp_path: Path) -> Journal:
    return new_journal(tmp_path)


def new_journal(tmp_path: Path) -> Journal:
    return Journal(new_run(tmp_path / "runs", "unplugged"), QuickDisk())


def open_radio(host: DongleHost, plan: Plan) -> SerialRadio:
    return SerialRadio(str(host.path), plan.drive, host.room.site)


@pytest.mark.parametrize("pulls", [PULLS, *only([CAMPAIGN])])
def test_gone_at_any_moment_nothing_is_lost_or_doubled(tmp_path: Path, pulls: int) -> None:
    print(f"seed {SEED}")
    random = Random(SEED)
    plan = short_plan(2, STEPS)
    noticed, hung, runs, resumed = [], [], 0, 0
    while len(noticed) + len(hung) < pulls:
        room = Room(plan.drive, weather=Weather(loss=0.1 * (runs % 2)))
        watched = Watched(room)
        journal = new_journal(tmp_path)
        with dongle_host(tmp_path / "dongle", room) as host, closing(open_radio(host, plan)) as radio:
            pulled = Pulled(radio, host, draw_from(random))
            report, count = carry_through(plan, pulled, journal, watched)
            assert (report.outcome, report.steps_done) == ("done", STEPS)
            watched.check_end(plan)
        noticed += pulled.noticed_s
        hung += pulled.hung_s
        runs, resumed = runs + 1, resumed + count
    print(f"{len(noticed)} plugs pulled, noticed within {1000 * max(noticed):.1f} ms; {len(hung)} dongles hung, ")
    print(f"noticed within {1000 * max(hung):.0f} ms; {runs} runs, resumed {resumed} times")
    assert max(noticed + hung) < DETECTED_S + SCHEDULING_S


PLAN = make_plan(2, [(1.0, 1.0, 0.5), (4.0, 0.0, 0.0)], seconds=0.5)


def test_a_gap_within_the_nodes_patience_goes_unnoticed_by_them(tmp_path: Path, journal: Journal) -> None:
    room = Room(PLAN.drive)
    watched = Watched(room)
    watched.listen(journal)
    with dongle_host(tmp_path / "dongle", room) as host, closing(open_radio(host, PLAN)) as radio:
        pulled = Pulled(radio, host, once(Pull(30, 0.5, 0.02)))
        control = Control(PATIENT)
        assert attempt(PLAN, pulled, journal, control).outcome == "done"
        assert len(pulled.noticed_s) == 1
    watched.check_end(PLAN)


def test_a_longer_one_lets_them_hold_and_the_run_goes_on_by_a_new_session(tmp_path: Path, journal: Journal) -> None:
    room = Room(PLAN.drive)
    watched = Watched(room)
    with dongle_host(tmp_path / "dongle", room) as host, closing(open_radio(host, PLAN)) as radio:
        pulled = Pulled(radio, host, once(Pull(60, 0.5, 0.6)))
        report, _ = carry_through(PLAN, pulled, journal, watched)
        assert report.outcome == "done"
    watched.check_end(PLAN)


def test_a_node_that_restarts_in_the_gap_ends_the_run_for_good(tmp_path: Path) -> None:
    for gap_s, policy in ((0.05, PATIENT), (1.1, Policy(poll_ms=3, silence_ms=700))):
        journal, room = new_journal(tmp_path), Room(PLAN.drive)
        with dongle_host(tmp_path / "dongle", room) as host, closing(open_radio(host, PLAN)) as radio:

            def reboot(room: Room = room) -> None:
                room.reboot(1)

            host.on_gone = reboot
            pulled = Pulled(radio, host, once(Pull(60, 0.5, gap_s)))
            with pytest.raises(Halted) as caught:
                attempt(PLAN, pulled, journal, Control(policy))
            assert caught.value.halt.cause in (Cause.REBOOT, Cause.NOT_HOMED)
            assert caught.value.node == 2
            with pytest.raises((InvalidInput, Halted), match="restart"):
                attempt(PLAN, radio, ReopenedJournal(journal.path.parent))
            assert room.nodes[1].memory.started == 0


def test_a_dongle_that_stays_away_ends_the_run_which_can_be_resumed(
    tmp_path: Path, journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    room = Room(PLAN.drive)
    watched = Watched(room)
    watched.listen(journal)
    with dongle_host(tmp_path / "dongle", room) as host:
        with monkeypatch.context() as patch, closing(open_radio(host, PLAN)) as radio:
            patch.setattr(serial_radio, "RETURN_S", 0.3)
            with pytest.raises(RadioGone, match="is out of action, for") as caught:
                attempt(PLAN, Pulled(radio, host, once(Pull(60, 0.5, 100))), journal, Control(PATIENT))
            assert not caught.value.may_return
        host.plug()
        with closing(open_radio(host, PLAN)) as radio:
            journal = ReopenedJournal(journal.path.parent)
            watched.listen(journal)
            report = attempt(PLAN, radio, journal, Control(PATIENT))
        assert report.outcome == "done"
    watched.check_end(PLAN)


def test_an_operator_who_wants_out_need_not_wait_for_it(tmp_path: Path, journal: Journal) -> None:
    room = Room(PLAN.drive)
    with dongle_host(tmp_path / "dongle", room) as host, closing(open_radio(host, PLAN)) as radio:
        control = Control(PATIENT)
        host.on_gone = lambda: control.ask(OperatorRequest.HOLD)
        begin = time.monotonic()
        with pytest.raises(RadioGone) as caught:
            attempt(PLAN, Pulled(radio, host, once(Pull(60, 0.5, 100))), journal, control)
        assert caught.value.may_return
        assert time.monotonic() - begin < 10
