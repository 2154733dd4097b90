"""Bending: the energy of the curvature binormal at a vertex, averaged over the material frames of both edges.

Bergou et al. 2008, eq. 1 and 2: kb = 2 t_e x t_f / (1 + t_e . t_f) and its components about the directors; these are
averaged over both edges' frames (Bergou et al. 2010, section 3). In the relative quaternion q = (w, x, y, z) from one
frame to the other, which is a turn about an axis across the tangent followed by the twist, these components are
2 w x / (w^2 + z^2) and 2 w y / (w^2 + z^2).
"""

from __future__ import annotations

from curveline.kernels.kernel import leaf


@leaf
def turns(q):
    """Components about m1 and m2 of the turn at a vertex between frames that differ by `q (4,)`."""
    scale = 2.0 * q[0] / (q[0] ** 2 + q[3] ** 2)
    return scale * q[1], scale * q[2]


@leaf
def energy(q, cell, stiffness, natural):
    """Bending energy of a vertex; `stiffness (4,)` as in `spatial.SpatialRod`, `natural` (3) as there of one vertex."""
    first, second = turns(q)
    return (
        0.5
        * (stiffness[0] * (first - cell * natural[0]) ** 2 + stiffness[1] * (second - cell * natural[1]) ** 2)
        / cell
    )


@leaf
def derivatives(q, cell, stiffness, natural):
    """Slope (4) and Hessian (10), lower triangle by rows, by the components of `q`."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    per = 1.0 / (w * w + z * z)
    ww, wz, zz = w * w * per, w * z * per, z * z * per
    along, across, turn = 2.0 * (zz - ww) * per, -4.0 * wz * per, 2.0 * w * per
    third_w, third_z = 4.0 * w * (ww - 3.0 * zz) * per * per, 4.0 * z * (3.0 * ww - zz) * per * per
    rate, other = stiffness[0] / cell, stiffness[1] / cell
    moment, sideways = rate * (turn * x - cell * natural[0]), other * (turn * y - cell * natural[1])
    # Of both components together, what their slopes by w and z have in common.
    pull, spread = moment * x + sideways * y, rate * x * x + other * y * y
    slope = (pull * along, moment * turn, sideways * turn, pull * across)
    return slope, (
        spread * along * along + pull * third_w,
        rate * turn * x * along + moment * along,
        rate * turn * turn,
        other * turn * y * along + sideways * along,
        0.0,
        other * turn * turn,
        spread * along * across + pull * third_z,
        rate * turn * x * across + moment * across,
        other * turn * y * across + sideways * across,
        spread * across * across - pull * third_w,
    )
