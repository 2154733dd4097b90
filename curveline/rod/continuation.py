"""Follow a stable equilibrium while the nodes move: where it stays, how near it comes to losing stability."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.rod._jit import njit
from curveline.rod.equilibrium import Equilibrium
from curveline.rod.ladder import vertex_table
from curveline.rod.modes import lowest_eigenvalue
from curveline.rod.planar import Effort, descend, newton
from curveline.rod.problem import Array, Pose, largest_change, make_problem, released, scale_rod, sharpest_turn
from curveline.rod.states import SEARCH_EDGES

FOLLOW_EDGES = 2 * SEARCH_EDGES[0]
LARGEST_STEP = 1.0 / 24.0
SMALLEST_STEP = 1e-7
LARGEST_MOVE = 0.25
"""An edge that turns by more than this [rad] in one step belongs to another branch."""

NUDGE = 0.01

TRACK = Effort(turn=0.2, close=1e-7, iterations=12)
LAND = Effort(turn=0.3, close=1e-7, iterations=400)


class Branch(NamedTuple):
    """A followed state, the fraction of the path it `reached`, and its angles and multipliers there.

    `samples (m, 6)` hold per pose: fraction of the path, lowest eigenvalue, largest curvature away from the natural one
    [1/m], then the largest axial force, vertical force [N] and moment about its pivot [N m] that a node holds.
    """

    samples: Array
    reached: float
    phi: Array
    multipliers: Array


@njit
def between(begin, end, fraction):
    """The pose on the straight path between two poses."""
    return Pose(
        begin.x + fraction * (end.x - begin.x),
        begin.y + fraction * (end.y - begin.y),
        begin.start + fraction * (end.start - begin.start),
        begin.end + fraction * (end.end - begin.end),
        begin.length + fraction * (end.length - begin.length),
    )


@njit
def node_loads(pose, bearing, free, phi, multipliers):
    """Largest curvature away from the natural one [1/m], then what a node must hold: see `Branch`."""
    length = pose.length - bearing.clamp
    table = vertex_table(free, phi, multipliers)
    force = bearing.stiffness / length**2
    end_x, end_y = -multipliers[0] * force, -multipliers[1] * force
    start_x, start_y = -end_x, bearing.weight * length - end_y
    axial = max(
        abs(start_x * np.cos(pose.start) + start_y * np.sin(pose.start)),
        abs(end_x * np.cos(pose.end) + end_y * np.sin(pose.end)),
    )
    half = 0.5 * bearing.clamp
    across_start = start_y * np.cos(pose.start) - start_x * np.sin(pose.start)
    across_end = end_y * np.cos(pose.end) - end_x * np.sin(pose.end)
    bend_start = bearing.stiffness * (table[0, 3] / length - bearing.natural)
    bend_end = bearing.stiffness * (table[phi.size, 3] / length - bearing.natural)
    moment = max(abs(half * across_start - bend_start), abs(bend_end - half * across_end))
    sharpest = 0.0
    for i in range(phi.size + 1):
        sharpest = max(sharpest, abs(table[i, 3] / length - bearing.natural))
    return sharpest, axial, max(abs(start_y), abs(end_y)), moment


@njit
def follow(begin, end, bearing, phi, multipliers):
    """Follow the stable state `phi (n,)`, `multipliers (2,)` from pose `begin` straight to pose `end`.

    Natural continuation: the fraction of the path grows by steps that are halved where Newton fails, jumps or finds an
    unstable equilibrium, down to `SMALLEST_STEP`, which is then the accuracy to which a fold or bifurcation is located.
    """
    n = phi.size
    loads = np.zeros((0, 3))
    edges = np.full(n, 1.0 / n)
    samples = np.empty((4000, 6))
    count = 0
    reached = 0.0
    step = 0.0
    while count < samples.shape[0]:
        fraction = min(1.0, reached + step)
        pose = between(begin, end, fraction)
        free = released(make_problem(scale_rod(pose, bearing, loads), edges))
        trial = phi.copy()
        force = multipliers.copy()
        iterations, unstable = newton(free, trial, force, TRACK)
        if iterations > 0 and unstable == 0 and largest_change(trial, phi) < LARGEST_MOVE:
            phi = trial
            multipliers = force
            reached = fraction
            samples[count, 0] = fraction
            samples[count, 1] = lowest_eigenvalue(free, phi, multipliers, 1e-4)
            samples[count, 2:] = node_loads(pose, bearing, free, phi, multipliers)
            count += 1
            if begin == end:
                reached = 1.0
            if reached == 1.0:
                break
            step = LARGEST_STEP if count == 1 else min(LARGEST_STEP, 1.5 * step)
        else:
            step *= 0.5
            if step < SMALLEST_STEP:
                break
    return Branch(samples[:count], reached, phi, multipliers)


@njit
def land(pose, bearing, phi, multipliers):
    """Where the rod falls from a state `phi (n,)` that is gone at `pose`: downhill, nudged off any symmetry.

    Energy descent stands in for damped dynamics here. Returns True and the state there, or False if none was reached.
    """
    n = phi.size
    free = released(make_problem(scale_rod(pose, bearing, np.zeros((0, 3))), np.full(n, 1.0 / n)))
    angles = phi.copy()
    force = multipliers.copy()
    for j in range(n):
        angles[j] += NUDGE * np.sin(2.0 * np.pi * (j + 0.5) / n)
    iterations = descend(free, angles, force, LAND)
    return iterations > 0 and sharpest_turn(free, angles) < 1.0, angles, force


def coarse_start(state: Equilibrium, n: int = FOLLOW_EDGES) -> tuple[Array, Array]:
    """Angles (n,) and multipliers (2,) from which Newton finds `state` again on n equal edges."""
    return state.start_on(np.full(n, 1.0 / n))
