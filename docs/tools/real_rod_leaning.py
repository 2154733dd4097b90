"""How far the right node may turn where a rod bends harder to one side: M = EI (1 + a sgn(k)) k of its curvature k.

A discrete rod of its own between rigid bearings, for `docs/tools/real_rod.py`: straight edges, bending over half cells
at the bearings and whole ones between, as curveline's is, with a stiffness for either side. Newton's method follows the
peak while the right node turns, in steps that are halved where it fails or the energy has no minimum any more.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from real_rod_rods import state_of

from curveline.scene import PEAK, Scene
from curveline.simulation.simulate import scene_rod
from curveline.units import deg, to_deg

Array = npt.NDArray[np.float64]

EDGES = 256
STEP, FINEST = deg(1.0), deg(0.002)
"""By which the node turns at first, and at last."""
ITERATIONS, CLOSE, FARTHEST = 30, 1e-10, 0.3
"""Of Newton's method, the change [rad] by which it ends, and the largest that an edge may make."""
SHARES = 4
"""Steps in which the rod gets harder to one side."""


class Held(NamedTuple):
    """A rod in units of its free length and EI: weight, bearings, and by how much it is harder one way."""

    weight: float
    chord: Array  # (2,) between the mouths
    start: float  # [rad]
    end: float  # [rad]
    share: float


def leaning_limit(scene: Scene, share: float, edges: int = EDGES) -> float:
    """How far [deg] the right node of a shape of one segment may turn before its peak ceases to exist.

    The rod is stiffer by a `share` where it bends counter-clockwise, and softer by it the other way.
    """
    peak = state_of(scene, PEAK)
    assert peak is not None
    phi, multipliers = peak.start_on(np.full(edges, 1.0 / edges))
    state = (phi.copy(), multipliers.copy())
    end = scene.nodes[1].angle
    for part in range(1, SHARES + 1):
        found = settled(held(scene, end, part / SHARES * share), state)
        assert found is not None
        state = found
    step = STEP
    while step >= FINEST:
        found = settled(held(scene, end + step, share), state)
        if found is None:
            step *= 0.5
            continue
        end, state = end + step, found
    return to_deg(end)


def held(scene: Scene, end: float, share: float) -> Held:
    """The rod of a shape with its right node turned elsewhere."""
    rod = scene_rod(scene, 0)
    turned = rod.moved_to(rod.pose._replace(end=end))
    length = turned.free_length
    chord = np.array(turned.free_chord) / length
    return Held(turned.weight * length**3 / turned.stiffness, chord, turned.start, end, share)


def settled(rod: Held, state: tuple[Array, Array]) -> tuple[Array, Array] | None:
    """The stable state near one of angles (n,) and multipliers (2,); None if there is none."""
    phi, multipliers = state[0].copy(), state[1].copy()
    n, h = phi.size, 1.0 / phi.size
    lifted = h * (1.0 - h * (np.arange(n) + 0.5))
    cells = np.full(n + 1, h)
    cells[[0, -1]] = 0.5 * h
    for _ in range(ITERATIONS):
        turns = np.diff(np.concatenate([[rod.start], phi, [rod.end]]))
        stiff = (1.0 + rod.share * np.sign(turns)) / cells
        sine, cosine = np.sin(phi), np.cos(phi)
        slopes = np.vstack([-h * sine, h * cosine])
        off = np.array([h * cosine.sum(), h * sine.sum()]) - rod.chord
        moments = stiff * turns
        rising = moments[:-1] - moments[1:] + rod.weight * lifted * cosine + multipliers @ slopes
        bent = np.diag(stiff[:-1] + stiff[1:]) - np.diag(stiff[1:-1], 1) - np.diag(stiff[1:-1], -1)
        bent -= np.diag(rod.weight * lifted * sine + h * (multipliers[0] * cosine + multipliers[1] * sine))
        whole = np.block([[bent, slopes.T], [slopes, np.zeros((2, 2))]])
        step = -np.linalg.solve(whole, np.concatenate([rising, off]))
        phi += step[:n]
        multipliers += step[n:]
        if np.max(np.abs(phi - state[0])) > FARTHEST:
            return None
        if np.max(np.abs(step[:n])) < CLOSE:
            # A minimum under two constraints: as many eigenvalues below 0 as there are of these.
            return (phi, multipliers) if int(np.sum(np.linalg.eigvalsh(whole) < 0.0)) == len(off) else None
    return None
