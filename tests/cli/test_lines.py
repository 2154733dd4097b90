"""`curveline send FOLDER`: several displays in one run, as people and scripts see it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from driving.lines_folder import lines_folder, quick_lines

from .conftest import FAILURE_KEYS, Run
from .terminals import in_terminal

LIMIT_S = 30.0
LINE_KEYS = {"line", "plan", "display", "radio", "outcome", "steps_done", "steps", "seconds", "nodes", "wanted"} | {
    "promised",
    "rod",
    "shapes",
    "run",
    "error",
}


def test_a_folder_is_sent_and_told_of_in_a_table_of_80_columns(run: Run, tmp_path: Path) -> None:
    folder = lines_folder(tmp_path / "roof", ["mock:loss=0.3"] * 3, plans=3)
    code, out, err = run("send", str(folder), "--yes")
    assert code == 0
    lines = out.splitlines()
    assert lines[0].startswith("done: ")
    assert " steps of 3 lines in " in lines[0]
    assert lines[1].split() == ["line", "ended", "steps", "of", "time", "s", "polls", "lost", "rod"]
    assert [line.split()[:2] for line in lines[2:]] == [["L1", "done"], ["L2", "done"], ["L3", "done"]]
    assert all(line.endswith("as wanted") for line in lines[2:])
    assert max(map(len, lines)) <= 80
    assert "line L2: step 1 of " in err
    assert "record: " in err


def test_in_short_there_is_a_line_for_each(run: Run, tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", ["mock"] * 2)
    out = run("send", str(folder), "--yes", "--brief").out
    assert out.splitlines()[1:] == ["L1: done, 2 of 2 steps", "L2: done, 2 of 2 steps"]


def test_json_is_one_document_with_all_lines(run: Run, tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", ["mock"] * 2, currents=[1.0, 1.0], limit=1.5)
    code, out, _ = run("send", str(folder), "--yes", "--json")
    assert code == 0
    (line,) = out.splitlines()
    document = json.loads(line)
    keys = {"curveline", "name", "outcome", "steps_done", "steps", "seconds", "current_limit_A", "lines", "run"}
    assert set(document) == keys
    assert (document["name"], document["outcome"], document["steps_done"]) == ("roof", "done", 4)
    assert document["current_limit_A"] == 1.5
    assert [set(each) for each in document["lines"]] == [LINE_KEYS] * 2
    assert [each["line"] for each in document["lines"]] == ["L1", "L2"]
    assert all(each["error"] is None for each in document["lines"])


def test_a_fault_is_told_with_all_lines_and_the_way_on_works_as_printed(run: Run, tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", ["mock", "mock:stall=2@step2"], [4, 4])
    code, out, err = run("send", str(folder), "--yes", "--json")
    assert code == 3
    document = json.loads(out)
    assert document["outcome"] == "halted"
    assert set(document["error"]) == FAILURE_KEYS
    assert (document["error"]["code"], document["error"]["cause"]) == ("halted", "stall")
    assert [each["outcome"] for each in document["lines"]] == ["paused", "halted"]
    told = document["lines"][1]["error"]
    assert (told["cause"], told["node"]) == ("stall", 2)
    assert "error: line L2: node 2 has stalled in step 2" in err
    (way_on,) = [line for line in err.splitlines() if line.startswith("to go on with this run: ")]
    code, out, _ = run(*way_on.split()[-3:])
    assert (code, out) == (2, "")
    code, out, err = run(*way_on.split()[-3:], "--yes")
    assert code == 0
    assert "0 of 2 lines are done, 2 go on" in err
    assert out.startswith("done: 8 of 8 steps of 2 lines")


def test_a_hint_that_names_the_display_of_a_line_finds_the_run_of_all(run: Run, tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", ["mock", "mock:stall=2@step2"], [4, 4])
    run("send", str(folder), "--yes")
    display = str(folder / "display-2.toml")
    assert run("send", "--resume", "last", "--display", display, "--yes").code == 0
    assert run("send", "--resume", "last", "--display", display, "--yes").code == 2


def test_runs_have_their_lines_in_them(run: Run, tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", ["mock", "mock:stall=2@step2", "mock"], [1, 4, 4])
    run("send", str(folder), "--yes")
    out = run("runs").out
    assert "  3 lines, plan roof, began " in out
    assert "was halted after " in out
    assert "line L2: node 2 has stalled in step 2" in " ".join(out.split())
    assert "  to go on: curveline send --resume " in out
    document = json.loads(run("runs", "--json").out)["runs"][0]
    assert document["display"] is None
    assert [each["line"] for each in document["lines"]] == ["L1", "L2", "L3"]
    assert [each["ending"] for each in document["lines"]] == ["done", "halted", "paused"]
    assert run("runs", "--display", str(folder / "display-3.toml"), "--brief").out.count("\n") == 1
    assert run("runs", "--display", "single").out == "no runs\n"
    log = run("runs", "show", "last").out
    assert "3 lines are to be sent together" in log
    assert "line L1: done to its end" in log
    assert "step 2    line L2: halted: node 2 has stalled" in log
    assert json.loads(run("runs", "show", "last", "--json").out)["records"][0]["type"] == "lines"


def test_a_dry_run_opens_and_moves_nothing(run: Run, tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", ["serial:/dev/nowhere", ""])
    code, out, err = run("send", str(folder), "--dry-run")
    assert code == 0
    assert out.count("line L") == 2
    assert "dry run: nothing was sent" in err
    document = json.loads(run("send", str(folder), "--dry-run", "--json").out)
    assert set(document) == {"curveline", "name", "current_limit_A", "lines"}
    assert [len(each["frames"]) for each in document["lines"]] == [4, 4]


def test_a_radio_that_is_typed_is_that_of_all_lines_one_of_the_environment_of_those_without(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = quick_lines(tmp_path / "roof", ["mock:seed=3", ""])
    assert run("send", str(folder), "--yes").code == 2

    def radios(*typed: str) -> list[str]:
        return [each["radio"] for each in json.loads(run("send", str(folder), "--yes", "--json", *typed).out)["lines"]]

    monkeypatch.setenv("CURVELINE_RADIO", "mock:seed=5")
    assert radios() == ["mock:seed=3", "mock:seed=5"]
    assert radios("--radio", "mock:fresh,seed=9") == ["mock:fresh,seed=9"] * 2


@pytest.mark.parametrize("more", [["--resume", "last"], ["--display", "single"], ["other"]])
def test_a_folder_is_taken_by_itself(run: Run, more: list[str], tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", ["mock"])
    code, _, err = run("send", str(folder), *more, "--yes")
    assert code == 2
    assert err.startswith("error: ")


def test_all_displays_of_a_folder_are_brought_home_so_that_it_can_be_sent_again(run: Run, tmp_path: Path) -> None:
    folder = lines_folder(tmp_path / "roof", ["mock", "mock", "mock:seed=3"], plans=3)
    # One of them stands at home already.
    assert run("send", str(folder), "--yes", "--radio", "mock").code == 0
    assert run("send", "--home", "--display", str(folder / "display-2.toml"), "--radio", "mock", "--yes").code == 0
    code, _, err = run("send", str(folder), "--yes")
    assert code == 3
    assert "line L1: node 1 does not stand where the plan starts" in err
    code, out, _ = run("send", str(folder), "--home", "--yes", "--json")
    assert code == 0
    lines = json.loads(out)["lines"]
    assert [line["rod"]["states"] for line in lines] == [["straight"] * 2] * 3
    assert all(node["counts"] == [0, 0, 0] for line in lines for node in line["nodes"])
    assert run("send", str(folder), "--yes").code == 0


def test_a_folder_without_a_manifest_says_what_to_write(run: Run, tmp_path: Path) -> None:
    code, _, err = run("send", str(tmp_path), "--radio", "mock", "--yes")
    assert code == 2
    assert f"error: {tmp_path}: there is no lines.toml in this folder, which says what to send\nhint: write one" in err


def test_a_wrong_manifest_is_told_as_a_compiler_would(run: Run, tmp_path: Path) -> None:
    (tmp_path / "lines.toml").write_text('[[lines]]\nname = "a"\nplan = "../a.json"\n')
    code, out, err = run("send", str(tmp_path), "--radio", "mock", "--json")
    assert code == 2
    (found,) = json.loads(out)["error"]["diagnostics"]
    assert (found["code"], found["line"], found["column"]) == ("outside", 3, 8)
    assert f"{tmp_path / 'lines.toml'}:3:8: error[outside]: '../a.json' is not within the folder" in err


def test_many_lines_of_long_names_stand_on_a_terminal_of_80_columns(tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", ["mock:loss=0.2"] * 6, [3] * 6, seconds=8.0)
    manifest = folder / "lines.toml"
    manifest.write_text(manifest.read_text().replace('"L', '"the long name of line L'))
    shown = in_terminal("send", str(folder), "--yes", cwd=tmp_path, settings={"CURVELINE_RUNS": str(tmp_path / "runs")})
    assert shown.code == 0
    # Paths are not broken.
    assert max(len(line) for line in shown.lines if str(tmp_path) not in line) <= 80
    assert any("the long name of line L6 [" in line for line in shown.lines)
    assert any("6 of 6 lines move" in line for line in shown.lines)
    assert any("line L6 [################]  step 3 of 3  done" in line for line in shown.lines)


class SendingLines:
    """A send of a folder in a process of its own."""

    def __init__(self, folder: Path, runs: Path) -> None:
        self.said = folder.parent / "said"
        with self.said.open("w") as said:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "curveline", "send", str(folder), "--yes", "--json"],
                env={**os.environ, "CURVELINE_RUNS": str(runs)},
                stdout=subprocess.PIPE,
                stderr=said,
                text=True,
            )

    def wait_for(self, words: str) -> None:
        """Return once these words have been said."""
        deadline = time.monotonic() + LIMIT_S
        while words not in self.said.read_text():
            assert time.monotonic() < deadline, f"{words!r} was not said: {self.said.read_text()}"
            time.sleep(0.02)

    def end(self) -> tuple[int, Any]:
        """Wait for the end: exit code and document."""
        out, _ = self.process.communicate(timeout=LIMIT_S)
        return self.process.returncode, json.loads(out)


@pytest.fixture
def sending(tmp_path: Path) -> Iterator[SendingLines]:
    """Four lines on their way in real time, behind two radios, each of which has a thread."""
    radios = ["mock:realtime", "mock:realtime,seed=1"] * 2
    folder = quick_lines(tmp_path / "roof", radios, [1, 30, 30, 30], seconds=0.5)
    started = SendingLines(folder, tmp_path / "runs")
    for line in ("L2", "L3", "L4"):
        started.wait_for(f"line {line}: step 2 of 30")
    yield started
    started.process.kill()
    if started.process.stdout is not None and not started.process.stdout.closed:
        started.process.communicate()


def test_lines_behind_several_radios_are_driven_by_threads_and_pause_at_ctrl_c(
    sending: SendingLines, run: Run, tmp_path: Path
) -> None:
    sending.process.send_signal(signal.SIGINT)
    code, document = sending.end()
    assert code == 130
    assert [each["outcome"] for each in document["lines"]] == ["done", "paused", "paused", "paused"]
    for line in document["lines"]:
        assert all(node["started"] == node["finished"] for node in line["nodes"])
    assert "pausing at the barrier" in sending.said.read_text()


def test_ctrl_c_three_times_is_an_emergency_stop_of_all(sending: SendingLines) -> None:
    for words in ("pausing", "holding", "emergency stop"):
        sending.process.send_signal(signal.SIGINT)
        sending.wait_for(words)
    code, document = sending.end()
    assert code == 130
    assert document["outcome"] == "halted"
    states = [{node["state"] for node in line["nodes"]} for line in document["lines"]]
    assert states == [{"ready"}, {"estop"}, {"estop"}, {"estop"}]


def test_status_and_stop_of_one_line_find_the_process_and_stop_all(
    sending: SendingLines, run: Run, tmp_path: Path
) -> None:
    display = str(tmp_path / "roof" / "display-3.toml")
    status = json.loads(run("status", "--radio", "mock", "--display", display, "--json").out)
    assert status["sender"]["process"] == sending.process.pid
    assert status["sender"]["plan"] == "quick-3"
    listed = json.loads(run("runs", "--json").out)["runs"][0]
    assert (listed["ending"], listed["process"]) == ("being sent", sending.process.pid)
    stopped = json.loads(run("stop", "--radio", "mock", "--display", display, "--json").out)
    assert all(node["is_sure"] for node in stopped["nodes"])
    assert stopped["sender"]["process"] == sending.process.pid
    code, document = sending.end()
    assert code == 130
    assert [each["outcome"] for each in document["lines"]] == ["done", "paused", "paused", "paused"]


def test_stop_of_a_line_that_is_done_holds_the_others_and_its_nodes(
    sending: SendingLines, run: Run, tmp_path: Path
) -> None:
    display = str(tmp_path / "roof" / "display-1.toml")
    code, out, err = run("stop", "--radio", "mock", "--display", display, "--json")
    assert (code, err) == (0, "")
    assert all(node["is_sure"] for node in json.loads(out)["nodes"])
    code, document = sending.end()
    assert code == 130
    assert [each["outcome"] for each in document["lines"]] == ["done", "paused", "paused", "paused"]


def test_a_killed_process_is_gone_on_with(sending: SendingLines, run: Run, tmp_path: Path) -> None:
    sending.process.kill()
    sending.process.communicate()
    run_of_all = json.loads(run("runs", "--json").out)["runs"][0]
    assert (run_of_all["ending"], run_of_all["can_resume"]) == ("cut off", True)
    code, out, _ = run("send", "--resume", "last", "--radio", "mock", "--yes", "--json")
    assert code == 0
    document = json.loads(out)
    assert document["outcome"] == "done"
    assert [each["radio"] for each in document["lines"][1:]] == ["mock"] * 3


def test_a_fault_stands_beside_the_longest_name(tmp_path: Path) -> None:
    folder = quick_lines(tmp_path / "roof", ["mock", "mock:brownout=2@step12"], [14] * 2, seconds=2.0)
    manifest = folder / "lines.toml"
    manifest.write_text(manifest.read_text().replace('"L2"', f'"{"x" * 24}"'))
    shown = in_terminal("send", str(folder), "--yes", cwd=tmp_path, settings={"CURVELINE_RUNS": str(tmp_path / "runs")})
    assert shown.code == 3
    (left,) = {line for line in shown.lines if line.startswith(f"  {'x' * 24} [") and "node 2" in line}
    assert left.endswith("]  step 12 of 14  node 2: brown-out")
    assert len(left) < 80
