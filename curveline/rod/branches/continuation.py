"""Follow a stable equilibrium along a path: where it stays, how near it comes to losing stability, where it falls.

Natural continuation: the fraction of the path grows and Newton takes the state along. `follow` records every pose,
`travel` only arrives, for those who ask a thousand times; both end where the state ceases to be stable, at a fold or
a bifurcation, in the plane or, where the bearing says how stiff the rod is sideways, out of it; `land` lets the rod
fall in the plane from there.

    path = straight(begin.pose, end.pose)                    # or loading(pose, at, before, after), or Way(...)
    branch = follow(path, begin.bearing, *start_along(path, state))
    if branch.reached < 1.0:
        landed, phi, multipliers = land(path, 1.0, begin.bearing, branch.phi, branch.multipliers, sway(branch.phi.size))
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from curveline.kernels.forms import Matrix, Vector
from curveline.kernels.kernel import njit, shipped
from curveline.rod.branches.control_path import (
    ControlPath,
    counts_along,
    forces_at,
    is_still,
    pose_at,
    problem_at,
    rod_at,
)
from curveline.rod.geometry.vertex_table import ANGLE, CURVATURE
from curveline.rod.planar.lateral import lateral_eigenvalue_below, lateral_modes_below, lateral_variation
from curveline.rod.planar.modes import from_zero, lowest_eigenvalue
from curveline.rod.planar.newton import Effort, descend, newton
from curveline.rod.planar.richardson import vertex_table
from curveline.rod.problem import Array, Bearing, cut, largest_change, mesh, refine_angles, sharpest_turn
from curveline.rod.profile import BENT
from curveline.rod.states.equilibrium import Equilibrium
from curveline.rod.states.planar_states import SEARCH_EDGES

FOLLOW_EDGES = 2 * SEARCH_EDGES[0]
LARGEST_STEP = 1.0 / 24.0
SMALLEST_STEP = 1e-7
LARGEST_MOVE = 0.25
"""An edge that turns by more than this [rad] in one step belongs to another branch."""

STIFFEST = 4.0 * math.pi**2
"""Lowest eigenvalue of a straight clamped rod without load, in EI/L^2: the unit of stability margins."""
SHALLOW = math.pi**2
"""An eigenvalue below this [EI/L^2], a quarter of a straight clamped rod's, that fell by more than half in one step may
have been lower on the path: look closer."""
CLOSEST_LOOK = LARGEST_STEP / 64.0
GLANCE = 1e-3
"""Relative precision of the lowest eigenvalue at every pose of a path; where it is lowest it is found to `PRECISE`."""
PRECISE = 1e-5
HIGH = 1e15
"""An eigenvalue [EI/L^2] that none exceeds."""
DOUBT = 4.0
"""What a coarse rod may miss of its lowest eigenvalue in the plane [EI/L^2]; one out of it that is higher by more
does not limit a margin, and is not sought."""

TRAVEL_MOVE = 0.05
"""The most that an edge turns [rad] in a step of `travel`, which takes the whole path at once where it can."""
TRAVEL_STEP = 1e-6

MOST_POSES = 4000
"""Of a branch that is followed."""
NUDGE = 0.01

TRACK = Effort(turn=0.2, close=1e-7, iterations=12)
LAND = Effort(turn=0.3, close=1e-7, iterations=400)


class Weakest(NamedTuple):
    """Where on a path an eigenvalue of a state is lowest: the fraction, the eigenvalue [EI/L^2], the state there."""

    fraction: float
    eigenvalue: float
    phi: Vector
    multipliers: Vector


class Branch(NamedTuple):
    """A followed state, the fraction of the path it `reached`, and its angles and multipliers there.

    Per pose: its `fractions (m,)` of the path, the `lowest (m,)` eigenvalue [EI/L^2], the `sharpest (m,)` curvature
    away from the natural one [1/m], and `wrenches (m, 6)`, what the left node must do to the rod, with its sign: along
    the tangent, towards the right node [N], upwards [N], moment about its pivot, counter-clockwise [N m]; then the same
    three for the right node. `inside` is where the lowest eigenvalue in the plane is lowest, `outside` the one out of
    it, sought where it could be the lower one. A branch that ends early `leaves_plane` or loses its stability in it.
    """

    fractions: Vector
    lowest: Vector
    sharpest: Vector
    wrenches: Matrix
    reached: float
    phi: Vector
    multipliers: Vector
    inside: Weakest
    outside: Weakest
    leaves_plane: bool


@njit
def node_loads(path, fraction, bearing, free, phi, multipliers):
    """Largest curvature away from the natural one [1/m], then what the nodes must do to the rod: see `Branch`.

    All six are slopes of the energy, by what the motors move. That is why the push along the tangent is not the force
    in the rod outside the bearing: straightening the rod as it enters pushes it out again, by EI kappa^2 / 2 (Bigoni
    et al. 2015, Mech. Mater. 80: Eshelby-like forces), less what straightening it takes where it comes from a tail, or
    another segment, EI / 2 times the square of its natural curvature. Of a rod that stretches it leaves out the energy
    of stretching.
    """
    pose = pose_at(path, fraction)
    forces = forces_at(path, fraction)
    length = pose.length - bearing.clamp
    half = 0.5 * bearing.clamp
    table = vertex_table(free, phi, multipliers)
    unit = bearing.stiffness / length**2
    end_x, end_y = -multipliers[0] * unit, -multipliers[1] * unit
    start_x, start_y = -end_x, bearing.weight * length - end_y
    for i in range(forces.shape[0]):
        start_x -= forces[i, 0]
        start_y -= forces[i, 1]
    out = np.empty(6)
    sharpest = 0.0
    for i in range(phi.size + 1):
        sharpest = max(sharpest, abs((table[i, CURVATURE] - free.rest[BENT, i]) / length - bearing.natural))
    for side in range(2):
        x, y = (start_x, start_y) if side == 0 else (end_x, end_y)
        angle = table[0 if side == 0 else phi.size, ANGLE]
        # Seen from the node, the rod leaves the left one along its tangent and the right one against it.
        sign = 1.0 if side == 0 else -1.0
        vertex = 0 if side == 0 else phi.size
        bend, own = table[vertex, CURVATURE] / length, free.rest[BENT, vertex] / length + bearing.natural
        out[3 * side] = x * np.cos(angle) + y * np.sin(angle) - sign * 0.5 * bearing.stiffness * (bend**2 - own**2)
        out[1 + 3 * side] = y
        across = y * np.cos(angle) - x * np.sin(angle)
        out[2 + 3 * side] = sign * (half * across - bearing.stiffness * (bend - own))
    return sharpest, out


@njit
def try_step(free, phi, multipliers, most):
    """The stable state of `free` that Newton reaches from another one; False where there is none.

    One that fails, is unstable or turns an edge by more than `most` is none. Returns it with its angles, multipliers.
    """
    return step_with(free, (phi, multipliers), most, TRACK)


@njit
def step_with(free, state, most, effort):
    """As `try_step` from a `state`, angles and multipliers, with an effort of Newton's."""
    trial, force = state[0].copy(), state[1].copy()
    iterations, unstable = newton(free, trial, force, effort)
    found = iterations > 0 and unstable == 0 and largest_change(trial, state[0]) < most
    return found, trial, force


@njit
def sideways(bearing, free_length):
    """Stiffness out of the plane and of twist over that in it, and the natural curvature times the length: (3,)."""
    ratio = 1.0 / bearing.stiffness
    return np.array([bearing.lateral * ratio, bearing.twisting * ratio, bearing.natural * free_length])


@njit
def is_held_in_plane(bearing):
    """True for a rod of which nobody said how stiff it is out of the plane."""
    return bearing.lateral == 0.0 and bearing.twisting == 0.0


@njit
def stiffness_outside(path, bearing, fraction, state, most):
    """Lowest eigenvalue out of the plane [EI/L^2] of a `state`, problem, angles and multipliers, or `most` if less."""
    free, phi, multipliers = state
    if is_held_in_plane(bearing):
        return most
    stiff = sideways(bearing, pose_at(path, fraction).length - bearing.clamp)
    return lateral_eigenvalue_below(free, phi, multipliers, stiff, most)


@njit
def _is_shallow(now, before):
    """True if an eigenvalue fell so far and so fast that it may have been lower between."""
    return now < SHALLOW and now < 0.5 * before


@shipped(ControlPath, Bearing, Vector, Vector)
def follow(path, bearing, phi, multipliers):
    """Follow the stable state `phi (n,)`, `multipliers (2,)` along a `ControlPath` to its end, or until it is lost.

    Natural continuation: the fraction of the path grows by steps that are halved where Newton fails, jumps or finds an
    unstable equilibrium, down to `SMALLEST_STEP`, which is then the accuracy to which a fold or bifurcation is located.
    They are halved, too, where the lowest eigenvalue falls fast, so that a dip is not stepped over.
    """
    counts = counts_along(path, bearing, phi.size)
    fractions, eigenvalues, sharpest = np.empty(MOST_POSES), np.empty(MOST_POSES), np.empty(MOST_POSES)
    wrenches = np.empty((MOST_POSES, 6))
    count = 0
    reached = 0.0
    step = 0.0
    leaves = False
    least = np.inf
    inside = Weakest(0.0, np.inf, phi, multipliers)
    outside = Weakest(0.0, np.inf, phi, multipliers)
    while count < MOST_POSES and counts.sum() == phi.size:
        fraction = min(1.0, reached + step)
        free = problem_at(path, bearing, fraction, counts)
        found, trial, force = try_step(free, phi, multipliers, LARGEST_MOVE)
        lowest = lowest_eigenvalue(free, trial, force, from_zero(), GLANCE) if found else 0.0
        least = min(outside.eigenvalue, min(lowest, inside.eigenvalue) + DOUBT)
        aside = stiffness_outside(path, bearing, fraction, (free, trial, force), least) if found else 0.0
        leaves = found and aside <= 0.0
        if found and count > 0 and step > CLOSEST_LOOK:
            found = not _is_shallow(lowest, eigenvalues[count - 1])
            found = found and not (aside < least and _is_shallow(aside, least))
        if found and not leaves:
            phi = trial
            multipliers = force
            reached = fraction
            fractions[count] = fraction
            eigenvalues[count] = lowest
            sharpest[count], wrenches[count] = node_loads(path, fraction, bearing, free, phi, multipliers)
            count += 1
            if lowest < inside.eigenvalue:
                inside = Weakest(fraction, lowest, phi, multipliers)
            if aside < least:
                outside = Weakest(fraction, aside, phi, multipliers)
            if is_still(path):
                reached = 1.0
            if reached == 1.0:
                break
            step = LARGEST_STEP if count == 1 else min(LARGEST_STEP, 1.5 * step)
        else:
            step *= 0.5
            if step < SMALLEST_STEP:
                break
    found = (fractions[:count], eigenvalues[:count], sharpest[:count], wrenches[:count])
    return Branch(*found, reached, phi, multipliers, inside, outside, leaves)


@njit
def _finer(path, bearing, dip):
    """The rod on edges cut in two where a followed state is least stable, and the state there; False if it is lost."""
    counts = counts_along(path, bearing, dip.phi.size)
    phi = refine_angles(problem_at(path, bearing, dip.fraction, counts), dip.phi, 2)
    free = problem_at(path, bearing, dip.fraction, 2 * counts)
    found, phi, multipliers = try_step(free, phi, dip.multipliers, LARGEST_MOVE)
    return found, (free, phi, multipliers)


@shipped(ControlPath, Bearing, Branch)
def stiffness_of(path, bearing, branch):
    """Lowest eigenvalues in the plane and out of it [EI/L^2] along a followed branch, of the continuous rod.

    Extrapolated from its edges and edges cut in two (Richardson); -inf where the state is lost on these. The one out of
    the plane is inf where it was not sought, since it does not limit a margin.
    """
    dip = branch.inside
    found, state = _finer(path, bearing, dip)
    inside = -np.inf
    if found:
        inside = lowest_eigenvalue(state[0], state[1], state[2], from_zero(), PRECISE)
        here = problem_at(path, bearing, dip.fraction, counts_along(path, bearing, dip.phi.size))
        inside += (inside - lowest_eigenvalue(here, dip.phi, dip.multipliers, from_zero(), PRECISE)) / 3.0
    outside = branch.outside.eigenvalue
    if outside < np.inf:
        found, state = _finer(path, bearing, branch.outside)
        finer = stiffness_outside(path, bearing, branch.outside.fraction, state, HIGH) if found else -np.inf
        outside = finer + (finer - outside) / 3.0
    return inside, outside


@shipped(ControlPath, Bearing, Vector, Vector)
def travel(path, bearing, phi, multipliers):
    """As `follow`, but without records: the fraction reached, angles (n,) and multipliers (2,) there.

    Steps are as long as the rod moves little in them, so that a short path is one step; a loss of stability is located
    to `TRAVEL_STEP`. Stability is that of the inertia, at the end of each step alone: in the plane Newton finds it at
    no cost. The last of what it returns is True if the rod would leave its plane there.
    """
    counts = counts_along(path, bearing, phi.size)
    reached = 0.0
    step = 1.0
    leaves = False
    flows = False
    while reached < 1.0 and step >= TRAVEL_STEP and counts.sum() == phi.size:
        fraction = min(1.0, reached + step)
        free = problem_at(path, bearing, fraction, counts)
        found, trial, force = try_step(free, phi, multipliers, TRAVEL_MOVE)
        leaves = found and not is_stable_outside(path, bearing, fraction, (free, trial, force))
        if found and not leaves:
            phi = trial
            multipliers = force
            reached = fraction
            # What was too long from farther away is tried once more from here, and nothing longer.
            step *= 1.5 if flows else 1.0
            flows = True
        else:
            step *= 0.5
            flows = False
    return reached, phi, multipliers, leaves


@njit
def is_stable_outside(path, bearing, fraction, state):
    """True if a `state`, problem, angles and multipliers, is stable out of its plane, too."""
    free, phi, multipliers = state
    if is_held_in_plane(bearing):
        return True
    stiff = sideways(bearing, pose_at(path, fraction).length - bearing.clamp)
    return lateral_modes_below(free, lateral_variation(free, phi, multipliers, stiff), 0.0) == 0


@shipped(ControlPath, float, Bearing, Vector, Vector, Vector)
def land(path, fraction, bearing, phi, multipliers, nudge):
    """Where the rod falls at a fraction of the path from a state `phi (n,)` that is gone there, nudged by `nudge (n,)`.

    The nudge [rad], a mode or `perturbation`, takes it off any symmetry; then it goes downhill. Energy descent stands
    in for damped dynamics here. Returns True and the state there, or False if none was reached.
    """
    counts = counts_along(path, bearing, phi.size)
    angles = phi.copy()
    force = multipliers.copy()
    if counts.sum() != phi.size:
        return False, angles, force
    free = problem_at(path, bearing, fraction, counts)
    for j in range(phi.size):
        angles[j] += nudge[j]
    iterations = descend(free, angles, force, LAND)
    if iterations < 0:
        # A descent may get stuck beside the bottom, where rounding hides what leads down: begun anew, Newton goes on.
        iterations = descend(free, angles, force, LAND)
    return iterations > 0 and sharpest_turn(free, angles) < 1.0, angles, force


@njit
def perturbation(n):
    """A small nudge (n,) [rad] to land with, neither symmetric nor antisymmetric: an S of n edges."""
    out = np.empty(n)
    for j in range(n):
        out[j] = NUDGE * np.sin(2.0 * np.pi * (j + 0.5) / n + 0.4)
    return out


def coarse_start(state: Equilibrium, n: int = FOLLOW_EDGES) -> tuple[Array, Array]:
    """Angles (n,) and multipliers (2,) from which Newton finds `state` again on n edges with vertices at its loads."""
    return state.start_on(mesh(state.rod.scaled().at, n))


def start_along(path: ControlPath, state: Equilibrium, n: int = FOLLOW_EDGES) -> tuple[Array, Array]:
    """As `coarse_start`, with vertices where the path has loads."""
    bearing = state.rod.bearing
    return state.start_on(cut(rod_at(path, bearing, 0.0).at, counts_along(path, bearing, n)))
