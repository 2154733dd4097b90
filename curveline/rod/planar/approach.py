"""States of taut and heavy rods: reached from an easier rod, on edges graded towards the places where it bends.

A rod that is nearly straight between clamps that point elsewhere, or that hangs like a chain, is straight or a catenary
but for layers at its clamps and under its loads, of thickness d = 1 / sqrt(T) under the tension T (in units of its
length and EI). With the angle a between a clamp and the taut rod, a layer takes up the length 2 d (1 - cos(a / 2)),
the loop of Euler's elastica (Love 1927, section 263), so the excess length tells how thin the layers are.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.forms import Vector
from curveline.kernels.kernel import shipped
from curveline.rod.planar.newton import Effort, descend
from curveline.rod.problem import Array, ScaledRod, make_problem, mesh, sharpest_turn, stretching_by

THIN = 0.03
"""Thickness of the layers, in units of the length, below which the edges are graded."""
PER_LAYER = 8
"""Edges per thickness of a layer, and per doubling of the distance from where it begins."""
INNER_EDGES = 48
PER_DROP = 6.0
"""Edges per length (EI / w)^(1/3), over which weight bends a rod, outside the layers."""
MOST_INNER = 3000.0

SLACK = 0.15
LOOP_SLACK = 0.35
LIGHT = 300.0
LIGHT_LOAD = 100.0
"""Excess length (plain and per further turn), weight and load of a rod whose states are found on a few edges."""

LARGEST_STEP = 0.25
SMALLEST_STEP = 1e-3
STEPS = 120
SOFTENING = 10.0
"""Powers of ten over which a rod is allowed to stretch, one after the other."""
DESCEND = Effort(turn=0.5, close=1e-7, iterations=80)


@shipped(ScaledRod)
def layer(rod):
    """Thickness of the layers in which a taut or heavy `ScaledRod` bends, in units of its length; large if it has none.

    An estimate from below: grading for a thinner layer than there is costs a few edges.
    """
    excess = max(1.0 - np.hypot(rod.chord[0], rod.chord[1]), 1e-15)
    along = np.arctan2(rod.chord[1], rod.chord[0])
    taken = 0.0
    for end in range(2):
        angle = rod.ends[end] - along
        angle -= 2.0 * np.pi * np.round(angle / (2.0 * np.pi))
        taken += 2.0 * (1.0 - np.cos(0.5 * angle))
    turns = abs(rod.ends[1] - rod.ends[0]) / (2.0 * np.pi)
    taken += 4.0 * max(0.0, np.floor(turns))
    pull = abs(rod.weight) * (1.0 + 1.0 / np.sqrt(24.0 * excess))
    for p in range(rod.at.size):
        pull += np.hypot(rod.forces[p, 0], rod.forces[p, 1]) * (1.0 + 0.5 / np.sqrt(excess))
    return min(excess / max(taken, 1e-15), 1.0 / np.sqrt(max(pull, 1e-15)))


@shipped(ScaledRod)
def graded_mesh(rod):
    """Edges (n,) of a rod of unit length with layers: short at the clamps and loads, doubling away from them."""
    inner = 1.0 / max(INNER_EDGES, min(PER_DROP * np.cbrt(abs(rod.weight)), MOST_INNER))
    first = min(layer(rod) / PER_LAYER, inner)
    out = np.empty(200_000)
    n = 0
    places = rod.at.size + 1
    for i in range(places):
        begin = rod.at[i - 1] if i > 0 else 0.0
        piece = (rod.at[i] if i < places - 1 else 1.0) - begin
        if piece <= 1e-9:
            continue
        start = n
        half = 0.5 * piece
        edge = min(first, 0.25 * piece)
        run = 0.0
        while edge < inner and run + PER_LAYER * edge < half:
            for _ in range(PER_LAYER):
                out[n] = edge
                n += 1
            run += PER_LAYER * edge
            edge *= 2.0
        stop = n
        middle = max(2, int(np.ceil((piece - 2.0 * run) / min(edge, inner))))
        for _ in range(middle):
            out[n] = (piece - 2.0 * run) / middle
            n += 1
        for j in range(stop - 1, start - 1, -1):
            out[n] = out[j]
            n += 1
    return out[:n].copy()


@shipped(ScaledRod)
def loop_edges(rod):
    """Number of equal edges that are short enough for loops anywhere on the rod."""
    return int(max(INNER_EDGES, min(PER_LAYER / layer(rod), MOST_INNER)))


@shipped(ScaledRod, float)
def easier(rod, share):
    """The `rod` made slacker and lighter: itself for a `share` of 1, one that the sweeps can search for 0."""
    span = np.hypot(rod.chord[0], rod.chord[1])
    excess = 1.0 - span
    turns = np.floor(abs(rod.ends[1] - rod.ends[0]) / (2.0 * np.pi) + 0.1)
    slack = max(excess, min(SLACK + turns * LOOP_SLACK, 0.8)) ** (1.0 - share) * excess**share
    weight = abs(rod.weight)
    if weight > LIGHT:
        weight = LIGHT ** (1.0 - share) * weight**share
    heaviest = 0.0
    for p in range(rod.at.size):
        heaviest = max(heaviest, np.hypot(rod.forces[p, 0], rod.forces[p, 1]))
    factor = 1.0
    if heaviest > LIGHT_LOAD:
        factor = (LIGHT_LOAD / heaviest) ** (1.0 - share)
    chord = rod.chord * ((1.0 - slack) / span) if span > 0.0 else rod.chord
    return ScaledRod(
        np.sign(rod.weight) * weight,
        rod.at,
        rod.forces * factor,
        chord,
        rod.ends,
        rod.compliance,
        rod.give,
        rod.play,
        rod.natural,
        rod.reach,
        rod.profile,
        rod.begin,
        rod.unit,
    )


@shipped(ScaledRod, Vector, Vector, Vector)
def approach(rod, edges, phi, multipliers):
    """Follow a stable state, `phi (n,)` on `edges (n,)` and `multipliers (2,)`, from the easiest rod to `rod` itself.

    Downhill at every step, so that it goes on after a fold, with another state. `phi` and `multipliers` are
    overwritten; returns False if the way ends.
    """
    reached = 0.0
    step = 0.0
    for _ in range(STEPS):
        share = min(1.0, reached + step)
        free = make_problem(easier(rod, share), edges)
        trial = phi.copy()
        force = multipliers.copy()
        if descend(free, trial, force, DESCEND) > 0 and sharpest_turn(free, trial) < 1.0:
            phi[:] = trial
            multipliers[:] = force
            reached = share
            if reached == 1.0:
                return True
            step = LARGEST_STEP if step == 0.0 else min(LARGEST_STEP, 2.0 * step)
        else:
            step *= 0.5
            if step < SMALLEST_STEP:
                return False
    return False


@shipped(ScaledRod, Vector, Vector, Vector)
def soften(rod, edges, phi, multipliers):
    """Follow a stable state of an inextensible rod, as `approach` does, while it is allowed to stretch more and more.

    The forces in a taut rod fall by as many powers of ten as its compliance rises, so that no single step would do.
    """
    for power in np.arange(-SOFTENING, 0.5, 0.5):
        compliance = rod.compliance * 10.0**power
        free = make_problem(stretching_by(rod, compliance), edges)
        if descend(free, phi, multipliers, DESCEND) < 0:
            return False
    return True


def fitting_mesh(rod: ScaledRod, n: int) -> Array:
    """About `n` equal edges (m,) of a rod of unit length, or graded ones if it bends in layers."""
    return np.asarray(graded_mesh(rod) if layer(rod) < THIN else mesh(rod.at, n))


def laid_out(edges: Array, coarse: Array, phi: Array) -> Array:
    """Angles on `edges (n,)` of a curve given by `phi (m,)` on the `coarse (m,)` edges."""
    middles = np.cumsum(edges) - 0.5 * edges
    places = np.cumsum(coarse) - 0.5 * coarse
    return np.interp(middles, places, phi)
