"""Twist: the energy of the angle by which a material frame turns about the rod beyond parallel transport.

Bergou et al. 2008, section 4.2.2: transport the frame of one edge to the next by the smallest rotation; the angle left
to the own frame of that edge is the twist, in the relative quaternion q = (w, x, y, z) of both frames 2 atan2(z, w).
"""

from __future__ import annotations

from curveline.kernels.kernel import leaf
from curveline.rod.trigonometry import arc_tangent


@leaf
def angle(q):
    """Twist [rad] between frames that differ by `q (4,)`."""
    return 2.0 * arc_tangent(q[3], q[0])


@leaf
def energy(q, cell, stiffness, natural):
    """Twisting energy of a vertex whose rod has a `stiffness` GJ / EI and a `natural` twist per length."""
    return 0.5 * stiffness * (angle(q) - cell * natural) ** 2 / cell


@leaf
def derivatives(q, cell, stiffness, natural):
    """Slope (4) and Hessian (10), lower triangle by rows, by the components of `q`."""
    w, z = q[0], q[3]
    per = 1.0 / (w * w + z * z)
    slope_w, slope_z = -2.0 * z * per, 2.0 * w * per
    rate = stiffness / cell
    moment = rate * (angle(q) - cell * natural)
    bend = -slope_w * slope_z
    return (moment * slope_w, 0.0, 0.0, moment * slope_z), (
        rate * slope_w * slope_w + moment * bend,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        rate * slope_w * slope_z + 0.5 * moment * (slope_w * slope_w - slope_z * slope_z),
        0.0,
        0.0,
        rate * slope_z * slope_z - moment * bend,
    )
