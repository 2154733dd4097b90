"""Every stable state of a segment: relaxed from two arches, then sought by sweeps over the mean height.

Energy descent from any set of guesses misses states whose basin is tiny near a fold; the sweeps do not rely on basins.
What a coarse rod cannot tell, because it has its folds and pitchforks elsewhere by the square of its edges, is asked of
finer ones: see `planar.pairs`, and `_search_harder`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.approach import THIN, approach, easier, graded_mesh, laid_out, layer, loop_edges
from curveline.rod.planar.newton import newton
from curveline.rod.planar.pairs import pairs_near
from curveline.rod.planar.search import divided, let_go_aside, may_be_stable, relax_from, search_edges
from curveline.rod.planar.sweep import BARELY, CERTIFY, SAME, MetEquilibria, keep, nothing_found
from curveline.rod.problem import Array, ScaledRod, make_problem, mesh
from curveline.rod.states.equilibrium import Disturbed, Equilibrium, Outcome, equilibrium_of, refine
from curveline.rod.states.identity import named, same_curve
from curveline.rod.states.plain_states import COARSE_LATERAL, EDGES, LONG, STEEP, VERTICES, Asked, plain_states
from curveline.rod.states.refined import SPREAD

SEARCH_EDGES = (EDGES, 96, 384)
"""Edges to search with; the finer ones only where the coarser show no stable state, or may hide one."""
TURNED_EDGES = 48


FALL_EDGES = 12_000
"""Most edges with which a rod leaves a saddle: coarser ones may hold it for stable."""

MetOnEdges = list[tuple[Array, MetEquilibria]]
"""Edges and the equilibria met on them."""


def search_turned(rod: ScaledRod, n: int) -> MetOnEdges:
    """Stable states of a rod whose clamp angles differ by a further turn: loops on a taut rod.

    The loop starts at either end and in the middle; there is no sweep, so this is a sample, not a complete list.
    """
    edges = mesh(rod.at, n)
    found = nothing_found(edges.size)
    free = make_problem(rod, edges)
    places = np.cumsum(edges) - 0.5 * edges
    for begin in (0.0, 0.25, 0.5):
        turned = np.clip(2.0 * (places - begin), 0.0, 1.0)
        relax_from(free, rod.ends[0] + (rod.ends[1] - rod.ends[0]) * turned, found)
    return [(edges, found)]


def search_wide(rod: ScaledRod, n: int) -> MetOnEdges:
    """Stable states reached downhill from waves of two lengths: for long rods and steep clamps, where arches fold."""
    edges = mesh(rod.at, n)
    found = nothing_found(edges.size)
    free = make_problem(rod, edges)
    places = np.cumsum(edges) - 0.5 * edges
    ramp = rod.ends[0] + (rod.ends[1] - rod.ends[0]) * places
    for first in (0.0, 2.0, -2.0):
        for second in (0.0, 1.5, -1.5, 3.0, -3.0):
            waves = first * np.sin(np.pi * places) + second * np.sin(2.0 * np.pi * places)
            relax_from(free, ramp + waves, found)
    return [(edges, found)]


def search_from_easier(rod: ScaledRod, winding: int) -> MetOnEdges:
    """Stable states reached from those of a slacker and lighter rod, on edges graded towards clamps and loads.

    The loops of further turns lie anywhere: for those all edges are short.
    """
    edges = mesh(rod.at, loop_edges(rod)) if winding else graded_mesh(rod)
    easy = easier(rod, 0.0)
    free, easy_free = make_problem(rod, edges), make_problem(easy, edges)
    begun, found = nothing_found(edges.size), nothing_found(edges.size)
    for coarse, met in search_turned(easy, TURNED_EDGES) if winding else _search_harder(easy)[0]:
        for i in range(int(met.filled[0])):
            if met.unstable[i] == 0.0:
                relax_from(easy_free, laid_out(edges, coarse, met.shapes[i]), begun)
    for i in range(int(begun.filled[0])):
        phi, force = begun.shapes[i], begun.multipliers[i]
        if approach(rod, edges, phi, force):
            keep(free, found, phi, force, 0)
    return [(edges, found)]


def find_states(
    rod: ClampedRod, tolerance: float, windings: tuple[int, ...] = (0,), asked: Asked | None = None
) -> list[Equilibrium]:
    """Every stable state of `rod`, each refined to `tolerance` [m], named, the highest over the chord first.

    Complete for the states a planar display can show; of those with further turns of the tangent, `windings`, it lists
    the ones it meets. Where the list is empty, `no_state_reason.why_none` says what to change. What is `asked` besides
    is found at no further call for the states of rods without difficulties; `model_error` asks it of the others.
    """
    states: list[Equilibrium] = []
    if rod.free_length <= math.hypot(*rod.free_chord):
        return states
    for winding in windings:
        turned = rod if rod.winding == winding else replace(rod, winding=winding)
        if winding == 0 and (plain := _plain(turned, asked or Asked(tolerance, math.nan, math.nan, sideways=False))):
            states += plain
            continue
        scaled = turned.scaled()
        met, finer = _raw(scaled, winding)
        while not _refined(turned, met, tolerance, states) and finer:
            met, finer = _search(scaled, finer[0])[0], finer[1:]
    return named(states)


def _plain(rod: ClampedRod, asked: Asked) -> list[Equilibrium]:
    """All states of a rod that has no difficulties, none of one that has."""
    facts, vertices, behind = plain_states(rod.pose, rod.bearing, *rod.dead_loads(), asked)
    states = []
    end = 0
    for each in facts:
        begin, end = end, end + int(each[VERTICES])
        # Copies, so that a state that is kept does not keep the others.
        state = equilibrium_of(rod, vertices[begin:end].copy(), behind[begin : end - 1].copy(), each, asked.tolerance)
        coarse, fine, stretched, weighed = each[COARSE_LATERAL:VERTICES].tolist()
        states.append(state.but(disturbed=Disturbed(coarse, fine, stretched, weighed, float(each[SPREAD]))))
    return states


def _refined(rod: ClampedRod, met: MetOnEdges, tolerance: float, states: list[Equilibrium]) -> bool:
    """Add the stable states among the equilibria `met` to `states`; False if one of them is lost on finer edges.

    Then it lies near a cusp, where another one may hide.
    """
    kept = True
    for edges, found in met:
        for i in _promising(rod.scaled(), edges, found):
            state = refine(rod, edges, found.shapes[i], found.multipliers[i], tolerance)
            kept = kept and state.outcome is not Outcome.LOST
            if state.stable:
                _add(states, state)
                continue
            # Nearer to a fold the coarse rod may lack what is beside the saddle.
            is_saddle = found.unstable[i] > 0.0 and state.lowest_eigenvalue < BARELY
            for each in _beside(state, (edges, found), i, tolerance) if is_saddle else _fallen(state, tolerance):
                _add(states, each)
    return kept


def _promising(scaled: ScaledRod, edges: Array, found: MetEquilibria) -> Iterator[int]:
    """Numbers of the equilibria that finer edges may show to be stable."""
    unstable = found.unstable[: int(found.filled[0])]
    if 1.0 in unstable:
        yield from np.flatnonzero(may_be_stable(scaled, edges, found)).tolist()
    else:
        yield from np.flatnonzero(unstable == 0.0).tolist()


def _beside(saddle: Equilibrium, met: tuple[Array, MetEquilibria], place: int, tolerance: float) -> list[Equilibrium]:
    """What else the rod goes to, either way, from a `saddle` that it has on coarse edges, too, at a `place`."""
    rod, (edges, found) = saddle.rod, met
    beside = nothing_found(edges.size)
    let_go_aside(make_problem(rod.scaled(), edges), found.shapes[place], beside)
    known = found.shapes[: int(found.filled[0])]
    return [
        refine(rod, edges, beside.shapes[i], beside.multipliers[i], tolerance)
        for i in range(int(beside.filled[0]))
        if not (abs(known - beside.shapes[i]).max(axis=1) < SAME).any()
    ]


def _fallen(saddle: Equilibrium, tolerance: float) -> list[Equilibrium]:
    """Where the rod goes, either way, from a `saddle` that coarse edges hold for stable: it lies near a pitchfork."""
    rod, n = saddle.rod, saddle.vertices - 1
    while saddle.outcome is Outcome.UNSTABLE and n <= FALL_EDGES:
        scaled = rod.scaled()
        edges = mesh(scaled.at, n)
        free = make_problem(scaled, edges)
        phi, force = saddle.start_on(edges)
        if newton(free, phi, force, CERTIFY)[1] > 0:
            found = nothing_found(edges.size)
            let_go_aside(free, phi, found)
            shapes, forces = found.shapes, found.multipliers
            return [refine(rod, edges, shapes[i], forces[i], tolerance) for i in range(int(found.filled[0]))]
        n *= 2
    return []


def _raw(scaled: ScaledRod, winding: int) -> tuple[MetOnEdges, tuple[int, ...]]:
    """Edges and equilibria of the scaled rod, from the searches that its length, clamps and loads call for.

    And the finer edges that were not searched with. Taut and heavy rods bend in layers too thin for the edges of a
    search; they are reached from an easier rod, as are states that no search shows.
    """
    if layer(scaled) < THIN and _is_stable(met := search_from_easier(scaled, winding)):
        return met, ()
    met, finer = (search_turned(scaled, TURNED_EDGES), ()) if winding else _search_harder(scaled)
    if not _is_stable(met):
        met += search_from_easier(scaled, winding)
    return met, finer


def _search_harder(scaled: ScaledRod) -> tuple[MetOnEdges, tuple[int, ...]]:
    """Edges and equilibria from searches with ever finer edges, until one shows a stable state, and the edges left.

    It goes on while a state may hide: beside one that is about to end, or at a fold that could not be followed.
    """
    steep = max(map(abs, scaled.ends.tolist())) > STEEP
    long = LONG * math.hypot(*scaled.chord.tolist()) < 1.0
    met: MetOnEdges = []
    finer: tuple[int, ...] = SEARCH_EDGES
    while finer:
        n, finer = finer[0], finer[1:]
        more, clear = _search(scaled, n)
        if steep or long or (n > SEARCH_EDGES[0] and not _is_stable(met)):
            more += search_wide(scaled, max(n, TURNED_EDGES))
        met += more
        if clear and _is_stable(met):
            break
    return met, finer


def _search(scaled: ScaledRod, n: int) -> tuple[MetOnEdges, bool]:
    """What a search with about n edges meets, and a finer rod near folds; False if finer edges may show more."""
    coarse, sought, near, unclear = search_edges(scaled, divided(mesh(scaled.at, EDGES), n // EDGES))
    if near.filled[0] == 0.0:
        return [coarse, sought], not unclear
    is_followed, known, angles = pairs_near(scaled, coarse[0], near)
    return [coarse, sought, *_beside_dips(coarse[0], known, angles)], is_followed and not unclear


def _beside_dips(edges: Array, known: Array, angles: Array) -> MetOnEdges:
    """What `pairs_near` found beside dips on `edges (n,)`, each state on its own, which are parts of these."""
    met: MetOnEdges = []
    end = 0
    for count, unstable, *force in known.tolist():
        n = int(count)
        begin, end = end, end + n
        shapes, one = angles[begin:end].reshape(1, n).copy(), np.ones(1)
        met.append((divided(edges, n // edges.size), MetEquilibria(shapes, np.array([force]), unstable * one, one)))
    return met


def _is_stable(met: MetOnEdges) -> bool:
    """True if any of the equilibria is stable."""
    return any(0.0 in found.unstable[: int(found.filled[0])] for _, found in met if found.filled[0])


def _add(states: list[Equilibrium], state: Equilibrium) -> None:
    """Append a stable state unless it is there already; the coarse and the fine search may both have met it."""
    if state.outcome not in (Outcome.LOST, Outcome.UNSTABLE) and not any(same_curve(state, other) for other in states):
        states.append(state)
