"""The host's state machine: its phases, its requests, and every reason it has to stop."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import pytest

from curveline.errors import InvalidInput
from curveline.radio.host.actions import Phase, Policy, Poll, Send, Write
from curveline.radio.host.conductor import Conductor
from curveline.radio.host.peer import Peer
from curveline.radio.host.stop_causes import Cause, Halt, fault_halt
from curveline.radio.mock.air import Heard, Weather
from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import PlantFault
from curveline.radio.node.state import NOWHERE, Identity, Memory
from curveline.radio.protocol import codes, frames
from curveline.radio.protocol.codes import Fault, FrameKind, NodeState
from curveline.radio.protocol.envelope import kind_of
from curveline.radio.protocol.frames import DriveFrame, HelloFrame, StopFrame
from curveline.radio.protocol.keys import Site
from curveline.radio.protocol.motion import AxisLimits, plan_move

from .bench import POSES, Bench, make_plan, target


def halted(bench: Bench, cause: Cause, node: int = 0) -> Halt:
    """Run to the end and check why it came."""
    assert bench.run() is Phase.HALTED
    halt = bench.conductor.halt
    assert halt is not None
    assert (halt.cause, halt.node) == (cause, node), halt.message
    assert "{" not in halt.message + halt.hint
    if bench.records and bench.records[-1]["type"] == "halt":
        assert bench.records[-1]["cause"] == cause.name.lower()
        assert bench.records[-1]["message"] == halt.message
    return halt


def at_rest(bench: Bench) -> None:
    """All nodes stand still, and stay where they are when no more is said to them."""
    for node in bench.nodes:
        node.advance(bench.now_ms)
    assert all(node.move is None for node in bench.nodes)


def moving(plan_seconds: float = 1.5) -> Bench:
    """A bench in the middle of step 1."""
    bench = Bench(make_plan(seconds=plan_seconds))
    bench.run_to(Phase.RELEASED, 1)
    bench.run_for(300)
    assert any(node.move is not None for node in bench.nodes)
    return bench


def silence(bench: Bench, node: int, until_ms: int = 10**9) -> None:
    """From now on nothing goes to or comes from `node`, until some moment."""

    def jam(send: Send) -> None:
        bench.air.weather = Weather(loss=float(send.node == node and bench.now_ms < until_ms))

    bench.hooks.append(jam)


# The straight road


def test_a_run_goes_from_barrier_to_barrier_and_writes_before_it_speaks() -> None:
    bench = Bench(make_plan())
    seen: list[tuple[int, int]] = []

    def watch(send: Send) -> None:
        frame = frames.decode_drive(
            send.payload, bench.conductor.peers[send.node - 1].key, codes.clock_of(bench.now_ms)
        )
        if isinstance(frame, DriveFrame):
            released = [record["step"] for record in bench.records if record["type"] == "release"]
            assert frame.release <= max(released, default=0)
            seen.append((frame.release, frame.load_step))

    bench.hooks.append(watch)
    assert bench.run() is Phase.DONE
    kinds = [(record["type"], record.get("step")) for record in bench.records]
    assert kinds == [
        ("start", None),
        *((kind, step) for step in (1, 2, 3) for kind in ("release", "barrier")),
        ("end", None),
    ]
    assert (0, 1) in seen
    assert (1, 2) in seen, "the next step is staged while one is being done"
    assert bench.positions() == [target(POSES[-1]).counts] * 2
    assert [node.state for node in bench.nodes] == [NodeState.READY] * 2
    for node in bench.nodes:
        node.advance(10**7)
        assert node.state is NodeState.READY, "a session that was given back leaves no dead-man behind"


def test_the_start_record_says_all_that_a_resume_needs() -> None:
    bench = Bench(make_plan())
    bench.run()
    start = bench.records[0]
    assert start["run"] == f"{bench.conductor.run_tag:016x}"
    assert start["boots"] == [1, 1]
    assert len(start["sessions"]) == 2
    assert start["steps"][0] == ((1, target(POSES[0]).counts, 1500),) * 2
    assert start["start"] == [(0, 0, 0)] * 2
    assert bench.records[-1]["finished"] == [3, 3]


def test_a_plan_without_steps_is_done_at_once() -> None:
    bench = Bench(make_plan(poses=()))
    assert bench.run() is Phase.DONE
    assert [record["type"] for record in bench.records] == ["start", "end"]


def test_the_run_tag_depends_on_what_the_nodes_will_do() -> None:
    plan = make_plan()
    site = Bench(plan).site
    tag = Conductor(plan, site, 0).run_tag
    assert Conductor(make_plan(), site, 0).run_tag == tag
    assert Conductor(make_plan(seconds=2.0), site, 0).run_tag != tag
    assert Conductor(make_plan(poses=POSES[:2]), site, 0).run_tag != tag


def test_steps_longer_than_the_field_are_sent_as_its_largest_value() -> None:
    bench = Bench(make_plan(poses=[(1.0, 0.0, 0.0)], seconds=100.0))
    assert bench.run() is Phase.DONE
    assert bench.nodes[0].memory.move_ms == codes.MOVE_MS_LIMIT


# Refused before the radio speaks


def test_a_plan_for_another_number_of_nodes_is_refused() -> None:
    with pytest.raises(InvalidInput, match="2 nodes, but the radio reaches 3"):
        Conductor(make_plan(2), Bench(make_plan(3)).site, 0)


@pytest.mark.parametrize("pose", [(0.0, 80.0, 0.0), (1500.0, 0.0, 0.0), (0.0, 0.0, -221.0)])
def test_a_plan_that_leaves_the_limits_is_refused(pose: tuple[float, float, float]) -> None:
    with pytest.raises(InvalidInput, match="step 2 takes node 1 out of its limits"):
        Bench(make_plan(poses=[POSES[0], pose]))


def test_a_plan_that_leaves_a_node_out_is_refused() -> None:
    plan = make_plan()
    short = replace(plan.steps[1], targets=plan.steps[1].targets[:1])
    for broken in (replace(plan, steps=(plan.steps[0], short)), replace(plan, start=plan.start[:1])):
        with pytest.raises(InvalidInput, match="every one of the 2 nodes"):
            Bench(broken)


# Refused before anything moves


def refused(bench: Bench, cause: Cause, node: int) -> Halt:
    halt = halted(bench, cause, node)
    assert all(node.memory.started == 0 for node in bench.nodes)
    assert not any(record["type"] in ("start", "release") for record in bench.records)
    return halt


def test_a_node_that_is_off() -> None:
    bench = Bench(make_plan())
    silence(bench, 2)
    halt = refused(bench, Cause.SILENT, 2)
    assert "status" in halt.hint
    assert bench.now_ms < 8000


def test_a_node_with_another_key() -> None:
    bench = Bench(make_plan())
    foreign = Identity(1, Site(b"another master k", bench.site.chips))
    bench.antennas[0].node = NodeMachine(foreign, bench.axes, bench.plants[0], Memory())
    refused(bench, Cause.UNTRUSTED, 1)


def test_a_node_with_another_chip() -> None:
    """The key belongs to the chip: another device with the site's key answers under another one."""
    bench = Bench(make_plan())
    other = Identity(2, Site(bench.site.master, (bench.site.chips[0], 0xDEAD)))
    bench.antennas[1].node = NodeMachine(other, bench.axes, bench.plants[1], Memory())
    refused(bench, Cause.UNTRUSTED, 2)


def test_a_node_with_other_settings() -> None:
    bench = Bench(make_plan())
    slow = AxisLimits(-1000, 1000, 500, 500)
    other = NodeMachine(Identity(2, bench.site), (slow, slow, slow), bench.plants[1], Memory())
    bench.antennas[1].node = bench.nodes[1] = other
    refused(bench, Cause.CONFIG, 2)


def test_a_node_with_another_firmware(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(make_plan())
    monkeypatch.setattr("curveline.radio.node.machine.VERSION", 3)
    halt = refused(bench, Cause.VERSION, 1)
    assert "it has 3, this release needs 2" in halt.message


def test_a_node_that_another_host_is_driving() -> None:
    bench = Bench(make_plan(seconds=5.0))
    bench.run_to(Phase.RELEASED, 1)
    other = Conductor(bench.plan, bench.site, 0x99FF00)
    first, bench.conductor = bench.conductor, other

    def keep_first_alive(send: Send) -> None:
        for peer in first.peers:
            if bench.now_ms >= peer.due_ms:
                node = bench.nodes[peer.number - 1]
                node.receive(bench.now_ms, peer.drive(1, 0, (0, (0, 0, 0), 0)))
                peer.take(node.ack)
                peer.due_ms = bench.now_ms + 20

    bench.hooks.append(keep_first_alive)
    halted(bench, Cause.BUSY, 1)
    assert all(node._session.counter == peer.counter for node, peer in zip(bench.nodes, first.peers, strict=True))


def test_a_node_that_offers_a_session_and_then_does_not_keep_it(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(make_plan())
    monkeypatch.setattr(bench.nodes[1], "_session_of", lambda payload: None)
    refused(bench, Cause.TAKEN, 2)


def test_a_node_that_does_not_come_to_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(make_plan())
    monkeypatch.setattr(bench.plants[0], "settles_ms", lambda: None)
    bench.nodes[0].move = plan_move((0, 0, 0), (100, 0, 0), bench.axes, 0)
    refused(bench, Cause.BUSY, 1)


def test_takeover_claims_idle_nodes_and_fences_the_first_host_off() -> None:
    bench = Bench(make_plan(poses=[POSES[0], POSES[0]]))
    bench.run_to(Phase.STAGING, 2)
    first = bench.conductor
    plan = replace(make_plan(), start=(target(POSES[0]),) * 2)
    bench.conductor = Conductor(plan, bench.site, 0x99FF00, Policy(takeover=True))
    bench.run_to(Phase.RELEASED, 1)
    second, bench.conductor = bench.conductor, first
    bench.records.clear()
    while first.phase is not Phase.HALTED:
        for conductor in (first, second):
            bench.conductor = conductor
            bench.turn()
    assert first.halt is not None
    assert first.halt.cause is Cause.TAKEN
    bench.conductor = second
    assert bench.run() is Phase.DONE


@pytest.mark.parametrize(
    ("memory", "cause"),
    [
        (Memory(unhomed=NOWHERE), Cause.NOT_HOMED),
        (Memory(unhomed=NOWHERE, homing=2), Cause.NOT_HOMED),
        (Memory(estop=True), Cause.LATCHED),
        (Memory(fault=Fault.STALL, fault_axis=2), Cause.STALL),
        (Memory(fault=Fault.ENCODER, fault_axis=1), Cause.LOST),
        (Memory(fault=Fault.BROWN_OUT), Cause.BROWN_OUT),
        (Memory(fault=Fault.RUNAWAY, fault_axis=1), Cause.RUNAWAY),
        (Memory(fault=Fault.DRIVER), Cause.DRIVER),
    ],
)
def test_a_node_that_is_not_fit_to_move(memory: Memory, cause: Cause) -> None:
    bench = Bench(make_plan())
    bench.nodes[1] = bench.antennas[1].node = bench.new_node(1, memory)
    halt = refused(bench, cause, 2)
    assert "step" not in halt.message
    assert bench.nodes[0].state is NodeState.READY, "nodes that are well are given back as they were"


def test_faults_can_be_cleared_on_request() -> None:
    bench = Bench(make_plan(), policy=Policy(clear_faults=True))
    bench.nodes[1] = bench.antennas[1].node = bench.new_node(1, Memory(fault=Fault.STALL, fault_axis=2))
    assert bench.run() is Phase.DONE


def test_a_display_that_stands_elsewhere() -> None:
    plan = make_plan()
    bench = Bench(replace(plan, start=(plan.start[0], target((0.0, 5.0, 0.0)))))
    bench.plants[1]._home = (0, 0, 0)
    halt = refused(bench, Cause.ELSEWHERE, 2)
    assert "bias 0.00 instead of 5.0" in halt.message
    assert "send the shape" in halt.hint


def test_a_few_counts_off_are_no_reason_to_refuse() -> None:
    for off, phase in ((28, Phase.DONE), (40, Phase.HALTED)):
        bench = Bench(make_plan())
        bench.plants[0]._home = (off, 0, -off)
        assert bench.run() is phase


# Stopped on the way


def test_a_node_that_falls_silent_for_good() -> None:
    bench = moving()
    silence(bench, 2)
    halt = halted(bench, Cause.SILENT, 2)
    assert "for 6.0 s" in halt.message
    assert bench.nodes[0].state is NodeState.HOLD
    bench.nodes[1].advance(bench.now_ms)
    assert bench.nodes[1].memory.finished <= 1
    assert bench.nodes[1].move is None
    assert bench.nodes[0].memory.started == 1, "nobody goes on without the lost node"


def test_nobody_answers_at_all() -> None:
    bench = Bench(make_plan(), Weather(1.0))
    halt = refused(bench, Cause.DEAF, 0)
    assert "channel" in halt.hint


def test_all_fall_silent_at_once() -> None:
    """No single node is blamed for a jammed channel."""
    bench = moving()
    bench.air.weather = Weather(1.0)
    halt = halted(bench, Cause.DEAF)
    assert "no node answers any more, for 6." in halt.message
    assert all(peer.gone for peer in bench.conductor.peers)
    at_rest(bench)


def test_the_last_but_one_to_fall_silent_is_not_everybody() -> None:
    bench = moving(20.0)
    silence(bench, 2)
    bench.run_for(4000)
    bench.air.weather = Weather(1.0)
    bench.hooks.clear()
    halted(bench, Cause.DEAF)
    bench = moving(20.0)
    silence(bench, 1)
    bench.run_for(5500)
    bench.air.weather = Weather(1.0)
    bench.hooks.clear()
    halted(bench, Cause.SILENT, 1)


@pytest.mark.parametrize("away_ms", [500, 3000, 400_000])
def test_a_host_that_was_suspended(away_ms: int) -> None:
    bench = moving(5.0)
    bench.now_us += 1000 * away_ms
    if away_ms < 1000:
        assert bench.run() is Phase.DONE
        return
    halt = halted(bench, Cause.SUSPENDED)
    assert f"in step 1 (for {away_ms / 1000:.0f}." in halt.message
    assert "as if suspended" in halt.message
    at_rest(bench)
    assert {node.memory.finished for node in bench.nodes} == {0}


def test_a_host_that_was_suspended_during_a_pause_has_missed_nothing() -> None:
    bench = moving(5.0)
    bench.conductor.hold(bench.now_ms)
    bench.run_to(Phase.PAUSED)
    bench.now_us += 400_000_000
    bench.run_for(500)
    bench.conductor.resume(bench.now_ms)
    assert bench.run() is Phase.DONE


def test_a_disk_that_takes_seconds_is_named() -> None:
    bench = Bench(make_plan())
    bench.run_to(Phase.RELEASED, 1)
    while not isinstance(bench.conductor.next(bench.now_ms), Write):
        bench.turn()
    bench.now_us += 2_500_000
    bench.conductor.written(bench.now_ms)
    assert "for 2.5 s, while a record was being stored" in halted(bench, Cause.SUSPENDED).message
    assert bench.conductor.barrier == 1


def test_a_short_silence_is_forgiven() -> None:
    bench = moving()
    weather = bench.air.weather
    bench.air.weather = Weather(loss=1.0)
    bench.run_for(600)
    bench.air.weather = weather
    assert bench.run() is Phase.DONE
    assert bench.conductor.peers[0].tally.lost > 5


def test_a_silence_beyond_the_dead_man_holds_and_is_not_forgotten() -> None:
    bench = moving(5.0)
    silence(bench, 2, until_ms=2500)
    halt = halted(bench, Cause.HELD, 2)
    assert "step 1" in halt.message
    at_rest(bench)


def test_a_restart() -> None:
    bench = moving()
    bench.reboot(1)
    halt = halted(bench, Cause.REBOOT, 2)
    assert "boot number 2 instead of 1" in halt.message
    assert bench.now_ms < 2000
    at_rest(bench)


def test_a_late_node() -> None:
    bench = Bench(make_plan(seconds=0.8), paces=iter([(1000, 1000, 1000), (200, 1000, 1000)]).__next__)
    halt = halted(bench, Cause.DEADLINE, 2)
    assert "its extrude has" in halt.message
    assert 2000 < bench.now_ms < 3500
    at_rest(bench)


def test_a_late_node_is_not_late_because_of_a_pause() -> None:
    bench = Bench(make_plan(seconds=0.8))
    bench.run_to(Phase.RELEASED, 1)
    bench.run_for(200)
    bench.conductor.hold(bench.now_ms)
    bench.run_to(Phase.PAUSED)
    bench.run_for(20_000)
    bench.conductor.resume(bench.now_ms)
    assert bench.run() is Phase.DONE


def test_a_node_that_does_not_set_off(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(make_plan())
    monkeypatch.setattr(bench.nodes[0], "_start", lambda session: None)
    assert "it has not set off" in halted(bench, Cause.DEADLINE, 1).message


def test_a_pause_does_not_forget_how_late_a_node_was() -> None:
    bench = Bench(make_plan(seconds=0.8), paces=iter([(1000, 1000, 1000), (200, 1000, 1000)]).__next__)
    bench.run_to(Phase.RELEASED, 1)
    bench.run_for(1800)
    bench.conductor.hold(bench.now_ms)
    bench.run_to(Phase.PAUSED)
    bench.conductor.resume(bench.now_ms)
    resumed_ms = bench.now_ms
    bench.run_to(Phase.HALTING)
    assert bench.now_ms - resumed_ms < 700
    halted(bench, Cause.DEADLINE, 2)


def test_a_node_that_does_not_take_its_target() -> None:
    bench = Bench(make_plan())
    bench.conductor._loads = (((0, (0, 0, 0), 0),) * 2,)
    halt = halted(bench, Cause.DEADLINE, 1)
    assert "has not taken its target" in halt.message


@pytest.mark.parametrize(
    ("fault", "cause"),
    [
        (Fault.STALL, Cause.STALL),
        (Fault.RUNAWAY, Cause.RUNAWAY),
        (Fault.DRIVER, Cause.DRIVER),
        (Fault.ENCODER, Cause.LOST),
        (Fault.BROWN_OUT, Cause.BROWN_OUT),
    ],
)
def test_a_fault_of_a_motor(fault: Fault, cause: Cause, monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(make_plan())
    bench.run_to(Phase.RELEASED, 1)
    monkeypatch.setattr(bench.plants[0], "fault", lambda: PlantFault(300, fault, 3))
    halt = halted(bench, cause, 1)
    assert "in step 1" in halt.message
    assert "translate" in halt.message
    at_rest(bench)
    assert bench.nodes[1].state is NodeState.HOLD


@pytest.mark.parametrize(("load", "cause"), [((1, (5, 5, 5), 0), Cause.CONFLICT), ((2, (10**6, 0, 0), 0), Cause.LIMIT)])
def test_a_target_that_the_node_refuses(load: tuple[int, codes.Counts, int], cause: Cause) -> None:
    bench = Bench(make_plan())
    bench.run_to(Phase.STAGING, 1)
    if cause is Cause.LIMIT:
        bench.run_to(Phase.RELEASED, 1)
        bench.run(lambda: bench.conductor.peers[0].started == 1)
    else:
        bench.run(lambda: bench.nodes[0].memory.staged == 1)
    peer = bench.conductor.peers[0]
    bench.nodes[0].receive(bench.now_ms, peer.drive(bench.conductor.released, 0, load))
    halted(bench, cause, 1)


def test_a_stop_that_somebody_else_sent() -> None:
    bench = moving()
    bench.nodes[1].receive(bench.now_ms, frames.encode_stop(StopFrame(0), bench.site.stop_key))
    halted(bench, Cause.STOPPED, 2)


def test_a_node_ahead_of_the_record() -> None:
    bench = moving()
    bench.nodes[0].memory.started = 7
    halt = halted(bench, Cause.AHEAD, 1)
    assert "step 7" in halt.message


def test_a_session_worn_out_by_pauses() -> None:
    bench = moving(50.0)
    bench.conductor._hold_gen = codes.HOLD_END - 2
    bench.conductor.hold(bench.now_ms)
    bench.run_to(Phase.PAUSED)
    bench.conductor.resume(bench.now_ms)
    halted(bench, Cause.WORN)


@pytest.mark.parametrize("kind", ["start", "release", "barrier", "pause", "end"])
def test_a_record_that_cannot_be_written_releases_nothing(kind: str) -> None:
    bench = Bench(make_plan())
    if kind == "pause":
        bench.conductor.pause()
    while True:
        action = bench.conductor.next(bench.now_ms)
        if isinstance(action, Write) and action.record["type"] == kind:
            break
        bench.turn()
    released = bench.conductor.released
    bench.write_error = "No space left on device"
    halt = halted(bench, Cause.JOURNAL)
    assert "No space left on device" in halt.message
    assert bench.conductor.released == released
    assert max(node.memory.started for node in bench.nodes) <= released
    at_rest(bench)


# What the operator asks for


@pytest.mark.parametrize("moment_ms", [0, 3, 50, 400, 1200])
def test_a_pause_waits_for_the_barrier(moment_ms: int) -> None:
    bench = Bench(make_plan())
    bench.run_for(moment_ms)
    bench.conductor.pause()
    bench.run_to(Phase.PAUSED)
    assert len({node.memory.finished for node in bench.nodes}) == 1
    assert {node.memory.started - node.memory.finished for node in bench.nodes} == {0}
    assert {node.state for node in bench.nodes} == {NodeState.HOLD}
    assert bench.records[-1]["type"] == "pause"
    assert bench.run(lambda: bench.now_ms > 5000) is Phase.PAUSED
    bench.conductor.resume(bench.now_ms)
    assert bench.run() is Phase.DONE


def test_a_pause_can_be_taken_back() -> None:
    bench = moving()
    bench.conductor.pause()
    bench.conductor.resume(bench.now_ms)
    assert bench.run() is Phase.DONE
    assert not any(record["type"] == "pause" for record in bench.records)


def test_a_hold_stops_everybody_at_once_and_resumes() -> None:
    bench = moving(5.0)
    asked_ms = bench.now_ms
    bench.conductor.hold(asked_ms)
    action = bench.conductor.next(asked_ms)
    assert isinstance(action, Poll), "the first hold frame leaves at once"
    bench.run_to(Phase.PAUSED)
    assert bench.now_ms - asked_ms < 400
    at_rest(bench)
    assert {node.memory.finished for node in bench.nodes} == {0}
    bench.conductor.resume(bench.now_ms)
    assert bench.run() is Phase.DONE


def test_a_hold_while_a_release_is_being_written_takes_it_back() -> None:
    """The record may be on disk already; a second one of the same step says the same."""
    bench = Bench(make_plan())
    while True:
        action = bench.conductor.next(bench.now_ms)
        if isinstance(action, Write) and action.record["type"] == "release":
            break
        bench.turn()
    bench.records.append(dict(action.record))
    bench.conductor.hold(bench.now_ms)
    bench.conductor.written(bench.now_ms)
    bench.run_to(Phase.PAUSED)
    assert bench.conductor.released == 0
    bench.conductor.resume(bench.now_ms)
    bench.run_to(Phase.RELEASED)
    assert [record["type"] for record in bench.records].count("release") == 2
    bench.now_us += 3_000_000
    bench.new_host()
    assert bench.run() is Phase.DONE


def test_a_radio_that_was_away_for_long_needs_another_session() -> None:
    """While nodes are being found, from the beginning; later from where the run was."""
    bench = Bench(make_plan())
    assert bench.conductor.successor(1000, 0x5500) is None
    for _ in range(2):
        bench.turn()
        bench.now_us += 4_000_000
        successor = bench.conductor.successor(4000, 0x5500 + bench.now_us << 8)
        assert successor is not None
        bench.conductor = successor
    bench.run_to(Phase.RELEASED, 2)
    bench.run_for(200)
    assert bench.conductor.successor(900, 0x6600) is None
    for nonce in (0x7700, 0x8800):
        bench.now_us += 20_000_000
        successor = bench.conductor.successor(20_000, nonce)
        assert successor is not None
        bench.conductor = successor
        bench.run_for(5)
    assert bench.run() is Phase.DONE
    assert [record["type"] for record in bench.records].count("resume") == 1
    assert bench.conductor.successor(20_000, 0x9900) is None


def test_a_hold_during_a_pause_changes_nothing() -> None:
    bench = moving()
    bench.conductor.hold(bench.now_ms)
    bench.run_to(Phase.PAUSED)
    bench.conductor.hold(bench.now_ms)
    assert bench.conductor.phase is Phase.PAUSED


def test_a_hold_before_anything_has_moved_is_a_pause() -> None:
    bench = Bench(make_plan())
    bench.conductor.hold(0)
    bench.run_to(Phase.PAUSED)
    assert bench.conductor.barrier == 0


@pytest.mark.parametrize("loss", [0.0, 0.5])
def test_an_emergency_stop_reaches_everybody(loss: float) -> None:
    bench = Bench(make_plan(seconds=5.0))
    bench.run_to(Phase.RELEASED, 1)
    bench.run_for(300)
    bench.air.weather = Weather(loss)
    bench.conductor.estop(bench.now_ms)
    halted(bench, Cause.ESTOP)
    assert {node.state for node in bench.nodes} == {NodeState.ESTOP}


def test_a_node_that_obeys_somebody_else_is_not_called_late() -> None:
    """Its step is over before it has been strange for long enough; what it answers says why nevertheless."""
    bench = Bench(make_plan(poses=[(0.1, 0.0, 0.0)], seconds=0.3), policy=Policy(slack_ms=0))
    bench.run_to(Phase.STAGING, 1)
    taken, first = bench.nodes[1], bench.conductor
    other = Peer(2, bench.plan.drive.addresses[1], bench.site.node_key(2), 0xAA00)
    taken.receive(bench.now_ms, other.hello(replace(first._hello, nonce=0)))
    ident = other.take(taken.ack)
    assert isinstance(ident, frames.IdentFrame)
    other.accept(ident, first.run_tag)

    def keep(send: Send) -> None:
        if first.released:
            taken.receive(bench.now_ms, other.drive(0, 0, (0, (0, 0, 0), 0)))

    bench.hooks.append(keep)
    halt = halted(bench, Cause.TAKEN, 2)
    assert halt.step == 1
    assert taken.memory.started == 0


def test_an_emergency_stop_reaches_a_node_that_another_host_has_taken() -> None:
    """Under a session that is no more nothing reaches it; a stop broadcast does."""
    bench = moving(9.0)
    taken = bench.nodes[1]
    other = Peer(2, bench.plan.drive.addresses[1], bench.site.node_key(2), 0xAA00)
    hello = replace(bench.conductor._hello, nonce=0)
    bench.run_for(2000)
    taken.advance(bench.now_ms)
    taken._session.heard_ms -= 5000  # type: ignore[union-attr]
    taken.receive(bench.now_ms, other.hello(hello))
    ident = other.take(taken.ack)
    assert isinstance(ident, frames.IdentFrame)
    other.accept(ident, bench.conductor.run_tag)
    taken.receive(bench.now_ms, other.drive(1, 0, (1, target(POSES[0]).counts, 9000)))
    taken.receive(bench.now_ms + 1, other.drive(1, 0, (1, target(POSES[0]).counts, 9000)))
    bench.conductor.estop(bench.now_ms)
    bench.run()
    assert bench.nodes[0].state is NodeState.ESTOP
    assert taken.state is NodeState.HOLD
    assert taken._stopped


def test_an_emergency_stop_also_while_nodes_are_being_held() -> None:
    bench = moving(5.0)
    bench.reboot(1)
    bench.run_to(Phase.HALTING)
    bench.conductor.estop(bench.now_ms)
    bench.conductor.estop(bench.now_ms)
    halted(bench, Cause.REBOOT, 2)
    assert bench.nodes[0].state is NodeState.ESTOP


def test_an_emergency_stop_before_any_node_is_claimed_touches_none() -> None:
    bench = Bench(make_plan())
    bench.turn()
    bench.conductor.estop(bench.now_ms)
    polls = bench.polls
    halted(bench, Cause.UNTAKEN)
    assert bench.polls == polls
    bench.conductor.estop(bench.now_ms)
    bench.conductor.fail(bench.now_ms, Halt(Cause.SILENT, 1))
    assert bench.conductor.halt == Halt(Cause.UNTAKEN, step=1)


# Messages


def test_every_cause_reads_well() -> None:
    for cause in Cause:
        halt = Halt(cause, 3, 4, "detail")
        for text in (halt.message, halt.hint):
            assert text
            assert "{" not in text
        assert "None" not in halt.message
    assert len({cause.text for cause in Cause}) == len(Cause)


def test_every_fault_has_its_cause() -> None:
    for fault in set(Fault) - {Fault.NONE}:
        assert "node 1" in fault_halt(fault, 0, 1, 2).message
        assert "bias" in fault_halt(fault, 2, 1, 2).message or fault is Fault.CONFLICT


# Strangers, and stops, while nodes are being taken over


def test_a_hello_that_replaces_an_offer_costs_a_handshake_and_no_more() -> None:
    """Somebody sends a recorded HELLO each time that the host has an offer and has not taken it up yet."""
    bench = Bench(make_plan())
    other = [frames.encode_hello(HelloFrame(1, nonce << 8, 5, 0, 1000), bench.site.node_key(1)) for nonce in (1, 2, 3)]

    def meddle(send: Send) -> None:
        if bench.conductor.phase is Phase.PREFLIGHT and send.node == 1 and other:
            bench.nodes[0].receive(bench.now_ms, other.pop())

    bench.hooks.append(meddle)
    assert bench.run() is Phase.DONE
    assert not other
    assert bench.nodes[0].memory.offers >= 4


def test_a_restart_before_the_first_step_is_told_as_one() -> None:
    bench = Bench(make_plan())
    bench.run_to(Phase.PREFLIGHT)
    bench.reboot(1)
    halted(bench, Cause.REBOOT, 2)


def test_a_stop_between_offer_and_first_frame_is_not_undone() -> None:
    bench = Bench(make_plan())
    bench.run(lambda: bench.conductor.peers[0].ident is not None and bench.conductor.phase is Phase.DISCOVER)
    for node in bench.nodes:
        node.receive(bench.now_ms, frames.encode_stop(StopFrame(0), bench.site.stop_key))
    assert bench.run() is Phase.HALTED
    assert bench.conductor.halt is not None
    assert bench.conductor.halt.cause is Cause.STOPPED
    assert bench.positions() == [start.counts for start in bench.plan.start]


@pytest.mark.parametrize("phase", [Phase.PAUSED, Phase.DISCOVER, Phase.PREFLIGHT])
def test_a_stop_of_somebody_else_outlives_a_pause_and_a_resume(phase: Phase) -> None:
    bench = moving(5.0)
    bench.conductor.hold(bench.now_ms)
    bench.run_to(Phase.PAUSED)
    if phase is not Phase.PAUSED:
        bench.new_host()
        bench.run_to(Phase.DISCOVER)
        bench.run(lambda: all(peer.ident is not None for peer in bench.conductor.peers[:1]))
        bench.run(lambda: bench.conductor.phase is phase)
    for node in bench.nodes:
        node.receive(bench.now_ms, frames.encode_stop(StopFrame(0), bench.site.stop_key))
    stands = bench.positions()
    if phase is Phase.PAUSED:
        bench.conductor.resume(bench.now_ms)
    assert bench.run() is Phase.HALTED
    assert bench.conductor.halt is not None
    assert bench.conductor.halt.cause is Cause.STOPPED
    assert bench.positions() == stands


def test_old_answers_replayed_do_not_pass_for_a_living_node() -> None:
    """Its frames are jammed, and its last STATUS is sent to the host again and again."""
    bench = moving(5.0)
    recorded = bench.nodes[1].ack
    send = bench.send

    def jammed(action: Send) -> Heard:
        heard = send(action)
        return replace(heard, payload=recorded) if action.node == 2 else heard

    bench.deaf.add(1)
    bench.send = jammed  # type: ignore[method-assign]
    began_ms = bench.now_ms
    halted(bench, Cause.SILENT, 2)
    assert bench.now_ms - began_ms < 8000


def look(bench: Bench, node: int) -> None:
    """Somebody asks for a node's last run, as `was_last_run` does: the first half of a handshake."""
    hello = HelloFrame(node, bench.polls + 1 << 8, 5, 0, 0)
    bench.nodes[node - 1].receive(bench.now_ms, frames.encode_hello(hello, bench.site.node_key(node)))


def before_first_drive(bench: Bench, happens: Callable[[int], object]) -> None:
    """Let something happen to each node right before its host takes up what it offered."""
    waiting = {1, 2}

    def hook(send: Send) -> None:
        if kind_of(send.payload) is FrameKind.DRIVE and send.node in waiting:
            waiting.remove(send.node)
            happens(send.node)

    bench.hooks.append(hook)


def test_nor_does_an_offer_that_was_replaced_after_a_stop_undo_it() -> None:
    bench = Bench(make_plan())

    def stop_and_look(number: int) -> None:
        bench.nodes[number - 1].receive(bench.now_ms, frames.encode_stop(StopFrame(0), bench.site.stop_key))
        look(bench, number)

    before_first_drive(bench, stop_and_look)
    assert bench.run() is Phase.HALTED
    assert bench.conductor.halt is not None
    assert bench.conductor.halt.cause is Cause.STOPPED
    assert bench.positions() == [start.counts for start in bench.plan.start]


def test_a_send_after_a_stop_lifts_it_also_when_its_offer_is_replaced() -> None:
    bench = Bench(make_plan())
    for node in bench.nodes:
        node.receive(0, frames.encode_stop(StopFrame(0), bench.site.stop_key))
    before_first_drive(bench, partial(look, bench))
    assert bench.run() is Phase.DONE


def test_a_stop_between_the_wish_to_pause_and_the_pause_outlives_it() -> None:
    bench = moving(5.0)
    bench.conductor.hold(bench.now_ms)
    for node in bench.nodes:
        node.receive(bench.now_ms, frames.encode_stop(StopFrame(0), bench.site.stop_key))
    bench.run_to(Phase.PAUSED)
    bench.conductor.resume(bench.now_ms)
    assert bench.run() is Phase.HALTED
    assert bench.conductor.halt is not None
    assert bench.conductor.halt.cause is Cause.STOPPED


def test_a_node_that_another_host_took_meanwhile_is_not_taken_back() -> None:
    bench = Bench(make_plan(seconds=5.0))
    bench.run(lambda: bench.conductor.phase is Phase.PREFLIGHT)
    late, bench.conductor = bench.conductor, Conductor(bench.plan, bench.site, 0x99FF00)
    bench.run_to(Phase.STAGING, 1)
    owner, bench.conductor = bench.conductor, late
    for _ in range(200):
        for bench.conductor in (late, owner):
            bench.turn()
    assert owner.halt is None
    assert owner.phase in (Phase.STAGING, Phase.RELEASED)
