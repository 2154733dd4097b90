"""The droop test, held against the formula of small sags and a solver of boundary values."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from curveline.calibrating.droop import Droop, sag_of
from curveline.errors import InvalidInput
from curveline.units import mm


@pytest.mark.parametrize("load", [0.01, 0.1])
def test_small_sags_are_as_the_formula_has_them(load: float) -> None:
    assert sag_of(load) == pytest.approx(load / 8.0, rel=2e-3)
    assert sag_of(0.0) == 0.0


@pytest.mark.parametrize("load", [2.0, 8.0, 20.0])
def test_large_sags_are_as_a_solver_has_them(load: float) -> None:
    s = np.linspace(0.0, 1.0, 41)
    found = solve_bvp(
        lambda s, y: np.vstack([y[1], -load * (1.0 - s) * np.cos(y[0]), np.sin(y[0])]),
        lambda a, b: np.array([a[0], b[1], a[2]]),
        s,
        np.vstack([s, 1.0 - s, 0.5 * s**2]),
        tol=1e-8,
    )
    assert found.success
    assert sag_of(load) == pytest.approx(found.y[2, -1], abs=1e-6)


def test_sags_grow_with_the_load_up_to_the_largest_that_is_taken() -> None:
    sags = [sag_of(load) for load in (1.0, 3.0, 9.0, 20.0, 30.0)]
    assert sags == sorted(sags)
    assert sags[-1] > 0.8


def test_a_sag_tells_the_gravity_length() -> None:
    length = 0.4
    for over in (0.15, 0.3, 0.5):
        droop = Droop(over, over * sag_of((over / length) ** 3), mm(1.0))
        assert droop.weight ** (-1.0 / 3.0) == pytest.approx(length, rel=1e-6)
    small = Droop(0.2, mm(3.0), mm(0.3))
    assert small.sigma / small.weight == pytest.approx(0.1, rel=0.05)
    assert Droop(0.2, mm(3.0)).sigma > small.sigma


@pytest.mark.parametrize(
    ("length", "sag", "error"), [(0.3, 0.0, 0.0), (0.3, 0.29, 0.0), (0.0, 0.1, 0.0), (0.3, 0.1, -1.0)]
)
def test_what_no_rod_does_is_refused(length: float, sag: float, error: float) -> None:
    with pytest.raises(InvalidInput):
        Droop(length, sag, error)
