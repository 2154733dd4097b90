"""Kernels of clamps that give, in space: as `planar.clamps`, a bearing's tilt is what makes the Lagrangian stationary.

The tilt of a bearing, for given frames of the edges and forces that they pass on, is the root of

    -+ m . z + U'(tilt) - reach (z x t) . F = 0

with m the moment about its mouth that the half cell there passes on, + at the last end, t the mouth's tangent and F the
force that the bearing passes on. Put in, it leaves a softer end, one whose constraints yield.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.kernel import leaf
from curveline.rod.planar.clamps import CLOSE, TURNS, spring
from curveline.rod.spatial.energy import vertex_slopes
from curveline.rod.spatial.mouths import GIVE, PLAY, arm, mouth_shift, seen_from_mouth, upright


@leaf
def doubled(single):
    """The rotation `single`, four numbers, taken twice: what a half cell at a clamp bends and twists by."""
    w, x, y, z = single[0], single[1], single[2], single[3]
    return w * w - x * x - y * y - z * z, 2.0 * w * x, 2.0 * w * y, 2.0 * w * z


@leaf
def _moment(rod, frame, single, end):
    """Moment about z that the half cell at an `end` asks of its mouth, and its slope by the tilt.

    `frame (4,)` is that of the first mouth, tilted or not, or that of the last edge.
    """
    v0, v1, v2 = upright(frame)
    (m0, m1, m2), (k00, k10, k11, k20, k21, k22) = vertex_slopes(rod, end * rod.edges.size, single, doubled(single))
    slope = v0 * (k00 * v0 + 2.0 * (k10 * v1 + k20 * v2)) + v1 * (k11 * v1 + 2.0 * k21 * v2) + k22 * v2 * v2
    return (2.0 * end - 1.0) * (m0 * v0 + m1 * v1 + m2 * v2), slope


@leaf
def least_turned(rod, turn, end):
    """Tilt [rad] that leaves least of the rotation `turn (4,)` between where a motor holds a mouth and its edge."""
    v0, v1, v2 = upright(rod.frames[end])
    about = turn[1] * v0 + turn[2] * v1 + turn[3] * v2
    # Of q and -q, which are the same rotation, the one of less than half a turn.
    side = (1.0 - 2.0 * end) * (-1.0 if turn[0] < 0.0 else 1.0)
    return 2.0 * np.arctan2(side * about, abs(turn[0]))


@leaf
def link(rod, frames, turns, force, end):
    """Tilt [rad] of the bearing at an `end`, 0 the first and 1 the last, and how far it yields to a moment.

    That is one over the second derivative of the Lagrangian by it, 0 at a stop. `force` are the parts in the plane of
    what the bearing passes on. Of all roots, which a discrete rod has where its edge points backwards, it is the one
    between the poles of the half cell's energy, a quarter turn beside the tilt that leaves the smallest rotation:
    Newton's method, kept between bounds.
    """
    n = rod.edges.size
    turn = turns[end * n]
    frame = frames[n - 1] if end else rod.frames[0]
    tilt = least_turned(rod, turn, end)
    low, high = tilt - 0.5 * np.pi, tilt + 0.5 * np.pi
    yields = 0.0
    for _ in range(TURNS):
        asked, stiffness = _moment(rod, frame, seen_from_mouth(rod.frames, turn, tilt, end), end)
        moment, slope = spring(rod.bearings, tilt)
        x, y = arm(rod, tilt, end)
        yields = 1.0 / (stiffness + slope + x * force[0] + y * force[1])
        left = asked + moment - (x * force[1] - y * force[0])
        low, high = (low, tilt) if left > 0.0 else (tilt, high)
        before, tilt = tilt, tilt - left * yields
        if not low <= tilt <= high:
            tilt = 0.5 * (low + high)
        if abs(tilt - before) < CLOSE:
            break
    if rod.bearings[GIVE] == 0.0 and abs(tilt) > rod.bearings[PLAY]:
        return np.copysign(rod.bearings[PLAY], tilt), 0.0
    return tilt, yields


@leaf
def links(rod, frames, turns, forces):
    """Tilt of the first bearing and how far it yields, then those of the last one; edges pass on `forces (n, 3)`."""
    n = rod.edges.size
    first = forces[0, 0] + rod.forces[0, 0], forces[0, 1] + rod.forces[0, 1]
    last = forces[n - 1, 0] - rod.forces[n, 0], forces[n - 1, 1] - rod.forces[n, 1]
    return link(rod, frames, turns, first, 0), link(rod, frames, turns, last, 1)


@leaf
def add_yielding(rod, bearing, coupling, end, border):
    """Take out of a bordered system what its bearing at an `end` yields, and add to its gap where the mouth went.

    `bearing` is its tilt and how far it yields, `coupling` (3) the second derivative by its tilt and the turn of the
    edge beside it, `border` blocks `own (n, 3, 3)` and `right (n, 3, 4)`, gap and what the border gives: see `balance`.
    """
    own, right, gap, give = border
    tilt, yields = bearing
    j = end * (rod.edges.size - 1)
    x, y = arm(rod, tilt, end)
    shift = mouth_shift(rod, tilt, end)
    pull = rod.held[1] * y, -rod.held[1] * x
    for r in range(3):
        for c in range(3):
            own[j, r, c] -= yields * coupling[r] * coupling[c]
    for k in range(2):
        gap[k] -= rod.held[1] * shift[k]
        for r in range(3):
            right[j, r, 1 + k] -= yields * coupling[r] * pull[k]
        for m in range(2):
            give[k, m] -= yields * pull[k] * pull[m]
