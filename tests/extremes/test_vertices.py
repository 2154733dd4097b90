"""From 4 to 100,000 vertices: as many Newton steps, errors of second order, and no work on pairs of edges."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

from clamped_rods import rod_between
from curveline.rod.geometry.crossings import clearance, crosses_itself, crosses_tails
from curveline.rod.planar.modes import from_zero, lowest_eigenvalue
from curveline.rod.planar.newton import Effort, newton
from curveline.rod.planar.richardson import vertex_table
from curveline.rod.problem import make_problem, mesh
from curveline.rod.states.planar_states import find_states

ROD = rod_between((0.5, 0.03), 0.4, -0.6, 0.64, 0.0, 1.0, 10.0)
EXACT = Effort(turn=0.3, close=1e-7, iterations=40)
HANG = 2.0
COUNTS = [4, 5, 10, 100, 1_000, 10_000, 100_000]


@pytest.fixture(scope="module", autouse=True)
def compiled() -> None:
    edges = np.asarray(mesh(np.empty(0), 10))
    problem = make_problem(ROD.scaled(), edges)
    phi, multipliers = find_states(ROD, 1e-3)[0].start_on(edges)
    newton(problem, phi, multipliers, EXACT)
    lowest_eigenvalue(problem, phi, multipliers, from_zero(), 1e-3)
    vertex_table(problem, phi, multipliers)


def test_steps_do_not_grow_with_the_vertices_and_errors_fall_with_their_square() -> None:
    truth = find_states(ROD, 1e-10)[0]
    steps, errors = [], []
    for vertices in COUNTS:
        edges = np.asarray(mesh(np.empty(0), vertices - 1))
        begin = time.process_time()
        problem = make_problem(ROD.scaled(), edges)
        phi, multipliers = truth.start_on(edges)
        iterations, unstable = newton(problem, phi, multipliers, EXACT)
        value = lowest_eigenvalue(problem, phi, multipliers, from_zero(), 1e-3)
        table = vertex_table(problem, phi, multipliers)
        assert time.process_time() - begin < HANG
        assert iterations > 0
        assert unstable == 0
        assert value > 0.0
        steps.append(iterations)
        middle = table[edges.size // 2, :2] * ROD.length
        place = float(np.sum(edges[: edges.size // 2]))
        fine = truth.curve(100_001)[round(place * 100_000)]
        errors.append(float(np.hypot(*(middle - fine))))
    print(f"vertices {COUNTS}: steps {steps}, errors {errors}")
    assert max(steps) <= 8
    assert max(steps[3:]) - min(steps[3:]) <= 1
    for vertices, error in zip(COUNTS[3:6], errors[3:6], strict=True):
        assert error < 2.0 / vertices**2 + 1e-5 * ROD.length


def curve(n: int, shape: str) -> np.ndarray:
    """Vertices of a curve of unit length with n edges."""
    s = (np.arange(n) + 0.5) / n
    angles = {"arch": 1.2 * np.cos(math.pi * s), "snake": 1.5 * np.sin(40.0 * s), "straight": 0.0 * s}[shape]
    table = np.zeros((n + 1, 6))
    table[1:, 0] = np.cumsum(np.cos(angles)) / n
    table[1:, 1] = np.cumsum(np.sin(angles)) / n
    table[0, 2], table[-1, 2] = angles[0], angles[-1]
    return table


@pytest.mark.parametrize("shape", ["arch", "snake", "straight"])
def test_what_a_curve_does_to_itself_is_known_at_once_with_any_number_of_vertices(shape: str) -> None:
    crosses_itself(curve(10, shape)), clearance(curve(10, shape)), crosses_tails(curve(10, shape), 0.1)
    near = clearance(curve(100, shape))
    for n in (1_000, 10_000, 100_000):
        table = curve(n, shape)
        begin = time.process_time()
        assert not crosses_itself(table)
        assert not crosses_tails(table, 0.1)
        assert clearance(table) == pytest.approx(near, rel=0.06)
        # All pairs of 100,000 edges would take half a minute.
        assert time.process_time() - begin < HANG


def test_trees_of_boxes_find_what_all_pairs_show() -> None:
    rng = np.random.default_rng(5)
    crossed = 0
    for number in range(300):
        n = int(rng.integers(3, 120))
        waves = sum(rng.normal() / k * np.sin(k * np.linspace(0.0, 3.1, n) + rng.normal()) for k in range(1, 5))
        edges = np.exp(rng.normal(0.0, 1.5 * (number % 2), n))
        angles = float(rng.choice([1.0, 3.0, 6.0])) * waves
        table = np.zeros((n + 1, 6))
        table[1:, 0] = np.cumsum(edges * np.cos(angles))
        table[1:, 1] = np.cumsum(edges * np.sin(angles))
        points = table[:, :2]
        along = np.concatenate([[0.0], np.cumsum(edges)])
        apart = along[None, :] - along[:, None] >= 0.2 * along[-1] * (1.0 - 1e-9)
        gaps = np.hypot(*(points[None, :] - points[:, None]).transpose(2, 0, 1))
        assert clearance(table) == pytest.approx(float(np.min(gaps[apart])), rel=1e-12)
        crosses = bool(np.any(all_crossings(points)))
        assert crosses_itself(table) is crosses
        crossed += crosses
    assert 50 <= crossed <= 250


def all_crossings(points: np.ndarray) -> np.ndarray:
    """Which pairs of edges, neighbours apart, cross each other inside: (n, n)."""
    begin, step = points[:-1], np.diff(points, axis=0)

    def side(of: np.ndarray) -> np.ndarray:
        away = of[None, :] - begin[:, None]
        return step[:, None, 0] * away[:, :, 1] - step[:, None, 1] * away[:, :, 0]

    parted = side(points[:-1]) * side(points[1:]) < 0.0
    n = begin.shape[0]
    return parted & parted.T & (np.arange(n)[None, :] >= np.arange(n)[:, None] + 2)
