"""A photograph is traced: which state it shows and where, or why that cannot be told."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from curveline.cameras.outcomes import TrialOutcome
from curveline.cameras.synthetic.faults import PictureFaults, faults_of
from curveline.cameras.synthetic.photograph import curves_of, photograph_of
from curveline.cameras.synthetic.standpoints import default_setup, default_view
from curveline.errors import InvalidInput
from curveline.rod.branches.drawn import misfits
from curveline.scene import STRAIGHT, Scene
from curveline.shapes.files import read_shape
from curveline.simulation.simulate import simulate
from curveline.tracing.overlay import LEFT_OUT, SEEN, overlay, plain_overlay
from curveline.tracing.trace import trace
from curveline.units import mm

CLEAN = faults_of("clean", 1)
SMALL = 1440, 1080


def rms(truth: np.ndarray, points: np.ndarray) -> float:
    moved = np.zeros((len(truth) + len(points), 1))
    off = misfits(np.ascontiguousarray(truth), np.ascontiguousarray(points), np.zeros((1, len(truth), 2)), moved)
    return float(np.sqrt(np.mean(off[len(truth) :] ** 2)))


@pytest.fixture(scope="module")
def scene() -> Scene:
    return read_shape("shapes/level-up-peak.toml")


@pytest.mark.parametrize("state", ["peak", "valley"])
def test_both_states_of_a_shape_are_named_and_measured(scene: Scene, state: str) -> None:
    segment = simulate(scene)[0]
    view = default_view(scene.display, SMALL)
    setup = default_setup(scene.display, view.lens)
    shown = next(each for each in segment.states if each.name == state)
    traced = trace(photograph_of(scene, curves_of(scene, [shown]), setup, view, CLEAN), view, scene, setup)
    trial = traced.trial("a.jpg")
    assert (trial.outcome, trial.reason, trial.source) == (TrialOutcome.SEEN, "", "a.jpg")
    (curve,) = trial.curves
    assert curve.state == state
    assert rms(shown.curve(2001), curve.points) < mm(0.15)
    assert mm(0.03) < curve.sigma < mm(0.2)
    assert np.all(np.diff(curve.points[:, 0]) > 0.0)


def test_a_rod_in_clamps_that_give_is_seen_where_it_is(scene: Scene) -> None:
    rod = scene.display.rod
    soft = replace(scene, display=replace(scene.display, clamp_stiffness=rod.bending_stiffness / mm(20.0)))
    shown = simulate(soft)[0].states[-1]
    model = simulate(scene)[0].states[-1]
    assert rms(model.curve(2001), shown.curve(400)) > mm(4.0)
    view = default_view(scene.display, SMALL)
    setup = default_setup(scene.display, view.lens)
    (curve,) = (
        trace(photograph_of(scene, curves_of(scene, [shown]), setup, view, CLEAN), view, scene, setup).trial("").curves
    )
    assert curve.state == shown.name
    assert rms(shown.curve(2001), curve.points) < mm(0.15)


def test_what_shows_none_of_the_states_is_refused(scene: Scene) -> None:
    view = default_view(scene.display, SMALL)
    setup = default_setup(scene.display, view.lens)
    peak, valley = simulate(scene)[0].states
    empty = trace(photograph_of(scene, [], setup, view, CLEAN), view, scene, setup)
    assert empty.outcome is TrialOutcome.ROD_NOT_SEEN
    assert "%" in empty.reason
    other = trace(photograph_of(scene, curves_of(scene, [peak]), setup, view, CLEAN), view, scene, setup, [[valley]])
    assert other.outcome is not TrialOutcome.SEEN
    assert other.trial("").curves == ()


def test_two_states_that_are_alike_are_not_told_apart(scene: Scene) -> None:
    view = default_view(scene.display, SMALL)
    setup = default_setup(scene.display, view.lens)
    peak, valley = simulate(scene)[0].states
    both = [curves_of(scene, [peak])[0], curves_of(scene, [valley])[0]]
    picture = photograph_of(scene, both, setup, view, CLEAN)
    found = trace(picture, view, scene, setup)
    assert found.outcome is TrialOutcome.AMBIGUOUS
    assert "peak" in found.reason
    assert "valley" in found.reason


def test_every_segment_of_a_row_is_traced_and_one_that_is_hidden_is_said() -> None:
    scene = read_shape("shapes/roofline.toml")
    segments = simulate(scene)
    view = default_view(scene.display, (4032, 1600))
    setup = default_setup(scene.display, view.lens)
    shown = [each.wanted for each in segments]
    assert None not in shown
    curves = curves_of(scene, [each for each in shown if each is not None])
    picture = photograph_of(scene, curves, setup, view, CLEAN)
    trial = trace(picture, view, scene, setup).trial("")
    assert [each.state for each in trial.curves] == [each.state for each in scene.segments]
    assert all(rms(truth, each.points) < mm(0.35) for truth, each in zip(curves, trial.curves, strict=True))
    low, high = (round(float(view.pixels(np.array([[x, 0.0, 0.0]]))[0, 0])) for x in (0.54, 0.96))
    picture[:, low:high] = 90
    hidden = trace(picture, view, scene, setup)
    assert [each.verdict.outcome is TrialOutcome.SEEN for each in hidden.segments] == [True, False, True, True]
    assert hidden.reason.startswith("segment 2: ")


def test_a_straight_segment_is_seen(scene: Scene) -> None:
    straight = replace(
        scene,
        nodes=tuple(replace(node, angle=0.0) for node in scene.nodes),
        segments=(replace(scene.segments[0], length=scene.display.span, state=STRAIGHT),),
    )
    shown = simulate(straight)[0].wanted
    assert shown is not None
    view = default_view(scene.display, SMALL)
    setup = default_setup(scene.display, view.lens)
    sagging = curves_of(straight, [shown])[0]
    sagging[:, 1] -= mm(2.0) * np.sin(np.pi * np.linspace(0.0, 1.0, len(sagging)))
    trial = trace(photograph_of(straight, [sagging], setup, view, CLEAN), view, straight, setup).trial("")
    assert [each.state for each in trial.curves] == [STRAIGHT]
    assert rms(sagging, trial.curves[0].points) < mm(0.2)


def test_a_picture_of_another_size_is_refused(scene: Scene) -> None:
    view = default_view(scene.display, SMALL)
    with pytest.raises(InvalidInput, match="100 x 80"):
        trace(np.zeros((80, 100), dtype=np.uint8), view, scene, default_setup(scene.display, view.lens))


def test_pictures_of_nothing_are_no_rod(scene: Scene) -> None:
    view = default_view(scene.display, SMALL)
    setup = default_setup(scene.display, view.lens)
    noise = np.random.default_rng(0).integers(0, 256, (1080, 1440), dtype=np.uint8)
    for picture in (np.zeros((1080, 1440), dtype=np.uint8), np.full((1080, 1440), 255, dtype=np.uint8), noise):
        assert trace(picture, view, scene, setup).outcome is TrialOutcome.ROD_NOT_SEEN


@pytest.mark.parametrize("aside", [0.55, 2.0])
def test_a_rod_that_is_partly_or_wholly_out_of_the_picture_is_refused(scene: Scene, aside: float) -> None:
    straight_on = default_view(scene.display, SMALL)
    view = replace(straight_on, translation=straight_on.translation + np.array([aside, 0.0, 0.0]))
    setup = default_setup(scene.display, view.lens)
    curves = curves_of(scene, [simulate(scene)[0].states[0]])
    traced = trace(photograph_of(scene, curves, setup, view, CLEAN), view, scene, setup)
    assert traced.outcome in (TrialOutcome.TOO_LITTLE_SEEN, TrialOutcome.ROD_NOT_SEEN)


def test_what_was_seen_is_drawn_into_the_picture(scene: Scene) -> None:
    view = default_view(scene.display, SMALL)
    setup = default_setup(scene.display, view.lens)
    curves = curves_of(scene, [simulate(scene)[0].states[0]])
    picture = photograph_of(scene, curves, setup, view, PictureFaults(quality=0))
    drawn = overlay(picture, trace(picture, view, scene, setup))
    assert drawn.shape == (*picture.shape, 3)
    green = np.all(drawn == SEEN, axis=2)
    assert green.sum() > 1000
    refused = plain_overlay(picture, "no-tags: " + "a long reason " * 20)
    assert np.all(refused == LEFT_OUT, axis=2).sum() > 1000


def test_a_sharper_picture_is_surer(scene: Scene) -> None:
    view = default_view(scene.display, SMALL)
    setup = default_setup(scene.display, view.lens)
    curves = curves_of(scene, [simulate(scene)[0].states[0]])
    sigmas = []
    for faults in (PictureFaults(noise=1.0), PictureFaults(noise=8.0, contrast=30.0, blur=3.0)):
        picture = photograph_of(scene, curves, setup, view, faults)
        (curve,) = trace(picture, view, scene, setup).trial("").curves
        sigmas.append(curve.sigma)
    assert sigmas[0] < sigmas[1] < math.inf
