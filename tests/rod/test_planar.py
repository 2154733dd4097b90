"""The kernels against finite differences and dense linear algebra, and which equilibria they end at."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.linalg

from curveline.rod.planar import newton as kernels
from curveline.rod.planar.modes import from_zero, lowest_eigenvalue, modes_below, second_variation
from curveline.rod.planar.newton import Effort, descend, energy, newton
from curveline.rod.problem import (
    FORWARD_HEIGHT,
    FORWARD_X,
    FORWARD_Y,
    GRADIENT,
    INVERSE,
    STEP,
    Array,
    Problem,
    ScaledRod,
    held_in_height,
    make_problem,
    mesh,
    released,
    sharpest_turn,
)

RELAX = Effort(turn=0.5, close=1e-9, iterations=300)
SEEDS = range(12)
SADDLE = 1.995
"""alpha sqrt(L / dL) just past the pitchfork of the coarse rod below."""
STRETCHY = 5e-4
"""EI / (EA L^2) of a rod that the multipliers below strain by a few per cent."""
NO_FORCES = np.zeros(2)


def random_problem(seed: int) -> tuple[Problem, Array, Array]:
    """A heavy, loaded rod with uneven edges, two or three constraints, any angles and multipliers; a third stretch."""
    rng = np.random.default_rng(seed)
    at = np.sort(rng.uniform(0.1, 0.9, seed % 3))
    rod = ScaledRod(
        rng.uniform(0.0, 40.0),
        at,
        rng.normal(0.0, 20.0, (at.size, 2)),
        rng.uniform(-0.7, 0.7, 2),
        rng.normal(0.0, 1.0, 2),
        STRETCHY if seed % 3 == 2 else 0.0,
    )
    problem = held_in_height(make_problem(rod, mesh(at, int(rng.integers(6, 30)))))
    if seed % 2:
        problem = released(problem)
    phi = rng.normal(0.0, 1.0, problem.edges.size)
    return problem, phi, rng.normal(0.0, 120.0, problem.targets.size)


def rows_of(problem: Problem) -> Array:
    """Coefficients (k, 2, n) of the cosines and sines in the constraints."""
    rows = np.zeros((3, 2, problem.edges.size))
    rows[0, 0] = rows[1, 1] = problem.edges
    rows[2] = problem.height
    return rows[: problem.targets.size]


def strains(problem: Problem, phi: Array, multipliers: Array) -> Array:
    """Axial strains (n,) of the edges."""
    force = problem.loads + np.einsum("k,kaj->aj", multipliers, rows_of(problem))
    return -problem.compliance * (force[0] * np.cos(phi) + force[1] * np.sin(phi))


def gaps(problem: Problem, phi: Array, multipliers: Array) -> Array:
    """By how much the constraints are missed."""
    stretch = 1.0 + strains(problem, phi, multipliers)
    rows = rows_of(problem)
    return rows[:, 0] @ (stretch * np.cos(phi)) + rows[:, 1] @ (stretch * np.sin(phi)) - problem.targets


def lagrangian(problem: Problem, phi: Array, multipliers: Array) -> float:
    return float(energy(problem, phi, multipliers) + multipliers @ gaps(problem, phi, multipliers))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_descent_weighs_the_energy_and_how_far_the_constraints_are_missed(seed: int) -> None:
    problem, phi, multipliers = random_problem(seed)
    missed = gaps(problem, phi, multipliers)
    found = np.array(kernels.energy_and_gaps(problem, phi, multipliers)[1])
    total = kernels.merit(problem, phi, multipliers)
    assert found[: missed.size] == pytest.approx(missed, rel=1e-11, abs=1e-11)
    assert not found[missed.size :].any()
    penalty = 0.5 * kernels.PENALTY * missed @ missed
    assert total == pytest.approx(lagrangian(problem, phi, multipliers) + penalty, rel=1e-11)


def swept(problem: Problem, phi: Array, multipliers: Array, shift: float = 0.0) -> tuple[Array, Array, Array, Array]:
    """Gradient (n,), diagonal of the Hessian (n,), constraint rows (k, n), gaps (k,): the sweep undone."""
    n, k = phi.size, multipliers.size
    kernels.eliminate(problem, phi, multipliers, shift)
    forward = problem.room[[GRADIENT, FORWARD_X, FORWARD_Y, FORWARD_HEIGHT][: k + 1]]
    pivots = 1.0 / problem.room[INVERSE]
    missed = np.array(kernels.energy_and_gaps(problem, phi, multipliers)[1][:k])
    ratio = -problem.stiffness[1:n] / pivots[:-1]
    diagonal, rows = pivots.copy(), forward.copy()
    diagonal[1:] -= ratio * problem.stiffness[1:n]
    rows[:, 1:] += ratio * forward[:, :-1]
    return rows[0], diagonal, rows[1:], missed


def dense_hessian(problem: Problem, diagonal: Array) -> Array:
    inner = problem.stiffness[1:-1]
    return np.diag(diagonal) - np.diag(inner, 1) - np.diag(inner, -1)


def reduced(problem: Problem, phi: Array, multipliers: Array) -> tuple[Array, Array]:
    """Dense second variation and mass matrix on the directions that keep the constraints."""
    diagonal, border, corner = second_variation(problem, phi, multipliers)
    hessian = dense_hessian(problem, diagonal)
    if np.any(corner):
        # A rod that stretches can leave the constraints of the angles, at a price.
        return hessian + border.T @ np.linalg.solve(corner, border), np.diag(problem.edges)
    free = scipy.linalg.null_space(border)
    return free.T @ hessian @ free, free.T @ (problem.edges[:, None] * free)


@pytest.mark.parametrize("seed", SEEDS)
def test_gradient_is_the_slope_of_the_lagrangian(seed: int) -> None:
    problem, phi, multipliers = random_problem(seed)
    gradient, _, rows, residual = swept(problem, phi, multipliers)
    step = 1e-5
    slope, bends = np.empty_like(phi), np.empty_like(rows)
    for j in range(phi.size):
        turn = step * np.eye(phi.size)[j]
        slope[j] = lagrangian(problem, phi + turn, multipliers) - lagrangian(problem, phi - turn, multipliers)
        bends[:, j] = gaps(problem, phi + turn, multipliers) - gaps(problem, phi - turn, multipliers)
    assert np.max(abs(gradient)) > 1.0
    np.testing.assert_allclose(gradient, slope / (2 * step), rtol=1e-6, atol=1e-6 * np.max(abs(gradient)))
    np.testing.assert_allclose(rows, bends / (2 * step), atol=1e-8)
    np.testing.assert_allclose(residual, gaps(problem, phi, multipliers), atol=1e-13)


@pytest.mark.parametrize("seed", SEEDS)
def test_hessian_is_the_slope_of_the_gradient(seed: int) -> None:
    problem, phi, multipliers = random_problem(seed)
    _, diagonal, border, _ = swept(problem, phi, multipliers)
    hessian = dense_hessian(problem, diagonal)
    # Larger angles' steps where the Hessian is small would only add truncation: one step scaled by the largest entry.
    step = 1e-4 / math.sqrt(np.max(abs(hessian)) / 100.0)
    slopes = np.empty_like(hessian)
    for j in range(phi.size):
        turn = step * np.eye(phi.size)[j]
        slopes[j] = swept(problem, phi + turn, multipliers)[0] - swept(problem, phi - turn, multipliers)[0]
    assert np.min(np.max(abs(hessian), axis=1)) > 1.0
    np.testing.assert_allclose(hessian, slopes / (2 * step), atol=1e-6 * np.max(abs(hessian)))
    alone, rows, corner = second_variation(problem, phi, multipliers)
    np.testing.assert_allclose(alone, diagonal, rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(rows, border, atol=1e-11)
    if np.any(problem.compliance):
        ways = step * np.eye(multipliers.size)
        give = [gaps(problem, phi, multipliers - way) - gaps(problem, phi, multipliers + way) for way in ways]
        assert np.max(abs(corner)) > 1e-5
        np.testing.assert_allclose(corner, np.array(give) / (2 * step), rtol=1e-6, atol=1e-9)
    else:
        assert not np.any(corner)


@pytest.mark.parametrize("shift", [0.0, 30.0])
@pytest.mark.parametrize("seed", SEEDS)
def test_newton_step_and_inertia_are_those_of_the_dense_system(seed: int, shift: float) -> None:
    problem, phi, multipliers = random_problem(seed)
    n, k = phi.size, multipliers.size
    gradient, diagonal, border, residual = swept(problem, phi, multipliers, shift)
    corner = second_variation(problem, phi, multipliers)[2]
    whole = np.block([[dense_hessian(problem, diagonal), border.T], [border, -corner]])
    wanted = np.linalg.solve(whole, -np.concatenate([gradient, residual]))
    unstable, turn, change = kernels.newton_step(problem, phi, multipliers, shift)
    step = np.concatenate([problem.room[STEP], change[:k]])
    assert np.max(abs(wanted)) > 1e-3
    np.testing.assert_allclose(step, wanted, rtol=1e-7, atol=1e-9 * np.max(abs(wanted)))
    assert turn == np.max(abs(step[:n]))
    assert not any(change[k:])
    modes = np.linalg.eigvalsh(whole)
    assert np.min(abs(modes)) > 1e-9
    assert unstable == np.count_nonzero(modes < 0.0) - k


@pytest.mark.parametrize("seed", range(30))
def test_modes_and_lowest_eigenvalue_are_those_of_the_dense_second_variation(seed: int) -> None:
    problem, phi, multipliers = random_problem(seed)
    modes = scipy.linalg.eigh(*reduced(problem, phi, multipliers), eigvals_only=True)
    diagonal, border, corner = second_variation(problem, phi, multipliers)
    for value in (0.0, modes[0] - 1.0, modes[0] + 1e-6 * abs(modes[0]), 0.5 * (modes[1] + modes[2]), 1e4):
        assert modes_below(problem, (diagonal, border, corner), value) == np.count_nonzero(modes < value)
    assert lowest_eigenvalue(problem, phi, multipliers, from_zero(), 1e-9) == pytest.approx(modes[0], rel=1e-8)


def test_random_problems_are_of_every_stability() -> None:
    lowest = [np.linalg.eigvalsh(reduced(*random_problem(seed))[0])[0] for seed in range(30)]
    assert sum(value < 0.0 for value in lowest) >= 5
    assert sum(value > 0.0 for value in lowest) >= 5


@pytest.mark.parametrize("held", [(1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (0.0, 0.0)])
@pytest.mark.parametrize("seed", SEEDS)
def test_borders_are_solved_and_counted_as_dense_ones(seed: int, held: tuple[float, float]) -> None:
    rng = np.random.default_rng(seed)
    problem = random_problem(seed)[0]._replace(held=np.array(held))
    matrix = rng.normal(size=(3, 3))
    matrix += matrix.T
    right = rng.normal(size=3)
    schur = tuple(matrix[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]].tolist())
    there = [place for place in range(3) if (*held, 1.0)[place]]
    kept = matrix[np.ix_(there, there)]
    negative, change = kernels.solve_border(problem, schur, tuple(right.tolist()))
    np.testing.assert_allclose(np.array(change)[there], np.linalg.solve(kept, right[there]), rtol=1e-9)
    assert not any(each for place, each in enumerate(change) if place not in there)
    assert negative == np.count_nonzero(np.linalg.eigvalsh(kept) < 0.0)


def arch_problem(length: float, tilt: float, weight: float = 0.0, n: int = 40) -> Problem:
    """Level clamps tilted by +-tilt, the chord 1 / length."""
    rod = ScaledRod(weight, np.empty(0), np.empty((0, 2)), np.array([1.0 / length, 0.0]), np.array([tilt, -tilt]))
    return make_problem(rod, mesh(np.empty(0), n))


def symmetric_start(n: int, height: float) -> Array:
    """The valley (height < 0) or peak that is its own mirror image."""
    places = (np.arange(n) + 0.5) / n
    return height * np.sin(2.0 * np.pi * places)


def test_newton_stays_on_the_dead_symmetric_branch_and_says_that_it_is_unstable() -> None:
    # Past the pitchfork of both ends turned against the valley, alpha sqrt(L / dL) = 2, the valley is a saddle.
    slack = 0.02
    phi, multipliers = symmetric_start(40, -2.0 * math.sqrt(slack)), np.array([40.0, 0.0])
    for factor, unstable in ((1.9, 0), (1.94, 0), (1.97, 0), (1.99, 0), (SADDLE, 1)):
        problem = arch_problem(1.0 / (1.0 - slack), factor * math.sqrt(slack))
        iterations, found = newton(problem, phi, multipliers, RELAX)
        assert iterations > 0
        np.testing.assert_allclose(phi, -phi[::-1], atol=1e-9)
        assert np.sum(np.sin(phi[:20])) < 0.0
        assert found == unstable
        assert np.count_nonzero(np.linalg.eigvalsh(reduced(problem, phi, multipliers)[0]) < 0.0) == unstable


def test_descent_from_that_saddle_does_not_call_it_an_end() -> None:
    slack = 0.02
    problem = arch_problem(1.0 / (1.0 - slack), SADDLE * math.sqrt(slack))
    phi, multipliers = symmetric_start(40, -2.0 * math.sqrt(slack)), np.array([70.0, 0.0])
    _, unstable = newton(problem, phi, multipliers, RELAX)
    assert unstable == 1
    saddle = energy(problem, phi, NO_FORCES)
    phi += 1e-3 * np.sin(2.0 * np.pi * np.arange(40) / 20.0 + 0.4)
    assert descend(problem, phi, multipliers, RELAX) > 0
    assert energy(problem, phi, NO_FORCES) < saddle - 0.1
    assert np.sum(np.sin(phi[:20])) > 0.0


@pytest.mark.parametrize("seed", range(40))
def test_descent_ends_at_stable_equilibria_only(seed: int) -> None:
    rng = np.random.default_rng(seed)
    chord = np.array([rng.uniform(0.6, 0.9), rng.uniform(-0.2, 0.2)])
    rod = ScaledRod(rng.uniform(0.0, 20.0), np.empty(0), np.empty((0, 2)), chord, rng.uniform(-1.0, 1.0, 2))
    problem = make_problem(rod, mesh(np.empty(0), 40))
    phi, multipliers = rng.normal(0.0, 0.6, 40), np.zeros(2)
    if descend(problem, phi, multipliers, RELAX) < 0:
        return
    assert abs(gaps(problem, phi, multipliers)).max() < 1e-9
    assert abs(swept(problem, phi, multipliers)[0]).max() < 1e-7
    assert np.linalg.eigvalsh(reduced(problem, phi, multipliers)[0])[0] > 0.0


def test_descent_seldom_fails() -> None:
    done = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        problem = arch_problem(rng.uniform(1.1, 1.5), rng.uniform(-0.8, 0.8), rng.uniform(0.0, 20.0))
        phi, multipliers = rng.normal(0.0, 0.5, 40), np.zeros(2)
        done += descend(problem, phi, multipliers, RELAX) > 0 and sharpest_turn(problem, phi) < 1.0
    assert done >= 36


@pytest.mark.parametrize("effort", [Effort(0.5, 1e-9, 1), Effort(0.5, 1e-9, 3)])
def test_running_out_of_iterations_is_said(effort: Effort) -> None:
    problem = arch_problem(1.3, 0.4)
    for kernel in (newton, descend):
        result = kernel(problem, symmetric_start(40, 1.0), np.zeros(2), effort)
        assert (result[0] if kernel is newton else result) == -effort.iterations


def at_equilibrium(chord: Array, ends: Array) -> tuple[float, Array, Problem, Array]:
    rod = ScaledRod(12.0, np.empty(0), np.empty((0, 2)), chord, ends)
    problem = make_problem(rod, mesh(np.empty(0), 40))
    phi, multipliers = symmetric_start(40, 1.0), np.array([40.0, 0.0])
    assert newton(problem, phi, multipliers, RELAX)[0] > 0
    return float(energy(problem, phi, NO_FORCES)), multipliers, problem, phi


def test_multipliers_and_end_moments_are_slopes_of_the_energy() -> None:
    chord, ends, step = np.array([0.8, 0.1]), np.array([0.3, -0.5]), 1e-5
    _, multipliers, problem, phi = at_equilibrium(chord, ends)
    moments = [
        -(phi[0] - ends[0]) * problem.stiffness[0],
        (ends[1] - phi[-1]) * problem.stiffness[-1],
    ]
    for axis in (0, 1):
        turn = step * np.eye(2)[axis]
        by_place = (at_equilibrium(chord + turn, ends)[0] - at_equilibrium(chord - turn, ends)[0]) / (2 * step)
        by_angle = (at_equilibrium(chord, ends + turn)[0] - at_equilibrium(chord, ends - turn)[0]) / (2 * step)
        assert abs(by_place) > 1.0
        assert abs(by_angle) > 1.0
        assert -multipliers[axis] == pytest.approx(by_place, rel=1e-6)
        assert moments[axis] == pytest.approx(by_angle, rel=1e-6)
