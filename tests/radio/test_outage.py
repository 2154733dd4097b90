"""A radio that goes away and comes back, and somebody who wants the display to stop now."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from curveline.errors import LinkError
from curveline.radio.host.journal import Journal, SystemDisk, read_journal
from curveline.radio.host.link import Control, OperatorRequest, Progress, RunReport, ignore, send_plan
from curveline.radio.interface import Answer, RadioGone
from curveline.radio.mock.air import Weather
from curveline.radio.mock.display import MockRadio
from curveline.radio.mock.spec import MockSpec
from curveline.radio.mock.store import state_at_home
from curveline.radio.protocol.codes import FrameKind
from curveline.radio.protocol.envelope import kind_of

from .bench import POSES, drive_table, make_plan, target

GOAL = target(POSES[-1]).counts


class QuickDisk(SystemDisk):
    """A disk that is not waited for."""

    def sync(self, descriptor: int) -> None:
        """Nothing of what these tests write is to survive a loss of power."""


class Returning(MockRadio):
    """A display whose radio goes away at some moments, for some time each; asking for it takes 50 ms."""

    def __init__(self, outages: Sequence[tuple[int, int]], spec: MockSpec | None = None) -> None:
        super().__init__(spec or MockSpec(), drive_table(), state_at_home(2))
        self.outages = outages
        self.records: list[dict[str, object]] = []

    def exchange(self, frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
        now_ms = self.now_us() // 1000
        for begin_ms, length_ms in self.outages:
            if begin_ms <= now_ms < begin_ms + length_ms:
                self.sleep_until(self.now_us() + 50_000)
                raise RadioGone("the dongle is gone", may_return=now_ms < begin_ms + 30_000)
        return super().exchange(frames)

    def send(self, folder: Path, observer: object = ignore, control: Control | None = None) -> RunReport:
        """Send the plan; `records` is then what was written."""
        journal = Journal(folder, QuickDisk())
        try:
            with closing(journal):
                return send_plan(make_plan(), self, journal, observer, control)  # type: ignore[arg-type]
        finally:
            self.records = list(read_journal(journal.path))  # type: ignore[arg-type]
            journal.path.unlink()


@pytest.mark.parametrize("loss", [0.0, 0.3])
@pytest.mark.parametrize("length_ms", [200, 700, 2000, 20_000])
def test_a_radio_that_comes_back_finds_its_run_again(tmp_path: Path, length_ms: int, loss: float) -> None:
    """Before the nodes are found, while they are, in a step, between two, and twice; short, and beyond the dead-man."""
    for begin_ms in (0, 15, 40, 700, 1520, 3000):
        again_ms = begin_ms + length_ms + 900
        radio = Returning(
            [(begin_ms, length_ms), (again_ms, length_ms)], MockSpec(weather=Weather(loss), seed=begin_ms)
        )
        report = radio.send(tmp_path)
        assert (report.outcome, report.steps_done) == ("done", 3), begin_ms
        assert radio.positions() == (GOAL,) * 2
        barriers = [record["step"] for record in radio.records if record["type"] == "barrier"]
        assert barriers == [1, 2, 3]
    radio = Returning([(700, length_ms)])
    radio.send(tmp_path)
    assert [record["type"] for record in radio.records].count("resume") == (length_ms > 1000)


@pytest.mark.parametrize("begin_ms", [10, 700])
def test_a_radio_that_does_not_come_back_ends_the_run(tmp_path: Path, begin_ms: int) -> None:
    radio = Returning([(begin_ms, 10**6)])
    with pytest.raises(LinkError, match="the dongle is gone"):
        radio.send(tmp_path)
    assert 30_000 <= radio.now_us() // 1000 - begin_ms < 31_000
    assert radio.records[-1]["cause"] == "radio"


def test_nobody_has_to_wait_for_a_radio(tmp_path: Path) -> None:
    """The nodes hold by themselves; whoever wants no more than that is free to go."""
    control, radio = Control(), Returning([(2000, 10**6)])
    plain = radio.exchange

    def exchange(frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
        if radio.now_us() > 3_000_000:
            control.ask(OperatorRequest.HOLD)
        return plain(frames)

    radio.exchange = exchange  # type: ignore[method-assign]
    with pytest.raises(LinkError, match="the dongle is gone"):
        radio.send(tmp_path, ignore, control)
    assert radio.now_us() < 4_000_000


def test_the_operator_is_told_when_the_radio_goes_and_when_it_is_back(tmp_path: Path) -> None:
    told: list[tuple[int, str]] = []
    radio = Returning([(700, 3000)])
    control = Control(tell=lambda line: told.append((radio.now_us() // 1000, line)))
    assert radio.send(tmp_path, ignore, control).outcome == "done"
    (gone_ms, gone), (back_ms, back) = told
    assert gone == "the dongle is gone; waiting for it to come back"
    assert back == "the radio is back"
    assert gone_ms < 800
    assert 3700 <= back_ms < 3800


@pytest.mark.parametrize("asked_s", [-1.0, 0.5])
def test_a_pause_that_was_asked_for_outlives_the_radio(tmp_path: Path, asked_s: float) -> None:
    control, radio = Control(), Returning([(700, 3000)])

    def observer(progress: Progress) -> None:
        if progress.seconds > asked_s:
            control.ask(OperatorRequest.PAUSE)

    report = radio.send(tmp_path, observer, control)
    assert (report.outcome, report.steps_done) == ("paused", 0 if asked_s < 0 else 1)


class Asked(MockRadio):
    """A display of many nodes on a slow channel, and somebody who wants a hold at some moment."""

    def __init__(self, moment_us: int, control: Control, seed: int) -> None:
        drive = replace(drive_table(20), data_rate="250kbps")
        super().__init__(MockSpec(weather=Weather(0.3), seed=seed), drive, state_at_home(20))
        self.waited_us: int | None = None
        self._moment_us = moment_us
        self._control = control

    def exchange(self, frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
        holds = any(kind_of(payload) is FrameKind.DRIVE and payload[23] & 1 for _, payload in frames)
        if holds and self.waited_us is None:
            self.waited_us = self.now_us() - self._moment_us
        answers = super().exchange(frames)
        self._look()
        return answers

    def sleep_until(self, moment_us: int) -> None:
        super().sleep_until(moment_us)
        self._look()

    def _look(self) -> None:
        if self.now_us() >= self._moment_us:
            self._control.ask(OperatorRequest.HOLD)


def test_a_hold_is_on_the_air_within_a_tenth_of_a_second(tmp_path: Path) -> None:
    """However the moment falls into a batch of 16 exchanges at 250 kbps and 30 % loss."""
    plan = make_plan(20, POSES[:1], seconds=4.0)
    plan = replace(plan, drive=replace(plan.drive, data_rate="250kbps"))
    waits = []
    for seed in range(30):
        control = Control()
        radio = Asked(1_500_000 + 7919 * seed, control, seed)
        (tmp_path / str(seed)).mkdir()
        with closing(Journal(tmp_path / str(seed), QuickDisk())) as journal:
            assert send_plan(plan, radio, journal, ignore, control).outcome == "paused"
        assert radio.waited_us is not None
        waits.append(radio.waited_us)
    print(f"hold asked to hold sent, 20 nodes, 250 kbps, 30 % loss: {max(waits) / 1000:.0f} ms at most")
    assert max(waits) <= 100_000
    assert max(waits) > 20_000, "the moments do fall into batches"
