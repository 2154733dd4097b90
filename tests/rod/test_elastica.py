"""Closed forms against published tables, the rod against closed forms, and the classical folds of clamped arches."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from curveline.rod.continuation import follow
from curveline.rod.elastica import Arc, Inflectional, clamped_arch, rectangular
from curveline.rod.equilibrium import ClampedRod, Equilibrium, Outcome, refine
from curveline.rod.planar import lowest_eigenvalue
from curveline.rod.problem import make_problem, mesh, released
from curveline.rod.states import find_states

from .rods import Level, distance, solve_level

# chord / L: P L^2 / EI, rise / L, energy L / EI of the first mode between level clamps, recomputed by shooting.
ARCHES = [
    (0.95, 40.4939706, 0.140110606, 1.999067895),
    (0.9, 41.57025579, 0.1949243114, 4.050408892),
    (0.8, 43.92916387, 0.266318588, 8.32293953),
    (0.7, 46.61212088, 0.314312613, 12.84702394),
    (0.5, 53.2741126, 0.3733064274, 22.80236705),
    (0.25, 65.44601573, 0.4022046409, 37.52599758),
]

SOLUTIONS: list[tuple[str, Inflectional | Arc]] = [
    *((f"arch-{chord}", clamped_arch(chord * 0.6, 0.6, 0.028)) for chord, *_ in ARCHES),
    *((f"arc-{angle}", Arc(math.radians(angle), 0.7, 0.028)) for angle in (-100.0, 5.0, 60.0, 120.0, 170.0)),
    ("rectangular", rectangular(0.7, 0.028)),
]


def rod_of(exact: Inflectional | Arc) -> ClampedRod:
    """The rod whose answer a closed form is."""
    start, end = exact.angles(np.array([0.0, exact.length]))
    x, y = exact.positions(np.array([exact.length]))[0]
    return ClampedRod((float(x), float(y)), float(start), float(end), exact.length, 0.0, exact.stiffness, 0.0)


def guess_of(exact: Inflectional | Arc, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Edge angles and multipliers of a closed form, to start Newton from."""
    middles = (np.arange(n) + 0.5) / n * exact.length
    return exact.angles(middles), -exact.clamp_force[1] * exact.length**2 / exact.stiffness


def solved(exact: Inflectional | Arc, tolerance: float) -> Equilibrium:
    return refine(rod_of(exact), np.full(24, 1 / 24), *guess_of(exact, 24), tolerance)


@pytest.mark.parametrize(("chord", "thrust", "rise", "energy"), ARCHES)
def test_clamped_arch_has_the_tabulated_thrust_rise_and_energy(
    chord: float, thrust: float, rise: float, energy: float
) -> None:
    arch = clamped_arch(chord, 1.0, 1.0)
    assert arch.thrust == pytest.approx(thrust, rel=1e-9)
    assert arch.energy == pytest.approx(energy, rel=1e-9)
    np.testing.assert_allclose(
        arch.positions(np.array([0.0, 0.5, 1.0])), [[0, 0], [chord / 2, rise], [chord, 0]], atol=1e-10
    )


def test_rectangular_elastica_carries_no_end_moment_and_stores_two_pi() -> None:
    exact = rectangular(1.0, 1.0)
    assert exact.angles(np.array([0.0, 1.0])) == pytest.approx([math.pi / 2, -math.pi / 2])
    assert exact.clamp_moment == pytest.approx([0.0, 0.0], abs=1e-14)
    assert exact.thrust == pytest.approx(13.750371636, rel=1e-10)
    assert exact.energy == pytest.approx(2.0 * math.pi, rel=1e-14)
    assert exact.positions(np.array([1.0]))[0] == pytest.approx([0.456946581, 0.0], abs=1e-9)


def test_arc_has_the_stated_moment_and_energy() -> None:
    exact = Arc(0.8, 1.0, 1.0)
    assert exact.clamp_moment == pytest.approx([1.6, -1.6])
    assert exact.energy == pytest.approx(2 * 0.8**2)
    assert exact.positions(np.array([1.0]))[0] == pytest.approx([math.sin(0.8) / 0.8, 0.0])


@pytest.mark.parametrize(("name", "exact"), SOLUTIONS)
def test_angle_curvature_and_position_of_a_closed_form_belong_together(name: str, exact: Inflectional | Arc) -> None:
    places = np.linspace(0.05, exact.length - 0.05, 40)
    step = 1e-6
    tangent = (exact.positions(places + step) - exact.positions(places - step)) / (2 * step)
    angles = exact.angles(places)
    np.testing.assert_allclose(tangent, np.column_stack([np.cos(angles), np.sin(angles)]), atol=1e-8)
    curvature = (exact.angles(places + step) - exact.angles(places - step)) / (2 * step)
    np.testing.assert_allclose(curvature, exact.curvature(places), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(("name", "exact"), SOLUTIONS)
def test_positions_of_a_closed_form_do_not_jump_at_quarter_periods(name: str, exact: Inflectional | Arc) -> None:
    for n in (32, 64, 128, 256):
        edges = np.linalg.norm(np.diff(exact.positions(np.linspace(0.0, exact.length, n + 1)), axis=0), axis=1)
        np.testing.assert_allclose(edges, exact.length / n, rtol=60.0 / n**2)


@pytest.mark.parametrize(("chord", "length"), [(1.0, 1.0), (1.1, 1.0), (-0.1, 1.0)])
def test_no_arch_over_a_chord_as_long_as_the_rod(chord: float, length: float) -> None:
    with pytest.raises(ValueError, match="does not arch"):
        clamped_arch(chord, length, 1.0)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-7])
@pytest.mark.parametrize(("name", "exact"), SOLUTIONS)
def test_the_rod_takes_the_closed_form(name: str, exact: Inflectional | Arc, tolerance: float) -> None:
    state = solved(exact, tolerance)
    assert state.outcome is Outcome.CONVERGED
    error = distance(state, exact.positions(np.linspace(0.0, exact.length, 201)))
    assert error <= state.error <= tolerance
    relative = 3e-4 if tolerance > 1e-5 else 2e-6
    unit = exact.stiffness / exact.length**2
    assert state.energy == pytest.approx(exact.energy, rel=relative)
    np.testing.assert_allclose(state.clamp_force, exact.clamp_force, rtol=0.0, atol=10 * relative * unit)
    np.testing.assert_allclose(
        state.clamp_moment, exact.clamp_moment, rtol=0.0, atol=10 * relative * unit * exact.length
    )
    assert state.stable


@pytest.mark.parametrize("angle", [5.0, 60.0, 120.0])
def test_an_arc_bends_evenly_and_needs_no_force(angle: float) -> None:
    exact = Arc(math.radians(angle), 0.7, 0.028)
    state = solved(exact, 1e-9)
    assert state.vertices_table[:, 3] == pytest.approx(exact.bend, rel=1e-7)
    assert abs(state.clamp_force).max() < 2e-6 * exact.stiffness / exact.length**2


def test_level_clamps_show_the_closed_form_and_its_mirror_image() -> None:
    arch = clamped_arch(0.5, 0.6, 1.0)
    peak, valley = find_states(rod_of(arch), 1e-6)
    curve = arch.positions(np.linspace(0.0, 0.6, 101))
    assert distance(peak, curve) < 1e-6
    assert distance(valley, curve * [1.0, -1.0]) < 1e-6


def extrapolated(coarse: float, fine: float) -> float:
    """Richardson's extrapolation of a second-order quantity from two levels, the second twice as fine."""
    return fine + (fine - coarse) / 3.0


def bisect(stable: Callable[[float], bool], low: float, high: float) -> float:
    """Where `stable`, true at `low` and false at `high`, changes."""
    assert stable(low)
    assert not stable(high)
    while high - low > 1e-10 * abs(high):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


def test_straight_clamped_rod_buckles_at_eulers_load() -> None:
    rod = ClampedRod((1.0, 0.0), 0.0, 0.0, 1.0, 0.0, 1.0, 0.0)

    def load(n: int) -> float:
        problem = released(make_problem(rod.scaled(), mesh(np.empty(0), n)))
        return bisect(
            lambda thrust: lowest_eigenvalue(problem, np.zeros(n), np.array([thrust, 0.0]), 1e-12) > 0.0, 30.0, 50.0
        )

    assert load(100) == pytest.approx(4.0 * math.pi**2, rel=1e-3)
    assert extrapolated(load(100), load(200)) == pytest.approx(4.0 * math.pi**2, rel=1e-7)


# wL^3 / EI: sag / L of a rod with L / chord = 1.2, clamped at the end angle of the catenary, by collocation.
CATENARIES = [(1e2, 0.2425168833), (1e3, 0.2432764397), (1e4, 0.2435747203)]
CATENARY_ANGLE = 0.9067746550


@pytest.mark.parametrize(("weight", "sag"), CATENARIES)
def test_heavy_rod_hangs_almost_like_a_catenary(weight: float, sag: float) -> None:
    rod = ClampedRod((1.0, 0.0), -CATENARY_ANGLE, CATENARY_ANGLE, 1.2, 0.0, 1.0, weight / 1.2**3)
    (valley,) = (state for state in find_states(rod, 1e-8) if state.name == "valley")
    assert valley.curve(3)[1] == pytest.approx([0.5, -1.2 * sag], abs=2e-8)
    assert valley.clamp_force[1, 1] == pytest.approx(0.5 * 1.2 * rod.weight, rel=1e-9)
    # The horizontal tension of the catenary, 0.39128 w L, is met in the limit.
    assert valley.clamp_force[1, 0] / (1.2 * rod.weight) == pytest.approx(0.3912846026, rel=5.0 / math.sqrt(weight))


# Slack dL / L of an arch; which multiples of alpha its ends turn; alpha sqrt(L / dL) at which the valley is lost.
FOLDS = [
    ("one end", 1e-3, (1.0, 0.0), 1.781830620),
    ("one end", 1e-2, (1.0, 0.0), 1.782313586),
    ("one end, L / chord = 1.2", 1 / 6, (1.0, 0.0), math.radians(41.81572612) * math.sqrt(6.0)),
    ("the other end", 1e-2, (0.0, -1.0), 1.782313586),
    ("both against the arch", 1e-3, (1.0, -1.0), 2.000189782),
    ("both against the arch", 1e-2, (1.0, -1.0), 2.001899818),
    ("both, L / chord = 1.32", 0.32 / 1.32, (1.0, -1.0), math.radians(57.73902789) * math.sqrt(1.32 / 0.32)),
]


def lost_at(slack: float, turned: tuple[float, float], n: int) -> float:
    """alpha sqrt(L / dL) at which a valley of n edges ceases to be stable while its ends turn by alpha `turned`."""
    arch = clamped_arch(1.0 - slack, 1.0, 1.0)
    phi, multipliers = guess_of(arch, n)
    begin = rod_of(arch)
    furthest = 2.3 * math.sqrt(slack)
    end = begin.pose._replace(start=turned[0] * furthest, end=turned[1] * furthest)
    branch = follow(begin.pose, end, begin.bearing, -phi, multipliers)
    assert 0.0 < branch.reached < 1.0
    return 2.3 * float(branch.reached)


@pytest.mark.parametrize(("name", "slack", "turned", "wanted"), FOLDS)
def test_turned_ends_snap_the_arch_where_published(
    name: str, slack: float, turned: tuple[float, float], wanted: float
) -> None:
    coarse, fine = lost_at(slack, turned, 100), lost_at(slack, turned, 200)
    assert coarse == pytest.approx(wanted, rel=2e-3)
    assert extrapolated(coarse, fine) == pytest.approx(wanted, rel=2e-6)


@pytest.mark.parametrize(("mu", "names", "eigenvalue"), [(1.95, ["peak", "valley"], None), (2.05, ["peak"], 1.327)])
def test_ends_turned_the_same_way_merge_both_arches_into_one_s(
    mu: float, names: list[str], eigenvalue: float | None
) -> None:
    slack = 1e-4
    angle = mu * math.sqrt(slack)
    rod = ClampedRod((1.0 - slack, 0.0), angle, angle, 1.0, 0.0, 1.0, 0.0)
    states = find_states(rod, 1e-9)
    assert len(states) == len(names)
    if eigenvalue is not None:
        assert states[0].lowest_eigenvalue == pytest.approx(eigenvalue, abs=1e-3)


def snap_load(at: float, n: int) -> float:
    """P L^2 / EI at which an arch of n edges with L / chord = 1.2 loses stability under a load down at `at`."""
    arch = clamped_arch(1.0 / 1.2, 1.0, 1.0)
    bare = rod_of(arch)

    def solve(load: float, near: tuple[np.ndarray, np.ndarray]) -> Level | None:
        rod = ClampedRod(bare.chord, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, loads=((at, 0.0, -load),))
        try:
            level = solve_level(rod, n, *near)
        except AssertionError:
            return None
        jumped = np.max(np.abs(level.phi - near[0])) > 0.2
        return level if level.unstable == 0 and not jumped else None

    load, step, state = 0.0, 4.0, guess_of(arch, n)
    while step > 1e-6:
        level = solve(load + step, state)
        if level is None:
            step *= 0.5
        else:
            load, state = load + step, (level.phi, level.multipliers)
    return load


@pytest.mark.parametrize(("at", "wanted"), [(0.5, 59.91928012574), (0.502, 56.3288800812)])
def test_load_on_an_arch_snaps_it_long_before_the_symmetric_fold(at: float, wanted: float) -> None:
    coarse, fine = snap_load(at, 100), snap_load(at, 200)
    assert coarse == pytest.approx(wanted, rel=2e-3)
    assert extrapolated(coarse, fine) == pytest.approx(wanted, rel=2e-6)
