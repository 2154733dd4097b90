"""What the model leaves out is named, explained, and bounded by the stated formulas."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from curveline.rod.equilibrium import ClampedRod, Equilibrium
from curveline.rod.fidelity import Section, left_out
from curveline.rod.states import find_states

from .rods import STIFFNESS, WEIGHT

SECTION = Section(58_800.0, 2.4e-3, 1e-2, WEIGHT, lateral_stiffness=0.49, twisting_stiffness=0.0355)
ROD = ClampedRod((0.5, 0.05), 0.3, -0.2, 0.62, 0.02, STIFFNESS, WEIGHT)


def peak(rod: ClampedRod = ROD) -> Equilibrium:
    return find_states(rod, 1e-6)[0]


def bound(name: str, state: Equilibrium, section: Section = SECTION) -> float:
    return left_out(state, section)[name].bound


def test_every_term_is_named_and_explained() -> None:
    assert set(left_out(peak(), SECTION)) == {"stretch", "twist", "contact"}
    assert set(left_out(peak(replace(ROD, weight=0.0)), SECTION)) == {"stretch", "twist", "contact", "gravity"}
    assert set(left_out(peak(replace(ROD, weight=0.0)), replace(SECTION, weight=0.0))) == {
        "stretch",
        "twist",
        "contact",
    }
    for entry in left_out(peak(replace(ROD, weight=0.0)), SECTION).values():
        assert len(entry.why) > 30
        assert entry.bound >= 0.0


SHALLOW = replace(ROD, chord=(0.5, 0.0), start=0.0, end=0.0, length=0.505)


@pytest.mark.parametrize("rod", [ROD, SHALLOW], ids=["tall", "shallow"])
def test_stretch_moves_the_curve_less_than_stated(rod: ClampedRod) -> None:
    state = peak(rod)
    stated = bound("stretch", state)
    assert bound("stretch", state, replace(SECTION, stretching_stiffness=588_000.0)) == pytest.approx(stated / 10.0)
    # A rod longer or shorter by what its thrust takes: a shallow arch gains much more height than length.
    thrust = float(np.linalg.norm(state.clamp_force, axis=1).max())
    for way in (1.0, -1.0):
        other = peak(replace(rod, length=rod.length + way * thrust / SECTION.stretching_stiffness * rod.free_length))
        moved = float(np.max(np.linalg.norm(other.curve(101) - state.curve(101), axis=1)))
        assert 0.0 < moved <= stated < 1e-3


def test_stretch_counts_for_more_the_shallower_the_arch() -> None:
    level = replace(ROD, chord=(0.5, 0.0), start=0.0, end=0.0)
    bounds = [bound("stretch", peak(replace(level, length=length))) for length in (0.502, 0.51, 0.55, 0.6)]
    assert bounds == sorted(bounds, reverse=True)


def test_stretch_counts_the_loads() -> None:
    state = peak()
    loaded = replace(state, rod=replace(state.rod, loads=((0.5, 3.0, 4.0),)))
    per_newton = (bound("stretch", loaded) - bound("stretch", state)) / 5.0
    force = abs(state.clamp_force).max() * math.sqrt(2.0)
    assert per_newton == pytest.approx(bound("stretch", state) / force)


def test_a_flat_strip_stays_in_its_plane_a_narrow_or_long_one_may_not() -> None:
    assert bound("twist", peak()) == 0.0
    assert bound("twist", peak(), replace(SECTION, width=2e-3)) == pytest.approx(0.5 * ROD.free_length)
    assert bound("twist", peak(replace(ROD, length=1.3))) == pytest.approx(0.5 * 1.28)


def test_contact_is_the_overlap() -> None:
    state = replace(peak(), clearance=0.01)
    assert bound("contact", state) == 0.0
    assert bound("contact", state, replace(SECTION, thickness=0.013)) == pytest.approx(0.003)
    assert bound("contact", replace(state, crosses_itself=True)) == pytest.approx(ROD.free_length)


@pytest.mark.parametrize("name", ["peak", "valley"])
@pytest.mark.parametrize("weight", [0.05, WEIGHT])
def test_gravity_moves_the_curve_less_than_stated(name: str, weight: float) -> None:
    (light,) = (state for state in find_states(replace(ROD, weight=0.0), 1e-6) if state.name == name)
    (heavy,) = (state for state in find_states(replace(ROD, weight=weight), 1e-6) if state.name == name)
    moved = float(np.max(np.linalg.norm(heavy.curve(101) - light.curve(101), axis=1)))
    stated = bound("gravity", light, replace(SECTION, weight=weight))
    assert 0.0 < moved <= stated
    assert stated == pytest.approx(
        weight * light.rod.free_length**4 / STIFFNESS / math.sqrt(3.0) / light.lowest_eigenvalue
    )
