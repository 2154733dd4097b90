"""One board and one radio: what moves, moves little and ends by itself, and boards built wrong are told in words."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import pytest

import curveline
from curveline.calibrating.step_response import SHIPPED, StepResponse, tuning_of
from curveline.driving.one_node import OneNode
from curveline.driving.session import Session
from curveline.errors import InvalidInput, LinkError
from curveline.radio.host.errands import Errand, tried
from curveline.radio.host.link import Halted
from curveline.radio.host.stop_causes import Cause
from curveline.radio.interface import Answer
from curveline.radio.mock.display import MockRadio
from curveline.radio.node.workbench import Turn
from curveline.radio.protocol.codes import NodeState, ReadingPage, ServiceOperation
from curveline.radio.protocol.service_frames import ServiceFrame

AXES = ("extrude", "bias", "translate")
WEATHER = ["", ",loss=0.3,dup=0.1,stale=0.2", ",loss=0.5"]


@pytest.fixture
def session_of(tmp_path: Path) -> Callable[..., Session]:
    def opened(settings: str, display: str = "single") -> Session:
        return curveline.connect(f"mock:fresh,{settings}", display, runs=tmp_path)

    return opened


def codes(node: OneNode) -> list[str]:
    """What a check finds, of the node and then of the axes."""
    found = node.check()
    return [each.code for each in found.findings] + [
        f"{axis.axis}: {each.code}" for axis in found.axes for each in axis.findings
    ]


def mock(session: Session) -> MockRadio:
    assert isinstance(session.radio, MockRadio)
    return session.radio


# Boards built wrong


@pytest.mark.parametrize("weather", WEATHER[:2], ids=["calm", "rough"])
def test_a_sound_board_is_well(session_of: Callable[..., Session], weather: str) -> None:
    with session_of(f"seed=3{weather}") as session:
        found = session.node(1).check()
    assert found.is_well, found
    for index, each in enumerate(found.axes):
        assert 290 < each.forward[index] < 330
        assert each.start_duty == pytest.approx((0.095, 0.095), abs=0.01)
        assert each.lag is not None


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("fault", ["reversed", "absent", "noisy", "loose"])
@pytest.mark.parametrize("homed", [True, False])
def test_each_fault_of_an_axis_is_named_and_no_other(
    session_of: Callable[..., Session], fault: str, axis: str, *, homed: bool
) -> None:
    with session_of(f"{fault}={axis}@1" + ",unhomed=1" * (not homed)) as session:
        assert codes(session.node(1)) == [f"{axis}: {fault}"]


@pytest.mark.parametrize(("axis", "other"), [*zip(AXES, (*AXES[1:], AXES[0]), strict=True)])
def test_two_encoders_that_are_exchanged(session_of: Callable[..., Session], axis: str, other: str) -> None:
    with session_of(f"swapped={axis}@1") as session:
        found = session.node(1).check([axis])
    (finding,) = found.axes[0].findings
    assert finding.code == "swapped"
    assert finding.text == f"the motor of {axis} turns, and the encoder of {other} counts"
    assert "pins" in finding.hint


@pytest.mark.parametrize("axis", AXES)
def test_one_motor_plugged_in_is_enough(session_of: Callable[..., Session], axis: str) -> None:
    others = [each for each in AXES if each != axis]
    with session_of(f"unhomed=1,absent={others[0]}@1") as session:
        mock(session)._stations[0].plant.wiring.absent |= 1 << AXES.index(others[1])
        assert session.node(1).check([axis]).is_well


def test_a_switch_that_is_always_closed(session_of: Callable[..., Session]) -> None:
    with session_of("switch=translate@1") as session:
        assert codes(session.node(1)) == ["translate: switch"]


def test_a_weak_supply(session_of: Callable[..., Session]) -> None:
    with session_of("supply=1") as session:
        found = session.node(1).check(["bias"])
    assert [each.code for each in found.findings] == ["supply"]
    assert "2.72 V" in found.findings[0].text


def test_a_motor_that_disturbs_another_encoder(
    session_of: Callable[..., Session], monkeypatch: pytest.MonkeyPatch
) -> None:
    with session_of("") as session:
        bench = mock(session)._stations[0].plant.bench
        still = bench.run

        def noisy(now_ms: int, turn: Turn, *rest: Any) -> tuple[Any, ...]:
            bench._missed[1] += 7 * (turn.axis == 3)
            return still(now_ms, turn, *rest)

        monkeypatch.setattr(bench, "run", noisy)
        (finding,) = session.node(1).check().findings
        assert (finding.code, finding.text) == (
            "crosstalk",
            "bias's encoder missed 14 edges while translate's motor turned",
        )
        assert "100 nF across the motor of translate" in finding.hint
        assert session.node(1).check(["translate"]).is_well, "with one motor plugged in nobody knows of the others"


@pytest.mark.parametrize(
    ("millivolts", "words"),
    [
        (3300, None),
        (3100, None),
        (3080, "3.08 V while a motor turns, give or take 0.09 V: that may be too low, measure it with a meter"),
        (2920, "2.92 V while a motor turns, give or take 0.09 V: that may be too low"),
        (2900, "2.90 V while a motor turns, give or take 0.09 V"),
    ],
)
def test_a_supply_is_judged_with_the_error_of_its_measurement(
    session_of: Callable[..., Session], monkeypatch: pytest.MonkeyPatch, millivolts: int, words: str | None
) -> None:
    monkeypatch.setattr("curveline.radio.node.motor_model.SUPPLY_MV", millivolts)
    with session_of("") as session:
        found = session.node(1).check(["bias"]).findings
    assert [words in each.text for each in found] == ([] if words is None else [True])
    assert all(("meter" in each.text) == ("meter" in str(words) or millivolts == 2920) for each in found)


class Fingers:
    """Switches of translate and extrude that go through some states, a tenth of a second each."""

    def __init__(self, mock: MockRadio, own: Sequence[bool], spare: Sequence[bool] = ()) -> None:
        self._mock, self._own, self._spare = mock, own, spare
        self._begin_us = mock.now_us()

    def __call__(self, number: int, axis: int, *, presses: bool) -> None:
        at = (self._mock.now_us() - self._begin_us) // 100_000
        bits = 0
        for states, bit in ((self._own, 0b100), (self._spare, 0b001)):
            if states:
                bits |= bit * states[min(at, len(states) - 1)]
        self._mock._stations[number - 1].plant.wiring.stuck_switches = bits


SHUT, OPEN = True, False


@pytest.mark.parametrize(
    ("own", "spare", "words"),
    [
        ([OPEN] * 7 + [SHUT, OPEN], [], None),
        ([OPEN] * 7 + [SHUT, SHUT, OPEN, OPEN, SHUT, OPEN], [], None),
        ([OPEN], [], "translate's switch stays open, pressed or not"),
        ([OPEN], [OPEN] * 7 + [SHUT, OPEN], "and the one of the rod's end changes instead"),
        ([SHUT] * 7, [], "translate's switch stays closed, pressed or not"),
        ([SHUT] * 7 + [OPEN, SHUT], [], "is closed, and opens when it is pressed"),
        ([OPEN] * 7 + [SHUT], [], "translate's switch was open and then closed"),
    ],
)
def test_what_a_switch_does_when_it_is_pressed(
    session_of: Callable[..., Session],
    monkeypatch: pytest.MonkeyPatch,
    own: Sequence[bool],
    spare: Sequence[bool],
    words: str | None,
) -> None:
    with session_of("") as session:
        node = session.node(1)
        fingers = Fingers(mock(session), own, spare)
        fingers(1, 3, presses=False)
        monkeypatch.setattr(mock(session), "finger", fingers, raising=False)
        found = node.check_switch(3.0)
    assert [words in each.text for each in found.findings] == ([] if words is None else [True])
    assert found.is_well == (words is None)


def test_two_devices_on_one_address_are_not_turned(session_of: Callable[..., Session]) -> None:
    with session_of("twin=1") as session:
        found = session.node(1).check()
        assert len(session.node(1).info().chips) == 2
    assert [each.code for each in found.findings] == ["twin"]
    assert found.axes == ()


@pytest.mark.parametrize(
    ("fault", "cause", "words"),
    [
        ("key=1", Cause.UNTRUSTED, "not to the key of this site"),
        ("firmware=1", Cause.OLDER, "firmware 2, this release needs 3"),
        ("version=1", Cause.VERSION, "another version of the protocol"),
        ("channel=1", Cause.SILENT, "does not answer"),
        ("busy=1", Cause.BUSY, "belongs to another host"),
        ("estop=1", Cause.LATCHED, "stopped for good"),
    ],
)
def test_boards_that_cannot_be_tried_out(
    session_of: Callable[..., Session], fault: str, cause: Cause, words: str
) -> None:
    with session_of(fault) as session, pytest.raises(Halted, match=words) as caught:
        session.node(1).check()
    assert caught.value.halt.cause is cause


def test_a_board_with_older_firmware_still_says_who_it_is(session_of: Callable[..., Session]) -> None:
    with session_of("firmware=1") as session:
        found = session.node(1).info()
    assert (found.firmware, found.limits) == (2, None)


def test_a_board_on_another_channel_is_found_there(session_of: Callable[..., Session]) -> None:
    with session_of("channel=1") as session:
        assert session.stray_channel(1) == 23


@pytest.mark.parametrize("axis", AXES)
def test_another_gear_is_found_by_a_ruler(session_of: Callable[..., Session], axis: str) -> None:
    with session_of(f"gear={axis}@1") as session:
        node = session.node(1)
        lay = node.mock_ruler
        assert lay is not None
        found = node.calibrate(axis, lambda attempt, gone: lay(gone))
    assert found.ratio == pytest.approx(2.98, rel=1e-3)
    assert "as a gear of 100:1 in place of 298:1 would" in found.findings[0].text


# What moves


@pytest.mark.parametrize("weather", WEATHER, ids=["calm", "rough", "rougher"])
def test_an_axis_goes_as_far_as_it_is_told(session_of: Callable[..., Session], weather: str) -> None:
    with session_of(f"seed=5{weather}") as session:
        node = session.node(1)
        for axis, by in (("extrude", 12.0), ("bias", -20.0), ("translate", 3.5), ("bias", 7.0)):
            gone = node.jog(axis, by)
            assert gone.way == pytest.approx(by, abs=0.02)
        position = node.report().position
        wanted = [each.counts(way) for each, way in zip(session.drive.axes, (12.0, -13.0, 3.5), strict=True)]
        assert position == pytest.approx(wanted, abs=8)


def test_it_is_slow(session_of: Callable[..., Session]) -> None:
    with session_of("") as session:
        session.node(1).jog("extrude", 50.0)
        motion = [(when, counts[0][0]) for when, counts in mock(session).motion()]
        rate = 5.0 * session.drive.axes[0].counts_per_unit
        for (begin, there), (end, here) in zip(motion, motion[5:], strict=False):
            assert abs(here - there) <= 1.1 * rate * (end - begin) + 2


@pytest.mark.parametrize(
    ("axis", "by", "words"),
    [("bias", 76.0, "bias would go to 76 deg"), ("bias", 500.0, "cannot be jogged"), ("bias", 0.0, "cannot be jogged")],
)
def test_limits_of_a_homed_axis(session_of: Callable[..., Session], axis: str, by: float, words: str) -> None:
    with session_of("") as session, pytest.raises(InvalidInput, match=words):
        session.node(1).jog(axis, by)


def test_limits_of_an_axis_that_is_not_homed(session_of: Callable[..., Session]) -> None:
    with session_of("unhomed=1") as session:
        node = session.node(1)
        with pytest.raises(InvalidInput, match="does not know where its bias is"):
            node.jog("bias", 5.0)
        with pytest.raises(InvalidInput, match="20 deg at most"):
            node.jog("bias", 21.0, unhomed=True)
        gone = node.jog("bias", 20.0, unhomed=True)
        assert (round(gone.way, 1), gone.position) == (20.0, None)
        assert node.report().state is NodeState.UNHOMED


def test_the_node_is_the_last_fence(session_of: Callable[..., Session]) -> None:
    """What no command of ours asks for is refused by the node itself."""
    wishes = [
        ServiceFrame(0, 0, 0, axis=2, amount=6000, rate=700),
        ServiceFrame(0, 0, 0, axis=2, amount=100, rate=99),
    ]
    turns = [
        ServiceFrame(0, 0, 0, axis=1, amount=351, rate=300, span=100),
        ServiceFrame(0, 0, 0, axis=1, amount=350, rate=1001, span=100),
        ServiceFrame(0, 0, 0, axis=1, amount=350, rate=300, span=1501),
        ServiceFrame(0, 0, 0, axis=1, amount=0, rate=300, span=100),
    ]
    with session_of("") as session, tried(session.radio, session.drive, 1) as errand:
        for wish in wishes:
            with pytest.raises(Halted, match="beyond what it is allowed"):
                errand.jog(wish, lambda facts: None)
        for wish in turns:
            with pytest.raises(Halted, match="beyond what it is allowed"):
                errand.turn(wish)
        assert errand.motors().counts == (0, 0, 0)


def test_a_session_with_a_long_dead_man_moves_nothing(session_of: Callable[..., Session]) -> None:
    class Patient(Errand):
        deadman_ms = 1000

    with session_of("") as session:
        errand = Patient(session.radio, session.drive, 1)
        errand.begin(0)
        with pytest.raises(Halted, match="dead-man time is too long"):
            errand.jog(ServiceFrame(0, 0, 0, axis=2, amount=100, rate=700), lambda facts: None)
        errand.give_back()


@pytest.mark.parametrize("operation", [ServiceOperation.JOG, ServiceOperation.TURN])
def test_it_stops_when_its_host_is_killed(session_of: Callable[..., Session], operation: ServiceOperation) -> None:
    with session_of("") as session:
        radio = mock(session)
        errand = Errand(radio, session.drive, 1)
        errand.begin(0)
        wish = ServiceFrame(0, 0, 0, operation, 1, 1, amount=300, rate=1000, span=1500)
        if operation is ServiceOperation.JOG:
            wish = ServiceFrame(0, 0, 0, operation, 1, 1, amount=60_000, rate=1100)
        end_us = radio.now_us() + 400_000
        while radio.now_us() < end_us:
            errand._look(wish)
            radio.sleep_until(radio.now_us() + 10_000)
        before = radio.now_us()
        assert radio.nodes[0].is_turning
        radio.sleep_until(before + 600_000)
        radio.nodes[0].advance(radio.now_us() // 1000)
        assert not radio.nodes[0].is_turning
        at = radio.positions()[0]
        radio.sleep_until(before + 5_000_000)
        assert radio.positions()[0] == at
        late = [when for when, counts in radio.motion() if counts[0] != at]
        assert max(late) < before / 1e6 + 0.25 + 0.35


def test_ctrl_c_stops_a_jog(session_of: Callable[..., Session]) -> None:
    def strike(facts: object) -> None:
        raise KeyboardInterrupt

    with session_of("") as session:
        with pytest.raises(KeyboardInterrupt):
            session.node(1).jog("extrude", 100.0, viewer=strike)
        radio = mock(session)
        radio.sleep_until(radio.now_us() + 1_000_000)
        radio.nodes[0].advance(radio.now_us() // 1000)
        assert not radio.nodes[0].is_turning
        assert radio.positions()[0][0] < 500


@pytest.mark.parametrize("fault", ["reversed=bias@1", "absent=bias@1"])
def test_a_jog_that_meets_a_fault_says_which(session_of: Callable[..., Session], fault: str) -> None:
    with session_of(fault) as session, pytest.raises(LinkError, match=r"against its command|lost its position"):
        session.node(1).jog("bias", 10.0)


def test_zero_makes_the_extruder_count_from_here(session_of: Callable[..., Session]) -> None:
    with session_of("unhomed=1") as session:
        node = session.node(1)
        node.jog("extrude", 5.0, unhomed=True)
        report = node.zero()
        assert (report.position[0], report.axes[0], report.axes[1]) == (0, 0, 15)
        assert node.jog("extrude", 100.0).position == pytest.approx(100.0, abs=0.02)


def test_what_is_watched(session_of: Callable[..., Session]) -> None:
    with session_of("switch=translate@1,noisy=bias@1") as session:
        first, *_, last = islice(session.node(1).watch(), 5)
        assert first.switches == (False, False, True)
        assert first.supply_mv == 3300
        assert last.missed[1] > first.missed[1]
        assert last.missed[0] == 0


def test_blinking_takes_its_time_and_moves_nothing(session_of: Callable[..., Session]) -> None:
    with session_of("") as session:
        begin = session.radio.now_us()
        session.node(1).blink(2.0)
        node = mock(session).nodes[0]
        assert session.radio.now_us() - begin >= 2_000_000
        assert node.blink_until_ms > begin // 1000 + 2000
        assert mock(session).positions()[0] == (0, 0, 0)
        with pytest.raises(InvalidInput):
            session.node(1).blink(float("nan"))


def test_info_tells_the_limits_of_the_display_file(session_of: Callable[..., Session]) -> None:
    with session_of("", "quad") as session:
        found = session.node(3).info()
        assert found.limits is not None
        for axis, (low, high) in zip(session.drive.axes, found.limits.values(), strict=True):
            assert (low, high) == pytest.approx(
                (max(axis.low, -262136 / axis.counts_per_unit), min(axis.high, 262136 / axis.counts_per_unit)), rel=1e-3
            )
    with session_of("config=1") as session:
        found = session.node(1).info()
        assert not found.limits_fit
        assert found.limits is not None, "it says which limits it holds instead"


def test_recorded_frames_move_nothing_a_second_time(session_of: Callable[..., Session]) -> None:
    with session_of("") as session:
        radio, sent, exchange = mock(session), [], mock(session).exchange

        def record(frames: Sequence[tuple[str, bytes]]) -> Sequence[Answer]:
            sent.extend(frames)
            return exchange(frames)

        radio.exchange = record  # type: ignore[method-assign]
        session.node(1).jog("bias", 5.0)
        node, at = radio.nodes[0], radio.positions()[0]
        for while_taken in (False, True):
            if while_taken:
                errand = Errand(radio, session.drive, 1)
                errand.begin(0)
            for _, payload in list(sent):
                radio.sleep_until(radio.now_us() + 1000)
                node.receive(radio.now_us() // 1000, payload)
            assert not node.is_turning
            assert radio.positions()[0] == at


def test_a_run_that_was_broken_off_cannot_go_on_after_a_jog(session_of: Callable[..., Session]) -> None:
    with session_of("silence=1@step2") as session:
        with pytest.raises(LinkError):
            session.send("level-down-peak")
        node = session.node(1)
        assert node.report().started == 2
        node.jog("bias", 1.0)
        assert node.report().started == 0
        with pytest.raises(LinkError) as caught:
            session.resume()
    assert "send the shape again" in caught.value.hint


def test_an_axis_at_the_end_of_its_travel_is_not_checked_there(session_of: Callable[..., Session]) -> None:
    with session_of("") as session:
        node = session.node(1)
        node.jog("bias", 74.0)
        with pytest.raises(InvalidInput, match="too near to the end") as caught:
            node.check(["bias"])
        way = float(caught.value.hint.split()[-1].strip("`"))
        node.jog("bias", way)
        assert node.check(["bias"]).is_well


# What is measured


def test_several_measurements_tell_an_error(session_of: Callable[..., Session]) -> None:
    said = iter((50.0, 50.2, 49.8, 50.4))
    with session_of("") as session:
        found = session.node(1).calibrate("extrude", lambda attempt, gone: next(said), way=50.0, repeats=4)
        assert mock(session).positions()[0] == (0, 0, 0), "it is back"
    assert found.new == pytest.approx(37.7 * 50.1 / 50.0, rel=1e-4)
    assert found.error == pytest.approx(37.7 / 50.0 * 0.2582 / 2.0, rel=1e-2)
    assert found.findings == ()


def test_what_was_measured_is_written_and_comments_stay(session_of: Callable[..., Session], tmp_path: Path) -> None:
    file = tmp_path / "lab.toml"
    file.write_text(curveline.builtin_text("single"))
    with session_of("", str(file)) as session:
        found = session.node(1).calibrate("bias", lambda attempt, gone: 1.01 * gone.way)
    curveline.write_calibration(found, file)
    before, after = curveline.builtin_text("single").splitlines(), file.read_text().splitlines()
    changed = [(old, new) for old, new in zip(before, after, strict=True) if old != new]
    assert len(changed) == 1
    assert changed[0][1].startswith("bias_deg_per_turn = 121.2")
    assert changed[0][1].split("#")[1] == changed[0][0].split("#")[1]
    with pytest.raises(InvalidInput, match="built-in"):
        curveline.write_calibration(found, "single")


@pytest.mark.parametrize("said", [0.0, -50.0, float("nan"), float("inf")])
def test_a_ruler_that_cannot_be_right(session_of: Callable[..., Session], said: float) -> None:
    with session_of("") as session, pytest.raises(InvalidInput, match="cannot have gone"):
        session.node(1).calibrate("extrude", lambda attempt, gone: said)


def test_the_motor_that_was_reckoned_with_gets_the_gains_that_are_shipped(session_of: Callable[..., Session]) -> None:
    with session_of("") as session:
        found = session.node(1).tune("translate")
    assert found.gain == pytest.approx(6953, rel=0.02)
    assert found.time_constant == pytest.approx(0.030, rel=0.1)
    assert found.friction == pytest.approx(0.05, abs=0.01)
    for name in ("proportional", "integral", "damping", "forward", "lead_ms"):
        assert found.gains[name] == pytest.approx(SHIPPED[name], rel=0.1)
    assert found.cut == ()


def test_no_gain_is_suggested_beyond_its_bounds() -> None:
    responses = [StepResponse(duty, (), duty * 1500.0, 0.1, 0.0) for duty in (0.2, -0.2, 0.34, -0.34)]
    found = tuning_of(1, "bias", responses)
    assert found.gains["forward"] == 132
    assert set(found.cut) >= {"forward", "lead_ms"}


def test_a_motor_that_is_absent_is_not_tuned(session_of: Callable[..., Session]) -> None:
    with session_of("absent=bias@1") as session, pytest.raises(LinkError, match="does not turn"):
        session.node(1).tune("bias")


def test_the_pages_of_a_reading_arrive_over_bad_air(session_of: Callable[..., Session]) -> None:
    with session_of("seed=9,loss=0.4,dup=0.2,stale=0.3") as session, tried(session.radio, session.drive, 1) as errand:
        result = errand.turn(ServiceFrame(0, 0, 0, axis=1, amount=340, rate=900, span=250, at_once=True))
        assert len(result.samples) == 64
        assert list(result.samples) == sorted(result.samples)
        for page in ReadingPage:
            assert errand._look(ServiceFrame(0, 0, 0, axis=1, page=page)).page is page
