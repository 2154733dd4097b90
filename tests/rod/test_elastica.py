"""Closed forms against each other, and the rod against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clamped_rods import rod_between
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.elastica import Arc, Inflectional, clamped_arch, rectangular
from curveline.rod.states.equilibrium import Equilibrium, Outcome, refine
from curveline.rod.states.planar_states import find_states

from .rods import distance

CHORDS = [0.95, 0.9, 0.8, 0.7, 0.5, 0.25]

SOLUTIONS: list[tuple[str, Inflectional | Arc]] = [
    *((f"arch-{chord}", clamped_arch(chord * 0.6, 0.6, 0.028)) for chord in CHORDS),
    *((f"arc-{angle}", Arc(math.radians(angle), 0.7, 0.028)) for angle in (-100.0, 5.0, 60.0, 120.0, 170.0)),
    ("rectangular", rectangular(0.7, 0.028)),
]


def rod_of(exact: Inflectional | Arc) -> ClampedRod:
    """The rod whose answer a closed form is."""
    start, end = exact.angles(np.array([0.0, exact.length]))
    x, y = exact.positions(np.array([exact.length]))[0]
    return rod_between((float(x), float(y)), float(start), float(end), exact.length, 0.0, exact.stiffness, 0.0)


def guess_of(exact: Inflectional | Arc, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Edge angles and multipliers of a closed form, to start Newton from."""
    middles = (np.arange(n) + 0.5) / n * exact.length
    return exact.angles(middles), -exact.clamp_force[1] * exact.length**2 / exact.stiffness


def solved(exact: Inflectional | Arc, tolerance: float) -> Equilibrium:
    return refine(rod_of(exact), np.full(24, 1 / 24), *guess_of(exact, 24), tolerance)


def test_rectangular_elastica_carries_no_end_moment_and_stores_two_pi() -> None:
    exact = rectangular(1.0, 1.0)
    assert exact.angles(np.array([0.0, 1.0])) == pytest.approx([math.pi / 2, -math.pi / 2])
    assert exact.clamp_moment == pytest.approx([0.0, 0.0], abs=1e-14)
    assert exact.thrust == pytest.approx(13.750371636, rel=1e-10)
    assert exact.energy == pytest.approx(2.0 * math.pi, rel=1e-14)
    assert exact.positions(np.array([1.0]))[0] == pytest.approx([0.456946581, 0.0], abs=1e-9)


def test_arc_has_the_stated_moment_and_energy() -> None:
    exact = Arc(0.8, 1.0, 1.0)
    assert exact.clamp_moment == pytest.approx([1.6, -1.6])
    assert exact.energy == pytest.approx(2 * 0.8**2)
    assert exact.positions(np.array([1.0]))[0] == pytest.approx([math.sin(0.8) / 0.8, 0.0])


@pytest.mark.parametrize(("name", "exact"), SOLUTIONS)
def test_angle_curvature_and_position_of_a_closed_form_belong_together(name: str, exact: Inflectional | Arc) -> None:
    places = np.linspace(0.05, exact.length - 0.05, 40)
    step = 1e-6
    tangent = (exact.positions(places + step) - exact.positions(places - step)) / (2 * step)
    angles = exact.angles(places)
    np.testing.assert_allclose(tangent, np.column_stack([np.cos(angles), np.sin(angles)]), atol=1e-8)
    curvature = (exact.angles(places + step) - exact.angles(places - step)) / (2 * step)
    np.testing.assert_allclose(curvature, exact.curvature(places), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(("name", "exact"), SOLUTIONS)
def test_positions_of_a_closed_form_do_not_jump_at_quarter_periods(name: str, exact: Inflectional | Arc) -> None:
    for n in (32, 64, 128, 256):
        edges = np.linalg.norm(np.diff(exact.positions(np.linspace(0.0, exact.length, n + 1)), axis=0), axis=1)
        np.testing.assert_allclose(edges, exact.length / n, rtol=60.0 / n**2)


@pytest.mark.parametrize(("chord", "length"), [(1.0, 1.0), (1.1, 1.0), (-0.1, 1.0)])
def test_no_arch_over_a_chord_as_long_as_the_rod(chord: float, length: float) -> None:
    with pytest.raises(ValueError, match="does not arch"):
        clamped_arch(chord, length, 1.0)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7])
@pytest.mark.parametrize(("name", "exact"), SOLUTIONS)
def test_the_rod_takes_the_closed_form(name: str, exact: Inflectional | Arc, tolerance: float) -> None:
    state = solved(exact, tolerance)
    assert state.outcome is Outcome.CONVERGED
    error = distance(state, exact.positions(np.linspace(0.0, exact.length, 201)))
    assert error <= state.error <= tolerance
    relative = 3e-4 if tolerance > 1e-5 else 2e-6
    unit = exact.stiffness / exact.length**2
    assert state.energy == pytest.approx(exact.energy, rel=relative)
    np.testing.assert_allclose(state.clamp_force, exact.clamp_force, rtol=0.0, atol=10 * relative * unit)
    np.testing.assert_allclose(
        state.clamp_moment, exact.clamp_moment, rtol=0.0, atol=10 * relative * unit * exact.length
    )
    assert state.stable


@pytest.mark.parametrize("angle", [5.0, 60.0, 120.0])
def test_an_arc_bends_evenly_and_needs_no_force(angle: float) -> None:
    exact = Arc(math.radians(angle), 0.7, 0.028)
    state = solved(exact, 1e-9)
    assert state.vertices_table[:, 3] == pytest.approx(exact.bend, rel=1e-7)
    assert abs(state.clamp_force).max() < 2e-6 * exact.stiffness / exact.length**2


def test_level_clamps_show_the_closed_form_and_its_mirror_image() -> None:
    arch = clamped_arch(0.5, 0.6, 1.0)
    peak, valley = find_states(rod_of(arch), 1e-6)
    curve = arch.positions(np.linspace(0.0, 0.6, 101))
    assert distance(peak, curve) < 1e-6
    assert distance(valley, curve * [1.0, -1.0]) < 1e-6
