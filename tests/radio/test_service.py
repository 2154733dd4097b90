"""What a host does to single nodes: over lossy air, with nodes that are absent, owned, stopped or hurt."""

from __future__ import annotations

from pathlib import Path

import pytest

from curveline.errors import InvalidInput, LinkError
from curveline.radio.host.journal import Journal, ReopenedJournal, new_run
from curveline.radio.host.link import Halted, resume_plan, send_plan
from curveline.radio.host.peer import NO_LOAD, Peer
from curveline.radio.host.service import clear_fault, home_axes, report_of
from curveline.radio.host.stop_causes import Cause
from curveline.radio.mock.display import MockRadio, open_radio
from curveline.radio.protocol.codes import ALL_AXES, NOT_HOMED, BootCause, Fault, FrameKind, NodeState
from curveline.radio.protocol.envelope import kind_of
from curveline.radio.protocol.frames import HelloFrame, IdentFrame, StopFrame, encode_hello, encode_stop

from .bench import drive_table, make_plan

DRIVE = drive_table()
LOSSES = ["", "loss=0.3,dup=0.1,stale=0.2", "loss=0.5"]


def opened(runs: Path, settings: str) -> MockRadio:
    return open_radio(settings, DRIVE, runs)


def broken_off(runs: Path, settings: str) -> tuple[Path, LinkError]:
    """A run that ends in a fault."""
    radio = opened(runs, settings)
    run = new_run(runs, "test")
    journal = Journal(run)
    with pytest.raises(LinkError) as caught:
        send_plan(make_plan(seconds=2.0), radio, journal)
    journal.close()
    radio.close()
    return run, caught.value


@pytest.mark.parametrize("weather", LOSSES)
def test_an_unhomed_node_is_homed(tmp_path: Path, weather: str) -> None:
    radio = opened(tmp_path, f"unhomed=2,{weather}")
    assert report_of(radio, DRIVE, 2).axes == (NOT_HOMED, NOT_HOMED, NOT_HOMED)
    seen: list[NodeState] = []
    report = home_axes(radio, DRIVE, 2, watcher=lambda status: seen.append(status.state))
    assert (report.axes, report.state, report.cause) == ((0, 0, 0), NodeState.READY, BootCause.POWER_ON)
    assert NodeState.HOMING in seen
    radio.close()


def test_one_axis_at_a_time_and_a_motor_that_is_absent(tmp_path: Path) -> None:
    radio = opened(tmp_path, "unhomed=1,absent=bias@1")
    assert home_axes(radio, DRIVE, 1, 0b001).axes == (0, NOT_HOMED, NOT_HOMED)
    report = home_axes(radio, DRIVE, 1, ALL_AXES)
    assert (report.axes, report.state, report.fault) == ((0, Fault.ENCODER, 0), NodeState.UNHOMED, Fault.NONE)
    radio.close()


def test_what_interrupts_homing_ends_it(tmp_path: Path) -> None:
    broken_off(tmp_path, "reboot=1@step3")
    radio = opened(tmp_path, "")
    polls = 0

    def interrupt(status: object) -> None:
        nonlocal polls
        polls += 1
        if polls == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        home_axes(radio, DRIVE, 1, watcher=interrupt)
    assert radio.nodes[0].memory.homing == 0
    assert report_of(radio, DRIVE, 1).state is NodeState.UNHOMED
    radio.close()


@pytest.mark.parametrize("weather", LOSSES)
def test_a_fault_is_cleared_and_the_run_goes_on(tmp_path: Path, weather: str) -> None:
    run, error = broken_off(tmp_path, "stall=1@step2")
    assert isinstance(error, Halted)
    radio = opened(tmp_path, weather)
    before = report_of(radio, DRIVE, 1)
    assert (before.state, before.fault, before.fault_axis) == (NodeState.FAULT, Fault.STALL, 2)
    after = clear_fault(radio, DRIVE, 1)
    assert (after.state, after.fault, after.started) == (NodeState.HOLD_LINK, Fault.NONE, before.started)
    journal = ReopenedJournal(run)
    assert resume_plan(make_plan(seconds=2.0), radio, journal).outcome == "done"
    journal.close()
    radio.close()


def test_a_lost_position_is_not_cleared(tmp_path: Path) -> None:
    broken_off(tmp_path, "encoder=1@step2")
    radio = opened(tmp_path, "")
    assert clear_fault(radio, DRIVE, 1).state is NodeState.POSITION_LOST
    assert home_axes(radio, DRIVE, 1).state is NodeState.READY
    radio.close()


def test_a_fault_says_since_when_over_several_hosts(tmp_path: Path) -> None:
    broken_off(tmp_path, "stall=1@step2")
    radio = opened(tmp_path, "")
    radio.sleep_until(90_000_000)
    assert 90 <= report_of(radio, DRIVE, 1).fault_s < 120
    radio.close()


def test_a_node_of_another_host_is_left_alone(tmp_path: Path) -> None:
    radio = opened(tmp_path, "busy=1")
    for act in (clear_fault, home_axes):
        with pytest.raises(Halted) as caught:
            act(radio, DRIVE, 1)
        assert caught.value.halt.cause is Cause.BUSY
    assert clear_fault(radio, DRIVE, 2).state is NodeState.READY
    radio.close()


def test_a_node_stopped_for_good_does_not_home(tmp_path: Path) -> None:
    radio = opened(tmp_path, "estop=1")
    with pytest.raises(Halted) as caught:
        home_axes(radio, DRIVE, 1)
    assert caught.value.halt.cause is Cause.LATCHED
    radio.close()
    again = opened(tmp_path, "repower")
    assert home_axes(again, DRIVE, 1).state is NodeState.READY
    again.close()


@pytest.mark.parametrize(
    ("settings", "cause"),
    [("config=1", Cause.CONFIG), ("version=1", Cause.VERSION), ("chip=1", Cause.CHIP), ("clone=1", Cause.CLONE)],
)
def test_a_node_that_is_not_as_it_should_be_is_refused(tmp_path: Path, settings: str, cause: Cause) -> None:
    radio = opened(tmp_path, settings)
    with pytest.raises(Halted) as caught:
        home_axes(radio, DRIVE, 1)
    assert caught.value.halt.cause is cause
    radio.close()


def test_a_node_that_is_off_and_one_that_does_not_exist(tmp_path: Path) -> None:
    radio = opened(tmp_path, "")
    radio._stations[0].deaf_until_ms = 10**9
    for act in (report_of, clear_fault, home_axes):
        with pytest.raises(Halted) as caught:
            act(radio, DRIVE, 1)
        assert caught.value.halt.cause is Cause.SILENT
        with pytest.raises(InvalidInput, match="there is no node 3"):
            act(radio, DRIVE, 3)
    radio.close()


def test_a_node_that_falls_silent_while_it_homes_is_given_up(tmp_path: Path) -> None:
    radio = opened(tmp_path, "unhomed=1")

    def fall_silent(status: object) -> None:
        radio._stations[0].deaf_until_ms = 10**9

    with pytest.raises(Halted, match="node 1 does not answer any more"):
        home_axes(radio, DRIVE, 1, watcher=fall_silent)
    radio.close()
    assert radio.nodes[0].memory.homing == 0


def test_homing_leaves_the_other_nodes_alone(tmp_path: Path) -> None:
    radio = opened(tmp_path, "unhomed=1")
    before = radio.nodes[1].memory.offers
    home_axes(radio, DRIVE, 1)
    assert radio.nodes[1].memory.offers == before
    radio.close()


def test_a_homing_that_ends_between_two_polls_has_been_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As that of an extruder without a switch, which is zeroed where it stands."""
    monkeypatch.setattr("curveline.radio.node.plant.SEEK_LEAST_MS", 2)
    monkeypatch.setattr("curveline.radio.node.plant.SEEK_RAMP_MS", 1)
    radio = opened(tmp_path, "unhomed=1")
    report = home_axes(radio, DRIVE, 1, 0b001)
    assert report.axes == (0, NOT_HOMED, NOT_HOMED)
    radio.close()


def test_homing_that_was_killed_can_be_ordered_again_at_once(tmp_path: Path) -> None:
    radio = opened(tmp_path, "unhomed=1")
    lost = Peer(1, DRIVE.addresses[0], radio.site.node_key(1), 0x7700)
    hello = HelloFrame(1, lost.nonce, 0, 0, 1000)
    for _ in range(2):
        (answer,) = radio.exchange([(lost.address, lost.hello(hello))])
    ident = lost.take(answer.payload or b"")
    assert isinstance(ident, IdentFrame)
    lost.accept(ident, 0)
    radio.exchange([(lost.address, lost.drive(0, 0, NO_LOAD))])
    assert home_axes(radio, DRIVE, 1).state is NodeState.READY
    radio.close()


def test_a_hello_that_replaces_the_offer_costs_a_handshake_and_no_more(tmp_path: Path) -> None:
    radio = opened(tmp_path, "unhomed=1")
    node, exchange = radio.nodes[0], radio.exchange
    recorded = [encode_hello(HelloFrame(1, nonce << 8, 5, 0, 1000), node.identity.node_key) for nonce in (1, 2)]

    def meddle(sent):
        if kind_of(sent[0][1]) is FrameKind.DRIVE and recorded:
            node.receive(radio.now_us() // 1000, recorded.pop())
        return exchange(sent)

    radio.exchange = meddle
    assert home_axes(radio, DRIVE, 1).state is NodeState.READY
    assert not recorded
    radio.close()


def test_a_stop_before_a_homing_that_must_ask_again_outlives_it(tmp_path: Path) -> None:
    radio = opened(tmp_path, "unhomed=1")
    node, exchange = radio.nodes[0], radio.exchange
    hello = encode_hello(HelloFrame(1, 1 << 8, 5, 0, 1000), node.identity.node_key)
    strange = [hello, encode_stop(StopFrame(0), node.identity.site.stop_key)]

    def meddle(sent):
        while kind_of(sent[0][1]) is FrameKind.DRIVE and strange:
            node.receive(radio.now_us() // 1000, strange.pop())
        return exchange(sent)

    radio.exchange = meddle
    with pytest.raises(Halted) as caught:
        home_axes(radio, DRIVE, 1)
    assert caught.value.halt.cause is Cause.STOPPED
    assert node.memory.homing == 0
    radio.close()
