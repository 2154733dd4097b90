"""Rods for the physics tests: the reference cases, random scenes, and plain discrete solutions of one level."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from clamped_rods import rod_between
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.newton import Effort, newton
from curveline.rod.planar.richardson import level_scalars, vertex_table
from curveline.rod.problem import Array, Problem, make_problem, mesh
from curveline.rod.states.equilibrium import Equilibrium

DATA = Path(__file__).parent.parent / "data"
REFERENCE = json.loads((DATA / "reference_cases.json").read_text())
DISPLAY = json.loads((DATA / "reference_display.json").read_text())["cases"]

EXACT = Effort(turn=0.3, close=1e-9, iterations=60)

STIFFNESS = 0.028224
WEIGHT = 0.4707192
"""EI [N m^2] and weight [N/m] of the built-in displays' rod."""


class Level(NamedTuple):
    """A discrete equilibrium as it is, without extrapolation, in units of the free length and EI."""

    problem: Problem
    phi: Array
    multipliers: Array
    table: Array
    scalars: Array
    unstable: int


def solve_level(rod: ClampedRod, n: int, phi: Array, multipliers: Array) -> Level:
    """The equilibrium of `rod` on n edges that Newton reaches from `phi (n,)`, `multipliers (2,)`."""
    scaled = rod.scaled()
    problem = make_problem(scaled, mesh(scaled.at, n))
    phi, multipliers = phi.copy(), multipliers.copy()
    iterations, unstable = newton(problem, phi, multipliers, EXACT)
    assert iterations > 0
    table = vertex_table(problem, phi, multipliers)
    return Level(problem, phi, multipliers, table, level_scalars(problem, phi, multipliers, table), unstable)


def reference_rod(case: dict[str, Any], loads: tuple[tuple[float, float, float], ...] = ()) -> ClampedRod:
    """The rod of a case in reference_cases.json, where EI = 1 and the clamps are points."""
    weight = -case.get("gravity_w", (0.0, 0.0))[1]
    return rod_between(
        (case["x2"], case["y"]), case["theta1"], case["theta2"], case["L"], 0.0, 1.0, weight, loads=loads
    )


def display_rod(case: dict[str, Any]) -> ClampedRod:
    """The rod of a case in reference_display.json."""
    start, end = (math.radians(case[key]) for key in ("theta1_deg", "theta2_deg"))
    return rod_between((0.5, case["y"]), start, end, case["L"], case["clamp"], case["EI"], case["weight_per_length"])


def random_rods(seed: int, count: int) -> list[ClampedRod]:
    """Scenes of the built-in display: height +-120 mm, angles +-45 deg, length 560 to 800 mm."""
    rng = np.random.default_rng(seed)
    rods = []
    for _ in range(count):
        height, length = float(rng.uniform(-0.12, 0.12)), float(rng.uniform(0.56, 0.8))
        start, end = (float(angle) for angle in np.radians(rng.uniform(-45.0, 45.0, 2)))
        rods.append(rod_between((0.5, height), start, end, length, 0.02, STIFFNESS, WEIGHT))
    return rods


def distance(state: Equilibrium, curve: Array) -> float:
    """Largest distance between a state and a `curve (m, 2)` [m] given at equal steps of arc length, pivot to pivot."""
    return float(np.max(np.linalg.norm(state.curve(len(curve)) - curve, axis=1)))


def simple(states: list[Equilibrium]) -> list[Equilibrium]:
    """Those that a planar display can show."""
    return [state for state in states if state.simple]
