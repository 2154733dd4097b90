"""A rod without loads between nodes that stand still: the state near another one, on finer edges, or where it falls.

Each is one call from Python, which would otherwise take longer to pass problems to and fro than to solve them.
"""

from __future__ import annotations

from curveline.kernels.forms import Vector
from curveline.kernels.kernel import njit, shipped
from curveline.rod.branches.continuation import LARGEST_MOVE, is_stable_outside, land, perturbation, try_step
from curveline.rod.branches.control_path import counts_along, problem_at, straight_path
from curveline.rod.problem import Bearing, Pose, refine_angles


@njit
def _problem(pose, bearing, n):
    """The rod cut into `n` equal edges."""
    still = straight_path(pose, pose)
    return problem_at(still, bearing, 0.0, counts_along(still, bearing, n))


@shipped(Pose, Bearing, Vector, Vector, int)
def state_near(pose, bearing, phi, multipliers, parts):
    """The stable state next to `phi (n,)`, `multipliers (2,)`, on edges cut into `parts` each, 1 or an even number.

    Returns whether there is one, its angles (parts n,) and multipliers (2,).
    """
    fine = refine_angles(_problem(pose, bearing, phi.size), phi, parts)
    return try_step(_problem(pose, bearing, fine.size), fine, multipliers, LARGEST_MOVE)


@shipped(Pose, Bearing, Vector, Vector)
def stays_in_plane(pose, bearing, phi, multipliers):
    """True if the rod stays in its plane in the state `phi (n,)`, `multipliers (2,)` of it."""
    state = _problem(pose, bearing, phi.size), phi, multipliers
    return is_stable_outside(straight_path(pose, pose), bearing, 0.0, state)


@shipped(Pose, Bearing, Vector, Vector)
def landed(pose, bearing, phi, multipliers):
    """Where the rod falls in its plane from a state `phi (n,)`, `multipliers (2,)` that is gone: see `land`."""
    return land(straight_path(pose, pose), 0.0, bearing, phi, multipliers, perturbation(phi.size))
