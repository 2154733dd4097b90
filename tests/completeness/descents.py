"""How many stable states of unusual rods the search misses, against descents from random curves.

    python -m tests.completeness.descents giving --scenes 300 --seed 1
    python -m tests.completeness.descents bent --scenes 300 --seed 1

The rods are between clamps that give, or bent when free, each part of them otherwise.

The descents share the discrete rod with the search, but neither its guesses nor its sweeps. Loops, whose tangent turns
by more than 0.6 turns beyond what its clamps ask for, and curves that flip a bearing over are no part of
it, as they are none of the search. Prints each state that is missed; the exit code is 1 if there is any.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.geometry.vertex_table import CURVATURE
from curveline.rod.natural_curvature import NaturalCurvature
from curveline.rod.planar.search import relax_from
from curveline.rod.planar.sweep import nothing_found
from curveline.rod.problem import Bearing, Pose, make_problem, mesh
from curveline.rod.states.equilibrium import Equilibrium, refine
from curveline.rod.states.identity import same_curve
from curveline.rod.states.planar_states import find_states

EDGES = 48
STARTS = 16
TOLERANCE = 1e-4
LOW, HIGH = (-0.15, -1.1, -1.1, 0.53), (0.15, 1.1, 1.1, 0.85)
GIVES, PLAYS, NATURALS, CLAMPS, WEIGHTS = (0.0, 0.003, 0.02), (0.0, 0.01, 0.1), (0.0, 1.5), (0.0, 0.02), (0.0, 0.4707)
KEPT = 0.5
"""Share of the bent rods that have kept some of the curvature of a state of theirs."""
LOOP = 1.2 * math.pi
"""Turn [rad] beyond that from clamp to clamp from which on a curve is a loop."""


def giving(count: int, seed: int) -> Iterator[ClampedRod]:
    """Slack rods anywhere, between bearings of which most give."""
    rng = np.random.default_rng(seed)
    while count:
        pose = Pose(0.5, *rng.uniform(LOW, HIGH).tolist())
        give, play, natural, clamp, weight = (
            float(rng.choice(values)) for values in (GIVES, PLAYS, NATURALS, CLAMPS, WEIGHTS)
        )
        rod = ClampedRod(pose, Bearing(clamp, 0.028224, weight, natural, give=give, play=play))
        if 1.005 * math.hypot(*rod.free_chord) < rod.free_length:
            count -= 1
            yield rod


def bent(count: int, seed: int) -> Iterator[ClampedRod]:
    """Slack rods anywhere that are bent when free: in waves, or as one of their own states is, by some of it."""
    rng = np.random.default_rng(seed)
    while count:
        pose = Pose(0.5, *rng.uniform(LOW, HIGH).tolist(), float(rng.uniform(0.0, 0.3)))
        clamp, weight = float(rng.choice(CLAMPS)), float(rng.choice(WEIGHTS))
        rod = ClampedRod(pose, Bearing(clamp, 0.028224, weight))
        if not 1.005 * math.hypot(*rod.free_chord) < rod.free_length:
            continue
        places = np.linspace(0.0, 1.3, 261)
        waves = np.sin(2.0 * np.pi * np.outer(np.arange(1, 6), places / 1.3) + rng.uniform(0.0, 6.0, (5, 1)))
        values = rng.normal(0.0, 1.0, 5) @ waves
        states = find_states(rod, TOLERANCE)
        if states and rng.random() < KEPT:
            kept = states[int(rng.integers(len(states)))]
            at = pose.begin + 0.5 * clamp + np.concatenate([[0.0], np.cumsum(kept.edges)])
            values = rng.uniform(0.05, 0.4) * np.interp(places, at, kept.vertices_table[:, CURVATURE], 0.0, 0.0)
        count -= 1
        yield ClampedRod(pose, rod.bearing._replace(profile=NaturalCurvature(places, values).table))


def descended(rod: ClampedRod, rng: np.random.Generator) -> Iterator[Equilibrium]:
    """Stable states that descents from random curves lead to, some of them more than once."""
    edges = mesh(rod.scaled().at, EDGES)
    free, found = make_problem(rod.scaled(), edges), nothing_found(edges.size)
    places = np.cumsum(edges) - 0.5 * edges
    waves = np.sin(np.pi * np.outer(np.arange(1, 5), places))
    for _ in range(STARTS):
        relax_from(free, rod.start + (rod.end - rod.start) * places + rng.normal(0.0, 1.2, 4) @ waves, found)
    for i in range(int(found.filled[0])):
        state = refine(rod, edges, found.shapes[i].copy(), found.multipliers[i].copy(), TOLERANCE)
        if state.stable and not is_loop(state):
            yield state


def is_loop(state: Equilibrium) -> bool:
    """True for a curve with a further turn, or in a bearing that is flipped over."""
    return bool(np.ptp(state.angles) > LOOP + abs(state.rod.end - state.rod.start))


def missed(rod: ClampedRod, rng: np.random.Generator) -> tuple[list[Equilibrium], list[Equilibrium]]:
    """The states of a rod, and those besides that descents lead to."""
    states = find_states(rod, TOLERANCE)
    return states, [each for each in descended(rod, rng) if not any(same_curve(each, other) for other in states)]


DRAWS: Mapping[str, Callable[[int, int], Iterator[ClampedRod]]] = {"giving": giving, "bent": bent}


def main() -> None:
    """Print what is missed of how many."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rods", choices=tuple(DRAWS))
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    rng = np.random.default_rng(asked.seed + 1_000_000)
    count = lost = 0
    for rod in DRAWS[asked.rods](asked.scenes, asked.seed):
        states, others = missed(rod, rng)
        count += len(states)
        lost += len(others)
        for each in others:
            print(
                rod.pose, rod.bearing, f"mean height {each.mean_height:.6f}", f"eigenvalue {each.lowest_eigenvalue:.3f}"
            )
    print(f"{asked.scenes} scenes, {count} states, {lost} missed")
    raise SystemExit(lost > 0)


if __name__ == "__main__":
    main()
