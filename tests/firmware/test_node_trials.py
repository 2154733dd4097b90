"""The real image tried out by the host program: what moves, moves little, gently, and only while the host is heard."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from curveline.driving.node_check import check
from curveline.driving.node_errands import NodePlace, info, jog, zero
from curveline.driving.node_tuning import tune
from curveline.errors import InvalidInput
from curveline.radio.host.errands import tried
from curveline.radio.host.link import Halted
from curveline.radio.host.stop_causes import Cause
from curveline.radio.node.state import FIRMWARE
from curveline.radio.protocol.codes import NodeState
from curveline.radio.protocol.service_frames import ServiceFrame

from .display import Rig
from .image import Image
from .machine import NFAULT
from .test_node_homing import BIAS, EXTRUDE, NOT_HOMED, PLACE, TRANSLATE, fitted, is_at_rest

BRAKED_US = 250_000 + 64_000 + 200_000 + 300_000
"""The dead-man time, a tick of the node's clock, what a slow jog needs to brake, and to come to rest."""


@pytest.fixture
def rig(image: Image, tmp_path: Path) -> Rig:
    """A node that has never been homed."""
    return fitted(Rig(image, b"", tmp_path, count=1))


@pytest.fixture
def homed(image: Image, homed_flash: bytes, tmp_path: Path) -> Rig:
    return fitted(Rig(image, homed_flash, tmp_path, count=1))


def place_of(rig: Rig) -> NodePlace:
    return NodePlace(rig.radio, rig.plan.drive, 1)


def test_it_says_who_it_is_and_flickers(rig: Rig) -> None:
    (machine,) = rig.machines
    found = info(place_of(rig))
    assert (found.firmware, found.limits_fit, len(found.chips)) == (FIRMWARE, True, 1)
    assert found.limits is not None
    for (low, high), axis in zip(found.limits.values(), rig.plan.drive.axes, strict=True):
        assert (low, high) == pytest.approx((axis.low, axis.high), abs=0.02)
    with tried(rig.radio, rig.plan.drive, 1) as errand:
        errand.blink(0.4)
        ups = [when for when, level in machine._lamp if level][-4:]
        assert all(70_000 < later - sooner < 90_000 for sooner, later in pairwise(ups))
    rig.fleet.run(3_000_000)
    *_, sooner, later = [when for when, level in machine._lamp if level]
    assert later - sooner > 1_000_000, "not homed, as before"


def test_an_axis_that_is_not_homed_is_jogged_a_little(rig: Rig) -> None:
    (machine,) = rig.machines
    before = machine.counts
    gone = jog(place_of(rig), "bias", 8.0, unhomed=True)
    assert gone.way == pytest.approx(8.0, abs=0.3)
    assert 0.0 < gone.lag < 2.0
    assert machine.counts[BIAS] - before[BIAS] == pytest.approx(8.0 * rig.plan.drive.axes[BIAS].counts_per_unit, abs=24)
    assert machine.counts[EXTRUDE] == before[EXTRUDE]
    rig.fleet.run(1_000_000)
    assert is_at_rest(machine)
    assert not machine.drivers_on
    assert rig.status()[0].unhomed == NOT_HOMED
    with pytest.raises(InvalidInput, match=r"8\.5 deg at most"):
        jog(place_of(rig), "bias", 8.6, unhomed=True)


def test_it_stops_when_its_host_falls_silent(homed: Rig) -> None:
    (machine,) = homed.machines

    class GoneError(Exception):
        pass

    def vanish(facts: object) -> None:
        if machine.motors[EXTRUDE].speed > 500:
            raise GoneError

    errand = tried(homed.radio, homed.plan.drive, 1)
    claim = errand.__enter__()
    with pytest.raises(GoneError):
        claim.jog(ServiceFrame(0, 0, 0, axis=1, amount=4_000, rate=1100), vanish)
    at = machine.counts[EXTRUDE]
    homed.fleet.run(BRAKED_US)
    assert is_at_rest(machine)
    assert machine.counts[EXTRUDE] - at < 600
    assert homed.status()[0].state == "hold-link"


def test_a_plan_is_not_disturbed_by_who_tries_out(homed: Rig) -> None:
    with tried(homed.radio, homed.plan.drive, 1) as errand:
        errand.jog(ServiceFrame(0, 0, 0, axis=3, amount=400, rate=500), lambda facts: None)
        with pytest.raises(Halted) as caught:
            errand.jog(ServiceFrame(0, 0, 0, axis=3, amount=400_000, rate=500), lambda facts: None)
    assert caught.value.halt.cause is Cause.REFUSED


def test_the_extruder_is_zeroed_where_it_stands(rig: Rig) -> None:
    place = place_of(rig)
    jog(place, "extrude", 3.0, unhomed=True)
    report = zero(place)
    assert report.axes[0] == 0
    assert report.position[0] == 0
    assert report.state is NodeState.UNHOMED
    assert jog(place, "extrude", 15.0).position == pytest.approx(15.0, abs=0.15)


def test_a_sound_node_is_found_to_be_well(homed: Rig) -> None:
    place = place_of(homed)
    jog(place, "bias", 1.0)
    found = check(place)
    assert found.is_well, found
    for index, each in enumerate(found.axes):
        assert 250 < each.forward[index] < 450
        assert -450 < each.backward[index] < -250
        assert 0.0 < each.start_duty[0] < 0.3
        assert each.lag is not None
        assert 0.0 < each.lag < 1.0
        assert each.supply_mv is not None
        assert 3200 < each.supply_mv < 3400


def test_an_absent_motor_and_one_with_crossed_wires(rig: Rig) -> None:
    (machine,) = rig.machines
    machine.motors[TRANSLATE].at = PLACE
    machine.unplugged.add(BIAS)
    step = machine.motors[EXTRUDE].step
    machine.motors[EXTRUDE].step = lambda duty, now, cycles: step(-duty, now, cycles)  # type: ignore[method-assign]
    found = check(place_of(rig))
    codes = {each.axis: [finding.code for finding in each.findings] for each in found.axes}
    assert codes == {"extrude": ["reversed"], "bias": ["absent"], "translate": []}


def test_a_noisy_encoder_and_a_driver_in_trouble(rig: Rig) -> None:
    (machine,) = rig.machines
    place = place_of(rig)
    with tried(place.radio, place.drive, 1) as errand:
        machine.set_pin(NFAULT, 0)
        result = errand.turn(ServiceFrame(0, 0, 0, axis=1, amount=350, rate=300, span=1200))
        assert result.driver_fault
        assert max(map(abs, result.gone)) < 20
        machine.set_pin(NFAULT, 1)
        assert errand.axis(1).missed == 0


def test_a_turn_tells_what_the_motor_is_like(homed: Rig) -> None:
    found = tune(place_of(homed), "extrude")
    assert found.gain == pytest.approx(6953, rel=0.1)
    assert found.time_constant == pytest.approx(0.030, rel=0.4)
    assert all(each.error < 3.0 for each in found.responses)
