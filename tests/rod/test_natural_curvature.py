"""A natural curvature that varies along the rod: held against collocation and the energy's slope."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from curveline.rod.branches.continuation import follow, start_along
from curveline.rod.branches.control_path import straight_path
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.geometry.vertex_table import CURVATURE
from curveline.rod.natural_curvature import NaturalCurvature
from curveline.rod.planar.richardson import interpolate
from curveline.rod.problem import Array, Bearing, Pose
from curveline.rod.states.planar_states import find_states

from .collocation import collocated
from .rods import STIFFNESS, WEIGHT, solve_level

POSE = Pose(0.5, 0.06, 0.5, -0.35, 0.64, 0.2)
ALONG = np.linspace(0.0, 1.2, 1201)


def waves(places: Array) -> Array:
    """Patterned: three waves a metre, a little uneven."""
    return 2.5 * np.sin(2.0 * math.pi * 3.0 * places + 0.4) + 0.8 * places


def hump(places: Array) -> Array:
    """Bent in one place only."""
    return -4.0 * np.exp(-(((places - 0.45) / 0.08) ** 2))


PATTERNS = {"waves": waves, "hump": hump}
RODS = {
    "rigid": {},
    "curved": {"natural": 1.5},
    "giving": {"give": 0.02, "natural": 1.5},
    "loose": {"give": 0.01, "play": 0.05},
}


def rod_of(pattern: str, kind: str = "rigid", pose: Pose = POSE) -> ClampedRod:
    profile = NaturalCurvature(ALONG, PATTERNS[pattern](ALONG)).table
    return ClampedRod(pose, Bearing(0.02, STIFFNESS, WEIGHT, profile=profile, **RODS[kind]))


@pytest.mark.parametrize("kind", RODS)
@pytest.mark.parametrize("pattern", PATTERNS)
def test_states_are_those_of_collocation(pattern: str, kind: str) -> None:
    rod = rod_of(pattern, kind)
    begin = rod.pose.begin + 0.5 * rod.clamp
    states = find_states(rod, 1e-7)
    assert [state.name for state in states] == ["peak", "valley"]
    for state in states:
        curve, moments = collocated(state, lambda places: PATTERNS[pattern](begin + places))
        ours = state.curve(6401)[100:6301:62]
        assert np.abs(np.linalg.norm(ours - curve, axis=1)).max() < 3e-6
        assert state.clamp_moment == pytest.approx(moments, abs=2e-5)


def mouth_heights(rod: ClampedRod, angles: Array) -> tuple[float, float]:
    """How high both mouths are above where the first one is before its bearing tilts [m]."""
    half = 0.5 * rod.clamp
    left = half * (math.sin(angles[0]) - math.sin(rod.start))
    return left, rod.pose.y - half * math.sin(angles[-1]) - half * math.sin(rod.start)


FEEDS = {
    # Rod that the left node pushes in has its own place; what lies on its right goes on as it was.
    "left": (lambda pose, by: pose._replace(length=pose.length + by, begin=pose.begin - by), 0),
    "right": (lambda pose, by: pose._replace(length=pose.length + by), 1),
}
STEP = 1e-4


@pytest.mark.parametrize("way", FEEDS)
@pytest.mark.parametrize("kind", RODS)
@pytest.mark.parametrize("pattern", PATTERNS)
def test_nodes_push_as_the_energy_rises(pattern: str, kind: str, way: str) -> None:
    rod = rod_of(pattern, kind)
    fed, side = FEEDS[way]
    still = straight_path(rod.pose, rod.pose)
    for place, state in enumerate(find_states(rod, 1e-8)):
        there, back = (find_states(rod.moved_to(fed(rod.pose, by)), 1e-8)[place].energy for by in (STEP, -STEP))
        wrench = follow(still, rod.bearing, *start_along(still, state, 768)).wrenches[0]
        gained = (1.0, -1.0)[side] * wrench[3 * side]
        gained += WEIGHT * mouth_heights(rod, state.angles)[side]
        assert gained == pytest.approx((there - back) / (2.0 * STEP), abs=4e-4)


@pytest.mark.parametrize("kind", ["rigid", "giving"])
@pytest.mark.parametrize("pattern", PATTERNS)
def test_the_edges_converge_with_their_square(pattern: str, kind: str) -> None:
    rod = rod_of(pattern, kind)
    for state in find_states(rod, 1e-9):
        errors = []
        for n in (64, 128, 256, 512):
            level = solve_level(rod, n, *state.start_on(np.full(n, 1.0 / n)))
            table = level.table[:, :2] * rod.free_length
            exact = np.empty((n + 1, 2))
            interpolate(state.vertices_table, state.edges, np.linspace(0.0, rod.free_length, n + 1), exact)
            mouth = 0.5 * rod.clamp * np.array([math.cos(level.table[0, 2]), math.sin(level.table[0, 2])])
            errors.append(np.linalg.norm(table + mouth - exact, axis=1).max())
        slope, _ = np.polyfit(np.log([1.0, 2.0, 4.0, 8.0]), np.log(errors), 1)
        assert slope == pytest.approx(-2.0, abs=0.05)


def step(places: Array) -> Array:
    """Bent behind one place, which lies in the middle of an edge."""
    return np.where(places > 0.4123, 5.0, 0.0)


def tooth(places: Array) -> Array:
    """Bent by 15 deg over a millimetre, and by as much back."""
    return np.where((places > 0.3512) & (places < 0.3522), 260.0, 0.0) - np.where(
        (places > 0.5512) & (places < 0.5522), 260.0, 0.0
    )


@pytest.mark.parametrize("pattern", [waves, hump, step, tooth])
def test_what_is_bent_within_an_edge_is_told_by_the_error(pattern: Callable[[Array], Array]) -> None:
    profile = NaturalCurvature(np.linspace(0.0, 1.2, 24_001), pattern(np.linspace(0.0, 1.2, 24_001))).table
    rod = ClampedRod(POSE, Bearing(0.02, STIFFNESS, WEIGHT, profile=profile))
    for rough, exact in zip(find_states(rod, 1e-3), find_states(rod, 1e-8), strict=True):
        gap = np.linalg.norm(rough.curve(4001) - exact.curve(4001), axis=1).max()
        assert gap < 1.05 * rough.error + exact.error
        assert rough.error < 40.0 * gap + 1e-6


SECOND = 8.986818916
"""Twice the first positive root of tan u = u: the wave number of a straight clamped rod's second mode."""


@pytest.mark.parametrize("part", [-0.5, 0.0, 0.5, 0.9])
def test_a_shallow_arch_snaps_where_its_modes_say(part: float) -> None:
    # Shallow arches in the modes of Euler's buckling, as arXiv 2601.06598 takes them apart: a natural curvature c cos(2
    # pi s) pushes the state on the other side along the first mode, until the second one is soft at c = c*.
    excess = 1e-4
    gap = SECOND**2 - 4.0 * math.pi**2
    critical = gap * math.sqrt(2.0 * excess) / (math.sqrt(2.0) * math.pi)
    places = np.linspace(0.0, 1.0, 2001)
    profile = NaturalCurvature(places, part * critical * np.cos(2.0 * math.pi * places)).table
    rod = ClampedRod(Pose(1.0 - excess, 0.0, 0.0, 0.0, 1.0), Bearing(0.0, 1.0, 0.0, profile=profile))
    _, valley = find_states(rod, 1e-6)
    assert valley.lowest_eigenvalue == pytest.approx(gap * (1.0 - part), abs=0.01 * gap)


def kept_by(name: str, share: float, right: float) -> Array:
    """The profile of a rod that keeps a share of the curvature of a state between nodes at 40 deg and `right` [deg]."""
    rod = ClampedRod(Pose(0.5, 0.0, math.radians(40.0), math.radians(right), 0.7), Bearing(0.02, STIFFNESS, WEIGHT))
    (state,) = (each for each in find_states(rod, 1e-6) if each.name == name)
    places = 0.5 * rod.clamp + np.concatenate([[0.0], np.cumsum(state.edges)])
    beside = [places[0] - 1e-4], [places[-1] + 1e-4]
    values = np.concatenate([[0.0], share * state.vertices_table[:, CURVATURE], [0.0]])
    return NaturalCurvature(np.concatenate([beside[0], places, beside[1]]), values).table


@pytest.mark.parametrize(("name", "right", "limit"), [("peak", 20.0, 57.9), ("valley", 0.0, 36.3)])
def test_a_tenth_of_another_state_moves_the_asymmetric_peak_as_another_solver_says(
    name: str, right: float, limit: float
) -> None:
    bearing = Bearing(0.02, STIFFNESS, WEIGHT, profile=kept_by(name, 0.1, right))
    rod = ClampedRod(Pose(0.5, 0.0, math.radians(40.0), 0.0, 0.7), bearing)
    peak = find_states(rod, 1e-5)[0]
    path = straight_path(rod.pose, rod.pose._replace(end=math.radians(80.0)))
    branch = follow(path, rod.bearing, *start_along(path, peak))
    assert 80.0 * branch.reached == pytest.approx(limit, abs=0.15)


def test_rods_are_told_apart_by_how_they_are_bent() -> None:
    one, same, other = rod_of("waves"), rod_of("waves"), rod_of("hump")
    assert one == same
    assert hash(one) == hash(same)
    assert one != other
    assert one.bearing != other.bearing
    assert one.bearing == same.bearing
    assert {one: "bent"}[same] == "bent"
    assert one.bearing != tuple(one.bearing)
