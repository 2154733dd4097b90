"""The real image finds its zeros, for a person or for a host: axis by axis, and not a moment longer than it may."""

from __future__ import annotations

from pathlib import Path

import pytest

from campaign import only
from curveline.drive_settings import AXES as NAMES
from curveline.radio.host.service import clear_fault, home_axes
from curveline.radio.protocol.codes import Fault, NodeState
from curveline.radio.protocol.frames import StatusFrame

from .display import Rig
from .fleet import AXES
from .hand import Hand
from .image import Image
from .kl26 import RESET_LOW_VOLTAGE
from .machine import NFAULT, Machine

EXTRUDE, BIAS, TRANSLATE = range(3)
ALL = 0b111
BAND = 24
"""Counts from its target within which an axis may rest, see test_node_image.py."""
NOT_HOMED = dict.fromkeys(NAMES, "not homed")
PLACE = 300.5
"""Where translate stands before: to be found is 0."""


@pytest.fixture
def rig(image: Image, tmp_path: Path) -> Rig:
    """A node that has never been homed."""
    return fitted(Rig(image, b"", tmp_path, count=1))


@pytest.fixture
def homed(image: Image, homed_flash: bytes, tmp_path: Path) -> Rig:
    return fitted(Rig(image, homed_flash, tmp_path, count=1))


def fitted(rig: Rig) -> Rig:
    """With a switch and a stop, which a node needs to be homed."""
    rig.machines[0].put_ends_at(
        AXES[TRANSLATE].low * AXES[TRANSLATE].counts_per_unit, -4.0 * AXES[BIAS].counts_per_unit
    )
    return rig


def is_at_zero(machine: Machine, axis: int) -> bool:
    return abs(machine.counts[axis]) <= BAND


def is_at_rest(machine: Machine) -> bool:
    return not any(motor.speed or machine.duty(axis) for axis, motor in enumerate(machine.motors))


# By order of a host


def test_a_host_has_all_axes_homed(rig: Rig) -> None:
    (machine,) = rig.machines
    machine.motors[TRANSLATE].at = PLACE
    hand = Hand(rig.fleet, rig.radio)
    assert hand.status().state is NodeState.UNHOMED
    assert not machine.drivers_on
    hand.home(ALL, order=1)
    assert hand.status().state is NodeState.HOMING
    assert machine.drivers_on
    assert hand.watch().state is NodeState.READY
    assert all(is_at_zero(machine, axis) for axis in range(3))
    rig.fleet.run(1_500_000)
    machine.power_cycle()
    rig.fleet.run(20_000)
    (node,) = rig.status()
    assert (node.state, node.unhomed) == ("ready", {})


def test_an_absent_motor_does_not_keep_the_other_axes_from_their_zeros(rig: Rig) -> None:
    (machine,) = rig.machines
    machine.motors[TRANSLATE].at = PLACE
    machine.unplugged.add(BIAS)
    hand = Hand(rig.fleet, rig.radio)
    hand.status()
    hand.home(ALL, order=1)
    assert hand.watch().state is NodeState.UNHOMED
    assert is_at_zero(machine, TRANSLATE)
    (node,) = rig.status()
    assert (node.state, node.unhomed) == ("unhomed", {"bias": "encoder"})
    rig.fleet.run(1_500_000)
    assert is_at_rest(machine)
    assert not machine.drivers_on


def test_what_was_homed_in_part_is_homed_to_the_end_and_only_then_remembered(rig: Rig) -> None:
    (machine,) = rig.machines
    machine.unplugged.add(BIAS)
    hand = Hand(rig.fleet, rig.radio)
    hand.status()
    hand.home(ALL, order=1)
    hand.watch()
    machine.unplugged.clear()
    before = machine.counts
    hand.home(1 << BIAS, order=2)
    assert hand.status().state is NodeState.HOMING
    assert hand.watch().state is NodeState.READY
    assert is_at_zero(machine, BIAS)
    assert all(abs(machine.counts[axis] - before[axis]) <= 2 for axis in (EXTRUDE, TRANSLATE))
    rig.fleet.run(1_500_000)
    machine.power_cycle()
    rig.fleet.run(20_000)
    assert rig.status()[0].state == "ready"


def test_a_part_of_the_position_does_not_survive_the_power(homed: Rig) -> None:
    (machine,) = homed.machines
    assert homed.status()[0].state == "ready"
    machine.unplugged.add(BIAS)
    hand = Hand(homed.fleet, homed.radio)
    hand.status()
    hand.home(1 << BIAS, order=1)
    assert hand.watch().state is NodeState.UNHOMED
    assert homed.status()[0].unhomed == {"bias": "encoder"}
    homed.fleet.run(1_500_000)
    machine.power_cycle()
    homed.fleet.run(20_000)
    (node,) = homed.status()
    assert (node.state, node.unhomed) == ("unhomed", NOT_HOMED)


def test_an_axis_without_a_switch_is_homed_where_it_is(rig: Rig) -> None:
    (machine,) = rig.machines
    machine.motors[EXTRUDE].at = PLACE
    hand = Hand(rig.fleet, rig.radio)
    hand.status()
    hand.home(1 << EXTRUDE, order=1)
    status = hand.watch(1_000_000)
    assert (status.state, status.position) == (NodeState.UNHOMED, (0, 0, 0))
    assert rig.status()[0].unhomed == {"bias": "not homed", "translate": "not homed"}
    assert machine.counts[EXTRUDE] == int(PLACE)


def test_power_lost_while_a_search_is_on_leaves_the_position_unknown(homed: Rig) -> None:
    (machine,) = homed.machines
    machine.motors[TRANSLATE].at = PLACE
    hand = Hand(homed.fleet, homed.radio)
    hand.status()
    hand.home(1 << TRANSLATE, order=1)
    homed.fleet.run(100_000)
    machine.power_cycle()
    homed.fleet.run(20_000)
    assert homed.status()[0].state == "unhomed"


def test_an_order_is_carried_out_once(rig: Rig) -> None:
    (machine,) = rig.machines
    hand = Hand(rig.fleet, rig.radio)
    hand.status()
    hand.home(1 << TRANSLATE, order=1)
    hand.watch()
    rig.fleet.run(300_000)
    before = machine.counts
    hand.home(1 << TRANSLATE, order=1)
    assert hand.status().state is NodeState.UNHOMED
    rig.fleet.run(300_000)
    assert is_at_rest(machine)
    assert machine.counts == before


@pytest.mark.parametrize("end", ["silence", "hold", "stop", "button", "given back"])
def test_what_ends_a_homing_before_its_time(rig: Rig, end: str) -> None:
    (machine,) = rig.machines
    machine.motors[TRANSLATE].at = 3000.5
    hand = Hand(rig.fleet, rig.radio)
    hand.status()
    hand.home(ALL, order=1)
    rig.fleet.run(300_000)
    assert machine.motors[TRANSLATE].speed < -500
    if end == "silence":
        rig.fleet.run(600_000)
        assert machine.motors[TRANSLATE].speed < -500, "a dead-man time has not passed yet"
        rig.fleet.run(600_000)
    elif end == "button":
        machine.press_button(rig.fleet.run, 100_000)
    elif end == "stop":
        hand.stop()
    else:
        hand.poll(hold=1 if end == "hold" else 254)
    rig.fleet.run(300_000)
    assert is_at_rest(machine)
    (node,) = rig.status()
    assert (node.state, node.unhomed) == ("unhomed", NOT_HOMED)
    assert not machine.drivers_on
    assert machine.counts[TRANSLATE] > 100, "the switch was not reached"


@pytest.mark.campaign
def test_a_lost_position_is_found_with_the_drivers_awake(homed: Rig) -> None:
    (machine,) = homed.machines
    homed.fleet.run(100_000)  # until the supply counts as up
    machine.reset(RESET_LOW_VOLTAGE)
    homed.fleet.run(20_000)
    hand = Hand(homed.fleet, homed.radio)
    assert hand.status().state is NodeState.POSITION_LOST
    hand.home(ALL, order=1)
    status = hand.status()
    assert (status.state, status.fault) == (NodeState.HOMING, Fault.BROWN_OUT)
    assert machine.drivers_on
    status = hand.watch()
    assert (status.state, status.fault) == (NodeState.READY, Fault.NONE)


def test_a_driver_in_trouble_is_the_end_for_all_axes(rig: Rig) -> None:
    (machine,) = rig.machines
    machine.motors[TRANSLATE].at = PLACE
    hand = Hand(rig.fleet, rig.radio)
    hand.status()
    hand.home(1 << BIAS | 1 << TRANSLATE, order=1)
    rig.fleet.run(100_000)
    machine.set_pin(NFAULT, 0)
    assert hand.watch().state is NodeState.UNHOMED
    assert rig.status()[0].unhomed == {"extrude": "not homed", "bias": "driver", "translate": "driver"}
    rig.fleet.run(200_000)
    assert is_at_rest(machine)
    assert not machine.drivers_on


def test_an_axis_that_is_held_up_on_its_way_to_zero_has_a_reason(rig: Rig) -> None:
    (machine,) = rig.machines
    machine.motors[TRANSLATE].at = PLACE
    hand = Hand(rig.fleet, rig.radio)
    hand.status()
    hand.home(1 << EXTRUDE | 1 << TRANSLATE, order=1)
    for way in (-1, 1, -1, 1):  # onto the switch, off it, onto it again, to zero
        while machine.motors[TRANSLATE].speed * way < 300:
            hand.poll()
            rig.fleet.run(20_000)
    machine.motors[TRANSLATE].jam()
    assert hand.watch().state is NodeState.UNHOMED
    assert rig.status()[0].unhomed == {"bias": "not homed", "translate": "stall"}


def test_missed_edges_after_the_zero_was_found_are_not_forgotten(rig: Rig) -> None:
    (machine,) = rig.machines
    hand = Hand(rig.fleet, rig.radio)
    hand.status()
    hand.home(ALL, order=1)
    while machine.motors[BIAS].speed == 0:
        hand.poll()
        rig.fleet.run(20_000)
    shake(rig, TRANSLATE)
    assert hand.watch().state is NodeState.UNHOMED
    assert rig.status()[0].unhomed == {"translate": "encoder"}


@pytest.mark.campaign
def test_missed_edges_of_an_axis_that_is_not_sought_are_a_fault_of_the_next_move(homed: Rig) -> None:
    (machine,) = homed.machines
    hand = Hand(homed.fleet, homed.radio)
    hand.status()
    hand.home(1 << BIAS, order=1)
    homed.fleet.run(100_000)
    shake(homed, TRANSLATE)
    assert hand.watch().state is NodeState.READY
    hand.poll(release=1, load=(1, (500, 0, 0), 0))
    homed.fleet.run(100_000)
    status = hand.status()
    assert (status.state, status.fault, status.fault_axis) == (NodeState.POSITION_LOST, Fault.ENCODER, TRANSLATE + 1)
    assert homed.status()[0].unhomed == {"translate": "encoder"}
    assert abs(machine.counts[EXTRUDE]) < 200
    hand = Hand(homed.fleet, homed.radio, run_tag=0x5678)
    hand.status()
    hand.home(ALL, order=1)
    assert hand.watch().state is NodeState.READY


def test_edges_that_were_missed_at_rest_cost_the_position_over_a_power_cut(homed: Rig) -> None:
    (machine,) = homed.machines
    hand = Hand(homed.fleet, homed.radio)
    hand.status()
    shake(homed, TRANSLATE)
    homed.fleet.run(1_500_000)
    machine.power_cycle()
    homed.fleet.run(20_000)
    assert homed.status()[0].state == "unhomed"


def shake(rig: Rig, axis: int) -> None:
    """Noise, with which the machine's clock runs ahead of the air; let the latter catch up."""
    rig.machines[0].shake_encoder(axis, 12)
    rig.fleet.run(3_000)


# What `curveline node home` and `curveline node clear` do


@pytest.mark.parametrize("loss", [0.3, *only([0.0])])
def test_the_host_program_has_nodes_homed(image: Image, tmp_path: Path, loss: float) -> None:
    rig = fitted(Rig(image, b"", tmp_path, count=1, loss=loss))
    (machine,) = rig.machines
    machine.unplugged.add(BIAS)
    states: list[NodeState] = []
    report = home_axes(rig.radio, rig.plan.drive, 1, ALL, lambda status: states.append(status.state))
    assert NodeState.HOMING in states
    assert (report.state, report.axes) == (NodeState.UNHOMED, (0, Fault.ENCODER, 0))
    machine.unplugged.clear()
    report = home_axes(rig.radio, rig.plan.drive, 1, 1 << BIAS)
    assert (report.state, report.axes) == (NodeState.READY, (0, 0, 0))
    assert all(is_at_zero(machine, axis) for axis in range(3))


def test_a_host_program_that_is_interrupted_stops_the_search(rig: Rig) -> None:
    (machine,) = rig.machines
    machine.motors[TRANSLATE].at = 3000.5

    def interrupt(status: StatusFrame) -> None:
        if machine.motors[TRANSLATE].speed < -500:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        home_axes(rig.radio, rig.plan.drive, 1, ALL, interrupt)
    rig.fleet.run(300_000)
    assert is_at_rest(machine)
    assert rig.status()[0].unhomed == NOT_HOMED


def test_a_stall_is_forgotten_when_the_host_program_says_so(homed: Rig) -> None:
    (machine,) = homed.machines
    free = machine.motors[EXTRUDE].low, machine.motors[EXTRUDE].high
    assert "stalled" in homed.send_until_moving(machine.motors[EXTRUDE].jam).message
    homed.fleet.run(1_500_000)
    (node,) = homed.status()
    assert node.state == "fault"
    assert node.fault_seconds in (1, 2)
    machine.motors[EXTRUDE].low, machine.motors[EXTRUDE].high = free
    report = clear_fault(homed.radio, homed.plan.drive, 1)
    assert (report.state, report.fault) == (NodeState.HOLD_LINK, Fault.NONE)
    homed.fleet.run(300_000)
    assert machine.drivers_on


# By the button


def test_homing_can_be_stopped_with_its_button(rig: Rig) -> None:
    (machine,) = rig.machines
    machine.motors[TRANSLATE].at = 1000.5
    machine.press_button(rig.fleet.run, 2_200_000)
    assert rig.status()[0].state == "homing"
    assert machine.drivers_on
    assert machine.motors[TRANSLATE].speed < -500
    machine.press_button(rig.fleet.run, 100_000)
    rig.fleet.run(500_000)
    assert rig.status()[0].state == "unhomed"
    assert is_at_rest(machine)
    assert not machine.drivers_on


@pytest.mark.campaign
def test_the_press_that_begins_homing_does_not_end_it(rig: Rig) -> None:
    rig.machines[0].press_button(rig.fleet.run, 5_000_000)
    assert rig.status()[0].state in ("homing", "ready")
    rig.fleet.run(15_000_000)
    assert rig.status()[0].state == "ready"


@pytest.mark.campaign
def test_an_obstacle_is_the_reason_why_an_axis_is_not_homed(rig: Rig) -> None:
    (machine,) = rig.machines
    machine.switch_at = None
    machine.motors[TRANSLATE].low = -500.0
    machine.press_button(rig.fleet.run, 2_200_000)
    rig.fleet.run(15_000_000)
    (node,) = rig.status()
    assert (node.state, node.fault, node.unhomed) == ("unhomed", "", {"translate": "stall"})
    assert is_at_zero(machine, BIAS)
    assert machine.counts[TRANSLATE] < -400, "whoever does not know where zero is does not go there"
    assert not machine.drivers_on
    assert machine.lamp() == 1
