"""Sending plans and reading status through a radio."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import pytest

from curveline.errors import InvalidInput, LinkError
from curveline.radio.host.actions import Phase, Policy
from curveline.radio.host.frame_listing import describe_plan_frames
from curveline.radio.host.journal import Journal, SystemDisk, read_journal
from curveline.radio.host.link import Control, OperatorRequest, Progress, ignore, read_status, send_plan
from curveline.radio.interface import Answer, RadioGone, open_radio
from curveline.radio.mock.air import Weather
from curveline.radio.mock.display import MockRadio
from curveline.radio.mock.spec import MockSpec
from curveline.radio.mock.store import state_at_home
from curveline.radio.protocol.frames import DriveFrame, decode_drive

from .bench import POSES, drive_table, make_plan, target

GOAL = target(POSES[-1]).counts


def mock(count: int = 2, **spec: object) -> MockRadio:
    """A mock display that remembers nothing."""
    return MockRadio(MockSpec(**spec), drive_table(count), state_at_home(count))  # type: ignore[arg-type]


@pytest.fixture
def journal(tmp_path: Path):
    journal = Journal(tmp_path)
    yield journal
    journal.close()


def kinds(journal: Journal) -> list[str]:
    return [str(record["type"]) for record in read_journal(journal.path)]


@pytest.mark.parametrize("loss", [0.0, 0.1, 0.3, 0.5])
def test_a_plan_arrives(journal: Journal, loss: float) -> None:
    radio = mock(3, weather=Weather(loss), spread=0.1)
    news: list[Progress] = []
    report = send_plan(make_plan(3), radio, journal, news.append)
    assert (report.outcome, report.steps_done, report.steps) == ("done", 3, 3)
    assert 3.0 < report.seconds < 12.0
    assert radio.positions() == (GOAL,) * 3
    for status in report.nodes:
        assert status.state == "ready"
        assert status.finished == 3
        assert status.link.polls == status.link.answered + status.link.lost
        assert (status.link.lost > 0) == (loss > 0.2) or loss == 0.1
        assert (status.link.retries > 0) == (loss > 0)
        assert status.counts == pytest.approx(GOAL, abs=4)
    assert kinds(journal) == ["start", *["release", "barrier"] * 3, "end"]
    assert all(record["at"] > 1e9 for record in read_journal(journal.path))
    assert {each.step for each in news} == {1, 2, 3}
    assert {each.status.node for each in news} == {1, 2, 3}
    fractions = [each.fraction for each in news if each.step == 1 and each.status.node == 2]
    assert fractions == sorted(fractions)
    assert {0.0, 1.0} <= set(fractions)
    assert any(0.2 < fraction < 0.8 for fraction in fractions)


def test_loss_costs_few_polls() -> None:
    plan, polls = make_plan(4), {}
    for loss in (0.0, 0.3, 0.5):
        radio = mock(4, weather=Weather(loss), seed=2)
        report = send_plan(plan, radio, NoJournal())  # type: ignore[arg-type]
        polls[loss] = sum(status.link.polls for status in report.nodes)
    assert polls[0.3] <= 1.15 * polls[0.0]
    assert polls[0.5] <= 1.5 * polls[0.0]


class NoJournal:
    """Takes every record and keeps none."""

    def reserve(self, size: int) -> None:
        """Room is no object."""

    def append(self, record: object) -> None:
        """Heard and forgotten."""


def asking(request: OperatorRequest, control: Control, step: int = 2):
    """An observer that asks for something in the middle of a step."""

    def observer(progress: Progress) -> None:
        if progress.step == step and 0.3 < progress.fraction < 0.7:
            control.ask(request)

    return observer


def test_a_pause_ends_at_the_barrier(journal: Journal) -> None:
    control, radio = Control(), mock()
    report = send_plan(make_plan(), radio, journal, asking(OperatorRequest.PAUSE, control), control)
    assert (report.outcome, report.steps_done) == ("paused", 2)
    assert {status.state for status in report.nodes} == {"hold"}
    assert radio.positions() == (target(POSES[1]).counts,) * 2
    assert kinds(journal)[-1] == "pause"


def test_a_hold_ends_at_once(journal: Journal) -> None:
    control, radio = Control(), mock()
    report = send_plan(make_plan(), radio, journal, asking(OperatorRequest.HOLD, control), control)
    assert (report.outcome, report.steps_done) == ("paused", 1)
    assert target(POSES[0]).counts < radio.positions()[0] < target(POSES[1]).counts
    assert all(node.move is None for node in radio.nodes)


def test_an_emergency_stop_is_an_error(journal: Journal) -> None:
    control, radio = Control(), mock()
    with pytest.raises(LinkError, match="emergency stop was asked for in step 2") as caught:
        send_plan(make_plan(), radio, journal, asking(OperatorRequest.ESTOP, control), control)
    assert "off and on" in caught.value.hint
    assert kinds(journal)[-1] == "halt"
    assert [status.state for status in read_status(radio, drive_table())] == ["estop"] * 2


def test_a_paused_run_waits_for_an_operator_who_said_so(journal: Journal) -> None:
    control = Control(waits=True)
    seen: list[Phase] = []

    def observer(progress: Progress) -> None:
        seen.append(progress.phase)
        asking(OperatorRequest.PAUSE, control)(progress)
        if seen.count(Phase.PAUSED) == 50:
            control.resume()

    report = send_plan(make_plan(), mock(), journal, observer, control)
    assert report.outcome == "done"
    assert seen.count(Phase.PAUSED) >= 50
    assert "pause" in kinds(journal)


def test_a_waiting_operator_can_end_the_pause(journal: Journal) -> None:
    control = Control(waits=True)
    seen: list[Phase] = []

    def observer(progress: Progress) -> None:
        seen.append(progress.phase)
        control.ask(OperatorRequest.PAUSE)
        if seen.count(Phase.PAUSED) == 5:
            control.ask(OperatorRequest.HOLD)

    assert send_plan(make_plan(), mock(), journal, observer, control).outcome == "paused"


def test_control_escalates_and_never_goes_back() -> None:
    control = Control()
    assert [control.escalate() for _ in range(4)] == [
        OperatorRequest.PAUSE,
        OperatorRequest.HOLD,
        OperatorRequest.ESTOP,
        OperatorRequest.ESTOP,
    ]
    control.ask(OperatorRequest.PAUSE)
    assert control.request is OperatorRequest.ESTOP


@pytest.mark.parametrize("poll_ms", [20, 700])
def test_whoever_asks_from_outside_is_heard_soon(journal: Journal, poll_ms: int) -> None:
    """Whatever the clock of the radio does: by its own time at least every 0.1 s, and between any two of its frames."""
    radio, heard, told = mock(2), [0], list[str]()
    control = Control(Policy(poll_ms=poll_ms, silence_ms=4000), tell=told.append)

    def listen() -> None:
        heard.append(radio.now_us())
        if len(heard) == 60:
            control.ask(OperatorRequest.HOLD, "a neighbour")

    control.attend(listen)
    report = send_plan(make_plan(2), radio, journal, control=control)
    assert report.outcome == "paused"
    assert max(after - before for before, after in pairwise(heard)) <= 110_000
    assert told == ["asked to hold by a neighbour"]
    last = read_journal(journal.path)[-1]
    assert (last["type"], last["by"], last["process"]) == ("pause", "a neighbour", os.getpid())


def test_a_request_is_heard_while_the_radio_is_away(journal: Journal) -> None:
    radio, tries, control = mock(2), [0], Control()
    plain = radio.exchange

    def exchange(frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
        tries[0] += 1
        if tries[0] < 30:
            return plain(frames)
        radio.sleep_until(radio.now_us() + 50_000)
        raise RadioGone("unplugged", may_return=tries[0] < 200)

    radio.exchange = exchange  # type: ignore[method-assign]
    control.attend(lambda: control.ask(OperatorRequest.HOLD, "a neighbour") if tries[0] == 50 else None)
    with pytest.raises(RadioGone):
        send_plan(make_plan(2), radio, journal, control=control)
    assert tries[0] < 60
    assert read_journal(journal.path)[-1]["by"] == "a neighbour"


def test_an_interrupt_without_a_handler_holds(journal: Journal) -> None:
    radio = mock()
    calls = []

    def observer(progress: Progress) -> None:
        if progress.step == 2 and progress.fraction > 0.3 and not calls:
            calls.append(1)
            raise KeyboardInterrupt

    report = send_plan(make_plan(), radio, journal, observer)
    assert report.outcome == "paused"
    assert all(node.move is None for node in radio.nodes)


def test_a_full_disk_releases_nothing_more(tmp_path: Path) -> None:
    class Full(SystemDisk):
        writes = 0

        def write(self, descriptor: int, data: bytes, offset: int) -> int:
            self.writes += 1
            if self.writes > 3:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return super().write(descriptor, data, offset)

    radio = mock()
    journal = Journal(tmp_path, Full())
    with pytest.raises(LinkError, match="No space left on device"):
        send_plan(make_plan(), radio, journal)
    journal.close()
    assert kinds(journal) == ["start", "release", "barrier"]
    assert {node.memory.started for node in radio.nodes} == {1}
    assert [status.state for status in read_status(radio, drive_table())] == ["hold"] * 2


def test_a_radio_that_breaks_is_recorded(journal: Journal) -> None:
    radio = mock()
    exchange = radio.exchange

    def breaking(frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
        if radio.now_us() > 1_000_000:
            raise LinkError("the radio is gone", node=0)
        return exchange(frames)

    radio.exchange = breaking  # type: ignore[method-assign]
    with pytest.raises(LinkError, match="the radio is gone"):
        send_plan(make_plan(), radio, journal)
    assert read_journal(journal.path)[-1]["cause"] == "radio"


def test_a_plan_for_another_display_never_reaches_the_radio(journal: Journal) -> None:
    radio = mock(3)
    with pytest.raises(InvalidInput, match="2 nodes, but the radio reaches 3"):
        send_plan(make_plan(2), radio, journal)
    assert radio.now_us() == 0


# Status


def test_status_says_how_every_node_is() -> None:
    radio = mock(3, weather=Weather(0.5), seed=4)
    statuses = read_status(radio, drive_table(3))
    assert [(each.node, each.state, each.counts, each.boot) for each in statuses] == [
        (number, "ready", (0, 0, 0), 1) for number in (1, 2, 3)
    ]
    assert all(each.link.polls >= 2 for each in statuses)


def test_status_counts_silent_nodes_too() -> None:
    radio = mock(2, weather=Weather(0.99999), seed=4)
    statuses = read_status(radio, drive_table())
    assert [(each.state, each.counts) for each in statuses] == [("silent", None)] * 2
    assert statuses[0].link.lost == statuses[0].link.polls == 40


def test_status_disturbs_no_run() -> None:
    """Asked through the same radio in the middle of every step, the run neither stops nor notices."""
    radio = mock()
    states: list[str] = []

    def observer(progress: Progress) -> None:
        if len(states) < 60:
            states.extend(each.state for each in read_status(radio, drive_table()))

    report = send_plan(make_plan(), radio, NoJournal(), observer)  # type: ignore[arg-type]
    assert report.outcome == "done"
    assert "moving" in states
    assert radio.nodes[0].memory.offers == 1


# Dry run


def test_a_dry_run_shows_the_real_frames() -> None:
    plan = make_plan()
    records = describe_plan_frames(plan)
    assert [(each.step, each.node) for each in records] == [(step, node) for step in (1, 2, 3) for node in (1, 2)]
    for record in records:
        frame = decode_drive(record.payload, bytes(16), 0)
        assert isinstance(frame, DriveFrame)
        assert (frame.load_step, frame.release) == (record.step, record.step - 1)
        assert frame.target == record.target == plan.steps[record.step - 1].targets[record.node - 1].counts
        assert record.move_ms == 1500
        assert record.address == plan.drive.addresses[record.node - 1]


# The table of radios


def test_what_does_not_exist_is_said_in_one_sentence(tmp_path: Path) -> None:
    for spec in ("pigeon:home", "", "mok"):
        with pytest.raises(InvalidInput, match="there is: mock") as caught:
            open_radio(spec, drive_table(), tmp_path)
        assert "\n" not in caught.value.message
        assert list(tmp_path.iterdir()) == []


def test_the_link_starts_without_heavy_libraries() -> None:
    script = (
        "import sys; import curveline.radio.host.link, curveline.radio.mock.display; "
        "heavy = {'numpy', 'scipy', 'numba', 'pydantic', 'typer', 'rich'} & set(sys.modules); assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
    assert ignore(None) is None  # type: ignore[arg-type]
