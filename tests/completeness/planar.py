"""How many stable planar states the search misses, and how many it invents, against an independent multistart.

    python -m tests.completeness.planar --scenes 2000 --seed 1 --jobs 1

prints a table by kind of scene and distance from the fold, with 95 % intervals (Wilson 1927), then each fault as the
rod that shows it; the exit code is 1 if there is any.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.states.equilibrium import Equilibrium, tail_of
from curveline.rod.states.planar_states import find_states

from .scenes import FOLD, PAST, PITCHFORK, RANDOM, Scene, elastica, scene, truth
from .spectral import MODES, Array, Elastica, State, basis, crosses, newton, positions, settled

POINTS = 121
TOLERANCE = 1e-4
"""Tolerance [m] of the search, the default of `curveline simulate`."""
NEAR = 2e-3
"""Two curves nearer than this part of the length are one state: the other one of a pair is never stable."""
DECADES = ((1e-4, 1e-3), (1e-3, 1e-2), (1e-2, 1e-1))

Search = Callable[[ClampedRod, float], list[Equilibrium]]


class Result(NamedTuple):
    """A scene, how many states exist that a display can show, what was missed and what invented, in words.

    `unmet` counts the states that the search lists, rightly, but no start of the yardstick led to: what that lacks.
    """

    scene: Scene
    number: int
    states: int
    missed: tuple[str, ...]
    invented: tuple[str, ...]
    unmet: int


def places_on(rod: ClampedRod) -> tuple[NDArray[np.bool_], Array]:
    """Which of POINTS places from pivot to pivot lie on the free rod, and where on it, from 0 to 1."""
    at = (np.linspace(0.0, rod.length, POINTS) - 0.5 * rod.clamp) / rod.free_length
    free = (at >= 0.0) & (at <= 1.0)
    return free, at[free]


def free_curve(state: Equilibrium) -> Array:
    """Positions (POINTS, 2) of the free rod in units of its length, beginning at the origin."""
    rod = state.rod
    free, _ = places_on(rod)
    return np.asarray((state.curve(POINTS)[free] - rod.free_start) / rod.free_length)


def confirmed(rod: Elastica, state: Equilibrium) -> State | None:
    """The exact equilibrium at a listed state, or None; found by Newton from the angles that are listed."""
    table, edges = state.vertices_table, state.edges
    for count in MODES[:3]:
        base = basis(count)
        theta = np.interp(base.places * edges.sum(), np.concatenate([[0.0], np.cumsum(edges)]), table[:, 2])
        mass = base.values.T @ (base.values * base.weights[:, None])
        c = np.linalg.solve(mass, base.values.T @ ((theta - rod.ramp(base.places)) * base.weights))
        force = -state.clamp_force[1] * state.rod.free_length**2 / state.rod.stiffness
        met, pulls, done = newton(rod, c[None], force[None], most=30)
        exact = settled(rod, met[0], pulls[0]) if done[0] else None
        if exact is not None:
            return exact
    return None


def judged(seed: int, number: int) -> Result:
    """Compare the search with the truth in one scene."""
    drawn = scene(seed, number)
    return compared(number, drawn, truth(seed, number, drawn), find_states)


def compared(number: int, drawn: Scene, true_states: list[State], search: Search) -> Result:
    """Compare what a search lists with the stable states that a scene has."""
    rod = elastica(drawn.rod)
    listed = search(drawn.rod, TOLERANCE)
    _, ticks = places_on(drawn.rod)
    curves = [free_curve(state) for state in listed]
    invented, right = [], []
    for j, (state, curve) in enumerate(zip(listed, curves, strict=True)):
        exact = confirmed(rod, state)
        gap = math.inf if exact is None else float(np.max(np.abs(positions(rod, exact, ticks) - curve)))
        if exact is None or not exact.is_stable or gap > 1e-6 + 2.0 * state.error / drawn.rod.free_length:
            value = math.nan if exact is None else exact.lowest_eigenvalue
            invented.append(f"{state.name} {state.lowest_eigenvalue:.4g}, truly {value:.4g}, {gap:.2g} away")
        elif state.simple:
            right.append(j)
    tail = tail_of(drawn.rod) / drawn.rod.free_length
    there = [state for state in true_states if not crosses(rod, state, tail)]
    pairs = matched([positions(rod, state, ticks) for state in there], curves)
    missed = [f"eigenvalue {each.lowest_eigenvalue:.4g}" for i, each in enumerate(there) if i not in pairs]
    unmet = set(right) - set(pairs.values())
    return Result(drawn, number, len(there) + len(unmet), tuple(missed), tuple(invented), len(unmet))


def matched(truths: list[Array], curves: list[Array]) -> dict[int, int]:
    """Which of the listed `curves` is which of the `truths`, none of them twice."""
    if not truths or not curves:
        return {}
    gaps = np.array([[np.max(np.abs(truth - curve)) for curve in curves] for truth in truths])
    pairs = zip(*(part.tolist() for part in linear_sum_assignment(gaps)), strict=True)
    return {i: j for i, j in pairs if gaps[i, j] < NEAR}


def wilson(hits: int, count: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927)."""
    if count == 0:
        return 0.0, 1.0
    z, share = 1.96, hits / count
    middle = (share + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * math.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    return max(0.0, middle - half), min(1.0, middle + half)


def row(name: str, results: Iterable[Result]) -> str:
    """A line of the table."""
    chosen = list(results)
    missing = sum(bool(each.missed) for each in chosen)
    low, high = wilson(missing, len(chosen))
    share = 100.0 * missing / max(1, len(chosen))
    states, missed = sum(each.states for each in chosen), sum(len(each.missed) for each in chosen)
    invented = sum(len(each.invented) for each in chosen)
    interval = f"{share:6.2f} % [{100 * low:.2f}, {100 * high:.2f}]"
    return f"{name:28} {len(chosen):6} {states:7} {missed:7} {invented:9}   {interval}"


def table(results: list[Result]) -> str:
    """The table of misses by kind and by distance from the fold."""
    lines = [f"{'scenes':28} {'scenes':>6} {'states':>7} {'missed':>7} {'invented':>9}   scenes with a miss"]
    lines.append(row("all", results))
    lines.append(row("anywhere", (each for each in results if each.scene.kind == RANDOM)))
    for kind in (FOLD, PITCHFORK, PAST):
        of_kind = [each for each in results if each.scene.kind == kind]
        lines.append(row(f"{'past either' if kind == PAST else 'before a ' + kind}", of_kind))
        for low, high in DECADES:
            name = f"  {100 * low:g} to {100 * high:g} % of the way"
            lines.append(row(name, (each for each in of_kind if low <= each.scene.back < high)))
    return "\n".join(lines)


def _one(task: tuple[int, int]) -> Result:
    return judged(*task)


def main() -> int:
    """Run the scenes, print the table and the faults."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    chosen = parser.parse_args()
    tasks = [(chosen.seed, number) for number in range(chosen.scenes)]
    if chosen.jobs > 1:
        with multiprocessing.get_context("spawn").Pool(chosen.jobs) as pool:
            results = pool.map(_one, tasks, chunksize=8)
    else:
        results = [_one(task) for task in tasks]
    print(table(results))
    unmet, states = sum(each.unmet for each in results), sum(each.states for each in results)
    print(f"of the {states} states {unmet} were listed, and confirmed, that no start of the yardstick led to")
    faults = [each for each in results if each.missed or each.invented]
    for each in faults:
        back = f"{each.scene.kind} {each.scene.back:.2e}"
        print(f"\n{each.number}: {back}: missed {list(each.missed)}, invented {list(each.invented)}")
        print(f"  {each.scene.rod}")
    return int(bool(faults))


if __name__ == "__main__":
    raise SystemExit(main())
