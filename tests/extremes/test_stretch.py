"""Rods so taut that only stretch lets them reach: tension and clamp moments as of a stretched line with bent ends."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import fsolve

from clamped_rods import Stock, made_of, rod_between
from curveline.rod.models.choice import SearchRequest, model_states
from curveline.rod.states.equilibrium import EXTENSIBLE, Outcome

STRETCHING = 1e6
"""EA L^2 / EI: about that of the built-in displays' rod."""


@pytest.mark.parametrize("excess", [1e-7, 1e-5, 1e-3])
@pytest.mark.parametrize("angles_deg", [(30.0, -30.0), (60.0, 60.0), (60.0, -20.0)], ids=str)
def test_a_taut_rod_stretches_until_its_ends_fit(angles_deg: tuple[float, float], excess: float) -> None:
    start, end = (math.radians(angle) for angle in angles_deg)
    rod = rod_between((1.0, 0.0), start, end, 1.0 + excess, 0.0, 1.0, 0.0)
    section = Stock(STRETCHING, 4e-3, 4.76e-3, 0.0, lateral_stiffness=16.0, twisting_stiffness=1.2)
    found = model_states(made_of(section, rod), SearchRequest(1e-6, (0,), EXTENSIBLE))
    (state,) = (each for each in found.states if each.simple)
    assert (state.model, state.outcome, state.stable) == (EXTENSIBLE, Outcome.CONVERGED, True)

    # A straight line between two ends of Euler's loop (Love 1927, section 263), tilted and stretched by T / EA. With
    # the angle a between line and clamp and d = 1 / sqrt(T), an end takes up the length 2 d (1 - cos(a / 2)), lies
    # 2 d sin(a / 2) beside the line, and asks for the moment 2 sin(a / 2) / d.
    def missing(unknown: NDArray[np.float64]) -> tuple[float, float]:
        tension, tilt = math.exp(unknown[0]), unknown[1]
        layer, halves = 1.0 / math.sqrt(tension), (0.5 * (start - tilt), 0.5 * (end - tilt))
        along = rod.length * (1.0 + tension / STRETCHING) - sum(2.0 * layer * (1.0 - math.cos(half)) for half in halves)
        return along - math.cos(tilt), sum(2.0 * layer * math.sin(half) for half in halves) + math.sin(tilt)

    logarithm, tilt = fsolve(missing, [math.log(4000.0), 0.0], xtol=1e-13)
    tension = math.exp(logarithm)
    assert tension > 400.0
    # What the ends stretch more or less than the line is left out.
    within = 1.5 * tension / STRETCHING
    assert state.clamp_force[1] == pytest.approx([tension * math.cos(tilt), tension * math.sin(tilt)], rel=within)
    for angle, moment in zip((start, end), state.clamp_moment, strict=True):
        assert moment == pytest.approx(2.0 * math.sin(0.5 * (angle - tilt)) * math.sqrt(tension), rel=within)
