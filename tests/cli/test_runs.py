"""`curveline runs`, and what `send --resume last` takes."""

from __future__ import annotations

import json
import os
import time
from dataclasses import replace
from pathlib import Path

import pytest

from curveline.cli.printing.progress import run_progress
from curveline.plan_file import sealed, write_plan
from curveline.radio.host.journal import read_journal
from curveline.radio.host.link import OperatorRequest, Progress

from .conftest import SHAPES, Run, promising, small_plan


@pytest.fixture
def paused(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Send a plan that is paused once a step has begun; the name of its run."""

    def send(step: int = 1, request: OperatorRequest = OperatorRequest.PAUSE, display: str = "single") -> str:
        plain = run_progress.Lines.__call__

        def call(self: run_progress.Lines, news: Progress) -> None:
            plain(self, news)
            if news.status.started == step:
                self._control.ask(request)

        write_plan(small_plan(steps=3, display=display), tmp_path / "paused.json", force=True)
        with monkeypatch.context() as patched:
            patched.setattr(run_progress.Lines, "__call__", call)
            assert run("send", tmp_path / "paused.json", "--radio", "mock:fresh", "--yes").code == 130
        return names(tmp_path)[-1]

    return send


def names(tmp_path: Path) -> list[str]:
    return sorted(journal.parent.name for journal in (tmp_path / "runs").glob("*/journal"))


@pytest.fixture
def other_display(tmp_path: Path, run: Run) -> Path:
    """The file of a display like the built-in one but for its name."""
    path = tmp_path / "twin.toml"
    path.write_text(run("display", "show", "single").out.replace('name = "single"', 'name = "twin"'))
    return path


def test_runs_are_listed_the_newest_first(run: Run, paused, plan_file: Path, tmp_path: Path) -> None:
    assert run("runs").out == "no runs\n"
    first = paused()
    assert run("send", plan_file, "--radio", "mock:stall=1@step2,fresh", "--yes").code == 3
    assert run("send", plan_file, "--radio", "mock:reboot=1@step2,fresh", "--yes").code == 3
    assert run("send", plan_file, "--radio", "mock:fresh", "--yes").code == 0
    code, out, err = run("runs")
    assert (code, err) == (0, "")
    found = names(tmp_path)
    assert [line for line in out.splitlines() if not line.startswith(" ")] == found[::-1]
    assert "  was done to its end\n" in out
    assert f"  was paused after 1 of 3 steps\n  to go on: curveline send --resume {first}\n" in out
    assert "  was halted after 1 of 2 steps: node 1 has restarted in step 2" in out
    assert "  first: free what blocks it" in out
    document = json.loads(run("runs", "--json").out)
    assert [each["ending"] for each in document["runs"]] == ["done", "halted", "halted", "paused"]
    assert [each["can_resume"] for each in document["runs"]] == [False, False, True, True]
    assert document["runs"][3]["resume"] == f"curveline send --resume {first}"
    assert document["is_more"] is False


def test_only_so_many_are_listed_and_only_of_one_display(run: Run, paused, other_display: Path, tmp_path: Path) -> None:
    paused()
    twin = paused(display=str(other_display))
    for number in range(100, 125):
        (tmp_path / "runs" / f"{number:06}-20260101-000000-x").mkdir()
    code, out, err = run("runs")
    assert code == 0
    assert out.count("never began") == 20
    assert "--all" in err
    document = json.loads(run("runs", "--all", "--json").out)
    assert (len(document["runs"]), document["is_more"]) == (27, False)
    document = json.loads(run("runs", "--display", other_display, "--all", "--json").out)
    assert twin in [each["run"] for each in document["runs"]]
    assert {each["display"] for each in document["runs"]} == {"twin", None}


def test_a_run_is_shown_as_a_log(run: Run, paused, tmp_path: Path) -> None:
    name = paused()
    assert run("send", "--resume", name, "--radio", "mock:stall=2@step3", "--yes").code == 3
    for which in (name, "last", tmp_path / "runs" / name):
        code, out, err = run("runs", "show", which)
        assert (code, err) == (0, "")
    log = [line[21:] for line in out.splitlines() if line[:2] == "20"]
    assert log[:4] == [
        f"          begun by process {os.getpid()} with 2 nodes",
        "step 1    released",
        "step 1    done by all nodes",
        "step 2    paused, all nodes hold",
    ]
    assert f"step 2    gone on with by process {os.getpid()}, at step 2" in log
    assert "step 3    halted: node 2 has stalled in step 3: its extrude motor does not follow" in log
    assert "hint: free what blocks it" in out
    document = json.loads(run("runs", "show", "last", "--json").out)
    assert document["records"] == read_journal(tmp_path / "runs" / name / "journal")
    assert (document["run"], document["ending"]) == (name, "halted")


def test_usage_and_damage(run: Run, paused, tmp_path: Path) -> None:
    assert run("runs", "show", "last").code == 2
    assert run("runs", "show", "nobody").code == 2
    assert run("runs", "--json", "show", "last").code == 2
    name = paused()
    path = tmp_path / "runs" / name / "journal"
    path.write_bytes(path.read_bytes().replace(b'"release"', b'"\x1b[2Jase"'))
    code, out, err = run("runs")
    assert code == 0
    assert "  is damaged: " in out
    assert "  cannot go on: this run cannot be trusted any more" in out
    code, out, err = run("runs", "show", name)
    assert code == 2
    assert "is damaged" in out
    assert "\x1b" not in out + err
    assert json.loads(run("runs", "show", name, "--json").out)["records"] == []
    path.unlink()
    code, out, _ = run("runs", "show", name)
    assert (code, "never began" in out) == (0, True)


def test_last_goes_by_the_order_of_runs_not_by_the_clock(
    run: Run, paused, plan_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run("send", plan_file, "--radio", "mock:fresh", "--yes").code == 0
    monkeypatch.setattr(time, "strftime", lambda *form: "19990101-000000")
    name = paused()
    os.utime(tmp_path / "runs" / name / "journal", (0, 0))
    code, _, err = run("send", "--resume", "last", "--radio", "mock", "--yes")
    assert code == 0, err
    assert f"the newest that can go on: {name} of display single, which was paused after 1 of 3 steps\n" in err


def test_a_finished_run_of_another_display_hides_nothing(run: Run, paused, other_display: Path, tmp_path: Path) -> None:
    name = paused()
    write_plan(small_plan(display=str(other_display)), tmp_path / "twin.json")
    assert run("send", tmp_path / "twin.json", "--radio", "mock", "--yes").code == 0
    twin = names(tmp_path)[-1]
    code, out, err = run("send", "--resume", "last", "--display", other_display, "--radio", "mock", "--yes")
    assert (code, out) == (2, "")
    assert f"no run of display twin can go on: the last one, {twin} of display twin, was done to its end\n" in err
    assert run("send", "--resume", "last", "--radio", "mock", "--yes").code == 0
    assert run("send", "--resume", name, "--display", "single", "--radio", "mock", "--yes").code == 2


def test_a_run_that_cannot_go_on_is_passed_over_and_named(run: Run, paused, plan_file: Path, tmp_path: Path) -> None:
    name = paused()
    write_plan(small_plan(display="single", seconds=0.6), tmp_path / "again.json")
    assert run("send", plan_file, "--radio", "mock:fresh,reboot=1@step2", "--yes").code == 3
    code, _, err = run("send", "--resume", "last", "--radio", "mock", "--yes", "--dry-run")
    assert code == 0
    assert f"passed over: {names(tmp_path)[-1]} was halted after 1 of 2 steps: node 1 has restarted in step 2" in err
    assert f"the newest that can go on: {name} of display single" in err


# What the rod shows is held against the step that was done


def test_a_pause_is_held_against_its_step_not_against_the_end(run: Run, tmp_path: Path, paused) -> None:
    plan = small_plan(steps=3)
    steps = [
        replace(step, states=(states,))
        for step, states in zip(plan.steps, ("peak|valley", "peak", "peak"), strict=True)
    ]
    write_plan(sealed(replace(plan, steps=tuple(steps), wanted=("peak",))), tmp_path / "small.json")
    ends = {}
    for step in (1, 2):
        plain = run_progress.Lines.__call__

        def call(self: run_progress.Lines, news: Progress, step: int = step, plain=plain) -> None:
            plain(self, news)
            if news.status.started == step:
                self._control.ask(OperatorRequest.PAUSE)

        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(run_progress.Lines, "__call__", call)
            ends[step] = run("send", tmp_path / "small.json", "--radio", "mock:fresh", "--yes")
    assert ends[1].out.endswith("segment 1: the rod is in the valley, as step 1 leaves it\n")
    assert ends[2].out.endswith("segment 1: the rod is in the valley, not the peak that step 2 promises\n")


def test_a_halt_is_held_against_its_step(run: Run, tmp_path: Path) -> None:
    write_plan(promising(small_plan(steps=3), "peak"), tmp_path / "small.json")
    code, _, err = run("send", tmp_path / "small.json", "--radio", "mock:stall=1@step2", "--yes")
    assert code == 3
    assert "segment 1: the rod is in the valley, as step 1 leaves it\n" in err


def test_what_happened_before_a_resume_has_no_time(run: Run, tmp_path: Path) -> None:
    """The nodes went on to the end of a step after their host was killed, and the rod snapped on the way."""
    assert run("send", SHAPES / "level-down-peak.toml", "--radio", "mock:fresh", "--yes").code == 0
    (path,) = (tmp_path / "runs").glob("*/journal")
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:-1]))
    code, out, err = run("send", "--resume", "last", "--radio", "mock", "--yes", "--json")
    assert code == 0, err
    snaps = json.loads(out)["rod"]["snaps"]
    assert snaps
    assert {snap["seconds"] for snap in snaps} == {None}


def test_a_resume_that_is_refused_tells_of_no_motion(run: Run, paused, plan_file: Path, tmp_path: Path) -> None:
    """A run that was killed, and another one since: the way through the first one's steps is not what the rod did."""
    name = paused(step=2)
    path = tmp_path / "runs" / name / "journal"
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:-1]))
    assert run("send", plan_file, "--radio", "mock:fresh", "--yes").code == 0
    before = json.loads(run("status", "--radio", "mock", "--json").out)["rod"]
    code, _, err = run("send", "--resume", name, "--radio", "mock", "--yes")
    assert code == 3
    assert "knows nothing of this run" in err
    assert "snapped" not in err
    assert "segment 1" not in err
    assert json.loads(run("status", "--radio", "mock", "--json").out)["rod"] == before
