"""`curveline send --resume`: runs that were paused, killed and halted, and those that cannot go on."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

import standby
from curveline.plan_file import read_plan, sealed, write_plan
from curveline.radio.host.journal import ReopenedJournal, read_journal
from curveline.radio.host.link import Control, OperatorRequest

from .conftest import SHAPES, Run, failure, small_plan

SHAPE = SHAPES / "level-up-peak.toml"


@pytest.fixture
def asking(monkeypatch: pytest.MonkeyPatch):
    """Ask for something as soon as a step has begun, once, as somebody at the keyboard would."""
    from curveline.cli.printing.progress import run_progress

    def ask(request: OperatorRequest, step: int) -> None:
        plain, asked = run_progress.Lines.__call__, []

        def call(self: run_progress.Lines, news: object) -> None:
            plain(self, news)  # type: ignore[arg-type]
            if not asked and news.step == step and news.status.started == step:  # type: ignore[attr-defined]
                asked.append(step)
                self._control.ask(request)

        monkeypatch.setattr(run_progress.Lines, "__call__", call)

    return ask


def only_run(tmp_path: Path) -> Path:
    (journal,) = (tmp_path / "runs").glob("*/journal")
    return journal.parent


def kinds(tmp_path: Path) -> list[str]:
    return [str(record["type"]) for record in read_journal(only_run(tmp_path) / "journal")]


@pytest.mark.parametrize("request_", [OperatorRequest.PAUSE, OperatorRequest.HOLD])
def test_a_paused_shape_goes_on_to_its_end(run: Run, asking, tmp_path: Path, request_: OperatorRequest) -> None:
    asking(request_, 3)
    code, out, err = run("send", SHAPE, "--radio", "mock", "--yes")
    assert code == 130
    assert out.startswith("paused: ")
    folder = only_run(tmp_path)
    assert f"to go on with this run: curveline send --resume {folder.name}\n" in err
    code, out, err = run("send", "--resume", folder.name, "--radio", "mock", "--yes", "--json")
    assert code == 0, err
    document = json.loads(out)
    assert (document["outcome"], document["steps_done"], document["steps"]) == ("done", 5, 5)
    assert document["rod"]["states"] == ["peak"]
    assert document["run"] == str(folder)
    assert only_run(tmp_path) == folder
    assert kinds(tmp_path).count("start") == kinds(tmp_path).count("resume") == kinds(tmp_path).count("end") == 1
    assert "goes on " in err


@pytest.mark.parametrize("chosen", ["--runs", "environment"])
def test_a_run_elsewhere_is_named_by_its_path(
    run: Run, asking, plan_file: Path, tmp_path: Path, chosen: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = tmp_path / "with spaces"
    options = ("--runs", elsewhere) if chosen == "--runs" else ()
    if chosen == "environment":
        monkeypatch.setenv("CURVELINE_RUNS", str(elsewhere))
    asking(OperatorRequest.PAUSE, 1)
    err = run("send", plan_file, "--radio", "mock", "--yes", *options).err
    assert err.count("curveline send --resume") == 2, "before the run, for whoever finds it killed, and after it"
    (folder,) = (journal.parent for journal in elsewhere.glob("*/journal"))
    named = f"'{folder}'" if chosen == "--runs" else folder.name
    assert f"curveline send --resume {named}\n" in err
    assert run("send", "--resume", named.strip("'"), "--radio", "mock", "--yes", *options).code == 0


def test_a_dry_run_shows_what_is_left_and_touches_nothing(run: Run, asking, plan_file: Path, tmp_path: Path) -> None:
    asking(OperatorRequest.PAUSE, 1)
    assert run("send", plan_file, "--radio", "mock", "--yes").code == 130
    before = {path: path.read_bytes() for path in (tmp_path / "runs").rglob("*") if path.is_file()}
    code, out, err = run("send", "--resume", "last", "--dry-run", "--json")
    assert code == 0
    assert "small: goes on with step 2 of 2\n" in err
    assert {frame["step"] for frame in json.loads(out)["frames"]} == {2}
    assert {path: path.read_bytes() for path in before} == before


def test_a_run_goes_on_whatever_its_plan_took_for_granted(run: Run, asking, tmp_path: Path) -> None:
    write_plan(sealed(replace(small_plan(), shows=("peak",))), tmp_path / "small.json")
    asking(OperatorRequest.PAUSE, 1)
    paused = run("send", tmp_path / "small.json", "--radio", "mock", "--yes")
    assert paused.code == 130
    assert "the plan takes for granted what is not known: the display shows peak\n" in paused.err
    # By now the display shows what the first step made of it.
    assert json.loads(run("status", "--radio", "mock", "--json").out)["rod"] == ["valley"]
    resumed = run("send", "--resume", "last", "--radio", "mock", "--yes")
    assert resumed.code == 0
    assert "granted" not in resumed.err


def test_what_is_left_of_a_run_is_said(run: Run, plan_file: Path, tmp_path: Path) -> None:
    assert run("send", plan_file, "--radio", "mock", "--yes").code == 0
    path = only_run(tmp_path) / "journal"
    lines = path.read_bytes().splitlines(keepends=True)
    for count, words in ((1, "with step 1 of 2"), (2, "in the midst of step 1 of 2"), (5, "all 2 steps are done")):
        path.write_bytes(b"".join(lines[:count]))
        assert words in run("send", "--resume", "last", "--dry-run").err


def test_a_run_that_is_done_is_not_done_again(run: Run, plan_file: Path, tmp_path: Path) -> None:
    assert run("send", plan_file, "--radio", "mock", "--yes").code == 0
    code, out, err = run("send", "--resume", "last", "--radio", "mock", "--yes")
    assert (code, out) == (2, "")
    name = only_run(tmp_path).name
    assert f"can go on: the last one, {name} of display single, was done to its end\n" in err
    code, out, err = run("send", "--resume", name, "--radio", "mock", "--yes")
    assert (code, out) == (2, "")
    assert f"error: run {name}: there is nothing to resume: the run has been done to its end" in err


def test_usage(run: Run, plan_file: Path) -> None:
    for arguments in ((plan_file, "--resume", "last"), ("--yes",), ("--resume", "nobody")):
        code, out, err = run("send", *arguments, "--radio", "mock")
        assert (code, out) == (2, "")
        assert "Traceback" not in err


def test_a_full_disk_holds_the_nodes_and_the_run_goes_on_when_there_is_space(
    run: Run, plan_file: Path, tmp_path: Path
) -> None:
    code, out, err = run("send", plan_file, "--radio", "mock:disk=full@step2", "--yes")
    assert (code, out) == (3, "")
    assert "No space left on device" in err
    assert f"curveline send --resume {only_run(tmp_path).name}" in err
    assert run("send", "--resume", "last", "--radio", "mock", "--yes").code == 0


@pytest.mark.parametrize(
    ("mishap", "can"),
    [("gone@step1", True), ("silence=1@step1", True), ("stall=1@step2", True), ("reboot=2@step1", False)],
)
def test_after_a_halt_the_way_on_is_told_if_there_is_one(run: Run, tmp_path: Path, mishap: str, can: bool) -> None:
    write_plan(small_plan(seconds=3.0), tmp_path / "plan.json")
    code, out, err = run("send", tmp_path / "plan.json", "--radio", f"mock:{mishap}", "--yes")
    assert (code, out) == (3, "")
    assert ("to go on with this run: curveline send --resume" in err) is can
    code, out, err = run("send", "--resume", "last", "--radio", "mock", "--yes", "--json")
    if can:
        assert code == 0, err
        assert json.loads(out)["outcome"] == "done"
    else:
        assert code == 2
        assert "node 2 has restarted in step 1" in failure(out, 2)["message"]
        assert f"can go on: the last one, {only_run(tmp_path).name} of display single, was halted after 0" in err
        assert "0 of 2 steps: node 2 has restarted in step 1" in err
        assert "hint: check its supply; then send the shape again" in err
        code, out, err = run("send", "--resume", only_run(tmp_path).name, "--radio", "mock", "--yes")
        assert (code, out) == (2, "")
        assert "this run cannot be resumed after its halt: node 2 has restarted in step 1" in err


def test_an_emergency_stop_is_not_gone_on_with(run: Run, asking, plan_file: Path) -> None:
    asking(OperatorRequest.ESTOP, 1)
    code, _, err = run("send", plan_file, "--radio", "mock", "--yes")
    assert code == 130
    assert "to go on with this run" not in err
    code, _, err = run("send", "--resume", "last", "--radio", "mock", "--yes")
    assert code == 2
    assert "emergency stop" in err


def test_a_display_that_was_replaced_is_no_place_to_go_on(run: Run, asking, plan_file: Path) -> None:
    asking(OperatorRequest.PAUSE, 1)
    assert run("send", plan_file, "--radio", "mock", "--yes").code == 130
    code, out, err = run("send", "--resume", "last", "--radio", "mock:fresh", "--yes")
    assert (code, out) == (3, "")
    assert "error: node 1 knows nothing of this run" in err
    assert "to go on with this run" not in err


def test_a_run_that_another_process_sends_is_not_sent_twice(run: Run, asking, plan_file: Path, tmp_path: Path) -> None:
    asking(OperatorRequest.PAUSE, 1)
    assert run("send", plan_file, "--radio", "mock", "--yes").code == 130
    other = ReopenedJournal(only_run(tmp_path))
    code, out, err = run("send", "--resume", "last", "--radio", "mock", "--yes")
    other.close()
    assert (code, out) == (3, "")
    assert f"another process is sending the run {only_run(tmp_path).name}" in err


def test_a_plan_that_was_changed_is_not_the_one_that_was_sent(
    run: Run, asking, plan_file: Path, tmp_path: Path
) -> None:
    asking(OperatorRequest.PAUSE, 1)
    assert run("send", plan_file, "--radio", "mock", "--yes").code == 130
    write_plan(small_plan(seconds=0.6), only_run(tmp_path) / "plan.json", force=True)
    code, out, err = run("send", "--resume", "last", "--radio", "mock", "--yes")
    assert (code, out) == (2, "")
    assert "not of the plan that is kept beside it" in err


def test_a_run_of_an_older_release_or_with_an_edited_plan_cannot_be_resumed(
    run: Run, asking, plan_file: Path, tmp_path: Path
) -> None:
    asking(OperatorRequest.PAUSE, 1)
    assert run("send", plan_file, "--radio", "mock", "--yes").code == 130
    kept = only_run(tmp_path) / "plan.json"
    document = json.loads(kept.read_text())
    older = {key: value for key, value in document.items() if key != "seal"} | {"curveline_plan": 2}
    for changed, says in (
        (older, "made by an older release and is not sealed"),
        (document | {"name": "edited"}, "the seal does not fit"),
    ):
        kept.write_text(json.dumps(changed))
        for more in (("--radio", "mock", "--yes"), ("--dry-run",)):
            code, out, err = run("send", "--resume", "last", *more)
            assert (code, out) == (2, "")
            assert "can go on: the last one, " in err
            assert says in " ".join(err.split())
            assert "hint: send the shape again" in err
    kept.write_text(json.dumps(document))
    assert run("send", "--resume", "last", "--radio", "mock", "--yes").code == 0


def test_takeover_is_handed_to_the_nodes(run: Run, plan_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[bool] = []
    plain = Control.__init__

    def build(self: Control, policy: object = None, **options: bool) -> None:
        plain(self, policy, **options)  # type: ignore[arg-type]
        seen.append(self.policy.takeover)

    monkeypatch.setattr(Control, "__init__", build)
    assert run("send", plan_file, "--radio", "mock", "--yes").code == 0
    assert run("send", plan_file, "--radio", "mock:fresh", "--yes", "--takeover").code == 0
    assert seen == [False, True]


@pytest.mark.parametrize("seed", range(2))
def test_killed_for_real_and_gone_on_with_by_the_command_line(tmp_path: Path, seed: int) -> None:
    write_plan(small_plan(steps=9, seconds=0.8), tmp_path / "plan.json")
    env = {**os.environ, "CURVELINE_RUNS": str(tmp_path / "runs")}
    command = [sys.executable, "-m", "curveline", "send", "plan.json", "--radio", "mock:realtime", "--yes"]
    with (tmp_path / "said").open("w") as said:
        process = subprocess.Popen(command, cwd=tmp_path, env=env, stderr=said, stdout=said)
    while f"step {1 + seed} of 9" not in (tmp_path / "said").read_text():
        assert process.poll() is None, (tmp_path / "said").read_text()
        time.sleep(0.02)
    time.sleep(Random(seed).random() * 0.8)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    begun = [*standby.python(env), "-m", "curveline"]
    command = [*begun, "send", "--resume", "last", "--radio", "mock", "--yes", "--json"]
    done = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, (seed, done.stderr)
    assert json.loads(done.stdout)["steps_done"] == 9
    steps = [(each["type"], each.get("step")) for each in read_journal(only_run(tmp_path) / "journal")]
    steps = [each for each in steps if each[0] in ("release", "barrier", "end")]
    wanted = [(kind, step) for step in range(1, 10) for kind in ("release", "barrier")]
    assert steps == [*wanted, ("end", None)]


@pytest.mark.parametrize("refused", ["--home", "plan"])
def test_a_send_that_is_refused_leaves_the_run_before_it_as_it_was(
    run: Run, tmp_path: Path, plan_file: Path, refused: str
) -> None:
    """A stalled node can neither go home nor begin another plan; the run in which it stalled still goes on."""
    write_plan(small_plan(seconds=3.0), tmp_path / "plan.json")
    assert run("send", tmp_path / "plan.json", "--radio", "mock:stall=1@step2", "--yes").code == 3
    again = ("--home",) if refused == "--home" else (plan_file,)
    code, out, err = run("send", *again, "--radio", "mock", "--yes")
    assert (code, out) == (3, "")
    assert "node 1 has stalled" in err
    assert "that it broke off: `curveline send --resume last`" in err
    assert run("send", "--resume", "last", "--radio", "mock", "--yes").code == 0


def test_a_plan_from_elsewhere_leaves_the_run_before_it_as_it_was(
    run: Run, asking, tmp_path: Path, plan_file: Path
) -> None:
    asking(OperatorRequest.PAUSE, 1)
    assert run("send", plan_file, "--radio", "mock", "--yes").code == 130
    code, _, err = run("send", plan_file, "--radio", "mock", "--yes")
    assert code == 3
    assert "does not stand where the plan starts" in err
    assert run("send", "--resume", "last", "--radio", "mock", "--yes").code == 0


def test_a_run_that_moved_nothing_yet_is_held_against_what_the_display_shows(run: Run, tmp_path: Path) -> None:
    """Killed between the record of its start and its first release; somebody then snapped the rod."""
    assert run("send", SHAPES / "level-up-peak.toml", "--radio", "mock", "--yes").code == 0
    assert run("send", SHAPES / "level-down-peak.toml", "--radio", "mock", "--yes").code == 0
    journal = sorted((tmp_path / "runs").glob("*/journal"))[-1]
    start = journal.read_bytes().split(b"\n")[0] + b"\n"
    plan = read_plan(journal.parent / "plan.json")
    assert plan.shows == ("peak",)
    journal.write_bytes(start)
    path = tmp_path / "runs" / "mock-single.json"
    content = json.loads(path.read_text())
    for node, target in zip(content["nodes"], plan.start, strict=True):
        node |= {"counts": target.counts, "started": 0, "finished": 0, "staged": 0}
    content |= {"rod": ["valley"], "rod_at": [target.counts for target in plan.start]}
    path.write_text(json.dumps(content))
    refused = run("send", "--resume", "last", "--radio", "mock", "--yes")
    assert (refused.code, refused.out) == (1, "")
    assert "segment 1 shows valley, but the plan takes peak for granted" in refused.err
    content["rod"] = ["peak"]
    path.write_text(json.dumps(content))
    assert run("send", "--resume", "last", "--radio", "mock", "--yes").code == 0
