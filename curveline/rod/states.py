"""Every stable state of a segment: relaxed from two spline guesses, then sought by sweeps over the mean height.

Energy descent from any set of guesses misses states whose basin is tiny near a fold; the sweeps do not rely on basins.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from curveline.rod.approach import THIN, approach, easier, graded_mesh, laid_out, layer, loop_edges
from curveline.rod.equilibrium import ClampedRod, Equilibrium, Outcome, refine
from curveline.rod.identity import named, same_curve
from curveline.rod.planar import newton
from curveline.rod.problem import Array, ScaledRod, make_problem, mesh, refine_angles, released
from curveline.rod.search import divided, may_be_stable, relax_from, search_edges
from curveline.rod.sweep import CERTIFY, Found, keep, look_closer, nothing_found

FOLD_EDGES = 384
"""Edges to look at the neighbourhood of a fold: it moves with the square of the edge, 0.1 % at about 100 edges."""
SEARCH_EDGES = (24, 96, 384)
"""Edges to search with; the finer ones only where the coarser show no stable state."""
TURNED_EDGES = 48

STEEP = 1.45
"""Clamp angle [rad] from which on more guesses than the two splines are tried; the built-in displays stay below."""
LONG = 2.0
"""Length over chord from which on they are tried, too."""

FALL_EDGES = 12_000
"""Most edges with which a rod leaves a saddle: coarser ones may hold it for stable."""
NUDGE = 0.01
"""Disturbance [rad], neither symmetric nor antisymmetric, with which the rod leaves a saddle."""

Met = list[tuple[Array, Found]]
"""Edges and the equilibria met on them."""


def search_turned(rod: ScaledRod, n: int) -> Met:
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


def search_wide(rod: ScaledRod, n: int) -> Met:
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


def search_from_easier(rod: ScaledRod, winding: int) -> Met:
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


def find_states(rod: ClampedRod, tolerance: float, windings: tuple[int, ...] = (0,)) -> list[Equilibrium]:
    """Every stable state of `rod`, each refined to `tolerance` [m], named, the highest over the chord first.

    Complete for the states a planar display can show; of those with further turns of the tangent, `windings`, it lists
    the ones it meets. Where the list is empty, `absence.why_none` says what to change.
    """
    states: list[Equilibrium] = []
    if rod.free_length <= math.hypot(*rod.free_chord):
        return states
    for winding in windings:
        turned = rod if rod.winding == winding else replace(rod, winding=winding)
        scaled = turned.scaled()
        for edges, found in _raw(scaled, winding):
            for i in _promising(scaled, edges, found):
                state = refine(turned, edges, found.shapes[i], found.multipliers[i], tolerance)
                for each in [state] if state.stable else _fallen(state, tolerance):
                    _add(states, each)
    return named(states)


def _promising(scaled: ScaledRod, edges: Array, found: Found) -> Iterator[int]:
    """Numbers of the equilibria that finer edges may show to be stable."""
    unstable = found.unstable[: int(found.filled[0])]
    if 1.0 in unstable:
        yield from np.flatnonzero(may_be_stable(scaled, edges, found)).tolist()
    else:
        yield from np.flatnonzero(unstable == 0.0).tolist()


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


def _raw(scaled: ScaledRod, winding: int) -> Met:
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


def _search_harder(scaled: ScaledRod) -> Met:
    """Edges and equilibria from searches with ever finer edges, until one shows a stable state."""
    steep = max(map(abs, scaled.ends.tolist())) > STEEP
    long = LONG * math.hypot(*scaled.chord.tolist()) < 1.0
    met: Met = []
    for n in SEARCH_EDGES:
        met = _search(scaled, n)
        if steep or long or n > SEARCH_EDGES[0]:
            met += search_wide(scaled, max(n, TURNED_EDGES))
        if _is_stable(met):
            break
    return met


def _search(scaled: ScaledRod, n: int) -> Met:
    """What a search with about n edges meets, and what a finer rod shows where it came near a fold.

    That is rare, so it is no part of the kernel: the first run need not wait for it to be compiled.
    """
    coarse, sought, near = search_edges(scaled, n)
    if near.filled[0] == 0.0:
        return [coarse, sought]
    problem = make_problem(scaled, coarse[0])
    parts = max(2, FOLD_EDGES // n)
    edges = divided(coarse[0], parts)
    found, fine = nothing_found(edges.size), make_problem(scaled, edges)
    for place in range(int(near.filled[0])):
        shape = refine_angles(problem, near.shapes[place], parts)
        look_closer(fine, near.heights[place], shape, near.forces[place].copy(), found)
    return [coarse, sought, (edges, found)]


def _is_stable(met: Met) -> bool:
    """True if any of the equilibria is stable."""
    return any(0.0 in found.unstable[: int(found.filled[0])] for _, found in met if found.filled[0])


def _add(states: list[Equilibrium], state: Equilibrium) -> None:
    """Append a stable state unless it is there already; the coarse and the fine search may both have met it."""
    if state.outcome not in (Outcome.LOST, Outcome.UNSTABLE) and not any(same_curve(state, other) for other in states):
        states.append(state)
