"""The mean height over the chord is known as well as the curve: held against the integral of a much finer curve."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from campaign import only
from clamped_rods import Stock, changed, made_of, rod_between
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.geometry.hermite import integral
from curveline.rod.models.choice import SearchRequest, model_states
from curveline.rod.problem import Array
from curveline.rod.states.equilibrium import Equilibrium
from curveline.rod.states.planar_states import find_states

from .rods import STIFFNESS, WEIGHT

SECTION = Stock(58_800.0, 2.4e-3, 2.97e-3, WEIGHT, lateral_stiffness=0.49, twisting_stiffness=0.0355)
COARSE, FINE = 1e-4, 1e-9
STEP = 1e-5
"""Tolerances of the state and of the one behind the fine curve, and the distance of its points [m]."""


def random_rods(count: int, seed: int) -> list[ClampedRod]:
    rng = np.random.default_rng(seed)
    rods = []
    for _ in range(count):
        height, start, end = rng.uniform([-0.2, -1.2, -1.2], [0.2, 1.2, 1.2])
        length = math.hypot(0.5, height) * rng.uniform(1.03, 1.7)
        # Whole steps of the fine curve lie between the clamps.
        length = STEP * round(length / STEP)
        rods.append(rod_between((0.5, float(height)), float(start), float(end), length, 0.02, STIFFNESS, WEIGHT))
    return rods


def planar(rod: ClampedRod, tolerance: float) -> list[Equilibrium]:
    return find_states(rod, tolerance)


def modelled(model: str) -> Callable[[ClampedRod, float], list[Equilibrium]]:
    def states(rod: ClampedRod, tolerance: float) -> list[Equilibrium]:
        segment = made_of(SECTION, rod)
        return list(model_states(segment, SearchRequest(tolerance, (0,), model)).states)

    return states


def rolled(rod: ClampedRod, tolerance: float) -> list[Equilibrium]:
    """A little out of the plane, by roll, yaw, and gravity that leans."""
    leaning = {"weight": 0.8 * rod.weight, "weight_z": -0.6 * rod.weight}
    segment = made_of(SECTION, rod, yaw=(0.2, -0.1), roll=(0.0, 0.6), **leaning)
    return list(model_states(segment, SearchRequest(tolerance, (0,), "spatial")).states)


def loaded(rod: ClampedRod, tolerance: float) -> list[Equilibrium]:
    """With loads: the rod bends in layers, and its edges are graded."""
    return find_states(changed(rod, loads=((0.3, 0.2, -1.0), (0.55, 0.0, -0.4))), tolerance)


def soft(rod: ClampedRod, tolerance: float) -> list[Equilibrium]:
    """A hundredth as stiff as the strip: bent in layers at its clamps."""
    return find_states(changed(rod, stiffness=0.01 * rod.stiffness), tolerance)


def taut(rod: ClampedRod, tolerance: float) -> list[Equilibrium]:
    chord = math.hypot(*rod.free_chord)
    return find_states(changed(rod, length=STEP * math.ceil((1.0002 * chord + rod.clamp) / STEP)), tolerance)


def curve_mean(state: Equilibrium) -> float:
    """Mean distance of the free rod from the chord, by Simpson's rule on a fine curve."""
    rod = state.rod
    count = round(rod.length / STEP)
    skip = round(0.5 * rod.clamp / STEP)
    curve = state.curve(count + 1)[skip : count + 1 - skip]
    heights = (rod.chord[0] * curve[:, 1] - rod.chord[1] * curve[:, 0]) / math.hypot(*rod.chord)
    if heights.size % 2 == 0:
        # An odd number of steps: the last by the trapezoidal rule, whose error is beyond any digit here.
        return (simpson(heights[:-1]) + 0.5 * (heights[-2] + heights[-1])) / (heights.size - 1)
    return simpson(heights) / (heights.size - 1)


def simpson(values: Array) -> float:
    """Integral over unit steps, an even number of them."""
    return float(values[0] + values[-1] + 4.0 * np.sum(values[1:-1:2]) + 2.0 * np.sum(values[2:-1:2])) / 3.0


WAYS: dict[str, Callable[[ClampedRod, float], list[Equilibrium]]] = {
    "planar": planar,
    "extensible": modelled("extensible"),
    "spatial": modelled("spatial"),
    "rolled": rolled,
    "loaded": loaded,
    "soft": soft,
    "taut": taut,
}


@pytest.mark.parametrize("count", [3, *only([12])])
@pytest.mark.parametrize("way", WAYS)
def test_the_mean_height_is_known_as_well_as_the_curve(way: str, count: int) -> None:
    checked = 0
    for rod in random_rods(count, seed=len(way)):
        exact = {state.name: state for state in WAYS[way](rod, FINE)}
        for state in WAYS[way](rod, COARSE):
            fine = exact.get(state.name)
            if fine is None or not (math.isfinite(state.error) and fine.error < 1e-7 and state.simple):
                continue
            checked += 1
            truth = curve_mean(fine)
            assert fine.mean_height == pytest.approx(truth, abs=fine.error + 1e-10)
            assert state.mean_height == pytest.approx(truth, abs=state.error)
    assert checked >= count


def test_quintics_are_integrated_exactly_on_uneven_edges() -> None:
    curve = np.polynomial.Polynomial([0.3, -1.0, 2.0, 0.5, -3.0, 1.5])
    edges = np.array([0.1, 0.5, 0.03, 0.37])
    places = np.concatenate([[0.0], np.cumsum(edges)])
    rows = np.column_stack([curve(places), curve.deriv()(places), curve.deriv(2)(places)])
    assert integral(rows, edges) == pytest.approx(curve.integ()(1.0), rel=1e-14)
