"""One state of one rod in the plane: against bare Newton, against collocation, and how its time grows with edges."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from curveline.bench.measurement import Measurement
from curveline.bench.methods.cases import Case, clamps, truth
from curveline.bench.methods.collocation import solve as collocate
from curveline.bench.methods.own import Solved, one_level
from curveline.bench.methods.stopwatch import Timed, timed
from curveline.bench.trade import distance, fitted_exponent
from curveline.bench.yardsticks import COLLOCATION, MOST_EDGES, Yardsticks, timed_row, yardsticks
from curveline.rod.planar.elastica import clamped_arch
from curveline.rod.planar.newton import descend
from curveline.rod.planar.search import RELAX
from curveline.rod.problem import Array
from curveline.rod.spatial import relax
from curveline.rod.spatial.lifting import lift
from curveline.rod.states.equilibrium import PLANAR, refine
from curveline.rod.states.refined import refined
from curveline.simulation.simulate import scene_rod
from curveline.units import mm, to_mm

PLANAR_SIZES = (100, 316, 1_000, 3_162, 10_000, 31_623, 100_000)
SPATIAL_SIZES = (100, 316, 1_000, 3_162, 10_000)
EXPONENT_NOISE = 0.1
"""By what part a fitted exponent differs from run to run, as noted over many of them."""
LONG_S = 0.3
"""How long yardsticks are timed where they are figures themselves [s]."""
BUMP = 0.02
"""Largest angle [rad] by which a neighbour differs from a state."""


class _Solves:
    """What is timed: a state from its spline guess, and from a neighbour, refined to a tolerance."""

    def __init__(self, sticks: Yardsticks) -> None:
        self.rod = sticks.case.rod
        self._placement = sticks.placement
        self._sticks = sticks
        settled, self.forces = sticks.guess.copy(), np.zeros(2)
        descend(sticks.problem, settled, self.forces, RELAX)
        self.near: Array = settled + BUMP * np.sin(2.0 * math.pi * np.cumsum(sticks.edges))

    def from_guess(self, tolerance: float) -> Any:
        """From the spline guess, to a tolerance [m]."""
        angles, forces = self._sticks.guess.copy(), np.zeros(2)
        descend(self._sticks.problem, angles, forces, RELAX)
        return self._climbed(angles, forces, tolerance)

    def warm(self, tolerance: float) -> Any:
        """From a neighbour, to a tolerance [m]."""
        return self._climbed(self.near.copy(), self.forces.copy(), tolerance)

    def _climbed(self, angles: Array, forces: Array, tolerance: float) -> Any:
        coarse = (self._sticks.edges, angles, forces)
        return refined(self._sticks.scaled, coarse, self._placement, tolerance, MOST_EDGES)


def rows() -> Iterator[Measurement]:
    """One planar state from its spline guess and from a neighbour, against bare Newton and against collocation."""
    sticks = yardsticks()
    solves = _Solves(sticks)
    for tolerance, goal in ((mm(0.1), "< 30"), (mm(0.001), "< 200")):
        for name, solve, how in (
            ("relax", solves.from_guess, "from a spline guess"),
            ("warm start", solves.warm, "from a neighbour"),
        ):
            took = timed(partial(solve, tolerance))
            yield sticks.beside(timed_row(f"{name} to {to_mm(tolerance):g} mm", took, "us", goal, how), took.best)
    exact = clamped_arch(solves.rod.chord[0], solves.rod.length, solves.rod.stiffness)
    places = np.linspace(0.0, solves.rod.length, 201)
    state = refine(solves.rod, sticks.edges, solves.near.copy(), solves.forces.copy(), mm(0.1))
    error = float(np.hypot(*(state.curve(201) - exact.positions(places)).T).max())
    yield Measurement("true error at 0.1 mm", to_mm(error), "mm", "< 0.003", "against the closed form", 0.0)
    yield from _bare_newton(sticks, partial(solves.from_guess, mm(0.1)))
    yield from _collocation(sticks.case, partial(solves.warm, mm(0.1)))
    yield _two_known_states()


def _bare_newton(sticks: Yardsticks, relax_it: Callable[[], object]) -> Iterator[Measurement]:
    """A certified state at 0.1 mm against Newton alone from the same guess through the same levels."""
    bare, relaxed = sticks.bare_newton(LONG_S), timed(relax_it)
    how = f"{sticks.finest} edges, error unknown"
    yield timed_row("bare Newton, same levels", bare, "us", "", how)
    yield over("relax to 0.1 mm over bare", relaxed, bare, "< 3", "same system, same run")


def _collocation(case: Case, warm: Callable[[], object]) -> Iterator[Measurement]:
    """scipy.integrate.solve_bvp on the same scene from the same guess."""
    answer = collocate(case, PLANAR, COLLOCATION, LONG_S)
    if answer is None:
        return
    took = Timed(answer.seconds, answer.spread)
    yield timed_row("solve_bvp, tol 1e-3", took, "ms", "", "scipy, same scene")
    yield error_row("its true error", true_error(case, PLANAR, answer))
    yield over("solve_bvp over warm start", took, timed(warm), "> 35", "same run")


def _two_known_states() -> Measurement:
    """Two states that are known, each refined and certified as users get it, against solve_bvp for the same two."""
    name, goal = "solve_bvp over two known states", "> 30"
    states = [Yardsticks(case) for case in clamps().cases]
    taken = [each for each in (stick.solve_bvp(LONG_S) for stick in states) if each is not None]
    if len(taken) < len(states):
        return Measurement(name, None, "x", goal, "solve_bvp did not converge")
    known = [(each, _Solves(each)) for each in states]

    def refined() -> None:
        for sticks, solves in known:
            refine(solves.rod, sticks.edges, solves.near.copy(), solves.forces.copy(), mm(0.1))

    both = Timed(math.fsum(each.best for each in taken), max(each.spread or 0.0 for each in taken))
    return over(name, both, timed(refined), goal, "both from neighbours")


def over(name: str, one: Timed, other: Timed, goal: str, how: str) -> Measurement:
    """A figure that is a ratio of two times of the same run."""
    noise = [each.spread for each in (one, other) if each.spread is not None]
    return Measurement(name, one.best / other.best, "x", goal, how, math.fsum(noise) if noise else None)


def true_error(case: Case, model: str, answer: Solved) -> float | None:
    """True error of an answer [m]; None if shooting finds no exact curve."""
    curve = truth(case, model)
    return distance(answer, curve.positions(answer.places)) if curve else None


def error_row(name: str, error: float | None) -> Measurement:
    """A figure that is a true error."""
    if error is None:
        return Measurement(name, None, "mm", "", "shooting found no curve")
    return Measurement(name, to_mm(error), "mm", "", "against shooting", 0.0)


def linear_cost() -> Iterator[Measurement]:
    """How the time of a solve grows with the number of edges, as a fitted exponent."""
    case = clamps().cases[0]
    solved = [one_level(case, PLANAR, n) for n in PLANAR_SIZES]
    yield _growth("planar", PLANAR_SIZES, [answer.seconds for answer in solved if answer])
    segment = scene_rod(case.scene, 0)
    spent = []
    for n in SPATIAL_SIZES:
        rod, shape = lift(segment, case.state, n)
        spent.append(timed(partial(relax.descend, rod, shape), 0.1).best)
    yield _growth("spatial", SPATIAL_SIZES, spent)


def _growth(model: str, sizes: Sequence[int], seconds: Sequence[float]) -> Measurement:
    name, how = f"{model} time, power of edges", f"{sizes[0]} to {sizes[-1]} edges"
    if len(seconds) < len(sizes):
        return Measurement(name, None, "", "< 1.1", "not all of them were solved")
    return Measurement(name, fitted_exponent(sizes, seconds), "", "< 1.1", how, EXPONENT_NOISE)
