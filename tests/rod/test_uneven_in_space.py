"""A natural curvature that varies along a rod in space: a closed form, the planar model, shooting, energy's slopes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from completeness.kirchhoff import EVEN
from completeness.space import exact
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.geometry.hermite import interpolate
from curveline.rod.models.choice import SearchRequest, model_states
from curveline.rod.models.model_error import lateral
from curveline.rod.natural_curvature import NaturalCurvature
from curveline.rod.problem import Array, Bearing, Pose
from curveline.rod.spatial.energy import positions
from curveline.rod.spatial.lifting import frame, lift, relax_in_space, spatial_rod
from curveline.rod.spatial.relax import newton, settle
from curveline.rod.spatial.richardson import refine_in_space, refine_shape
from curveline.rod.spatial.richardson import refined as halved_shape
from curveline.rod.spatial.stability import lowest_eigenvalue
from curveline.rod.states.equilibrium import Equilibrium, Outcome
from curveline.rod.states.planar_states import find_states

from .rods import STIFFNESS
from .spatial_rods import matrix
from .test_giving_in_space import ASIDE, FLAT, STOCK, made_of, rest_mouth
from .test_natural_curvature import PATTERNS, RODS, hump, rod_of, step, tooth, waves

LATERAL, TWISTING = STOCK.lateral_stiffness, STOCK.twisting_stiffness


def uneven(pattern: str, kind: str = "rigid", aside: str = "") -> ClampedRod:
    rod = made_of(STOCK, rod_of(pattern, kind), **(ASIDE[aside] if aside else {}))
    return replace(rod, loads=())


@pytest.mark.parametrize("kind", RODS)
@pytest.mark.parametrize("pattern", PATTERNS)
def test_in_the_plane_it_is_the_extensible_rod(pattern: str, kind: str) -> None:
    segment = uneven(pattern, kind)
    flat = find_states(segment.extensible(), 1e-7)
    states = [refine_in_space(segment, start, 1e-7) for start in flat]
    assert [state.name for state in states] == ["peak", "valley"]
    for wanted, state in zip(flat, states, strict=True):
        assert state.outcome is Outcome.CONVERGED
        assert np.max(np.abs(state.curve(201) - wanted.curve(201))) <= state.error + wanted.error
        assert state.energy == pytest.approx(wanted.energy, rel=1e-5)
        # At vertices, of which either model has its own.
        assert state.max_curvature == pytest.approx(wanted.max_curvature, rel=2e-3)
        assert state.mean_height == pytest.approx(wanted.mean_height, abs=1e-6)
        np.testing.assert_allclose(state.clamp_force, wanted.clamp_force, atol=5e-5)
        np.testing.assert_allclose(state.clamp_moment, wanted.clamp_moment, atol=5e-6)


@pytest.mark.parametrize("kind", RODS)
@pytest.mark.parametrize("pattern", PATTERNS)
def test_the_eigenvalue_out_of_the_plane_is_that_of_the_rod_in_space(pattern: str, kind: str) -> None:
    segment = uneven(pattern, kind)
    weak = segment.bearing._replace(lateral=0.8 * STIFFNESS, twisting=0.4 * STIFFNESS)
    segment = replace(segment, bearing=weak)
    for state in find_states(segment, 1e-6):
        told = lateral(state)
        values = []
        for n in (48, 96):
            rod, shape = lift(segment, state, n)
            values.append(lowest_eigenvalue(rod, newton(rod, shape).shape))
        exact_value = values[1] + (values[1] - values[0]) / 3.0
        assert exact_value < 0.2 * state.lowest_eigenvalue
        assert told.eigenvalue == pytest.approx(exact_value, rel=0.012, abs=0.02)


def clothoid(first: float, slope: float, length: float) -> tuple[Callable[[float], float], float]:
    """Angle of a free rod's tangent along its length, its chord level, whose curvature rises by `slope`; the chord."""
    bare = [
        quad(lambda s, part=part: part(first * s + 0.5 * slope * s * s), 0.0, length, epsabs=1e-13)[0]
        for part in (math.cos, math.sin)
    ]
    lean = math.atan2(bare[1], bare[0])
    return lambda s: first * s + 0.5 * slope * s * s - lean, math.hypot(*bare)


def test_a_rod_between_clamps_that_stand_as_it_does_when_free_is_a_clothoid_without_forces() -> None:
    first, slope, length, begin = -1.0, 9.0, 0.6, 0.3
    angle, chord = clothoid(first, slope, length)
    ends = begin, begin + length
    profile = np.array([[ends[0], first, slope], [ends[1], first + slope * length, slope]])
    bearing = Bearing(0.0, STIFFNESS, 0.0, lateral=LATERAL, twisting=TWISTING, profile=profile)
    # Rolled by a quarter turn, it is bent towards the viewer.
    quarter = 0.5 * math.pi
    segment = ClampedRod(
        Pose(chord, 0.0, 0.0, 0.0, length, begin),
        bearing,
        section=STOCK.section,
        yaw=(angle(0.0), angle(length)),
        roll=(quarter, quarter),
    )
    states = model_states(segment, SearchRequest(1e-7, (0,), "spatial")).states
    free = min(states, key=lambda state: state.energy)
    assert free.stable
    assert free.energy == pytest.approx(0.0, abs=1e-8)
    assert np.max(np.abs(free.clamp_force)) < 1e-5
    assert free.space is not None
    ours = free.space.positions(25)
    places = np.linspace(0.0, length, 25)
    for s, place in zip(places, ours, strict=True):
        truth = [quad(lambda at, part=part: part(angle(at)), 0.0, s, epsabs=1e-13)[0] for part in (math.cos, math.sin)]
        assert place == pytest.approx([truth[0], 0.0, truth[1]], abs=free.error)


@pytest.mark.parametrize("kind", ["rigid", "giving", "loose"])
@pytest.mark.parametrize("pattern", PATTERNS)
def test_states_are_those_of_shooting(pattern: str, kind: str) -> None:
    segment = uneven(pattern, kind, "all")
    states = [each for each in model_states(segment, SearchRequest(1e-7, (0,), "spatial")).states if each.stable]
    assert states
    for state in states:
        found = exact(segment, state)
        assert found is not None
        assert found.conjugate == 0
        assert state.space is not None
        ours = np.empty((EVEN.size, 3))
        interpolate(state.space.table, state.space.edges, EVEN * segment.free_length, ours)
        assert np.max(np.abs((ours - ours[0]) / segment.free_length - found.curve)) < 2e-6


def relaxed_of(segment: ClampedRod):  # type: ignore[no-untyped-def]
    (start, *_) = find_states(segment.part(0.0), 1e-5)
    return relax_in_space(segment, start)


@pytest.mark.parametrize("kind", ["rigid", "giving"])
@pytest.mark.parametrize("pattern", PATTERNS)
def test_the_edges_converge_with_their_square(pattern: str, kind: str) -> None:
    segment = uneven(pattern, kind, "all")
    rod, relaxed = relaxed_of(segment)
    best = refine_shape(segment, rod, relaxed, 1e-10).space
    assert best is not None
    errors, shape = [], relaxed.shape
    for _ in range(5):
        places = np.concatenate([[0.0], np.cumsum(rod.edges)]) * segment.free_length
        truth = np.empty((places.size, 3))
        interpolate(best.table, best.edges, places, truth)
        ours = positions(rod, shape) * segment.free_length + rest_mouth(segment)
        errors.append(np.max(np.linalg.norm(ours - truth, axis=1)))
        shape = halved_shape(rod, shape)
        rod = spatial_rod(segment, np.repeat(0.5 * rod.edges, 2))
        shape = settle(rod, shape).shape
    slope, _ = np.polyfit(np.log(2.0 ** np.arange(4)), np.log(errors[1:]), 1)
    assert slope == pytest.approx(-2.0, abs=0.1)


@pytest.mark.parametrize("pattern", [waves, hump, step, tooth])
def test_what_is_bent_within_an_edge_is_told_by_the_error(pattern: Callable[[Array], Array]) -> None:
    places = np.linspace(0.0, 1.2, 24_001)
    segment = uneven("hump", "rigid", "all")
    bent = segment.bearing._replace(profile=NaturalCurvature(places, pattern(places)).table)
    segment = replace(segment, bearing=bent)
    rod, relaxed = relaxed_of(segment)
    rough, exact_one = (refine_shape(segment, rod, relaxed, tolerance) for tolerance in (1e-3, 1e-7))
    assert rough.space is not None
    assert exact_one.space is not None
    gap = np.linalg.norm(rough.space.positions(4001) - exact_one.space.positions(4001), axis=1).max()
    assert gap < 1.05 * rough.error + exact_one.error
    assert rough.error < 40.0 * gap + 1e-6


FEEDS: dict[str, tuple[Callable[[Pose, float], Pose], int]] = {
    "left": (lambda pose, by: pose._replace(length=pose.length + by, begin=pose.begin - by), 0),
    "right": (lambda pose, by: pose._replace(length=pose.length + by), 1),
}
STEP = 1e-4


def entering(segment: ClampedRod, state: Equilibrium, side: int) -> float:
    """Energy per length [N] of what is fed in at a mouth: the rod's Hamiltonian there, reversed, and its weight's."""
    space = state.space
    assert space is not None
    along = math.atan2(space.tangents[side, 1], space.tangents[side, 0])
    directors = matrix(frame(along, segment.yaw[side], segment.roll[side]))
    force, moment = (2 * side - 1) * space.forces[side], directors.T @ ((2 * side - 1) * space.moments[side])
    rigid = np.array([LATERAL, STIFFNESS, TWISTING])
    own = np.array([-segment.lateral_curvature, segment.mouth_curvatures[side], 0.0])
    tension = float(force @ directors[:, 2])
    bent = -moment @ (own + 0.5 * moment / rigid) - tension - 0.5 * tension**2 / STOCK.stretching_stiffness
    weight = np.array([segment.weight_x, -segment.weight, segment.weight_z])
    return float(bent - weight @ (space.table[-side, :3] - rest_mouth(segment)))


@pytest.mark.parametrize("way", FEEDS)
@pytest.mark.parametrize("kind", RODS)
@pytest.mark.parametrize("pattern", PATTERNS)
def test_nodes_push_as_the_energy_rises(pattern: str, kind: str, way: str) -> None:
    segment = uneven(pattern, kind, "all")
    fed, side = FEEDS[way]
    rod, relaxed = relaxed_of(segment)
    here = refine_shape(segment, rod, relaxed, 1e-9)
    ends = []
    for by in (STEP, -STEP):
        there = segment.moved_to(fed(segment.pose, by))
        own = spatial_rod(there, rod.edges)
        ends.append(refine_shape(there, own, settle(own, relaxed.shape), 1e-9).energy)
    assert entering(segment, here, side) == pytest.approx((ends[0] - ends[1]) / (2.0 * STEP), rel=1e-4, abs=4e-4)


def test_a_rod_without_a_profile_is_bent_alike_all_along() -> None:
    even = replace(FLAT, bearing=FLAT.bearing._replace(natural=1.5))
    profile = np.array([[0.1, 1.5, 0.0], [2.0, 1.5, 0.0]])
    same = replace(FLAT, bearing=FLAT.bearing._replace(profile=profile))
    edges: Array = np.array([0.1, 0.2, 0.4, 0.3])
    np.testing.assert_allclose(spatial_rod(same, edges).natural, spatial_rod(even, edges).natural, atol=1e-12)
