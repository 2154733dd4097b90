"""Twist: the energy of the angle by which a material frame turns about the rod beyond parallel transport.

Bergou et al. 2008, section 4.2.2: transport the frame of one edge to the next by the smallest rotation; the angle left
to the own frame of that edge is the twist, in the relative quaternion q = (w, x, y, z) of both frames 2 atan2(z, w).
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.kernel import njit


@njit
def angle(q):
    """Twist [rad] between frames that differ by `q (4,)`."""
    return 2.0 * np.arctan2(q[3], q[0])


@njit
def energy(q, cell, stiffness, natural):
    """Twisting energy of a vertex; `stiffness (4,)` and `natural (3,)` as in `spatial.SpatialRod`."""
    return 0.5 * stiffness[2] * (angle(q) - cell * natural[2]) ** 2 / cell


@njit
def add_derivatives(q, cell, stiffness, natural, gradient, hessian):
    """Add slope (4,) and Hessian (4, 4), lower triangle, by the components of `q` to `gradient` and `hessian`."""
    w, z = q[0], q[3]
    d = w * w + z * z
    slope_w, slope_z = -2.0 * z / d, 2.0 * w / d
    moment = stiffness[2] * (angle(q) - cell * natural[2]) / cell
    rate = stiffness[2] / cell
    gradient[0] += moment * slope_w
    gradient[3] += moment * slope_z
    bend = 4.0 * w * z / d**2
    hessian[0, 0] += rate * slope_w * slope_w + moment * bend
    hessian[3, 0] += rate * slope_w * slope_z + moment * 2.0 * (z * z - w * w) / d**2
    hessian[3, 3] += rate * slope_z * slope_z - moment * bend
