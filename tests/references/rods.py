"""Discrete rods on any supports, in units of length and EI: solved on one level, extrapolated, followed to a fold."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from clamped_rods import rod_between
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.modes import modes_below, second_variation
from curveline.rod.planar.newton import Effort, descend, energy, newton
from curveline.rod.problem import Array, Problem, make_problem

FALL = Effort(turn=0.5, close=1e-9, iterations=400)
POLISH = Effort(turn=0.3, close=1e-10, iterations=60)

Loads = tuple[tuple[float, float, float], ...]


class Shape(NamedTuple):
    """An equilibrium of a discrete rod, as it is on its level."""

    problem: Problem
    phi: Array
    multipliers: Array
    unstable: int

    @property
    def positions(self) -> Array:
        """Positions (n+1, 2) of the vertices; the rod begins at the origin."""
        edges = self.problem.edges[:, None] * np.column_stack([np.cos(self.phi), np.sin(self.phi)])
        return np.concatenate([np.zeros((1, 2)), np.cumsum(edges, axis=0)])

    @property
    def curvature(self) -> Array:
        """Curvature (n-1,) at the inner vertices."""
        return np.diff(self.phi) * self.problem.stiffness[1:-1]

    @property
    def moments(self) -> Array:
        """Bending moments (2,) at the clamps: slopes of the energy by the clamp angles, the first reversed."""
        problem = self.problem
        turns = np.array([self.phi[0] - problem.ends[0], problem.ends[1] - self.phi[-1]])
        return turns * problem.stiffness[[0, -1]]

    @property
    def energy(self) -> float:
        """Bending energy plus the potential of the loads."""
        return float(energy(self.problem, self.phi, self.multipliers))


def unit_rod(
    chord: tuple[float, float], ends: tuple[float, float], *, weight: float = 0.0, loads: Loads = ()
) -> ClampedRod:
    """A rod of length and EI 1 between point clamps."""
    return rod_between(chord, ends[0], ends[1], 1.0, 0.0, 1.0, weight, loads=loads)


def clamped(rod: ClampedRod, n: int, *, at: float = 0.5) -> Problem:
    """`rod` cut into n edges, half of them on either side of the fraction `at` of its length, both ends clamped."""
    edges = np.repeat([2.0 * at / n, 2.0 * (1.0 - at) / n], n // 2)
    problem: Problem = make_problem(rod.scaled(), edges)
    return problem


def pinned(problem: Problem, *ends: int) -> Problem:
    """The same rod with its first (0) or last (-1) end, or both, free to turn."""
    stiffness = problem.stiffness.copy()
    stiffness[list(ends)] = 0.0
    return problem._replace(stiffness=stiffness)


def held(problem: Problem, *axes: int) -> Problem:
    """The same rod whose last end is held along x (0) or y (1) alone, or not at all."""
    return problem._replace(held=np.array([float(axis in axes) for axis in (0, 1)]))


def cantilever(start: float, n: int, *, weight: float = 0.0, loads: Loads = ()) -> Problem:
    """A rod that leaves its one clamp at the angle `start`; the other end is free."""
    return held(pinned(clamped(unit_rod((1.0, 0.0), (start, 0.0), weight=weight, loads=loads), n), -1))


def relax(problem: Problem, phi: Array) -> Shape:
    """The stable equilibrium downhill from `phi (n,)`."""
    phi, multipliers = phi.copy(), np.zeros(problem.targets.size)
    assert descend(problem, phi, multipliers, FALL) > 0
    return solve(problem, phi, multipliers)


def solve(problem: Problem, phi: Array, multipliers: Array) -> Shape:
    """The equilibrium, stable or not, that Newton reaches from `phi (n,)`, `multipliers (k,)`."""
    shape = try_solve(problem, phi, multipliers)
    assert shape is not None
    return shape


def try_solve(problem: Problem, phi: Array, multipliers: Array) -> Shape | None:
    """As `solve`, or None where Newton reaches nothing."""
    phi, multipliers = phi.copy(), multipliers.copy()
    iterations, unstable = newton(problem, phi, multipliers, POLISH)
    return Shape(problem, phi, multipliers, unstable) if iterations > 0 else None


def is_definite(problem: Problem, phi: Array, multipliers: Array) -> bool:
    """True if the second variation under the constraints has no negative eigenvalue."""
    return bool(modes_below(problem, second_variation(problem, phi, multipliers), 0.0) == 0)


def bisect(holds: Callable[[float], bool], low: float, high: float) -> float:
    """Where `holds`, true at `low` and false at `high`, changes."""
    assert holds(low)
    assert not holds(high)
    while abs(high - low) > 1e-13 * max(abs(high), abs(low)):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return 0.5 * (low + high)


def middle_held(problem: Problem, axis: int, target: float) -> Problem:
    """The same rod with its middle vertex held at x (0) or y (1) = `target`; the last multiplier holds it."""
    half = problem.edges.size // 2
    row = np.zeros((2, problem.edges.size))
    row[axis, :half] = problem.edges[:half]
    return problem._replace(height=row, targets=np.append(problem.targets, target))


def symmetric(problem: Problem, axis: int, near: Shape) -> Shape | None:
    """The symmetric equilibrium close to `near`, stable or not; None where there is none.

    By symmetry it takes no force to hold the middle vertex halfway along x (0) or y (1), but doing so keeps Newton
    regular, and on the symmetric path, where that loses its stability to another one.
    """
    level = middle_held(problem, axis, 0.5 * float(problem.targets[axis]))
    shape = try_solve(level, near.phi, np.append(near.multipliers, 0.0))
    if shape is None:
        return None
    assert abs(shape.multipliers[-1]) < 1e-6 * np.max(abs(shape.multipliers))
    phi, multipliers = shape.phi, shape.multipliers[:-1]
    unstable = int(modes_below(problem, second_variation(problem, phi, multipliers), 0.0))
    return Shape(problem, phi, multipliers, unstable)


def branches_at(problem_at: Callable[[float], Problem], axis: int, state: Shape, bracket: tuple[float, float]) -> float:
    """Where within the `bracket` the symmetric path from the stable `state` at 0 loses its stability."""
    low, high = bracket
    for at in np.linspace(0.0, low, 12):
        shape = symmetric(problem_at(float(at)), axis, state)
        assert shape is not None
        state = shape

    def stable(at: float) -> bool:
        trial = symmetric(problem_at(at), axis, state)
        return trial is not None and trial.unstable == 0

    return bisect(stable, low, high)


def last_stable(problem_at: Callable[[float], Problem], state: Shape, begin: float, step: float) -> float:
    """Where the stable `state` ends while its problem changes from `begin` on by steps of `step`, then by shorter ones.

    Each step starts from the last state; one that fails, is unstable or lands on another branch is halved.
    """
    at, smallest = begin, 1e-13 * abs(step)
    while abs(step) > max(smallest, 1e-13 * abs(at)):
        trial = try_solve(problem_at(at + step), state.phi, state.multipliers)
        near = trial is not None and np.max(abs(trial.phi - state.phi)) < 0.2 * np.max(abs(state.phi))
        if trial is not None and trial.unstable == 0 and near:
            at, state = at + step, trial
        else:
            step *= 0.5
    return at


def middles(n: int) -> Array:
    """Arc length (n,) of the middle of each of n equal edges."""
    return (np.arange(n) + 0.5) / n


def tip_angle(shape: Shape) -> float:
    """Tangent angle at an end without moment, where the curvature vanishes, from the last two edges."""
    return float(shape.phi[-1] - (shape.phi[-2] - shape.phi[-1]) / 8.0)


def romberg(levels: Sequence[object]) -> Array:
    """The limit of values whose error is even in the edge length, from levels that are each twice as fine."""
    values = [np.asarray(level, dtype=float) for level in levels]
    factor = 4.0
    while len(values) > 1:
        values = [fine + (fine - coarse) / (factor - 1.0) for coarse, fine in itertools.pairwise(values)]
        factor *= 4.0
    return values[0]


def orders(counts: Sequence[int], levels: Sequence[object], exact: object) -> tuple[Array, Array]:
    """Fitted orders of convergence (k,) of `levels` of k numbers on rods of `counts` edges, plain and extrapolated."""
    better = [romberg(pair) for pair in itertools.pairwise(levels)]
    return _slopes(counts, levels, exact), _slopes(counts, better, exact)


def _slopes(counts: Sequence[int], levels: Sequence[object], exact: object) -> Array:
    errors = abs(np.array([np.ravel(np.asarray(level, dtype=float) - exact) for level in levels]))
    assert errors.min() > 0.0
    slopes: Array = -np.polyfit(np.log(counts[: len(errors)]), np.log(errors), 1)[0]
    return slopes
