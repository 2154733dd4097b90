"""Band matrices against dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest

from curveline.rod.problem import Array
from curveline.rod.spatial.bands import cholesky, solve_factored, times

from .spatial_rods import dense


def random_band(size: int, width: int, seed: int = 0) -> Array:
    """A band whose last entries, those beyond the matrix, are anything."""
    return np.random.default_rng(seed).normal(size=(size, width))


@pytest.mark.parametrize(("size", "width"), [(1, 11), (6, 11), (23, 11), (40, 3)])
def test_bands_do_what_dense_matrices_do(size: int, width: int) -> None:
    band, right = random_band(size, width), np.random.default_rng(2).normal(size=size)
    matrix = dense(band)
    assert np.max(np.abs(matrix)) > 0.1
    assert times(band, right) == pytest.approx(matrix @ right, abs=1e-12)
    assert np.linalg.eigvalsh(matrix)[0] < 0.0 or size == 1
    band[:, 0] += 30.0
    factor = cholesky(band)
    assert factor is not None
    assert (matrix + 30.0 * np.eye(size)) @ solve_factored(factor, right) == pytest.approx(right, abs=1e-12)
    both = solve_factored(factor, np.column_stack([right, 2.0 * right]))
    assert both[:, 1] == pytest.approx(2.0 * both[:, 0])


def test_what_is_not_definite_has_no_factor() -> None:
    band = random_band(12, 4)
    band[:, 0] += 30.0
    lowest = np.linalg.eigvalsh(dense(band))[0]
    for below, definite in ((1e-6, True), (-1e-6, False)):
        shifted = band.copy()
        shifted[:, 0] -= lowest - below
        assert (cholesky(shifted) is not None) == definite
    band[5, 0] = np.nan
    assert cholesky(band) is None
