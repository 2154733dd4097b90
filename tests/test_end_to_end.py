"""From shape file to the curve that the mock's rod takes, over air that loses packets, with motors of unequal speed."""

from contextlib import closing
from functools import cache
from pathlib import Path

import pytest

from campaign import only
from curveline import read_shape
from curveline.planning.tours import make_plan
from curveline.radio.host.actions import Policy
from curveline.radio.host.journal import Journal, new_run, read_journal
from curveline.radio.host.link import Control, send_plan
from curveline.radio.interface import open_radio
from curveline.replay.playback import replay

PATIENT = Policy(slack_ms=60_000)
"""Waits also for motors of half the speed, which are late enough to end a run as a fault."""
SHAPES = sorted((Path(__file__).parents[1] / "shapes").glob("*.toml"))
PAPER = [path for path in SHAPES if path.stem.endswith(("-peak", "-valley"))]


@cache
def plan_from_home(path):
    scene = read_shape(path)
    return scene, make_plan(scene)


def send(plan, spec, runs):
    """Send a plan; what the mock recorded and the report."""
    folder = new_run(runs, plan.name)
    with closing(open_radio(spec, plan.drive, runs)) as radio:
        with closing(Journal(folder)) as journal:
            report = send_plan(plan, radio, journal, control=Control(PATIENT))
        return folder, report, radio.motion(), radio.positions()


def test_there_are_sixteen_shapes():
    assert len(PAPER) == 16


@pytest.mark.parametrize(("loss", "spread"), [(0.0, 0.0), (0.3, 0.5), *only([(0.1, 0.0)])])
@pytest.mark.parametrize("path", SHAPES, ids=lambda path: path.stem)
def test_shape_ends_in_the_wanted_state(path, loss, spread, tmp_path):
    scene, plan = plan_from_home(path)
    folder, report, motion, positions = send(plan, f"mock:loss={loss},spread={spread},seed=11", tmp_path)
    assert report.outcome == "done"
    assert report.steps_done == len(plan.steps)
    played = replay(scene.display, motion)
    assert played.states == plan.wanted == tuple(segment.state for segment in scene.segments)
    for counts, target in zip(positions, plan.steps[-1].targets, strict=True):
        assert max(abs(a - b) for a, b in zip(counts, target.counts, strict=True)) <= 22
    # The chip resends by itself, so that most of what the air loses costs retries, not polls.
    assert (sum(node.link.retries for node in report.nodes) > 0) == (loss > 0.0)
    kinds = [record["type"] for record in read_journal(folder / "journal")]
    assert kinds.count("release") == len(plan.steps)


@pytest.mark.campaign
def test_tour_of_all_shapes_with_unequal_motors_on_bad_air(tmp_path):
    # The display keeps its place between the sends, and the rod its state; each shape is planned from there.
    states: tuple[str, ...] = ()
    counts = None
    for path in PAPER:
        scene = read_shape(path)
        plan = make_plan(scene, counts, states)
        _, report, motion, counts = send(plan, "mock:loss=0.3,seed=5,spread=0.5", tmp_path)
        assert report.outcome == "done"
        states = replay(scene.display, motion, states).states
        assert states == plan.wanted, path.stem


def test_without_the_funnel_the_mock_shows_the_wrong_curve(tmp_path):
    # The last three steps alone, untilted: the rod sags as its weight makes it, and no step turns it over.
    from dataclasses import replace

    scene, plan = plan_from_home(next(path for path in PAPER if path.stem == "level-neutral-peak"))
    flat = tuple(
        replace(target, bias_deg=0.0, counts=(target.counts[0], 0, target.counts[2]))
        for target in plan.steps[2].targets
    )
    steps = (replace(plan.steps[2], number=1, targets=flat, seconds=5.0),)
    _, report, motion, _ = send(replace(plan, steps=steps), "mock", tmp_path)
    assert report.outcome == "done"
    assert replay(scene.display, motion).states == ("valley",)
