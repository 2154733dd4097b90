"""What symmetry, dimension and mechanics demand of any scene."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from clamped_rods import changed, rod_between
from curveline.rod.branches.continuation import coarse_start
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.newton import energy
from curveline.rod.states.equilibrium import Equilibrium
from curveline.rod.states.planar_states import find_states

from .rods import STIFFNESS, distance, solve_level

few = settings(max_examples=20, derandomize=True, deadline=None, database=None)


@st.composite
def rods(draw: st.DrawFn, heaviest: float = 1.0) -> ClampedRod:
    angle = st.floats(-0.9, 0.9)
    return rod_between(
        chord=(0.5, draw(st.floats(-0.15, 0.15))),
        start=draw(angle),
        end=draw(angle),
        length=draw(st.floats(0.57, 0.8)),
        clamp=draw(st.sampled_from([0.0, 0.02])),
        stiffness=STIFFNESS,
        weight=draw(st.floats(0.0, heaviest)),
    )


def solid(rod: ClampedRod) -> list[Equilibrium]:
    """The states of a rod that are not about to vanish."""
    return [state for state in find_states(rod, 1e-7) if state.lowest_eigenvalue > 3.0]


def partner(state: Equilibrium, curve: np.ndarray, others: list[Equilibrium]) -> Equilibrium:
    """The one of `others` that takes `curve`, which is `state` transformed."""
    nearest = min(others, key=lambda other: distance(other, curve))
    assert distance(nearest, curve) <= 3.0 * (state.error + nearest.error) + 1e-9
    return nearest


@few
@given(rods())
def test_upside_down_peaks_are_valleys(rod: ClampedRod) -> None:
    x, y = rod.chord
    others = find_states(changed(rod, chord=(x, -y), start=-rod.start, end=-rod.end, weight=-rod.weight), 1e-7)
    for state in solid(rod):
        other = partner(state, state.curve(51) * [1.0, -1.0], others)
        np.testing.assert_allclose(other.clamp_force, state.clamp_force * [1.0, -1.0], atol=1e-4)
        np.testing.assert_allclose(other.clamp_moment, -state.clamp_moment, atol=1e-5)
        assert abs(other.energy - state.energy) < 1e-5


@few
@given(rods())
def test_seen_from_behind_a_rod_takes_the_same_curve(rod: ClampedRod) -> None:
    x, y = rod.chord
    others = find_states(changed(rod, chord=(x, -y), start=-rod.end, end=-rod.start), 1e-7)
    for state in solid(rod):
        other = partner(state, (np.array(rod.chord) - state.curve(51)[::-1]) * [1.0, -1.0], others)
        assert other.name == state.name
        np.testing.assert_allclose(other.clamp_force, state.clamp_force[::-1] * [-1.0, 1.0], atol=1e-4)
        np.testing.assert_allclose(other.clamp_moment, -state.clamp_moment[::-1], atol=1e-5)


@few
@given(rods(), st.floats(0.2, 5.0))
def test_forces_fall_with_the_square_of_the_size(rod: ClampedRod, size: float) -> None:
    scaled = changed(
        rod,
        chord=(size * rod.chord[0], size * rod.chord[1]),
        length=size * rod.length,
        clamp=size * rod.clamp,
        weight=rod.weight / size**3,
    )
    others = find_states(scaled, size * 1e-7)
    for state in solid(rod):
        other = partner(state, size * state.curve(51), others)
        assert other.name == state.name
        np.testing.assert_allclose(other.clamp_force * size**2, state.clamp_force, atol=1e-4)
        np.testing.assert_allclose(other.clamp_moment * size, state.clamp_moment, atol=1e-5)
        assert abs(other.energy * size - state.energy) < 1e-5
        assert abs(other.lowest_eigenvalue / state.lowest_eigenvalue - 1.0) < 1e-3


@few
@given(rods(heaviest=0.0), st.floats(-3.0, 3.0))
def test_without_weight_it_does_not_matter_which_way_is_up(rod: ClampedRod, angle: float) -> None:
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    chord = np.array(rod.chord) @ turn
    turned = changed(rod, chord=(chord[0], chord[1]), start=rod.start + angle, end=rod.end + angle)
    others = find_states(turned, 1e-7)
    for state in solid(rod):
        other = partner(state, state.curve(51) @ turn, others)
        assert other.name == state.name
        np.testing.assert_allclose(other.clamp_force, state.clamp_force @ turn, atol=1e-4)
        np.testing.assert_allclose(other.clamp_moment, state.clamp_moment, atol=1e-5)
        assert abs(other.mean_height - state.mean_height) < 1e-5


@few
@given(rods(), st.integers(0, 2**32 - 1))
def test_no_small_move_that_keeps_the_clamps_lowers_the_energy(rod: ClampedRod, seed: int) -> None:
    rng = np.random.default_rng(seed)
    for state in solid(rod):
        level = solve_level(rod, 60, *coarse_start(state, 60))
        problem, lowest = level.problem, energy(level.problem, level.phi, level.multipliers)
        for _ in range(20):
            shift = (np.arange(60) + rng.uniform()) / 60
            waves = sum(rng.normal() / wave * np.sin(wave * math.pi * shift) for wave in range(1, 7))
            phi = level.phi + 0.02 * waves
            for _ in range(8):
                missed = np.array([problem.edges @ np.cos(phi), problem.edges @ np.sin(phi)]) - problem.targets
                slope = problem.edges * np.array([-np.sin(phi), np.cos(phi)])
                phi = phi - np.linalg.lstsq(slope, missed, rcond=None)[0]
            assert np.max(abs(missed)) < 1e-12
            assert np.max(abs(phi - level.phi)) > 1e-4
            assert energy(problem, phi, level.multipliers) > lowest


@few
@given(rods())
def test_the_whole_rod_is_in_balance(rod: ClampedRod) -> None:
    for state in solid(rod):
        weight = rod.weight * rod.free_length
        np.testing.assert_allclose(state.clamp_force.sum(axis=0), [0.0, weight], atol=1e-12)
        places = np.linspace(0.0, rod.length, 4001)
        free = state.curve(4001)[(places >= 0.5 * rod.clamp) & (places <= rod.length - 0.5 * rod.clamp)]
        begin = np.array(rod.free_start)
        moments = [state.clamp_moment.sum(), -weight * free[:, 0].mean()]
        for place, force in zip((begin, begin + rod.free_chord), state.clamp_force, strict=True):
            moments.append(place[0] * force[1] - place[1] * force[0])
        assert abs(sum(moments)) < 1e-4 * max(1e-2, max(abs(moment) for moment in moments))
