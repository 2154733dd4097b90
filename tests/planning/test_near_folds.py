"""Margins and ends of ways are those of the rod that exists, near folds, of soft rods and of taut ones."""

from __future__ import annotations

from dataclasses import replace

import pytest

from curveline.errors import Infeasible
from curveline.planning.layout import Box
from curveline.planning.tours import make_plan
from curveline.planning.verification import LEAST_STABILITY, STABILITY, STIFFEST, Refused, Verifier
from curveline.rod.branches.continuation import coarse_start
from curveline.rod.branches.control_path import between, straight_path
from curveline.rod.branches.special_points import SpecialKind, critical
from curveline.rod.branches.tracking import tracked
from curveline.rod.problem import Pose
from curveline.rod.states.equilibrium import Equilibrium
from curveline.scene import Display, Node, Scene, Segment
from curveline.sections import Rectangle
from curveline.shapes.files import read_display
from curveline.units import deg, mm

SINGLE = read_display("single")
SOFT = replace(SINGLE, rod=replace(SINGLE.rod, section=Rectangle(mm(10.0), mm(0.5))), digest="0.5 mm")
SPAN = SINGLE.span
Ends = tuple[tuple[float, float], tuple[float, float]]


def shape(ends: Ends, length_mm: float, state: str, display: Display = SINGLE) -> Scene:
    nodes = tuple(Node(mm(height), deg(angle)) for height, angle in ends)
    return Scene("shape", display, nodes, (Segment(mm(length_mm), state),))


def test_a_goal_near_a_fold_is_planned_with_its_true_margin() -> None:
    """Fault 9: the margin is 0.155, and the plan was refused for "a state that was not found"."""
    made = make_plan(shape(((-72.1, -42.3), (64.5, 2.6)), 898.9, "peak"))
    assert made.steps[-1].margin == pytest.approx(0.155, abs=0.001)
    assert made.steps[-1].margin_of == STABILITY


def test_a_soft_and_heavy_rod_is_planned() -> None:
    made = make_plan(shape(((0.0, -33.6), (50.0, 4.3)), 800.0, "valley", SOFT))
    assert made.wanted == ("valley",)
    assert made.steps[-1].margin > 1.0


def test_of_a_taut_rod_the_reason_is_what_it_asks_for() -> None:
    with pytest.raises(Infeasible, match=r"the shape itself: .* bend to a radius of 1\d mm, its strain allows 40 mm"):
        make_plan(shape(((109.2, -43.6), (-25.2, 60.8)), 532.9, "valley"))


LEVEL = Pose(SPAN, 0.0, 0.0, 0.0, 0.56)
TILTED = LEVEL._replace(start=-0.9, end=0.5)


def to_the_fold(verifier: Verifier, state: Equilibrium) -> float:
    """The part of the way to `TILTED` at which the peak ends, for the continuous rod."""
    point = critical(straight_path(LEVEL, TILTED), state.rod.bearing, *coarse_start(state), 1e-7)
    assert point.kind is SpecialKind.FOLD
    return point.fraction


@pytest.mark.parametrize("before_fold", [0.03, 0.01, 0.003, 0.001])
def test_a_margin_is_that_of_the_continuous_rod_and_decides(before_fold: float) -> None:
    """Against the refined state at the end of the way, where the eigenvalue is lowest."""
    verifier = Verifier(SINGLE, lambda: None)
    peak = verifier.states(LEVEL)[0]
    there = between(LEVEL, TILTED, (1.0 - before_fold) * to_the_fold(verifier, peak))
    truth = min(verifier.states(there), key=lambda state: state.lowest_eigenvalue).lowest_eigenvalue / STIFFEST
    try:
        margin = verifier.keep(LEVEL, there, Box(LEVEL, LEVEL), tracked(peak)).margin
    except Refused:
        assert truth < LEAST_STABILITY
    else:
        assert margin == pytest.approx(truth, abs=4e-3)
        assert truth > LEAST_STABILITY


def test_both_verdicts_occur_near_the_fold() -> None:
    verifier = Verifier(SINGLE, lambda: None)
    peak = verifier.states(LEVEL)[0]
    fold = to_the_fold(verifier, peak)
    verifier.keep(LEVEL, between(LEVEL, TILTED, 0.99 * fold), Box(LEVEL, LEVEL), tracked(peak))
    with pytest.raises(Refused, match="losing stability"):
        verifier.keep(LEVEL, between(LEVEL, TILTED, 0.999 * fold), Box(LEVEL, LEVEL), tracked(peak))
