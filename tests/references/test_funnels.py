"""Section F, funnels 1 to 4: what every build must pass, with the solver as it is used."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from curveline.rod.branches.continuation import follow
from curveline.rod.branches.control_path import straight_path
from curveline.rod.planar.elastica import Arc, Inflectional, clamped_arch
from curveline.rod.problem import Problem
from curveline.rod.states.planar_states import find_states
from rod.rods import REFERENCE, reference_rod, simple
from rod.test_elastica import SOLUTIONS, guess_of, rod_of
from rod.test_reference import PLAIN, by_name, curve_of

from .report import Report
from .rods import Shape, clamped, last_stable, middles, orders, relax, romberg, solve, unit_rod

LEVELS = [32, 64, 128, 256]


def misses(exact: Inflectional | Arc, n: int) -> list[float]:
    """Largest error of the vertices / L and relative error of the energy of n edges, without extrapolation."""
    rod = rod_of(exact)
    chord = (rod.chord[0] / rod.length, rod.chord[1] / rod.length)
    shape = solve(clamped(unit_rod(chord, (rod.start, rod.end)), n), *guess_of(exact, n))
    places = np.linspace(0.0, exact.length, n + 1)
    gaps = np.linalg.norm(shape.positions - exact.positions(places) / exact.length, axis=1)
    return [float(gaps.max()), abs(shape.energy * exact.stiffness / exact.length / exact.energy - 1.0)]


@pytest.mark.parametrize(("name", "exact"), SOLUTIONS)
def test_gate_1_shape_and_energy_converge_with_order_two(name: str, exact: Inflectional | Arc, against: Report) -> None:
    levels = [misses(exact, n) for n in LEVELS]
    plain, _ = orders(LEVELS, levels, 0.0)
    # An arc needs no end force, so that its energy does not feel the second-order error of the chord.
    against("F funnel 1: order of shape and energy", plain, [2.0, 4.0 if isinstance(exact, Arc) else 2.0], 0.05)
    against("F funnel 1: shape error / L, 64 edges", levels[1][0], 0.0, 1e-3, scale=1.0)
    against("F funnel 1: energy error, 64 edges", levels[1][1], 0.0, 5e-3, scale=1.0)


@pytest.mark.parametrize("case", PLAIN, ids=lambda case: case["id"])
def test_gate_2_all_reference_cases(case: dict[str, Any], against: Report) -> None:
    rod = reference_rod(case)
    states = {state.name: state for state in simple(find_states(rod, 1e-7))}
    answers = by_name(case)
    against("F funnel 2: number of states", len(states), case["n_stable_simple"], 0.0)
    for name, answer in answers.items():
        state, curve = states[name], curve_of(answer)
        gaps = np.linalg.norm(state.curve(len(curve)) - curve, axis=1)
        against("F funnel 2: RMS shape error / L", np.sqrt(np.mean(gaps**2)) / rod.length, 0.0, 1e-7, scale=1.0)
        against("F funnel 2: sign of stability", np.sign(state.lowest_eigenvalue), np.sign(answer["lam_min_L2"]), 0.0)
        force = np.array(answer["internal_force_end"])
        against("F funnel 2: end force", state.clamp_force[1], force, 1e-5, scale=np.hypot(*force))


def loaded(case: dict[str, Any], at: float, n: int, load: float) -> Problem:
    """The rod of a case under a dead load, in the case's units, at the fraction `at` of its length."""
    x, y = case["direction"]
    unit = case["L"] ** 2 * load
    rod = unit_rod(
        (case["x2"] / case["L"], case["y"] / case["L"]),
        (case["theta1"], case["theta2"]),
        loads=((at, unit * x, unit * y),),
    )
    return clamped(rod, n, at=at)


def peak_of(case: dict[str, Any], at: float, n: int) -> Shape:
    """The state above the chord, without load."""
    slope = math.atan2(case["y"], case["x2"])
    return relax(loaded(case, at, n, 0.0), slope + 1.2 * np.sin(2.0 * np.pi * middles(n)))


def snap_load(case: dict[str, Any], at: float) -> float:
    """The dead load at which the peak ceases to be stable, extrapolated."""
    return float(
        romberg(
            [
                last_stable(lambda load, n=n: loaded(case, at, n, load), peak_of(case, at, n), 0.0, 12.0)
                for n in (64, 128, 256, 512)
            ]
        )
    )


@pytest.mark.parametrize("case", REFERENCE["load"], ids=lambda case: case["id"])
def test_gate_3_snap_loads(case: dict[str, Any], against: Report) -> None:
    against(f"F funnel 3: snap load {case['id']}", snap_load(case, case["s_fraction"]), case["P_snap"], 1e-7)


def test_gate_3_an_imperfect_s1_snaps_earlier(against: Report) -> None:
    case = REFERENCE["load"][0]
    by_two = snap_load(case, 0.502)
    against("F funnel 3: snap load S1, 0.2 % off centre", by_two, case["P_snap_with_s_plus_0.002"], 1e-8)
    # The load that a small imperfection takes away grows with its power 2/3 (Koiter).
    missing = case["P_snap"] - np.array([snap_load(case, 0.5005), snap_load(case, 0.501)])
    against("F funnel 3: power of a small imperfection", math.log2(missing[1] / missing[0]), 2.0 / 3.0, 0.05)


# Slack dL / L of a valley, which multiples of alpha its ends turn, degrees or mu = alpha sqrt(L / dL) that lose it.
TURNS = [
    ("one end, L / chord = 1.2", 1.0 / 6.0, (1.0, 0.0), math.radians(41.81572612) * math.sqrt(6.0)),
    ("both ends, L / chord = 1.32", 0.32 / 1.32, (1.0, -1.0), math.radians(57.73902789) * math.sqrt(1.32 / 0.32)),
    ("one end, dL / L = 0.01", 1e-2, (1.0, 0.0), 1.782313586),
    ("other end, dL / L = 0.01", 1e-2, (0.0, -1.0), 1.782313586),
    ("both ends, dL / L = 0.01", 1e-2, (1.0, -1.0), 2.001899818),
    ("both ends, dL / L = 0.001", 1e-3, (1.0, -1.0), 2.000189782),
]


def followed_to(slack: float, ways: tuple[float, float], n: int) -> float:
    """mu at which `follow` loses a valley of n edges while its ends turn."""
    arch = clamped_arch(1.0 - slack, 1.0, 1.0)
    phi, multipliers = guess_of(arch, n)
    begin = rod_of(arch)
    furthest = 2.3 * math.sqrt(slack)
    end = begin.pose._replace(start=ways[0] * furthest, end=ways[1] * furthest)
    branch = follow(straight_path(begin.pose, end), begin.bearing, -phi, multipliers)
    assert 0.0 < branch.reached < 1.0
    return 2.3 * float(branch.reached)


@pytest.mark.parametrize(("name", "slack", "ways", "wanted"), TURNS)
def test_gate_4_slow_rotation_snaps_at_the_fold(
    name: str, slack: float, ways: tuple[float, float], wanted: float, against: Report
) -> None:
    against(f"F funnel 4: {name}", romberg([followed_to(slack, ways, n) for n in (100, 200)]), wanted, 2e-6)
