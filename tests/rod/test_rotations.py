"""Quaternions against matrices."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from curveline.rod.geometry.rotations import between, exponential, logarithm, matrix_of, multiply, normalise
from curveline.rod.problem import Array


def random_pair(seed: int) -> tuple[Array, Array]:
    a, b = np.random.default_rng(seed).normal(size=(2, 4))
    return a / np.linalg.norm(a), b / np.linalg.norm(b)


def matrix(q: Array) -> Array:
    out = np.empty((3, 3))
    matrix_of(q, out)
    return out


@pytest.mark.parametrize("seed", range(5))
def test_products_are_those_of_matrices(seed: int) -> None:
    a, b = random_pair(seed)
    product, difference = np.empty(4), np.empty(4)
    multiply(a, b, product)
    between(a, b, difference)
    assert matrix(product) == pytest.approx(matrix(a) @ matrix(b), abs=1e-14)
    assert matrix(difference) == pytest.approx(matrix(a).T @ matrix(b), abs=1e-14)
    assert difference[0] >= 0.0
    assert matrix(a) @ matrix(a).T == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.det(matrix(a)) == pytest.approx(1.0)
    longer = 1.7 * a
    normalise(longer)
    assert longer == pytest.approx(a, abs=1e-15)


@pytest.mark.parametrize("size", [0.0, 1e-9, 9.9e-5, 1.01e-4, 0.3, 3.0])
def test_exponentials_are_rotations_about_their_vector(size: int) -> None:
    vector = size * np.array([2.0, -3.0, 6.0]) / 7.0
    x, y, z = vector
    q, back = np.empty(4), np.empty(3)
    exponential(vector, q)
    assert matrix(q) == pytest.approx(expm(np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])), abs=1e-14)
    assert np.linalg.norm(q) == pytest.approx(1.0, abs=1e-15)
    logarithm(q, back)
    assert back == pytest.approx(vector, abs=1e-15 + 1e-14 * size)
