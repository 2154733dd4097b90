"""Static equilibria of the spatial rod: what they end at, how well, how fast, and that they are those of the plane."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.linalg

from curveline.rod.planar.modes import from_zero, lowest_eigenvalue
from curveline.rod.planar.newton import Effort
from curveline.rod.planar.newton import newton as planar_newton
from curveline.rod.problem import Array, ScaledRod, make_problem, mesh
from curveline.rod.spatial.bands import times
from curveline.rod.spatial.energy import Shape, SpatialRod, assemble, metric, moments, moved, positions
from curveline.rod.spatial.lifting import frame
from curveline.rod.spatial.relax import RESIDUAL, RelaxEnding, descend, is_stable, lowest_mode, lowest_modes, newton
from curveline.rod.spatial.stability import lowest_eigenvalue as lowest_in_space
from curveline.rod.spatial.twisting import spun, total_twist, twisted, wind

from .spatial_rods import arch, dense, turned

STRETCHES = (1e2, 1e4, 1e7, 1e10)


def residual(rod: SpatialRod, shape: Shape) -> float:
    """Largest force that is left over, over the largest that an edge passes on."""
    gradient, _ = assemble(rod, shape)
    n = rod.edges.size
    forces = np.append(gradient, 0.0).reshape(-1, 4)
    passed = np.cumsum(forces[:n, :3] + rod.forces[:n], axis=0)
    last = 4 * n if rod.held[1] else 4 * n + 3
    return float(np.max(np.abs(gradient[3:last])) / max(np.max(np.abs(passed)), 1.0))


def reduced(rod: SpatialRod, shape: Shape) -> tuple[Array, Array]:
    """Dense second variation and metric of what is free."""
    _, band = assemble(rod, shape)
    free = slice(3, -3 if rod.held[1] else None)
    return dense(band)[free, free], dense(metric(rod))[free, free]


def rough_start(seed: int, n: int, stretch: float, size: float) -> tuple[SpatialRod, Shape]:
    """An arch's clamps, and a shape that bends out of the plane, twists, and meets neither clamp."""
    rod, shape = arch(n, 0.6, 0.85, (17.0, 1.0, 0.7, stretch))
    rng, s = np.random.default_rng(seed), (np.arange(n) + 0.5) / n
    wave = size * rng.normal(size=3)[:, None] * np.array([np.cos(3.0 * s), np.sin(6.0 * s), np.sin(5.0 * s)])
    return rod, Shape(shape.strain, np.array([turned(*each) for each in zip(shape.frames, wave.T, strict=True)]))


@pytest.mark.parametrize("stretch", STRETCHES)
@pytest.mark.parametrize("n", [20, 100, 1000])
def test_rough_guesses_settle_in_a_few_iterations(n: int, stretch: float) -> None:
    counts = []
    for seed in range(12 if n < 1000 else 4):
        rod, start = rough_start(seed, n, stretch, 0.2)
        relaxed = descend(rod, start)
        assert relaxed.ending is RelaxEnding.SETTLED, seed
        assert residual(rod, relaxed.shape) <= 1.01 * RESIDUAL
        assert positions(rod, relaxed.shape)[-1] == pytest.approx(rod.chord, abs=1e-9)
        assert is_stable(rod, relaxed.shape)
        counts.append(relaxed.iterations)
    assert np.median(counts) <= 10
    assert max(counts) <= (15 if n < 1000 else 25)


@pytest.mark.parametrize("seed", range(6))
def test_far_guesses_settle_too(seed: int) -> None:
    rod, start = rough_start(seed, 60, 1e6, 0.5)
    relaxed = descend(rod, start)
    assert relaxed.ending is RelaxEnding.SETTLED
    assert np.linalg.eigvalsh(reduced(rod, relaxed.shape)[0])[0] > 0.0
    assert relaxed.iterations <= 60


def test_residuals_do_not_grow_with_the_number_of_edges() -> None:
    rod, start = rough_start(1, 5000, 1e6, 0.1)
    relaxed = descend(rod, start)
    assert residual(rod, relaxed.shape) < RESIDUAL
    # What the shape carries along makes the difference: differences of frames alone leave n^2 times the rounding.
    assert residual(rod, Shape(relaxed.shape.strain, relaxed.shape.frames)) > RESIDUAL


def test_a_clamp_that_moved_is_not_overlooked() -> None:
    rod, start = arch(30)
    shape = descend(rod, start).shape
    frames = rod.frames.copy()
    frames[1] = turned(frames[1], np.array([0.0, 1e-6, 0.0]))
    assert residual(rod, shape) < RESIDUAL
    assert residual(rod._replace(frames=frames), shape) > 1e-6


PLANAR = {
    "arch": ((0.85, 0.0), (0.6, -0.6), 0.0, ()),
    "uneven": ((0.8, 0.1), (0.7, -0.2), 0.0, ()),
    "heavy": ((0.8, 0.0), (0.4, -0.4), 30.0, ()),
    "loaded": ((0.8, 0.05), (0.5, -0.3), 5.0, ((0.4, 3.0, -20.0),)),
}


@pytest.mark.parametrize("scene", PLANAR)
@pytest.mark.parametrize("compliance", [1e-3, 1e-5])
def test_in_the_plane_it_is_the_extensible_rod(scene: str, compliance: float) -> None:
    chord, ends, weight, loads = PLANAR[scene]

    def gap(n: int) -> Array:
        """How far the spatial rod's positions, force, moment, energy and eigenvalue are from the planar rod's."""
        at = np.array([load[0] for load in loads])
        scaled = ScaledRod(
            weight,
            at,
            np.array([load[1:] for load in loads]).reshape(-1, 2),
            np.array(chord),
            np.array(ends),
            compliance,
        )
        problem = make_problem(scaled, mesh(at, n))
        s = np.cumsum(problem.edges) - 0.5 * problem.edges
        phi, force = ends[0] + (ends[1] - ends[0]) * s, np.zeros(2)
        iterations, unstable = planar_newton(problem, phi, force, Effort(turn=0.3, close=1e-9, iterations=80))
        assert iterations > 0
        assert unstable == 0
        forces = np.zeros((problem.edges.size + 1, 3))
        forces[:-1, 1] -= 0.5 * weight * problem.edges
        forces[1:, 1] -= 0.5 * weight * problem.edges
        places = np.concatenate([[0.0], np.cumsum(problem.edges)])
        for fraction, *load in loads:
            forces[np.argmin(np.abs(places - fraction)), :2] += load
        rod = SpatialRod(
            problem.edges,
            np.array([20.0, 1.0, 15.0, 1.0 / compliance]),
            np.zeros((problem.edges.size + 1, 3)),
            forces,
            np.array([*chord, 0.0]),
            np.array([frame(each) for each in ends]),
            np.ones(3),
        )
        relaxed = descend(rod, Shape(np.zeros(phi.size), np.array([frame(each) for each in phi])))
        assert relaxed.ending is RelaxEnding.SETTLED
        assert relaxed.iterations <= 10
        tangents = np.diff(positions(rod, relaxed.shape), axis=0)
        assert np.max(np.abs(tangents[:, 2])) < 1e-12
        angles = np.arctan2(tangents[:, 1], tangents[:, 0])
        lowest = lowest_eigenvalue(problem, phi, force, from_zero(), 1e-10)
        bending = 2.0 * (ends[1] - phi[-1]) / problem.edges[-1]
        gradient, _ = assemble(rod, relaxed.shape)
        return np.array(
            [
                np.max(np.abs(angles - phi)),
                np.max(np.abs(gradient[-3:-1] + force)) / np.max(np.abs(force)),
                abs(moments(rod, relaxed.shape)[1, 2] - bending) / abs(bending),
                abs(lowest_mode(rod, relaxed.shape)[0] / lowest - 1.0),
            ]
        )

    coarse, fine = gap(20), gap(80)
    # Both are of second order, but for different discrete curvatures: 2 tan(turn / 2) against the turn itself.
    assert np.all(fine[:3] < [2e-3, 5e-3, 5e-3])
    assert np.all(fine[:3] < coarse[:3] / 10.0)
    # In space the strain of a mode counts in its size, so that eigenvalues agree for stiff rods.
    assert fine[3] < 5e-3 + 120.0 * compliance


@pytest.mark.parametrize("case", ["planar", "twisted", "cantilever"])
def test_errors_fall_with_the_square_of_the_edges(case: str) -> None:
    def level(n: int) -> Array:
        rod, start = arch(n, 0.7, 0.8, (4.0, 1.0, 0.8, 1e5))
        if case == "twisted":
            rod, start = twisted(rod._replace(natural=np.tile([0.5, 1.0, 0.3], (n + 1, 1))), start, 2.0)
        if case == "cantilever":
            rod.forces[n] = [0.0, -3.0, 2.0]
            rod = rod._replace(held=np.array([1.0, 0.0, 0.0]))
        shape = descend(rod, start).shape
        places = positions(rod, shape)
        return np.array([*places[n // 2], *places[n]])

    finest = level(512)
    errors = [np.linalg.norm(level(n) - finest) for n in (16, 32, 64)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all(np.abs(orders - 2.0) < 0.1), orders


def saddle(n: int = 40) -> tuple[SpatialRod, Shape]:
    """The flat state of a rod that is pushed together: Euler's column past its load, unstable in both planes."""
    rod, _ = arch(n, 0.0, 0.9, (1.5, 1.0, 0.8, 1e3))
    return rod, Shape(np.full(n, -0.1), np.array([frame(0.0)] * n))


def test_descent_leaves_saddles_and_newton_finds_them() -> None:
    rod, shape = saddle()
    assert newton(rod, shape).ending is RelaxEnding.SETTLED
    assert not is_stable(rod, shape)
    value, mode = lowest_mode(rod, shape)
    assert value < 0.0
    _, turn = moved(rod, shape, mode, 1.0)
    left = descend(rod, moved(rod, shape, mode, 1e-4 / turn)[0])
    assert left.ending is RelaxEnding.SETTLED
    assert is_stable(rod, left.shape)
    assert np.max(np.abs(positions(rod, left.shape)[:, 1:])) > 0.1
    # On the saddle itself, to the last digit, nothing tells where to go; but it is not called stable.
    stuck = descend(rod, shape, 60)
    assert stuck.ending is not RelaxEnding.SETTLED or is_stable(rod, stuck.shape)


@pytest.mark.parametrize("stretch", [1e2, 1e5, 1e9])
@pytest.mark.parametrize("kind", ["stable", "saddle", "twisted", "cantilever"])
def test_the_lowest_modes_are_those_of_the_dense_matrices(kind: str, stretch: float) -> None:
    n = 24
    rod, shape = arch(n, 0.7, 0.8, (3.0, 1.0, 0.8, stretch))
    if kind == "saddle":
        rod, shape = saddle(n)
    elif kind == "twisted":
        for _ in range(6):
            rod, shape = twisted(rod, newton(rod, shape).shape, 1.5)
    elif kind == "cantilever":
        rod = rod._replace(held=np.array([1.0, 0.0, 0.0]))
    shape = newton(rod, shape).shape
    hessian, mass = reduced(rod, shape)
    expected = scipy.linalg.eigh(hessian, mass, eigvals_only=True)[:3]
    values, modes = lowest_modes(rod, shape, 3)
    noise = 1e-15 * stretch * n
    assert values == pytest.approx(expected, rel=1e-8, abs=1e-8 + noise)
    assert (expected[0] < 0.0) == (kind == "saddle" or (kind == "twisted" and stretch > 1e2))
    _, band = assemble(rod, shape)
    # By turns alone: what the strains of a mode have in its size is known to the square of the strain.
    strain = float(np.max(np.abs(shape.strain)))
    assert lowest_in_space(rod, shape) == pytest.approx(expected[0], rel=1e-8 + strain**2, abs=noise)
    assert is_stable(rod, shape) == (expected[0] > 0.0)
    for value, mode in zip(values, modes, strict=True):
        assert mode @ times(metric(rod), mode) == pytest.approx(1.0)
        assert mode @ times(band, mode) == pytest.approx(value, rel=1e-6, abs=1e-5 + noise)


def test_nearly_singular_states_keep_their_eigenvalue() -> None:
    # A round rod's arch between facing clamps turns freely about the line through them.
    rod, start = arch(60, 0.0, 0.7, (1.0, 1.0, 0.9, 1e6))
    s = (np.arange(60) + 0.5) / 60
    state = descend(rod, start._replace(frames=np.array([frame(each) for each in np.sin(2.0 * math.pi * s)])))
    assert state.ending is RelaxEnding.SETTLED
    values, _ = lowest_modes(rod, state.shape, 2)
    assert abs(values[0]) < 1e-6
    assert values[1] > 1.0
    assert is_stable(rod, state.shape)


def test_the_lowest_mode_of_ten_thousand_edges() -> None:
    few, many = (lowest_mode(rod, descend(rod, start).shape)[0] for rod, start in (arch(2000), arch(10_000)))
    # Rounding of the Hessian's entries, which grow with the third power of the edges, leaves five digits.
    assert many == pytest.approx(few, rel=2e-4)


def test_twist_of_several_turns() -> None:
    stiff = (60.0, 40.0, 0.5, 1e6)
    rod, start = arch(40, 0.0, 1.0, stiff)
    straight = descend(rod, Shape(start.strain, np.array([frame(0.0)] * 40))).shape
    for turns in (0.25, -1.0, 3.5):
        angle = 2.0 * math.pi * turns
        there, relaxed = wind(rod, straight, angle)
        assert relaxed.ending is RelaxEnding.SETTLED
        assert total_twist(there, relaxed.shape) == pytest.approx(angle, rel=1e-9)
        assert moments(there, relaxed.shape)[1] == pytest.approx([0.5 * angle, 0.0, 0.0], abs=1e-7)
        at_once, shape = twisted(rod, straight, angle)
        assert at_once.frames[1] @ there.frames[1] == pytest.approx(
            math.copysign(1.0, at_once.frames[1] @ there.frames[1])
        )
        assert descend(at_once, shape).shape.frames == pytest.approx(relaxed.shape.frames, abs=1e-8)
        back, relaxed = wind(there, relaxed.shape, -angle)
        assert total_twist(back, relaxed.shape) == pytest.approx(0.0, abs=1e-9)
    assert spun(frame(0.3), 0.2) == pytest.approx(frame(0.3, 0.0, 0.2))


def test_winding_stops_where_nothing_stable_is_left() -> None:
    rod, start = arch(12, 0.0, 1.0, (1.0, 1.0, 1.0, 1e4))
    there, relaxed = wind(rod._replace(stiffness=np.full(4, np.inf)), start, 1.0)
    assert relaxed.ending is RelaxEnding.BROKEN
    assert there.frames.shape == (2, 4)


def test_natural_curvature_is_the_shape_without_forces() -> None:
    n = 60
    rod, start = arch(n, 0.0, 1.0, (2.0, 1.0, 0.7, 1e6))
    natural = np.array([0.0, 3.0, 1.5])
    rod = rod._replace(natural=np.tile(natural, (n + 1, 1)), held=np.array([1.0, 0.0, 0.0]))
    relaxed = descend(rod, start)
    assert relaxed.ending is RelaxEnding.SETTLED
    # A helix with the curvature and the torsion of the rest state.
    tangents = np.diff(positions(rod, relaxed.shape), axis=0) * n
    size = np.linalg.norm(natural)
    axis = tangents.sum(axis=0) / n
    turn = np.arccos(np.clip(np.sum(tangents[1:] * tangents[:-1], axis=1), -1.0, 1.0)) * n
    assert turn == pytest.approx(3.0, rel=2e-3)
    assert np.linalg.norm(axis) < 1.0
    assert total_twist(rod, relaxed.shape) == pytest.approx(natural[2] * (1.0 - 0.5 / n), rel=1e-6)
    assert size > 3.0
    assert residual(rod, relaxed.shape) < 1e-9


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_out_of_range_are_an_outcome(bad: float) -> None:
    rod, start = arch(10)
    rod.forces[3, 0] = bad
    assert descend(rod, start).ending is RelaxEnding.BROKEN
    assert newton(rod, start).ending is RelaxEnding.BROKEN


def test_what_cannot_be_reached_is_an_outcome() -> None:
    rod, start = arch(20, 0.3, 3.0)
    assert descend(rod, start).ending is not RelaxEnding.SETTLED or descend(rod, start).shape.strain.min() > 1.0
