"""The mock display: its settings, its motion, what it remembers, and its mishaps."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from random import Random

import pytest

from curveline.errors import InvalidInput, LinkError
from curveline.radio.host.journal import Journal, new_run
from curveline.radio.host.link import RunReport, read_status, send_plan
from curveline.radio.interface import Answer
from curveline.radio.mock import store as store_module
from curveline.radio.mock.air import Weather
from curveline.radio.mock.display import MockRadio, open_radio
from curveline.radio.mock.fault_injection import MISHAPS, Mishap
from curveline.radio.mock.spec import MockSpec, parse_spec
from curveline.radio.protocol.codes import NodeState
from curveline.radio.protocol.motion import axes_of

from .bench import HOME, POSES, drive_table, make_plan, target

GOAL = target(POSES[-1]).counts


def send(runs: Path, radio: MockRadio, count: int = 2) -> RunReport:
    journal = Journal(new_run(runs, "test"))
    try:
        return send_plan(make_plan(count), radio, journal)
    finally:
        journal.close()
        radio.close()


# Settings


def test_settings_are_read() -> None:
    assert parse_spec("") == MockSpec()
    text = (
        "loss=0.3,seed=7, nodes=2,spread=0.1,realtime,fresh,keys,dup=.25,stale=0.5,corrupt=1e-3,"
        "stall=1@step2,reboot=2@step3,jam@step4,twin=2,replay=0.5,disk=full@step7"
    )
    assert parse_spec(text) == MockSpec(
        weather=Weather(0.3, 0.25, 0.5, 1e-3),
        seed=7,
        nodes=2,
        spread=0.1,
        realtime=True,
        fresh=True,
        keys=True,
        mishaps=(
            Mishap("stall", node=1, step=2),
            Mishap("reboot", node=2, step=3),
            Mishap("jam", step=4),
            Mishap("twin", node=2),
            Mishap("replay", chance=0.5),
            Mishap("disk", step=7),
        ),
    )


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("los=0.3", "no setting 'los'"),
        ("weather", "no setting 'weather'"),
        ("loss", "loss takes a value"),
        ("fresh=1", "takes no value"),
        ("loss=1", "cannot be read"),
        ("loss=-0.1", "cannot be read"),
        ("dup=nan", "cannot be read"),
        ("loss=much", "cannot be read"),
        ("spread=0.95", "cannot be read"),
        ("seed=-1", "cannot be read"),
        ("seed=1.5", "cannot be read"),
        ("nodes=two", "cannot be read"),
        ("stall=1", "cannot be read"),
        ("reboot=0@step1", "cannot be read"),
        ("stall=1@step0", "cannot be read"),
        ("loss=0.1,loss=0.2", "given twice"),
        ("stall=1@step2,stall=2@step3", "given twice"),
        ("jam=1@step2", "jam=1@step2 cannot be read"),
        ("jam", "jam cannot be read"),
        ("off@step2", "cannot be read"),
        ("twin=1@step2", "twin=1@step2 cannot be read"),
        ("twin=0", "cannot be read"),
        ("stranger=1", "cannot be read"),
        ("replay=often", "cannot be read"),
        ("disk=half@step1", "cannot be read"),
        ("loss@step2", "loss takes a value"),
        ("keys=1", "takes no value"),
        ("strangr=0.5", "no setting 'strangr'"),
        ("=3", "no setting ''"),
    ],
)
def test_malformed_settings_are_refused(text: str, says: str) -> None:
    with pytest.raises(InvalidInput, match=says):
        parse_spec(text)


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("los=0.3", "did you mean loss? Written as loss=<number from 0 to below 1>"),
        ("strangr=0.5", "did you mean stranger? Written as stranger=<number from 0 to below 1>"),
        ("loss", "write it as loss=<number from 0 to below 1>"),
        ("spread=0.95", "write it as spread=<number from 0 to 0.9>"),
        ("seed=1.5", "write it as seed=<whole number>"),
        ("stall=1", "write it as stall=<node>@step<number>"),
        ("jam=1@step2", "write it as jam@step<number>"),
        ("twin=0", "write it as twin=<node>"),
        ("disk=half@step1", "write it as disk=full@step<number>"),
        ("keys=1", "write it as keys"),
    ],
)
def test_what_is_advised_is_how_it_is_written(text: str, hint: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        parse_spec(text)
    assert caught.value.hint == hint


def test_a_name_that_is_like_none_is_answered_with_all_of_them() -> None:
    with pytest.raises(InvalidInput) as caught:
        parse_spec("weather")
    for key in ("loss", "seed", "nodes", "spread", "fresh", "realtime", *MISHAPS):
        assert f" {key}," in f"{caught.value.hint},"


def test_settings_that_contradict_the_display_are_refused(tmp_path: Path) -> None:
    for settings, says in (
        ("nodes=3", "asked for 3 nodes"),
        ("stall=3@step1", "no node 3"),
        ("reboot=9@step1", "no node 9"),
    ):
        with pytest.raises(InvalidInput, match=says):
            open_radio(settings, drive_table(2), tmp_path)
    with pytest.raises(InvalidInput, match="data rate"):
        open_radio("", replace(drive_table(2), data_rate="3Mbps"), tmp_path)
    assert list(tmp_path.iterdir()) == []


# Motion


@pytest.mark.parametrize("spread", ["0", "0.2"])
def test_motion_tells_where_all_nodes_were(tmp_path: Path, spread: str) -> None:
    radio = open_radio(f"seed=3,spread={spread}", drive_table(), tmp_path)
    assert radio.motion() == [(0.0, ((0, 0, 0), (0, 0, 0)))]
    report = send(tmp_path, radio)
    motion = radio.motion()
    times = [seconds for seconds, _ in motion]
    assert times == sorted(set(times))
    assert motion[0] == (0.0, ((0, 0, 0), (0, 0, 0)))
    assert motion[-1][1] == (GOAL, GOAL)
    assert times[-1] >= report.seconds - 0.002
    moving = [pair for pair in pairwise(motion) if pair[0][1] != pair[1][1]]
    assert max(later[0] - sooner[0] for sooner, later in moving) <= 0.0201
    apart = max(abs(left[0] - right[0]) for _, (left, right) in motion)
    assert (apart > 100) == (spread != "0")


def test_speeds_and_accelerations_are_finite(tmp_path: Path) -> None:
    radio = open_radio("spread=0.2,loss=0.3", drive_table(), tmp_path)
    send(tmp_path, radio)
    motion = radio.motion()
    for (before, old), (after, new) in pairwise(motion):
        for node, others in zip(old, new, strict=True):
            for axis, here, there in zip(drive_table().axes, node, others, strict=True):
                assert abs(there - here) <= axis.speed * axis.counts_per_unit * (after - before) + 2


def test_the_same_seed_gives_the_same_run(tmp_path: Path) -> None:
    motions = []
    for name in ("a", "b"):
        radio = open_radio("loss=0.3,seed=11,spread=0.3", drive_table(), tmp_path / name)
        radio_times = send(tmp_path, radio).seconds
        motions.append((radio.motion()[-1][1], round(radio_times, 0)))
    assert motions[0] == motions[1]


def test_real_time_is_real(tmp_path: Path) -> None:
    radio = open_radio("realtime", drive_table(), tmp_path)
    begin = time.monotonic()
    radio.exchange([(drive_table().addresses[0], bytes(32))])
    radio.sleep_until(radio.now_us() + 30_000)
    took = time.monotonic() - begin
    assert 0.031 <= took < 1.0
    assert radio.now_us() >= 31_000
    radio.close()


def test_nobody_answers_on_an_unknown_address(tmp_path: Path) -> None:
    radio = open_radio("", drive_table(), tmp_path)
    assert radio.exchange([("0000000000", bytes(32))]) == [Answer(None, 3)]
    assert 3000 < radio.now_us() < 6000
    radio.close()


def test_virtual_time_costs_nothing(tmp_path: Path) -> None:
    radio = open_radio("", drive_table(), tmp_path)
    radio.sleep_until(3_600_000_000)
    assert radio.now_us() == 3_600_000_000
    radio.sleep_until(5)
    assert radio.now_us() == 3_600_000_000
    radio.close()


# Memory


def test_a_display_stands_where_it_was_left(tmp_path: Path) -> None:
    radio = open_radio("", drive_table(), tmp_path)
    assert radio.positions() == ((0, 0, 0), (0, 0, 0))
    assert radio.rod == []
    radio.rod = ["peak"]
    send(tmp_path, radio)
    again = open_radio("", drive_table(), tmp_path)
    assert again.positions() == (GOAL, GOAL)
    assert again.rod == ["peak"]
    assert [(status.state, status.boot) for status in read_status(again, drive_table())] == [("ready", 1)] * 2
    again.close()
    fresh = open_radio("fresh", drive_table(), tmp_path)
    assert fresh.positions() == ((0, 0, 0), (0, 0, 0))
    assert fresh.rod == []
    fresh.close()
    assert open_radio("", drive_table(name="other"), tmp_path).positions() == ((0, 0, 0), (0, 0, 0))


def test_displays_do_not_share_files(tmp_path: Path) -> None:
    for name in ("one", "../two", ""):
        open_radio("", drive_table(name=name), tmp_path).close()
    names = {path.name for path in tmp_path.iterdir()}
    assert {"mock-one.json", "mock-.._two.json", "mock-_.json"} <= names


class Unplugged(Exception):
    """Stands for whatever may end a process in the middle of a run."""


def test_an_interrupted_run_leaves_the_display_where_it_comes_to_rest(tmp_path: Path) -> None:
    radio = open_radio("", drive_table(), tmp_path)

    def stop_in_step_three(progress) -> None:
        if progress.step == 3 and 0.3 < progress.fraction < 1.0:
            raise Unplugged

    journal = Journal(new_run(tmp_path, "x"))
    with pytest.raises(Unplugged):
        send_plan(make_plan(seconds=6.0), radio, journal, stop_in_step_three)
    journal.close()
    before = radio.positions()
    radio.close()
    rest = radio.positions()
    assert rest[0] > before[0], "the nodes went on until their dead-man held them"
    assert all(node.move is None for node in radio.nodes)
    assert target(POSES[1]).counts < rest[0] < GOAL
    again = open_radio("", drive_table(), tmp_path)
    assert again.positions() == rest
    assert [status.state for status in read_status(again, drive_table())] == ["hold-link"] * 2
    report = send_from(tmp_path, again, rest)
    assert report.outcome == "done"


def send_from(runs: Path, radio: MockRadio, counts) -> RunReport:
    """Send a plan that starts where the display stands."""
    plan = make_plan()
    start = tuple(replace(target(HOME), counts=each) for each in counts)
    journal = Journal(new_run(runs, "test"))
    try:
        return send_plan(replace(plan, start=start), radio, journal)
    finally:
        journal.close()
        radio.close()


def test_a_killed_process_leaves_the_steps_begun_and_done(tmp_path: Path) -> None:
    """Nothing is closed here: what counts is what was saved on the way."""
    radio = open_radio("", drive_table(), tmp_path)

    def die(progress) -> None:
        if progress.step == 2 and progress.status.started == 2:
            raise Unplugged

    journal = Journal(new_run(tmp_path, "x"))
    with pytest.raises(Unplugged):
        send_plan(make_plan(), radio, journal, die)
    radio._store.close()
    again = open_radio("", drive_table(), tmp_path)
    assert [(node.memory.started, node.memory.finished) for node in again.nodes] in ([(2, 1)] * 2, [(2, 1), (1, 1)])
    assert again.nodes[0].memory.target == target(POSES[1]).counts
    again.close()


DAMAGES = [
    "",
    "{",
    "[]",
    "nonsense",
    "[" * 5000,
    '{"format": 2}',
    '{"format": 1}',
    "\x00" * 50,
]


@pytest.mark.parametrize("text", DAMAGES)
def test_a_damaged_memory_is_refused_with_the_way_out(tmp_path: Path, text: str) -> None:
    path = tmp_path / "mock-test.json"
    path.write_text(text)
    with pytest.raises(LinkError, match="damaged") as caught:
        open_radio("", drive_table(), tmp_path)
    assert "mock:fresh" in caught.value.hint
    assert path.read_text() == text
    open_radio("fresh", drive_table(), tmp_path).close()
    open_radio("", drive_table(), tmp_path).close()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"counts": [0, 0, 0]', '"counts": [0, 0]'),
        ('"counts": [0, 0, 0]', '"counts": [0, 0.5, 0]'),
        ('"counts": [0, 0, 0]', '"counts": [0, true, 0]'),
        ('"counts": [0, 0, 0]', '"counts": [99999999, 0, 0]'),
        ('"counts": [0, 0, 0]', '"counts": "000"'),
        ('"target": [0, 0, 0]', '"target": null'),
        ('"unhomed": [0, 0, 0]', '"unhomed": [0, 0]'),
        ('"unhomed": [0, 0, 0]', '"unhomed": [0, 0, 9]'),
        ('"unhomed": [0, 0, 0]', '"unhomed": [0, 0, true]'),
        ('"homing": 0', '"homing": 2'),
        ('"estop": false', '"estop": 0'),
        ('"estop": false', '"estop": false, "extra": 1'),
        ('"cause": 1', '"cause": 99'),
        ('"fault_axis": 0', '"fault_axis": 4'),
        ('"fault_ms": 0', '"fault_ms": 1'),
        ('"boot": 1', '"boot": -1'),
        ('"boot": 1', '"boot": 16777216'),
        ('"boot": 1', '"boot": 1.0'),
        ('"fault": 0', '"fault": 12'),
        ('"offers"', '"offer"'),
        ('"rod": []', '"rod": [1]'),
        ('"rod": []', '"rod": "peak"'),
        ('"rod": []', '"wood": []'),
        ('"nodes": [', '"nodes": [{}, '),
        ('"nodes": [', '"nodes": 3, "knots": ['),
    ],
)
def test_a_memory_that_says_the_impossible_is_damaged(tmp_path: Path, old: str, new: str) -> None:
    open_radio("", drive_table(), tmp_path).close()
    path = tmp_path / "mock-test.json"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(LinkError, match="damaged"):
        open_radio("", drive_table(), tmp_path)


@pytest.mark.parametrize("marks", ["[false, false, false]", "[true, true, false]"])
def test_a_board_without_settings_to_run_under_is_damaged(tmp_path: Path, marks: str) -> None:
    open_radio("", drive_table(), tmp_path).close()
    path = tmp_path / "mock-test.json"
    content = json.loads(path.read_text())
    board = content["nodes"][0]["board"]
    board["settings"][0]["marks"] = json.loads(marks)
    path.write_text(json.dumps(content))
    with pytest.raises(LinkError, match="a board has no settings to run under"):
        open_radio("", drive_table(), tmp_path)
    board["settings"] = [None, None]
    path.write_text(json.dumps(content))
    with pytest.raises(LinkError, match="a board has no settings to run under"):
        open_radio("", drive_table(), tmp_path)


def test_a_memory_of_another_display_file_is_refused(tmp_path: Path) -> None:
    open_radio("", drive_table(2), tmp_path).close()
    with pytest.raises(LinkError, match="does not have 3 nodes"):
        open_radio("", drive_table(3), tmp_path)
    table = drive_table(2)
    other = replace(table, axes=(replace(table.axes[0], counts_per_unit=100.0), *table.axes[1:]))
    radio = open_radio("", other, tmp_path)
    assert [node._axes for node in radio.nodes] == [axes_of(table)] * 2, "its boards hold what they held"
    radio.close()


def test_a_memory_of_an_older_release_is_carried_over(tmp_path: Path) -> None:
    """Its boards are taken to hold what the display file says, as they did then."""
    table = drive_table(2)
    open_radio("", table, tmp_path).close()
    path = tmp_path / "mock-test.json"
    content = json.loads(path.read_text())
    content["nodes"][1]["counts"] = [100, 0, 0]
    for node in content["nodes"]:
        del node["board"]
    content |= {"format": 2, "counts_per_unit": [axis.counts_per_unit for axis in table.axes]}
    path.write_text(json.dumps(content))
    faster = replace(table, axes=(replace(table.axes[0], speed=10.0), *table.axes[1:]))
    radio = open_radio("", faster, tmp_path)
    assert [node._axes for node in radio.nodes] == [axes_of(faster)] * 2
    assert radio.positions()[1] == (100, 0, 0)
    radio.close()
    assert json.loads(path.read_text())["format"] == 4
    path.write_text(json.dumps(content))
    other = replace(table, axes=(replace(table.axes[0], counts_per_unit=100.0), *table.axes[1:]))
    with pytest.raises(LinkError, match="motors differ"):
        open_radio("", other, tmp_path)


def test_boards_of_an_older_release_have_the_program_of_this_one(tmp_path: Path) -> None:
    table = drive_table(2)
    open_radio("", table, tmp_path).close()
    path = tmp_path / "mock-test.json"
    content = json.loads(path.read_text())
    for node in content["nodes"]:
        del node["board"]["program"], node["board"]["in_loader"]
    path.write_text(json.dumps(content | {"format": 3}))
    radio = open_radio("", table, tmp_path)
    assert [station.program.is_runnable for station in radio._stations] == [True, True]
    radio.close()
    content = json.loads(path.read_text())
    program = content["nodes"][1]["board"]["program"]
    assert program["whole"]
    for damage in (
        {"description": "00"},
        {"description": "00" * 32},
        {"whole": 1},
        {"whole": False},
        {"sectors": {"0": "AAAA"}},
        {"whole": False, "sectors": {"0": "AAAA"}},
        {"whole": False, "sectors": {"1": ""}},
        {"whole": False, "sectors": {"0": 3}},
        {"more": 1},
    ):
        content["nodes"][1]["board"]["program"] = program | damage
        path.write_text(json.dumps(content))
        with pytest.raises(LinkError, match="damaged"):
            open_radio("", table, tmp_path)


def test_a_huge_or_unreadable_memory_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "mock-test.json"
    path.write_bytes(b" " * 21_000_000)
    with pytest.raises(LinkError, match="far too large"):
        open_radio("", drive_table(), tmp_path)
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(LinkError, match="damaged"):
        open_radio("", drive_table(), tmp_path)
    path.unlink()
    path.mkdir()
    with pytest.raises(LinkError, match="cannot use") as caught:
        open_radio("", drive_table(), tmp_path)
    assert "CURVELINE_RUNS" in caught.value.hint


def test_a_memory_is_replaced_in_one_go_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    radio = open_radio("", drive_table(), tmp_path)
    before = (tmp_path / "mock-test.json").read_bytes()
    radio.rod = ["valley"]

    def fail(source: Path, destination: Path) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr(store_module.os, "replace", fail)
        with pytest.raises(LinkError, match="No space left"):
            radio.save()
    assert (tmp_path / "mock-test.json").read_bytes() == before
    radio.close()
    assert b"valley" in (tmp_path / "mock-test.json").read_bytes()


def test_a_runs_folder_that_is_none_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(LinkError, match="cannot use"):
        open_radio("", drive_table(), tmp_path / "file")


# Lock

HOLDER = """
import sys
from pathlib import Path
sys.path[:0] = {paths!r}
from radio.bench import drive_table
from curveline.radio.mock.display import open_radio
radio = open_radio("", drive_table(), Path({runs!r}))
print("locked", flush=True)
sys.stdin.readline()
radio.close()
"""


def holder(runs: Path) -> subprocess.Popen[str]:
    here = Path(__file__).resolve()
    paths = [str(here.parents[1]), str(here.parents[2])]
    script = HOLDER.format(paths=paths, runs=str(runs))
    process = subprocess.Popen(
        [sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=dict(os.environ)
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "locked\n"
    return process


def test_two_processes_cannot_use_one_display(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store_module, "LOCK_WAIT_S", 0.2)
    with holder(tmp_path) as process:
        with pytest.raises(LinkError, match=f"in use by process {process.pid}"):
            open_radio("", drive_table(), tmp_path)
        open_radio("", drive_table(name="other"), tmp_path).close()
        monkeypatch.setattr(store_module, "LOCK_WAIT_S", 10.0)
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
        open_radio("", drive_table(), tmp_path).close()


def test_a_lock_dies_with_its_process(tmp_path: Path) -> None:
    with holder(tmp_path) as process:
        process.kill()
    open_radio("", drive_table(), tmp_path).close()


def test_a_refused_display_is_not_left_locked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store_module, "LOCK_WAIT_S", 0.0)
    (tmp_path / "mock-test.json").write_text("{")
    for _ in range(2):
        with pytest.raises(LinkError, match="damaged"):
            open_radio("", drive_table(), tmp_path)
    radio = open_radio("fresh", drive_table(), tmp_path)
    radio.close()
    radio.close()
    open_radio("", drive_table(), tmp_path).close()


# Mishaps


def test_a_stall_halts_the_run_and_stays(tmp_path: Path) -> None:
    radio = open_radio("stall=1@step2", drive_table(), tmp_path)
    with pytest.raises(LinkError, match="node 1 has stalled in step 2: its bias motor") as caught:
        send(tmp_path, radio)
    assert caught.value.node == 1
    again = open_radio("", drive_table(), tmp_path)
    status = read_status(again, drive_table())
    assert (status[0].state, status[0].fault) == ("fault", "stall (bias)")
    assert status[1].state == "hold-link"
    again.close()


def test_a_restart_halts_the_run_and_the_node_needs_homing(tmp_path: Path) -> None:
    radio = open_radio("reboot=2@step3", drive_table(), tmp_path)
    with pytest.raises(LinkError, match="node 2 has restarted in step 3: boot number 2 instead of 1") as caught:
        send(tmp_path, radio)
    assert caught.value.node == 2
    again = open_radio("", drive_table(), tmp_path)
    assert again.nodes[1].memory.boot == 2
    with pytest.raises(LinkError, match="node 2 does not know where it is: it has not been homed"):
        send_from(tmp_path, again, again.positions())


def test_a_node_that_restarts_while_idle_knows_its_place(tmp_path: Path) -> None:
    radio = open_radio("", drive_table(), tmp_path)
    radio._stations[0].restart(0, Random(0))
    radio.nodes[0].advance(0)
    assert (radio.nodes[0].state, radio.nodes[0].memory.boot) == (NodeState.READY, 2)
    radio.close()
