"""Every stable state of a segment: relaxed from two spline guesses, then sought by sweeps over the mean height.

Energy descent from any set of guesses misses states whose basin is tiny near a fold; the sweeps do not rely on basins.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from curveline.rod import spline
from curveline.rod.approach import THIN, approach, easier, graded_mesh, laid_out, layer, loop_edges
from curveline.rod.equilibrium import ClampedRod, Equilibrium, Outcome, refine
from curveline.rod.modes import lowest_eigenvalue
from curveline.rod.planar import Effort, descend, newton
from curveline.rod.problem import Array, Problem, ScaledRod, make_problem, mean_height, mesh, refine_angles, released
from curveline.rod.sweep import (
    CERTIFY,
    SAME,
    Found,
    keep,
    look_closer,
    nothing_found,
    nowhere_near,
    settle_at,
    sweep_heights,
)

SEARCH_EDGES = (24, 96, 384)
"""Edges to search with; the finer ones only where the coarser show no stable state."""
FOLD_EDGES = 384
"""Edges to look at the neighbourhood of a fold: it moves with the square of the edge, 0.1 % at about 100 edges."""
TURNED_EDGES = 48
SEEK_PARTS = 4
"""Parts of an edge where a spline leads to no equilibrium of the coarse rod: that has its folds earlier."""

STEEP = 1.45
"""Clamp angle [rad] from which on more guesses than the two splines are tried; the built-in displays stay below."""
LONG = 2.0
"""Length over chord from which on they are tried, too."""

PEAK = "peak"
VALLEY = "valley"

BARELY = -8.0
"""Lowest eigenvalue of a coarse equilibrium that finer edges may show to be stable after all."""

FALL_EDGES = 12_000
"""Most edges with which a rod leaves a saddle: coarser ones may hold it for stable."""
NUDGE = 0.01
"""Disturbance [rad], neither symmetric nor antisymmetric, with which the rod leaves a saddle."""

RELAX = Effort(turn=0.5, close=1e-7, iterations=150)


def search(rod: ScaledRod, n: int) -> list[tuple[Array, Found]]:
    """Equilibria of a rod without extra turns, stable and unstable, cut into about n edges and, near folds, into finer.

    The rod is relaxed from both splines; every stable state, also those found on the way, is swept towards all others,
    since a sweep that jumps does not pass the same states upwards and downwards; a lone state is swept both ways. A
    spline may relax past a state that is only just stable, so Newton starts from it, too, and where it relaxes into
    nothing new it is swept as well, from its own height; where Newton finds nothing either, it tries once more on finer
    edges, since a state may exist on those alone. Returns pairs of edges and `Found`.
    """
    edges = mesh(rod.at, n)
    parts = max(2, FOLD_EDGES // n)
    fine_edges = np.repeat(edges / parts, parts)
    seek_edges = np.repeat(edges / SEEK_PARTS, SEEK_PARTS)
    problem = make_problem(rod, edges)
    found, found_fine, near = nothing_found(edges.size), nothing_found(fine_edges.size), nowhere_near(edges.size)
    sought = nothing_found(seek_edges.size)
    free = released(problem)
    for side in (1.0, -1.0):
        phi = np.empty(edges.size)
        spline.guess(rod.chord, rod.ends, side, phi)
        is_new = relax_from(free, phi.copy(), found)
        is_there = seek_from(free, phi.copy(), found)
        if not is_new:
            if not is_there:
                finer = released(make_problem(rod, seek_edges))
                seek_from(finer, refine_angles(problem, phi, SEEK_PARTS), sought)
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
    return [(edges, found), (seek_edges, sought), (fine_edges, found_fine)]


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


def search_from_easier(rod: ScaledRod, winding: int) -> list[tuple[Array, Found]]:
    """Stable states reached from those of a slacker and lighter rod, on edges graded towards clamps and loads.

    The loops of further turns lie anywhere: for those all edges are short.
    """
    edges = mesh(rod.at, loop_edges(rod)) if winding else graded_mesh(rod)
    easy = easier(rod, 0.0)
    free, easy_free = released(make_problem(rod, edges)), released(make_problem(easy, edges))
    begun, found = nothing_found(edges.size), nothing_found(edges.size)
    for coarse, met in search_turned(easy, TURNED_EDGES) if winding else _search_harder(easy):
        for i in range(int(met.filled[0])):
            if met.unstable[i] == 0.0:
                relax_from(easy_free, laid_out(edges, coarse, met.shapes[i]), begun)
    for i in range(int(begun.filled[0])):
        phi, force = begun.shapes[i], begun.multipliers[i]
        if approach(rod, edges, phi, force):
            keep(free, found, phi, force, 0)
    return [(edges, found)]


def relax_from(free: Problem, phi: Array, found: Found) -> bool:
    """Go downhill from the guess `phi (n,)` and keep the state it leads to; False if that is none or known."""
    force = np.zeros(2)
    return descend(free, phi, force, RELAX) > 0 and bool(keep(free, found, phi, force, 0))


def seek_from(free: Problem, phi: Array, found: Found) -> bool:
    """Go to an equilibrium near the guess `phi (n,)`, stable or not, and keep it; Newton heeds no ways down.

    Returns False if there is none.
    """
    force = np.zeros(2)
    iterations, unstable = newton(free, phi, force, CERTIFY)
    if iterations > 0:
        keep(free, found, phi, force, unstable)
    return bool(iterations > 0)


def find_states(rod: ClampedRod, tolerance: float, windings: tuple[int, ...] = (0,)) -> list[Equilibrium]:
    """Every stable state of `rod`, each refined to `tolerance` [m], named, the highest over the chord first.

    Complete for the states a planar display can show; of those with further turns of the tangent, `windings`, it lists
    the ones it meets. Where the list is empty, `absence.why_none` says what to change.
    """
    states: list[Equilibrium] = []
    if rod.free_length <= math.hypot(*rod.free_chord):
        return states
    for winding in windings:
        turned = replace(rod, winding=winding)
        scaled = turned.scaled()
        for edges, found in _raw(scaled, winding):
            for i in range(int(found.filled[0])):
                if not _may_be_stable(scaled, edges, found, i):
                    continue
                state = refine(turned, edges, found.shapes[i], found.multipliers[i], tolerance)
                for each in [state] if state.stable else _fallen(state, tolerance):
                    _add(states, each)
    return named(states)


def _fallen(saddle: Equilibrium, tolerance: float) -> list[Equilibrium]:
    """Where the rod goes, either way, from a `saddle` that coarse edges hold for stable: it lies near a pitchfork."""
    rod, n = saddle.rod, saddle.vertices - 1
    while saddle.outcome is Outcome.UNSTABLE and n <= FALL_EDGES:
        scaled = rod.scaled()
        edges = mesh(scaled.at, n)
        free = released(make_problem(scaled, edges))
        phi, force = saddle.start_on(edges)
        if newton(free, phi, force, CERTIFY)[1] > 0:
            found = nothing_found(edges.size)
            for nudge in (NUDGE, -NUDGE):
                places = np.cumsum(edges) - 0.5 * edges
                relax_from(free, phi + nudge * np.sin(2.0 * np.pi * places + 0.4), found)
            shapes, forces = found.shapes, found.multipliers
            return [refine(rod, edges, shapes[i], forces[i], tolerance) for i in range(int(found.filled[0]))]
        n *= 2
    return []


def _may_be_stable(scaled: ScaledRod, edges: Array, found: Found, i: int) -> bool:
    """True unless a coarse equilibrium is clearly unstable: near a bifurcation only finer edges can tell."""
    if found.unstable[i] != 1.0:
        return bool(found.unstable[i] == 0.0)
    free = released(make_problem(scaled, edges))
    return bool(lowest_eigenvalue(free, found.shapes[i], found.multipliers[i], 0.1) > BARELY)


def _raw(scaled: ScaledRod, winding: int) -> list[tuple[Array, Found]]:
    """Edges and equilibria of the scaled rod, from the searches that its length, clamps and loads call for.

    Taut and heavy rods bend in layers too thin for the edges of a search; they are reached from an easier rod, as are
    states that no search shows.
    """
    if layer(scaled) < THIN and _is_stable(met := search_from_easier(scaled, winding)):
        return met
    met = search_turned(scaled, TURNED_EDGES) if winding else _search_harder(scaled)
    if not _is_stable(met):
        met += search_from_easier(scaled, winding)
    return met


def _search_harder(scaled: ScaledRod) -> list[tuple[Array, Found]]:
    """Edges and equilibria from searches with ever finer edges, until one shows a stable state."""
    steep = float(np.max(np.abs(scaled.ends))) > STEEP
    long = LONG * float(np.hypot(*scaled.chord)) < 1.0
    met: list[tuple[Array, Found]] = []
    for n in SEARCH_EDGES:
        met = search(scaled, n)
        if steep or long or n > SEARCH_EDGES[0]:
            met += search_wide(scaled, max(n, TURNED_EDGES))
        if _is_stable(met):
            break
    return met


def _is_stable(met: list[tuple[Array, Found]]) -> bool:
    """True if any of the equilibria is stable."""
    return any(bool(np.any(found.unstable[: int(found.filled[0])] == 0.0)) for _, found in met)


def _add(states: list[Equilibrium], state: Equilibrium) -> None:
    """Append a stable state unless it is there already; the coarse and the fine search may both have met it."""
    if state.outcome in (Outcome.LOST, Outcome.UNSTABLE):
        return
    for other in states:
        near = 0.01 * SAME * state.rod.length + state.error + other.error
        if other.winding == state.winding and np.max(np.abs(other.curve(33) - state.curve(33))) < near:
            return
    states.append(state)


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
