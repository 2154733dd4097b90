"""What a display shows: remembered by a mock, or led to by the run that all nodes name as their last."""

from __future__ import annotations

import json
import os
import re
import shutil
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from curveline.driving import known_states, tours
from curveline.driving.known_states import Shown, shown_states
from curveline.driving.tours import Tour, Whereabouts
from curveline.listening import Listener
from curveline.plan_file import Plan, sealed, to_json, write_plan
from curveline.radio.host.journal import Journal, new_run
from curveline.radio.host.link import Control, OperatorRequest, read_status, send_plan
from curveline.radio.interface import open_radio

from .conftest import SHAPES, Run, promising, small_plan

PLAN = promising(small_plan(steps=3), "peak")
OTHER = sealed(replace(PLAN, drive=replace(PLAN.drive, display="other")))


def carry_out(plan: Plan, runs: Path, spec: str = "mock", control: Control | None = None) -> Path:
    """Send a plan as `send` does on a radio that knows nothing of the rod; the folder of the run."""
    folder = new_run(runs, plan.name)
    write_plan(plan, folder / "plan.json")
    with closing(open_radio(spec, plan.drive, runs)) as radio, closing(Journal(folder)) as journal:
        send_plan(plan, radio, journal, control=control)
    return folder


def known(runs: Path, spec: str = "mock", plan: Plan = PLAN) -> Shown:
    with closing(open_radio(spec, plan.drive, runs)) as radio:
        return shown_states(radio, plan.drive, read_status(radio, plan.drive), runs)


def back(plan: Plan) -> Plan:
    """From where a plan ends to where it starts, by way of its steps."""
    steps = [replace(step, targets=before) for step, before in zip(plan.steps, targets_before(plan), strict=True)][::-1]
    numbered = tuple(replace(step, number=number) for number, step in enumerate(steps, start=1))
    return promising(replace(plan, start=plan.steps[-1].targets, steps=numbered), "valley")


def targets_before(plan: Plan) -> list:
    return [plan.start, *(step.targets for step in plan.steps[:-1])]


# A mock remembers


def test_a_mock_remembers_what_its_rod_did(run: Run, tmp_path: Path) -> None:
    write_plan(PLAN, tmp_path / "plan.json")
    assert known(tmp_path / "runs") == Shown()
    assert run("send", tmp_path / "plan.json", "--radio", "mock", "--yes").code == 1
    # The plan promised a peak, the model knows better.
    assert known(tmp_path / "runs") == Shown(("valley",), "the mock display remembers")


def test_a_lost_rod_is_not_known(tmp_path: Path) -> None:
    with closing(open_radio("mock", PLAN.drive, tmp_path)) as radio:
        radio.rod = ["lost"]
        assert not any(shown_states(radio, PLAN.drive, read_status(radio, PLAN.drive), tmp_path).states)


def test_a_mock_forgets_its_rod_when_its_nodes_move_unwatched(run: Run, tmp_path: Path) -> None:
    runs = tmp_path / "runs"
    with closing(open_radio("mock", PLAN.drive, runs)) as radio:
        radio.rod = ["peak"]
        assert radio.known_rod == ("peak",)
    assert known(runs).states == ("peak",)
    assert run("status", "--radio", "mock").out.endswith("rod: peak\n")
    shutil.rmtree(carry_out(PLAN, runs))
    assert known(runs) == Shown()
    assert run("status", "--radio", "mock").out.endswith("rod: not known\n")
    with closing(open_radio("mock", PLAN.drive, runs)) as radio:
        assert (radio.rod, radio.known_rod) == (["peak"], ())


# A run is believed


def test_a_run_that_was_done_says_what_the_display_shows(tmp_path: Path) -> None:
    folder = carry_out(PLAN, tmp_path)
    assert known(tmp_path) == Shown(("peak",), f"run {folder.name}")
    assert known(tmp_path).line() == f"the display shows: peak (run {folder.name})"
    assert known(tmp_path, "mock:loss=0.3,seed=3").states == ("peak",)
    assert known(tmp_path, "mock:fresh") == Shown(), "another display stands at home"


def test_of_several_runs_the_last_one_counts(tmp_path: Path) -> None:
    carry_out(PLAN, tmp_path)
    carry_out(back(PLAN), tmp_path)
    assert known(tmp_path).states == ("valley",)
    again = carry_out(promising(PLAN, "middle-1"), tmp_path)
    # The nodes have done the same moves twice, but the promises of the two plans differ, and so do their tags.
    assert known(tmp_path) == Shown(("middle-1",), f"run {again.name}")
    shutil.rmtree(again)
    assert known(tmp_path) == Shown()


@pytest.mark.parametrize(("states", "expected"), [("peak", "peak"), ("peak|valley", ""), ("none", "")])
def test_a_run_that_paused_at_a_barrier_shows_the_state_of_its_step(tmp_path: Path, states: str, expected: str) -> None:
    steps = tuple(replace(step, states=(states,)) for step in PLAN.steps)
    plan = promising(replace(PLAN, steps=steps), "valley")
    control = Control()

    def watch(news: object) -> None:
        if news.status.started == 2:
            control.ask(OperatorRequest.PAUSE)

    folder = new_run(tmp_path, plan.name)
    write_plan(plan, folder / "plan.json")
    with closing(open_radio("mock", plan.drive, tmp_path)) as radio, closing(Journal(folder)) as journal:
        assert send_plan(plan, radio, journal, watch, control).steps_done == 2
    assert known(tmp_path) == Shown((expected,), f"run {folder.name}")
    assert ("not known" in known(tmp_path).line()) is not expected


def test_a_run_that_was_held_in_the_midst_of_a_step_shows_nothing(tmp_path: Path) -> None:
    control = Control()

    def watch(news: object) -> None:
        if news.status.started == 2:
            control.ask(OperatorRequest.HOLD)

    folder = new_run(tmp_path, PLAN.name)
    write_plan(PLAN, folder / "plan.json")
    with closing(open_radio("mock", PLAN.drive, tmp_path)) as radio, closing(Journal(folder)) as journal:
        assert send_plan(PLAN, radio, journal, watch, control).steps_done == 1
    assert known(tmp_path) == Shown()


# A run is not believed


def test_nodes_that_another_host_has_driven_are_not_believed(tmp_path: Path) -> None:
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    carry_out(PLAN, ours)
    theirs.mkdir()
    state = "mock-single.json"
    shutil.copy(ours / state, theirs)
    # The other host takes the display away and brings it back to the very same place, in as many steps.
    carry_out(back(PLAN), theirs)
    carry_out(promising(PLAN, "valley"), theirs)
    shutil.copy(theirs / state, ours)
    assert known(ours) == Shown()
    assert known(theirs).states == ("valley",)


@pytest.mark.parametrize("node", [0, 1])
def test_a_node_that_has_restarted_is_not_believed(tmp_path: Path, node: int) -> None:
    carry_out(PLAN, tmp_path)
    path = tmp_path / "mock-single.json"
    content = json.loads(path.read_text())
    content["nodes"][node].update(boot=2, run_tag=0, started=0, finished=0, staged=0)
    path.write_text(json.dumps(content))
    assert known(tmp_path) == Shown()


@pytest.mark.parametrize(("off", "states"), [(20, ("peak",)), (40, ())])
def test_nodes_that_stand_elsewhere_are_not_believed(tmp_path: Path, off: int, states: tuple[str, ...]) -> None:
    carry_out(PLAN, tmp_path)
    path = tmp_path / "mock-single.json"
    content = json.loads(path.read_text())
    content["nodes"][1]["counts"][1] += off
    path.write_text(json.dumps(content))
    assert known(tmp_path).states == states


def test_a_plan_that_was_edited_in_its_run_is_not_the_one_that_was_sent(tmp_path: Path) -> None:
    folder = carry_out(PLAN, tmp_path)
    write_plan(promising(PLAN, "valley"), folder / "plan.json", force=True)
    assert known(tmp_path) == Shown()


def test_a_display_whose_file_has_changed_is_another_one(tmp_path: Path) -> None:
    carry_out(PLAN, tmp_path)
    changed = replace(PLAN, drive=replace(PLAN.drive, digest="0" * 64))
    assert known(tmp_path, plan=changed) == Shown()


# Folders full of other things


def rubbish(runs: Path, count: int) -> None:
    """Runs that are none, or not fit to be read, each newer than any real one."""
    stamps = (f"{900000 + number}-20260101-000000-rubbish" for number in range(count))
    text = to_json(PLAN)
    for number, stamp in enumerate(stamps):
        folder = runs / stamp
        if number % 9 == 0:
            folder.write_text("a file where a folder was expected")
            continue
        folder.mkdir()
        plan = folder / "plan.json"
        kinds = {
            1: lambda plan=plan: None,
            2: lambda plan=plan: plan.write_text(text[: len(text) // 2]),
            3: lambda plan=plan: plan.write_bytes(b"\xff\xfe" + PLAN.drive.digest.encode()),
            4: lambda plan=plan: plan.write_text("[" * 100_000 + PLAN.drive.digest),
            5: lambda plan=plan: plan.mkdir(),
            6: lambda plan=plan: os.mkfifo(plan),
            7: lambda plan=plan: plan.symlink_to(plan),
            8: lambda plan=plan: plan.write_text(to_json(OTHER)),
        }
        kinds[number % 9]()
        (folder / "journal").write_bytes(b"\0" * 10)


def test_damaged_and_foreign_folders_are_passed_over(tmp_path: Path) -> None:
    folder = carry_out(PLAN, tmp_path)
    rubbish(tmp_path, 36)
    (tmp_path / "zebra").mkdir()
    (tmp_path / "notes.txt").write_text("mine")
    assert known(tmp_path) == Shown(("peak",), f"run {folder.name}")


def test_only_so_many_runs_are_looked_at(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    carry_out(PLAN, tmp_path)
    opened: list[object] = []
    plain = known_states.read_file
    monkeypatch.setattr(known_states, "read_file", lambda path, limit: opened.append(path) or plain(path, limit))
    rubbish(tmp_path, 400)
    assert known(tmp_path) == Shown()
    assert len(opened) == known_states.RUNS_SEEN


def test_only_so_much_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = carry_out(PLAN, tmp_path)
    size = (folder / "plan.json").stat().st_size
    (tmp_path / "900000-20260101-000000-big").mkdir()
    (tmp_path / "900000-20260101-000000-big" / "plan.json").write_bytes(b" " * size)
    for limit, states in ((2 * size, ("peak",)), (2 * size - 1, ())):
        monkeypatch.setattr(known_states, "BYTES_READ", limit)
        assert known(tmp_path).states == states


def test_only_so_many_runs_are_asked_about(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = carry_out(PLAN, tmp_path)
    asked: list[int] = []
    plain = known_states.was_last_run
    monkeypatch.setattr(
        known_states, "was_last_run", lambda radio, drive, tag: asked.append(tag) or plain(radio, drive, tag)
    )
    for number in range(20):
        other = tmp_path / f"{900000 + number}-20260101-000000-other"
        other.mkdir()
        write_plan(promising(PLAN, f"state-{min(number, 9)}"), other / "plan.json")
    assert known(tmp_path) == Shown()
    assert len(asked) == len(set(asked)) == known_states.RUNS_ASKED
    for number in range(17):
        shutil.rmtree(tmp_path / f"{900000 + number}-20260101-000000-other")
    assert known(tmp_path) == Shown(("peak",), f"run {folder.name}")


# What it is good for


@pytest.fixture
def planned_with(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, ...]]:
    """What plans were told of the states that the display shows."""
    told: list[tuple[str, ...]] = []
    plain = tours.plan_tour

    def spy(tour: Tour, begin: Whereabouts, listener: Listener) -> Plan:
        told.append(begin.shows)
        return plain(tour, begin, listener)

    for module in ("session", "dry_run"):
        monkeypatch.setattr(f"curveline.driving.{module}.plan_tour", spy)
    return told


def test_a_shape_is_planned_from_what_the_display_shows(run: Run, planned_with: list[tuple[str, ...]]) -> None:
    first, second = SHAPES / "level-up-peak.toml", SHAPES / "level-up-valley.toml"
    result = run("send", first, "--radio", "mock", "--yes")
    assert result.code == 0
    assert "the display shows" not in result.err
    dry = run("send", second, "--radio", "mock", "--dry-run")
    assert "the display shows: peak (the mock display remembers)\n" in dry.err
    dry = run("send", second, "--radio", "mock", "--dry-run", "--touched")
    assert "which curve the display shows is not known\n" in dry.err
    touched = run("send", second, "--radio", "mock", "--yes", "--touched")
    assert "which curve the display shows is not known\n" in touched.err
    assert touched.code == 0
    known = run("send", first, "--radio", "mock", "--yes")
    assert "the display shows: valley (the mock display remembers)\n" in known.err
    assert planned_with == [(), ("peak",), (), (), ("valley",)]


def test_over_a_radio_that_sees_no_rod_the_last_run_tells(
    run: Run, monkeypatch: pytest.MonkeyPatch, planned_with: list[tuple[str, ...]]
) -> None:
    monkeypatch.setattr(known_states, "known_rod", lambda radio: None)
    radio = ("--radio", "mock:loss=0.3,seed=8", "--yes")
    assert run("send", SHAPES / "level-up-peak.toml", *radio).code == 0
    second = run("send", SHAPES / "level-up-valley.toml", *radio)
    assert second.code == 0
    (told,) = [line for line in second.err.splitlines() if line.startswith("the display shows: ")]
    assert re.fullmatch(r"the display shows: peak \(run 000001-[0-9]{8}-[0-9]{6}-level-up-peak\)", told)
    assert planned_with == [(), ("peak",)]


@pytest.mark.parametrize(
    ("granted", "shown_now", "code", "says"),
    [
        ("valley", "valley", 0, "the display shows: valley (the mock display remembers)\n"),
        ("peak", "valley", 1, "error: segment 1 shows valley, but the plan takes peak for granted (the mock display"),
        ("valley", "", 0, "the plan takes for granted what is not known: the display shows valley\n"),
        ("", "valley", 0, ""),
    ],
)
def test_what_a_plan_takes_for_granted_is_held_against_what_is_known(
    run: Run, tmp_path: Path, granted: str, shown_now: str, code: int, says: str
) -> None:
    write_plan(PLAN, tmp_path / "there.json")
    assert run("send", tmp_path / "there.json", "--radio", "mock", "--yes").code == 1
    if not shown_now:
        path = tmp_path / "runs" / "mock-single.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | {"rod": []}))
        shutil.rmtree(next((tmp_path / "runs").glob("*-small")))
    write_plan(promising(replace(back(PLAN), shows=(granted,)), "straight"), tmp_path / "back.json")
    before = json.loads(run("status", "--radio", "mock", "--json").out)["nodes"][0]["counts"]
    result = run("send", tmp_path / "back.json", "--radio", "mock", "--yes")
    assert result.code == code, result.err
    assert says in result.err
    assert ("for granted" in result.err or "shows: " in result.err) is bool(says)
    after = json.loads(run("status", "--radio", "mock", "--json").out)["nodes"][0]["counts"]
    assert (after == before) is bool(code)
    assert ("hint: send the shape" in result.err) is bool(code)


def test_nodes_that_stand_elsewhere_are_the_first_thing_to_say_of_a_plan(run: Run, tmp_path: Path) -> None:
    write_plan(PLAN, tmp_path / "there.json")
    assert run("send", tmp_path / "there.json", "--radio", "mock", "--yes").code == 1
    # It shows a valley, but not where this plan would take a peak for granted.
    write_plan(sealed(replace(PLAN, shows=("peak",))), tmp_path / "again.json")
    result = run("send", tmp_path / "again.json", "--radio", "mock", "--yes")
    assert result.code == 3
    assert "does not stand where the plan starts" in result.err
    assert "for granted" not in result.err


def test_usage(run: Run, plan_file: Path) -> None:
    shape = SHAPES / "level-up-peak.toml"
    wrong = (
        (plan_file, "--touched"),
        (plan_file, plan_file),
        (shape, plan_file),
        (plan_file, "--home"),
        (shape, "--display", "single"),
        (shape, "--home", "--display", "single"),
        ("--home", "--resume", "last"),
        (),
    )
    for arguments in wrong:
        for more in ((), ("--dry-run",)):
            code, out, err = run("send", *arguments, "--radio", "mock", "--yes", *more)
            assert (code, out) == (2, ""), arguments
            assert "error" in err or "Usage" in out + err
            assert "Traceback" not in err
