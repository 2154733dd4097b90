"""Section C: where clamped arches snap, turned at their ends or loaded in the middle.

Angles alpha = mu sqrt(dL / L), loads P L^2 / EI = f sqrt(dL / L) for a rod that is longer than its chord by dL.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from curveline.rod.planar.elastica import clamped_arch
from curveline.rod.planar.modes import from_zero, lowest_eigenvalue
from curveline.rod.problem import Problem
from curveline.rod.states.planar_states import find_states

from .report import Report
from .rods import (
    Shape,
    bisect,
    branches_at,
    clamped,
    last_stable,
    middle_held,
    middles,
    orders,
    relax,
    romberg,
    solve,
    symmetric,
    unit_rod,
)

LEVELS = [32, 64, 128, 256, 512]

# How the ends turn, in multiples of alpha, by which the valley of level clamps is lost.
ONE_END = (1.0, 0.0)
AGAINST_THE_ARCH = (1.0, -1.0)

# dL / L: mu. Gomez, Moulton and Vella 2017 give 1.7818 in the shallow limit; the problem of both ends is Radisson and
# Kanso's of 2023. Digits by elliptic integrals.
TURNED = {
    ONE_END: {1e-4: 1.781781507, 1e-3: 1.781830620, 1e-2: 1.782313586, 1.0 / 6.0: 1.787691748},
    AGAINST_THE_ARCH: {1e-4: 2.000018976, 1e-3: 2.000189782, 1e-2: 2.001899818},
}
SHALLOW = {ONE_END: 1.781776041, AGAINST_THE_ARCH: 2.0}
# L / chord: degrees at which the valley of that rod is lost.
LOST_AT = {ONE_END: (1.2, 41.81572612), AGAINST_THE_ARCH: (1.32, 57.73902789)}
NAMES = {ONE_END: "one end", AGAINST_THE_ARCH: "both ends against the arch"}


def turned(slack: float, angles: tuple[float, float], n: int) -> Problem:
    """A rod longer than its chord by `slack` between clamps at `angles`."""
    return clamped(unit_rod((1.0 - slack, 0.0), angles), n)


def arch(slack: float, side: float, n: int) -> Shape:
    """The first mode between level clamps, above (1) or below (-1) its chord."""
    exact = clamped_arch(1.0 - slack, 1.0, 1.0)
    return solve(turned(slack, (0.0, 0.0), n), side * exact.angles(middles(n)), np.array([exact.thrust, 0.0]))


def lost_at(slack: float, ways: tuple[float, float], n: int) -> float:
    """mu at which the valley on n edges ceases to be stable while its ends turn `ways`."""
    unit = math.sqrt(slack)

    def at(mu: float) -> Problem:
        return turned(slack, (mu * unit * ways[0], mu * unit * ways[1]), n)

    start = arch(slack, -1.0, n)
    return last_stable(at, start, 0.0, 0.05) if ways == ONE_END else branches_at(at, 0, start, (1.7, 2.1))


CASES = [(ways, slack, mu) for ways, rows in TURNED.items() for slack, mu in rows.items()]


@pytest.mark.parametrize(("ways", "slack", "mu"), CASES)
def test_turned_ends_snap_an_arch(ways: tuple[float, float], slack: float, mu: float, against: Report) -> None:
    levels = [lost_at(slack, ways, n) for n in LEVELS]
    against(f"C {NAMES[ways]}", romberg(levels), mu, 1e-8)
    plain, better = orders(LEVELS[:3], levels[:3], romberg(levels))
    against(f"C {NAMES[ways]}: order", plain, 2.0, 0.05)
    against(f"C {NAMES[ways]}: order, extrapolated", better, 4.0, 0.075)


@pytest.mark.parametrize("ways", SHALLOW)
def test_the_shallow_limit_of_turned_ends(ways: tuple[float, float], against: Report) -> None:
    # The threshold grows linearly with dL / L, to the second order of which two values leave an error.
    coarse, fine = (romberg([lost_at(slack, ways, n) for n in LEVELS]) for slack in (2e-5, 1e-5))
    against(f"C {NAMES[ways]}: shallow limit", 2.0 * fine - coarse, SHALLOW[ways], 2e-9)


@pytest.mark.parametrize("ways", LOST_AT)
def test_the_angle_that_snaps_a_long_rod(ways: tuple[float, float], against: Report) -> None:
    ratio, degrees = LOST_AT[ways]
    slack = 1.0 - 1.0 / ratio
    mu = romberg([lost_at(slack, ways, n) for n in LEVELS])
    against(f"C {NAMES[ways]}: degrees, L / chord = {ratio}", np.degrees(mu * math.sqrt(slack)), degrees, 1e-9)


def test_a_symmetric_computation_stays_on_the_dead_branch() -> None:
    # Both ends against the arch: just past mu = 2 the symmetric valley is still an equilibrium, but no stable one.
    slack, n = 0.01, 128
    state = arch(slack, -1.0, n)
    for mu in np.linspace(0.0, 2.01, 68):
        problem = turned(slack, (mu * math.sqrt(slack), -mu * math.sqrt(slack)), n)
        state = solve(problem, state.phi, state.multipliers)
        np.testing.assert_allclose(state.phi, -state.phi[::-1], atol=1e-8)
    assert state.positions[n // 2, 1] < 0.0
    assert state.unstable == 1
    disturbed = relax(state.problem, state.phi + 1e-3 * np.sin(2.0 * np.pi * middles(n) + 0.3))
    assert disturbed.unstable == 0
    assert disturbed.positions[n // 2, 1] > 0.0


def s_shape(slack: float, mu: float, n: int) -> Shape:
    """The S between ends that both turn by alpha: symmetric to the middle point of its chord."""
    alpha = mu * math.sqrt(slack)
    problem = turned(slack, (alpha, alpha), n)
    guess = Shape(problem, alpha * np.cos(2.0 * np.pi * middles(n)), np.array([80.0, 0.0]), -1)
    shape = symmetric(problem, 1, guess)
    assert shape is not None
    return shape


def merged_at(slack: float, n: int) -> float:
    """mu at which the S becomes stable."""
    return bisect(lambda mu: s_shape(slack, mu, n).unstable == 1, 1.8, 2.2)


def test_ends_turned_the_same_way_merge_both_arches_into_one_s(against: Report) -> None:
    coarse, fine = (romberg([merged_at(slack, n) for n in LEVELS]) for slack in (2e-5, 1e-5))
    against("C both ends the same way: shallow limit", 2.0 * fine - coarse, 2.0, 2e-9)
    levels = [merged_at(1e-4, n) for n in LEVELS]
    plain, better = orders(LEVELS[:3], levels[:3], romberg(levels))
    against("C both ends the same way: order", plain, 2.0, 0.05)
    against("C both ends the same way: order, extrapolated", better, 4.0, 0.075)


@pytest.mark.parametrize(("mu", "eigenvalue"), [(1.95, -1.305), (2.05, 1.327)])
def test_the_s_gains_stability_by_as_much_as_it_lacked(mu: float, eigenvalue: float, against: Report) -> None:
    shapes = [s_shape(1e-4, mu, n) for n in LEVELS]
    values = [lowest_eigenvalue(shape.problem, shape.phi, shape.multipliers, from_zero(), 1e-9) for shape in shapes]
    against("C both ends the same way: lowest eigenvalue", romberg(values), eigenvalue, 5e-4)


def test_the_arches_become_the_s_without_a_jump_and_leave_it_alone() -> None:
    # Near the threshold, coarse edges hold the S for stable although it is not.
    slack, heights = 1e-2, []
    threshold = float(romberg([merged_at(slack, n) for n in LEVELS]))
    for left in (0.04, 0.01, 0.0025, -0.0025, -0.04):
        alpha = (threshold - left) * math.sqrt(slack)
        states = find_states(unit_rod((1.0 - slack, 0.0), (alpha, alpha)), 1e-8)
        assert len(states) == (2 if left > 0.0 else 1)
        heights.append(abs(states[0].curve(3)[1, 1]))
    # A pitchfork: the rise over the S shrinks with the square root of what is left to turn.
    assert heights[1] / heights[0] == pytest.approx(0.5, rel=0.02)
    assert heights[2] / heights[1] == pytest.approx(0.5, rel=0.02)
    assert max(heights[3:]) < 1e-8


# dL / L: f at which the arch under a centre load loses stability to an antisymmetric mode, and at which the symmetric
# arch folds. The problem of Vangbo 1998, Camescasse et al. 2013 and Pandey et al. 2014; digits by elliptic integrals.
CENTRE = {1e-4: (129.5391, 549.966), 1e-3: (129.6193, 550.144)}
CENTRE_SHALLOW = (129.5302149, 549.9467317)
CENTRE_LONG = (59.91928012574, 240.3135)
OFF_CENTRE = 56.3289
LONG = 1.0 - 1.0 / 1.2


def loaded(slack: float, at: float, n: int, load: float) -> Problem:
    """Level clamps and a dead load down at the fraction `at` of the length."""
    return clamped(unit_rod((1.0 - slack, 0.0), (0.0, 0.0), loads=((at, 0.0, -load),)), n, at=at)


def lowered(slack: float, n: int, height: float) -> Shape:
    """The symmetric arch whose middle is held at `height` times its rise without load, by the third multiplier."""
    free = arch(slack, 1.0, n)
    rise = free.positions[n // 2, 1]
    shape = free._replace(multipliers=np.append(free.multipliers, 0.0))
    for part in np.linspace(1.0, height, 30):
        shape = solve(middle_held(free.problem, 1, part * rise), shape.phi, shape.multipliers)
    return shape


def symmetric_limit(slack: float, n: int) -> float:
    """P L^2 / EI that the symmetric arch bears at most: the largest force on its way down."""
    best = minimize_scalar(
        lambda height: -lowered(slack, n, float(height)).multipliers[2], bounds=(0.05, 0.9), method="bounded"
    )
    return -float(best.fun)


def bifurcation(slack: float, n: int) -> float:
    """P L^2 / EI at which the symmetric arch ceases to be stable."""
    bracket = (100.0 * math.sqrt(slack), 160.0 * math.sqrt(slack))
    return branches_at(lambda load: loaded(slack, 0.5, n, load), 0, arch(slack, 1.0, n), bracket)


def centre_loads(slack: float) -> tuple[list[float], list[float]]:
    """Both limits of the centre load per level."""
    return [bifurcation(slack, n) for n in LEVELS], [symmetric_limit(slack, n) for n in LEVELS]


def test_under_a_centre_load_too_a_symmetric_computation_stays_on_the_dead_branch() -> None:
    # Loaded up to twice the snap load, Newton keeps to the symmetric arch; a small disturbance takes it to the valley.
    slack, n = 1e-3, 128
    unit = math.sqrt(slack)
    state = arch(slack, 1.0, n)
    for load in np.linspace(0.0, 2.0 * CENTRE_SHALLOW[0] * unit, 60):
        state = solve(loaded(slack, 0.5, n, float(load)), state.phi, state.multipliers)
        assert state.unstable == (load > CENTRE_SHALLOW[0] * unit)
        np.testing.assert_allclose(state.phi, -state.phi[::-1], atol=1e-8)
    assert state.positions[n // 2, 1] > 0.0
    disturbed = relax(state.problem, state.phi + 1e-3 * np.sin(2.0 * np.pi * middles(n) + 0.3))
    assert disturbed.unstable == 0
    assert disturbed.positions[n // 2, 1] < 0.0


@pytest.mark.parametrize("slack", CENTRE)
def test_a_centre_load_snaps_a_shallow_arch_sideways(slack: float, against: Report) -> None:
    for name, levels, wanted in zip(("snap", "symmetric fold"), centre_loads(slack), CENTRE[slack], strict=True):
        against(f"C centre load: {name}", romberg(levels) / math.sqrt(slack), wanted, 1e-6)
        plain, better = orders(LEVELS[:3], levels[:3], romberg(levels))
        against("C centre load: order", plain, 2.0, 0.05)
        against("C centre load: order, extrapolated", better, 4.0, 0.075)


def test_the_shallow_limit_of_the_centre_load(against: Report) -> None:
    slacks = (2e-5, 1e-5)
    coarse, fine = (
        np.array([romberg(levels) for levels in centre_loads(slack)]) / math.sqrt(slack) for slack in slacks
    )
    limit = 2.0 * fine - coarse
    against("C centre load: shallow limit", limit, CENTRE_SHALLOW, 1e-8)
    # In units of EI h / L^3 with the rise h = (2 / pi) sqrt(dL L).
    against("C centre load: shallow limit over the rise", limit[0] * 0.5 * math.pi, 203.4655858, 1e-8)


def test_a_centre_load_snaps_a_long_arch(against: Report) -> None:
    snap, fold = centre_loads(LONG)
    against("C centre load, L / chord = 1.2: snap", romberg(snap), CENTRE_LONG[0], 1e-9)
    against("C centre load, L / chord = 1.2: symmetric fold", romberg(fold), CENTRE_LONG[1], 3e-7)


def test_a_load_off_centre_snaps_it_earlier(against: Report) -> None:
    loads = [last_stable(lambda load, n=n: loaded(LONG, 0.502, n, load), arch(LONG, 1.0, n), 0.0, 4.0) for n in LEVELS]
    against("C centre load, L / chord = 1.2: 0.2 % off centre", romberg(loads), OFF_CENTRE, 1e-6)
