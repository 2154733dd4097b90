"""scipy.integrate.solve_bvp: the rod's differential equation by collocation, to a tolerance on its residual.

Unknown are position, angle, curvature and the force at the start. Everything is scaled by the free length and EI, and
the force at the start is guessed from the curvature of the spline; without both it needs more iterations.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from curveline.bench.methods.cases import Case
from curveline.bench.methods.own import POINTS, REPEATS, Method, Solved
from curveline.bench.methods.stopwatch import timed
from curveline.bench.methods.straddling import closed
from curveline.rod.problem import Array
from curveline.rod.states.equilibrium import EXTENSIBLE, PLANAR

TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8)
NODES = 12
MOST_NODES = 20_000


def solve(case: Case, model: str, tolerance: float, repeats: float = REPEATS) -> Solved | None:
    """The case by collocation, repeated for some seconds.

    None with dead loads, which its one smooth piece can't hold, or without convergence.
    """
    from scipy.integrate import solve_bvp

    if case.rod.loads:
        return None
    scaled = (case.rod if model == PLANAR else case.stretchy).scaled()
    chord, ends, weight, compliance = scaled.chord, scaled.ends, scaled.weight, scaled.compliance

    def slopes(s: Array, y: Array) -> Array:
        cosine, sine, across = np.cos(y[2]), np.sin(y[2]), y[5] + weight * s
        speed = 1.0 + compliance * (y[4] * cosine + across * sine)
        bend = y[4] * sine - across * cosine
        return np.vstack([speed * cosine, speed * sine, y[3], speed * bend, 0.0 * s, 0.0 * s])

    def clamps(a: Array, b: Array) -> Array:
        return np.array([a[0], a[1], a[2] - ends[0], b[0] - chord[0], b[1] - chord[1], b[2] - ends[1]])

    places = np.linspace(0.0, 1.0, NODES)
    start = _guess(case, places, weight)

    def run() -> Any:
        return solve_bvp(slopes, clamps, places, start, tol=tolerance, max_nodes=MOST_NODES)

    answer = run()
    if not answer.success:
        return None
    at = np.linspace(0.0, 1.0, POINTS)
    length = case.rod.free_length
    positions = np.array(case.rod.free_start) + length * answer.sol(at)[:2].T
    took = timed(run, repeats)
    return Solved(answer.x.size, took.best, 0.5 * case.rod.clamp + length * at, positions, took.spread)


def _guess(case: Case, places: Array, weight: float) -> Array:
    """The closed spline at `places (m,)`, (6, m), and the constant force that fits its change of curvature best."""
    scaled = case.rod.scaled()
    count = 48
    edges = np.full(count + 2, 1.0 / count)
    edges[[0, -1]] = 0.0
    angles = closed(np.array([scaled.ends[0], *case.guess(count), scaled.ends[1]]), edges, scaled.chord)
    middles = np.cumsum(edges) - 0.5 * edges
    theta = np.interp(places, middles, angles)
    curvature = np.gradient(theta, places)
    matrix = np.column_stack([np.sin(theta), -np.cos(theta)])
    force = np.linalg.lstsq(matrix, np.gradient(curvature, places) + weight * places * np.cos(theta), rcond=None)[0]
    corners = np.concatenate(
        [[[0.0, 0.0]], np.cumsum(edges[:, None] * np.column_stack([np.cos(angles), np.sin(angles)]), 0)]
    )
    along = np.concatenate([[0.0], np.cumsum(edges)])
    x, y = (np.interp(places, along, corners[:, axis]) for axis in (0, 1))
    return np.vstack([x, y, theta, curvature, np.full(places.size, force[0]), np.full(places.size, force[1])])


METHODS = (
    Method("solve_bvp", PLANAR, TOLERANCES, "tol", lambda case, goal: solve(case, PLANAR, goal)),
    Method("solve_bvp", EXTENSIBLE, TOLERANCES, "tol", lambda case, goal: solve(case, EXTENSIBLE, goal)),
)
