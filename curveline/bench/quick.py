"""The speed/accuracy trade, measured on this machine: rows of figures, each with what it is compared to.

Timings are the best of many repeats in one process, since everything else on a machine only adds to them; compare the
ratios, which are taken in the same run.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from curveline.measured import Row
from curveline.rod import spline
from curveline.rod.elastica import clamped_arch
from curveline.rod.equilibrium import ClampedRod, refine
from curveline.rod.ladder import climb
from curveline.rod.planar import Effort, descend, newton
from curveline.rod.problem import Array, ScaledRod, make_problem, mesh, released, sharpest_turn
from curveline.rod.states import RELAX, SEARCH_EDGES, find_states
from curveline.scene import Scene
from curveline.shapefile import read_shape
from curveline.simulation import simulate
from curveline.units import deg, mm, to_mm

SCENES = 144
SEED = 20260101
STARTS = 24


def quick(shapes: Iterable[str]) -> Iterable[Row]:
    """The figures of `bench --quick` over the given shape files, one after the other as they are measured."""
    scenes = [read_shape(path) for path in shapes]
    yield from _one_state()
    yield from _all_states(scenes)
    yield from _random_scenes()
    yield from _processes([scene.path for scene in scenes])


def _best(action: Callable[[], object], seconds: float = 0.3) -> float:
    """Shortest time of `action` [s] over repeats that take about `seconds`."""
    action()
    best, spent = math.inf, 0.0
    while spent < seconds:
        begin = time.perf_counter()
        action()
        took = time.perf_counter() - begin
        best, spent = min(best, took), spent + took
    return best


def _arch() -> ClampedRod:
    """The scene of the yardsticks: span 500 mm, length 600 mm, level clamps without length, no gravity."""
    return ClampedRod((0.5, 0.0), 0.0, 0.0, 0.6, 0.0, 1.0, 0.0)


def _one_state() -> Iterable[Row]:
    """One state from its spline guess and from a neighbour, against bare Newton and against collocation."""
    rod = _arch()
    scaled = rod.scaled()
    exact = clamped_arch(0.5, 0.6, 1.0)
    edges = mesh(scaled.at, SEARCH_EDGES[0])
    problem = released(make_problem(scaled, edges))
    guess = np.empty(edges.size)
    spline.guess(scaled.chord, scaled.ends, 1.0, guess)
    near, forces = guess.copy(), np.zeros(2)
    descend(problem, near, forces, RELAX)
    near = near + 0.02 * np.sin(2.0 * math.pi * np.cumsum(edges))

    def from_guess(tolerance: float) -> None:
        angles, multipliers = guess.copy(), np.zeros(2)
        descend(problem, angles, multipliers, RELAX)
        climb(scaled, edges, angles, multipliers, tolerance / rod.length, 10_000)

    def warm(tolerance: float) -> None:
        climb(scaled, edges, near.copy(), forces.copy(), tolerance / rod.length, 10_000)

    for tolerance, goal in ((mm(0.1), "< 100"), (mm(0.001), "< 200")):
        name = f"{to_mm(tolerance):g} mm"
        yield Row(f"relax to {name}", 1e6 * _best(lambda t=tolerance: from_guess(t)), "us", goal, "from a spline guess")  # type: ignore[misc]
        yield Row(f"warm start to {name}", 1e6 * _best(lambda t=tolerance: warm(t)), "us", goal, "from a neighbour")  # type: ignore[misc]
    state = refine(rod, edges, near.copy(), forces.copy(), mm(0.1))
    places = np.linspace(0.0, rod.length, 201)
    error = float(np.hypot(*(state.curve(201) - exact.positions(places)).T).max())
    yield Row("true error at 0.1 mm", to_mm(error), "mm", "< 0.003", "against the elliptic closed form")
    ours = _best(lambda: warm(mm(0.1)))
    yield from _bare_newton(scaled, ours)
    yield from _collocation(rod, ours, exact.positions(places))


def _bare_newton(scaled: ScaledRod, ours: float) -> Iterable[Row]:
    """Newton alone on 50 and 100 edges: the yardstick for everything that certifies and extrapolates on top."""
    for n in (50, 100):
        edges = mesh(scaled.at, n)
        problem = released(make_problem(scaled, edges))
        angles, forces = np.empty(n), np.zeros(2)
        spline.guess(scaled.chord, scaled.ends, 1.0, angles)
        descend(problem, angles, forces, RELAX)
        near = angles + 0.02 * np.sin(2.0 * math.pi * np.cumsum(edges))
        effort = Effort(turn=1.0, close=1e-7, iterations=30)
        took = _best(lambda p=problem, a=near, f=forces, e=effort: newton(p, a.copy(), f.copy(), e))  # type: ignore[misc]
        yield Row(f"bare Newton, {n} edges", 1e6 * took, "us", "", "one solve, no error known")
        yield Row(f"warm start over bare Newton {n}", ours / took, "x", "", "same scene, same run")


def _collocation(rod: ClampedRod, ours: float, exact: Array) -> Iterable[Row]:
    """scipy.integrate.solve_bvp on the same scene, tol 1e-3, from a sine-shaped guess."""
    from scipy.integrate import solve_bvp

    length = rod.length

    def slopes(_s: Array, y: Array) -> Array:
        theta, curvature, force_x, force_y = y[2], y[3], y[4], y[5]
        bend = force_x * np.sin(theta) - force_y * np.cos(theta)
        return np.vstack([np.cos(theta), np.sin(theta), curvature, bend, 0.0 * theta, 0.0 * theta])

    def ends(a: Array, b: Array) -> Array:
        return np.array([a[0], a[1], a[2], b[0] - rod.chord[0], b[1] - rod.chord[1], b[2]])

    places = np.linspace(0.0, length, 12)
    start = np.zeros((6, places.size))
    start[0] = places * rod.chord[0] / length
    start[1] = 0.07 * (1.0 - np.cos(2.0 * math.pi * places / length))
    start[2] = 0.8 * np.sin(2.0 * math.pi * places / length)
    start[4] = -100.0
    took = _best(lambda: solve_bvp(slopes, ends, places, start, tol=1e-3))
    solution = solve_bvp(slopes, ends, places, start, tol=1e-3)
    curve = solution.sol(np.linspace(0.0, length, exact.shape[0]))[:2].T
    yield Row("solve_bvp, tol 1e-3", 1e3 * took, "ms", "", "scipy, same scene")
    yield Row("its true error", to_mm(float(np.hypot(*(curve - exact).T).max())), "mm", "", "the closed form")
    yield Row("solve_bvp over warm start", took / ours, "x", "> 35", "same run")


def _all_states(scenes: list[Scene]) -> Iterable[Row]:
    """`simulate` over shape files: search, certificates, error estimates, terms left out."""
    times = [_best(lambda s=scene: simulate(s), 0.05) for scene in scenes]  # type: ignore[misc]
    yield Row("simulate a segment", 1e3 * float(np.median(times)), "ms", "< 1", f"median of {len(scenes)} shapes")
    yield Row("simulate, slowest shape", 1e3 * max(times), "ms", "< 1", "all stable states, certified")


def _random_scenes() -> Iterable[Row]:
    """Random scenes: what the search finds, against descents from random starts, and that each state is certified."""
    rng = np.random.default_rng(SEED)
    found = missed = uncertain = 0
    times = []
    for _ in range(SCENES):
        height, left, right, length = rng.uniform([-0.12, deg(-45), deg(-45), 0.56], [0.12, deg(45), deg(45), 0.8])
        rod = ClampedRod((0.5, height), left, right, length, mm(20.0), 0.028224, 0.4707192)
        begin = time.perf_counter()
        states = find_states(rod, mm(0.1))
        times.append(time.perf_counter() - begin)
        found += len(states)
        uncertain += sum(not state.stable or state.error > mm(0.1) for state in states)
        missed += _missed(rod, [state.mean_height for state in states], rng)
    yield Row("states in random scenes", found, "", "", f"{SCENES} scenes, seed {SEED}")
    yield Row("not certified to 0.1 mm", uncertain, "", "0", "same scenes")
    yield Row("missed by the search", missed, "", "0", f"{STARTS} random descents a scene")
    yield Row("search of a scene", 1e3 * float(np.median(times)), "ms", "< 1", "median of single runs")


def _missed(rod: ClampedRod, known: list[float], rng: np.random.Generator) -> int:
    """How many stable states random descents reach whose mean height [m] is not among `known`."""
    scaled = rod.scaled()
    edges = mesh(scaled.at, 48)
    problem = released(make_problem(scaled, edges))
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


def _processes(paths: list[str]) -> Iterable[Row]:
    """Whole commands: help, all shape files, the first run with an empty kernel cache; peak memory."""
    command = [sys.executable, "-m", "curveline"]
    bare = _wall([sys.executable, "-c", "import typer"], dict(os.environ))
    shown = _wall([*command, "--help"], dict(os.environ))
    yield Row("curveline --help", shown, "s", "< 0.3", "wall, best of 5")
    yield Row("help over bare Python with typer", shown / bare, "x", "< 3", "same run")
    warm = _wall([*command, "simulate", "--json", *paths], dict(os.environ))
    yield Row(f"simulate {len(paths)} files, warm", warm, "s", "< 1.5", "wall with start-up, best of 5")
    memory = _peak_memory([*command, "simulate", "--json", *paths], dict(os.environ))
    yield Row("its peak memory", memory, "MB", "< 200", "resident")
    with tempfile.TemporaryDirectory() as folder:
        fresh = {**os.environ, "CURVELINE_CACHE": str(Path(folder) / "cache")}
        first = _wall([*command, "simulate", "--json", paths[0]], fresh, repeats=1)
    yield Row("first run, empty kernel cache", first, "s", "< 20", "wall, compiles the kernels")


def _wall(command: list[str], environment: dict[str, str], repeats: int = 5) -> float:
    """Shortest wall time of a command [s]."""
    best = math.inf
    for _ in range(repeats):
        begin = time.perf_counter()
        subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
        best = min(best, time.perf_counter() - begin)
    return best


def _peak_memory(command: list[str], environment: dict[str, str]) -> float:
    """Largest resident memory of a command [MB]; asked by a small process, as a fork counts what its parent holds."""
    ask = (
        "import resource, subprocess, sys; hush = subprocess.DEVNULL; "
        "subprocess.run(sys.argv[1:], stdout=hush, stderr=hush, check=True); "
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    done = subprocess.run([sys.executable, "-c", ask, *command], env=environment, capture_output=True, check=True)
    return int(done.stdout) / (1e6 if sys.platform == "darwin" else 1e3)


def trade(shapes: Iterable[str]) -> Iterable[Row]:
    """The speed/accuracy trade over shape files: for each tolerance the vertices, the true error and the time."""
    scenes = [read_shape(path) for path in shapes]
    truth = [_curves(scene, mm(1e-6)) for scene in scenes]
    for tolerance in (mm(1.0), mm(0.1), mm(0.01), mm(0.001), mm(0.0001)):
        name = f"{to_mm(tolerance):g} mm"
        results = [simulate(scene, tolerance) for scene in scenes]
        vertices = max(state.vertices for result in results for part in result for state in part.states)
        worst = max(
            float(np.hypot(*(curve - exact).T).max())
            for scene, curves in zip(scenes, truth, strict=True)
            for curve, exact in zip(_curves(scene, tolerance), curves, strict=True)
        )
        times = [_best(lambda s=scene, t=tolerance: simulate(s, t), 0.05) for scene in scenes]  # type: ignore[misc]
        yield Row(f"{name}: most vertices", vertices, "", "", f"{len(scenes)} shapes")
        yield Row(f"{name}: worst true error", to_mm(worst), "mm", f"< {to_mm(tolerance):g}", "against 1e-6 mm")
        yield Row(f"{name}: time of a shape", 1e3 * float(np.median(times)), "ms", "", "median, all states")


def _curves(scene: Scene, tolerance: float) -> list[Array]:
    """All curves of a scene at a tolerance [m]."""
    return [state.curve(201) for part in simulate(scene, tolerance) for state in part.states]
