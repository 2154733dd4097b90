"""A modelled display whose bearings give, whatever its file says, and plans for a file that says so."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import curveline
from curveline.errors import Infeasible, InvalidInput
from curveline.radio.mock.spec import parse_spec
from curveline.units import deg, nmm

from .to_mock import ends_in

SHAPE = "level-asymmetric-peak"
SOFT = 8.0
"""Stiffness [N mm/deg] of bearings with which the peak is not reached by a plan for rigid ones."""


@pytest.mark.parametrize(
    ("settings", "state"), [("clamp=1e6", "peak"), (f"clamp={SOFT}", "valley"), ("play=3", "peak")]
)
def test_soft_bearings_may_lead_a_plan_into_the_wrong_curve(settings: str, state: str, tmp_path: Path) -> None:
    assert ends_in(settings, curveline.plan(SHAPE), tmp_path) == state


def test_a_plan_for_a_file_that_says_so_gets_there(tmp_path: Path) -> None:
    scene = curveline.read_shape(SHAPE)
    display = replace(scene.display, clamp_stiffness=nmm(SOFT) / deg(1.0))
    plan = curveline.plan(replace(scene, display=display))
    assert ends_in(f"clamp={SOFT}", plan, tmp_path) == "peak"


def test_what_no_plan_reaches_between_soft_bearings_is_refused() -> None:
    scene = curveline.read_shape(SHAPE)
    display = replace(scene.display, clamp_stiffness=nmm(6.0) / deg(1.0))
    with pytest.raises(Infeasible, match="no safe plan reaches the peak"):
        curveline.plan(replace(scene, display=display))


@pytest.mark.parametrize(
    "settings", ["clamp=0", "clamp=nan", "clamp=soft", "clamp=-3", "play=-1", "play=46", "play=nan"]
)
def test_bearings_that_there_are_not_are_refused(settings: str) -> None:
    with pytest.raises(InvalidInput, match=f"the mock radio's {settings} cannot be read"):
        parse_spec(settings)
