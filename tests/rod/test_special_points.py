"""Where stability is lost is found to rounding, and told what it is; what falls from there lands in a stable state."""

from __future__ import annotations

import numpy as np
import pytest

from clamped_rods import changed, rod_between
from curveline.rod.branches.arclength import begin_at
from curveline.rod.branches.continuation import FOLLOW_EDGES, coarse_start, start_along
from curveline.rod.branches.control_path import ControlPath, between, counts_along, loading, problem_at, straight_path
from curveline.rod.branches.special_points import (
    BIFURCATION_POINT,
    FOLD_POINT,
    SpecialKind,
    SpecialPoint,
    critical,
    falls,
    next_special_point,
)
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.modes import second_variation
from curveline.rod.planar.newton import Effort, newton
from curveline.rod.states.equilibrium import refine
from curveline.rod.states.planar_states import find_states

from .rods import random_rods
from .test_continuation import ROD, followed, state_of, symmetric_arch

CHANGES = {
    "start": changed(ROD, start=1.2),
    "both ends": changed(ROD, start=1.2, end=-1.3),
    "length": changed(ROD, start=0.9, length=0.52),
    "all": changed(ROD, chord=(0.49, 0.05), start=1.1, end=-0.4, length=0.62),
}
NEWTON = Effort(turn=0.2, close=1e-9, iterations=25)


def lost_on(way: ControlPath, rod: ClampedRod, name: str, tolerance: float = 1e-6) -> SpecialPoint:
    return critical(way, rod.bearing, *start_along(way, state_of(rod, name)), tolerance)


def press(rod: ClampedRod, at: float, load: float) -> ControlPath:
    """The way on which a load down at a fraction of the length grows from nothing."""
    way: ControlPath = loading(rod.pose, np.array([at]), np.zeros((1, 2)), np.array([[0.0, -load]]))
    return way


def test_stability_is_lost_where_the_followed_state_is() -> None:
    kinds = []
    for begin in random_rods(23, 6):
        end = changed(begin, start=begin.start + 0.9, end=begin.end - 0.5)
        for state in find_states(begin, 1e-6):
            if not state.simple:
                continue
            point = critical(straight_path(begin.pose, end.pose), begin.bearing, *coarse_start(state))
            fine = followed(begin, end, coarse_start(state, 400))
            kinds.append(point.kind)
            if point.kind is SpecialKind.NONE:
                assert fine.reached == 1.0
                assert point.fraction == 1.0
                assert not point.mode.any()
            else:
                assert point.kind is SpecialKind.FOLD
                assert point.fraction == pytest.approx(fine.reached, rel=2e-4)
                assert point.error < 1e-6 * point.fraction
    assert set(kinds) == {SpecialKind.NONE, SpecialKind.FOLD}


@pytest.mark.parametrize("change", CHANGES)
def test_the_error_of_a_fold_is_below_its_estimate(change: str) -> None:
    way = straight_path(ROD.pose, CHANGES[change].pose)
    point, exact = lost_on(way, ROD, "valley"), lost_on(way, ROD, "valley", 1e-10)
    assert point.kind is exact.kind is SpecialKind.FOLD
    assert len(exact.levels) > len(point.levels)
    assert 1e-12 < abs(point.fraction - exact.fraction) <= point.error <= 1e-6 * point.fraction


@pytest.mark.parametrize("change", CHANGES)
def test_a_fold_does_not_depend_on_how_the_way_is_counted(change: str) -> None:
    pose = CHANGES[change].pose
    point = lost_on(straight_path(ROD.pose, pose), ROD, "valley", 1e-9)
    longer = lost_on(straight_path(ROD.pose, between(ROD.pose, pose, 1.7)), ROD, "valley", 1e-9)
    assert 1.7 * longer.fraction == pytest.approx(point.fraction, rel=2e-9)
    # From a place nearer to the fold, on which the state has been brought in another way.
    middle = between(ROD.pose, pose, 0.5 * point.fraction)
    near = changed(ROD, chord=(middle.x, middle.y), start=middle.start, end=middle.end, length=middle.length)
    rest = lost_on(straight_path(middle, pose), near, "valley", 1e-9)
    assert (0.5 + (1.0 / point.fraction - 0.5) * rest.fraction) * point.fraction == pytest.approx(
        point.fraction, rel=2e-9
    )


@pytest.mark.parametrize("change", CHANGES)
def test_a_fold_is_an_equilibrium_with_a_mode_of_no_stiffness_that_the_way_pushes(change: str) -> None:
    way = straight_path(ROD.pose, CHANGES[change].pose)
    point = lost_on(way, ROD, "valley")
    counts = counts_along(way, ROD.bearing, point.phi.size)
    problem = problem_at(way, ROD.bearing, point.reached, counts)
    np.testing.assert_allclose(problem.edges, point.edges)
    diagonal, border, _ = second_variation(problem, point.phi, point.multipliers)
    mode = point.mode
    assert point.edges @ mode**2 == pytest.approx(1.0)
    np.testing.assert_allclose(border @ mode, 0.0, atol=1e-7)
    inner = problem.stiffness[1:-1]
    bent = mode @ (diagonal * mode) - 2.0 * inner @ (mode[1:] * mode[:-1])
    assert abs(bent) < 1e-5
    # A little before the point there are two equilibria, the mode leads from one to the other; past it there is none.
    before, _ = [problem_at(way, ROD.bearing, point.reached + d, counts) for d in (-1e-4, 1e-4)]
    found = []
    for side in (-1.0, 1.0):
        phi, force = point.phi + side * 0.02 * mode, point.multipliers.copy()
        iterations, unstable = newton(before, phi, force, NEWTON)
        assert iterations > 0
        found.append((unstable, (point.edges * mode) @ (phi - point.phi)))
    assert [unstable for unstable, _ in found] == [0, 1]
    assert found[0][1] < 0.0 < found[1][1]


@pytest.mark.parametrize("change", CHANGES)
def test_what_falls_from_a_fold_lands_in_another_stable_state(change: str) -> None:
    rod = CHANGES[change]
    way = straight_path(ROD.pose, rod.pose)
    point = lost_on(way, ROD, "valley")
    (fall,) = falls(way, ROD.bearing, point)
    assert fall.landed
    pose = between(ROD.pose, rod.pose, fall.at)
    there = changed(ROD, chord=(pose.x, pose.y), start=pose.start, end=pose.end, length=pose.length)
    state = refine(there, fall.edges, fall.phi, fall.multipliers, 1e-6)
    assert state.stable
    (only,) = (each for each in find_states(there, 1e-6) if each.simple)
    assert only.name == "peak"
    np.testing.assert_allclose(state.curve(33), only.curve(33), atol=1e-5)


@pytest.mark.parametrize("off", [0.0, 1e-5, 1e-4, 1e-3])
def test_a_load_that_is_hardly_off_centre_makes_a_fold_of_the_bifurcation(off: float) -> None:
    rod = rod_between((1.0, 0.0), 0.0, 0.0, 1.2, 0.0, 1.0, 0.0)
    centred = lost_on(press(rod, 0.5, 70.0), rod, "peak", 1e-8)
    point = lost_on(press(rod, 0.5 + off, 70.0), rod, "peak", 1e-8)
    assert point.kind is (SpecialKind.FOLD if off else SpecialKind.BIFURCATION)
    if off:
        # Koiter: an imperfection takes away as much of the load as its power 2/3.
        assert (1.0 - point.fraction / centred.fraction) / off ** (2.0 / 3.0) == pytest.approx(3.988, rel=0.04)
    symmetric = np.max(abs(point.phi + point.phi[::-1]))
    assert (symmetric < 1e-6) == (off == 0.0)


def test_a_symmetric_arch_falls_to_either_side_from_its_bifurcation() -> None:
    # Both land in the one state that is left; on the way back from an S that is level, in one of two.
    rod = rod_between((1.0, 0.0), 0.0, 0.0, 1.2, 0.0, 1.0, 0.0)
    way = press(rod, 0.5, 70.0)
    (fall,) = falls(way, rod.bearing, lost_on(way, rod, "peak"))
    assert fall.landed
    assert fall.edges[:96] @ np.sin(fall.phi[:96]) < -0.1
    steep = rod_between((0.99, 0.0), 0.3, 0.3, 1.0, 0.0, 1.0, 0.0)
    (only,) = find_states(steep, 1e-7)
    way = straight_path(steep.pose, steep.pose._replace(start=0.0, end=0.0))
    point = critical(way, steep.bearing, *coarse_start(only))
    assert point.kind is SpecialKind.BIFURCATION
    both = falls(way, steep.bearing, point)
    assert [fall.landed for fall in both] == [True, True]
    heights = [fall.edges @ np.cumsum(fall.edges * np.sin(fall.phi)) for fall in both]
    assert heights[0] * heights[1] < 0.0


def test_special_points_of_unstable_branches_are_found_one_after_another() -> None:
    rod = rod_between((1.0, 0.0), 0.0, 0.0, 1.2, 0.0, 1.0, 0.0)
    way = press(rod, 0.5, 300.0 / 1.44)
    counts = counts_along(way, rod.bearing, FOLLOW_EDGES)
    found, here = begin_at(way, rod.bearing, counts, 0.0, *symmetric_arch(1.2))
    assert found
    assert here.unstable == 0
    kinds, loads = [], []
    for index in range(1, 5):
        kind, point, mode, here = next_special_point(way, rod.bearing, counts, here, 2.0)
        assert here.unstable == index
        kinds.append(kind)
        loads.append(300.0 * point[-1])
        # The first and the third lead off to the side; the second moves only the halves out of their own symmetry.
        side = 1.0 if index in (1, 3) else -1.0
        np.testing.assert_allclose(mode, side * mode[::-1], atol=1e-3)
    assert kinds == [*[BIFURCATION_POINT] * 3, FOLD_POINT]
    assert loads[0] == pytest.approx(59.919, rel=0.01)
    assert loads[3] == pytest.approx(240.31, rel=0.02)
    assert here.tangent[-1] < 0.0


def test_what_is_stable_to_the_end_or_not_there_at_all_is_told() -> None:
    way = press(ROD, 0.4, 0.01)
    point = lost_on(way, ROD, "peak")
    assert point.kind is SpecialKind.NONE
    assert (point.fraction, point.error, point.reached) == (1.0, 0.0, 1.0)
    absent = critical(way, ROD.bearing, np.full(FOLLOW_EDGES, 2.0), np.zeros(2))
    assert absent.kind is SpecialKind.LOST
    assert absent.reached == 0.0


def test_a_loss_just_past_the_end_is_none_even_where_the_coarse_rod_has_it_before() -> None:
    end = CHANGES["start"].pose
    fraction = lost_on(straight_path(ROD.pose, end), ROD, "valley", 1e-9).fraction
    for part, kind in ((1.0 - 1e-5, SpecialKind.NONE), (1.0 + 1e-5, SpecialKind.FOLD)):
        way = straight_path(ROD.pose, between(ROD.pose, end, part * fraction))
        point = lost_on(way, ROD, "valley")
        assert point.kind is kind
        if kind is SpecialKind.FOLD:
            assert point.levels[0][1] != pytest.approx(1.0, abs=1e-4)
            assert point.fraction == pytest.approx(1.0 - 1e-5, abs=1e-6)
