"""How complete the search for stable states is: random scenes against descents from random starts."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

import numpy as np

from curveline.bench.measurement import Measurement
from curveline.bench.methods.cases import SEED
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.newton import descend
from curveline.rod.planar.search import RELAX
from curveline.rod.problem import Bearing, Pose, make_problem, mesh, sharpest_turn
from curveline.rod.states.equilibrium import refine
from curveline.rod.states.planar_states import find_states
from curveline.units import deg, mm

SCENES = 144
STARTS = 24


def rows() -> Iterator[Measurement]:
    """Random scenes: what the search finds, against descents from random starts, and that each state is certified."""
    rng = np.random.default_rng(SEED)
    found = lost = uncertain = 0
    times = []
    for _ in range(SCENES):
        drawn = rng.uniform([-0.12, deg(-45), deg(-45), 0.56], [0.12, deg(45), deg(45), 0.8])
        height, left, right, length = drawn.tolist()
        rod = ClampedRod(Pose(0.5, height, left, right, length), Bearing(mm(20.0), 0.028224, 0.4707192))
        begin = time.perf_counter()
        states = find_states(rod, mm(0.1))
        times.append(time.perf_counter() - begin)
        found += len(states)
        uncertain += sum(not state.stable or state.error > mm(0.1) for state in states)
        lost += missed(rod, [state.mean_height for state in states], rng)
    yield Measurement("states in random scenes", found, "", "", f"{SCENES} scenes, seed {SEED}")
    yield Measurement("not certified to 0.1 mm", uncertain, "", "0", "same scenes")
    yield Measurement("missed by the search", lost, "", "0", f"{STARTS} random descents each")
    yield Measurement("search of a scene", 1e3 * float(np.median(times)), "ms", "< 1", "median of single runs")


def missed(rod: ClampedRod, known: list[float], rng: np.random.Generator) -> int:
    """How many stable states random descents reach whose mean height [m] is not among `known`."""
    scaled = rod.scaled()
    edges = mesh(scaled.at, 48)
    problem = make_problem(scaled, edges)
    places = np.cumsum(edges) - 0.5 * edges
    news: list[float] = []
    for _ in range(STARTS):
        waves = sum(rng.normal() / k * np.sin(k * math.pi * places) for k in range(1, 5))
        angles = rod.start + (rod.end - rod.start) * places + 2.0 * waves
        forces = np.zeros(2)
        if descend(problem, angles, forces, RELAX) < 0 or sharpest_turn(problem, angles) > 0.8:
            continue
        height = refine(rod, edges, angles, forces, mm(0.1)).mean_height
        if all(abs(height - other) > mm(2.0) for other in known + news):
            news.append(height)
    return len(news)
