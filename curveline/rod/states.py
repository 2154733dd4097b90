"""Every stable state of a segment: two spline guesses, then a sweep over the curve's mean height.

Energy descent from any set of guesses misses states whose basin is tiny near a fold. The sweep does not rely on
basins: it holds the mean height m of the curve over its chord by one more constraint and follows the constrained
minimum from every state found, upwards and downwards. The constraint's multiplier is the slope of the energy along the
sweep, so each of its zeros is an equilibrium; where it only comes near zero, between two samples or because the coarse
rod just misses a fold, the neighbourhood is looked at again with a finer rod.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from curveline.rod import spline
from curveline.rod._jit import njit
from curveline.rod.equilibrium import ClampedRod, Equilibrium, Outcome, refine
from curveline.rod.planar import Effort, descend, lowest_eigenvalue, newton
from curveline.rod.problem import (
    Array,
    Problem,
    ScaledRod,
    copy_into,
    largest_change,
    make_problem,
    mean_height,
    mesh,
    refine_angles,
    released,
    sharpest_turn,
)

SEARCH_EDGES = (24, 96, 384)
"""Edges to search with; the finer ones only where the coarser show no stable state."""
FOLD_EDGES = 384
"""Edges to look at the neighbourhood of a fold: it moves with the square of the edge, 0.1 % at about 100 edges."""
CAPACITY = 24
NEAR_PLACES = 8
TURNED_EDGES = 48

STEEP = 1.45
"""Clamp angle [rad] from which on more guesses than the two splines are tried; the built-in displays stay below."""
LONG = 2.0
"""Length over chord from which on they are tried, too."""

PEAK = "peak"
VALLEY = "valley"

NUDGE = 0.03
"""S-shaped disturbance [rad] that takes a constrained rod off an unstable symmetric shape."""
STRIDE = 0.025
"""Step of the mean height in a sweep, in units of the length."""
FAR = 300.0
"""Slope of the energy at which a sweep ends; in the scenes searched by brute force no state lay beyond."""
NEAR = 12.0
"""Extreme of the energy's slope below which a pair of states may hide between samples or from the coarse rod."""
SHARPEST = 1.0
"""Turn between neighbouring edges [rad] from which on a coarse shape counts as an artefact."""
BARELY = -8.0
"""Lowest eigenvalue of a coarse equilibrium that finer edges may show to be stable after all."""
SAME = 1e-3
"""Edges' angles [rad] that differ by less belong to the same state."""

FOLLOW = Effort(turn=0.5, close=1e-3, iterations=12)
SETTLE = Effort(turn=0.5, close=1e-3, iterations=15)
CERTIFY = Effort(turn=0.3, close=1e-7, iterations=40)
RELAX = Effort(turn=0.5, close=1e-7, iterations=150)


class Found(NamedTuple):
    """Equilibria met so far: `shapes (c, n)`, `multipliers (c, 2)`, `unstable (c,)`, `filled (1,)` how many."""

    shapes: Array
    multipliers: Array
    unstable: Array
    filled: Array


class Near(NamedTuple):
    """Where a sweep's slope of the energy came near zero: three heights each, and the rod in the middle one.

    `heights (c, 3)`, `shapes (c, n)`, multipliers `forces (c, 3)`, `filled (1,)` how many.
    """

    heights: Array
    shapes: Array
    forces: Array
    filled: Array


def nowhere_near(n: int) -> Near:
    """An empty `Near` for rods of n edges."""
    return Near(np.empty((NEAR_PLACES, 3)), np.empty((NEAR_PLACES, n)), np.empty((NEAR_PLACES, 3)), np.zeros(1))


def nothing_found(n: int) -> Found:
    """An empty `Found` for rods of n edges."""
    return Found(np.empty((CAPACITY, n)), np.empty((CAPACITY, 2)), np.empty(CAPACITY), np.zeros(1))


@njit
def keep(problem, found, phi, multipliers, unstable):
    """Add an equilibrium to `found` unless it is an artefact, already there, or there is no room."""
    if unstable < 0 or sharpest_turn(problem, phi) > SHARPEST:
        return False
    count = int(found.filled[0])
    for i in range(count):
        if largest_change(found.shapes[i], phi) < SAME:
            return False
    if count == found.shapes.shape[0]:
        return False
    copy_into(found.shapes[count], phi)
    copy_into(found.multipliers[count], multipliers)
    found.unstable[count] = unstable
    found.filled[0] += 1
    return True


@njit
def settle_at(problem, height, phi, multipliers, backup):
    """Solve with the mean height held at `height`: Newton, or downhill from `backup (n,)` where that is unstable.

    `phi (n,)` and `multipliers (3,)` are overwritten; returns False if there is no such constrained minimum.
    """
    problem.targets[2] = height
    kept = multipliers.copy()
    iterations, unstable = newton(problem, phi, multipliers, FOLLOW)
    if iterations < 0 or unstable != 0:
        copy_into(phi, backup)
        copy_into(multipliers, kept)
        # Off the symmetric path by a small S, or the descent could sit on it.
        n = phi.size
        for j in range(n):
            phi[j] += NUDGE * np.sin(2.0 * np.pi * (j + 0.5) / n)
        iterations = descend(problem, phi, multipliers, SETTLE)
    return iterations > 0 and sharpest_turn(problem, phi) < SHARPEST


@njit
def parabola_vertex(at, values):
    """Abscissa of the vertex of the parabola through three points; NaN if they lie on a line."""
    first = (values[1] - values[0]) / (at[1] - at[0])
    second = (values[2] - values[1]) / (at[2] - at[1])
    bend = (second - first) / (at[2] - at[0])
    return 0.5 * (at[0] + at[1] - first / bend) if bend != 0.0 else np.nan


@njit
def look_closer(problem, heights, phi, multipliers, found):
    """Look for a pair of states near a fold on a finer rod: the energy's slope came near zero between three `heights`.

    Successive parabolic interpolation seeks the extremum of the slope. Once the slope changes sign, a pair of states
    exists, and the rod is released from every height that was tried. `phi (n,)`, `multipliers (3,)` are overwritten.
    """
    tries = 7
    at = np.empty(tries)
    slopes = np.empty(tries)
    shapes = np.empty((tries, phi.size))
    forces = np.empty((tries, 3))
    tried = 0
    crossed = False
    while tried < tries and not (crossed and tried > 3):
        height = heights[tried] if tried < 3 else parabola_vertex(at[tried - 3 : tried], slopes[tried - 3 : tried])
        if not abs(height - heights[1]) <= abs(heights[2] - heights[1]) + 1e-12:
            break
        backup = phi.copy()
        if not settle_at(problem, height, phi, multipliers, backup):
            break
        at[tried] = height
        slopes[tried] = multipliers[2]
        copy_into(shapes[tried], phi)
        copy_into(forces[tried], multipliers)
        crossed = crossed or slopes[tried] * slopes[0] < 0.0
        tried += 1
    if not crossed:
        return
    free = released(problem)
    for i in range(tried):
        force = forces[i, :2].copy()
        iterations, unstable = newton(free, shapes[i], force, CERTIFY)
        if iterations > 0:
            keep(problem, found, shapes[i], force, unstable)


@njit
def nearly_zero(before, here, after):
    """True if the slope of the energy came near zero and turned round: the parabola's vertex is below `NEAR`."""
    if before * here <= 0.0 or here * after <= 0.0 or abs(here) > abs(before) or abs(here) > abs(after):
        return False
    bend = before - 2.0 * here + after
    return abs(here) - 0.125 * (after - before) ** 2 / abs(bend) < NEAR


@njit
def predict(now, before, out):
    """Linear extrapolation of two equally spaced values, componentwise, into `out`."""
    for j in range(now.size):
        out[j] = 2.0 * now[j] - before[j]


@njit
def sweep_heights(problem, start, direction, found, near):
    """Follow the constrained minimum `start`, angles (n,) and multipliers (3,), while the mean height rises or falls.

    `direction` is 1 or -1. Equilibria that are met go to `found`, places worth a closer look to `near`.
    """
    shape, held = start
    phi = shape.copy()
    multipliers = held.copy()
    free = released(problem)
    height = mean_height(problem, phi)
    before = phi.copy()
    before_forces = multipliers.copy()
    guess = phi.copy()
    forces = multipliers.copy()
    slopes = np.array([0.0, held[2]])
    for count in range(60):
        height += direction * STRIDE
        predict(phi, before, guess)
        predict(multipliers, before_forces, forces)
        copy_into(before, phi)
        copy_into(before_forces, multipliers)
        if not settle_at(problem, height, guess, forces, before):
            return
        copy_into(phi, guess)
        copy_into(multipliers, forces)
        slope = multipliers[2]
        if slopes[1] != 0.0 and slope * slopes[1] <= 0.0:
            if abs(slope) > abs(slopes[1]):
                copy_into(guess, before)
                copy_into(forces, before_forces)
            force = forces[:2].copy()
            iterations, unstable = newton(free, guess, force, CERTIFY)
            if iterations > 0:
                keep(problem, found, guess, force, unstable)
        elif count > 1 and nearly_zero(slopes[0], slopes[1], slope):
            heights = np.array([height - 2.0 * direction * STRIDE, height - direction * STRIDE, height])
            place = int(near.filled[0])
            if place < near.heights.shape[0]:
                copy_into(near.heights[place], heights)
                copy_into(near.shapes[place], before)
                copy_into(near.forces[place], before_forces)
                near.filled[0] += 1
        if abs(slope) > FAR:
            return
        slopes[0] = slopes[1]
        slopes[1] = slope


def search(rod: ScaledRod, n: int) -> list[tuple[Array, Found]]:
    """Equilibria of a rod without extra turns, stable and unstable, cut into about n edges and, near folds, into finer.

    The rod is relaxed from both splines; every stable state, also those found on the way, is swept towards all others,
    since a sweep that jumps does not pass the same states upwards and downwards; a lone state is swept both ways. A
    spline may relax past a state that is only just stable, so Newton starts from it, too, and where it relaxes into
    nothing new it is swept as well, from its own height. Returns pairs of edges and `Found`.
    """
    edges = mesh(rod.at, n)
    parts = max(2, FOLD_EDGES // n)
    fine_edges = np.repeat(edges / parts, parts)
    problem = make_problem(rod, edges)
    found, found_fine, near = nothing_found(edges.size), nothing_found(fine_edges.size), nowhere_near(edges.size)
    free = released(problem)
    for side in (1.0, -1.0):
        phi = np.empty(edges.size)
        spline.guess(rod.chord, rod.ends, side, phi)
        is_new = relax_from(free, phi.copy(), found)
        seek_from(free, phi.copy(), found)
        if not is_new:
            held = np.zeros(3)
            if settle_at(problem, mean_height(problem, phi), phi, held, phi.copy()):
                for direction in (1.0, -1.0):
                    sweep_heights(problem, (phi, held), direction, found, near)
    swept = 0
    while swept < found.filled[0]:
        if found.unstable[swept] == 0.0:
            held = np.append(found.multipliers[swept], 0.0)
            for direction in _ways(problem, found, swept):
                sweep_heights(problem, (found.shapes[swept], held), direction, found, near)
        swept += 1
    for place in range(int(near.filled[0])):
        shape = refine_angles(problem, near.shapes[place], parts)
        fine_problem = make_problem(rod, fine_edges)
        look_closer(fine_problem, near.heights[place], shape, near.forces[place].copy(), found_fine)
    return [(edges, found), (fine_edges, found_fine)]


def _ways(problem: Problem, found: Found, start: int) -> list[float]:
    """Where to sweep from a stable state: up (1) and down (-1), but not away from all other stable states."""
    count = int(found.filled[0])
    others = [mean_height(problem, found.shapes[i]) for i in range(count) if found.unstable[i] == 0.0 and i != start]
    height = mean_height(problem, found.shapes[start])
    return [way for way in (1.0, -1.0) if not others or any((other - height) * way > 0.0 for other in others)]


def search_turned(rod: ScaledRod, n: int) -> list[tuple[Array, Found]]:
    """Stable states of a rod whose clamp angles differ by a further turn: loops on a taut rod.

    The loop starts at either end and in the middle; there is no sweep, so this is a sample, not a complete list.
    """
    edges = mesh(rod.at, n)
    found = nothing_found(edges.size)
    free = released(make_problem(rod, edges))
    places = np.cumsum(edges) - 0.5 * edges
    for begin in (0.0, 0.25, 0.5):
        turned = np.clip(2.0 * (places - begin), 0.0, 1.0)
        relax_from(free, rod.ends[0] + (rod.ends[1] - rod.ends[0]) * turned, found)
    return [(edges, found)]


def search_wide(rod: ScaledRod, n: int) -> list[tuple[Array, Found]]:
    """Stable states reached downhill from waves of two lengths: for long rods and steep clamps, where splines fold."""
    edges = mesh(rod.at, n)
    found = nothing_found(edges.size)
    free = released(make_problem(rod, edges))
    places = np.cumsum(edges) - 0.5 * edges
    ramp = rod.ends[0] + (rod.ends[1] - rod.ends[0]) * places
    for first in (0.0, 2.0, -2.0):
        for second in (0.0, 1.5, -1.5, 3.0, -3.0):
            waves = first * np.sin(np.pi * places) + second * np.sin(2.0 * np.pi * places)
            relax_from(free, ramp + waves, found)
    return [(edges, found)]


def relax_from(free: Problem, phi: Array, found: Found) -> bool:
    """Go downhill from the guess `phi (n,)` and keep the state it leads to; False if that is none or known."""
    force = np.zeros(2)
    return descend(free, phi, force, RELAX) > 0 and bool(keep(free, found, phi, force, 0))


def find_states(rod: ClampedRod, tolerance: float, windings: tuple[int, ...] = (0,)) -> list[Equilibrium]:
    """Every stable state of `rod`, each refined to `tolerance` [m], named, the highest over the chord first.

    Complete for the states a planar display can show; of those with further turns of the tangent, `windings`, it lists
    the ones it meets.
    """
    states: list[Equilibrium] = []
    for winding in windings:
        turned = replace(rod, winding=winding)
        scaled = turned.scaled()
        for edges, found in _raw(scaled, winding):
            for i in range(int(found.filled[0])):
                if _may_be_stable(scaled, edges, found, i):
                    _add(states, refine(turned, edges, found.shapes[i], found.multipliers[i], tolerance))
    return named(states)


def _may_be_stable(scaled: ScaledRod, edges: Array, found: Found, i: int) -> bool:
    """True unless a coarse equilibrium is clearly unstable: near a bifurcation only finer edges can tell."""
    if found.unstable[i] != 1.0:
        return bool(found.unstable[i] == 0.0)
    free = released(make_problem(scaled, edges))
    return bool(lowest_eigenvalue(free, found.shapes[i], found.multipliers[i], 0.1) > BARELY)


def _raw(scaled: ScaledRod, winding: int) -> list[tuple[Array, Found]]:
    """Edges and equilibria of the scaled rod, from the searches that its length and clamps call for.

    Where a rod shows no stable state, it is looked at again with finer edges: taut and heavy rods bend in short pieces.
    """
    if winding:
        return search_turned(scaled, TURNED_EDGES)
    steep = float(np.max(np.abs(scaled.ends))) > STEEP
    long = LONG * float(np.hypot(*scaled.chord)) < 1.0
    met: list[tuple[Array, Found]] = []
    for n in SEARCH_EDGES:
        met = search(scaled, n)
        if steep or long or n > SEARCH_EDGES[0]:
            met += search_wide(scaled, max(n, TURNED_EDGES))
        if any(np.any(found.unstable[: int(found.filled[0])] == 0.0) for _, found in met):
            break
    return met


def _add(states: list[Equilibrium], state: Equilibrium) -> None:
    """Append a stable state unless it is there already; the coarse and the fine search may both have met it."""
    if state.outcome in (Outcome.LOST, Outcome.UNSTABLE):
        return
    for other in states:
        near = 0.01 * SAME * state.rod.length + state.error + other.error
        if other.winding == state.winding and np.max(np.abs(other.curve(33) - state.curve(33))) < near:
            return
    states.append(state)


def seek_from(free: Problem, phi: Array, found: Found) -> None:
    """Go to an equilibrium near the guess `phi (n,)`, stable or not, and keep it; Newton heeds no ways down."""
    force = np.zeros(2)
    iterations, unstable = newton(free, phi, force, CERTIFY)
    if iterations > 0:
        keep(free, found, phi, force, unstable)


def named(states: list[Equilibrium]) -> list[Equilibrium]:
    """The states with their names: of two that can be shown the higher is the peak; a single one goes by its side."""
    states = sorted(states, key=lambda state: (not state.simple, -state.mean_height))
    shown = [state for state in states if state.simple]
    names = [PEAK, *(f"middle-{i}" for i in range(1, len(shown) - 1)), VALLEY]
    if len(shown) < 2:
        names = [PEAK if state.mean_height > 0.0 else VALLEY for state in shown]
    for state in states[len(shown) :]:
        kind = "loop" if state.winding else "crossing" if state.crosses_itself else "wrapped"
        names.append(f"{kind}-{1 + sum(name.startswith(kind) for name in names)}")
    return [replace(state, name=name) for state, name in zip(states, names, strict=True)]
