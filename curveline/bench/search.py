"""The search for every stable state: how long it takes, and how complete it is, held against random descents."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from curveline.bench.measurement import Measurement
from curveline.bench.methods.cases import SEED
from curveline.bench.methods.cases import random_scenes as drawn_scenes
from curveline.bench.methods.stopwatch import Timed, timed
from curveline.bench.yardsticks import timed_row, yardsticks
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.newton import descend
from curveline.rod.planar.search import RELAX
from curveline.rod.problem import Bearing, Pose, make_problem, mesh, sharpest_turn
from curveline.rod.states.equilibrium import refine
from curveline.rod.states.planar_states import find_states
from curveline.scene import Scene
from curveline.simulation.simulate import simulate
from curveline.units import deg, mm, to_ms

BOUNDARY_CONDITIONS = (
    (0.0, 0.0, 0.0, 600.0),
    (100.0, 0.0, 0.0, 620.0),
    (0.0, 30.0, -30.0, 660.0),
    (100.0, 30.0, -30.0, 680.0),
    (0.0, -40.0, 40.0, 700.0),
    (120.0, -30.0, 30.0, 700.0),
    (0.0, 40.0, 10.0, 700.0),
    (80.0, 45.0, -15.0, 720.0),
)
"""Height [mm], angles [deg] and length [mm] over a span of 500 mm, with point clamps and without weight."""

SCENES = 144
STARTS = 24
SIMULATED = 400
"""Random scenes that are simulated: a few near folds take many times as long as the others."""
GOES = 3
"""How often each of many scenes is timed."""
SHAPE_S = 0.05
"""How long each shape is timed [s]."""

Middle = Callable[[Sequence[float]], Any]
"""numpy's `mean` or `median`."""


def all_states(scenes: Sequence[Scene]) -> Iterator[Measurement]:
    """Every stable state: of eight boundary conditions, and of shapes with all that `simulate` does."""
    rods = [
        ClampedRod(Pose(0.5, mm(height), deg(left), deg(right), mm(length)), Bearing(0.0, 1.0, 0.0))
        for height, left, right, length in BOUNDARY_CONDITIONS
    ]
    found = sum(len(find_states(rod, mm(0.1))) for rod in rods)
    took = timed(lambda: [find_states(rod, mm(0.1)) for rod in rods])
    row = timed_row(f"{found} states of {len(rods)} boundaries", took, "ms", "< 20", "all states, 0.1 mm")
    yield yardsticks().beside(row, took.best / len(rods))
    times = [timed(partial(simulate, scene), SHAPE_S) for scene in scenes]
    each = [took.best / len(scene.segments) for took, scene in zip(times, scenes, strict=True)]
    spread = float(np.median([took.spread or 0.0 for took in times]))
    for name, goal, seconds, how in (
        ("simulate a shape", "< 0.2", float(np.median(each)), "of a segment, median"),
        ("simulate, slowest shape", "< 1", max(each), "of a segment"),
    ):
        yield yardsticks().beside(Measurement(name, to_ms(seconds), "ms", goal, how, spread), seconds)


def random_scenes() -> Iterator[Measurement]:
    """What the search finds in random scenes, against descents from random starts, and how long all of it takes."""
    rng = np.random.default_rng(SEED)
    found = lost = uncertain = 0
    goes = []
    scenes = [_drawn(rng) for _ in range(SCENES)]
    for rod in scenes:
        begin = time.perf_counter()
        states = find_states(rod, mm(0.1))
        goes.append(time.perf_counter() - begin)
        found += len(states)
        uncertain += sum(not state.stable or state.error > mm(0.1) for state in states)
        lost += missed(rod, [state.mean_height for state in states], rng)
    yield Measurement("states in random scenes", found, "", "", f"of {SCENES} scenes", 0.0)
    yield Measurement("not certified to 0.1 mm", uncertain, "", "= 0", "same scenes", 0.0)
    yield Measurement("missed by the search", lost, "", "= 0", f"{STARTS} descents each", 0.0)
    yield of_many("search of a scene", [partial(find_states, rod, mm(0.1)) for rod in scenes], "< 1", np.median)
    yield of_scenes("simulate, random scenes' mean", list(drawn_scenes(SIMULATED)), "< 0.25", np.mean)


def of_scenes(name: str, scenes: Sequence[Scene], goal: str, middle: Middle, goes: int = GOES) -> Measurement:
    """Mean or median time of `simulate` over scenes of one segment [ms], each the best of some goes."""
    return of_many(name, [partial(simulate, scene) for scene in scenes], goal, middle, goes)


def of_many(
    name: str, actions: Sequence[Callable[[], object]], goal: str, middle: Middle, goes: int = GOES
) -> Measurement:
    """Mean or median time over actions that each solve one rod [ms], each the best of some goes, with its noise."""
    actions[0]()
    taken = [[_once(action) for action in actions] for _ in range(goes)]
    best = [min(each) for each in zip(*taken, strict=True)]
    seconds, processor = (float(middle(each)) for each in zip(*best, strict=True))
    rounds = [float(middle([wall for wall, _ in go])) for go in taken]
    spread = max(Timed.of(rounds).spread or 0.0, seconds / processor - 1.0)
    how = f"{middle.__name__} of {len(actions)}, {goes} goes"
    return yardsticks().beside(Measurement(name, to_ms(seconds), "ms", goal, how, spread), seconds)


def _once(action: Callable[[], object]) -> tuple[float, float]:
    """Time on the wall clock, and that of the processor [s]."""
    worked, begin = time.process_time(), time.perf_counter()
    action()
    took = time.perf_counter() - begin
    return took, time.process_time() - worked


def _drawn(rng: np.random.Generator) -> ClampedRod:
    """A rod as in the built-in display, anywhere within much of what that can do."""
    drawn = rng.uniform([-0.12, deg(-45), deg(-45), 0.56], [0.12, deg(45), deg(45), 0.8])
    height, left, right, length = drawn.tolist()
    return ClampedRod(Pose(0.5, height, left, right, length), Bearing(mm(20.0), 0.028224, 0.4707192))


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
