"""Neighbouring lines, and what they take: by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from curveline.shapes.files import read_display
from curveline.surfaces.neighbours import compared

X = np.linspace(0.0, 0.5, 51)


def fit_of(curve: Any, drawn: Any) -> Any:
    """A fit of one segment with these heights [m] over `X`."""
    curves, pieces = ((np.column_stack([X, np.broadcast_to(each, X.shape)]),) for each in (curve, drawn))
    return SimpleNamespace(scene=SimpleNamespace(display=read_display("single")), curves=curves, drawn=pieces)


def test_errors_that_both_have_are_none_across() -> None:
    hill = 0.05 * np.sin(np.pi * X / 0.5)
    error = 0.003 * np.cos(7.0 * X)
    pair = compared(3, fit_of(hill + error, hill), fit_of(2.0 * hill + error, 2.0 * hill))
    assert pair.line == 3
    assert pair.max < 1e-12


def test_an_error_of_one_is_the_step() -> None:
    bump = np.where(np.abs(X - 0.3) < 0.004, 0.002, 0.0)
    for one, other in ((bump, 0.0 * X), (0.0 * X, -bump)):
        pair = compared(1, fit_of(one, 0.0), fit_of(other, 0.1))
        # The lines are asked to be 100 mm apart, and are level.
        assert pair.max == pytest.approx(0.102)
        assert pair.x == pytest.approx(0.3, abs=0.01)
        assert 0.1 < pair.rms < 0.1002
