"""Kernels of the planar rod, inextensible or not: Newton on the bordered system, descent, inertia.

The Hessian of the Lagrangian is tridiagonal, bordered by the k constraints, so that a Newton step costs O(n): L D L^T
by a forward sweep, a k x k Schur complement, a backward sweep. The signs of the pivots and of the Schur complement give
the inertia (Sylvester), hence the number of directions in which the rod is unstable.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.kernels.forms import Vector
from curveline.kernels.kernel import njit, shipped
from curveline.rod.problem import Problem

TINY = 1e-290

PENALTY = 1000.0
LEAST_SHIFT = 0.05
"""The step away from a saddle grows with curvature over shift, so the shift must not dwarf a weak instability."""


class Effort(NamedTuple):
    """How hard to try: the most an edge may turn per step [rad], the last step's size that ends it, iterations.

    The error after a full Newton step is of the order of its square, so `close` = 1e-7 leaves rounding only.
    """

    turn: float
    close: float
    iterations: int


@njit
def solve_small(matrix, vector):
    """Solve the k x k system in place by elimination with row pivoting; the solution replaces `vector (k,)`."""
    k = vector.size
    for i in range(k):
        best = i
        for r in range(i + 1, k):
            if abs(matrix[r, i]) > abs(matrix[best, i]):
                best = r
        if best != i:
            for c in range(k):
                matrix[i, c], matrix[best, c] = matrix[best, c], matrix[i, c]
            vector[i], vector[best] = vector[best], vector[i]
        if abs(matrix[i, i]) < TINY:
            matrix[i, i] = TINY
        for r in range(i + 1, k):
            factor = matrix[r, i] / matrix[i, i]
            for c in range(i, k):
                matrix[r, c] -= factor * matrix[i, c]
            vector[r] -= factor * vector[i]
    for i in range(k - 1, -1, -1):
        for c in range(i + 1, k):
            vector[i] -= matrix[i, c] * vector[c]
        vector[i] /= matrix[i, i]


@njit
def count_positive(matrix):
    """Number of positive eigenvalues of the symmetric k x k `matrix`, by the signs of its pivots; overwrites it."""
    k = matrix.shape[0]
    positive = 0
    for i in range(k):
        pivot = matrix[i, i]
        if abs(pivot) < TINY:
            pivot = TINY
        if pivot > 0.0:
            positive += 1
        for r in range(i + 1, k):
            factor = matrix[r, i] / pivot
            for c in range(i + 1, k):
                matrix[r, c] -= factor * matrix[i, c]
    return positive


@njit
def sweep_forward(problem, phi, multipliers, shift, pivots, forward, schur, residual):
    """Eliminate the tridiagonal Hessian of the Lagrangian at `phi (n,)`, `multipliers (k,)`.

    Fills `pivots (n,)`; `forward (k+1, n)`, the gradient and the constraint rows after the forward sweep;
    `schur (k, k+1)`, the Schur complement C H^-1 C^T, plus what the constraints give by stretching, and its right-hand
    side; `residual (k,)`, the constraints' violation. The Hessian is shifted by `shift` times the edge lengths. Returns
    the number of negative pivots and the largest gradient entry per edge length.
    """
    edges, stiffness, loads, rows = problem.edges, problem.stiffness, problem.loads, problem.rows
    compliance = problem.compliance
    n = phi.size
    k = multipliers.size
    negative = 0
    steepest = 0.0
    for a in range(k):
        residual[a] = -problem.targets[a]
        for b in range(k + 1):
            schur[a, b] = 0.0
    before = problem.ends[0]
    pivot = 1.0
    for j in range(n):
        cosine = np.cos(phi[j])
        sine = np.sin(phi[j])
        along = loads[0, j]
        across = loads[1, j]
        for a in range(k):
            along += multipliers[a] * rows[a, 0, j]
            across += multipliers[a] * rows[a, 1, j]
        thrust = along * cosine + across * sine
        turning = across * cosine - along * sine
        stretch = 1.0 - compliance[j] * thrust
        after = phi[j + 1] if j + 1 < n else problem.ends[1]
        gradient = (phi[j] - before) * stiffness[j] - (after - phi[j]) * stiffness[j + 1] + turning * stretch
        steepest = max(steepest, abs(gradient) / edges[j])
        diagonal = stiffness[j] + stiffness[j + 1] - thrust * stretch - compliance[j] * turning**2 + shift * edges[j]
        ratio = 0.0
        if j > 0:
            ratio = -stiffness[j] / pivot
            diagonal += ratio * stiffness[j]
            gradient -= ratio * forward[0, j - 1]
        pivot = diagonal
        if abs(pivot) < TINY:
            pivot = TINY
        if pivot < 0.0:
            negative += 1
        pivots[j] = pivot
        forward[0, j] = gradient
        for a in range(k):
            reach = rows[a, 0, j] * cosine + rows[a, 1, j] * sine
            residual[a] += reach * stretch
            give = compliance[j] * reach
            value = (rows[a, 1, j] * cosine - rows[a, 0, j] * sine) * stretch - give * turning
            if j > 0:
                value -= ratio * forward[a + 1, j - 1]
            forward[a + 1, j] = value
            scaled = value / pivot
            schur[a, k] += scaled * gradient
            for b in range(a + 1):
                schur[a, b] += scaled * forward[b + 1, j]
                schur[a, b] += give * (rows[b, 0, j] * cosine + rows[b, 1, j] * sine)
        before = phi[j]
    for a in range(k):
        for b in range(a):
            schur[b, a] = schur[a, b]
    return negative, steepest


@njit
def sweep_backward(problem, pivots, forward, schur, residual, step, change):
    """Newton step after `sweep_forward`: `step (n,)` for the angles, `change (k,)` for the multipliers.

    Returns the number of positive eigenvalues of the Schur complement.
    """
    n = step.size
    k = change.size
    for a in range(k):
        change[a] = residual[a] - schur[a, k]
    positive = count_positive(schur[:, :k].copy())
    solve_small(schur[:, :k], change)
    for j in range(n - 1, -1, -1):
        value = forward[0, j]
        for a in range(k):
            value += change[a] * forward[a + 1, j]
        value = -value
        if j + 1 < n:
            value += problem.stiffness[j + 1] * step[j + 1]
        step[j] = value / pivots[j]
    return positive


@shipped(Problem, Vector, Vector, Effort)
def newton(problem, phi, multipliers, effort):
    """Find an equilibrium, stable or not, from `phi (n,)`, `multipliers (k,)`, both overwritten.

    Full Newton steps, shortened where an edge would turn by more than the effort allows. Returns the iterations
    used (negative if they ran out) and the number of unstable directions at the equilibrium.
    """
    n = phi.size
    k = multipliers.size
    pivots = np.empty(n)
    step = np.empty(n)
    forward = np.empty((k + 1, n))
    schur = np.empty((k, k + 1))
    residual = np.empty(k)
    change = np.empty(k)
    for iteration in range(1, effort.iterations + 1):
        negative, _ = sweep_forward(problem, phi, multipliers, 0.0, pivots, forward, schur, residual)
        positive = sweep_backward(problem, pivots, forward, schur, residual, step, change)
        turn = 0.0
        for j in range(n):
            turn = max(turn, abs(step[j]))
        if not np.isfinite(turn):
            return -iteration, -1
        scale = 1.0 if turn <= effort.turn else effort.turn / turn
        for j in range(n):
            phi[j] += scale * step[j]
        for a in range(k):
            multipliers[a] += scale * change[a]
        if turn < effort.close:
            return iteration, negative + positive - k
    return -effort.iterations, -1


@njit
def thrust_on(problem, phi, multipliers, j):
    """Thrust on edge `j` times its length, from loads and constraints: its strain over minus its compliance."""
    along = problem.loads[0, j]
    across = problem.loads[1, j]
    for a in range(multipliers.size):
        along += multipliers[a] * problem.rows[a, 0, j]
        across += multipliers[a] * problem.rows[a, 1, j]
    return along * np.cos(phi[j]) + across * np.sin(phi[j])


@njit
def energy(problem, phi, multipliers):
    """Energy of bending and stretching plus load potential at `phi (n,)`; the `multipliers (k,)` set the strains."""
    return energy_and_gaps(problem, phi, multipliers, np.empty(multipliers.size))


@njit
def energy_and_gaps(problem, phi, multipliers, gaps):
    """The `energy`; `gaps (k,)` is overwritten by how far each constraint is from its target."""
    total = 0.0
    before = problem.ends[0]
    n = phi.size
    k = multipliers.size
    for a in range(k):
        gaps[a] = -problem.targets[a]
    for j in range(n):
        # Sines and cosines are most of the cost: one of each for everything.
        cosine, sine = np.cos(phi[j]), np.sin(phi[j])
        turn = phi[j] - before
        potential = problem.loads[0, j] * cosine + problem.loads[1, j] * sine
        total += 0.5 * turn * turn * problem.stiffness[j] + potential
        stretch = 1.0
        if problem.compliance[j] > 0.0:
            thrust = potential
            for a in range(k):
                thrust += multipliers[a] * (problem.rows[a, 0, j] * cosine + problem.rows[a, 1, j] * sine)
            total += problem.compliance[j] * thrust * (0.5 * thrust - potential)
            stretch -= problem.compliance[j] * thrust
        for a in range(k):
            gaps[a] += (problem.rows[a, 0, j] * cosine + problem.rows[a, 1, j] * sine) * stretch
        before = phi[j]
    turn = problem.ends[1] - before
    return total + 0.5 * turn * turn * problem.stiffness[n]


@njit
def merit(problem, phi, multipliers, gaps):
    """Augmented Lagrangian at `phi (n,)`: what a descent step must lower; `gaps (k,)` is overwritten.

    An exact penalty would refuse steps along a weak instability: they leave the constraints by as much, to second
    order, as they lower the energy (the Maratos effect).
    """
    total = energy_and_gaps(problem, phi, multipliers, gaps)
    for a in range(multipliers.size):
        total += multipliers[a] * gaps[a] + 0.5 * PENALTY * gaps[a] * gaps[a]
    return total


@njit
def descend(problem, phi, multipliers, effort):
    """Go downhill from `phi (n,)` to a stable equilibrium; `phi` and `multipliers (k,)` are overwritten.

    Newton on the bordered system with the Hessian shifted until it is positive definite on the constraints, a bound on
    how far an edge turns per step, and a line search on an augmented Lagrangian (Nocedal and Wright 2006, ch. 17).
    Returns the iterations used, negative if they ran out.
    """
    n = phi.size
    k = multipliers.size
    pivots = np.empty(n)
    step = np.empty(n)
    trial = np.empty(n)
    target = np.empty(k)
    forward = np.empty((k + 1, n))
    schur = np.empty((k, k + 1))
    residual = np.empty(k)
    change = np.empty(k)
    shift = 0.0
    for iteration in range(1, effort.iterations + 1):
        shift = 0.0 if shift < LEAST_SHIFT else 0.25 * shift
        for _ in range(40):
            negative, _ = sweep_forward(problem, phi, multipliers, shift, pivots, forward, schur, residual)
            if negative + sweep_backward(problem, pivots, forward, schur, residual, step, change) == k:
                break
            shift = max(LEAST_SHIFT, 4.0 * shift)
        turn = 0.0
        for j in range(n):
            turn = max(turn, abs(step[j]))
        if not np.isfinite(turn):
            return -iteration
        scale = 1.0 if turn <= effort.turn else effort.turn / turn
        if turn > 0.05 or shift > 0.0:
            for a in range(k):
                target[a] = multipliers[a] + change[a]
            start = merit(problem, phi, target, residual)
            for _ in range(12):
                for j in range(n):
                    trial[j] = phi[j] + scale * step[j]
                if merit(problem, trial, target, residual) < start:
                    break
                scale *= 0.5
        for j in range(n):
            phi[j] += scale * step[j]
        for a in range(k):
            multipliers[a] += change[a] if scale == 1.0 else scale * change[a]
        if turn < effort.close and shift == 0.0:
            return iteration
    return -effort.iterations
