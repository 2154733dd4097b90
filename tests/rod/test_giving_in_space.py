"""Bearings that tilt, out of the plane: held against the planar model, slopes of the energy, and exact shooting."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from clamped_rods import Stock, made_of, rod_between
from completeness.kirchhoff import EVEN
from completeness.space import exact
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.geometry.hermite import interpolate
from curveline.rod.models.choice import SearchRequest, model_states
from curveline.rod.problem import Array, Pose
from curveline.rod.spatial.energy import positions
from curveline.rod.spatial.lifting import relax_in_space, spatial_rod
from curveline.rod.spatial.relax import at_rest, settle
from curveline.rod.spatial.richardson import refine_in_space, refine_shape
from curveline.rod.spatial.richardson import refined as halved_shape
from curveline.rod.states.equilibrium import Equilibrium, Outcome
from curveline.rod.states.planar_states import find_states

from .rods import STIFFNESS, WEIGHT
from .test_giving_clamps import CLAMPS

STOCK = Stock(58_800.0, 2.4e-3, 2.97e-3, WEIGHT, lateral_stiffness=0.49, twisting_stiffness=0.0354887)
FLAT = made_of(STOCK, rod_between((0.5, 0.06), 0.5, -0.35, 0.64, 0.02, STIFFNESS, WEIGHT))
UP = np.array([0.0, 0.0, 1.0])
ASIDE = {
    "yaw": {"yaw": (0.25, -0.1)},
    "roll": {"roll": (0.3, 2.0)},
    "all": {
        "yaw": (0.2, 0.3),
        "roll": (-0.4, 0.9),
        "weight_x": 0.1,
        "weight_z": 0.3,
        "loads": ((0.3, 0.1, -0.2, 0.4),),
        "lateral_curvature": 1.0,
    },
}


def giving(name: str, **aside: object) -> ClampedRod:
    rod = made_of(STOCK, FLAT, **aside)
    return replace(rod, bearing=rod.bearing._replace(**CLAMPS[name]))


def spatial(segment: ClampedRod, tolerance: float = 1e-6) -> list[Equilibrium]:
    return [each for each in model_states(segment, SearchRequest(tolerance, (0,), "spatial")).states if each.stable]


@pytest.mark.parametrize("name", CLAMPS)
def test_in_the_plane_it_is_the_extensible_rod(name: str) -> None:
    segment = giving(name)
    flat = find_states(segment.extensible(), 1e-7)
    states = [refine_in_space(segment, start, 1e-7) for start in flat]
    assert [state.name for state in states] == ["peak", "valley"]
    for wanted, state in zip(flat, states, strict=True):
        assert state.outcome is Outcome.CONVERGED
        assert np.max(np.abs(state.curve(201) - wanted.curve(201))) <= state.error + wanted.error
        assert np.max(np.abs(state.depth(201))) < 1e-12
        assert state.energy == pytest.approx(wanted.energy, rel=1e-5)
        np.testing.assert_allclose(state.clamp_force, wanted.clamp_force, atol=2e-5)
        np.testing.assert_allclose(state.clamp_moment, wanted.clamp_moment, atol=2e-6)


@pytest.mark.parametrize("name", ["soft", "loose", "loose and rigid", "curved and loose"])
@pytest.mark.parametrize("aside", ASIDE)
def test_states_are_those_of_shooting(name: str, aside: str) -> None:
    segment = giving(name, **ASIDE[aside])
    states = spatial(segment, 1e-7)
    assert states
    for state in states:
        found = exact(segment, state)
        assert found is not None
        assert found.conjugate == 0
        assert state.space is not None
        table, length = state.space.table, segment.free_length
        ours = np.empty((EVEN.size, 3))
        interpolate(table, state.space.edges, EVEN * length, ours)
        assert np.max(np.abs((ours - ours[0]) / length - found.curve)) < 1e-6
        assert tilts_of(segment, state) == pytest.approx(found.wrench[6:], abs=2e-5)
        assert np.max(np.abs(found.wrench[6:])) > 1e-3


def tilts_of(segment: ClampedRod, state: Equilibrium) -> Array:
    assert state.space is not None
    along = np.arctan2(state.space.tangents[:, 1], state.space.tangents[:, 0])
    return np.asarray(along - [segment.start, segment.end])


def moved(segment: ClampedRod, key: str, size: float) -> ClampedRod:
    if key == "roll":
        return replace(segment, roll=(segment.roll[0], segment.roll[1] + size))
    if key == "yaw":
        return replace(segment, yaw=(segment.yaw[0], segment.yaw[1] + size))
    return segment.moved_to(segment.pose._replace(**{key: getattr(segment.pose, key) + size}))


def pulled(segment: ClampedRod, state: Equilibrium, key: str) -> float:
    """What the last node holds against: its force along y, or its moment about the axis that it turns about."""
    space = state.space
    assert space is not None
    force, moment, tangent = space.forces[1], space.moments[1], space.tangents[1]
    if key == "y":
        return float(force[1])
    if key == "roll":
        return float(moment @ tangent)
    axis = UP if key == "end" else np.cross(tangent, UP) / math.hypot(tangent[0], tangent[1])
    return float((moment + np.cross(-0.5 * segment.clamp * tangent, force)) @ axis)


@pytest.mark.parametrize("key", ["y", "end", "roll", "yaw"])
@pytest.mark.parametrize("name", ["soft", "loose", "loose and rigid", "curved and loose"])
def test_nodes_pull_as_the_energy_rises(name: str, key: str) -> None:
    segment = giving(name, **ASIDE["all"])
    step = 1e-4
    (start, *_) = find_states(segment.part(0.0), 1e-5)
    rod, relaxed = relax_in_space(segment, start)
    here = refine_shape(segment, rod, relaxed, 1e-9)
    ends = []
    for side in (1.0, -1.0):
        there = moved(segment, key, side * step)
        own = spatial_rod(there, rod.edges)
        ends.append(refine_shape(there, own, settle(own, relaxed.shape), 1e-9).energy)
    slope = (ends[0] - ends[1]) / (2.0 * step)
    assert abs(slope) > 1e-3
    assert pulled(segment, here, key) == pytest.approx(slope, rel=1e-4, abs=1e-5)


@pytest.mark.parametrize("name", ["soft", "loose", "loose and rigid"])
def test_the_edges_converge_with_their_square(name: str) -> None:
    segment = giving(name, **ASIDE["all"])
    (start, *_) = find_states(segment.part(0.0), 1e-5)
    rod, relaxed = relax_in_space(segment, start)
    best = refine_shape(segment, rod, relaxed, 1e-10).space
    assert best is not None
    errors, shape = [], relaxed.shape
    for _ in range(4):
        places = np.concatenate([[0.0], np.cumsum(rod.edges)]) * segment.free_length
        truth = np.empty((places.size, 3))
        interpolate(best.table, best.edges, places, truth)
        ours = positions(rod, shape) * segment.free_length + rest_mouth(segment)
        errors.append(np.max(np.linalg.norm(ours - truth, axis=1)))
        shape = halved_shape(rod, shape)
        rod = spatial_rod(segment, np.repeat(0.5 * rod.edges, 2))
        shape = settle(rod, shape).shape
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([2.0, 2.0, 2.0], abs=0.15)


def rest_mouth(segment: ClampedRod) -> Array:
    """Where the motor of the first node holds the mouth [m]."""
    yaw, start = segment.yaw[0], segment.start
    return (
        0.5
        * segment.clamp
        * np.array([math.cos(yaw) * math.cos(start), math.cos(yaw) * math.sin(start), math.sin(yaw)])
    )


@pytest.mark.parametrize("aside", ASIDE)
def test_a_very_stiff_bearing_is_a_rigid_one(aside: str) -> None:
    rigid = made_of(STOCK, FLAT, **ASIDE[aside])
    stiff = replace(rigid, bearing=rigid.bearing._replace(give=1e-9))
    for one, other in zip(spatial(rigid), spatial(stiff), strict=True):
        assert one.name == other.name
        assert np.max(np.abs(one.curve(101) - other.curve(101))) < 1e-7
        assert one.energy == pytest.approx(other.energy, rel=1e-6)


def test_out_of_the_plane_a_bearing_is_rigid() -> None:
    for state in spatial(giving("soft", yaw=(0.25, -0.1))):
        assert state.space is not None
        assert np.arcsin(state.space.tangents[:, 2]) == pytest.approx([0.25, -0.1], abs=1e-12)
        curve = state.space.positions(33)
        np.testing.assert_allclose(curve[0], 0.0, atol=1e-15)
        np.testing.assert_allclose(curve[-1], [*FLAT.chord, 0.0], atol=1e-15)
        for end, tangent in zip((0, -1), state.space.tangents, strict=True):
            slope = state.space.table[end, 3:6]
            np.testing.assert_allclose(slope / np.linalg.norm(slope), tangent, atol=1e-6)


def test_a_rod_that_starts_beyond_its_poles_finds_the_bearing_it_points_along() -> None:
    # Descents began where edges pointed backwards: of several roots for the tilt, all but one are artefacts of edges.
    pose = Pose(0.5, -0.0304, -1.03, -1.28, 0.62)
    rod = giving("soft", yaw=(0.4786, 0.7667), roll=(-1.2834, -1.1601), loads=((0.4388, 0.1895, -0.3963, 0.3843),))
    segment = rod.moved_to(pose)
    segment = replace(segment, bearing=segment.bearing._replace(give=0.1, play=0.1, clamp=0.0))
    assert len(spatial(segment, 1e-4)) >= 1


def test_a_state_at_rest_stays_there() -> None:
    segment = giving("loose", **ASIDE["all"])
    (start, *_) = find_states(segment.part(0.0), 1e-5)
    rod, relaxed = relax_in_space(segment, start)
    again = settle(rod, relaxed.shape)
    assert again.iterations <= 2
    assert again.shape.tilts == pytest.approx(relaxed.shape.tilts, abs=1e-12)
    assert refine_shape(segment, rod, at_rest(relaxed.shape), 1e-5).outcome is Outcome.CONVERGED
