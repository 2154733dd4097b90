"""`curveline plan --monte-carlo`: what it prints, where, and what it exits with."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from curveline.plan_file import from_json, read_plan
from curveline.replay.monte_carlo import Errors
from curveline.units import to_deg, to_mm

from .conftest import SHAPES, Run

SHAPE = SHAPES / "level-up-peak.toml"
ROUGH = ("--monte-carlo", 20, "--feed-error-mm", 60)
"""Errors of the feed that many runs do not survive."""


def test_the_share_follows_the_plan_on_80_columns(run: Run) -> None:
    code, out, err = run("plan", SHAPE, "--monte-carlo", 20)
    assert (code, err) == (0, "")
    assert all(len(line) <= 80 for line in out.splitlines())
    assert out.index("encoder counts from home") < out.index("20 runs with errors, seed 1 to 20")
    assert "1        peak    20 of 20    100.0  83.9 to 100.0 %" in out


def test_reasons_and_the_worst_run_are_told(run: Run) -> None:
    _, out, _ = run("plan", SHAPE, *ROUGH)
    assert "segment 1 is pulled taut between nodes that are out of line" in out
    assert all(len(line) <= 80 for line in out.splitlines())
    line = next(line for line in out.splitlines() if "fails with the smallest errors" in line)
    again = line.split("again: ")[1].split()
    code, out, _ = run("plan", SHAPE, *again, *ROUGH[2:])
    assert code == 0
    assert "peak      0 of 1" in out


def test_json_is_one_document_and_the_file_is_the_plan(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "plan.json"
    code, out, err = run("plan", SHAPE, *ROUGH, "--seed", 7, "--json", "-o", file)
    assert (code, err) == (0, f"wrote {file}\n")
    document = json.loads(out)
    assert list(document) == ["plan", "monte_carlo"]
    plan = read_plan(file)
    assert from_json(json.dumps(document["plan"]), "stdout") == plan
    found = document["monte_carlo"]
    assert (found["runs"], found["seed"], found["confidence"], found["errors"]["feed_mm"]) == (20, 7, 0.95, 60.0)
    assert found["wanted"]["low"] < found["wanted"]["share"] < found["wanted"]["high"]
    assert [each["wanted"] for each in found["segments"]] == ["peak"]
    assert sum(each["runs"] for each in found["failures"]) == 20 - found["wanted"]["count"]
    assert found["worst"]["endings"] != ["peak"]
    # A plan that was written is played as well, to the same end.
    assert json.loads(run("plan", file, *ROUGH, "--seed", 7, "--json").out)["monte_carlo"] == found


def test_beside_a_plan_on_stdout_the_share_goes_to_stderr(run: Run) -> None:
    code, out, err = run("plan", SHAPE, "--monte-carlo", 5, "-o", "-")
    assert code == 0
    assert from_json(out, "stdout").name == "level-up-peak"
    assert "5 of 5" in err


def test_only_a_share_that_was_asked_for_is_missed(run: Run) -> None:
    assert run("plan", SHAPE, *ROUGH, "--least-share", 0.9).code == 1
    assert run("plan", SHAPE, "--monte-carlo", 5, "--least-share", 1.0).code == 0


def test_what_the_display_shows_before_is_where_the_runs_begin(run: Run) -> None:
    # Directly from one peak to the next: no run may begin in the valley, into which the weight pulls most rods.
    out = run("plan", SHAPE, "--from", SHAPES / "level-asymmetric-peak.toml", "--monte-carlo", 20).out
    assert "display single, 1 step," in out
    assert "peak    20 of 20" in out


@pytest.mark.parametrize(
    "options", [("--bow-mm", 1), ("--least-share", 0.5), ("--monte-carlo", 5, "--unevenness", 2), ("--monte-carlo", 0)]
)
def test_what_means_nothing_is_refused(run: Run, options: tuple[object, ...]) -> None:
    code, out, err = run("plan", SHAPE, *options)
    assert (code, out) == (2, "")
    assert "Traceback" not in err


def test_help_states_the_usual_errors(run: Run) -> None:
    text = " ".join(run("plan", "--help").out.split())
    usual = Errors()
    sizes = {
        "the feed, in mm.": to_mm(usual.feed),
        "in percent.": 100.0 * usual.feed_scale,
        "the angle, in deg.": to_deg(usual.angle),
        "the height, in mm.": to_mm(usual.height),
        "straight rod, in mm.": to_mm(usual.bow),
        "step's time.": usual.unevenness,
    }
    for words, size in sizes.items():
        assert f"{words} [at least 0; default: {size:.1f}]" in text
