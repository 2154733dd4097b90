"""Dead loads on the vertices, the weight among them: a potential linear in the positions, so without a Hessian."""

from __future__ import annotations

from curveline.kernels.forms import Matrix
from curveline.kernels.kernel import leaf, shipped


@shipped(Matrix, Matrix)
@leaf
def energy(positions, forces):
    """Potential of `forces (n+1, 3)` at `positions (n+1, 3)`."""
    total = 0.0
    for i in range(forces.shape[0]):
        for axis in range(3):
            total -= forces[i, axis] * positions[i, axis]
    return total


@leaf
def add_derivatives(forces, gradient):
    """Add the slope by the positions to `gradient (4n+3,)`, whose entries 4i to 4i+2 are those of vertex i."""
    for i in range(forces.shape[0]):
        for axis in range(3):
            gradient[4 * i + axis] -= forces[i, axis]
