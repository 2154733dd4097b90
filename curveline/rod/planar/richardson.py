"""Kernels that turn a coarse equilibrium into a curve of known accuracy: levels of halved edges and extrapolation.

The discrete rod converges with the square of the edge length, so (4 fine - coarse) / 3 of two levels is an order better
(Richardson). Two such extrapolations, from three levels, differ by nearly the whole error of the coarser one; the error
of the finer one is a fifteenth of that difference in the limit; `HONESTY` times it is reported.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.forms import Matrix, Vector
from curveline.kernels.kernel import leaf, njit, shipped
from curveline.rod.geometry.hermite import weights
from curveline.rod.geometry.vertex_table import ANGLE, COLUMNS, CURVATURE, STRAIN, STRAIN_SLOPE, X, Y
from curveline.rod.planar.clamps import link, link_energies
from curveline.rod.planar.modes import around, from_zero, lowest_eigenvalue
from curveline.rod.planar.newton import Effort, newton, thrust_on
from curveline.rod.problem import COSINE, SINE, Problem, gives, halved, largest_change, make_problem, refine_angles
from curveline.rod.profile import BEFORE, BENT, TURN, hidden_between
from curveline.rod.trigonometry import sines_and_cosines

POLISH = Effort(turn=0.3, close=1e-7, iterations=25)

ACROSS, UP, FIRST_BEND, LAST_BEND, STRAIN_ENERGY, LOAD_POTENTIAL, EIGENVALUE = range(7)
"""The numbers of a level: both multipliers, by what the ends are bent beyond the profile of the natural curvature, two
energies, the lowest eigenvalue."""

SCALARS = 7
HONESTY = 0.15
DOUBT = 1.0
"""Eigenvalue, as a part of its change by halving the edges, below which the next halving is asked, too."""
MOST_DOUBTED = 6000
"""Edges from which on that is not done: what is still undecided lies at its bifurcation to within 1e-6."""
ROUNDING = 1e-12


@shipped(Problem, Vector, Vector)
def vertex_table(problem, phi, multipliers):
    """Position x, y, tangent angle, curvature, axial strain and its slope at every vertex: (n+1, 6)."""
    n = phi.size
    rest = problem.rest
    table = np.zeros((n + 1, COLUMNS))
    sines_and_cosines(phi, problem.room[SINE], problem.room[COSINE])
    before = 0.0
    for j in range(n):
        strain = 0.0
        if problem.compliance[j] > 0.0:
            strain = -problem.compliance[j] * thrust_on(problem, phi, multipliers, j)
        length = problem.edges[j] * (1.0 + strain)
        table[j + 1, X] = table[j, X] + length * problem.room[COSINE, j]
        table[j + 1, Y] = table[j, Y] + length * problem.room[SINE, j]
        if j > 0:
            turn = phi[j] - phi[j - 1]
            share = problem.edges[j - 1] / (problem.edges[j - 1] + problem.edges[j])
            bent = turn - rest[TURN, j]
            table[j, ANGLE] = phi[j - 1] + rest[BEFORE, j] + share * bent
            table[j, CURVATURE] = bent * problem.stiffness[j] + rest[BENT, j]
            table[j, STRAIN] = before + share * (strain - before)
            table[j, STRAIN_SLOPE] = (strain - before) * problem.stiffness[j]
        before = strain
    table[0, STRAIN_SLOPE] = table[1, STRAIN_SLOPE]
    table[n, STRAIN_SLOPE] = table[n - 1, STRAIN_SLOPE]
    table[0, STRAIN] = table[1, STRAIN] - problem.edges[0] * table[0, STRAIN_SLOPE]
    table[n, STRAIN] = table[n - 1, STRAIN] + problem.edges[n - 1] * table[n, STRAIN_SLOPE]
    start, _ = link(problem, phi, multipliers, 0)
    end, _ = link(problem, phi, multipliers, 1)
    table[0, ANGLE] = start
    table[n, ANGLE] = end
    # The derivative of the discrete energy by the clamp angle: the end moment, second order accurate.
    table[0, CURVATURE] = (phi[0] - start - rest[TURN, 0]) * problem.stiffness[0] + rest[BENT, 0]
    table[n, CURVATURE] = (end - phi[n - 1] - rest[TURN, n]) * problem.stiffness[n] + rest[BENT, n]
    return table


@njit
def level_scalars(problem, phi, multipliers, table):
    """The numbers of a level that are extrapolated beside its vertices: see `SCALARS`."""
    out = np.empty(SCALARS)
    n = phi.size
    out[ACROSS] = multipliers[0]
    out[UP] = multipliers[1]
    out[FIRST_BEND] = table[0, CURVATURE] - problem.rest[BENT, 0]
    out[LAST_BEND] = table[n, CURVATURE] - problem.rest[BENT, n]
    strained = 0.0
    potential = 0.0
    before, end = table[0, ANGLE], table[n, ANGLE]
    if gives(problem):
        for side in range(2):
            own, loaded = link_energies(problem, table[side * n, ANGLE], side)
            strained += own
            potential += loaded
    for j in range(n):
        # The table's edges are stretched and turned already, which spares a sine and a cosine.
        potential += problem.loads[0, j] * (table[j + 1, X] - table[j, X]) / problem.edges[j]
        potential += problem.loads[1, j] * (table[j + 1, Y] - table[j, Y]) / problem.edges[j]
        strained += 0.5 * (phi[j] - before - problem.rest[TURN, j]) ** 2 * problem.stiffness[j]
        before = phi[j]
        if problem.compliance[j] > 0.0:
            strained += 0.5 * problem.compliance[j] * thrust_on(problem, phi, multipliers, j) ** 2
    out[STRAIN_ENERGY] = strained + 0.5 * (end - before - problem.rest[TURN, n]) ** 2 * problem.stiffness[n]
    out[LOAD_POTENTIAL] = potential
    out[EIGENVALUE] = 0.0
    return out


@leaf
def largest_gap(fine, coarse):
    """Largest distance between the vertices of `coarse (m+1, 6)` and the same ones of `fine (2m+1, 6)`."""
    worst = 0.0
    for i in range(coarse.shape[0]):
        x, y = fine[2 * i, X] - coarse[i, X], fine[2 * i, Y] - coarse[i, Y]
        worst = max(worst, x * x + y * y)
    return np.sqrt(worst)


@leaf
def extrapolate(coarse, fine, out):
    """Richardson: the limit for vanishing edges of values with an error in the square of the edge length."""
    for i in range(coarse.size):
        out[i] = coarse[i] + (fine[i] - coarse[i]) * (4.0 / 3.0)


@leaf
def _is_undecided(eigenvalue, change, n):
    """True if finer edges than n may show that an equilibrium is stable, or that it is not.

    The extrapolated eigenvalue's error is a small part of its last `change` by halving the edges.
    """
    return abs(eigenvalue) < DOUBT * abs(change) and n < MOST_DOUBTED


@njit
def climb_levels(rod, edges, phi, multipliers, tolerance, most_edges):
    """Refine the equilibrium `phi (n,)`, `multipliers (2,)` on `edges (n,)` until its error is below `tolerance`.

    Returns (table, scalars, edges, estimate, unstable, iterations, level): the extrapolated vertices (m+1, 6), the
    extrapolated scalars, the edges (m,) between these vertices, the error estimate in units of the length, the number
    of unstable directions on the finest level (-1 if the equilibrium was lost there), Newton iterations in all, and
    the finest level's number of edges. Stops at `most_edges` with the estimate reached by then.
    """
    free = make_problem(rod, edges)
    spent, unstable = newton(free, phi, multipliers, POLISH)
    fine_table = vertex_table(free, phi, multipliers)
    fine_scalars = level_scalars(free, phi, multipliers, fine_table)
    table = fine_table
    scalars = fine_scalars
    estimate = np.inf
    if spent < 0:
        return table, scalars, edges, estimate, -1, -spent, edges.size
    rungs = 1
    previous_change = np.inf
    lowest = 0.0
    places = edges
    moved = np.zeros(edges.size)
    pulled = np.zeros(multipliers.size)
    while 2 * edges.size <= most_edges or rungs < 3:
        lowest_before = lowest
        lowest = lowest_eigenvalue(free, phi, multipliers, from_zero() if rungs == 1 else around(lowest), 1e-6)
        phi = refine_angles(free, phi, 2)
        start = phi.copy()
        # What halving the edges changes is a quarter of what it changed before: a guess that spares an iteration.
        for j in range(phi.size):
            phi[j] += 0.25 * moved[j // 2]
        for a in range(multipliers.size):
            multipliers[a] += 0.25 * pulled[a]
            pulled[a] = multipliers[a] - 0.25 * pulled[a]
        free = make_problem(rod, halved(edges))
        iterations, unstable = newton(free, phi, multipliers, POLISH)
        spent += abs(iterations)
        if iterations < 0 or largest_change(phi, start) > 0.5:
            return table, scalars, places, np.inf, -1, spent, 2 * edges.size
        for j in range(phi.size):
            start[j] = phi[j] - start[j]
        moved = start
        for a in range(multipliers.size):
            pulled[a] = multipliers[a] - pulled[a]
        coarse_table = fine_table
        coarse_scalars = fine_scalars
        fine_table = vertex_table(free, phi, multipliers)
        fine_scalars = level_scalars(free, phi, multipliers, fine_table)
        before = table
        table = np.empty(coarse_table.shape)
        for i in range(coarse_table.shape[0]):
            extrapolate(coarse_table[i], fine_table[2 * i], table[i])
        scalars = np.empty(SCALARS)
        extrapolate(coarse_scalars, fine_scalars, scalars)
        # The finest level would cost most and add little: its stability is known from its inertia.
        scalars[EIGENVALUE] = lowest + (lowest - lowest_before) / 3.0 if rungs > 1 else lowest
        rungs += 1
        change = largest_gap(fine_table, coarse_table)
        if rungs > 2:
            estimate = HONESTY * largest_gap(table, before) + ROUNDING
            if rod.profile.shape[0] > 0:
                estimate += hidden_between(rod.profile, rod.begin, rod.unit * edges) / rod.unit
            # Where halving the edges does not quarter the change, the extrapolation is not to be trusted.
            if change > 0.4 * previous_change:
                estimate = max(estimate, change)
            if estimate <= tolerance and not _is_undecided(scalars[EIGENVALUE], lowest - lowest_before, edges.size):
                return table, scalars, edges, estimate, unstable, spent, 2 * edges.size
        previous_change = change
        places = edges
        edges = halved(edges)
    return table, scalars, places, estimate, unstable, spent, edges.size


@shipped(Matrix, Vector, Vector, Matrix)
def interpolate(table, edges, places, out):
    """Positions `out (k, 2)` at the sorted arc lengths `places (k,)`, by quintic Hermite interpolation.

    Position and its first two derivatives at the vertices `table (m+1, 6)` are met: error of sixth order in the edges.
    """
    j = 0
    begin = 0.0
    for i in range(places.size):
        while j < edges.size - 1 and places[i] > begin + edges[j]:
            begin += edges[j]
            j += 1
        h = edges[j]
        share = weights(min(max((places[i] - begin) / h, 0.0), 1.0))
        out[i, 0] = 0.0
        out[i, 1] = 0.0
        for end in range(2):
            row = table[j + end]
            cosine, sine = np.cos(row[ANGLE]), np.sin(row[ANGLE])
            speed = h * (1.0 + row[STRAIN])
            gain, turn = h * h * row[STRAIN_SLOPE], h * speed * row[CURVATURE]
            value, slope, bend = share[end], share[2 + end], share[4 + end]
            out[i, 0] += value * row[X] + (slope * speed + bend * gain) * cosine - bend * turn * sine
            out[i, 1] += value * row[Y] + (slope * speed + bend * gain) * sine + bend * turn * cosine
