"""Where on a path a state ends, roughly and soon: to choose among many paths which of them to look at closely."""

from __future__ import annotations

import numpy as np

from curveline.kernels.forms import Vector
from curveline.kernels.kernel import shipped
from curveline.rod.branches.continuation import TRAVEL_MOVE, is_stable_outside, node_loads, travel, try_step
from curveline.rod.branches.control_path import ControlPath, between, counts_along, problem_at, straight_path
from curveline.rod.problem import Bearing, copy_into

ROUGH = 1e-3
"""Part of the path to which the end of a state is located."""
RECORDS = 200
"""Steps of a path that are remembered, more than one that is a turn of a rod takes."""


@shipped(ControlPath, Bearing, Vector, Vector, float)
def rough_end(path, bearing, phi, multipliers, share):
    """Follow the stable state `phi (n,)`, `multipliers (2,)` of a rod without loads as `travel` does, but to `ROUGH`.

    Returns the fraction reached and rows (2, 7), the largest curvature [1/m] and what the nodes do to the rod, see
    `node_loads`: at the begin, and at the end of the path or, if the state is lost, at `share` of the way to there.
    """
    counts = counts_along(path, bearing, phi.size)
    fractions, shapes, forces = np.empty(RECORDS), np.empty((RECORDS, phi.size)), np.empty((RECORDS, 2))
    rows = np.zeros((2, 7))
    reached, step, count, flows = 0.0, 1.0, 0, False
    begin = phi
    while reached < 1.0 and step >= ROUGH and count < RECORDS:
        fraction = min(1.0, reached + step)
        free = problem_at(path, bearing, fraction, counts)
        found, trial, force = try_step(free, phi, multipliers, TRAVEL_MOVE)
        if found and is_stable_outside(path, bearing, fraction, (free, trial, force)):
            fractions[count] = reached
            copy_into(shapes[count], phi)
            copy_into(forces[count], multipliers)
            count += 1
            phi, multipliers, reached = trial, force, fraction
            step *= 1.5 if flows else 1.0
            flows = True
        else:
            step *= 0.5
            flows = False
    last = reached
    if reached < 1.0 and count > 0:
        last = share * reached
        while count > 1 and fractions[count - 1] > last:
            count -= 1
        here = fractions[count - 1]
        way = straight_path(between(path.begin, path.end, here), between(path.begin, path.end, last))
        _, phi, multipliers, _ = travel(way, bearing, shapes[count - 1].copy(), forces[count - 1].copy())
    if count > 0:
        rows[0, 0], rows[0, 1:] = node_loads(
            path, 0.0, bearing, problem_at(path, bearing, 0.0, counts), begin, forces[0]
        )
        rows[1, 0], rows[1, 1:] = node_loads(
            path, last, bearing, problem_at(path, bearing, last, counts), phi, multipliers
        )
    return reached, rows
