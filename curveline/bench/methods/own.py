"""What is measured: a method solves a case for one setting of its accuracy; curveline's own ones are here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from curveline.bench.methods.cases import Case
from curveline.bench.methods.stopwatch import best, timed
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.approach import fitting_mesh
from curveline.rod.planar.newton import descend, newton
from curveline.rod.planar.richardson import POLISH, vertex_table
from curveline.rod.planar.search import RELAX
from curveline.rod.problem import Array, make_problem, mesh
from curveline.rod.spatial import relax
from curveline.rod.spatial.energy import Shape
from curveline.rod.spatial.energy import positions as spatial_positions
from curveline.rod.spatial.lifting import spatial_rod
from curveline.rod.spatial.richardson import refine_in_space
from curveline.rod.states.equilibrium import EXTENSIBLE, PLANAR, SPATIAL, Equilibrium, refine
from curveline.rod.states.planar_states import SEARCH_EDGES
from curveline.simulation.simulate import scene_rod, simulate
from curveline.units import mm

SETTLE = RELAX._replace(close=1e-7)
"""To equilibrium up to rounding, which a search does not wait for."""
REPEATS = 0.02
"""Seconds that a case is repeated for."""
POINTS = 201
LEVELS = (12, 25, 50, 100, 200, 400, 800)
TOLERANCES = (1.0, 0.1, 0.01, 0.001, 0.0001)


class Solved(NamedTuple):
    """An answer: `positions (k, 2 or 3)` [m] at the arc lengths `places (k,)` [m] from the left pivot.

    `vertices` are those of the finest rod or mesh behind it; `seconds` is the time from the guess to the answer.
    """

    vertices: int
    seconds: float
    places: Array
    positions: Array
    spread: float | None = None  # noise of the time, see `Timed`


@dataclass(frozen=True)
class Method:
    """A way to solve cases of one model; `settings` run from coarse to fine, in `unit`.

    `solve` returns None if it comes to no answer. `package` is what must be installed, empty if nothing. A method for
    `few` scenes is too slow for all of them. `truth` is the model whose exact curve the answers are held against.
    """

    name: str
    model: str
    settings: tuple[float, ...]
    unit: str
    solve: Callable[[Case, float], Solved | None]
    package: str = ""
    few: bool = False
    truth: str = ""


def _rod(case: Case, model: str) -> ClampedRod:
    return case.rod if model == PLANAR else case.stretchy


def one_level(case: Case, model: str, n: int) -> Solved | None:
    """The discrete rod of n edges as it is, relaxed from the spline guess."""
    rod = _rod(case, model)

    def relax() -> tuple[Array, Array] | None:
        found = _relaxed(case, rod, n)
        if found is None:
            return None
        edges, angles, forces = found
        return edges, vertex_table(make_problem(rod.scaled(), edges), angles, forces)

    answer = relax()
    if answer is None:
        return None
    edges, table = answer
    places = 0.5 * rod.clamp + rod.free_length * np.append(0.0, np.cumsum(edges))
    positions = rod.free_length * table[:, :2] + np.array(rod.free_start)
    return Solved(edges.size + 1, best(relax, REPEATS), places, positions)


def _relaxed(case: Case, rod: ClampedRod, n: int) -> tuple[Array, Array, Array] | None:
    """Edges, angles and forces of the discrete equilibrium below the guess; stretch is added once it has settled."""
    scaled = rod.scaled()
    edges = mesh(scaled.at, n)
    angles, forces = case.guess(edges.size), np.zeros(2)
    settled = descend(make_problem(scaled._replace(compliance=0.0), edges), angles, forces, SETTLE) > 0
    if settled and scaled.compliance > 0.0:
        settled = newton(make_problem(scaled, edges), angles, forces, POLISH)[0] > 0
    return (edges, angles, forces) if settled else None


def one_state(case: Case, model: str, tolerance_mm: float) -> Solved | None:
    """One state from the spline guess, refined until its own estimate of its error is below the tolerance."""
    rod = _rod(case, model)

    def solve() -> Equilibrium | None:
        found = _relaxed(case, rod, SEARCH_EDGES[0])
        return None if found is None else refine(rod, *found, mm(tolerance_mm))

    state = solve()
    return None if state is None else _delivered(state, best(solve, REPEATS))


def all_states(case: Case, model: str, tolerance_mm: float) -> Solved | None:
    """`curveline simulate`: the search for every stable state, certified, refined, with all bounds."""

    def solve() -> Equilibrium | None:
        return simulate(case.scene, mm(tolerance_mm), model=model)[0].wanted

    state = solve()
    return None if state is None else _delivered(state, best(solve, REPEATS))


def one_spatial_level(case: Case, n: int) -> Solved | None:
    """The rod in space of n edges as it is, relaxed from the spline guess."""
    segment = scene_rod(case.scene, 0)

    def solve() -> Array | None:
        rod = spatial_rod(segment, fitting_mesh(segment.scaled(), n))
        relaxed = relax.descend(rod, spatial_guess(case, rod.edges.size))
        return (
            np.asarray(spatial_positions(rod, relaxed.shape)) if relaxed.ending is relax.RelaxEnding.SETTLED else None
        )

    vertices = solve()
    if vertices is None:
        return None
    edges = fitting_mesh(segment.scaled(), n)
    places = 0.5 * case.rod.clamp + case.rod.free_length * np.append(0.0, np.cumsum(edges))
    positions = case.rod.free_length * vertices + np.array([*case.rod.free_start, 0.0])
    took = timed(solve, REPEATS)
    return Solved(edges.size + 1, took.best, places, positions, took.spread)


def spatial_guess(case: Case, n: int) -> Shape:
    """The spline guess on n edges as a rod in space, its second director towards the viewer."""
    half = 0.5 * case.guess(n)
    cosine, sine = np.cos(half), np.sin(half)
    return Shape(np.zeros(n), 0.5 * np.column_stack([cosine - sine, cosine - sine, cosine + sine, cosine + sine]))


def one_spatial_state(case: Case, tolerance_mm: float) -> Solved | None:
    """One state in space: a planar one from the spline guess, led into space, refined there to the tolerance."""
    segment = scene_rod(case.scene, 0)

    def solve() -> Equilibrium | None:
        found = _relaxed(case, case.rod, SEARCH_EDGES[0])
        if found is None:
            return None
        return refine_in_space(segment, refine(case.rod, *found, mm(1.0)), mm(tolerance_mm))

    state = solve()
    return None if state is None else _delivered(state, best(solve, REPEATS))


def _delivered(state: Equilibrium, seconds: float) -> Solved:
    """The curve as users get it."""
    curve = state.curve(POINTS) if state.space is None else state.space.positions(POINTS)
    return Solved(state.vertices, seconds, np.linspace(0.0, state.rod.length, POINTS), curve)


OWN = (
    Method("one level", PLANAR, LEVELS, "edges", lambda case, n: one_level(case, PLANAR, int(n))),
    Method("one state", PLANAR, TOLERANCES, "mm", lambda case, goal: one_state(case, PLANAR, goal)),
    Method("simulate", PLANAR, TOLERANCES, "mm", lambda case, goal: all_states(case, PLANAR, goal)),
    Method("one level", EXTENSIBLE, LEVELS, "edges", lambda case, n: one_level(case, EXTENSIBLE, int(n))),
    Method("one state", EXTENSIBLE, TOLERANCES, "mm", lambda case, goal: one_state(case, EXTENSIBLE, goal)),
    Method("simulate", EXTENSIBLE, TOLERANCES, "mm", lambda case, goal: all_states(case, EXTENSIBLE, goal)),
    Method("one level", SPATIAL, LEVELS, "edges", lambda case, n: one_spatial_level(case, int(n))),
    Method("one state", SPATIAL, TOLERANCES, "mm", one_spatial_state),
    Method("simulate", SPATIAL, TOLERANCES, "mm", lambda case, goal: all_states(case, SPATIAL, goal)),
)
"""curveline's own methods."""
