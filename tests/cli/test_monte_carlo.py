"""`curveline plan --monte-carlo`: what it prints, where, and what it exits with."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from curveline.plan_file import from_json, read_plan
from curveline.replay.monte_carlo import Errors
from curveline.shapes.files import builtin_text
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


RANGES = ("--clamp-mm", "0:20", "--stiffness-percent", "-20:5", "--clamp-stiffness-Nmm-per-deg", "50:inf")


def test_the_display_in_truth_is_drawn_and_told(run: Run) -> None:
    code, out, err = run("plan", SHAPE, "--monte-carlo", 20, *RANGES)
    assert (code, err) == (0, "")
    assert all(len(line) <= 80 for line in out.splitlines())
    told = " ".join(out.split())
    assert "errors of the display: stiffness -20 to 5 %, clamp stiffness 50 to inf N mm/deg, clamp 0 to 20 mm" in told
    assert "errors of the display" not in run("plan", SHAPE, "--monte-carlo", 20).out


def test_ranks_follow_the_share_on_80_columns(run: Run) -> None:
    code, out, err = run("plan", SHAPE, "--monte-carlo", 15, "--rank", *RANGES)
    assert (code, err) == (0, "")
    assert all(len(line) <= 80 for line in out.splitlines())
    assert "good runs: of 165 runs all end alike, whatever is drawn" in out
    assert "error            alone %" in out
    rows = [line for line in out.splitlines() if " to " in line and "." in line.rsplit(" ", 1)[-1]]
    assert any(row.startswith("clamp stiffness") for row in rows)
    moves = [float(row.rsplit(" ", 1)[-1]) for row in rows]
    assert moves == sorted(moves, reverse=True)
    brief = run("plan", SHAPE, "--monte-carlo", 15, "--rank", *RANGES, "--brief").out.splitlines()
    assert len(brief) == 2
    assert re.fullmatch(r"curve, [\d.]+ mm about its mean: (\w[\w ]* \d+ %(, )?){3}", brief[1])
    # A share that varies has a table of its own.
    out = run("plan", SHAPE, *ROUGH, "--rank").out
    assert "what decides whether a run is good, from 160 runs" in out
    assert all(len(line) <= 80 for line in out.splitlines())


def test_ranges_and_ranks_are_in_the_json(run: Run) -> None:
    plain = json.loads(run("plan", SHAPE, "--monte-carlo", 15, "--json").out)["monte_carlo"]
    assert (plain["display_errors"], plain["ranking"]) == ({}, None)
    code, out, _ = run("plan", SHAPE, "--monte-carlo", 15, "--rank", *RANGES, "--json")
    found = json.loads(out)["monte_carlo"]
    assert code == 0
    assert found["display_errors"] == {
        "stiffness_percent": [-20.0, 5.0],
        "clamp_stiffness_Nmm_per_deg": [50.0, None],
        "clamp_mm": [0.0, 20.0],
    }
    ranking = found["ranking"]
    assert (ranking["plays"], ranking["share"]) == (165, None)
    assert {each["input"] for each in ranking["curve"]["inputs"]} == {*found["errors"], *found["display_errors"]}
    # The runs themselves are those without ranks.
    again = json.loads(run("plan", SHAPE, "--monte-carlo", 15, *RANGES, "--json").out)["monte_carlo"]
    assert {**found, "ranking": None} == again


def test_options_win_over_the_file(run: Run, tmp_path: Path) -> None:
    display = (
        builtin_text("single").replace('"single"', '"mine"', 1)
        + "\n[errors]\nclamp_mm = [5, 20]\nmass_percent = [-3, 3]\n"
    )
    (tmp_path / "mine.toml").write_text(display)
    (tmp_path / "shape.toml").write_text(SHAPE.read_text().replace('"single"', '"mine.toml"'))
    shape = ("plan", tmp_path / "shape.toml", "--monte-carlo", 2, "--json")
    found = json.loads(run(*shape).out)["monte_carlo"]["display_errors"]
    assert found == {"mass_percent": [-3.0, 3.0], "clamp_mm": [5.0, 20.0]}
    found = json.loads(run(*shape, "--clamp-mm", 10, "--friction-mm", "0:0.5").out)["monte_carlo"]["display_errors"]
    assert found == {"mass_percent": [-3.0, 3.0], "clamp_mm": [10.0, 10.0], "friction_mm": [0.0, 0.5]}


@pytest.mark.parametrize(
    ("option", "text", "said", "hint"),
    [
        ("--clamp-mm", "20:0", "--clamp-mm is 20 to 0 mm, which is no range", "the lower end first"),
        ("--clamp-mm", "wide", "--clamp-mm 'wide' is no range", "write FROM:TO"),
        ("--clamp-mm", "1:2:3", "is no range", "write FROM:TO"),
        ("--clamp-mm", "0:500", "500 mm of rod in a bearing, and 500 mm between two", "must leave some rod free"),
        ("--span-error-mm", "-490:0", "20 mm of rod in a bearing, and 10 mm between two", "must leave some rod free"),
        ("--stiffness-percent", "-95:0", "beyond what a display can be", "stay within -90 to 900 %"),
        ("--clamp-stiffness-Nmm-per-deg", "nan", "is no range", "lower end first"),
        ("--clamp-stiffness-Nmm-per-deg", "0:inf", "beyond what a display can be", "begin at 1e-06"),
        ("--clamp-play-deg", "0:inf", "beyond what a display can be", "stay within 0 to 45 deg"),
        ("--friction-mm", "-1:1", "beyond what a display can be", "begin at 0"),
        ("--set-percent", "0:120", "beyond what a display can be", "stay within -100 to 100 %"),
    ],
)
def test_ranges_that_no_display_can_have_are_refused(run: Run, option: str, text: str, said: str, hint: str) -> None:
    code, out, err = run("plan", SHAPE, "--monte-carlo", 5, option, text, "--brief")
    assert code == 2
    told = " ".join(err.split())
    assert said in told
    assert hint in told
    assert out == ""


@pytest.mark.parametrize("options", [("--clamp-mm", "0:20"), ("--rank",)])
def test_errors_of_the_display_need_runs(run: Run, options: tuple[object, ...]) -> None:
    code, _, err = run("plan", SHAPE, *options)
    assert code == 2
    assert "add --monte-carlo 1000" in err


def test_ranks_of_very_many_runs_are_refused(run: Run) -> None:
    code, _, err = run("plan", SHAPE, "--monte-carlo", 100_001, "--rank")
    assert code == 2
    assert "take 100000 or fewer" in err


def test_ranks_of_nothing_are_refused(run: Run) -> None:
    none = [
        option
        for size in (
            "feed-error-mm",
            "feed-scale-percent",
            "angle-error-deg",
            "height-error-mm",
            "bow-mm",
            "unevenness",
        )
        for option in (f"--{size}", 0)
    ]
    code, _, err = run("plan", SHAPE, "--monte-carlo", 5, "--rank", *none)
    assert code == 2
    assert "nothing to rank" in err


def test_runs_are_played_with_the_history_of_the_rod(run: Run, tmp_path: Path) -> None:
    # A peak near its limit, as the page has it; plans are refused only after longer in a valley.
    asymmetric = (SHAPES / "level-asymmetric-peak.toml").read_text()
    (tmp_path / "steep.toml").write_text(asymmetric.replace("angle_deg = 10.0", "angle_deg = 45.0"))
    asked = ("plan", tmp_path / "steep.toml", "--monte-carlo", 40, "--angle-error-deg", 2, "--json")
    counts = []
    for after in ((), ("--after", f"{SHAPES / 'level-up-valley.toml'}@1min"), ("--after", "level-up-peak@8h")):
        code, out, _ = run(*asked, *after)
        assert code == 0
        counts.append(json.loads(out)["monte_carlo"]["wanted"]["count"])
    fresh, after_valley, after_peak = counts
    assert fresh == after_peak == 40
    assert after_valley < 32
