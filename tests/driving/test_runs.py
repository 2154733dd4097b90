"""The runs on record: how they ended, which can go on, and what `last` means."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from curveline.driving.interrupted import find_interrupted_run
from curveline.driving.logbook import log_of, plain
from curveline.driving.runs import RunEnding, read_run, read_runs, unfinished
from curveline.errors import InvalidInput
from curveline.plan_file import Plan, sealed, write_plan
from curveline.radio.host.journal import FILE_NAME, Journal, new_run, read_journal
from curveline.radio.host.preflight import run_tag
from radio.bench import short_plan

PLAN = sealed(short_plan(2, 2))
QUAD = sealed(replace(PLAN, drive=replace(PLAN.drive, display="quad", digest="another")))
RELEASE: Mapping[str, Any] = {"type": "release", "step": 1}
PAUSE: Mapping[str, Any] = {"type": "pause", "step": 2}
END: Mapping[str, Any] = {"type": "end"}


def barrier(step: int, plan: Plan = PLAN) -> dict[str, Any]:
    return {"type": "barrier", "step": step, "boots": [1] * plan.drive.node_count}


def start(plan: Plan = PLAN) -> dict[str, Any]:
    boots = [1] * plan.drive.node_count
    head = {"type": "start", "run": f"{run_tag(plan):016x}", "plan": plan.name, "display": plan.drive.display}
    return {**head, "steps": [[] for _ in plan.steps], "boots": boots, "at": 1.8e9, "process": 42}


def halt(cause: str) -> dict[str, Any]:
    return {"type": "halt", "cause": cause, "node": 1, "step": 2, "message": f"node 1: {cause}"}


def a_run(runs: Path, *records: Mapping[str, Any], plan: Plan = PLAN) -> Path:
    folder = new_run(runs, plan.name)
    write_plan(plan, folder / "plan.json")
    with closing(Journal(folder)) as journal:
        for record in records:
            journal.append(record)
    return folder


def done(runs: Path, plan: Plan = PLAN) -> Path:
    steps = ({**RELEASE}, barrier(1, plan), {"type": "release", "step": 2}, barrier(2, plan))
    return a_run(runs, start(plan), *steps, END, plan=plan)


@pytest.mark.parametrize(
    ("records", "ending", "can", "words"),
    [
        ([start(), RELEASE, barrier(1), PAUSE], RunEnding.PAUSED, True, "was paused after 1 of 2 steps"),
        ([start(), RELEASE], RunEnding.CUT_OFF, True, "was cut off after 0 of 2 steps"),
        (
            [start(), RELEASE, barrier(1), halt("stall")],
            RunEnding.HALTED,
            True,
            "was halted after 1 of 2 steps: node 1",
        ),
        ([start(), RELEASE, halt("reboot")], RunEnding.HALTED, False, "was halted after 0 of 2 steps: node 1: reboot"),
        ([start(), RELEASE, halt("from the future")], RunEnding.HALTED, True, "was halted"),
        ([halt("silent")], RunEnding.NOT_BEGUN, False, "never began: node 1: silent"),
        ([], RunEnding.NOT_BEGUN, False, "never began"),
        ([start(), barrier(2)], RunEnding.DAMAGED, False, "cannot be believed"),
        ([start(), {"type": ["x"]}], RunEnding.DAMAGED, False, "cannot be believed"),
        ([{**start(), "run": "0"}], RunEnding.DAMAGED, False, "not of the plan"),
    ],
)
def test_how_a_run_ended(
    tmp_path: Path, records: list[Mapping[str, Any]], ending: RunEnding, can: bool, words: str
) -> None:
    run = read_run(a_run(tmp_path, *records))
    assert (run.ending, run.can_resume) == (ending, can)
    assert words in run.ended
    assert bool(run.command) is can
    assert can or run.advice, "what to do is said"


def test_a_run_that_is_being_sent_is_no_run_to_go_on_with(tmp_path: Path) -> None:
    older = a_run(tmp_path, start(), RELEASE)
    folder = new_run(tmp_path, "small")
    with closing(Journal(folder)) as journal:
        journal.append(start())
        assert read_run(folder).ending is RunEnding.SENDING
        assert unfinished(tmp_path).run.folder == older
        (older / FILE_NAME).unlink()
        assert unfinished(tmp_path).run.ending is RunEnding.SENDING


def test_last_is_the_newest_that_can_go_on_whatever_the_clock_says(tmp_path: Path) -> None:
    a_run(tmp_path, start(), RELEASE)
    wanted = a_run(tmp_path, start(), RELEASE, barrier(1), PAUSE)
    done(tmp_path, QUAD)
    for age, folder in enumerate(sorted(tmp_path.iterdir(), reverse=True)):
        os.utime(folder / FILE_NAME, (10**9 + age, 10**9 + age))
    newest = unfinished(tmp_path)
    assert (newest.run.folder, newest.broken, newest.since) == (wanted, (), ())
    assert unfinished(tmp_path, "test").run.folder == wanted


def test_last_is_of_one_display_if_one_is_named(tmp_path: Path) -> None:
    single = a_run(tmp_path, start(), RELEASE)
    quad = a_run(tmp_path, start(QUAD), RELEASE, plan=QUAD)
    assert unfinished(tmp_path).run.folder == quad
    assert unfinished(tmp_path, "test").run.folder == single
    with pytest.raises(InvalidInput, match="there is no run of display other"):
        unfinished(tmp_path, "other")


def test_a_run_that_cannot_go_on_is_passed_over_and_named(tmp_path: Path) -> None:
    wanted = a_run(tmp_path, start(), RELEASE)
    broken = a_run(tmp_path, start(), RELEASE, halt("reboot"))
    damaged = a_run(tmp_path, start(), barrier(2))
    a_run(tmp_path)
    newest = unfinished(tmp_path)
    assert newest.run.folder == wanted
    assert [each.folder for each in newest.broken] == [damaged, broken]
    assert [each.folder for each in newest.since] == [damaged, broken]


def test_where_nothing_can_go_on_the_last_run_is_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="there is no run in"):
        unfinished(tmp_path)
    broken = a_run(tmp_path, start(), RELEASE, halt("reboot"))
    with pytest.raises(InvalidInput, match=rf"the last one, {broken.name} of display test, was halted") as one:
        unfinished(tmp_path)
    assert "send the shape again" in one.value.hint
    finished = done(tmp_path)
    with pytest.raises(InvalidInput) as both:
        unfinished(tmp_path)
    assert f"the last one, {finished.name} of display test, was done to its end" in both.value.message
    assert f"{broken.name} was halted after 0 of 2 steps: node 1: reboot" in both.value.message


# Folders as strangers leave them

HOSTILE = {
    "text": {"plan": "\x1b[2J", "display": "a\nb", "at": 1e400},
    "types": {"plan": 7, "display": ["x"], "steps": "many", "boots": {}, "at": "noon", "process": -1},
    "numbers": {"at": 1e300, "process": 10**30, "steps": [0] * 10**4},
    "deep": {"plan": json.loads("[" * 400 + "]" * 400), "by": json.loads("[" * 400 + "]" * 400)},
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_record_is_listed_and_nothing_steers_the_terminal(tmp_path: Path, kind: str) -> None:
    records = [{**start(), **HOSTILE[kind]}, {**halt("reboot"), "message": "\x07", "step": 10**9, **HOSTILE[kind]}]
    folder = a_run(tmp_path, *records, {"type": "\x1b", "step": True})
    run = read_run(folder)
    assert run.ending is RunEnding.DAMAGED
    entries = log_of(read_journal(folder / FILE_NAME))
    for text in (run.plan, run.display, run.ended, run.advice, *(each.what + each.hint for each in entries)):
        assert text.isprintable()
    json.dumps(plain(read_journal(folder / FILE_NAME)), allow_nan=False)


def test_damaged_folders_are_listed_as_such(tmp_path: Path) -> None:
    a_run(tmp_path, start(), RELEASE, barrier(1), PAUSE)
    gap = a_run(tmp_path, start(), RELEASE, barrier(1), PAUSE)
    path = gap / FILE_NAME
    path.write_bytes(path.read_bytes().replace(b'"release"', b'"Release"'))
    fifo = new_run(tmp_path, "fifo")
    os.mkfifo(fifo / FILE_NAME)
    link = new_run(tmp_path, "link")
    (link / FILE_NAME).symlink_to(link / FILE_NAME)
    plan = a_run(tmp_path, start(), RELEASE)
    (plan / "plan.json").write_text("{")
    bare = new_run(tmp_path, "bare")
    os.mkdir(os.fsencode(tmp_path) + b"/000009-20260101-000000-\x1b[2J\xff")
    found = {run.folder: run for run in read_runs(tmp_path)}
    assert [found[folder].ending for folder in (gap, fifo, link)] == [RunEnding.DAMAGED] * 3
    assert (found[plan].ending, found[plan].is_stuck) == (RunEnding.CUT_OFF, True)
    assert "it cannot go on: " in found[plan].ended
    assert all(found[folder].advice for folder in (gap, fifo, link, plan))
    assert found[bare].ending is RunEnding.NOT_BEGUN
    assert len(found) == 7
    assert all(run.name.isprintable() for run in found.values())


def test_who_opens_a_run_forgets_what_a_killed_sender_left(tmp_path: Path) -> None:
    folder = a_run(tmp_path, start(), RELEASE)
    left = [folder / "live.json", folder / "stop-0123456789abcdef"]
    for path in left:
        path.touch()
    broken = find_interrupted_run(folder.name, tmp_path)
    with broken.opened():
        assert not any(path.exists() for path in left)


def test_a_log_says_who_did_what(tmp_path: Path) -> None:
    records = [
        start(),
        RELEASE,
        {**halt("stall"), "at": 1.8e9},
        {"type": "resume", "step": 1, "process": 43},
        {**PAUSE, "by": "`curveline stop` in process 44"},
    ]
    entries = log_of(records)
    assert [each.what for each in entries] == [
        "begun by process 42 with 2 nodes",
        "released",
        "halted: node 1: stall",
        "gone on with by process 43, at step 1",
        "paused, all nodes hold, asked for by `curveline stop` in process 44",
    ]
    assert [each.step for each in entries] == [0, 1, 2, 1, 2]
    assert "`curveline node clear 1 --display test`" in entries[2].hint
    assert (entries[0].at, entries[1].at) == (1.8e9, None)
