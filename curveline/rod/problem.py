"""The discrete planar rod between two clamps, in units of its free length and its bending stiffness EI.

The rod has n straight edges with tangent angles phi_j. Its energy is the planar case of Bergou et al. 2008, bending
over Voronoi cells, with half cells at the clamps, plus loads that are linear in the vertex positions and hence in
cos(phi_j), sin(phi_j):

    E = sum_i (phi_i - phi_{i-1} - rest_i)^2 / (2 cell_i)
        + sum_j (1 + strain_j) (loads_0j cos phi_j + loads_1j sin phi_j) + sum_j strain_j^2 / (2 compliance_j)

with phi_{-1}, phi_n the clamp angles, and rest_i what vertex i of the free rod turns by. Two constraints close the
chord, and a third may hold the mean height:

    sum_j (1 + strain_j) edges_j cos phi_j = targets_0,    sum_j (1 + strain_j) edges_j sin phi_j = targets_1,
    sum_j (1 + strain_j) (height_0j cos phi_j + height_1j sin phi_j) = targets_2

A uniform natural curvature adds a constant to the energy of a planar rod whose clamps do not give, so it is not in
rest_i, which has what varies along the rod, see `profile`; for clamps that give see `planar.clamps`.

The axial strains are no unknowns. With the multipliers lambda_k, the thrust on edge j times its length is

    thrust_j = along_j cos phi_j + across_j sin phi_j,
    along_j = loads_0j + lambda_0 edges_j + lambda_2 height_0j,
    across_j = loads_1j + lambda_1 edges_j + lambda_2 height_1j

so that strain_j = -compliance_j thrust_j makes the Lagrangian stationary; put in, it leaves thrust - compliance
thrust^2 / 2 where an inextensible rod, the case of no compliance, has thrust.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from curveline.kernels.forms import Counts, Matrix, Vector
from curveline.kernels.kernel import leaf, njit, shipped
from curveline.rod.profile import NO_PROFILE, lay_free
from curveline.rod.trigonometry import sines_and_cosines

Array = NDArray[np.float64]

SINE, COSINE, GRADIENT, INVERSE, FORWARD_X, FORWARD_Y, FORWARD_HEIGHT, STEP = range(8)
"""The rows of a problem's room: of the angles; then see `newton.eliminate`."""
ROWS = 8


class ScaledRod(NamedTuple):
    """A rod between two clamps in units of its free length L and EI, before it is cut into edges.

    `weight` is w L^3 / EI (downwards); `at (m,)` sorted fractions of the free length at which dead loads
    `forces (m, 2)`, F L^2 / EI, act; `chord (2,)` leads from clamp to clamp; `ends (2,)` are the clamp angles [rad];
    `compliance` is EI / (EA L^2), 0 for an inextensible rod. A clamp gives as much as the length `give` of rod,
    EI / (k L) for its stiffness k, after a `play` [rad] to either side; then the `natural` curvature, times L, and the
    `reach` from pivot to mouth matter. Further natural curvature is that of a `profile (k, 3)`, in SI, of whose
    material the free rod begins at `begin` [m] and takes the length `unit` [m].
    """

    weight: float
    at: Vector
    forces: Matrix
    chord: Vector
    ends: Vector
    compliance: float = 0.0
    give: float = 0.0
    play: float = 0.0
    natural: float = 0.0
    reach: float = 0.0
    profile: Matrix = NO_PROFILE
    begin: float = 0.0
    unit: float = 1.0


class Pose(NamedTuple):
    """What the nodes of a segment impose: the right pivot seen from the left one, angles, rod between the pivots."""

    x: float  # [m]
    y: float  # [m]
    start: float  # [rad]
    end: float  # [rad]
    length: float  # [m]
    begin: float = 0.0  # [m] arc length of the material at the left pivot, from the rod's left end


class Bearing(NamedTuple):
    """What stays the same along a path: the rod held by a node, EI, weight (downwards), natural curvature, EI / EA.

    `lateral` and `twisting` tell whether the rod stays in its plane; both 0 for one that is held in it.
    """

    clamp: float  # [m]
    stiffness: float  # [N m^2]
    weight: float  # [N/m]
    natural: float = 0.0  # [1/m]
    compliance: float = 0.0  # [m^2], EI / EA; 0 for an inextensible rod
    lateral: float = 0.0  # [N m^2], EI out of the plane
    twisting: float = 0.0  # [N m^2], GJ
    give: float = 0.0  # [m] of rod that turns as much under a moment as a bearing does: EI over the bearing's stiffness
    play: float = 0.0  # [rad] by which a bearing tilts, either way, before it meets that stiffness
    profile: Matrix = NO_PROFILE  # (k, 3) of natural curvature beside the uniform one: see `rod.profile`

    def __eq__(self, other: object) -> bool:
        """True if a rod between two of either does the same: an array tells that no tuple can compare."""
        return isinstance(other, Bearing) and self._key == other._key

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash(self._key)

    @property
    def _key(self) -> tuple[object, ...]:
        return (*self[:-1], self.profile.shape, self.profile.tobytes())

    def held_in_plane(self) -> Bearing:
        """The same of a rod that cannot leave its plane."""
        return self._replace(lateral=0.0, twisting=0.0)


class Problem(NamedTuple):
    """A discrete rod between two clamps, in units of its free length and EI.

    `edges (n,)` edge lengths, summing to 1; `stiffness (n+1,)` one over the cell length of each vertex; `loads (2, n)`
    and `height (2, n)` coefficients of cos(phi), sin(phi) in the load potential and in the third constraint; `targets
    (k,)` of the constraints, whose third is there if k is 3; `ends (2,)` clamp angles [rad]; `compliance (n,)` strain
    of an edge per thrust on it as defined above, of all edges or of none; `held (2,)` 1 for each of the chord's
    constraints that is there, 0 for a last end that slides along that axis; `clamps (6,)` is what `planar.clamps` asks
    for; `rest (3, n+1)` what each vertex has when the rod is free, see `profile`, but for its uniform part. In the
    `room (8, n)` kernels keep what a call needs.
    """

    edges: Vector
    stiffness: Vector
    loads: Matrix
    height: Matrix
    targets: Vector
    ends: Vector
    compliance: Vector
    held: Vector
    clamps: Vector
    rest: Matrix
    room: Matrix


GIVE, PLAY, NATURAL, REACH, PUSH, LIFT = range(6)
"""Places in a problem's `clamps`: as of the `ScaledRod`; then the loads' pull at the first mouth, times the reach."""


@leaf
def pose_at_row(row):
    """The `Pose` of a row (5,), or (6,) of one that says where of the rod's material it begins."""
    return Pose(row[0], row[1], row[2], row[3], row[4], row[5] if row.size > 5 else 0.0)


@shipped(Pose, Bearing, Vector, Matrix)
def scale_rod(pose, bearing, at, forces):
    """The free rod of a `Pose` in units of its length and EI; `forces (m, 2)` [N] act at fractions `at (m,)` of it."""
    half = 0.5 * bearing.clamp
    free = pose.length - bearing.clamp
    unit = free * free / bearing.stiffness
    chord = np.array(
        [
            (pose.x - half * (np.cos(pose.start) + np.cos(pose.end))) / free,
            (pose.y - half * (np.sin(pose.start) + np.sin(pose.end))) / free,
        ]
    )
    places = (at * pose.length - half) / free
    ends = np.array([pose.start, pose.end])
    return ScaledRod(
        bearing.weight * free * unit,
        places,
        forces * unit,
        chord,
        ends,
        bearing.compliance / free**2,
        bearing.give / free,
        bearing.play,
        bearing.natural * free,
        half / free,
        bearing.profile,
        pose.begin + half,
        free,
    )


@njit
def stretching_by(rod, compliance):
    """The same rod with another `compliance`."""
    weight, at, forces, chord, ends, _, give, play, natural, reach, profile, begin, unit = rod
    return ScaledRod(weight, at, forces, chord, ends, compliance, give, play, natural, reach, profile, begin, unit)


@njit
def weighing(rod, weight):
    """The same rod with another `weight`."""
    _, at, forces, chord, ends, compliance, give, play, natural, reach, profile, begin, unit = rod
    return ScaledRod(weight, at, forces, chord, ends, compliance, give, play, natural, reach, profile, begin, unit)


@shipped(ScaledRod, Vector)
def make_problem(rod, edges):
    """Cut a `ScaledRod` into `edges (n,)`, between ends that are held where it has them.

    Dead loads must act at vertices, as they do for the edges that `mesh` gives.
    """
    n = edges.size
    stiffness = np.empty(n + 1)
    stiffness[0] = 2.0 / edges[0]
    stiffness[n] = 2.0 / edges[n - 1]
    for i in range(1, n):
        stiffness[i] = 2.0 / (edges[i - 1] + edges[i])
    loads = np.zeros((2, n))
    beyond = 1.0
    for j in range(n):
        loads[1, j] = rod.weight * _lifted(edges[j], beyond)
        for p in range(rod.at.size):
            if 1.0 - rod.at[p] < beyond - 0.5 * edges[j]:
                loads[0, j] -= rod.forces[p, 0] * edges[j]
                loads[1, j] -= rod.forces[p, 1] * edges[j]
        beyond -= edges[j]
    height, room = np.zeros((2, n)), np.zeros((ROWS, n))
    targets, held = rod.chord.copy(), np.ones(2)
    clamps = np.array([rod.give, rod.play, rod.natural, rod.reach, 0.0, rod.weight * rod.reach])
    for p in range(rod.at.size):
        clamps[PUSH] -= rod.forces[p, 0] * rod.reach
        clamps[LIFT] -= rod.forces[p, 1] * rod.reach
    rest = np.zeros((3, n + 1))
    if rod.profile.shape[0] > 0:
        lay_free(rod.profile, rod.begin, rod.unit, edges, rest)
    return Problem(edges, stiffness, loads, height, targets, rod.ends, rod.compliance / edges, held, clamps, rest, room)


@leaf
def _lifted(edge, beyond):
    """Length of rod that the turning of an edge lifts: half of itself and all of what is `beyond` its begin."""
    return edge * (beyond - 0.5 * edge)


@njit
def held_in_height(problem):
    """The same rod with a third constraint, on its mean height over the chord, whose target is 0."""
    chord = problem.targets
    span = max(np.hypot(chord[0], chord[1]), 1e-12)
    height = np.empty((2, problem.edges.size))
    beyond = 1.0
    for j in range(problem.edges.size):
        lifted = _lifted(problem.edges[j], beyond)
        beyond -= problem.edges[j]
        height[0, j] = -chord[1] / span * lifted
        height[1, j] = chord[0] / span * lifted
    return _constrained(problem, height, np.array([chord[0], chord[1], 0.0]))


@njit
def released(problem):
    """The same rod without the constraint on its mean height."""
    return _constrained(problem, problem.height, problem.targets[:2])


@njit
def _constrained(problem, height, targets):
    """The same rod under other constraints."""
    edges, stiffness, loads, _, _, ends, compliance, held, clamps, rest, room = problem
    return Problem(edges, stiffness, loads, height, targets, ends, compliance, held, clamps, rest, room)


@leaf
def coefficients(problem, multipliers, j):
    """Those of cos(phi_j) and sin(phi_j) in the Lagrangian: along_j and across_j of the module's formulas."""
    along = problem.loads[0, j] + multipliers[0] * problem.edges[j]
    across = problem.loads[1, j] + multipliers[1] * problem.edges[j]
    if multipliers.size == 3:
        along += multipliers[2] * problem.height[0, j]
        across += multipliers[2] * problem.height[1, j]
    return along, across


@njit
def shares(at, n):
    """How many of n edges lie between neighbouring sorted fractions `at (m,)` of the length: counts (m+1,).

    They are n in all, unless n is less than two for each piece that is longer than nothing.
    """
    m = at.size
    marks = np.zeros(m + 2, dtype=np.int64)
    least = np.zeros(m + 1, dtype=np.int64)
    for i in range(m + 1):
        least[i] = 2 if (at[i] if i < m else 1.0) - (at[i - 1] if i > 0 else 0.0) > 1e-9 else 0
        marks[i + 1] = max(marks[i] + least[i], round(n * at[i]) if i < m else n)
    for i in range(m, 0, -1):
        marks[i] = min(marks[i], marks[i + 1] - least[i])
    for i in range(m + 1):
        marks[i + 1] = max(marks[i + 1], marks[i] + least[i])
    return marks[1:] - marks[:-1]


@shipped(Vector, Counts)
def cut(at, counts):
    """Edges of a rod of length 1, `counts (m+1,)` of equal ones between vertices at the sorted fractions `at (m,)`."""
    m = at.size
    edges = np.empty(counts.sum())
    j = 0
    for i in range(m + 1):
        piece = (at[i] if i < m else 1.0) - (at[i - 1] if i > 0 else 0.0)
        for _ in range(counts[i]):
            edges[j] = piece / counts[i]
            j += 1
    return edges


@shipped(Vector, int)
def mesh(at, n):
    """Edges of a rod of length 1, n where that is enough, with a vertex at each of the sorted fractions `at (m,)`."""
    return cut(at, shares(at, n))


@shipped(Vector)
def halved(edges):
    """Every edge cut in two."""
    fine = np.empty(2 * edges.size)
    for j in range(edges.size):
        fine[2 * j] = 0.5 * edges[j]
        fine[2 * j + 1] = 0.5 * edges[j]
    return fine


@leaf
def mean_height(problem, phi):
    """Mean height of the curve of an inextensible rod over its chord, in units of the length."""
    sines_and_cosines(phi, problem.room[SINE], problem.room[COSINE])
    total = 0.0
    for j in range(phi.size):
        total += problem.height[0, j] * problem.room[COSINE, j] + problem.height[1, j] * problem.room[SINE, j]
    return total


@leaf
def gives(problem):
    """True for a rod whose clamps do not stand where the motors hold them."""
    return problem.clamps[GIVE] > 0.0 or problem.clamps[PLAY] > 0.0


@leaf
def _seen_ends(problem, phi):
    """Angles of both mouths: of clamps that give, as the edges beside them go on."""
    if not gives(problem):
        return problem.ends[0], problem.ends[1]
    n = phi.size
    return 1.5 * phi[0] - 0.5 * phi[1], 1.5 * phi[n - 1] - 0.5 * phi[n - 2]


@leaf
def sharpest_turn(problem, phi):
    """Largest turn between neighbouring edges [rad]: near pi it is an artefact of the discrete rod, not a curve."""
    start, end = _seen_ends(problem, phi)
    sharpest = 2.0 * max(abs(phi[0] - start), abs(end - phi[phi.size - 1]))
    for j in range(1, phi.size):
        sharpest = max(sharpest, abs(phi[j] - phi[j - 1]))
    return sharpest


@leaf
def largest_change(after, before):
    """Largest difference between two arrays (n,)."""
    largest = 0.0
    for j in range(after.size):
        largest = max(largest, abs(after[j] - before[j]))
    return largest


@leaf
def copy_into(out, values):
    """Overwrite `out (n,)` with `values`; compiles in a fraction of the time of a slice assignment."""
    for j in range(out.size):
        out[j] = values[j]


@shipped(Problem, Vector, int)
def refine_angles(problem, phi, parts):
    """Angles of the same curve on edges cut into `parts` (even) each, by linear interpolation in arc length."""
    n = phi.size
    fine = np.empty(n * parts)
    start, end = _seen_ends(problem, phi)
    for j in range(n):
        for i in range(parts):
            at = (i + 0.5) / parts - 0.5
            if at < 0.0:
                fraction = -at if j > 0 else -2.0 * at
                other = phi[j - 1] if j > 0 else start
            else:
                fraction = at if j < n - 1 else 2.0 * at
                other = phi[j + 1] if j < n - 1 else end
            fine[j * parts + i] = phi[j] + fraction * (other - phi[j])
    return fine
