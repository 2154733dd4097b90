"""Symmetric band matrices: the lower band of a matrix (N, N) is an array (N, k), diagonal first."""

from __future__ import annotations

import numpy as np

from curveline.kernels.forms import Matrix, Vector
from curveline.kernels.kernel import shipped
from curveline.rod.problem import Array


def cholesky(band: Array) -> Array | None:
    """Factor of the positive definite matrix with the lower `band (N, k)`; None if it is not positive definite."""
    factor = np.array(band)
    return factor if factorise(factor) else None


@shipped(Matrix)
def factorise(band):
    """Overwrite the lower `band (N, k)` of a matrix with its Cholesky factor's; False if it is not positive definite.

    Bands as narrow as those of a rod take less than half of the time that LAPACK takes for them.
    """
    size, width = band.shape
    for j in range(size):
        pivot = band[j, 0]
        if not 0.0 < pivot < np.inf:
            return False
        reach = min(width, size - j)
        root = np.sqrt(pivot)
        band[j, 0] = root
        inverse = 1.0 / root
        for k in range(1, reach):
            band[j, k] *= inverse
        for k in range(1, reach):
            factor = band[j, k]
            for m in range(k, reach):
                band[j + k, m - k] -= factor * band[j, m]
    return True


@shipped(Matrix, Vector)
def solve_factored(factor, right):
    """Solution (N,) of a system whose matrix `factorise` has overwritten with its `factor (N, k)`."""
    size, width = factor.shape
    out = right.copy()
    for j in range(size):
        out[j] /= factor[j, 0]
        for k in range(1, min(width, size - j)):
            out[j + k] -= factor[j, k] * out[j]
    for j in range(size - 1, -1, -1):
        total = out[j]
        for k in range(1, min(width, size - j)):
            total -= factor[j, k] * out[j + k]
        out[j] = total / factor[j, 0]
    return out


@shipped(Matrix, Vector)
def times(band, vector):
    """Product (N,) of the symmetric matrix with the lower `band (N, k)` and `vector (N,)`."""
    size, width = band.shape
    out = np.zeros(size)
    for column in range(size):
        out[column] += band[column, 0] * vector[column]
        for k in range(1, min(width, size - column)):
            out[column + k] += band[column, k] * vector[column]
            out[column] += band[column, k] * vector[column + k]
    return out
