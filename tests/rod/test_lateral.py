"""A planar state stays in its plane or does not: against the published table and against the rod in space."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clamped_rods import Stock, made_of, rod_between
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.model_error import Lateral, lateral
from curveline.rod.spatial.lifting import lift
from curveline.rod.spatial.relax import lowest_mode, newton
from curveline.rod.states.equilibrium import Equilibrium
from curveline.rod.states.planar_states import find_states

from .rods import STIFFNESS, WEIGHT


def section(bend: float, twist: float, stretching: float = 1e7) -> Stock:
    """A section whose stiffnesses, sideways and in twist, are those multiples of a stiffness of 1 in the plane."""
    return Stock(stretching, 1e-3, 4.1e-4, 0.0, lateral_stiffness=bend, twisting_stiffness=twist)


def arch(chord: float, natural: float = 0.0) -> Equilibrium:
    rod = rod_between((chord, 0.0), 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, natural)
    return find_states(rod, 1e-7)[0]


def sideways(state: Equilibrium, of: Stock) -> Lateral:
    return lateral(state.but(rod=made_of(of, state.rod)))


@pytest.mark.parametrize(("ratio", "chord"), [(2 / 3, 0.4573269026), (3 / 4, 0.4284774434), (1.0, 1 / 3)])
def test_an_arch_leaves_its_plane_where_the_reference_says(ratio: float, chord: float) -> None:
    """Reference values, section D: the planar mode-1 arch of a rod as weak sideways as in the plane.

    Such a rod has a neutral mode besides, since it may turn about its chord; one stiffer sideways has none.
    """
    isotropic = section(1.0, ratio)
    far, near = (sideways(arch(chord - short), isotropic) for short in (0.02, 0.01))
    assert far.eigenvalue < near.eigenvalue < -near.uncertainty
    slope = (near.eigenvalue - far.eigenvalue) / 0.01
    assert chord - 0.01 - near.eigenvalue / slope == pytest.approx(chord, abs=3e-4)
    beyond = sideways(arch(chord + 0.01), isotropic)
    assert abs(beyond.eigenvalue) < beyond.uncertainty < 0.03
    assert sideways(arch(chord + 0.01), section(1.5, ratio)).stays


@pytest.mark.parametrize(
    ("rod", "bend", "twist"),
    [
        (rod_between((0.8, 0.0), 0.3, -0.2, 1.0, 0.0, 1.0, 3.0), 17.0, 1.2),
        (rod_between((0.4, 0.0), 0.3, -0.2, 1.0, 0.0, 1.0, 3.0, 2.0), 1.3, 1.2),
        (rod_between((0.6, 0.1), 0.5, 0.8, 1.0, 0.0, 1.0, 3.0, -4.0), 3.0, 0.3),
        (rod_between((0.45, 0.0), 0.0, 0.0, 1.0, 0.0, 1.0, 3.0, 8.0), 1.0, 0.5),
        (rod_between((0.7, 0.0), 0.2, 0.1, 1.0, 0.0, 1.0, 0.0, 0.0, ((0.4, 3.0, -8.0),)), 2.0, 0.7),
    ],
    ids=["strip", "naturally curved", "curved the other way", "far past the limit", "loaded"],
)
def test_the_eigenvalue_is_that_of_the_rod_in_space(rod: ClampedRod, bend: float, twist: float) -> None:
    state = find_states(rod, 1e-6)[0]
    mine = sideways(state, section(bend, twist))
    segment = made_of(section(bend, twist), rod)
    values = []
    for n in (48, 96):
        spatial, shape = lift(segment, state, n)
        values.append(lowest_mode(spatial, newton(spatial, shape).shape)[0])
    exact = values[1] + (values[1] - values[0]) / 3.0
    assert exact < state.lowest_eigenvalue, "the lowest mode lies in the plane: this row shows nothing"
    assert mine.eigenvalue == pytest.approx(exact, rel=0.012, abs=0.02)
    assert abs(mine.eigenvalue - exact) < mine.uncertainty + 0.003 * abs(exact)


def test_natural_curvature_counts_although_it_does_not_move_the_planar_rod() -> None:
    weak = section(1.0, 0.7)
    plain, curved = arch(0.5), arch(0.5, natural=6.0)
    assert curved.curve(65) == pytest.approx(plain.curve(65), abs=1e-7)
    assert abs(sideways(curved, weak).eigenvalue - sideways(plain, weak).eigenvalue) > 1.0


def test_the_built_in_rod_stays_in_its_plane_and_a_narrow_one_does_not() -> None:
    rod = rod_between((0.5, 0.0), 0.3, -0.3, 0.62, 0.02, STIFFNESS, WEIGHT)
    state = find_states(rod, 1e-4)[0]
    strip = Stock(58_800.0, 2.4e-3, 2.97e-3, WEIGHT, 0.49, 0.0355)
    assert sideways(state, strip).eigenvalue > 20.0
    assert not sideways(state, replace(strip, lateral_stiffness=0.0028, twisting_stiffness=0.0028)).stays
    assert np.isfinite(sideways(state, strip).uncertainty)
