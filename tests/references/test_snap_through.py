"""Section C: where clamped arches snap, turned at their ends or loaded in the middle.

Angles alpha = mu sqrt(dL / L), loads P L^2 / EI = f sqrt(dL / L) for a rod that is longer than its chord by dL.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from curveline.rod.elastica import clamped_arch
from curveline.rod.planar import lowest_eigenvalue
from curveline.rod.problem import Array, Problem
from curveline.rod.states import find_states

from .report import Report
from .rods import (
    Shape,
    bisect,
    clamped,
    is_definite,
    last_stable,
    middles,
    orders,
    relax,
    romberg,
    solve,
    unit_rod,
)

LEVELS = [32, 64, 128, 256]

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

    return last_stable(at, arch(slack, -1.0, n), 0.0, 0.05)


CASES = [(ways, slack, mu) for ways, rows in TURNED.items() for slack, mu in rows.items()]


@pytest.mark.parametrize(("ways", "slack", "mu"), CASES)
def test_turned_ends_snap_an_arch(ways: tuple[float, float], slack: float, mu: float, against: Report) -> None:
    levels = [lost_at(slack, ways, n) for n in LEVELS]
    print(ways, slack, levels, romberg(levels) / mu - 1, orders(LEVELS, levels, mu))
    against(f"C {NAMES[ways]}", romberg(levels), mu, 1e-8)
    plain, better = orders(LEVELS[:3], levels[:3], romberg(levels))
    against(f"C {NAMES[ways]}: order", plain, 2.0, 0.05)
    against(f"C {NAMES[ways]}: order, extrapolated", better, 4.0, 0.075)
