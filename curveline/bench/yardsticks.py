"""What every solution of a rod is held against in the same run: Newton's method alone, and scipy's solve_bvp.

Both are timed again beside each figure, since a processor is not equally fast throughout a run.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache, cached_property, partial
from typing import Any

import numpy as np

from curveline.bench.measurement import Measurement
from curveline.bench.methods.cases import Case, clamps
from curveline.bench.methods.collocation import solve as collocate
from curveline.bench.methods.stopwatch import Timed, timed
from curveline.rod.planar.newton import descend
from curveline.rod.planar.search import RELAX
from curveline.rod.problem import Array, Problem, ScaledRod, make_problem, mesh
from curveline.rod.states.equilibrium import PLANAR
from curveline.rod.states.planar_states import SEARCH_EDGES
from curveline.rod.states.refined import FINEST, placement_of, refined
from curveline.units import mm

COLLOCATION = 1e-3
"""The tolerance of solve_bvp: with it about as accurate as the rod on its coarsest level."""
MOST_EDGES = 10_000
BESIDE_S = 0.1
"""How long a yardstick is timed beside a figure [s]."""


def planar_start(case: Case) -> tuple[ScaledRod, Array, Array, Problem]:
    """Rod, edges, spline guess and equations with which the refinement of a planar state begins."""
    scaled = case.rod.scaled()
    edges = mesh(scaled.at, SEARCH_EDGES[0])
    return scaled, edges, case.guess(edges.size), make_problem(scaled, edges)


PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6}


class Yardsticks:
    """Both on one scene, from the same spline guess."""

    def __init__(self, case: Case) -> None:
        """Those of a planar scene."""
        from curveline.bench.methods import bare_newton  # its kernels are compiled when it is imported

        self.case = case
        self.scaled, self.edges, self.guess, self.problem = planar_start(case)
        given = (self.guess, self.scaled.chord, self.scaled.ends, self.scaled.weight, self.finest)
        self._bare = partial(bare_newton.solve, *given)

    @cached_property
    def finest(self) -> int:
        """Edges of the finest level that a state at 0.1 mm takes."""
        angles, forces = self.guess.copy(), np.zeros(2)
        descend(self.problem, angles, forces, RELAX)
        found = refined(self.scaled, (self.edges, angles, forces), self.placement, mm(0.1), MOST_EDGES)
        return int(found[2][FINEST])

    @property
    def placement(self) -> Any:
        """Where the scene's rod is in SI, for `refined`."""
        rod = self.case.rod
        return placement_of(rod.pose, rod.bearing, rod.dead_loads()[1], rod.winding)

    def bare_newton(self, seconds: float = BESIDE_S) -> Timed:
        """Newton's method alone, through the levels of a state at 0.1 mm."""
        return timed(self._bare, seconds)

    def solve_bvp(self, seconds: float = BESIDE_S) -> Timed | None:
        """scipy.integrate.solve_bvp; None if it does not converge."""
        answer = collocate(self.case, PLANAR, COLLOCATION, seconds)
        return None if answer is None else Timed(answer.seconds, answer.spread)

    def beside(self, row: Measurement, seconds_a_rod: float | None) -> Measurement:
        """A figure with the time of a rod in it [s] over the yardsticks, which are timed now."""
        if seconds_a_rod is None:
            return row
        collocation = self.solve_bvp()
        return replace(
            row,
            over_bare_newton=seconds_a_rod / self.bare_newton().best,
            over_solve_bvp=seconds_a_rod / collocation.best if collocation else None,
        )


@cache
def yardsticks() -> Yardsticks:
    """Those of this run, on the level scene of the set "clamps"."""
    return Yardsticks(clamps().cases[0])


def timed_row(name: str, took: Timed, unit: str, goal: str, how: str) -> Measurement:
    """A figure that is a time, in its unit, with its noise."""
    return Measurement(name, took.best * PER_SECOND[unit], unit, goal, how, took.spread)
