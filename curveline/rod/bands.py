"""Symmetric band matrices by LAPACK: the lower band of a matrix (N, N) is an array (N, k), diagonal first."""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from curveline.rod._jit import njit
from curveline.rod.problem import Array


def cholesky(band: Array) -> Array | None:
    """Factor of the positive definite matrix with the lower `band (N, k)`; None if it is not positive definite."""
    factor, info = lapack.dpbtrf(band.T, lower=1)
    return factor if info == 0 and np.all(np.isfinite(factor[0])) else None


def solve_factored(factor: Array, right: Array) -> Array:
    """Solution of a system whose matrix `cholesky` has factored; `right (N,)` or `(N, m)`."""
    solution, _ = lapack.dpbtrs(factor, right, lower=1)
    return solution


def solve_indefinite(band: Array, right: Array) -> Array | None:
    """Solution of a system with the lower `band (N, k)`, definite or not, by LU; None if it is singular."""
    reach = band.shape[1] - 1
    _, _, solution, info = lapack.dgbsv(reach, reach, unfolded(band).T, right)
    return solution if info == 0 and np.all(np.isfinite(solution)) else None


@njit
def unfolded(band):
    """The band of both halves as LAPACK's LU wants it, transposed: (N, 3k+1) with k rows of room for its fill."""
    size, reach = band.shape[0], band.shape[1] - 1
    out = np.zeros((size, 3 * reach + 1))
    for column in range(size):
        for k in range(min(reach + 1, size - column)):
            out[column, 2 * reach + k] = band[column, k]
            out[column + k, 2 * reach - k] = band[column, k]
    return out


@njit
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
