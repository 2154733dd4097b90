"""Bending: the energy of the curvature binormal at a vertex, averaged over the material frames of both edges.

Bergou et al. 2008, eq. 1 and 2: kb = 2 t_e x t_f / (1 + t_e . t_f) and its components about the directors; these are
averaged over both edges' frames (Bergou et al. 2010, section 3). In the relative quaternion q = (w, x, y, z) from one
frame to the other, which is a turn about an axis across the tangent followed by the twist, these components are
2 w x / (w^2 + z^2) and 2 w y / (w^2 + z^2).
"""

from __future__ import annotations

from curveline.kernels.kernel import njit


@njit
def turns(q):
    """Components about m1 and m2 of the turn at a vertex between frames that differ by `q (4,)`."""
    scale = 2.0 * q[0] / (q[0] ** 2 + q[3] ** 2)
    return scale * q[1], scale * q[2]


@njit
def energy(q, cell, stiffness, natural):
    """Bending energy of a vertex; `stiffness (4,)` and `natural (3,)` as in `spatial.SpatialRod`."""
    first, second = turns(q)
    return (
        0.5
        * (stiffness[0] * (first - cell * natural[0]) ** 2 + stiffness[1] * (second - cell * natural[1]) ** 2)
        / cell
    )


@njit
def add_derivatives(q, cell, stiffness, natural, gradient, hessian):
    """Add slope (4,) and Hessian (4, 4), lower triangle, by the components of `q` to `gradient` and `hessian`."""
    w, z = q[0], q[3]
    d = w * w + z * z
    along, across = 2.0 * (z * z - w * w) / d**2, -4.0 * w * z / d**2
    for axis in range(2):
        v = q[1 + axis]
        value = 2.0 * w * v / d
        slope_w, slope_v, slope_z = v * along, 2.0 * w / d, v * across
        moment = stiffness[axis] * (value - cell * natural[axis]) / cell
        rate = stiffness[axis] / cell
        gradient[0] += moment * slope_w
        gradient[1 + axis] += moment * slope_v
        gradient[3] += moment * slope_z
        bend_ww = 4.0 * v * w * (w * w - 3.0 * z * z) / d**3
        bend_wz = 4.0 * v * z * (3.0 * w * w - z * z) / d**3
        hessian[0, 0] += rate * slope_w * slope_w + moment * bend_ww
        hessian[1 + axis, 0] += rate * slope_v * slope_w + moment * along
        hessian[1 + axis, 1 + axis] += rate * slope_v * slope_v
        hessian[3, 0] += rate * slope_z * slope_w + moment * bend_wz
        hessian[3, 1 + axis] += rate * slope_z * slope_v + moment * across
        hessian[3, 3] += rate * slope_z * slope_z - moment * bend_ww
