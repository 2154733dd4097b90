"""Figures of fits: the drawing, the curve, and why they are apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import curveline
from curveline.drawings.drawing import Drawing
from curveline.figures.fits import draw
from curveline.fitting.fit import Fit, FitRequest

ROOF = np.array([[0.0, 0.0], [0.25, 0.1], [0.5, 0.0]])


@pytest.fixture(scope="module")
def roof() -> Fit:
    return curveline.fit(Drawing(ROOF, "roof"), request=FitRequest(is_planned=False))


def test_a_figure_says_what_is_what(roof: Fit) -> None:
    svg = draw(roof, kind="svg").decode()
    for word in ("drawn", "peak", "apart [mm]", "RMS", "1: ", "a corner of", f"{1e3 * roof.rms:.3g} mm RMS"):
        assert word in svg


def test_the_same_fit_has_the_same_figure(roof: Fit) -> None:
    for kind in ("svg", "png", "pdf"):
        assert draw(roof, kind=kind) == draw(roof, kind=kind)


def test_names_are_text(roof: Fit) -> None:
    hostile = replace(roof, scene=replace(roof.scene, name="<script>$x_1$</script>"))
    svg = draw(hostile, kind="svg").decode()
    assert "<script>" not in svg
    assert "&lt;script&gt;" in svg


def test_an_exact_fit_has_a_figure() -> None:
    flat = curveline.fit(np.array([[0.0, 0.0], [0.5, 0.0]]), request=FitRequest(is_planned=False))
    assert b"straight" in draw(flat, kind="svg")


def test_a_row_is_wide_enough_for_its_segments() -> None:
    wave = np.column_stack([np.linspace(0.0, 2.0, 201), 0.05 * np.sin(np.linspace(0.0, 12.0, 201))])
    svg = draw(curveline.fit(wave, "quad", FitRequest(is_planned=False)), kind="svg").decode()
    assert "peak" in svg
    assert "valley" in svg
