"""Section C and the load cases through the package's own continuation: snap-through, folds, force and deflection."""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.interpolate import BarycentricInterpolator

from clamped_rods import changed, rod_between
from curveline.rod.branches.arclength import TraceReach, begin_at, trace
from curveline.rod.branches.continuation import start_along
from curveline.rod.branches.control_path import ControlPath, counts_along, loading, problem_at, straight_path
from curveline.rod.branches.special_points import FOLD_POINT, SpecialKind, critical, next_special_point
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.problem import Array, refine_angles
from curveline.rod.states.equilibrium import Equilibrium, Outcome, refine
from curveline.rod.states.planar_states import find_states
from rod.rods import REFERENCE, reference_rod

from .report import Report
from .rods import romberg

CASES = {case["id"]: case for case in REFERENCE["load"]}
EDGES = 48
FINEST = 384


def press(rod: ClampedRod, at: float, force: tuple[float, float]) -> ControlPath:
    """The way on which a force at a fraction of the length grows from nothing."""
    way: ControlPath = loading(rod.pose, np.array([at]), np.zeros((1, 2)), np.array([force]))
    return way


def case_way(case: dict[str, Any], load: float, off: float = 0.0) -> ControlPath:
    """The way on which the load of a case grows to `load`."""
    x, y = case["direction"]
    return press(reference_rod(case), case["s_fraction"] + off, (load * x, load * y))


@cache
def state_of(rod: ClampedRod, name: str) -> Equilibrium:
    return next(state for state in find_states(rod, 1e-9) if state.name == name)


def above(case: dict[str, Any]) -> Equilibrium:
    return state_of(reference_rod(case), "peak")


@pytest.mark.parametrize("name", CASES)
def test_where_and_how_a_loaded_state_is_lost(name: str, against: Report) -> None:
    case = CASES[name]
    load = 1.5 * case["P_snap"]
    way = case_way(case, load)
    point = critical(way, reference_rod(case).bearing, *start_along(way, above(case)), 1e-9)
    assert point.kind.value == case["kind"]
    against(f"load {name}: snap-through", point.fraction * load, case["P_snap"], 2e-9)
    assert abs(point.fraction * load - case["P_snap"]) < point.error * load + 1e-9 * case["P_snap"]


def test_the_load_of_s1_off_its_centre(against: Report) -> None:
    case = CASES["S1"]
    wanted = case["P_snap_with_s_plus_0.002"]
    way = case_way(case, 1.5 * wanted, 0.002)
    point = critical(way, reference_rod(case).bearing, *start_along(way, above(case)), 1e-9)
    assert point.kind is SpecialKind.FOLD
    against("load S1: 0.2 % off centre", point.fraction * 1.5 * wanted, wanted, 2e-9)
    against("C centre load, followed: 0.2 % off", point.fraction * 1.5 * wanted * case["L"] ** 2, 56.3289, 1e-6)


def test_a_centre_load_takes_stability_by_a_bifurcation(against: Report) -> None:
    rod = rod_between((1.0 / 1.2, 0.0), 0.0, 0.0, 1.0, 0.0, 1.0, 0.0)
    way = press(rod, 0.5, (0.0, -100.0))
    point = critical(way, rod.bearing, *start_along(way, state_of(rod, "peak")), 1e-10)
    assert point.kind is SpecialKind.BIFURCATION
    against("C centre load, followed: bifurcation", 100.0 * point.fraction, 59.91928012574, 1e-9)


def folds_on(case: dict[str, Any], load: float, edges: int) -> float:
    """Load of the first fold of a case's branch, stable there or not, on a number of edges."""
    way, rod = case_way(case, load), reference_rod(case)
    phi, multipliers = start_along(way, above(case), EDGES)
    if case["kind"] == SpecialKind.BIFURCATION.value:
        phi = 0.5 * (phi - phi[::-1])
    counts = counts_along(way, rod.bearing, EDGES)
    while counts.sum() < edges:
        phi = refine_angles(problem_at(way, rod.bearing, 0.0, counts), phi, 2)
        counts = 2 * counts
    _, here = begin_at(way, rod.bearing, counts, 0.0, phi, multipliers)
    for _ in range(6):
        what, point, _, here = next_special_point(way, rod.bearing, counts, here, 2.0)
        if what == FOLD_POINT:
            return load * float(point[-1])
    raise AssertionError(case["id"])


@pytest.mark.parametrize("name", CASES)
def test_the_fold_lies_on_the_branch_traced_on_past_the_bifurcation(name: str, against: Report) -> None:
    case = CASES[name]
    fold = romberg([folds_on(case, case["P_fold"], edges) for edges in (48, 96, 192, 384)])
    against(f"load {name}: fold of the branch", fold, case["P_fold"], 1e-8)
    if name == "S1":
        against("C centre load, followed: symmetric fold", fold * case["L"] ** 2, 240.3135, 1e-6)


# L / chord, which multiples of the angle the ends turn, degrees at which the valley is lost, how.
TURNED = [
    (1.2, (1.0, 0.0), 41.81572612, SpecialKind.FOLD),
    (1.32, (1.0, -1.0), 57.73902789, SpecialKind.BIFURCATION),
    (1.0 / (1.0 - 1e-4), (1.0, 0.0), math.degrees(1.781781507 * 1e-2), SpecialKind.FOLD),
    (1.0 / (1.0 - 1e-2), (1.0, 0.0), math.degrees(1.782313586 * 1e-1), SpecialKind.FOLD),
    (1.0 / (1.0 - 1e-2), (1.0, -1.0), math.degrees(2.001899818 * 1e-1), SpecialKind.BIFURCATION),
]


@pytest.mark.parametrize(("ratio", "ways", "degrees", "kind"), TURNED)
def test_turned_ends(
    ratio: float, ways: tuple[float, float], degrees: float, kind: SpecialKind, against: Report
) -> None:
    rod = rod_between((1.0 / ratio, 0.0), 0.0, 0.0, 1.0, 0.0, 1.0, 0.0)
    furthest = 1.4 * math.radians(degrees)
    way = straight_path(rod.pose, rod.pose._replace(start=furthest * ways[0], end=furthest * ways[1]))
    point = critical(way, rod.bearing, *start_along(way, state_of(rod, "valley")), 1e-9)
    assert point.kind is kind
    against(f"C turned ends, followed: {kind.value}", math.degrees(point.fraction * furthest), degrees, 2e-9)


class Traced(NamedTuple):
    """The branch of a load case on a rod of so many edges: loads and deflections (m,), angles, multipliers, edges."""

    loads: Array
    deflections: Array
    shapes: Array
    forces: Array
    edges: Array

    def near(self, case: dict[str, Any], load: float, deflection: float) -> int:
        """The record that is nearest to a load and a deflection."""
        gaps = np.hypot((self.loads - load) / case["P_fold"], (self.deflections - deflection) / case["L"])
        return int(np.argmin(gaps))


@cache
def traced(name: str, edges: int) -> Traced:
    case, unit = CASES[name], 100.0
    way, rod = case_way(case, unit), reference_rod(case)
    phi, multipliers = start_along(way, above(case), edges)
    if case["kind"] == SpecialKind.BIFURCATION.value:
        phi = 0.5 * (phi - phi[::-1])
    track = trace(way, rod.bearing, phi, multipliers, TraceReach(-12.0, 14.0, 0.03, 1500))
    counts = counts_along(way, rod.bearing, edges)
    lengths = problem_at(way, rod.bearing, 0.0, counts).edges
    steps = np.stack([np.cos(track.phi), np.sin(track.phi)], axis=2) * lengths[:, None]
    places = rod.length * steps[:, : counts[0]].sum(axis=1)
    deflections = (places - places[0]) @ np.array(case["direction"])
    return Traced(unit * track.fractions, deflections, track.phi, track.multipliers, lengths)


def load_at(name: str, load: float, deflection: float, edges: int) -> float:
    """The load near another one that holds a deflection, by interpolation between records of a traced branch."""
    track = traced(name, edges)
    near = track.near(CASES[name], load, deflection)
    place = slice(near - 4, near + 6)
    return float(BarycentricInterpolator(track.deflections[place], track.loads[place])(deflection))


@pytest.mark.parametrize("name", CASES)
def test_force_against_deflection(name: str, against: Report) -> None:
    case = CASES[name]
    rod, track = reference_rod(case), traced(name, FINEST)
    at, toward = case["s_fraction"], np.array(case["direction"])
    begin = at_vertex(above(case), at)
    at_folds = 0
    for load, deflection, x, y, lowest in case["curve"]:
        near = track.near(case, load, deflection)
        pushed = changed(rod, loads=((at, load * toward[0], load * toward[1]),))
        state = refine(pushed, track.edges, track.shapes[near].copy(), track.forces[near].copy(), 1e-8)
        if state.outcome is Outcome.LOST:
            # So near to a fold that the coarsest level does not bear this load: then the deflection gives the load.
            at_folds += 1
            levels = [load_at(name, load, deflection, edges) for edges in (96, 192, FINEST)]
            against(f"load {name}: load at a fold", romberg(levels), load, 1e-7)
            continue
        place = at_vertex(state, at)
        against(f"load {name}: deflections", (place - begin) @ toward, deflection, 1e-8, scale=case["L"])
        against(f"load {name}: places", place, [x, y], 1e-8, scale=case["L"])
        against(f"load {name}: lowest eigenvalues", state.lowest_eigenvalue, lowest, 1e-4, scale=max(abs(lowest), 1.0))
    assert at_folds <= 1


def at_vertex(state: Equilibrium, at: float) -> Array:
    """Where the point at a fraction of the length is."""
    return state.curve(2001)[round(2000 * at)]
