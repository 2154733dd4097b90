"""Where a display lands: motors of unequal speed, bad air, tours, home, and plans that lead past the funnel."""

from __future__ import annotations

import json
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from campaign import only
from curveline.cli.printing.progress import run_progress
from curveline.plan_file import NodeTarget, Plan, read_plan, sealed, write_plan
from curveline.radio.host.actions import Policy
from curveline.radio.host.journal import Journal, new_run
from curveline.radio.host.link import Control, OperatorRequest, Progress, send_plan
from curveline.radio.interface import open_radio
from curveline.radio.mock.display import Motion
from curveline.radio.protocol.codes import Counts
from curveline.replay.playback import replay
from curveline.replay.tour_checks import ShapeCheck
from curveline.shapes.files import read_display

from .conftest import SHAPES, Run, promising, small_plan

BAD = "mock:loss=0.3,spread=0.3"
"""Motors that are slower than this by half their step's time are late, which ends a run as a fault."""
PAPER = sorted([*SHAPES.glob("*-peak.toml"), *SHAPES.glob("*-valley.toml")])
ROW = """
name = "{name}"
display = "quad"
nodes = [
  {{ height_mm = 0.0, angle_deg = 10.0 }},
  {{ height_mm = 15.0, angle_deg = 5.0 }},
  {{ height_mm = 20.0, angle_deg = 0.0 }},
  {{ height_mm = 10.0, angle_deg = -6.0 }},
  {{ height_mm = 0.0, angle_deg = -4.0 }},
]
segments = [
  {{ length_mm = 540.0, state = "{0}" }},
  {{ length_mm = 530.0, state = "{1}" }},
  {{ length_mm = 530.0, state = "{2}" }},
  {{ length_mm = 540.0, state = "{3}" }},
]
"""


def sent(run: Run, *arguments: object, code: int = 0) -> dict[str, Any]:
    """The document of a send that came to its end."""
    result = run("send", *arguments, "--yes", "--json")
    assert result.code == code, result.err
    return {**json.loads(result.out), "said": result.err}


# Tours


@pytest.mark.parametrize("part", [3, *only([1])])
def test_a_tour_of_all_shapes_shows_each_of_them_and_ends_at_home(run: Run, part: int) -> None:
    """Both states of every boundary condition, one after the other; each time some of either."""
    shapes = PAPER[::part]
    assert {path.stem.rsplit("-", 1)[1] for path in shapes} == {"peak", "valley"}
    document = sent(run, *shapes, "--radio", f"{BAD},seed=5")
    assert [stop["shape"] for stop in document["shapes"]] == [path.stem for path in shapes]
    for stop in document["shapes"]:
        assert stop["states"] == stop["wanted"] == [stop["shape"].rsplit("-", 1)[1]]
    assert document["shapes"][-1]["step"] == document["steps"] == document["steps_done"]
    assert document["rod"]["states"] == document["wanted"]
    home = sent(run, "--home", "--radio", f"{BAD},seed=6")
    assert home["plan"] == "home"
    assert home["wanted"] == home["rod"]["states"] == ["straight"]
    assert [stop["shape"] for stop in home["shapes"]] == ["home"]
    assert all(abs(count) <= 22 for node in home["nodes"] for count in node["counts"])


def test_a_row_goes_from_shape_to_shape_and_home(run: Run, tmp_path: Path) -> None:
    states = (("peak", "peak", "valley", "peak"), ("valley", "peak", "peak", "valley"))
    for name, row in zip("ab", states, strict=True):
        (tmp_path / f"{name}.toml").write_text(ROW.format(*row, name=name))
    first = sent(run, tmp_path / "a.toml", "--radio", f"{BAD},seed=1")
    assert first["rod"]["states"] == list(states[0])
    tour = sent(run, tmp_path / "b.toml", tmp_path / "a.toml", "--radio", f"{BAD},seed=2")
    assert "the display shows: 2 x peak, valley, peak (the mock display remembers)\n" in tour["said"]
    assert [stop["states"] for stop in tour["shapes"]] == [list(states[1]), list(states[0])]
    home = sent(run, "--home", "--display", "quad", "--radio", f"{BAD},seed=3")
    assert home["rod"]["states"] == ["straight"] * 4


def test_a_round_trip_shows_its_shapes_and_ends_at_home(run: Run) -> None:
    document = sent(run, *PAPER[:2], "--home", "--radio", f"{BAD},seed=4")
    assert [stop["states"] for stop in document["shapes"]] == [["peak"], ["valley"], ["straight"]]
    assert document["wanted"] == document["rod"]["states"] == ["straight"]
    assert all(abs(count) <= 22 for node in document["nodes"] for count in node["counts"])


def stopping(plan: Plan, **shapes: str) -> Plan:
    """To and fro between two places; `shapes` are the states that the second and the fourth step are to complete."""
    there = [plan.steps[step % 2] for step in range(4)]
    steps = [replace(step, number=number) for number, step in enumerate(there, start=1)]
    for index, (name, state) in zip((1, 3), shapes.items(), strict=True):
        steps[index] = replace(steps[index], shape=name, states=(state,))
    return promising(replace(plan, steps=tuple(steps)), *steps[-1].states)


def test_a_shape_that_was_missed_on_the_way_is_the_answer_no(run: Run, tmp_path: Path) -> None:
    write_plan(stopping(small_plan(), first="peak", last="valley"), tmp_path / "plan.json")
    result = run("send", tmp_path / "plan.json", "--radio", "mock", "--yes")
    assert result.code == 1
    assert "\nfirst: the rod was in the valley, not the wanted peak\n" in result.out
    assert result.out.endswith("segment 1: the rod is in the valley, as wanted\n")
    document = sent(run, tmp_path / "plan.json", "--radio", "mock:fresh", code=1)
    first = {"step": 2, "shape": "first", "wanted": ["peak"], "states": ["valley"]}
    assert document["shapes"] == [first, {"step": 4, "shape": "last", "wanted": ["valley"], "states": ["valley"]}]


@pytest.mark.parametrize(
    ("states", "says"),
    [
        (("peak",), "a: the rod was in the peak, as wanted"),
        (("lost",), "a: the rod was lost, not the wanted peak"),
        (("peak", "valley"), "a: all 2 segments were as wanted"),
        (("valley", "straight"), "a: segment 1 was in the valley, not the wanted peak; "),
    ],
)
def test_a_stop_names_the_segments_that_went_wrong(states: tuple[str, ...], says: str) -> None:
    line = ShapeCheck(3, "a", ("peak", "valley")[: len(states)], states).line()
    assert line.startswith(says)
    assert line.endswith((says, "segment 2 was straight, not the wanted valley"))


@pytest.mark.parametrize("pause", [2, 3])
def test_a_tour_that_goes_on_tells_of_the_shapes_that_were_left(
    run: Run, tmp_path: Path, pause: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The nodes come twice to where the first shape was complete: what is seen there later is not the first."""
    plain = run_progress.Lines.__call__

    def call(self: run_progress.Lines, news: Progress) -> None:
        plain(self, news)
        if news.status.started == pause:
            self._control.ask(OperatorRequest.PAUSE)

    write_plan(stopping(small_plan(), first="peak", last="valley"), tmp_path / "plan.json")
    with monkeypatch.context() as paused:
        paused.setattr(run_progress.Lines, "__call__", call)
        result = run("send", tmp_path / "plan.json", "--radio", "mock", "--yes", "--json")
    assert result.code == 130
    assert [stop["shape"] for stop in json.loads(result.out)["shapes"]] == ["first"]
    document = sent(run, "--resume", "last", "--radio", "mock")
    assert [stop["shape"] for stop in document["shapes"]] == ["last"]


def test_a_tour_is_of_one_display(run: Run, tmp_path: Path) -> None:
    (tmp_path / "row.toml").write_text(ROW.format(*["peak"] * 4, name="row"))
    result = run("send", PAPER[0], tmp_path / "row.toml", "--radio", "mock", "--yes")
    assert (result.code, result.out) == (2, "")
    assert "a tour is of one display" in result.err


def test_a_rehearsal_of_a_tour_and_of_the_way_home_touches_nothing(run: Run, tmp_path: Path) -> None:
    tour = run("send", *PAPER[:2], "--radio", "mock", "--dry-run", "--json")
    assert tour.code == 0
    assert not (tmp_path / "runs").exists()
    sent(run, PAPER[0], "--radio", "mock")
    before = {path: path.read_bytes() for path in (tmp_path / "runs").rglob("*") if path.is_file()}
    home = run("send", "--home", "--radio", "mock", "--dry-run", "--json")
    assert home.code == 0
    last = [frame["target_counts"] for frame in json.loads(home.out)["frames"]][-2:]
    assert last == [[0, 0, 0], [0, 0, 0]]
    assert {path: path.read_bytes() for path in before} == before
    frames = json.loads(run("send", *PAPER[:2], "--radio", "mock", "--dry-run", "--json").out)["frames"]
    assert frames != json.loads(tour.out)["frames"], "planned from where the display stands"


# Motors of unequal speed

PATIENT = Policy(slack_ms=60_000)
"""Waits also for motors of half the speed, which are late enough to end a run as a fault."""


def motion_of(plan: Plan, settings: str, runs: Path) -> Motion:
    """Where all nodes of a mock display were while it carried out a plan."""
    with closing(open_radio(f"mock:{settings}", plan.drive, runs)) as radio:
        with closing(Journal(new_run(runs, plan.name))) as journal:
            assert send_plan(plan, radio, journal, control=Control(PATIENT)).outcome == "done"
        return radio.motion()


def reaching(length_mm: float, angle_deg: float) -> Plan:
    """From home in one step to a length, with both ends of the rod up: feeding and tilting at once."""
    plan = small_plan(steps=1)
    values = ((length_mm / 2.0 - 250.0, angle_deg), (250.0 - length_mm / 2.0, -angle_deg))
    axes = plan.drive.axes
    targets = tuple(
        NodeTarget(feed, tilt, 0.0, (axes[0].counts(feed), axes[1].counts(tilt), 0)) for feed, tilt in values
    )
    return by_hand(plan, targets)


def shares(now: tuple[Counts, ...], end: tuple[Counts, ...]) -> list[tuple[float, float]]:
    """How much of their ways from home the feed and the tilt of every node have behind them."""
    return [(at[0] / to[0], at[1] / to[1]) for at, to in zip(now, end, strict=True)]


@pytest.mark.parametrize(("settings", "uneven"), [("", False), ("spread=0.5,seed=967", True)])
def test_every_axis_of_every_node_has_its_own_course(tmp_path: Path, settings: str, uneven: bool) -> None:
    plan = reaching(600.0, 40.0)
    end = tuple(target.counts for target in plan.steps[-1].targets)
    courses = [shares(counts, end) for _, counts in motion_of(plan, settings, tmp_path)]
    lead = [max(tilt - feed for feed, tilt in course) for course in zip(*courses, strict=True)]
    apart = max(abs(left[0] - right[0]) for left, right in courses)
    print(f"{settings or 'equal'}: tilts lead feeds by {lead}, feeds of the nodes are {apart:.3f} of their way apart")
    assert all((each > 0.3) is uneven for each in lead)
    assert (apart > 0.05) is uneven
    # The rod is up to so much longer or shorter than on the straight way to where the tilts are.
    off_mm = max(abs(0.5 * (left[0] + right[0]) - 0.5 * (left[1] + right[1])) * 100.0 for left, right in courses)
    assert (off_mm > 30.0) is uneven
    assert off_mm < 1.0 or uneven


@pytest.mark.parametrize(
    ("settings", "state"), [("", "valley"), ("spread=0.5,seed=967", "peak"), ("spread=0.5,seed=967,loss=0.3", "peak")]
)
def test_the_rod_follows_the_courses_of_the_axes_not_the_plan(tmp_path: Path, settings: str, state: str) -> None:
    """One step that feeds and tilts at once: with equal motors the sagging rod stays, if tilts lead it snaps over."""
    plan = reaching(600.0, 40.0)
    assert replay(read_display("single"), motion_of(plan, settings, tmp_path)).states == (state,)


# Plans that are not in the funnel


def straight_there(plan: Plan) -> Plan:
    """From home to length and angles at once, then to height: the plan without its funnel."""
    goal = plan.steps[-1]
    level = tuple(replace(each, translate_mm=0.0, counts=(*each.counts[:2], 0)) for each in goal.targets)
    return by_hand(plan, level, goal.targets)


def length_first(plan: Plan) -> Plan:
    """From home to length, between upright nodes, and then to the pose."""
    goal = plan.steps[-1].targets
    upright = tuple(NodeTarget(each.extrude_mm, 0.0, 0.0, (each.counts[0], 0, 0)) for each in goal)
    return by_hand(plan, upright, goal)


def tilted_first(plan: Plan) -> Plan:
    """From home to the final angles with next to no rod to spare, and then to the pose."""
    goal = plan.steps[-1].targets
    per_mm = plan.drive.axes[0].counts_per_unit
    tilted = tuple(
        NodeTarget(feed, each.bias_deg, 0.0, (round(feed * per_mm), each.counts[1], 0))
        for feed, each in zip((5.0, -5.0), goal, strict=True)
    )
    return by_hand(plan, tilted, goal)


def by_hand(plan: Plan, *ends: tuple[NodeTarget, ...]) -> Plan:
    """A plan with these ends of its steps, which promises what `plan` does."""
    steps = tuple(
        replace(plan.steps[-1], number=number, targets=targets, seconds=8.0)
        for number, targets in enumerate(ends, start=1)
    )
    return replace(plan, steps=steps)


@pytest.mark.parametrize(
    ("name", "way"),
    [
        ("level-neutral-peak", straight_there),
        ("level-neutral-peak", length_first),
        ("level-down-peak", straight_there),
        ("staggered-neutral-peak", straight_there),
        ("level-up-valley", tilted_first),
    ],
)
def test_past_the_funnel_the_display_shows_the_wrong_curve(run: Run, tmp_path: Path, name: str, way) -> None:
    real, hand_made = tmp_path / "real.json", tmp_path / "hand-made.json"
    assert run("plan", SHAPES / f"{name}.toml", "-o", real).code == 0
    plan = read_plan(real)
    write_plan(sealed(way(plan)), hand_made)
    (wanted,) = plan.wanted
    other = {"peak": "valley", "valley": "peak"}[wanted]
    result = run("send", hand_made, "--radio", "mock:fresh", "--yes")
    assert result.code == 1
    assert result.out.endswith(f"segment 1: the rod is in the {other}, not the wanted {wanted}\n")
    result = run("send", real, "--radio", "mock:fresh", "--yes")
    assert result.code == 0
    assert result.out.endswith(f"segment 1: the rod is in the {wanted}, as wanted\n")
