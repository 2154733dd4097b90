"""Clamps that give: bearings that tilt about their pivots, held against collocation, which knows nothing of edges."""

from __future__ import annotations

import math

import numpy as np
import pytest

from curveline.rod.branches.continuation import follow, start_along
from curveline.rod.branches.control_path import straight_path
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.richardson import interpolate
from curveline.rod.problem import Bearing, Pose
from curveline.rod.states.equilibrium import Equilibrium
from curveline.rod.states.planar_states import find_states

from .collocation import collocated
from .rods import STIFFNESS, WEIGHT, solve_level

POSE = Pose(0.5, 0.06, 0.5, -0.35, 0.64)
BEARING = Bearing(0.02, STIFFNESS, WEIGHT)
CLAMPS = {
    "stiff": {"give": 0.002},
    "soft": {"give": 0.02},
    "very soft": {"give": 0.2},
    "loose": {"give": 0.01, "play": 0.05},
    "loose and rigid": {"play": 0.05},
    "rigid and curved": {"natural": 1.5},
    "curved": {"give": 0.02, "natural": 1.5},
    "curved and loose": {"give": 0.01, "play": 0.05, "natural": 1.5},
    "hinged by play": {"give": 0.01, "play": 1.5, "natural": 1.5},
}


def rod_of(name: str, pose: Pose = POSE) -> ClampedRod:
    return ClampedRod(pose, BEARING._replace(**CLAMPS[name]))


@pytest.mark.parametrize("name", CLAMPS)
def test_states_are_those_of_collocation(name: str) -> None:
    rod = rod_of(name)
    states = find_states(rod, 1e-7)
    assert [state.name for state in states] == ["peak", "valley"]
    for state in states:
        curve, moments = collocated(state)
        ours = state.curve(6401)[100:6301:62]
        assert np.abs(np.linalg.norm(ours - curve, axis=1)).max() < 3e-6
        assert state.clamp_moment == pytest.approx(moments, abs=2e-5)


def rise_of(state: Equilibrium) -> float:
    """How far the first mouth is above where a bearing that does not tilt has it [m]."""
    return 0.5 * state.rod.clamp * (math.sin(state.angles[0]) - math.sin(state.rod.start))


SLOPES = {
    "y": (1e-4, lambda wrench, _: wrench[4]),
    "end": (1e-4, lambda wrench, _: wrench[5]),
    # What is fed enters at the height of the mouth, which the potential counts from where it is before the link tilts.
    "length": (1e-4, lambda wrench, state: wrench[0] + WEIGHT * rise_of(state)),
    # The potential is that over the first mouth, which the motor of the first node lifts.
    "start": (
        1e-4,
        lambda wrench, state: (
            wrench[2] - WEIGHT * state.rod.free_length * 0.5 * state.rod.clamp * math.cos(state.rod.start)
        ),
    ),
}


@pytest.mark.parametrize("field", SLOPES)
@pytest.mark.parametrize("name", CLAMPS)
def test_nodes_pull_as_the_energy_rises(name: str, field: str) -> None:
    rod = rod_of(name)
    step, slope = SLOPES[field]
    there, back = (rod.pose._replace(**{field: getattr(rod.pose, field) + sign * step}) for sign in (1.0, -1.0))
    for place, state in enumerate(find_states(rod, 1e-8)):
        rise = (
            find_states(rod.moved_to(there), 1e-8)[place].energy - find_states(rod.moved_to(back), 1e-8)[place].energy
        )
        branch = follow(
            straight_path(rod.pose, rod.pose), rod.bearing, *start_along(straight_path(rod.pose, rod.pose), state, 384)
        )
        assert slope(branch.wrenches[0], state) == pytest.approx(rise / (2.0 * step), abs=4e-4)


@pytest.mark.parametrize("name", ["soft", "loose", "curved and loose"])
def test_the_edges_converge_with_their_square(name: str) -> None:
    rod = rod_of(name)
    peak = find_states(rod, 1e-9)[0]
    errors = []
    for n in (32, 64, 128, 256):
        level = solve_level(rod, n, *peak.start_on(np.full(n, 1.0 / n)))
        table = level.table[:, :2] * rod.free_length
        places = np.linspace(0.0, rod.free_length, n + 1)
        exact = np.empty((n + 1, 2))
        interpolate(peak.vertices_table, peak.edges, places, exact)
        gone = 0.5 * rod.clamp * np.array([math.cos(level.table[0, 2]), math.sin(level.table[0, 2])])
        errors.append(np.linalg.norm(table + gone - exact, axis=1).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([2.0, 2.0, 2.0], abs=0.1)


@pytest.mark.parametrize(("give", "limit"), [(0.0, 50.3), (0.005, 50.7), (0.01, 51.3), (0.02, 52.8), (0.04, 57.2)])
def test_the_limit_of_the_asymmetric_peak_is_that_of_another_solver(give: float, limit: float) -> None:
    # Level nodes, the left one at 40 deg, 700 mm: how far the right one may turn before the peak is gone.
    rod = ClampedRod(Pose(0.5, 0.0, math.radians(40.0), math.radians(20.0), 0.7), BEARING._replace(give=give))
    (peak,) = (state for state in find_states(rod, 1e-5) if state.name == "peak")
    path = straight_path(rod.pose, rod.pose._replace(end=math.radians(70.0)))
    branch = follow(path, rod.bearing, *start_along(path, peak))
    assert 20.0 + 50.0 * branch.reached == pytest.approx(limit, abs=0.05)
