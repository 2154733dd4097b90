"""The figures that are held against goals: `curveline bench --quick`.

Compare the ratios, which are taken in the same run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from curveline.bench import commands, search
from curveline.bench.many_segments import row
from curveline.bench.measurement import Measurement
from curveline.bench.methods.cases import Case, clamps, truth
from curveline.bench.methods.collocation import solve as collocate
from curveline.bench.methods.own import Method, Solved, one_level, one_spatial_level
from curveline.bench.methods.peers import PEERS
from curveline.bench.methods.stopwatch import best
from curveline.bench.trade import distance, fitted_exponent, is_installed
from curveline.planning.tours import make_plan
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.elastica import clamped_arch
from curveline.rod.planar.newton import descend
from curveline.rod.planar.richardson import climb_levels
from curveline.rod.planar.search import RELAX
from curveline.rod.problem import Array, Bearing, Pose, Problem, ScaledRod, make_problem, mesh
from curveline.rod.spatial import relax
from curveline.rod.spatial.lifting import lift
from curveline.rod.states.equilibrium import EXTENSIBLE, PLANAR, refine
from curveline.rod.states.planar_states import SEARCH_EDGES, find_states
from curveline.scene import Scene
from curveline.shapes.files import read_shape
from curveline.simulation.simulate import scene_rod, simulate
from curveline.units import deg, mm, to_mm, to_ms

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

PLANAR_SIZES = (100, 316, 1_000, 3_162, 10_000, 31_623, 100_000)
SPATIAL_SIZES = (100, 316, 1_000, 3_162, 10_000)
SEGMENTS = (4, 16, 64)


def quick(shapes: Sequence[str]) -> Iterator[Measurement]:
    """The figures of `bench --quick` over the given shape files, one after the other as they are measured."""
    scenes = [read_shape(path) for path in shapes]
    yield from one_state()
    yield from spatial_against_peers()
    yield from linear_cost()
    yield from all_states(scenes)
    yield from many_segments()
    yield from search.rows()
    yield from commands.rows([scene.path for scene in scenes])


def one_state() -> Iterator[Measurement]:
    """One planar state from its spline guess and from a neighbour, against bare Newton and against collocation."""
    case = clamps().cases[0]
    rod = case.rod
    scaled, edges, guess, problem = _planar_start(case)
    near, forces = guess.copy(), np.zeros(2)
    descend(problem, near, forces, RELAX)
    near = near + 0.02 * np.sin(2.0 * math.pi * np.cumsum(edges))

    def from_guess(tolerance: float) -> Any:
        angles, multipliers = guess.copy(), np.zeros(2)
        descend(problem, angles, multipliers, RELAX)
        return climb_levels(scaled, edges, angles, multipliers, tolerance / rod.length, 10_000)

    def warm(tolerance: float) -> Any:
        return climb_levels(scaled, edges, near.copy(), forces.copy(), tolerance / rod.length, 10_000)

    for tolerance, goal in ((mm(0.1), "< 100"), (mm(0.001), "< 200")):
        name = f"{to_mm(tolerance):g} mm"
        yield Measurement(
            f"relax to {name}", 1e6 * best(partial(from_guess, tolerance)), "us", goal, "from a spline guess"
        )
        yield Measurement(f"warm start to {name}", 1e6 * best(partial(warm, tolerance)), "us", goal, "from a neighbour")
    exact = clamped_arch(rod.chord[0], rod.length, rod.stiffness)
    places = np.linspace(0.0, rod.length, 201)
    state = refine(rod, edges, near.copy(), forces.copy(), mm(0.1))
    error = float(np.hypot(*(state.curve(201) - exact.positions(places)).T).max())
    yield Measurement("true error at 0.1 mm", to_mm(error), "mm", "< 0.003", "against the closed form")
    finest = int(from_guess(mm(0.1))[-1])
    yield from _bare_newton(scaled, guess, finest, partial(from_guess, mm(0.1)))
    yield from _collocation(case, partial(warm, mm(0.1)))


def _planar_start(case: Case) -> tuple[ScaledRod, Array, Array, Problem]:
    """Rod, edges, spline guess and equations with which the refinement of a planar state begins."""
    scaled = case.rod.scaled()
    edges = mesh(scaled.at, SEARCH_EDGES[0])
    return scaled, edges, case.guess(edges.size), make_problem(scaled, edges)


def _bare_newton(scaled: ScaledRod, guess: Array, finest: int, relax_it: Callable[[], object]) -> Iterator[Measurement]:
    """A certified state at 0.1 mm against Newton alone from the same guess through the same levels."""
    from curveline.bench.methods import bare_newton  # its kernels are compiled when it is imported

    solve = partial(bare_newton.solve, guess, scaled.chord, scaled.ends, scaled.weight, finest)
    took = best(solve)
    yield Measurement("bare Newton, same levels", 1e6 * took, "us", "", f"{finest} edges, no error known")
    yield Measurement("relax to 0.1 mm over bare", best(relax_it) / took, "x", "< 3", "same system, same run")


def _collocation(case: Case, warm: Callable[[], object]) -> Iterator[Measurement]:
    """scipy.integrate.solve_bvp on the same scene from the same guess."""
    answer = collocate(case, PLANAR, 1e-3)
    if answer is None:
        return
    yield Measurement("solve_bvp, tol 1e-3", 1e3 * answer.seconds, "ms", "", "scipy, same scene")
    yield Measurement("its true error", to_mm(_error(case, PLANAR, answer)), "mm", "", "against shooting")
    yield Measurement("solve_bvp over warm start", answer.seconds / best(warm), "x", "> 35", "same run")


def _error(case: Case, model: str, answer: Solved) -> float:
    """True error of an answer [m]."""
    curve = truth(case, model)
    return distance(answer, curve.positions(answer.places)) if curve else math.nan


def spatial_against_peers() -> Iterator[Measurement]:
    """The rod in space of 100 edges between clamps in its plane, and what others need to come as close."""
    case = clamps().cases[0]
    ours = one_spatial_level(case, 100)
    if ours is None:
        return
    error = _error(case, EXTENSIBLE, ours)
    yield Measurement("spatial, 100 edges", 1e3 * ours.seconds, "ms", "< 5", "from a spline guess")
    yield Measurement("its true error", to_mm(error), "mm", "", "against shooting")
    for peer in PEERS:
        if peer.few and is_installed(peer):
            took = time_at(case, peer, error)
            if took is None:
                continue
            how = f"{1e3 * took:.3g} ms at that error"
            yield Measurement(f"{peer.name} over spatial", took / ours.seconds, "x", "> 50", how)


def time_at(case: Case, peer: Method, error: float) -> float | None:
    """Time [s] that a peer would take to an error [m], from its two finest settings on logarithmic scales."""
    finest = []
    for setting in peer.settings[-2:]:
        answer = peer.solve(case, setting)
        if answer is not None:
            finest.append((_error(case, peer.truth or peer.model, answer), answer.seconds))
    if len(finest) < 2:
        return None
    (rough, short), (fine, long) = finest
    power = math.log(long / short) / math.log(rough / fine)
    return float(long * (fine / error) ** power)


def linear_cost() -> Iterator[Measurement]:
    """How the time of a solve grows with the number of edges, as a fitted exponent."""
    case = clamps().cases[0]
    spent = [_fastest(one_level(case, PLANAR, n)) for n in PLANAR_SIZES]
    yield _growth("planar", PLANAR_SIZES, spent)
    segment = scene_rod(case.scene, 0)
    spent = []
    for n in SPATIAL_SIZES:
        rod, shape = lift(segment, case.state, n)
        spent.append(best(partial(relax.descend, rod, shape), 0.1))
    yield _growth("spatial", SPATIAL_SIZES, spent)


def _fastest(answer: Solved | None) -> float:
    return answer.seconds if answer else math.nan


def _growth(model: str, sizes: Sequence[int], seconds: Sequence[float]) -> Measurement:
    how = f"{sizes[0]} to {sizes[-1]} edges"
    return Measurement(f"{model} time, power of edges", fitted_exponent(sizes, seconds), "", "< 1.1", how)


def all_states(scenes: Sequence[Scene]) -> Iterator[Measurement]:
    """Every stable state: of eight boundary conditions, and of shape files with all that `simulate` does."""
    rods = [
        ClampedRod(Pose(0.5, mm(height), deg(left), deg(right), mm(length)), Bearing(0.0, 1.0, 0.0))
        for height, left, right, length in BOUNDARY_CONDITIONS
    ]
    found = sum(len(find_states(rod, mm(0.1))) for rod in rods)
    took = best(lambda: [find_states(rod, mm(0.1)) for rod in rods])
    yield Measurement(
        f"{found} states of {len(rods)} boundaries", 1e3 * took, "ms", "< 20", "all stable states, 0.1 mm"
    )
    times = [best(partial(simulate, scene, model=PLANAR), 0.05) / len(scene.segments) for scene in scenes]
    yield Measurement(
        "simulate a segment", 1e3 * float(np.median(times)), "ms", "< 1", f"median of {len(scenes)} shapes"
    )
    yield Measurement("simulate, slowest shape", 1e3 * max(times), "ms", "< 1", "all its stable states")


def many_segments(sizes: Sequence[int] = SEGMENTS) -> Iterator[Measurement]:
    """Displays of many segments, no two alike: every state of each, a proven plan, and how their times grow."""
    scenes = [row(size) for size in sizes]
    for name, unit, action, goal in (
        ("simulate", "ms", simulate, "< 50"),
        ("plan", "s", make_plan, "< 5"),
    ):
        spent = [best(partial(action, scene), 0.2) for scene in scenes]
        last = to_ms(spent[-1]) if unit == "ms" else spent[-1]
        yield Measurement(f"{name} {sizes[-1]} segments", last, unit, goal, "no two alike")
        how = f"{sizes[0]} to {sizes[-1]} segments"
        yield Measurement(f"{name} time, power of segments", fitted_exponent(sizes, spent), "", "< 1.1", how)
