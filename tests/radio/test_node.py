"""The node's rules, one by one."""

from __future__ import annotations

from dataclasses import replace

import pytest

from curveline.radio.node.machine import NodeMachine
from curveline.radio.node.plant import PlantFault
from curveline.radio.node.state import DEAF_MS, FIRMWARE, FLOOD, NOWHERE, Identity, Memory
from curveline.radio.protocol import codes, frames
from curveline.radio.protocol.codes import Counts, Fault, NodeState, clock_of
from curveline.radio.protocol.frames import DriveFrame, EstopFrame, HelloFrame, ReportFrame, StopFrame
from curveline.radio.protocol.keys import FROM_HOST, OPEN_KEY, tag
from curveline.radio.protocol.motion import NodeMove, config_hash
from curveline.radio.protocol.page_frames import AskFrame, PageFrame, decode_page, encode_ask

from .single import AXES, DEADMAN, FAR, NODE_KEY, RUN, SITE, TARGET, Host, NewsPlant, keep_alive, make_node


@pytest.fixture
def host() -> Host:
    host = Host(make_node())
    host.offer(0)
    host.drive(0)
    return host


# Sessions


def test_a_node_boots_with_nothing_loaded_and_says_who_it_is() -> None:
    node = make_node(Memory(boot=7, noise=0xABC))
    assert node.state is NodeState.BOOT
    node.advance(0)
    assert (node.state, node.ack) == (NodeState.READY, b"")
    ident = Host(node).offer(0)
    assert (ident.node, ident.nonce, ident.session) == (1, frames.NodeNonce(7, 1, 0xABC), 1)
    assert ident.config_hash == config_hash(AXES)
    assert (ident.state, ident.same_run, ident.busy, ident.version) == (NodeState.READY, False, False, 2)


def test_attempts_of_one_handshake_get_the_same_offer_and_another_handshake_another() -> None:
    host = Host(make_node())
    first, again = host.offer(0), host.offer(1)
    assert first == again
    other = Host(host.node, nonce=0x7700).offer(2)
    assert (other.session, other.nonce) != (first.session, first.nonce)


def test_an_offer_alone_changes_nothing(host: Host) -> None:
    other = Host(host.node, nonce=0x9900)
    other.offer(10)
    assert host.drive(20).echo == host.counter
    assert host.start(30).state is NodeState.MOVING


def test_a_new_host_takes_an_idle_node_over_and_the_old_one_is_fenced_off(host: Host) -> None:
    other = Host(host.node, nonce=0x9900, run=RUN + 1)
    assert other.offer(10).busy
    assert other.drive(20).echo == 1
    before = host.node.ack
    stale = DriveFrame(0, host.session, 1000, release=1, load_step=1, target=TARGET)
    host.node.receive(30, frames.encode_drive(stale, host.key))
    assert host.node.ack == before
    assert host.node.memory.staged == 0


def test_a_moving_node_is_not_taken_over_before_its_owner_has_been_silent(host: Host) -> None:
    host.start(0, target=FAR)
    other = Host(host.node, nonce=0x9900, run=RUN + 1)
    other.offer(500)
    other.node.receive(600, frames.encode_drive(DriveFrame(clock_of(600), other.session, 1), other.key))
    assert host.node.state is NodeState.MOVING
    assert host.drive(700, release=1).echo == host.counter
    other.offer(1699)
    other.node.receive(1700, frames.encode_drive(DriveFrame(clock_of(1700), other.session, 1), other.key))
    assert other.status().echo == 1


def test_a_new_hosts_step_waits_for_the_axes_to_rest_and_takes_its_own_time(host: Host) -> None:
    host.start(0, target=FAR)
    other = Host(host.node, nonce=0x9900, run=RUN + 1)
    other.offer(DEADMAN)
    taken = other.drive(DEADMAN + 10, release=1, load_step=1, target=TARGET, move_ms=30_000)
    assert (taken.state, taken.staged, taken.started) == (NodeState.MOVING, 1, 0)
    assert other.drive(DEADMAN + 900, release=1).started == 1
    assert host.node.move is not None
    assert host.node.move.duration_ms == 30_000


def test_nobody_is_obeyed_who_speaks_for_another_node(host: Host) -> None:
    before = host.node.ack
    host.node.receive(5, frames.encode_estop(EstopFrame(2, host.session, 99), host.key))
    host.node.receive(5, frames.encode_hello(replace(host.hello, node=2), NODE_KEY))
    assert host.node.ack == before


def test_old_frames_and_wrong_tags_have_no_effect(host: Host) -> None:
    host.drive(0)
    host.drive(0)
    before, memory = host.node.ack, replace(host.node.memory)
    for counter in (1, 2, host.counter):
        old = DriveFrame(0, host.session, counter, release=5, load_step=1, target=TARGET, hold_gen=3)
        host.node.receive(5, frames.encode_drive(old, host.key))
        host.node.receive(5, frames.encode_estop(EstopFrame(1, host.session, counter), host.key))
    forged = DriveFrame(0, host.session, 99, release=5, load_step=1, target=TARGET, hold_gen=3)
    host.node.receive(5, frames.encode_drive(forged, bytes(16)))
    host.node.receive(5, frames.encode_estop(EstopFrame(1, host.session, 99), bytes(16)))
    host.node.receive(5, frames.encode_hello(host.hello, bytes(16)))
    host.node.receive(5, frames.encode_stop(StopFrame(0), bytes(16)))
    assert (host.node.ack, host.node.memory, host.node.state) == (before, memory, NodeState.READY)
    assert (host.node.tally.old_frames, host.node.tally.bad_tags) == (6, 4)


def test_what_is_no_frame_for_a_node_is_ignored(host: Host) -> None:
    before = host.node.ack
    for payload in (b"", bytes(32), host.node.ack, b"\x25" + bytes(31)):
        host.node.receive(5, payload)
    foreign = DriveFrame(0, host.session + 1, 99)
    host.node.receive(5, frames.encode_drive(foreign, host.key))
    host.node.receive(5, frames.encode_estop(EstopFrame(1, host.session + 1, 99), host.key))
    assert host.node.ack == before


def test_a_session_ends_with_its_counter(host: Host) -> None:
    host.start(0, target=FAR)
    host.counter = codes.COUNTER_END - 2
    assert host.drive(100, release=1).state is NodeState.MOVING
    host.node.receive(200, frames.encode_drive(DriveFrame(clock_of(200), host.session, codes.COUNTER_END), host.key))
    host.node.advance(1000)
    assert host.node.state is NodeState.HOLD_LINK
    assert host.node.memory.finished == 0


def test_giving_a_session_back_leaves_the_node_ready_and_its_last_answer_loaded(host: Host) -> None:
    status = host.drive(10, hold_gen=codes.HOLD_END)
    assert (status.state, status.echo) == (NodeState.READY, host.counter)
    before = host.node.ack
    host.counter += 1
    host.node.receive(20, frames.encode_drive(DriveFrame(0, host.session, host.counter, load_step=1), host.key))
    host.node.advance(10**6)
    assert (host.node.ack, host.node.state) == (before, NodeState.READY)
    assert not Host(host.node, nonce=0x9900).offer(20).busy


def test_giving_a_session_back_stops_a_moving_node_and_lifts_no_hold(host: Host) -> None:
    host.start(0, target=FAR)
    host.drive(500, release=1, hold_gen=codes.HOLD_END)
    host.node.advance(5000)
    assert host.node.state is NodeState.HOLD_LINK
    assert host.node.memory.finished == 0


def test_a_query_tells_everything_and_changes_nothing(host: Host) -> None:
    host.start(0, target=FAR)
    session = host.node._session
    question = HelloFrame(1, 0xABCDEF00, 0, 0, 0, codes.FLAG_QUERY)
    host.node.receive(500, frames.encode_hello(question, NODE_KEY))
    answer = frames.decode_report(host.node.ack, NODE_KEY, question.handshake)
    assert isinstance(answer, ReportFrame)
    assert (answer.boot, answer.state, answer.started) == (1, NodeState.MOVING, 1)
    assert answer.position[0] == pytest.approx(host.node.plant.positions(500)[0], abs=4)
    assert (host.node._session, host.node._pending) == (session, None)
    assert host.drive(510, release=1).echo == host.counter


# Staging, release, motion


def test_anybody_is_told_who_a_node_is_and_that_changes_nothing_else(host: Host) -> None:
    host.start(0)
    node = host.node
    before = (vars(node.memory).copy(), node.state, host.counter)
    for number in (1, codes.EVERY_NODE):
        ask = AskFrame(number, 0x7700)
        node.receive(10, encode_ask(replace(ask, nonce=0x7703)))
        page = decode_page(node.ack, ask.handshake)
        assert page == PageFrame(1, 0xC0FFEE, FIRMWARE, 1, config_hash(AXES), NodeState.MOVING)
    assert (vars(node.memory), node.state, host.counter) == before
    assert host.drive(20, release=1).started == 1, "the session goes on"


def test_a_question_for_somebody_else_or_an_unknown_page_is_not_answered(host: Host) -> None:
    before = host.node.ack
    for ask in (AskFrame(2, 0x7700), AskFrame(1, 0x7700, page=1)):
        host.node.receive(0, encode_ask(ask))
        assert host.node.ack == before
    damaged = bytearray(encode_ask(AskFrame(1, 0x7700)))
    damaged[31] ^= 1
    host.node.receive(0, bytes(damaged))
    assert host.node.ack == before
    assert host.node.tally.bad_tags == 1


def test_a_field_with_no_meaning_is_no_forgery(host: Host) -> None:
    before, body = host.node.ack, bytearray(encode_ask(AskFrame(1, 0x7700))[:24])
    body[3] = 1
    host.node.receive(0, bytes(body) + tag(OPEN_KEY, bytes(body), FROM_HOST))
    assert host.node.ack == before
    assert host.node.tally.bad_tags == 0


def forged(host: Host, number: int) -> bytes:
    frame = DriveFrame(0, host.session, 1000 + number, release=9)
    return frames.encode_drive(frame, bytes(16))


def test_a_flood_of_forgeries_makes_a_node_deaf_for_a_tenth_of_a_second(host: Host) -> None:
    for number in range(FLOOD):
        host.node.receive(5, forged(host, number))
    assert host.drive(5).echo == host.counter, "fifty are borne"
    host.node.receive(6, forged(host, FLOOD))
    assert (host.node.tally.bad_tags, host.node.tally.floods) == (FLOOD + 1, 1)
    heard = host.counter
    assert host.drive(6 + DEAF_MS - 1).echo == heard
    host.node.receive(6 + DEAF_MS - 1, forged(host, 0))
    assert host.node.tally.bad_tags == FLOOD + 1, "nothing is even looked at"
    assert host.drive(6 + DEAF_MS).echo == host.counter


def test_forgeries_spread_over_time_are_borne(host: Host) -> None:
    for number in range(10 * FLOOD):
        host.node.receive(21 * number, forged(host, number))
        host.drive(21 * number)
    assert host.node.tally.floods == 0
    assert host.node.tally.bad_tags == 10 * FLOOD


def test_a_deaf_node_still_falls_silent_and_brakes(host: Host) -> None:
    host.start(0, target=FAR)
    for moment in range(0, DEADMAN + 20, 20):
        for number in range(FLOOD + 1):
            host.node.receive(moment, forged(host, number))
    host.node.advance(DEADMAN + 5000)
    assert host.node.state is NodeState.HOLD_LINK


def test_news_of_the_plant_count_from_the_moment_they_are_told() -> None:
    plant = NewsPlant((0, 0, 0))
    host = Host(NodeMachine(Identity(1, SITE), AXES, plant, Memory()))
    host.offer(0)
    host.start(0)
    for moment in range(0, 5000, 100):
        host.drive(moment, release=1)
    assert host.node.state is NodeState.MOVING, "nobody has said that it has arrived"
    plant.arrived_ms = 4990
    host.node.notice(4995)
    assert host.status().finished == 1


def test_a_step_is_staged_released_and_done_in_order(host: Host) -> None:
    staged = host.drive(0, load_step=1, target=TARGET, move_ms=900)
    assert (staged.staged, staged.started, staged.state) == (1, 0, NodeState.READY)
    moving = host.drive(10, release=1)
    assert (moving.started, moving.finished, moving.state) == (1, 0, NodeState.MOVING)
    host.node.advance(909)
    assert host.status().finished == 0
    host.node.advance(910)
    assert (host.status().finished, host.status().state) == (1, NodeState.READY)
    assert host.node.plant.positions(910) == TARGET


def test_release_is_a_level(host: Host) -> None:
    host.drive(0, release=3)
    host.drive(0, release=0, load_step=1, target=TARGET)
    assert host.status().started == 1


def test_the_next_step_can_be_staged_while_one_is_done_and_starts_only_when_released(host: Host) -> None:
    host.start(0)
    status = host.drive(10, release=1, load_step=2, target=FAR)
    assert (status.staged, status.started) == (2, 1)
    keep_alive(host, 20, 2000, release=1)
    assert host.status().started == 1
    assert host.drive(2001, release=2).started == 2


def test_a_step_released_early_starts_when_the_one_before_is_done(host: Host) -> None:
    host.start(0)
    host.drive(10, release=2, load_step=2, target=FAR)
    assert host.node.memory.started == 1
    status = keep_alive(host, 20, 1500, release=2)
    assert (status.finished, status.started, status.state) == (1, 2, NodeState.MOVING)


def test_steps_already_started_are_not_staged_again(host: Host) -> None:
    host.start(0)
    assert host.drive(10, release=1, load_step=1, target=FAR).fault is Fault.NONE
    assert host.node.memory.target == TARGET


@pytest.mark.parametrize(
    "fields",
    [{"load_step": 1, "target": FAR}, {"load_step": 1, "target": TARGET, "move_ms": 5}, {"load_step": 2}],
)
def test_contradicting_targets_are_a_conflict(host: Host, fields: dict[str, object]) -> None:
    host.drive(0, load_step=1, target=TARGET)
    status = host.drive(1, **fields)
    assert (status.state, status.fault) == (NodeState.FAULT, Fault.CONFLICT)
    assert host.drive(2, release=1).started == 0


def test_the_first_fault_is_the_one_that_is_told(host: Host) -> None:
    assert host.drive(0, load_step=1, target=(AXES[0].high + 1, 0, 0)).fault is Fault.LIMIT
    status = host.drive(1, load_step=2, target=TARGET)
    assert (status.fault, status.fault_axis) == (Fault.LIMIT, 1)


def test_skipping_a_step_is_a_conflict(host: Host) -> None:
    assert host.drive(0, load_step=2, target=TARGET).fault is Fault.CONFLICT


def test_staging_the_same_twice_is_no_conflict(host: Host) -> None:
    for now in range(3):
        assert host.drive(now, load_step=1, target=TARGET).fault is Fault.NONE


@pytest.mark.parametrize(("target", "axis"), [((10**6, 0, 0), 1), ((0, 6000, 0), 2), ((0, 0, -50000), 3)])
def test_targets_out_of_limits_are_refused(host: Host, target: Counts, axis: int) -> None:
    status = host.drive(0, load_step=1, target=target)
    assert (status.fault, status.fault_axis, status.staged) == (Fault.LIMIT, axis, 0)
    assert host.drive(1, release=1).started == 0


def test_an_unhomed_node_does_not_move() -> None:
    host = Host(make_node(Memory(unhomed=NOWHERE)))
    host.offer(0)
    assert host.start(0).state is NodeState.UNHOMED
    assert host.status().started == 0


# Holding


def test_a_hold_slows_down_within_the_limits_and_goes_on_when_lifted(host: Host) -> None:
    host.start(0, target=FAR)
    status = host.drive(900, release=1, hold_gen=1)
    assert (status.state, status.hold_low) == (NodeState.MOVING, 1)
    host.node.advance(1099)
    assert host.node.state is NodeState.MOVING
    host.node.advance(1100)
    stopped = host.node.plant.positions(1100)
    assert host.node.state is NodeState.HOLD
    assert host.drive(1500, release=1, hold_gen=1).position[0] == pytest.approx(stopped[0], abs=4)
    assert host.drive(1600, release=1, hold_gen=2).state is NodeState.MOVING
    keep_alive(host, 1700, 8000, release=1, hold_gen=2)
    assert (host.status().finished, host.node.plant.positions(8000)) == (1, FAR)


def test_a_hold_lifted_while_braking_first_comes_to_rest(host: Host) -> None:
    host.start(0, target=FAR)
    host.drive(900, release=1, hold_gen=1)
    assert host.drive(950, release=1, hold_gen=2).state is NodeState.MOVING
    assert isinstance(host.node.move, NodeMove)
    assert host.node.move.brake_ms is not None
    keep_alive(host, 1000, 8000, release=1, hold_gen=2)
    assert host.node.plant.positions(8000) == FAR


def test_a_held_node_starts_nothing(host: Host) -> None:
    host.drive(0, hold_gen=1)
    assert host.start(10, hold_gen=1).state is NodeState.HOLD
    assert host.status().started == 0
    assert host.drive(20, release=1, hold_gen=0).started == 0, "an old generation must not lift a hold"
    assert host.drive(30, release=1, hold_gen=2).started == 1


def test_a_hold_in_the_last_ramp_lets_the_step_end(host: Host) -> None:
    host.start(0)
    end = host.node.plant.settles_ms()
    host.drive(end - 1, release=1, hold_gen=1)
    host.node.advance(end)
    assert (host.status().finished, host.node.state) == (1, NodeState.HOLD)


def test_silence_holds_exactly_at_the_dead_man_time(host: Host) -> None:
    host.start(0, target=FAR)
    host.node.advance(DEADMAN - 1)
    assert host.node.move.brake_ms is None
    host.node.advance(DEADMAN)
    assert host.node.move.brake_ms == DEADMAN
    host.node.advance(DEADMAN + 200)
    assert host.node.state is NodeState.HOLD_LINK
    here = host.node.plant.positions(DEADMAN + 200)
    assert keep_alive(host, 2000, 5000, release=1).state is NodeState.HOLD_LINK, "hearing the host again is not enough"
    assert host.node.plant.positions(5000) == here
    assert host.drive(5001, release=1, hold_gen=1).state is NodeState.HOLD
    assert host.drive(5002, release=1, hold_gen=2).state is NodeState.MOVING


def test_the_generation_that_lifted_one_hold_does_not_lift_the_next_silence(host: Host) -> None:
    host.start(0, target=FAR)
    host.drive(100, release=1, hold_gen=2)
    assert keep_alive(host, 100 + DEADMAN + 500, 3000, release=1, hold_gen=2).state is NodeState.HOLD_LINK
    assert host.drive(3001, release=1, hold_gen=4).state is NodeState.MOVING


def test_an_idle_node_falls_silent_too(host: Host) -> None:
    host.node.advance(DEADMAN)
    assert host.node.state is NodeState.HOLD_LINK
    assert host.start(DEADMAN + 1).started == 0


def test_a_stop_broadcast_holds_and_the_owner_lifts_it(host: Host) -> None:
    host.start(0, target=FAR)
    host.node.receive(500, frames.encode_stop(StopFrame(0), SITE.stop_key))
    status = keep_alive(host, 600, 1500, release=1)
    assert (status.state, status.hold_low) == (NodeState.HOLD, 0)
    assert host.drive(1600, release=1, hold_gen=2).state is NodeState.HOLD, (
        "that may be the end of a pause it had wished for"
    )
    assert host.drive(1700, release=1, hold_gen=4).state is NodeState.MOVING


def test_a_recorded_stop_cannot_be_worse_than_a_hold() -> None:
    node = make_node()
    node.receive(0, frames.encode_stop(StopFrame(0), SITE.stop_key))
    assert node.state is NodeState.HOLD
    host = Host(node)
    host.offer(1)
    assert host.start(2).started == 1


def test_an_emergency_stop_is_final(host: Host) -> None:
    host.start(0, target=FAR)
    host.counter += 1
    host.node.receive(500, frames.encode_estop(EstopFrame(1, host.session, host.counter), host.key))
    assert host.status().state is NodeState.ESTOP
    assert host.drive(600, release=1, hold_gen=2).state is NodeState.ESTOP
    end = host.node.plant.settles_ms()
    assert end <= 700
    other = Host(host.node, nonce=0x9900, run=RUN + 1, flags=codes.FLAG_CLEAR)
    other.offer(3000)
    assert other.start(3000).started == 0
    host.node.start_homing(4000, codes.ALL_AXES)
    assert host.node.state is NodeState.ESTOP
    assert host.node.plant.positions(9000) == host.node.plant.positions(end)


# Faults


def test_a_fault_of_the_plant_stops_the_node_at_its_own_moment(host: Host) -> None:
    host.node.plant.coming = PlantFault(450, Fault.STALL, 1)
    host.start(0, target=FAR)
    host.node.advance(449)
    assert host.node.state is NodeState.MOVING
    host.node.advance(3000)
    assert host.node.move is None
    status = host.status()
    assert (status.state, status.fault, status.fault_axis, status.finished) == (NodeState.FAULT, Fault.STALL, 1, 0)
    assert host.drive(3001, release=1, hold_gen=2).state is NodeState.FAULT


def test_a_fault_is_cleared_by_a_session_that_says_so(host: Host) -> None:
    host.node.plant.coming = PlantFault(450, Fault.STALL, 1)
    host.start(0, target=FAR)
    host.node.advance(3000)
    host.node.plant.coming = None
    plain = Host(host.node, nonce=0x9900, run=1)
    plain.offer(4000)
    assert plain.drive(4000).state is NodeState.FAULT
    clearing = Host(host.node, nonce=0xAA00, run=1, flags=codes.FLAG_CLEAR)
    clearing.offer(4001)
    assert clearing.drive(4001).state is NodeState.READY


@pytest.mark.parametrize("fault", [Fault.ENCODER, Fault.BROWN_OUT])
def test_a_lost_position_is_cleared_by_homing_only(host: Host, fault: Fault) -> None:
    host.node.plant.coming = PlantFault(450, fault, 2)
    host.start(0, target=FAR)
    host.node.advance(3000)
    host.node.plant.coming = None
    clearing = Host(host.node, nonce=0xAA00, run=1, flags=codes.FLAG_CLEAR)
    clearing.offer(4001)
    assert clearing.drive(4001).state is NodeState.POSITION_LOST
    clearing.drive(4100, hold_gen=codes.HOLD_END)
    host.node.start_homing(5000, codes.ALL_AXES)
    host.node.advance(30_000)
    assert host.node.state in (NodeState.READY, NodeState.HOLD_LINK)
    assert host.node.memory.homed


# Runs


def interrupted(flags: int, run: int) -> Host:
    """A node whose host died in step 1, claimed again."""
    first = Host(make_node())
    first.offer(0)
    first.start(0, target=FAR)
    first.node.advance(5000)
    again = Host(first.node, nonce=0x9900, run=run, flags=flags)
    again.offer(5000)
    again.drive(5001)
    return again


def test_a_new_run_starts_from_nothing() -> None:
    host = interrupted(0, RUN)
    assert (host.status().started, host.status().staged, host.status().state) == (0, 0, NodeState.READY)
    assert host.start(5002).state is NodeState.MOVING


def test_a_resumed_run_stays_held_until_it_is_lifted_and_then_goes_on() -> None:
    host = interrupted(codes.FLAG_RESUME, RUN)
    assert (host.status().started, host.status().finished, host.status().state) == (1, 0, NodeState.HOLD_LINK)
    assert host.drive(5003, release=1).state is NodeState.HOLD_LINK
    assert host.drive(5004, release=1, hold_gen=2).state is NodeState.MOVING
    keep_alive(host, 5100, 12000, release=1, hold_gen=2)
    assert host.status().finished == 1


def test_resuming_another_run_is_a_new_one() -> None:
    assert interrupted(codes.FLAG_RESUME, RUN + 1).status().started == 0


def test_an_offer_says_whether_the_run_is_known() -> None:
    host = interrupted(0, RUN)
    assert Host(host.node, nonce=0xAA00, run=RUN).offer(5002).same_run
    assert not Host(host.node, nonce=0xBB00, run=RUN + 1).offer(5003).same_run


def test_a_new_run_may_be_released_while_the_node_still_brakes_from_the_old_one() -> None:
    first = Host(make_node())
    first.offer(0)
    first.start(0, target=FAR)
    again = Host(first.node, nonce=0x9900, run=RUN + 1)
    again.offer(DEADMAN)
    again.start(DEADMAN + 1, target=TARGET)
    keep_alive(again, DEADMAN + 10, 9000, release=1)
    assert again.status().finished == 1
    assert again.node.plant.positions(9000) == TARGET


def test_a_node_restored_in_the_middle_of_a_step_holds() -> None:
    node = make_node(Memory(started=2, finished=1, staged=2, target=FAR, run_tag=RUN), counts=(5000, 0, 0))
    node.advance(0)
    assert node.state is NodeState.HOLD_LINK
    host = Host(node, flags=codes.FLAG_RESUME)
    host.offer(1)
    assert host.drive(2, release=2).state is NodeState.HOLD_LINK
    assert host.drive(3, release=2, hold_gen=2).state is NodeState.MOVING


def test_the_set_point_is_the_move_and_then_the_position(host: Host) -> None:
    assert host.node.setpoint(0) == (0, 0, 0)
    host.start(0, target=FAR)
    assert host.node.setpoint(700) == host.node.plant.positions(700)
    assert host.node.setpoint(700)[0] > 0
