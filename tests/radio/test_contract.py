"""What every radio must do, whichever it is: each test runs over every back end, see `worlds.WORLDS`."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path

import pytest

from curveline.errors import InvalidInput, LinkError
from curveline.plan_file import Plan
from curveline.radio.host.actions import Policy
from curveline.radio.host.journal import Journal, new_run, read_journal
from curveline.radio.host.link import Control, OperatorRequest, Progress, RunReport, read_status, send_plan
from curveline.radio.host.service import clear_fault, home_axes, report_of
from curveline.radio.interface import BACK_ENDS, BATCH, Answer, Radio
from curveline.radio.measuring.reach import RangeWish, measure_reach
from curveline.radio.mock.air import Weather
from curveline.radio.node.state import NOWHERE
from curveline.radio.protocol.air_time import RETRIES
from curveline.radio.protocol.codes import FLAG_QUERY, FLAG_TAKEOVER, FRAME_BYTES, Fault, NodeState
from curveline.radio.protocol.frames import (
    DriveFrame,
    HelloFrame,
    ReportFrame,
    decode_report,
    encode_drive,
    encode_hello,
)
from curveline.radio.protocol.keys import session_key

from .bench import drive_table, make_plan, short_plan
from .worlds import HERE, SEED, WORLDS, World, world_of

PLAN = make_plan(2, [(0.3, 1.0, 0.1), (0.5, 0.0, 0.0)], seconds=0.1)
THERE_AND_BACK = make_plan(2, [(0.3, 1.0, 0.1), (0.0, 0.0, 0.0)], seconds=0.1)
HURRY = Policy(budget_ms=400)
"""For runs that are to fail: how long they try."""
BLANK = bytes(FRAME_BYTES)
NOBODY = "0102030405"
NONCE = 0x5566778899AABB00

Display = Callable[..., World]


@pytest.fixture(params=HERE)
def display(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Display]:
    """Makes a display of so many nodes in some weather."""
    with ExitStack() as stack:

        def make(weather: Weather | None = None, count: int = 2) -> World:
            print(f"seed {SEED}")
            made = world_of(request.param, tmp_path / "world", drive_table(count), weather or Weather())
            return stack.enter_context(made)

        yield make


@pytest.fixture
def world(display: Display) -> World:
    return display()


def send(world: World, plan: Plan = PLAN, control: Control | None = None, radio: Radio | None = None) -> RunReport:
    journal = Journal(new_run(world.folder, "contract"))
    try:
        return send_plan(plan, radio or world.radio, journal, control=control)
    finally:
        journal.close()


def query(world: World, number: int, attempt: int = 0) -> tuple[str, bytes]:
    """A question to a node that changes nothing."""
    hello = HelloFrame(number, NONCE | attempt, 0, 0, 0, FLAG_QUERY)
    return world.drive.addresses[number - 1], encode_hello(hello, world.radio.site.node_key(number))


def answered(world: World, number: int, answer: Answer) -> ReportFrame | None:
    """What a node said to the question, None if it is not that."""
    status = decode_report(answer.payload or b"", world.radio.site.node_key(number), NONCE)
    return status if isinstance(status, ReportFrame) and status.node == number else None


def assert_arrived(world: World, report: RunReport, plan: Plan = PLAN) -> None:
    """The run is done, and every node stands at the end of it, having done each step once."""
    steps = len(plan.steps)
    assert (report.outcome, report.steps_done) == ("done", steps)
    assert [(node.memory.started, node.memory.finished) for node in world.nodes()] == [(steps, steps)] * len(
        plan.drive.addresses
    )
    for node, goal in zip(world.nodes(), plan.steps[-1].targets, strict=True):
        assert node.memory.target == goal.counts


# The shape of a radio


def test_every_back_end_is_in_the_suite() -> None:
    assert {name.partition("-")[0] for name in WORLDS} == set(BACK_ENDS)


def test_it_has_the_methods_of_a_radio(world: World) -> None:
    for name, method in inspect.getmembers(Radio, inspect.isfunction):
        if not name.startswith("_"):
            assert inspect.signature(method) == inspect.signature(getattr(type(world.radio), name)), name
    assert len(world.radio.site.chips) == 2


# The air


def test_it_hears_who_else_sends_and_for_what_part_of_the_time(display: Display) -> None:
    world = display(Weather(noise=((6, 0.5),)))
    looks = [set(world.radio.carriers()) for _ in range(40)]
    for channel in (0, 26, 48, 76, 125):
        assert not any(channel in look for look in looks), channel
    for channel in (27, 37, 47):
        assert 8 <= sum(channel in look for look in looks) <= 32, channel
    assert answered_soon(world, 1), "it is back on its own channel"
    assert all(node.tally.bad_tags == 0 for node in world.nodes())


def test_noise_on_its_channel_costs_packets_and_elsewhere_none(display: Display) -> None:
    world = display(Weather(noise=((6, 0.9),)))
    assert [retries_of(world) for _ in range(2)] == [0, 0]


def test_noise_on_its_channel_costs_packets(display: Display) -> None:
    assert retries_of(display(Weather(noise=((13, 0.5),)))) > 20


def test_less_power_reaches_less_far_and_full_power_is_what_it_begins_with(display: Display) -> None:
    world = display(Weather(margin=16.0))
    full = retries_of(world)
    world.radio.set_power("min")
    least = retries_of(world)
    world.radio.set_power("max")
    assert retries_of(world) < 30 > full
    assert least > 55


def test_how_well_a_node_is_heard(display: Display) -> None:
    world = display(Weather(margin=12.0))
    found = measure_reach(world.radio, world.spec, world.drive, 1, RangeWish(2.0))
    full, *_, least = found.levels
    assert full.lost <= 2
    assert least.loss > 0.6
    assert found.depends_on_power
    assert retries_of(world) < 60, "full power is back"


def retries_of(world: World) -> int:
    """How often 40 packets were sent again."""
    return sum(answer.retries for index in range(40) for answer in world.radio.exchange([query(world, 1, index)]))


def answered_soon(world: World, number: int) -> bool:
    """Whether a node answers one of a few questions."""
    answers = [answer for attempt in range(9) for answer in world.radio.exchange([query(world, number, attempt)])]
    return any(answered(world, number, answer) for answer in answers)


def test_its_time_only_grows_and_sleeping_reaches_the_moment(world: World) -> None:
    radio = world.radio
    times = [radio.now_us()]
    for _ in range(3):
        radio.sleep_until(radio.now_us() + 2000)
        times.append(radio.now_us())
    assert all(later - sooner >= 2000 for sooner, later in pairwise(times))
    radio.sleep_until(0)
    assert radio.now_us() >= times[-1]


# Exchanges


def test_nothing_to_send_is_answered_by_nothing(world: World) -> None:
    assert list(world.radio.exchange([])) == []


def test_an_exchange_takes_time_and_gives_a_frame_or_nothing(world: World) -> None:
    for number in range(20):
        begin = world.radio.now_us()
        (answer,) = world.radio.exchange([(world.drive.addresses[number % 2], bytes([number]) * FRAME_BYTES)])
        assert world.radio.now_us() > begin
        assert answer.payload is None or len(answer.payload) in (0, FRAME_BYTES)
        assert answer.retries >= 0


def test_a_full_batch_is_answered_in_its_order(world: World) -> None:
    frames = [query(world, 1 + index % 2, index) if index % 3 else (NOBODY, BLANK) for index in range(BATCH)]
    world.radio.exchange([query(world, 1, 100), query(world, 2, 100)])
    answers = world.radio.exchange(frames)
    assert len(answers) == BATCH
    for index, answer in enumerate(answers):
        if index % 3:
            assert answered(world, 1 + index % 2, answer) is not None, index
        else:
            assert answer.payload is None, index


def test_sixteen_nodes_answer_one_batch(display: Display) -> None:
    world = display(count=16)
    for attempt in range(2):
        answers = world.radio.exchange([query(world, number, attempt) for number in range(1, 17)])
    assert all(answered(world, number, answer) for number, answer in enumerate(answers, start=1))


def test_an_address_of_nobody_stays_silent(world: World) -> None:
    for _ in range(3):
        (answer,) = world.radio.exchange([(NOBODY, BLANK)])
        assert answer == Answer(None, RETRIES)


def test_addresses_may_be_written_in_either_case(world: World) -> None:
    address, question = query(world, 1)
    for spelling in (address.lower(), address.upper()):
        (answer,) = world.radio.exchange([(spelling, question)])
        assert answer.payload is not None


def test_an_answer_was_loaded_before_its_question(world: World) -> None:
    key = world.radio.site.node_key(1)
    heard = []
    for round_number in range(3):
        handshake = NONCE + (round_number << 8)
        hello = HelloFrame(1, handshake, 0, 0, 0, FLAG_QUERY)
        (answer,) = world.radio.exchange([(world.drive.addresses[0], encode_hello(hello, key))])
        heard.append(answer.payload or b"")
        world.radio.sleep_until(world.radio.now_us() + 5000)
    assert not any(isinstance(decode_report(heard[0], key, NONCE + (later << 8)), ReportFrame) for later in range(3))
    assert isinstance(decode_report(heard[1], key, NONCE), ReportFrame)
    assert isinstance(decode_report(heard[2], key, NONCE + 0x100), ReportFrame)


def test_one_node_twice_in_a_batch_is_asked_twice(world: World) -> None:
    key = world.radio.site.node_key(1)
    world.radio.exchange([query(world, 1, 1 << 8)])
    answers = world.radio.exchange([query(world, 1, 2 << 8), query(world, 1, 3 << 8)])
    for number, answer in enumerate(answers, start=1):
        assert isinstance(decode_report(answer.payload or b"", key, NONCE | number << 8), ReportFrame)


def test_retries_are_reported(display: Display) -> None:
    world = display(Weather(loss=0.5))
    answers = [world.radio.exchange([query(world, 1, attempt)])[0] for attempt in range(60)]
    assert {answer.retries for answer in answers} == {0, 1, 2, 3}
    assert all(answer.retries == RETRIES for answer in answers if answer.payload is None)


def test_good_air_needs_no_retries(world: World) -> None:
    answers = [world.radio.exchange([query(world, 1, attempt)])[0] for attempt in range(10)]
    assert [answer.retries for answer in answers] == [0] * 10


@pytest.mark.parametrize("size", [0, 1, 31, 33, 64, 5000])
def test_a_payload_that_is_no_frame_is_refused(world: World, size: int) -> None:
    with pytest.raises(InvalidInput, match="32 bytes"):
        world.radio.exchange([query(world, 1), (world.drive.addresses[0], bytes(size))])
    assert world.radio.exchange([query(world, 1)])[0].payload is not None


@pytest.mark.parametrize("address", ["", "C1", "C1C1C1C1C1C1", "C1C1C1C1GG", "C1C1C1C10\n", "\u0661" * 10])
def test_an_address_that_is_none_is_refused(world: World, address: str) -> None:
    with pytest.raises(InvalidInput, match="address"):
        world.radio.exchange([(address, BLANK)])
    assert world.radio.exchange([query(world, 1)])[0].payload is not None


def test_a_batch_that_is_too_long_is_refused(world: World) -> None:
    with pytest.raises(InvalidInput, match=f"at most {BATCH} frames"):
        world.radio.exchange([query(world, 1)] * (BATCH + 1))


# Runs


def test_a_node_is_homed_and_forgets_its_fault(world: World) -> None:
    unhomed, hurt = world.nodes()
    unhomed.memory.unhomed = NOWHERE
    hurt.memory.fault, hurt.memory.fault_axis = Fault.STALL, 2
    assert report_of(world.radio, world.drive, 1).state is NodeState.UNHOMED
    homed = home_axes(world.radio, world.drive, 1)
    assert (homed.axes, homed.state, homed.boot) == ((0, 0, 0), NodeState.READY, 1)
    assert report_of(world.radio, world.drive, 2).fault is Fault.STALL
    assert clear_fault(world.radio, world.drive, 2).state is NodeState.READY
    assert_arrived(world, send(world, THERE_AND_BACK), THERE_AND_BACK)


def test_status_then_send_then_status(world: World) -> None:
    before = read_status(world.radio, world.drive)
    assert [each.counts for each in before] == [(0, 0, 0)] * 2
    report = send(world)
    assert_arrived(world, report)
    for after, goal in zip(read_status(world.radio, world.drive), PLAN.steps[-1].targets, strict=True):
        assert after.counts == pytest.approx(goal.counts, abs=4)
        assert after.state == "ready"
    (journal,) = world.folder.rglob("journal*")
    assert read_journal(journal)[-1]["type"] == "end"


@pytest.mark.parametrize(
    "weather",
    [
        Weather(loss=0.3),
        Weather(duplicate=0.3),
        Weather(stale=0.3),
        Weather(corrupt=0.1),
        Weather(loss=0.3, duplicate=0.1, stale=0.1, corrupt=0.05),
    ],
    ids=["loss", "duplicates", "stale answers", "corruption", "all at once"],
)
def test_bad_air_costs_no_step(display: Display, weather: Weather) -> None:
    world = display(weather)
    assert_arrived(world, send(world))


@pytest.mark.parametrize("count", [3, 4])
def test_the_repeat_filter_starves_no_node(display: Display, count: int) -> None:
    world = display(count=count)
    plan = short_plan(count, 3)
    assert_arrived(world, send(world, plan), plan)


def test_a_dead_node_does_not_disturb_the_others(display: Display) -> None:
    world = display(count=3)
    world.silence(2)
    world.radio.exchange([query(world, number) for number in (1, 2, 3)])
    answers = world.radio.exchange([query(world, number, 1) for number in (1, 2, 3)])
    assert [answered(world, number, answer) is not None for number, answer in enumerate(answers, start=1)] == [
        True,
        False,
        True,
    ]
    assert [each.state for each in read_status(world.radio, world.drive)] == ["ready", "silent", "ready"]


def test_a_run_with_a_dead_node_names_it(world: World) -> None:
    world.silence(2)
    with pytest.raises(LinkError) as caught:
        send(world, control=Control(HURRY))
    assert (caught.value.node, bool(caught.value.hint)) == (2, True)
    assert all(node.memory.started == 0 for node in world.nodes())


def test_frames_of_another_run_are_ignored(world: World) -> None:
    tape: list[tuple[str, bytes]] = []
    assert_arrived(world, send(world, THERE_AND_BACK, radio=_Recorder(world.radio, tape)), THERE_AND_BACK)
    assert_arrived(world, send(world, THERE_AND_BACK), THERE_AND_BACK)
    before = [(node.state, node.memory.target, node.memory.staged) for node in world.nodes()]
    for begin in range(0, len(tape), BATCH):
        world.radio.exchange(tape[begin : begin + BATCH])
    assert [(node.state, node.memory.target, node.memory.staged) for node in world.nodes()] == before
    assert_arrived(world, send(world, THERE_AND_BACK), THERE_AND_BACK)


def test_a_stranger_with_another_key_moves_nothing(world: World) -> None:
    address, stranger = world.drive.addresses[0], bytes(range(16))
    frames = [(address, encode_hello(HelloFrame(1, NONCE, 5, 0, 1000, FLAG_TAKEOVER), stranger))]
    for session in range(4):
        drive = DriveFrame(0, session, 1000 + session, 9, 1, (500, 500, 500), 100)
        frames.append((address, encode_drive(drive, session_key(stranger, NONCE, (1, 1, 0), 5))))
    for _ in range(3):
        world.radio.exchange(frames)
    node = world.nodes()[0]
    assert (node.memory.offers, node.memory.staged, node.memory.started) == (0, 0, 0)
    assert node.tally.bad_tags > 0
    assert_arrived(world, send(world))


def test_a_hold_stops_the_run_where_it_is(world: World) -> None:
    control = Control()
    plan = make_plan(2, [(5.0, 0.0, 0.0)], seconds=1.0)
    journal = Journal(new_run(world.folder, "contract"))

    def watch(progress: Progress) -> None:
        if progress.status.started:
            control.ask(OperatorRequest.HOLD)

    report = send_plan(plan, world.radio, journal, watch, control)
    journal.close()
    assert (report.outcome, report.steps_done) == ("paused", 0)
    assert all(status.state == "hold" for status in report.nodes)


# Opening and closing


def test_closing_twice_is_once(world: World) -> None:
    world.radio.close()
    stored = _files(world.folder)
    world.radio.close()
    assert _files(world.folder) == stored


def test_a_closed_radio_says_so(world: World) -> None:
    world.radio.exchange([query(world, 1)])
    world.radio.close()
    for _ in range(2):
        with pytest.raises(LinkError):
            world.radio.exchange([query(world, 1)])


def test_closing_during_a_run_ends_it_with_a_link_error(world: World) -> None:
    journal = Journal(new_run(world.folder, "contract"))

    def watch(progress: Progress) -> None:
        if progress.status.started:
            world.radio.close()

    with pytest.raises(LinkError):
        send_plan(PLAN, world.radio, journal, watch)
    journal.close()
    world.radio.close()


def test_a_second_opener_is_refused_until_the_first_closes(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("curveline.radio.mock.store.LOCK_WAIT_S", 0.1)
    with pytest.raises(LinkError, match=r"in use|locked|another") as caught:
        world.open()
    assert caught.value.hint
    assert world.radio.exchange([query(world, 1)])[0].payload is not None
    world.radio.close()
    second = world.open()
    assert second.exchange([query(world, 1)])[0].payload is not None
    second.close()


def test_after_a_link_error_it_closes_and_opens_again(world: World) -> None:
    world.silence(1)
    with pytest.raises(LinkError):
        send(world, control=Control(HURRY))
    world.radio.close()
    world.open().close()


class _Recorder:
    """A radio that keeps what it sends."""

    def __init__(self, radio: Radio, tape: list[tuple[str, bytes]]) -> None:
        self.site = radio.site
        self._radio = radio
        self._tape = tape

    def exchange(self, frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
        self._tape.extend(frames)
        return self._radio.exchange(frames)

    def close(self) -> None:
        self._radio.close()

    def now_us(self) -> int:
        return self._radio.now_us()

    def sleep_until(self, moment_us: int) -> None:
        self._radio.sleep_until(moment_us)


def _files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.rglob("*.json")}
