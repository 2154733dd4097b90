"""Stretch: the energy of an edge's axial strain (Bergou et al. 2010, section 3)."""

from __future__ import annotations

from curveline.kernels.kernel import leaf


@leaf
def energy(strain, length, stiffness):
    """Stretching energy of an edge of rest `length`; `stiffness (4,)` as in `spatial.SpatialRod`."""
    return 0.5 * stiffness[3] * strain**2 * length


@leaf
def add_derivatives(strain, length, stiffness, gradient, hessian):
    """Add slope (4,) and Hessian (4, 4), lower triangle, by the edge's change along m1, m2, t and its spin."""
    force = stiffness[3] * strain
    gradient[2] += force
    hessian[0, 0] += force / (length * (1.0 + strain))
    hessian[1, 1] += force / (length * (1.0 + strain))
    hessian[2, 2] += stiffness[3] / length
