"""--brief: a few short lines for each thing, whatever the command; and tables that can be read down."""

from __future__ import annotations

import json
import re
from itertools import pairwise
from pathlib import Path

import pytest

from .conftest import SHAPES, Run

PEAK = SHAPES / "level-up-peak.toml"
ROOF = SHAPES / "roofline.toml"
NUMBER = r"-?[0-9.e+-]+"


def matched(out: str, *patterns: str) -> None:
    """Every line is of its form, and one line to a pipe, however long."""
    lines = out.splitlines()
    assert len(lines) == len(patterns), out
    for line, pattern in zip(lines, patterns, strict=True):
        assert re.fullmatch(pattern, line), line


def test_a_shape_is_a_line_per_segment(run: Run, no_valley: Path) -> None:
    code, out, err = run("simulate", ROOF, "--brief")
    assert (code, err) == (0, "")
    matched(
        out,
        rf"roofline, segment 1: valley, as wanted, to {NUMBER} mm",
        rf"roofline, segment 2: peak, as wanted, to {NUMBER} mm",
        rf"roofline, segment 3: peak, as wanted, to {NUMBER} mm; also valley",
        rf"roofline, segment 4: peak, as wanted, to {NUMBER} mm",
    )
    matched(run("simulate", no_valley, "-b").out, "no-valley, segment 1: no valley; also peak")


def test_a_sweep_is_a_line_per_segment(run: Run) -> None:
    out = run("simulate", PEAK, "--sweep", "segments.1.length_mm=520:700:4", "-b").out.splitlines()
    assert re.fullmatch(r"level-up-peak, segment 1: [0-4] of 4 points have the peak", out[0])


def test_a_plan_is_what_it_comes_to(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    code, out, _ = run("plan", PEAK, SHAPES / "level-down-valley.toml", "-o", path, "--brief")
    assert code == 0
    steps = json.loads(path.read_text())["steps"]
    least = min(steps, key=lambda step: step["margin"])
    matched(
        out,
        r"level-up-peak, level-down-valley: display single, [0-9]+ steps, [0-9.]+ s, ends in: valley",
        r"complete: level-up-peak after step [0-9]+, level-down-valley after step [0-9]+",
        f"least margin: {least['margin']:.2f} in step {least['number']}, {least['margin_of']}",
    )
    assert run("plan", path, "-b").out == out


def test_many_runs_with_errors_are_their_share(run: Run) -> None:
    confidence = rf"{NUMBER} to {NUMBER} % \(95 % confidence\)"
    code, out, err = run("plan", PEAK, "--monte-carlo", "20", "--brief")
    assert (code, err) == (0, "")
    matched(out, rf"level-up-peak: 20 of 20 runs as wanted, {confidence}")
    code, out, _ = run("plan", PEAK, "--monte-carlo", 1, "--feed-error-mm", 60, "--seed", 9, "--least-share", 1, "-b")
    assert code in (0, 1)
    matched(out, rf"level-up-peak: {1 - code} of 1 run as wanted, {confidence}")
    code, out, err = run("plan", PEAK, "--monte-carlo", 5, "-b", "-o", "-")
    assert json.loads(out)["name"] == "level-up-peak"
    matched(err, rf"level-up-peak: 5 of 5 runs as wanted, {confidence}")


def test_a_plan_begins_with_its_targets(run: Run) -> None:
    lines = run("plan", PEAK).out.splitlines()
    assert lines[3] == "targets, where a step moves a node"
    assert lines[5].split() == ["step", "node", "feed", "mm", "angle", "deg", "height", "mm", "feed", "angle", "height"]
    assert all(len(line) <= 80 for line in lines)


def test_a_load_is_where_it_ends(run: Run) -> None:
    shape = SHAPES / "level-neutral-peak.toml"
    matched(
        run("load", shape, "-b").out,
        rf"level-neutral-peak, segment 1, peak at 0\.5: snaps through at {NUMBER} N, lands in valley",
    )
    matched(
        run("load", shape, "--most-N", "1", "-b").out,
        r"level-neutral-peak, segment 1, peak at 0\.5: no snap-through up to 1 N",
    )
    matched(
        run("load", shape, "--map", "--points", "3", "-b").out,
        rf"level-neutral-peak, segment 1, peak, weakest: {NUMBER} N at {NUMBER}",
    )


def test_nodes_are_a_line_each(run: Run, plan_file: Path) -> None:
    at_home = r"ready, step 0, feed 0\.00 mm, angle 0\.00 deg, height 0\.00 mm"
    matched(
        run("status", "--radio", "mock", "-b").out,
        "display single over mock",
        f"node 1: {at_home}",
        f"node 2: {at_home}",
        "rod: not known",
    )
    assert "node 2: silent\n" in run("status", "--radio", "mock:loss=0.99", "-b").out
    run("send", plan_file, "--radio", "mock:stall=2@step2", "--yes")
    out = run("status", "--radio", "mock", "-b").out
    assert re.search(r"^node 2: fault, step 1 > 2, feed ", out, re.MULTILINE)
    assert "node 2: fault stall" in out


def test_the_end_of_a_send_is_short(run: Run, plan_file: Path) -> None:
    code, out, _ = run("send", plan_file, "--radio", "mock:fresh", "--yes", "-b")
    assert code in (0, 1)
    where = rf"ready, step 2, feed {NUMBER} mm, angle 0\.00 deg, height 0\.00 mm"
    matched(
        out,
        r"done: 2 of 2 steps in [0-9.]+ s",
        f"node 1: {where}",
        f"node 2: {where}",
        r"segment 1: the rod is in the .*",
    )


def test_runs_are_a_line_each(run: Run, plan_file: Path) -> None:
    run("send", plan_file, "--radio", "mock:fresh", "--yes")
    run("send", plan_file, "--radio", "mock:fresh,stall=1@step2", "--yes")
    matched(
        run("runs", "-b").out,
        r"000002-[0-9-]+-small: halted, 1 of 2 steps, can go on",
        r"000001-[0-9-]+-small: done, 2 of 2 steps",
    )


def test_brief_is_for_one_command(run: Run) -> None:
    assert len(run("simulate", PEAK, "--brief").out.splitlines()) == 1
    assert len(run("simulate", PEAK).out.splitlines()) > 10


def test_json_is_the_same_with_it(run: Run) -> None:
    brief, full = (json.loads(run("simulate", PEAK, "--json", *more).out) for more in (("--brief",), ()))
    for document in (brief, full):
        del document["seconds"], document["provenance"]
    assert brief == full


@pytest.mark.parametrize("shape", [ROOF, SHAPES / "space" / "pushed.toml"])
def test_columns_are_as_wide_in_every_segment_and_have_units(run: Run, shape: Path) -> None:
    lines = run("simulate", shape, "--no-drawing").out.splitlines()
    heads = [(above, head) for above, head in pairwise(lines) if head.startswith("  state")]
    assert len(set(heads)) == 1
    above, head = heads[0]
    for title, last in (("height mm", "middle"), ("energy", "mJ"), ("error", "mm"), ("moment N mm", "right")):
        last = "depth" if last == "middle" and last not in head else last
        end = above.index(title) + len(title)
        assert head[:end].endswith(last)
    rows = [line for line in lines if re.match(r"[* ] (peak|valley)", line)]
    ends = [[match.end() for match in re.finditer(r"\S+", row.replace("* ", "  "))] for row in rows]
    assert all(each[1:] == ends[0][1:] for each in ends)
    assert lines[-2 if not lines[-1] else -1].startswith("stability: lowest eigenvalue of the second variation")
