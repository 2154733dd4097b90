"""Section A: closed forms of the planar rod without weight (Euler 1744; Timoshenko and Gere 1961; Born 1906)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from curveline.rod.planar.elastica import clamped_arch
from curveline.rod.problem import Array, Problem, sharpest_turn

from .report import Report
from .rods import (
    Shape,
    bisect,
    cantilever,
    clamped,
    held,
    is_definite,
    middles,
    orders,
    pinned,
    romberg,
    solve,
    tip_angle,
    try_solve,
    unit_rod,
)

LEVELS = [32, 64, 128, 256, 512]

# Smallest positive root of tan z = z.
TANGENT_ROOT = float(brentq(lambda z: math.sin(z) - z * math.cos(z), 4.0, 4.6, xtol=1e-15))

# Supports: first end turns, last end turns, last end held across; P L^2 / EI (Timoshenko and Gere 1961, chapter 2).
EULER = {
    "fixed-free": (math.pi**2 / 4.0, (-1,), ()),
    "pinned": (math.pi**2, (0, -1), (1,)),
    "clamped-pinned": (TANGENT_ROOT**2, (-1,), (1,)),
    "clamped": (4.0 * math.pi**2, (), (1,)),
}

# chord / L: P L^2 / EI, rise / L, energy L / EI of the first mode between level clamps.
ARCHES = {
    0.95: (40.4939706, 0.140110606, 1.999067895),
    0.9: (41.57025579, 0.1949243114, 4.050408892),
    0.8: (43.92916387, 0.266318588, 8.32293953),
    0.7: (46.61212088, 0.314312613, 12.84702394),
    0.5: (53.2741126, 0.3733064274, 22.80236705),
    0.25: (65.44601573, 0.4022046409, 37.52599758),
}


def column(n: int, turning: tuple[int, ...], axes: tuple[int, ...], thrust: float) -> Problem:
    """A straight rod under a dead thrust at its last end."""
    bare = clamped(unit_rod((1.0, 0.0), (0.0, 0.0), loads=((1.0, -thrust, 0.0),)), n)
    return held(pinned(bare, *turning), *axes)


@pytest.mark.parametrize("support", EULER)
def test_a_straight_rod_loses_definiteness_at_eulers_load(support: str, against: Report) -> None:
    wanted, turning, axes = EULER[support]

    def stands(n: int, thrust: float) -> bool:
        return is_definite(column(n, turning, axes, thrust), np.zeros(n), np.zeros(2))

    counts = [8, 16, 32, 64, 128]
    loads = [bisect(lambda thrust, n=n: stands(n, thrust), 0.5 * wanted, 1.5 * wanted) for n in counts]
    against("A Euler loads", romberg(loads), wanted, 1e-11)
    plain, better = orders(counts[:4], loads[:4], wanted)
    against("A Euler loads: order", plain, 2.0, 0.01)
    against("A Euler loads: order, extrapolated", better, 4.0, 0.01)


def test_the_clamped_pinned_load_is_the_published_one(against: Report) -> None:
    against("A Euler loads: published digits", TANGENT_ROOT**2, 20.19072856, 3e-10)


@pytest.mark.parametrize("chord", ARCHES)
def test_the_closed_form_of_the_first_clamped_mode_is_the_tabulated_one(chord: float, against: Report) -> None:
    arch = clamped_arch(chord, 1.0, 1.0)
    thrust, rise, energy = ARCHES[chord]
    against("A clamped mode 1: closed form", [arch.thrust, arch.energy], [thrust, energy], 1e-9)
    ends = arch.positions(np.array([0.0, 0.5, 1.0]))
    against("A clamped mode 1: closed form", ends, [[0.0, 0.0], [0.5 * chord, rise], [chord, 0.0]], 1e-10, scale=1.0)


def clamped_mode(chord: float, n: int) -> Shape:
    """The first mode between level clamps on n edges."""
    exact = clamped_arch(chord, 1.0, 1.0)
    problem = clamped(unit_rod((chord, 0.0), (0.0, 0.0)), n)
    return solve(problem, exact.angles(middles(n)), np.array([exact.thrust, 0.0]))


@pytest.mark.parametrize("chord", ARCHES)
def test_thrust_rise_and_energy_of_the_first_clamped_mode(chord: float, against: Report) -> None:
    shapes = [clamped_mode(chord, n) for n in LEVELS]
    levels = [
        [shape.multipliers[0], shape.positions[n // 2, 1], shape.energy]
        for n, shape in zip(LEVELS, shapes, strict=True)
    ]
    assert all(shape.unstable == 0 for shape in shapes)
    against("A clamped mode 1", romberg(levels), ARCHES[chord], 1e-9)
    plain, better = orders(LEVELS[:4], levels[:4], romberg(levels))
    against("A clamped mode 1: order", plain, 2.0, 0.05)
    against("A clamped mode 1: order, extrapolated", better, 4.0, 0.075)


@pytest.mark.parametrize("degrees", [5.0, 60.0, 120.0, 170.0])
def test_a_circular_arc_bends_evenly_without_force(degrees: float, against: Report) -> None:
    angle = math.radians(degrees)
    levels = []
    for n in LEVELS:
        problem = clamped(unit_rod((math.sin(angle) / angle, 0.0), (angle, -angle)), n)
        shape = solve(problem, angle * (1.0 - 2.0 * middles(n)), np.zeros(2))
        assert shape.unstable == 0
        levels.append([*shape.multipliers, *shape.moments, shape.energy, *shape.curvature[n // 8 - 1 :: n // 8]])
    limit = romberg(levels)
    against("A circular arc: end force", limit[:2], 0.0, 1e-9, scale=4.0 * angle**2)
    against("A circular arc: end moments", limit[2:4], -2.0 * angle, 1e-10)
    against("A circular arc: curvature", limit[5:], -2.0 * angle, 1e-10)
    against("A circular arc: energy", limit[4], 2.0 * angle**2, 1e-10)


def moment_loaded(moment: float, n: int) -> Shape:
    """A cantilever under a dead end moment: a spring far softer than the rod, wound up until it gives the moment."""
    soft = 1e-12
    free = cantilever(0.0, n)
    stiffness = free.stiffness.copy()
    stiffness[-1] = soft
    problem = free._replace(stiffness=stiffness, ends=np.array([0.0, moment / soft]))
    return solve(problem, moment * middles(n) * 0.9, np.zeros(2))


@pytest.mark.parametrize(("turns", "tip"), [(0.5, (0.0, 2.0 / math.pi)), (1.0, (0.0, 0.0))])
def test_an_end_moment_rolls_a_cantilever_up(turns: float, tip: tuple[float, float], against: Report) -> None:
    shapes = [moment_loaded(2.0 * math.pi * turns, n) for n in LEVELS]
    against("A pure moment roll-up: tip", romberg([shape.positions[-1] for shape in shapes]), tip, 1e-10, scale=1.0)
    for shape in shapes:
        against("A pure moment roll-up: curvature", shape.curvature, 2.0 * math.pi * turns, 1e-9)
        assert shape.unstable == 0


def half_loop(n: int) -> Shape:
    """Half of a pinned rod whose ends meet: clamped along x, its tip held level with the clamp, free to turn."""
    bare = clamped(unit_rod((0.0, 0.0), (0.0, 0.0)), n)
    problem = held(pinned(bare, -1), 0)
    guess = math.radians(130.0) * np.sin(0.5 * np.pi * middles(n))
    return solve(problem, guess, np.array([5.0]))


def test_the_ends_of_a_pinned_rod_meet(against: Report) -> None:
    shapes = [half_loop(n) for n in LEVELS]
    # Half the length: a quarter of Euler's pinned load, pi^2, in the units of the half.
    levels = [[math.degrees(tip_angle(shape)), 4.0 * shape.multipliers[0] / math.pi**2] for shape in shapes]
    against("A ends meet", romberg(levels), [130.7099107, 2.183379046], 1e-9)
    plain, better = orders(LEVELS[:4], levels[:4], romberg(levels))
    against("A ends meet: order", plain, 2.0, 0.05)
    against("A ends meet: order, extrapolated", better, 4.0, 0.075)


def test_that_thrust_as_a_dead_load_brings_the_ends_together(against: Report) -> None:
    thrust = 2.183379046 * math.pi**2 / 4.0
    tips = []
    for n in LEVELS:
        problem = cantilever(0.0, n, loads=((1.0, -thrust, 0.0),))
        shape = solve(problem, half_loop(n).phi, np.zeros(2))
        assert shape.unstable == 0
        tips.append(shape.positions[-1, 0])
    against("A ends meet: gap under the dead load", romberg(tips), 0.0, 1e-9, scale=1.0)


def rectangular(n: int, *turning: int) -> Shape:
    """The rectangular elastica between clamps at +-90 deg, or with ends that turn freely."""
    bare = clamped(unit_rod((0.456946581, 0.0), (0.5 * math.pi, -0.5 * math.pi)), n)
    return solve(pinned(bare, *turning), 0.5 * np.pi * np.cos(np.pi * middles(n)), np.array([13.0, 0.0]))


@pytest.mark.parametrize("turning", [(), (0, -1)], ids=["clamped", "pinned"])
def test_the_rectangular_elastica_stores_two_pi(turning: tuple[int, ...], against: Report) -> None:
    shapes = [rectangular(n, *turning) for n in LEVELS]
    levels = [[shape.multipliers[0], shape.energy, *shape.moments] for shape in shapes]
    limit = romberg(levels)
    against("A rectangular elastica", limit[:2], [13.750371636, 2.0 * math.pi], 5e-9)
    against("A rectangular elastica: end moments", limit[2:], 0.0, 1e-8, scale=2.0 * math.pi)
    assert all(shape.unstable == 0 for shape in shapes)


def test_pinned_ends_of_the_rectangular_elastica_stand_at_right_angles(against: Report) -> None:
    angles = [math.degrees(tip_angle(rectangular(n, 0, -1))) for n in LEVELS]
    against("A rectangular elastica: free end angle", romberg(angles), -90.0, 1e-8)


def inflections(phi: Array) -> int:
    """Changes of sign of the curvature inside the rod."""
    bends = np.diff(phi)
    return int(np.count_nonzero(bends[1:] * bends[:-1] < 0.0))


def equilibria(count: int) -> list[tuple[int, int]]:
    """Inflections and unstable directions of well resolved equilibria met by Newton from random waves."""
    rng = np.random.default_rng(7)
    met = []
    for _ in range(count):
        chord = (float(rng.uniform(0.3, 0.97)), float(rng.uniform(-0.2, 0.2)))
        start, end = (float(angle) for angle in rng.uniform(-3.0, 3.0, 2))
        problem = clamped(unit_rod(chord, (start, end)), 128)
        waves = np.sin(np.pi * np.outer(np.arange(1, 7), middles(128)))
        guess = start + (end - start) * middles(128) + rng.normal(0.0, 0.8, 6) @ waves
        shape = try_solve(problem, guess, np.array([rng.uniform(0.0, 200.0), 0.0]))
        if shape is not None and sharpest_turn(problem, shape.phi) < 0.25:
            met.append((inflections(shape.phi), shape.unstable))
    return met


def test_inflections_tell_stable_from_unstable(against: Report) -> None:
    met = equilibria(3000)
    unbent = [unstable == 0 for count, unstable in met if count == 0]
    thrice = [unstable == 0 for count, unstable in met if count >= 3]
    assert min(len(unbent), len(thrice)) >= 100
    against("A no inflection: share that is stable", np.mean(unbent), 1.0, 0.0)
    against("A three inflections: share that is stable", np.mean(thrice), 0.0, 0.0, scale=1.0)
