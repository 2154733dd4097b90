"""`curveline send`: what reaches a mock display, what is told of it, and every way to end."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import typer

from curveline.plan_file import NodeTarget, sealed, write_plan
from curveline.radio.host.journal import read_journal
from curveline.radio.protocol.frames import decode_drive
from curveline.radio.protocol.keys import KEY_BYTES

from .conftest import BROKEN, SHAPES, Run, failure, promising, small_plan

SHAPE = SHAPES / "level-up-peak.toml"
NODE_KEYS = {"node", "address", "state", "boot", "started", "finished", "staged", "fault", "obstacle", "counts"}
NODE_KEYS |= {"advice", "position", "link", "boot_cause", "unhomed", "fault_seconds"}


def test_a_shape_is_planned_sent_and_reached(run: Run, tmp_path: Path) -> None:
    code, out, err = run("send", SHAPE, "--radio", "mock", "--yes")
    assert code == 0
    assert out.startswith("done: 5 of 5 steps in ")
    assert out.endswith("segment 1: the rod is in the peak, as wanted\n")
    assert all(len(line) <= 80 for line in out.splitlines())
    assert "step 5 of 5: translate" in err
    (record,) = (tmp_path / "runs").glob("*level-up-peak*")
    assert f"record: {record}\n" in err
    assert [entry["type"] for entry in read_journal(record / "journal")][-1] == "end"
    assert (record / "plan.json").exists()


def test_the_next_shape_is_planned_from_where_the_display_stands(run: Run) -> None:
    assert run("send", SHAPE, "--radio", "mock", "--yes").code == 0
    code, out, _ = run("send", SHAPES / "level-up-valley.toml", "--radio", "mock", "--yes", "--json")
    assert code == 0
    rod = json.loads(out)["rod"]
    assert rod["start"] == ["peak"]
    assert rod["states"] == ["valley"]
    assert [snap["after"] for snap in rod["snaps"]][-1:] == ["valley"]
    status = json.loads(run("status", "--radio", "mock", "--json").out)
    assert status["rod"] == ["valley"]
    assert status["nodes"][0]["position"]["extrude_mm"] == pytest.approx(80.0, abs=0.1)


def test_json_is_one_document(run: Run, plan_file: Path, tmp_path: Path) -> None:
    code, out, _ = run("send", plan_file, "--radio", "mock:loss=0.3,seed=7", "--yes", "--json")
    assert code == 0
    document = json.loads(out)
    assert document["plan"] == "small"
    assert document["display"] == "single"
    assert document["radio"] == "mock:loss=0.3,seed=7"
    assert (document["outcome"], document["steps_done"], document["steps"]) == ("done", 2, 2)
    assert document["seconds"] > 1.0
    assert document["wanted"] == ["valley"]
    assert set(document["rod"]) == {"start", "states", "snaps"}
    assert Path(document["run"]).parent == tmp_path / "runs"
    for number, node in enumerate(document["nodes"], start=1):
        assert set(node) == NODE_KEYS
        assert node["node"] == number
        assert (node["started"], node["finished"], node["fault"]) == (2, 2, None)
        assert node["link"]["lost"] > 0


def test_the_wrong_curve_is_the_answer_no(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "hopeful.json"
    write_plan(promising(small_plan(), "peak"), file)
    code, out, _ = run("send", file, "--radio", "mock", "--yes")
    assert code == 1
    assert out.endswith("segment 1: the rod is in the valley, not the wanted peak\n")


def test_runs_are_kept_in_the_folder_that_is_named(run: Run, plan_file: Path, tmp_path: Path) -> None:
    assert run("send", plan_file, "--radio", "mock", "--yes", "--runs", tmp_path / "mine").code == 0
    assert list((tmp_path / "mine").glob("*small*/journal"))
    assert not (tmp_path / "runs").exists()


def test_the_radio_may_be_named_by_the_environment(run: Run, plan_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    code, out, err = run("send", plan_file, "--yes")
    assert (code, out) == (2, "")
    assert "CURVELINE_RADIO" in err
    monkeypatch.setenv("CURVELINE_RADIO", "mock")
    assert run("send", plan_file, "--yes").code == 0
    assert run("send", plan_file, "--yes", "--radio", "pigeon").code == 2


def test_without_a_terminal_nobody_is_asked(run: Run, plan_file: Path, tmp_path: Path) -> None:
    code, out, err = run("send", plan_file, "--radio", "mock")
    assert (code, out) == (2, "")
    assert "--yes" in err
    assert not (tmp_path / "runs").exists()


@pytest.fixture
def terminal(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True)
    monkeypatch.setattr(type(sys.stderr), "isatty", lambda self: True)
    monkeypatch.setenv("TERM", "dumb")


@pytest.mark.usefixtures("terminal")
@pytest.mark.parametrize(("agrees", "code", "moved"), [(True, 0, 443), (False, 1, 0)])
def test_on_a_terminal_the_user_is_asked(
    run: Run, plan_file: Path, monkeypatch: pytest.MonkeyPatch, agrees: bool, code: int, moved: int
) -> None:
    monkeypatch.setattr(typer, "confirm", lambda question, err: agrees and err)
    result = run("send", plan_file, "--radio", "mock")
    assert result.code == code
    assert ("nothing was sent" in result.err) is not agrees
    nodes = json.loads(run("status", "--radio", "mock", "--json").out)["nodes"]
    assert nodes[0]["counts"][0] == pytest.approx(moved, abs=16)


@pytest.mark.usefixtures("terminal")
def test_an_interrupted_question_moves_nothing(run: Run, plan_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(question: str, err: bool) -> bool:
        raise typer.Abort

    monkeypatch.setattr(typer, "confirm", interrupt)
    code, out, err = run("send", plan_file, "--radio", "mock")
    assert (code, out) == (130, "")
    assert "Traceback" not in err
    assert json.loads(run("status", "--radio", "mock", "--json").out)["nodes"][0]["counts"] == [0, 0, 0]


def test_a_dry_run_decodes_the_frames_and_touches_nothing(run: Run, plan_file: Path, tmp_path: Path) -> None:
    code, out, err = run("send", plan_file, "--radio", "mock", "--dry-run")
    assert code == 0
    assert err == "dry run: nothing was sent\n"
    assert all(len(line) <= 80 for line in out.splitlines())
    assert "frames that stage each step, decoded" in out
    assert not (tmp_path / "runs").exists()
    code, out, _ = run("send", plan_file, "--dry-run", "--json")
    assert code == 0
    document = json.loads(out)
    assert [(frame["step"], frame["node"]) for frame in document["frames"]] == [(1, 1), (1, 2), (2, 1), (2, 2)]
    for frame in document["frames"]:
        decoded = decode_drive(bytes.fromhex(frame["payload"]), bytes(KEY_BYTES), 0)
        assert list(decoded.target) == frame["target_counts"]
        assert decoded.move_ms == frame["move_ms"] == 500
        assert decoded.release == frame["release"] == frame["step"] - 1


def test_a_dry_run_of_a_shape_starts_where_the_mock_stands(run: Run) -> None:
    home = run("send", SHAPE, "--dry-run", "--json")
    assert home.code == 0
    assert "planned from home" in home.err
    assert run("send", SHAPE, "--radio", "mock", "--yes").code == 0
    before = run("status", "--radio", "mock", "--json").out
    there = run("send", SHAPE, "--radio", "mock", "--dry-run", "--json")
    assert there.code == 0
    assert "where the mock display stands" in there.err
    # It shows the shape already, so that there is next to nothing to do.
    assert {frame["step"] for frame in json.loads(there.out)["frames"]} == {1}
    assert {frame["step"] for frame in json.loads(home.out)["frames"]} == {1, 2, 3, 4, 5}
    assert run("status", "--radio", "mock", "--json").out == before
    fresh = run("send", SHAPE, "--radio", "mock:fresh", "--dry-run", "--json")
    assert fresh.out == home.out


def test_a_plan_from_elsewhere_is_a_fault_of_the_display(run: Run, plan_file: Path) -> None:
    assert run("send", plan_file, "--radio", "mock", "--yes").code == 0
    code, out, err = run("send", plan_file, "--radio", "mock", "--yes")
    assert (code, out) == (3, "")
    assert "does not stand where the plan starts" in err
    assert "hint: " in err


def test_a_stalled_motor_is_a_fault_and_the_rod_is_remembered(run: Run, plan_file: Path) -> None:
    code, out, err = run("send", plan_file, "--radio", "mock:stall=2@step2", "--yes", "--json")
    assert code == 3
    error = failure(out, 3)
    assert (error["code"], error["cause"], error["node"]) == ("halted", "stall", 2)
    assert f"error: {error['message']}\nhint: {error['hint']}\n" in err
    assert "error: node 2 has stalled in step 2" in err
    assert "segment 1: the rod is in the valley" in err
    assert json.loads(run("status", "--radio", "mock", "--json").out)["rod"] == ["valley"]


def test_a_node_that_lost_its_position_cannot_be_planned_from(run: Run, plan_file: Path) -> None:
    assert run("send", plan_file, "--radio", "mock:reboot=1@step1", "--yes").code == 3
    code, out, err = run("send", SHAPE, "--radio", "mock", "--yes")
    assert (code, out) == (3, "")
    assert "error: node 1 does not know where it is: it has not been homed" in err


def test_a_changed_display_file_is_said(run: Run, tmp_path: Path) -> None:
    display = tmp_path / "mine.toml"
    text = (SHAPES.parent / "curveline" / "shapes" / "displays" / "single.toml").read_text()
    display.write_text(text.replace('"single"', '"mine"'))
    write_plan(small_plan(display=str(display)), tmp_path / "plan.json")
    assert "has changed" not in run("send", tmp_path / "plan.json", "--radio", "mock", "--yes").err
    display.write_text(text.replace('"single"', '"mine"') + "# changed\n")
    result = run("send", tmp_path / "plan.json", "--radio", "mock:fresh", "--yes")
    assert result.code == 0
    assert "display mine has changed since this plan was made" in result.err
    display.unlink()
    result = run("send", tmp_path / "plan.json", "--radio", "mock:fresh", "--yes", "--json")
    assert result.code == 0
    assert "which curve the rod took is not known" in result.err
    assert json.loads(result.out)["rod"] is None


@pytest.mark.parametrize(
    ("name", "part"),
    [
        ("shape.yaml", "error[no-such-file]"),
        ("missing.json", "error[no-such-file]"),
        ("missing.toml", "error[no-such-file]"),
    ],
)
def test_what_cannot_be_sent_is_refused(run: Run, tmp_path: Path, name: str, part: str) -> None:
    code, out, err = run("send", tmp_path / name, "--radio", "mock", "--yes")
    assert (code, out) == (2, "")
    assert part in err


@pytest.mark.parametrize(("fed_mm", "code"), [(1184.0, 0), (1185.0, 2)])
def test_no_node_is_sent_where_it_could_not_tell_its_place(run: Run, tmp_path: Path, fed_mm: float, code: int) -> None:
    plan = small_plan(steps=1, seconds=60.0)
    # Both nodes feed alike, so that the segment keeps its rod and the tails take it.
    target = NodeTarget(fed_mm, 0.0, 0.0, (plan.drive.axes[0].counts(fed_mm), 0, 0))
    write_plan(sealed(replace(plan, steps=(replace(plan.steps[0], targets=(target,) * 2),))), tmp_path / "far.json")
    for more in (("--dry-run",), ("--yes",)):
        result = run("send", tmp_path / "far.json", "--radio", "mock", *more)
        assert result.code in (code, 1 - code), result.err
        if code:
            assert result.out == ""
            assert "step 1 takes node 1 out of its limits: extrude 1185, allowed -1184." in result.err
            assert "hint: further out a node cannot tell where it is" in result.err
            assert not list((tmp_path / "runs").glob("*small*"))


def exchanged(document: dict) -> None:
    """The targets of two steps in each other's place: a way that nobody has proven."""
    first, *_, last = document["steps"]
    first["targets"], last["targets"] = last["targets"], first["targets"]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (exchanged, "error[broken-seal]: the seal does not fit"),
        (lambda document: document["steps"][0].update(seconds=0.4), "error[broken-seal]"),
        (lambda document: document.update(wanted=["peak"]), "error[end-mismatch]: wanted is 'peak', but the last"),
        (lambda document: document.pop("seal"), "error[unsealed]: seal is missing"),
        (lambda document: document.update(curveline_plan=2), "error[unsealed]: this plan was made by an older release"),
        (
            lambda document: document["drive"]["axes"][0].update(high=1e308),
            "error[out-of-range]: drive.axes[0].high is",
        ),
        (lambda document: document["drive"]["axes"][2].update(speed=1e308), "error[out-of-range]"),
    ],
)
def test_an_edited_plan_moves_nothing(run: Run, tmp_path: Path, change, says: str) -> None:
    write_plan(small_plan(steps=4), tmp_path / "plan.json")
    document = json.loads((tmp_path / "plan.json").read_text())
    change(document)
    (tmp_path / "plan.json").write_text(json.dumps(document))
    for command in (
        ("send", tmp_path / "plan.json", "--radio", "mock", "--yes"),
        ("send", tmp_path / "plan.json", "--dry-run"),
        ("plan", tmp_path / "plan.json"),
        ("plan", tmp_path / "plan.json", "--monte-carlo", 1),
    ):
        code, out, err = run(*command)
        assert (code, out) == (2, "")
        assert says in " ".join(err.split())
        assert "plan again" in err
    assert not (tmp_path / "runs").exists()


def test_an_invalid_shape_or_plan_reaches_no_radio(run: Run, tmp_path: Path) -> None:
    (tmp_path / "plan.json").write_text("{}")
    for file in (BROKEN / "syntax.toml", tmp_path / "plan.json"):
        code, out, err = run("send", file, "--radio", "mock", "--yes")
        assert (code, out) == (2, "")
        assert ": error[" in err
    assert not (tmp_path / "runs").exists()
