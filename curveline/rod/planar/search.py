"""Kernels that search a segment for its equilibria on few edges: from arches, by Newton, and by sweeps."""

from __future__ import annotations

import numpy as np

from curveline.kernels.forms import Vector
from curveline.kernels.kernel import leaf, njit, shipped
from curveline.rod.planar.arch import arch
from curveline.rod.planar.modes import from_zero, lowest_eigenvalue, modes_below, second_variation
from curveline.rod.planar.newton import Effort, descend, newton, way_down
from curveline.rod.planar.sweep import (
    BARELY,
    CAPACITY,
    CERTIFY,
    LOOK,
    RIDGE,
    MetEquilibria,
    follow_heights,
    is_ridge,
    keep,
    no_ridge,
    nothing_found,
    nowhere_near,
    room_for,
    settle_at,
    sweep_heights,
)
from curveline.rod.problem import (
    Problem,
    ScaledRod,
    held_in_height,
    largest_change,
    make_problem,
    mean_height,
    refine_angles,
    released,
)

SEEK_PARTS = 4
"""Parts of an edge where an arch leads to no equilibrium of the coarse rod: that has its folds earlier."""
SEEK_MOST = 100
"""Edges from which on they are not cut for that: their folds are where those of the cut ones are, to 0.1 %."""

COARSE = 24.0
"""Edges that cannot tell an eigenvalue between `BARELY` and `DOUBTFUL` from zero."""
DOUBTFUL = 2.0
"""Eigenvalue below which a state lies near a fold, or near a cusp, where others hide in dips that coarse edges lack."""
ASIDE = 0.01
"""Disturbance [rad], neither symmetric nor antisymmetric, with which the rod is let go from a saddle."""
ASTRAY = 0.6
"""Turn of an edge [rad] from an arch to an equilibrium, from which on that is not the one it stands for."""

RELAX = Effort(turn=0.5, close=1e-4, iterations=150)


@shipped(Problem, Vector, MetEquilibria)
def relax_from(free, phi, found):
    """Go downhill from the guess `phi (n,)` and keep the state it leads to; False if that is none or known."""
    force = np.zeros(2)
    known = found.filled[0]
    if descend(free, phi, force, RELAX) > 0:
        keep(free, found, phi, force, 0)
    return found.filled[0] > known


@njit
def seek_from(free, phi, found):
    """Go to an equilibrium near the guess `phi (n,)`, stable or not, and keep it; Newton heeds no ways down.

    Returns False if there is none.
    """
    force = np.zeros(2)
    iterations, unstable = newton(free, phi, force, CERTIFY)
    if iterations > 0:
        keep(free, found, phi, force, unstable)
    return iterations > 0


@njit
def sought_from(free, phi, found):
    """Relax the rod from the guess `phi (n,)`, then seek from it; keep both.

    Where the way down was Newton's own, with steps that seeking takes too, both are one. Returns whether relaxing led
    to something new, whether Newton found an equilibrium, and its angles (n,).
    """
    relaxed, force = phi.copy(), np.zeros(2)
    before = found.filled[0]
    iterations, longest = way_down(free, relaxed, force, RELAX)
    if iterations > 0:
        keep(free, found, relaxed, force, 0)
    is_new = found.filled[0] > before
    if iterations > 0 and longest <= CERTIFY.turn:
        return is_new, True, relaxed
    sought = phi.copy()
    return is_new, seek_from(free, sought, found), sought


@shipped(Problem, Vector, MetEquilibria)
def let_go_aside(free, phi, found):
    """Relax the rod from a saddle `phi (n,)` either way, and keep the states; False if all of them are known."""
    n = phi.size
    is_new = False
    for way in (1.0, -1.0):
        begin = np.empty(n)
        at = 0.0
        for j in range(n):
            begin[j] = phi[j] + way * ASIDE * np.sin(2.0 * np.pi * (at + 0.5 * free.edges[j]) + 0.4)
            at += free.edges[j]
        is_new = relax_from(free, begin, found) or is_new
    return is_new


@leaf
def doubt_of(n):
    """Part of an eigenvalue that n edges cannot tell from zero of what `COARSE` ones cannot.

    Edges move a fold, and both parameters of a cusp, by the square of their length; near a cusp the eigenvalue goes
    with the power 2/3 of that.
    """
    return (COARSE / n) ** (4.0 / 3.0)


@njit
def _has_other(problem, found, start, way):
    """True if a stable state other than the one numbered `start` lies on its side `way`, or there is no other."""
    height = mean_height(problem, found.shapes[start])
    alone = True
    for i in range(int(found.filled[0])):
        if found.unstable[i] == 0.0 and i != start:
            alone = False
            if (mean_height(problem, found.shapes[i]) - height) * way > 0.0:
                return True
    return alone


@shipped(Vector, int)
def divided(edges, parts):
    """Every edge cut into `parts` equal ones."""
    fine = np.empty(edges.size * parts)
    for j in range(fine.size):
        fine[j] = edges[j // parts] / parts
    return fine


@njit
def sweep_ridge(problem, phi, found, near):
    """Sweep both ways from the mean height of the guess `phi (n,)` for as long as the rod stays on top of a ridge.

    There a state may be stable on finer edges, from which a coarse rod falls.
    """
    problem.targets[2] = mean_height(problem, phi)
    angles, held = phi.copy(), np.zeros(3)
    iterations, _ = newton(problem, angles, held, LOOK)
    if iterations > 0 and is_ridge(problem, angles, held, RIDGE):
        for direction in (1.0, -1.0):
            follow_heights(
                problem, (angles, held, np.nan), direction, (found, near, no_ridge(phi.size), np.zeros(CAPACITY)), RIDGE
            )


@njit
def sweep_all(problem, found, near):
    """Sweep from every stable state in `found`, also from those that are met on the way, towards all others.

    A sweep that jumps does not pass the same states upwards and downwards. Of two states that one has passed without a
    jump, a sweep from one is that from the other: it need not be made again, but for what lies on the far side.
    """
    done, wanted = np.zeros((CAPACITY, 2)), np.zeros((CAPACITY, 2))
    held = np.zeros(3)
    place = 0
    while place < 2 * found.filled[0]:
        i, way = place // 2, place % 2
        place += 1
        direction = 1.0 - 2.0 * way
        is_due = wanted[i, way] > 0.0 or _has_other(problem, found, i, direction)
        if found.unstable[i] != 0.0 or done[i, way] > 0.0 or not is_due:
            continue
        done[i, way] = 1.0
        held[0], held[1], held[2] = found.multipliers[i, 0], found.multipliers[i, 1], 0.0
        passed = sweep_heights(problem, (found.shapes[i], held), direction, found, near)
        for other in range(int(found.filled[0])):
            if passed[other] > 0.0 and other != i:
                done[other, 0], done[other, 1] = 1.0, 1.0
                wanted[i, 1 - way] = 1.0
        # What is due now may stand before this place.
        place = 0


@shipped(ScaledRod, Vector)
def search_edges(rod, edges):
    """Equilibria of a rod without extra turns, stable and unstable, cut into `edges (n,)`.

    The rod is relaxed from both arches; every stable state, also those found on the way, is swept towards all others,
    since a sweep that jumps does not pass the same states upwards and downwards; a lone state is swept both ways. An
    arch may relax past a state that is only just stable, so Newton starts from it, too, and where it relaxes into
    nothing new it is swept as well, from its own height; where Newton finds nothing either, it tries once more on finer
    edges, since a state may exist on those alone. Where Newton goes astray, the ridge that the arch lies on is swept.
    Returns two pairs of edges and `Found`, the places that are worth a closer look, and whether finer edges may
    show more: where an equilibrium is `doubtful`, or a ridge was lost.
    """
    seek_edges = divided(edges, SEEK_PARTS)
    free = make_problem(rod, edges)
    problem = held_in_height(free)
    found, near = nothing_found(edges.size), nowhere_near(edges.size)
    sought = room_for(seek_edges.size, 2)
    phi = np.empty(edges.size)
    for side in (1.0, -1.0):
        arch(free, side, phi)
        is_new, is_there, sought_phi = sought_from(free, phi, found)
        if not is_there or largest_change(sought_phi, phi) > ASTRAY:
            sweep_ridge(problem, phi, found, near)
        if not is_new:
            if not is_there and edges.size < SEEK_MOST:
                finer = make_problem(rod, seek_edges)
                seek_from(finer, refine_angles(problem, phi, SEEK_PARTS), sought)
            held = np.zeros(3)
            if settle_at(problem, mean_height(problem, phi), phi, held):
                for direction in (1.0, -1.0):
                    sweep_heights(problem, (phi, held), direction, found, near)
    sweep_all(problem, found, near)
    doubt = doubt_of(edges.size) * DOUBTFUL
    is_unclear = near.lost[0] > 0.0 or doubtful(problem, found, -doubt, doubt)
    return (edges, found), (seek_edges, sought), near, is_unclear


@shipped(ScaledRod, Vector, MetEquilibria)
def may_be_stable(rod, edges, found):
    """Which of the equilibria are not clearly unstable: near a bifurcation only finer edges can tell. (c,)"""
    count = int(found.filled[0])
    may_be = np.zeros(count, dtype=np.bool_)
    for i in range(count):
        may_be[i] = found.unstable[i] == 0.0
        if found.unstable[i] == 1.0:
            free = make_problem(rod, edges)
            may_be[i] = lowest_eigenvalue(free, found.shapes[i], found.multipliers[i], from_zero(), 0.1) > BARELY
    return may_be


@njit
def doubtful(problem, found, least, most):
    """True if finer edges may show that an equilibrium is stable, is not, or is none, or others beside it.

    For its lowest eigenvalue lies between `least` and `most`.
    """
    free = released(problem)
    for i in range(int(found.filled[0])):
        unstable = int(found.unstable[i])
        if unstable < 2:
            variation = second_variation(free, found.shapes[i], found.multipliers[i])
            if modes_below(free, variation, least if unstable == 1 else most) != unstable:
                return True
    return False
