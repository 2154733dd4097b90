"""Finding the zeros of a node's axes, by a person's or a host's order, one axis at a time."""

from __future__ import annotations

import pytest

from curveline.radio.node.plant import PlantFault
from curveline.radio.node.state import NOWHERE, Memory
from curveline.radio.protocol import codes, frames
from curveline.radio.protocol.codes import ALL_AXES, NOT_HOMED, Fault, NodeState
from curveline.radio.protocol.frames import EstopFrame, StopFrame

from .single import DEADMAN, FAR, RUN, SITE, Host, keep_alive, make_node

LONG = 60_000
BIAS = 0b010


@pytest.fixture
def host() -> Host:
    """A host that has taken over a node which stands far out and does not know it."""
    host = Host(make_node(Memory(unhomed=NOWHERE), counts=(4000, -800, 2500)))
    host.offer(0)
    host.drive(0)
    return host


def poll(host: Host, start: int, end: int) -> NodeState:
    return keep_alive(host, start, end).state


def test_a_host_orders_it_and_the_axes_end_at_zero(host: Host) -> None:
    assert host.home(10).state is NodeState.HOMING
    assert poll(host, 100, 5000) is NodeState.READY
    assert host.node.plant.positions(5000) == (0, 0, 0)
    assert host.report(5000).axes == (0, 0, 0)


def test_one_axis_alone_leaves_the_others_as_they_are(host: Host) -> None:
    host.home(10, BIAS)
    assert poll(host, 100, 5000) is NodeState.UNHOMED
    assert host.node.plant.positions(5000) == (4000, 0, 2500)
    assert host.report(5000).axes == (NOT_HOMED, 0, NOT_HOMED)
    host.home(5100, ALL_AXES & ~BIAS, order=2)
    assert poll(host, 5200, 9000) is NodeState.READY


def test_an_axis_whose_motor_is_absent_says_so_and_the_others_are_homed(host: Host) -> None:
    host.node.plant.wiring.absent = BIAS
    host.home(10)
    assert poll(host, 100, 5000) is NodeState.UNHOMED
    assert host.report(5000).axes == (0, Fault.ENCODER, 0)
    assert host.report(5000).fault is Fault.NONE, "the node is not in fault: two axes work"


def test_an_order_is_carried_out_once(host: Host) -> None:
    host.home(10, BIAS)
    for moment in range(100, 5000, 100):
        host.home(moment, BIAS)
    assert host.status().state is NodeState.UNHOMED
    assert host.report(5000).axes[1] == 0, "it was not begun again"


def test_an_order_that_could_not_be_carried_out_is_not_spent(host: Host) -> None:
    host.drive(5, hold_gen=1)
    assert host.home(10).state is NodeState.UNHOMED
    host.drive(15, hold_gen=2)
    assert host.home(20).state is NodeState.HOMING


@pytest.mark.parametrize("end", ["silence", "hold", "give back", "stop", "estop"])
def test_whatever_brakes_a_move_ends_homing_too(end: str) -> None:
    host = Host(make_node(Memory(unhomed=NOWHERE), counts=(20_000, 0, 0)))
    host.offer(0)
    host.home(10)
    poll(host, 100, 400)
    if end == "hold":
        host.drive(500, hold_gen=1)
    elif end == "give back":
        host.drive(500, hold_gen=codes.HOLD_END)
    elif end == "stop":
        host.node.receive(500, frames.encode_stop(StopFrame(0), SITE.stop_key))
    elif end == "estop":
        host.counter += 1
        host.node.receive(500, frames.encode_estop(EstopFrame(1, host.session, host.counter), host.key))
    host.node.advance(LONG)
    assert host.node.memory.homing == 0
    assert host.node.memory.unhomed == NOWHERE
    stands = host.node.plant.positions(LONG)
    assert stands == host.node.plant.positions(LONG + DEADMAN)
    assert stands[0] > 0, "it stopped on the way"
    assert host.node.state is (NodeState.ESTOP if end == "estop" else NodeState.UNHOMED)


def test_a_homing_node_is_not_taken_over_while_its_owner_lives(host: Host) -> None:
    host.home(10)
    other = Host(host.node, nonce=0x9900, run=RUN + 1)
    assert other.offer(20).busy
    other.counter += 1
    frame = frames.DriveFrame(0, other.session, other.counter)
    host.node.receive(30, frames.encode_drive(frame, other.key))
    assert host.node.state is NodeState.HOMING
    assert host.drive(40).echo == host.counter


def test_a_run_that_goes_on_is_not_homed(host: Host) -> None:
    running = Host(make_node())
    running.offer(0)
    running.start(0, target=FAR)
    running.drive(10, release=1, hold_gen=1)
    running.node.advance(500)
    running.drive(600, release=1, hold_gen=2, load_step=0)
    keep_alive(running, 700, 8000, release=1, hold_gen=2)
    assert running.home(8100).state is NodeState.READY
    assert running.report(8200).finished == 1


def test_homing_voids_what_was_done_of_a_run_and_a_refused_order_does_not() -> None:
    first = Host(make_node())
    first.offer(0)
    first.start(0)
    keep_alive(first, 100, 2000, release=1)
    node = first.node
    node.receive(2100, frames.encode_stop(StopFrame(0), SITE.stop_key))
    other = Host(node, nonce=0x9900, run=0)
    other.offer(2200)
    other.drive(2200, hold_gen=1)
    other.home(2300)
    assert other.report(2300).finished == 1, "held, it takes no order"
    other.drive(2400, hold_gen=2)
    other.home(2500)
    assert other.report(2600).finished == 0


def test_a_moving_node_cannot_be_homed_and_a_homing_one_not_moved() -> None:
    host = Host(make_node())
    host.offer(0)
    host.start(0, target=FAR)
    host.node.start_homing(50, ALL_AXES)
    assert host.node.state is NodeState.MOVING
    other = Host(make_node(), nonce=0x7700)
    other.node.start_homing(10, ALL_AXES)
    other.offer(20)
    assert other.start(20).started == 0
    assert other.status().state is NodeState.HOMING


def test_a_person_ends_it(host: Host) -> None:
    host.node.start_homing(10, ALL_AXES)
    host.node.stop_homing(200)
    assert host.node.state is NodeState.UNHOMED
    host.node.advance(LONG)
    assert host.node.memory.unhomed == NOWHERE


@pytest.mark.parametrize(("axis", "lost"), [(2, (0, Fault.ENCODER, 0)), (0, (5, 5, 5))])
def test_a_lost_position_is_found_by_homing_what_was_lost(axis: int, lost: tuple[int, int, int]) -> None:
    host = Host(make_node())
    host.node.plant.coming = PlantFault(450, Fault.ENCODER, axis)
    host.offer(0)
    host.start(0, target=FAR)
    keep_alive(host, 100, 3000, release=1)
    host.node.plant.coming = None
    assert host.report(3500).axes == lost
    assert host.report(3500).fault_s == 3
    other = Host(host.node, nonce=0x9900, run=0)
    other.offer(5000)
    other.home(5000, BIAS if axis else ALL_AXES)
    assert poll(other, 5100, 12_000) is NodeState.READY
    assert other.report(12_000).fault is Fault.NONE


def test_homing_forgets_no_fault_that_left_the_position_known() -> None:
    host = Host(make_node(Memory(fault=Fault.STALL, fault_axis=1)))
    host.offer(0)
    host.home(0)
    assert poll(host, 100, 3000) is NodeState.FAULT


def test_a_motor_that_is_absent_is_a_dead_encoder_to_a_step() -> None:
    host = Host(make_node())
    host.node.plant.coming = None
    host.node.plant.wiring.absent = 0b001
    host.offer(0)
    host.start(0, target=FAR)
    host.node.plant.coming = super(type(host.node.plant), host.node.plant).fault()
    keep_alive(host, 100, 3000, release=1)
    status = host.status()
    assert (status.state, status.fault, status.fault_axis) == (NodeState.POSITION_LOST, Fault.ENCODER, 1)


def test_an_order_under_another_session_or_key_is_none(host: Host) -> None:
    frame = frames.HomeFrame(0, host.session + 1, 99, ALL_AXES, 1)
    host.node.receive(10, frames.encode_home(frame, host.key))
    host.node.receive(10, frames.encode_home(frames.HomeFrame(0, host.session, 99, ALL_AXES, 1), bytes(16)))
    assert host.node.memory.homing == 0
    assert host.node.tally.bad_tags == 1


def test_a_person_who_ends_nothing_ends_nothing(host: Host) -> None:
    before = host.node.ack
    host.node.stop_homing(20)
    assert host.node.ack == before
