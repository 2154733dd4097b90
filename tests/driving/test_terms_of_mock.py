"""A modelled display whose rod differs from its file, and whose rod a hand snaps over."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import curveline
from curveline.driving.looking.model_camera import scattered, shown_by
from curveline.driving.looking.picture_sources import NoPicture
from curveline.errors import InvalidInput
from curveline.plan_file import Plan
from curveline.radio.mock.spec import parse_spec
from curveline.units import to_deg, to_mm

from .to_mock import ends_in


@pytest.fixture(scope="module")
def plan() -> Plan:
    """Of a peak near where it ends."""
    scene = curveline.read_shape("level-asymmetric-peak")
    return curveline.plan(replace(scene, nodes=(scene.nodes[0], replace(scene.nodes[1], angle=math.radians(40.0)))))


@pytest.mark.parametrize(
    ("settings", "state"),
    [("stiffness=0", "peak"), ("stiffness=-20", "peak"), ("stiffness=-85", "valley"), ("stiffness=200", "peak")],
)
def test_a_softer_rod_cannot_hold_every_peak(settings: str, state: str, plan: Plan, tmp_path: Path) -> None:
    assert ends_in(settings, plan, tmp_path) == state


def test_a_bent_rod_shows_between_giving_clamps(plan: Plan, tmp_path: Path) -> None:
    # With rigid clamps a uniform natural curvature moves nothing; with soft ones it is a turn of the clamps.
    assert ends_in("curvature=6", plan, tmp_path) == "peak"
    assert {ends_in(f"clamp=10,curvature={sign}6", plan, tmp_path) for sign in ("", "-")} == {"peak", "valley"}


def test_a_hand_snaps_the_rod_over_once(tmp_path: Path) -> None:
    with curveline.connect("mock:fresh,hand=1", runs=tmp_path) as session:
        first = session.send("level-up-peak")
        assert first.playback is not None
        assert first.playback.states == ("valley",)
        assert (first.playback.snaps[-1].before, first.playback.snaps[-1].after) == ("peak", "valley")
        assert not first.is_wanted
        again = session.send("level-up-peak")
        assert again.playback is not None
        assert again.playback.states == ("peak",)


def test_a_straight_rod_cannot_be_snapped_over(tmp_path: Path) -> None:
    with curveline.connect("mock:fresh", runs=tmp_path) as session:
        session.send("level-up-peak")
    with curveline.connect("mock:hand=1", runs=tmp_path) as session:
        home = session.home()
    assert home.playback is not None
    assert home.playback.states == ("straight",)


def test_only_segments_that_are_there_have_hands(tmp_path: Path) -> None:
    with (
        pytest.raises(InvalidInput, match="there is no segment 2"),
        curveline.connect("mock:hand=2", runs=tmp_path) as s,
    ):
        s.status()


@pytest.mark.parametrize("setting", ["curvature=30", "stiffness=-95", "scatter=-1", "hand=x", "curvature=nan"])
def test_what_no_rod_is_is_refused(setting: str) -> None:
    with pytest.raises(InvalidInput):
        parse_spec(setting)


def test_scattered_nodes_are_off_by_half_a_degree_and_less_than_half_a_millimetre() -> None:
    single = curveline.read_display("single")
    assert scattered(single, 0.0, 1) is single
    found = [scattered(single, 1.0, seed).offsets for seed in range(400)]
    assert scattered(single, 1.0, 7).offsets == found[7]
    assert to_deg(np.std([each.angles for each in found])) == pytest.approx(0.5, rel=0.1)
    assert to_mm(np.std([each.lengths for each in found])) == pytest.approx(0.4, rel=0.1)


def test_no_picture_of_a_rod_that_is_not_known() -> None:
    scene = curveline.read_shape("level-up-peak")
    counts = curveline.plan("level-up-peak").steps[-1].targets
    at = [target.counts for target in counts]
    shown, (curve,) = shown_by(scene.display, at, ["peak"])
    assert to_mm(shown.segments[0].length) == pytest.approx(660.0, abs=0.1)
    assert to_mm(float(curve[:, 1].max())) == pytest.approx(199.0, abs=2.0)
    for states in ([], ["lost"], ["straight"]):
        with pytest.raises(NoPicture):
            shown_by(scene.display, at, states)
