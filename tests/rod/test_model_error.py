"""What the model leaves out is named, explained, and bounded by the stated formulas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clamped_rods import Stock, changed, made_of, rod_between
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.model_error import Bound, farthest, judge
from curveline.rod.states.equilibrium import Equilibrium
from curveline.rod.states.planar_states import find_states

from .rods import STIFFNESS, WEIGHT

SECTION = Stock(58_800.0, 2.4e-3, 2.97e-3, WEIGHT, lateral_stiffness=0.49, twisting_stiffness=0.0355)
ROD = rod_between((0.5, 0.05), 0.3, -0.2, 0.62, 0.02, STIFFNESS, WEIGHT)


def peak(rod: ClampedRod = ROD) -> Equilibrium:
    return find_states(rod, 1e-6)[0]


def named_bounds(state: Equilibrium, section: Stock) -> dict[str, Bound]:
    return judge(state.but(rod=made_of(section, state.rod))).bounds


def bound(name: str, state: Equilibrium, section: Stock = SECTION) -> float:
    return named_bounds(state, section)[name].bound


def test_every_term_is_named_and_explained() -> None:
    assert set(named_bounds(peak(), SECTION)) == {"stretch", "twist", "contact"}
    assert set(named_bounds(peak(changed(ROD, weight=0.0)), SECTION)) == {"stretch", "twist", "contact", "gravity"}
    weightless = replace(SECTION, weight=0.0)
    assert set(named_bounds(peak(changed(ROD, weight=0.0)), weightless)) == {"stretch", "twist", "contact"}
    for entry in named_bounds(peak(changed(ROD, weight=0.0)), SECTION).values():
        assert len(entry.why) > 30
        assert entry.bound >= 0.0


def test_contact_is_the_overlap() -> None:
    long = changed(ROD, chord=(0.1, 0.0), start=1.3, end=-1.3, length=0.8)
    state = peak(long)
    dense = state.curve(2001)
    gaps = np.linalg.norm(dense[:, None] - dense[None, :], axis=2)
    apart = np.abs(np.subtract.outer(np.arange(2001), np.arange(2001))) > 400
    distance = float(np.min(gaps[apart]))
    assert bound("contact", state, replace(SECTION, thickness=0.5 * distance)) == 0.0
    thick = replace(SECTION, thickness=distance + 0.003)
    assert bound("contact", state, thick) == pytest.approx(0.003, rel=0.2)
    assert bound("contact", replace(state, crosses_itself=True)) == pytest.approx(farthest(long))
