"""States of a rod in the plane by scipy's collocation, which knows nothing of edges."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_bvp

from curveline.rod.problem import Array
from curveline.rod.states.equilibrium import Equilibrium

SMOOTH = 1e-6
"""Moment [N m] over which the collocation spreads the play."""


def none(places: Array) -> Array:
    """No natural curvature beside the uniform one."""
    return np.zeros_like(places)


def collocated(state: Equilibrium, bent: Callable[[Array], Array] = none) -> tuple[Array, Array]:
    """Positions at 101 equal steps of the free rod, and moments on the rod at its mouths, by scipy's collocation.

    The unknowns are x, y, the angle, the bending moment and both parts of the force in the rod, in SI. `bent` is the
    natural curvature [1/m] beside the uniform one at places [m] along the free rod.
    """
    rod = state.rod
    bearing, length, half = rod.bearing, rod.free_length, 0.5 * rod.clamp

    def slopes(at: Array, u: Array) -> Array:
        _, _, angle, moment, across, up = u
        cosine, sine = np.cos(angle), np.sin(angle)
        bend = moment / bearing.stiffness + bearing.natural + bent(at)
        return np.array([cosine, sine, bend, across * sine - up * cosine, 0.0 * up, 0.0 * up + bearing.weight])

    def tilted(moment: float) -> float:
        """Angle of a bearing from where its motor holds it, under a moment about its pivot."""
        if bearing.play == 0.0:
            return moment * bearing.give / bearing.stiffness
        return moment * bearing.give / bearing.stiffness + bearing.play * math.tanh(moment / SMOOTH)

    def ends(a: Array, b: Array) -> Array:
        out = []
        for u, pivot, angle, side in ((a, (0.0, 0.0), rod.start, 1.0), (b, rod.chord, rod.end, -1.0)):
            cosine, sine = math.cos(u[2]), math.sin(u[2])
            about = side * u[3] + half * (cosine * u[5] - sine * u[4])
            out += [u[0] - pivot[0] - side * half * cosine, u[1] - pivot[1] - side * half * sine]
            out += [u[2] - angle - tilted(about)]
        return np.array(out)

    places = np.linspace(0.0, length, 101)
    at = np.concatenate([[0.0], np.cumsum(state.edges)])
    table = state.vertices_table
    guess = [np.interp(places, at, table[:, i]) for i in range(4)]
    guess[3] = (guess[3] - bearing.natural - bent(places)) * bearing.stiffness
    push, lift = -state.clamp_force[0]
    guess += [np.full(places.size, push), lift + bearing.weight * places]
    found = solve_bvp(slopes, ends, places, np.array(guess), tol=1e-9, max_nodes=50_000)
    assert found.success, found.message
    curve = found.sol(places)
    return curve[:2].T, np.array([-curve[3, 0], curve[3, -1]])
