"""The two shapes that the paper could not hold: there with the set that a peak leaves, and not after a valley."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

import curveline
from curveline.errors import Infeasible
from curveline.plan_file import Plan
from curveline.scene import Scene
from curveline.simulation.simulate import simulate

LEVEL, STAGGERED = "level-asymmetric", "staggered-asymmetric"
PAST = [(LEVEL, 53.0), (STAGGERED, 63.0)]
"""With the right node [deg] 2.5 deg past the limit of the rod as it is for one of them, 2.8 deg for the other."""
WITHIN = [(LEVEL, 45.0), (STAGGERED, 55.0)]
"""More than 5 deg within it."""
MARGIN = math.radians(2.0)
"""By which the right node may be off."""


def turned(where: str, right: float, history: str = "") -> Scene:
    """The asymmetric peak with the right node at an angle [deg], after a history of the `peak` and the `valley`."""
    scene = curveline.read_shape(f"{where}-peak")
    scene = replace(scene, nodes=(scene.nodes[0], replace(scene.nodes[1], angle=math.radians(right))))
    named = history.replace("peak", f"{where}-peak").replace("valley", f"{where}-valley")
    return curveline.after(scene, named) if history else scene


def off(scene: Scene, by: float) -> Scene:
    left, right = scene.nodes
    return replace(scene, nodes=(left, replace(right, angle=right.angle + by)))


def holds(scene: Scene) -> bool:
    """True if the peak is a state, and stays one if the right node is off by the margin."""
    return all(simulate(off(scene, by))[0].wanted for by in (-MARGIN, 0.0, MARGIN))


def is_gone(scene: Scene) -> bool:
    """True if the peak is no state, and would be none if the right node were off by the margin."""
    return not any(simulate(off(scene, by))[0].wanted for by in (-MARGIN, 0.0, MARGIN))


def plan(scene: Scene) -> Plan:
    """A plan that ends in the peak."""
    found = curveline.plan(scene)
    assert found.steps[-1].states == ("peak",)
    return found


@pytest.mark.parametrize(("where", "right"), PAST)
def test_past_the_limit_a_peak_holds_that_was_held_before(where: str, right: float) -> None:
    assert is_gone(turned(where, right))
    for dwell in ("10min", "1h", "8h", "1w"):
        assert holds(turned(where, right, f"peak@{dwell}")), dwell
    # Three minutes are enough for the peak, not for the margin.
    assert simulate(turned(where, right, "peak@3min"))[0].wanted
    assert not simulate(turned(where, right, "peak@20s"))[0].wanted
    # Of eight hours an hour at home leaves enough, a day does not.
    assert holds(turned(where, right, "peak@8h,home@1h"))
    assert not simulate(turned(where, right, "peak@8h,home@1d"))[0].wanted


@pytest.mark.parametrize(("where", "right"), WITHIN)
def test_within_the_limit_a_peak_is_gone_after_its_valley(where: str, right: float) -> None:
    assert holds(turned(where, right))
    for dwell in ("10min", "1h", "8h", "1w"):
        assert is_gone(turned(where, right, f"valley@{dwell}")), dwell
    # A few seconds do nothing; after eight hours a day at home brings the peak back, an hour does not.
    assert holds(turned(where, right, "valley@2s"))
    assert holds(turned(where, right, "valley@8h,home@1d"))
    assert is_gone(turned(where, right, "valley@8h,home@1h"))


@pytest.mark.parametrize(("where", "right"), PAST)
def test_a_plan_past_the_limit_needs_the_set_of_the_peak(where: str, right: float) -> None:
    for history in ("", "valley@10min", "valley@8h"):
        with pytest.raises(Infeasible, match="no stable peak"):
            plan(turned(where, right, history))
    for dwell in ("10min", "1h", "8h"):
        steps = plan(turned(where, right, f"peak@{dwell}")).steps
        assert min(step.margin for step in steps) > 0.05, dwell


@pytest.mark.parametrize(("where", "right"), WITHIN)
def test_a_plan_within_the_limit_is_refused_after_the_valley_until_what_is_advised_was_done(
    where: str, right: float
) -> None:
    plan(turned(where, right))
    with pytest.raises(Infeasible, match="no stable peak") as refused:
        plan(turned(where, right, "valley@1h"))
    assert "hold it at home for 1h" in refused.value.hint
    assert min(step.margin for step in plan(turned(where, right, "valley@1h,home@1h")).steps) > 0.05


def test_where_the_mirrored_shape_cannot_be_held_either_the_refusal_is_of_the_shape() -> None:
    with pytest.raises(Infeasible, match="level-asymmetric-peak: segment 1 has no stable peak") as refused:
        plan(turned(LEVEL, 10.0, "valley@1w"))
    assert "mirrored" not in refused.value.hint
    assert "at home for" in refused.value.hint
