"""Going on with a broken-off run: records that cannot be believed, and nodes that do not agree."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import pytest

from curveline.errors import InvalidInput
from curveline.radio.host.actions import Phase, Policy
from curveline.radio.host.conductor import Conductor
from curveline.radio.host.resume import FINAL, ResumePoint, can_resume, resume_point
from curveline.radio.host.stop_causes import Cause, Halt
from curveline.radio.mock.air import Weather
from curveline.radio.node.plant import PlantFault
from curveline.radio.node.state import HOMED, NOWHERE
from curveline.radio.protocol.codes import ALL_AXES, BOOT_END, Fault, NodeState

from .bench import POSES, Bench, make_plan, target

Records = list[dict[str, Any]]
PLAN = make_plan()


def story() -> Records:
    """What an unbroken run of three steps leaves: start, three times release and barrier, end."""
    bench = Bench(PLAN)
    bench.run()
    return json.loads(json.dumps(bench.records))  # type: ignore[no-any-return]


STORY = story()
START, RELEASE_1, BARRIER_1, RELEASE_2, BARRIER_2 = STORY[:5]
PAUSE, RESUME = {"type": "pause", "step": 1}, {"type": "resume", "step": 1}


def halt(cause: str) -> dict[str, Any]:
    return {"type": "halt", "cause": cause, "node": 1, "step": 1, "message": f"because of {cause}"}


# What records say


@pytest.mark.parametrize(
    ("records", "released", "barrier"),
    [
        ([START], 0, 0),
        ([START, PAUSE], 0, 0),
        ([START, RELEASE_1], 1, 0),
        ([START, RELEASE_1, BARRIER_1], 1, 1),
        ([START, RELEASE_1, BARRIER_1, {"type": "look"}], 1, 1),
        ([START, RELEASE_1, BARRIER_1, RELEASE_2], 2, 1),
        ([START, RELEASE_1, PAUSE, RESUME, BARRIER_1, PAUSE], 1, 1),
        ([START, RELEASE_1, PAUSE, BARRIER_1], 1, 1),
        ([START, RELEASE_1, halt("held"), RESUME, BARRIER_1], 1, 1),
        ([START, RELEASE_1, halt("radio")], 1, 0),
        ([START, RELEASE_1, halt("a cause of the future"), halt("held")], 1, 0),
        ([START, START, RELEASE_1, RELEASE_1, BARRIER_1, BARRIER_1], 1, 1),
        (STORY[:-1], 3, 3),
    ],
)
def test_a_record_tells_where_to_go_on(records: Records, released: int, barrier: int) -> None:
    assert resume_point(PLAN, records) == ResumePoint(released, barrier, (1, 1))


@pytest.mark.parametrize(
    ("records", "part"),
    [
        ([], "nothing to resume"),
        ([halt("silent")], "nothing to resume"),
        ([{}], "nothing to resume"),
        (STORY, "done to its end"),
        ([*STORY, PAUSE], "done to its end"),
        ([*STORY, halt("radio")], "done to its end"),
        ([{**START, "run": "0" * 16}], "not of the plan"),
        ([{**START, "run": 5}], "not of the plan"),
        ([{**START, "boots": [1]}], "entry 1 "),
        ([{**START, "boots": "12"}], "entry 1 "),
        ([{**START, "boots": [1, "1"]}], "entry 1 "),
        ([{**START, "boots": [1, True]}], "entry 1 "),
        ([{**START, "boots": [1, BOOT_END]}], "entry 1 "),
        ([START, BARRIER_1], "entry 2 "),
        ([START, {**BARRIER_1, "step": 0}], "entry 2 "),
        ([START, RELEASE_2], "entry 2 "),
        ([START, {"type": "release"}], "entry 2 "),
        ([START, {"type": "release", "step": True}], "entry 2 "),
        ([START, {"type": "release", "step": 1.0}], "entry 2 "),
        ([START, {"type": "release", "step": -1}], "entry 2 "),
        ([START, RELEASE_1, RELEASE_2], "entry 3 "),
        ([START, RELEASE_1, {**BARRIER_1, "boots": [1, 2]}], "entry 3 "),
        ([START, RELEASE_1, {**BARRIER_1, "step": 1.0}], "entry 3 "),
        ([START, RELEASE_1, START], "entry 3 "),
        ([START, {"type": "end"}], "entry 2 "),
        ([START, {"type": "surprise"}], "entry 2 "),
        ([START, {}], "entry 2 "),
        ([START, {**START, "run": "0"}], "entry 2 "),
        ([START, halt("held"), RELEASE_1], "entry 3 "),
        ([*STORY[:-1], {"type": "release", "step": 4}], "entry 8 "),
        ([*STORY, RESUME], "entry 9 "),
        ([*STORY, RELEASE_1], "entry 9 "),
    ],
)
def test_a_record_that_cannot_be_gone_on_with_is_refused(records: Records, part: str) -> None:
    with pytest.raises(InvalidInput, match=part) as caught:
        resume_point(PLAN, records)
    assert "\n" not in caught.value.message


@pytest.mark.parametrize("cause", Cause, ids=lambda cause: cause.name)
def test_causes_that_end_a_run_for_good(cause: Cause) -> None:
    records = [START, RELEASE_1, halt(cause.name.lower())]
    assert can_resume(Halt(cause)) is (cause not in FINAL)
    if cause in FINAL:
        with pytest.raises(InvalidInput, match=f"cannot be resumed after its halt: because of {cause.name.lower()}"):
            resume_point(PLAN, records)
    else:
        assert resume_point(PLAN, records).clears == (cause in (Cause.STALL, Cause.DRIVER))


@pytest.mark.parametrize("message", [None, "", "\x1b[31mred", 7])
def test_a_message_that_cannot_be_shown_is_not(message: object) -> None:
    record = {**halt("reboot"), "message": message}
    with pytest.raises(InvalidInput, match=r"halt: (the cause was reboot|7|None)\nhint: "):
        resume_point(PLAN, [START, RELEASE_1, record])


# What nodes say


def broken_off(*, in_step: int = 2, after_ms: int = 200, policy: Policy | None = None) -> Bench:
    """A bench whose host was killed in the midst of a step, some time ago."""
    bench = Bench(PLAN, policy=policy)
    bench.run_to(Phase.RELEASED, in_step)
    bench.run_for(after_ms)
    bench.now_us += 5_000_000
    return bench


def refused(bench: Bench, cause: Cause, node: int) -> Halt:
    """Another host must refuse to go on, write nothing and move nothing."""
    records = len(bench.records)
    started = [node.memory.started for node in bench.nodes]
    bench.new_host()
    assert bench.run() is Phase.HALTED
    found = bench.conductor.halt
    assert found is not None
    assert (found.cause, found.node) == (cause, node), found.message
    assert len(bench.records) == records
    assert [node.memory.started for node in bench.nodes] == started
    for each in bench.nodes:
        each.advance(bench.now_ms)
    assert all(each.move is None for each in bench.nodes)
    return found


@pytest.mark.parametrize("loss", [0.0, 0.5])
def test_a_run_goes_on_in_the_midst_of_a_step(loss: float) -> None:
    bench = broken_off()
    bench.air.weather = Weather(loss)
    assert {node.state for node in bench.nodes} == {NodeState.MOVING}
    bench.new_host()
    assert bench.run() is Phase.DONE
    assert bench.positions() == [target(POSES[-1]).counts] * 2
    kinds = [(record["type"], record.get("step")) for record in bench.records[4:]]
    assert kinds == [("resume", 2), ("barrier", 2), ("release", 3), ("barrier", 3), ("end", None)]


def test_no_node_stirs_before_the_record_says_that_the_run_goes_on() -> None:
    bench = broken_off()
    bench.new_host()
    bench.run_to(Phase.RELEASED)
    resumed_us = bench.now_us
    assert bench.records[-1]["type"] == "resume"
    assert {node.state for node in bench.nodes} == {NodeState.HOLD}
    bench.run_for(100)
    assert {node.state for node in bench.nodes} == {NodeState.MOVING}
    assert bench.now_us > resumed_us


def test_a_node_that_restarted_is_not_gone_on_with() -> None:
    bench = broken_off()
    bench.reboot(1, unhomed=HOMED)
    assert "boot number 2 instead of 1" in refused(bench, Cause.REBOOT, 2).message


def test_a_node_that_was_sent_something_else() -> None:
    bench = broken_off(in_step=1, after_ms=0)
    bench.nodes[0].memory.run_tag ^= 1
    refused(bench, Cause.OTHER_RUN, 1)


def test_before_the_first_release_any_node_at_the_start_will_do() -> None:
    bench = Bench(PLAN)
    bench.run_to(Phase.STAGING)
    bench.now_us += 5_000_000
    bench.nodes[0].memory.run_tag ^= 1
    bench.new_host()
    assert bench.run() is Phase.DONE


def test_a_node_ahead_of_the_record() -> None:
    bench = broken_off()
    del bench.records[3:]
    assert "step 2" in refused(bench, Cause.AHEAD, 1).message


def test_a_node_behind_the_record() -> None:
    """Homing makes a node forget its run, but not which one it was."""
    bench = broken_off(in_step=3)
    bench.nodes[1].advance(bench.now_ms)
    bench.nodes[1].start_homing(bench.now_ms, ALL_AXES)
    bench.nodes[1].advance(bench.now_ms + 60_000)
    assert "the record says 2" in refused(bench, Cause.BEHIND, 2).message


@pytest.mark.parametrize("off", [200, -200])
def test_a_node_that_was_moved_by_somebody_else(off: int) -> None:
    bench = broken_off()
    bench.nodes[0].advance(bench.now_ms)
    x, y, z = bench.plants[0].positions(bench.now_ms)
    bench.plants[0].positions = lambda now_ms: (x, y, z + off)  # type: ignore[method-assign]
    assert "translate" in refused(bench, Cause.BEHIND, 1).message


@pytest.mark.parametrize(
    ("memory", "cause"),
    [({"unhomed": NOWHERE}, Cause.NOT_HOMED), ({"estop": True}, Cause.LATCHED), ({"fault": Fault.STALL}, Cause.STALL)],
)
def test_a_node_that_is_not_fit_to_go_on(memory: dict[str, Any], cause: Cause) -> None:
    bench = broken_off()
    for name, value in memory.items():
        setattr(bench.nodes[1].memory, name, value)
    refused(bench, cause, 2)


def test_a_refusal_leaves_nodes_as_they_were() -> None:
    bench = broken_off()
    bench.nodes[1].memory.fault = Fault.CONFLICT
    refused(bench, Cause.CONFLICT, 2)
    bench.nodes[1].memory.fault = Fault.NONE
    bench.new_host(nonce=0x77000000)
    assert bench.run() is Phase.DONE


def test_a_silent_node_is_waited_for_and_told() -> None:
    bench = broken_off()
    bench.hooks.append(lambda send: setattr(bench.air, "weather", Weather(float(send.node == 2))))
    refused(bench, Cause.SILENT, 2)


def test_a_stall_is_cleared_by_going_on_and_no_other_fault_is(monkeypatch: pytest.MonkeyPatch) -> None:
    for fault in (Fault.STALL, Fault.DRIVER):
        bench = Bench(PLAN)
        bench.run_to(Phase.RELEASED, 2)
        with monkeypatch.context() as patch:
            at_ms = bench.now_ms + 300
            patch.setattr(bench.plants[0], "fault", lambda at_ms=at_ms, fault=fault: PlantFault(at_ms, fault, 2))
            assert bench.run() is Phase.HALTED
        assert bench.nodes[0].state is NodeState.FAULT
        bench.new_host()
        assert bench.run() is Phase.DONE
        assert bench.positions() == [target(POSES[-1]).counts] * 2


def test_the_same_host_may_hold_a_resumed_run_and_a_third_go_on() -> None:
    bench = broken_off()
    for nonce in (0x100, 0x200, 0x300):
        bench.new_host(nonce << 32)
        bench.run_to(Phase.RELEASED, 2)
        bench.run_for(20)
        bench.conductor.hold(bench.now_ms)
        bench.run_to(Phase.PAUSED)
    bench.conductor.resume(bench.now_ms)
    assert bench.run() is Phase.DONE


@pytest.mark.parametrize("ask", [Conductor.pause, lambda conductor: conductor.hold(0)])
def test_wishes_uttered_while_nodes_are_being_found(ask: Callable[[Conductor], None]) -> None:
    bench = broken_off()
    bench.new_host()
    ask(bench.conductor)
    bench.run_to(Phase.PAUSED)
    moved = ask is Conductor.pause
    assert bench.conductor.barrier == (2 if moved else 1)
    assert {node.memory.finished for node in bench.nodes} == {2 if moved else 1}
    bench.conductor.resume(bench.now_ms)
    assert bench.run() is Phase.DONE


def test_a_record_whose_end_alone_is_missing_is_ended() -> None:
    bench = Bench(PLAN)
    bench.run()
    assert bench.records.pop()["type"] == "end"
    bench.new_host()
    assert bench.run() is Phase.DONE
    assert [record["type"] for record in bench.records[-2:]] == ["resume", "end"]


def test_the_next_host_waits_until_the_dead_one_is_silent_for_long_enough() -> None:
    bench = Bench(PLAN)
    bench.run_to(Phase.RELEASED, 2)
    bench.run_for(300)
    killed_ms = bench.now_ms
    bench.new_host()
    bench.run_to(Phase.RELEASED, 2)
    assert 1000 <= bench.now_ms - killed_ms < 1700
    assert bench.run() is Phase.DONE


# Two hosts


def interleave(bench: Bench, hosts: Sequence[Conductor], until: Callable[[], bool]) -> None:
    """Several hosts on one air, turn by turn."""
    while not until():
        for each in hosts:
            bench.conductor = each
            bench.turn()
        assert bench.now_ms < 60_000


def ended(conductor: Conductor) -> bool:
    return conductor.phase in (Phase.HALTED, Phase.DONE)


@pytest.mark.parametrize("resumes", [False, True])
@pytest.mark.parametrize("takeover", [False, True])
def test_a_second_host_is_told_within_two_seconds_who_is_in_its_way(resumes: bool, takeover: bool) -> None:
    bench = Bench(make_plan(3, seconds=4.0))
    bench.run_to(Phase.RELEASED, 1)
    bench.run_for(300)
    first, begin_ms = bench.conductor, bench.now_ms
    point = first.successor(5000, 0)._point if resumes else None  # type: ignore[union-attr]
    second = Conductor(bench.plan, bench.site, 0x99FF00, Policy(takeover=takeover), point)
    interleave(bench, (first, second), lambda: ended(second))
    assert second.halt == Halt(Cause.BUSY, 1, detail="; so does node 2, 3")
    assert bench.now_ms - begin_ms < 2000
    assert first.phase is Phase.RELEASED
    bench.conductor = first
    assert bench.run() is Phase.DONE


@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_takeover_claims_idle_nodes_and_the_first_host_stops_and_moves_nothing(loss: float) -> None:
    bench = Bench(make_plan(3, [POSES[0], POSES[0], POSES[1]], seconds=0.5), Weather(loss))
    bench.run_to(Phase.STAGING, 2)
    first = bench.conductor
    first.pause()
    bench.run_to(Phase.PAUSED)
    begin_ms = bench.now_ms
    plan = make_plan(3, [POSES[1], POSES[2]], seconds=0.5)
    plan = replace(plan, start=(target(POSES[0]),) * 3)
    second = Conductor(plan, bench.site, 0x99FF00, Policy(takeover=True))
    interleave(bench, (first, second), lambda: ended(first))
    assert first.halt is not None
    assert first.halt.cause is Cause.TAKEN
    assert bench.now_ms - begin_ms < 4000
    assert all(node.memory.run_tag == second.run_tag for node in bench.nodes)
    bench.conductor = second
    assert bench.run() is Phase.DONE
    assert bench.positions() == [target(POSES[2]).counts] * 3


def test_a_host_that_was_taken_over_cannot_go_on_with_its_run_either() -> None:
    bench = Bench(make_plan(2, [POSES[0], POSES[0], POSES[1]], seconds=0.5))
    bench.run_to(Phase.STAGING, 2)
    records = bench.records.copy()
    bench.now_us += 3_000_000
    plan = make_plan(2, [POSES[1]], seconds=0.5)
    plan = replace(plan, start=(target(POSES[0]),) * 2)
    bench.conductor = Conductor(plan, bench.site, 0x99FF00)
    assert bench.run() is Phase.DONE
    bench.records = records
    refused(bench, Cause.OTHER_RUN, 1)


def test_going_on_clears_the_fault_that_ended_the_run_and_no_other() -> None:
    """Two nodes are in fault; the record names the first, whose reason is gone."""
    bench = Bench(make_plan(seconds=5.0))
    bench.run_to(Phase.RELEASED, 1)
    bench.run_for(300)
    bench.nodes[0]._fail(bench.now_ms, Fault.STALL, 1)
    bench.nodes[0].notice(bench.now_ms)
    assert bench.run() is Phase.HALTED
    assert bench.records[-1]["cause"] == "stall"
    bench.nodes[1]._fail(bench.now_ms, Fault.RUNAWAY, 2)
    bench.new_host()
    assert bench.run() is Phase.HALTED
    assert bench.conductor.halt is not None
    assert (bench.conductor.halt.cause, bench.conductor.halt.node) == (Cause.RUNAWAY, 2)
    assert bench.nodes[1].memory.fault is Fault.RUNAWAY
