"""Kernel for the states of many rods without difficulties with their curves, each ready to be drawn or written."""

from __future__ import annotations

import numpy as np

from curveline.kernels.forms import Matrix, Stack, Vector
from curveline.kernels.kernel import njit, shipped
from curveline.rod.geometry.vertex_table import ANGLE, X, Y
from curveline.rod.planar.richardson import interpolate
from curveline.rod.problem import Bearing, copy_into, pose_at_row
from curveline.rod.states.plain_states import PLAIN_NUMBERS, VERTICES, Asked, in_order, plain_states
from curveline.rod.states.refined import ERROR, HEIGHT, LEVEL

STATES_PER_ROD = 3
"""Rows of `plain_curves` for each rod: most have two states; where more come together than fit, a rod waits."""


@njit
def curve_between(pose, clamp, state, out):
    """Positions `out (k, 2)` [m] of a `state`, its vertices (m+1, 6) and edges (m,): see `Equilibrium.curve`."""
    vertices, edges = state
    count, half, length = out.shape[0], 0.5 * clamp, pose.length
    places = np.empty(count)
    step = length / (count - 1)
    for i in range(count - 1):
        places[i] = i * step
    places[count - 1] = length
    interpolate(vertices, edges, places - half, out)
    start, end = vertices[0, ANGLE], vertices[vertices.shape[0] - 1, ANGLE]
    for i in range(count):
        if places[i] < half:
            out[i, X], out[i, Y] = places[i] * np.cos(start), places[i] * np.sin(start)
        if places[i] > length - half:
            back = length - places[i]
            out[i, X], out[i, Y] = pose.x - back * np.cos(end), pose.y - back * np.sin(end)


@njit
def ranked(states, doubts):
    """Numbers of `states (c, PLAIN_NUMBERS)` in the order of their heights, the highest first; none if `in_order`
    finds that heights do not tell."""
    ordered = states.copy()
    if not in_order(ordered, doubts):
        return np.empty(0, dtype=np.int64)
    numbers = np.empty(states.shape[0], dtype=np.int64)
    for i in range(states.shape[0]):
        for j in range(states.shape[0]):
            # No two are equally high: that has just been told.
            if states[j, HEIGHT] == ordered[i, HEIGHT]:
                numbers[i] = j
    return numbers


@shipped(tuple[Matrix, Matrix], Bearing, tuple[Vector, Matrix], Asked, Stack)
def plain_curves(stands, bearing, loads, asked, curves):
    """The states of many rods without difficulties, as of `plain_batch`, and their curves.

    The `stands` are poses (m, 5), and both pivots of each rod in the display's frame, x and y of the left, then of the
    right one (m, 4) [m]; `loads` are fractions (l,) and forces (l, 2) [N]. `curves (s, k, 2)` takes equally spaced
    points [m] from pivot to pivot of as many states as fit; k is 0 if nobody wants any. Returns how many states each
    rod has (m,), 0 for one that has difficulties or does not fit, and the numbers (S, PLAIN_NUMBERS) of all of them.
    """
    (poses, pivots), (at, forces) = stands, loads
    counts = np.zeros(poses.shape[0], dtype=np.int64)
    table = np.empty((curves.shape[0], PLAIN_NUMBERS))
    total = 0
    last = curves.shape[1] - 1
    for i in range(poses.shape[0]):
        pose = pose_at_row(poses[i])
        states, vertices, behind = plain_states(pose, bearing, at, forces, asked)
        doubts = states[:, ERROR] + LEVEL * pose.length
        order = ranked(states, doubts)
        if total + order.size > table.shape[0]:
            continue
        for number in order:
            copy_into(table[total], states[number])
            if last > 0:
                begin = int(states[:number, VERTICES].sum())
                end = begin + int(states[number, VERTICES])
                out = curves[total]
                curve_between(pose, bearing.clamp, (vertices[begin:end], behind[begin : end - 1]), out)
                for j in range(last + 1):
                    out[j, X] += pivots[i, 0]
                    out[j, Y] += pivots[i, 1]
                # Adding the pivot rounds; the ends are the pivots to the last bit.
                out[0, X], out[0, Y], out[last, X], out[last, Y] = pivots[i]
            total += 1
        counts[i] = order.size
    return counts, table[:total].copy()
