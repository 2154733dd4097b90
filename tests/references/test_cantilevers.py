"""Section B: dead loads and weight (Bisshopp and Drucker 1945; Mattiasson 1981; Greenhill 1881)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from scipy.special import jv

from curveline.rod.problem import Array
from curveline.rod.states.planar_states import find_states

from .report import Report
from .rods import (
    Shape,
    bisect,
    cantilever,
    clamped,
    is_definite,
    middles,
    orders,
    relax,
    romberg,
    tip_angle,
    unit_rod,
)

LEVELS = [32, 64, 128, 256, 512]

# P L^2 / EI: tip angle, drop / L, shortening / L (Mattiasson 1981, recomputed by elliptic integrals).
TIP_LOADS = {
    0.2: (0.0996361630, 0.0663644821, 0.0026465483),
    0.5: (0.2445336471, 0.1621435757, 0.0159189625),
    1.0: (0.4613519497, 0.3017207738, 0.0564332363),
    2.0: (0.7817498316, 0.4934574804, 0.1606417208),
    5.0: (1.215368118, 0.7137915236, 0.3876283607),
    10.0: (1.430285539, 0.8106090249, 0.5549955978),
}

# w L^3 / EI: tip angle, drop / L, reach / L, drop / reach: the master curve of Romero et al. 2021, by shooting.
OWN_WEIGHTS = {
    1.0: (0.1651155605, 0.1234714020, 0.9912463953, 0.1245617664),
    5.0: (0.6970047775, 0.4959050446, 0.8466571800, 0.5857211825),
    10.0: (1.052643117, 0.7001997155, 0.6563537612, 1.066802320),
    20.0: (1.339501542, 0.8298814434, 0.4452320522, 1.863930144),
    50.0: (1.526453150, 0.9079171235, 0.2450147563, 3.705560992),
    100.0: (1.564107321, 0.9375239354, 0.1592233826, 5.888104623),
    300.0: (1.570740452, 0.9650063685, 0.0862913654, 11.18311622),
    1000.0: (1.570796322, 0.9811412706, 0.0459864534, 21.33544115),
}


@pytest.mark.parametrize("load", TIP_LOADS)
def test_a_tip_load_bends_a_cantilever_as_tabulated(load: float, against: Report) -> None:
    levels = []
    for n in LEVELS:
        shape = relax(cantilever(0.0, n, loads=((1.0, 0.0, -load),)), np.zeros(n))
        x, y = shape.positions[-1]
        levels.append([-tip_angle(shape), -y, 1.0 - x])
    against("B tip load", romberg(levels), TIP_LOADS[load], 3e-8)
    plain, better = orders(LEVELS[:4], levels[:4], romberg(levels))
    against("B tip load: order", plain, 2.0, 0.05)
    against("B tip load: order, extrapolated", better, 4.0, 0.075)


def collocated(weight: float) -> Array:
    """A row of `OWN_WEIGHTS` by a boundary value solver: angle' = bend, bend' = -w (1 - s) cos(angle)."""

    def slope(places: Array, state: Array) -> Array:
        angle, bend = state[:2]
        return np.array([bend, -weight * (1.0 - places) * np.cos(angle), np.cos(angle), np.sin(angle)])

    def ends(first: Array, last: Array) -> Array:
        return np.array([first[0], last[1], first[2], first[3]])

    places = np.linspace(0.0, 1.0, 2001)
    fade = np.exp(-math.sqrt(weight) * places)
    guess = np.array([0.5 * np.pi * (1.0 - fade), 0.5 * np.pi * math.sqrt(weight) * fade, 0.0 * places, places])
    solution = solve_bvp(slope, ends, places, guess, tol=1e-10, max_nodes=100_000)
    assert solution.success
    angle, _, x, drop = solution.y[:, -1]
    return np.array([angle, drop, x, drop / x])


@pytest.mark.parametrize("weight", OWN_WEIGHTS)
def test_its_own_weight_bends_a_cantilever_as_computed(weight: float, against: Report) -> None:
    levels = []
    counts = [4 * n for n in LEVELS]
    for n in counts:
        shape = relax(cantilever(0.0, n, weight=weight), np.zeros(n))
        x, y = shape.positions[-1]
        levels.append([-tip_angle(shape), -y, x, -y / x])
    # At 1000 the table's last digits are off by 3e-8: collocation, below, agrees with the discrete rod and not with it.
    against(f"B self weight{' 1000' if weight == 1000.0 else ''}", romberg(levels), OWN_WEIGHTS[weight], 4e-8)
    against("B self weight: by collocation", romberg(levels), collocated(weight), 1e-9)
    plain, better = orders(counts[:4], levels[:4], romberg(levels))
    against("B self weight: order", plain[1:], 2.0, 0.05)
    against("B self weight: order, extrapolated", better[1:], 4.0, 0.075)


# First zero of the Bessel function J of order -1/3.
BESSEL_ROOT = bisect(lambda z: bool(jv(-1.0 / 3.0, z) > 0.0), 1.0, 3.0)


def test_a_heavy_column_stands_up_to_greenhills_weight(against: Report) -> None:
    wanted = 2.25 * BESSEL_ROOT**2
    against("B heavy column: published digits", wanted, 7.837347439, 1e-10)
    counts = [16, 32, 64, 128, 256]

    def stands(n: int, weight: float) -> bool:
        return is_definite(cantilever(0.5 * math.pi, n, weight=weight), np.full(n, 0.5 * math.pi), np.zeros(2))

    weights = [bisect(lambda weight, n=n: stands(n, weight), 4.0, 12.0) for n in counts]
    against("B heavy column", romberg(weights), wanted, 1e-11)
    plain, better = orders(counts[:4], weights[:4], wanted)
    against("B heavy column: order", plain, 2.0, 0.05)
    against("B heavy column: order, extrapolated", better, 4.0, 0.075)


@pytest.mark.parametrize(("factor", "leans"), [(0.99, False), (1.01, True)])
def test_a_heavier_column_bends_a_lighter_one_straightens(factor: float, *, leans: bool) -> None:
    column = cantilever(0.5 * math.pi, 128, weight=7.837347439 * factor)
    shape = relax(column, 0.5 * math.pi + 0.3 * middles(128))
    assert shape.unstable == 0
    lean = tip_angle(shape) - 0.5 * math.pi
    assert lean > 0.1 if leans else abs(lean) < 1e-9


# Sag / L, angle at the ends, horizontal tension / (w L) of a chain with L / chord = 1.2.
CATENARY = (0.2436198313, 0.9067746550, 0.3912846026)
# w L^3 / EI: sag / L of a rod clamped at that angle, by collocation.
HEAVY = {1e2: 0.2425168833, 1e3: 0.2432764397, 1e4: 0.2435747203}


def hanging(weight: float, n: int) -> Shape:
    """A heavy rod between clamps at the catenary's end angle."""
    problem = clamped(unit_rod((1.0 / 1.2, 0.0), (-CATENARY[1], CATENARY[1]), weight=weight), n)
    return relax(problem, CATENARY[1] * (2.0 * middles(n) - 1.0))


@pytest.mark.parametrize("weight", HEAVY)
def test_a_heavy_rod_hangs_almost_like_a_chain(weight: float, against: Report) -> None:
    counts = [4 * n for n in LEVELS]
    sags = [-hanging(weight, n).positions[n // 2, 1] for n in counts]
    against("B catenary limit with EI", romberg(sags), HEAVY[weight], 1e-8)
    plain, better = orders(counts[:4], sags[:4], romberg(sags))
    against("B catenary limit with EI: order", plain, 2.0, 0.05)
    against("B catenary limit with EI: order, extrapolated", better, 4.0, 0.075)


def test_a_rod_without_stiffness_is_a_chain(against: Report) -> None:
    levels = []
    for n in LEVELS:
        bent = clamped(unit_rod((1.0 / 1.2, 0.0), (0.0, 0.0), weight=1.0), n)
        shape = relax(bent._replace(stiffness=np.zeros(n + 1)), CATENARY[1] * (2.0 * middles(n) - 1.0))
        levels.append([-shape.positions[n // 2, 1], 1.5 * shape.phi[-1] - 0.5 * shape.phi[-2], -shape.multipliers[0]])
    against("B catenary limit", romberg(levels), CATENARY, 2e-8)


@pytest.mark.parametrize("weight", HEAVY)
def test_the_search_finds_the_heavy_rod(weight: float, against: Report) -> None:
    rod = unit_rod((1.0 / 1.2, 0.0), (-CATENARY[1], CATENARY[1]), weight=weight)
    (valley,) = (state for state in find_states(rod, 1e-8) if state.name == "valley")
    against("B catenary limit with EI: found and refined", -valley.curve(3)[1, 1], HEAVY[weight], 1e-7)
    tension, lift = valley.clamp_force[1] / weight
    assert lift == pytest.approx(0.5, rel=1e-9)
    # The horizontal tension of the chain is met in the limit.
    assert tension == pytest.approx(CATENARY[2], rel=5.0 / math.sqrt(weight))
