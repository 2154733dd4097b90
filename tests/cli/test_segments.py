"""Displays of many segments on a terminal of 80 columns: plans, status, progress, and how a run ended."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from curveline.cli.printing.progress import run_progress
from curveline.cli.printing.reports.plan_text import describe
from curveline.drive_settings import drive_settings
from curveline.driving.promises import promise
from curveline.driving.rod_report import rod_lines
from curveline.phrases import alike, in_words, spans
from curveline.plan_file import NodeTarget, Plan, Step, sealed, write_plan
from curveline.radio.host.link import Control, Phase, Progress
from curveline.radio.host.node_status import NodeStatus
from curveline.radio.host.peer import LinkTally
from curveline.replay.playback import Playback, Snap
from curveline.shapes.files import read_display
from rows import row

from .conftest import SHAPES, Run


def test_equal_neighbours_are_named_together() -> None:
    assert in_words(["peak"]) == "peak"
    assert in_words(["valley", "peak", "peak", "peak"]) == "valley, 3 x peak"
    assert in_words([]) == ""
    assert in_words(["peak", "valley"] * 32) == "32 x peak, 32 x valley"
    assert list(alike("aab")) == [(range(1, 3), "a"), (range(3, 4), "b")]
    assert spans([1, 2, 3, 5, 7, 8]) == "1-3, 5, 7-8"
    assert spans([]) == ""


def row_plan(segments: int, display: str = "") -> Plan:
    """Three steps of a row: every segment another length, all states open, then the wanted ones, then one more feed."""
    scene = row(segments)
    found = read_display(display) if display else scene.display
    drive = drive_settings(found)

    def targets(*values: tuple[float, float, float]) -> tuple[NodeTarget, ...]:
        return tuple(
            NodeTarget(*each, counts=tuple(axis.counts(v) for axis, v in zip(drive.axes, each, strict=True)))  # type: ignore[arg-type]
            for each in values
        )

    nodes = range(segments + 1)
    feeds = [30.0 * (0.5 * segments - node) for node in nodes]
    wanted = tuple(segment.state for segment in scene.segments)
    fed = targets(*((feed, 0.0, 0.0) for feed in feeds))
    biased = targets(*((feed, 15.0 * (-1) ** node, 0.0) for node, feed in enumerate(feeds)))
    last = (*biased[:-1], *targets((feeds[-1] - 1.0, biased[-1].bias_deg, -12.5)))
    lengths = (530.0,) * segments
    steps = [
        Step(1, "extrude", 48.2, fed, lengths, ("peak|valley",) * segments, 7.0, 0.2, "stability", 0.011, 7.25, 312.0),
        Step(2, "bias", 1.2, biased, lengths, wanted, 7.0, 0.2, "bias past the fold of the other", 0.021, 6.5, 412.0),
        Step(3, "translate", 2.5, last, (*lengths[:-1], 531.0), wanted, 7.0, 0.2, "stability", 0.011, 7.25, 312.0),
    ]
    start = targets(*((0.0, 0.0, 0.0),) * (segments + 1))
    return Plan(
        scene.name,
        drive,
        start,
        tuple(steps),
        wanted,
        steps[-1].lengths_mm,
        provenance={"display": found.path or found.name},
    )


@pytest.mark.parametrize("count", [1, 4, 64])
def test_a_plan_is_shown_on_80_columns_however_many_segments_it_has(count: int) -> None:
    lines = list(describe(row_plan(count)))
    assert all(len(line) <= 80 for line in lines)
    assert "margin of step 1, 3: stability" in lines
    assert any(line.split()[:2] == ["1", "extrude"] and "7.25" in line for line in lines)


def test_what_a_plan_takes_for_granted_is_told() -> None:
    plan = row_plan(4)
    assert not any("granted" in line for line in describe(replace(plan, shows=("",) * 4)))
    lines = list(describe(replace(plan, shows=("", "peak", "peak", "valley"))))
    assert "takes for granted that the display shows: any, 2 x peak, valley" in lines
    crowd = list(describe(replace(row_plan(64), shows=("loop-1", "", "peak", "crossing-12") * 16)))
    assert "display shows: 16 x loop-1, 16 x any, 16 x peak, 16 x crossing-12" in " ".join(" ".join(crowd).split())
    assert all(len(line) <= 80 for line in crowd)


def test_segments_are_told_only_where_a_step_changes_them() -> None:
    lines = list(describe(row_plan(4)))
    begin = lines.index("rod and states after a step, where it changes them")
    assert [line.split() for line in lines[begin + 2 : begin + 7]] == [
        ["1", "1-4", "530.0", "peak|valley"],
        ["2", "1", "530.0", "peak"],
        ["2-3", "530.0", "valley"],
        ["4", "530.0", "peak"],
        ["3", "4", "531.0", "peak"],
    ]
    # Of the targets, too: the first step leaves the node in the middle, the last one moves but the last node.
    first = lines.index("targets, where a step moves a node") + 3
    targets = lines[first : lines.index("", first)]
    assert len(targets) == 4 + 5 + 1
    assert targets[-1].split()[:5] == ["3", "5", "-61.00", "15.00", "-12.50"]


def test_what_was_followed_and_which_step_ends_a_shape_of_a_tour_is_told() -> None:
    plan = row_plan(4)
    assert not any("mixture" in line or "complete" in line for line in describe(plan))
    first, second, third = plan.steps
    steps = (replace(first, corners=12), replace(second, corners=30, shape="one"), replace(third, shape="two"))
    lines = list(describe(replace(plan, steps=steps)))
    assert "42 mixtures of uneven progress were followed" in lines
    assert "complete: one after step 2, two after step 3" in lines


def test_a_table_that_nobody_would_read_is_not_shown() -> None:
    plan = row_plan(64)
    steps = [replace(plan.steps[i % 2], number=i + 1) for i in range(6)]
    lines = list(describe(replace(plan, steps=tuple(steps))))
    assert len(lines) < 310
    assert "  389 rows, too many for a terminal: --json, or the file that -o writes, has them" in lines


def test_a_step_that_moves_nothing_still_shows_where_the_nodes_are() -> None:
    plan = row_plan(2)
    stays = replace(plan, steps=(replace(plan.steps[0], targets=plan.start),))
    assert sum(line.split()[-3:] == ["0", "0", "0"] for line in describe(stays)) == 3


def test_a_row_is_sent_and_its_status_asked_on_80_columns(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "row.json"
    plan = row_plan(4, "quad")
    write_plan(sealed(replace(plan, steps=tuple(replace(step, seconds=60.0) for step in plan.steps))), path)
    code, out, _ = run("send", path, "--dry-run")
    assert code == 0
    assert all(len(line) <= 80 for line in out.splitlines())
    code, out, err = run("send", path, "--radio", "mock", "--yes")
    assert code in (0, 1)
    assert all(len(line) <= 80 for line in out.splitlines())
    assert len(re.findall(r"^segments? [-0-9, ]+: the rod is in the ", out, re.MULTILINE)) <= 4
    assert "ends in: peak, 2 x valley, peak" in err
    code, out, _ = run("status", "--radio", "mock", "--display", "quad")
    assert code == 0
    assert out.count("ready") == 5
    assert all(len(line) <= 80 for line in out.splitlines())
    assert re.search(r"^rod: ", out, re.MULTILINE)


def test_four_segments_are_simulated_and_drawn_on_80_columns(run: Run) -> None:
    code, out, err = run("simulate", SHAPES / "roofline.toml")
    assert (code, err) == (0, "")
    assert all(len(line) <= 80 for line in out.splitlines())
    assert out.count("wanted, ") == 4
    assert out.count("\n* peak") == 3
    # Five nodes and a curve from one side to the other.
    drawing = out[out.rindex("mm\n") :].splitlines()
    assert sum(line.count("●") for line in drawing) == 5
    assert max(map(len, drawing)) > 60


def test_how_a_run_ended_names_equal_neighbours_together() -> None:
    plan = row_plan(4)
    states = ("peak", "valley", "valley", "valley")
    lines = list(rod_lines(Playback(states, states, (Snap(1.25, 4, "peak", "valley"),)), promise(plan, 3, 3)))
    assert lines == [
        "1.2 s: segment 4 snapped from peak to valley",
        "segment 1: the rod is in the peak, as wanted",
        "segments 2-3: the rod is in the valley, as wanted",
        "segment 4: the rod is in the valley, not the wanted peak",
    ]


def news(node: int, fraction: float) -> Progress:
    status = NodeStatus(node, "C1", "moving", started=1, counts=(0, 0, 0), link=LinkTally(polls=99999, lost=9999))
    return Progress(12.5, Phase.RELEASED, 1, 3, status, fraction)


def test_of_many_nodes_those_behind_are_drawn() -> None:
    drawn: list[str] = []
    view = run_progress.Picture(row_plan(64), Control(), drawn.append)
    for node in range(1, 66):
        view(news(node, 0.1 if node in (3, 40) else 0.5))
    view.finish()
    lines = drawn[-1].splitlines()
    assert all(len(line) <= 80 for line in lines)
    assert len(lines) == 1 + run_progress.MOST_BARS + 1
    assert sum(" 10 %" in line for line in lines) == 2
    assert lines[-1] == "  49 more nodes, none of them behind these"
