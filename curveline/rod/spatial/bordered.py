"""Kernels of a spatial rod's balance: Newton's system by the turns of its edges, bordered by the last vertex's place.

Unknowns are the turns (n, 3) of the edges' frames about the axes of space, and the `reaction (3,)`, the force on the
last vertex that keeps it in its place. An edge passes on the reaction and the loads beyond it; its strain is what that
force says, so that stretch adds no unknown and no stiffness. The Hessian of the Lagrangian is then block tridiagonal,
in blocks of three, bordered by three constraints: L D L^T by a forward sweep, a Schur complement, a backward sweep, as
in `planar.newton`. The signs of the pivots and of the complement give the inertia (Sylvester).

With t the tangent of an edge, F the force that it passes on, N = t . F and S the stiffness of stretch, the edge adds
-l (N + N^2 / 2 S); a vertex that turns by q adds its energy, whose slope m and curvature K along rotations are brought
into space; as exp(-a) exp(b) = exp(b - a - a x b / 2 + ...), they add m . (b - a), K and K - [m]x / 2 beside.
"""

from __future__ import annotations

import numpy as np

from curveline.kernels.kernel import leaf
from curveline.rod.geometry.rotations import product, trued, unit
from curveline.rod.planar.clamps import spring_energy
from curveline.rod.spatial.clamps import add_yielding, doubled, link, links
from curveline.rod.spatial.energy import (
    inner_energy,
    inner_slopes,
    natural_at,
    stiffnesses,
    vertex_energy,
    vertex_slopes,
)
from curveline.rod.spatial.mouths import gives, mouth_frame, mouth_shift, seen_from_mouth

TINY = 1e-290


@leaf
def tangent_of(frame):
    """Tangent of an edge that has a `frame (4,)`."""
    w, x, y, z = frame[0], frame[1], frame[2], frame[3]
    return 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), w * w - x * x - y * y + z * z


@leaf
def add_edges(rod, frames, forces, system, gap, give):
    """Add the edges' part of the bordered `system`, see `balance`; `gap (3,)` and `give (3, 3)` are the border's."""
    own, _, right = system
    g0, g1, g2 = rod.chord[0] * rod.held[1], rod.chord[1] * rod.held[1], rod.chord[2] * rod.held[1]
    s00 = s10 = s11 = s20 = s21 = s22 = 0.0
    for j in range(rod.edges.size):
        t0, t1, t2 = tangent_of(frames[j])
        f0, f1, f2 = forces[j, 0], forces[j, 1], forces[j, 2]
        axial = t0 * f0 + t1 * f1 + t2 * f2
        soft = rod.edges[j] / rod.stiffness[3]
        long = rod.edges[j] + soft * axial
        pull = long * axial
        u0, u1, u2 = t1 * f2 - t2 * f1, t2 * f0 - t0 * f2, t0 * f1 - t1 * f0
        v0, v1, v2 = soft * u0, soft * u1, soft * u2
        h0, h1, h2 = 0.5 * long * f0, 0.5 * long * f1, 0.5 * long * f2
        k10, k20, k21 = v1 * u0 + h1 * t0 + t1 * h0, v2 * u0 + h2 * t0 + t2 * h0, v2 * u1 + h2 * t1 + t2 * h1
        own[j, 0, 0] += pull - v0 * u0 - 2.0 * h0 * t0
        own[j, 1, 1] += pull - v1 * u1 - 2.0 * h1 * t1
        own[j, 2, 2] += pull - v2 * u2 - 2.0 * h2 * t2
        own[j, 0, 1] -= k10
        own[j, 0, 2] -= k20
        own[j, 1, 2] -= k21
        own[j, 1, 0] -= k10
        own[j, 2, 0] -= k20
        own[j, 2, 1] -= k21
        right[j, 0, 0] += long * u0
        right[j, 1, 0] += long * u1
        right[j, 2, 0] += long * u2
        right[j, 0, 1], right[j, 0, 2], right[j, 0, 3] = -v0 * t0, long * t2 - v0 * t1, -long * t1 - v0 * t2
        right[j, 1, 1], right[j, 1, 2], right[j, 1, 3] = -long * t2 - v1 * t0, -v1 * t1, long * t0 - v1 * t2
        right[j, 2, 1], right[j, 2, 2], right[j, 2, 3] = long * t1 - v2 * t0, -long * t0 - v2 * t1, -v2 * t2
        g0, g1, g2 = g0 - long * t0, g1 - long * t1, g2 - long * t2
        s00, s11, s22 = s00 - soft * t0 * t0, s11 - soft * t1 * t1, s22 - soft * t2 * t2
        s10, s20, s21 = s10 - soft * t1 * t0, s20 - soft * t2 * t0, s21 - soft * t2 * t1
    gap[0], gap[1], gap[2] = g0, g1, g2
    give[0, 0], give[0, 1], give[0, 2] = s00, s10, s20
    give[1, 0], give[1, 1], give[1, 2] = s10, s11, s21
    give[2, 0], give[2, 1], give[2, 2] = s20, s21, s22


@leaf
def in_space(frame, derivatives):
    """Slope (3) and curvature (6) by rotations about the axes of space, from those about those of `frame (4,)`."""
    w, x, y, z = frame[0], frame[1], frame[2], frame[3]
    (f0, f1, f2), (k00, k10, k11, k20, k21, k22) = derivatives
    a00, a01, a02 = w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
    a10, a11, a12 = 2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)
    a20, a21, a22 = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z
    h00, h01, h02 = (
        a00 * k00 + a01 * k10 + a02 * k20,
        a00 * k10 + a01 * k11 + a02 * k21,
        a00 * k20 + a01 * k21 + a02 * k22,
    )
    h10, h11, h12 = (
        a10 * k00 + a11 * k10 + a12 * k20,
        a10 * k10 + a11 * k11 + a12 * k21,
        a10 * k20 + a11 * k21 + a12 * k22,
    )
    h20, h21, h22 = (
        a20 * k00 + a21 * k10 + a22 * k20,
        a20 * k10 + a21 * k11 + a22 * k21,
        a20 * k20 + a21 * k21 + a22 * k22,
    )
    slope = a00 * f0 + a01 * f1 + a02 * f2, a10 * f0 + a11 * f1 + a12 * f2, a20 * f0 + a21 * f1 + a22 * f2
    return slope, (
        h00 * a00 + h01 * a01 + h02 * a02,
        h10 * a00 + h11 * a01 + h12 * a02,
        h10 * a10 + h11 * a11 + h12 * a12,
        h20 * a00 + h21 * a01 + h22 * a02,
        h20 * a10 + h21 * a11 + h22 * a12,
        h20 * a20 + h21 * a21 + h22 * a22,
    )


@leaf
def balance(rod, frames, turns, forces, system, gap, give):
    """Overwrite the bordered system of Newton's method.

    `system` holds the blocks `own (n, 3, 3)` of the edges, `beside (n, 3, 3)` of each and the one before it, and
    `right (n, 3, 4)`: minus the slope, then the border's three columns. The gap is the last vertex's, `give` its slope.
    """
    own, beside, right = system
    n, stiffness = rod.edges.size, stiffnesses(rod)
    first, last = (0.0, 0.0), (0.0, 0.0)
    if gives(rod):
        first, last = links(rod, frames, turns, forces)
    single = seen_from_mouth(rod.frames, turns[0], first[0], 0)
    (b0, b1, b2), (a00, a10, a11, a20, a21, a22) = in_space(
        mouth_frame(rod.frames, first[0], 0), vertex_slopes(rod, 0, single, doubled(single))
    )
    for j in range(n):
        h0, h1, h2 = 0.5 * b0, 0.5 * b1, 0.5 * b2
        beside[j, 0, 0], beside[j, 0, 1], beside[j, 0, 2] = -a00, h2 - a10, -h1 - a20
        beside[j, 1, 0], beside[j, 1, 1], beside[j, 1, 2] = -h2 - a10, -a11, h0 - a21
        beside[j, 2, 0], beside[j, 2, 1], beside[j, 2, 2] = h1 - a20, -h0 - a21, -a22
        if j < n - 1:
            q = turns[j + 1, 0], turns[j + 1, 1], turns[j + 1, 2], turns[j + 1, 3]
            slopes = inner_slopes(stiffness, natural_at(rod, j + 1), 0.5 * (rod.edges[j] + rod.edges[j + 1]), q)
        else:
            single = seen_from_mouth(rod.frames, turns[n], last[0], 1)
            slopes = vertex_slopes(rod, n, single, doubled(single))
        (m0, m1, m2), (k00, k10, k11, k20, k21, k22) = in_space(frames[j], slopes)
        right[j, 0, 0], right[j, 1, 0], right[j, 2, 0] = m0 - b0, m1 - b1, m2 - b2
        a10, a20, a21 = a10 + k10, a20 + k20, a21 + k21
        own[j, 0, 0], own[j, 1, 1], own[j, 2, 2] = a00 + k00, a11 + k11, a22 + k22
        own[j, 0, 1], own[j, 0, 2], own[j, 1, 2] = a10, a20, a21
        own[j, 1, 0], own[j, 2, 0], own[j, 2, 1] = a10, a20, a21
        b0, b1, b2, a00, a10, a11, a20, a21, a22 = m0, m1, m2, k00, k10, k11, k20, k21, k22
    add_edges(rod, frames, forces, system, gap, give)
    if gives(rod):
        border = own, right, gap, give
        add_yielding(rod, first, (beside[0, 0, 2], beside[0, 1, 2], beside[0, 2, 2]), 0, border)
        add_yielding(rod, last, (0.5 * b1 - a20, -0.5 * b0 - a21, -a22), 1, border)


@leaf
def left_over(rod, right, gap, scale):
    """Largest force left over, over the largest that an edge passes on, `scale`; not a number if any is none."""
    left = 0.0
    for j in range(rod.edges.size):
        for r in range(3):
            missing = abs(right[j, r, 0]) / rod.edges[j]
            if not missing < np.inf:
                return np.nan
            left = max(left, missing)
    for axis in range(3):
        left = max(left, abs(gap[axis]) * scale * rod.held[1])
    return left / scale


@leaf
def sweep_forward(system, edges, shift, factor, complement):
    """Factor the blocks of `system`, with `shift` times the metric, carry its right-hand sides along.

    `factor` holds what `sweep_backward` needs: pivots (n, 3), the lower triangles (n, 3) of the diagonal blocks, the
    blocks (n, 3, 3) below them, the right-hand sides (n, 3, 4), and room (n, 3). `complement (3, 4)`, which holds the
    border's part, becomes Schur's, and in its first column what is asked of the border. Returns the number of negative
    pivots.
    """
    own, beside, right = system
    pivots, lower, cross, swept, _ = factor
    negative = 0
    l10 = l20 = l21 = i0 = i1 = i2 = 0.0
    for j in range(edges.size):
        more = shift * edges[j]
        d00, d11, d22 = own[j, 0, 0] + more, own[j, 1, 1] + more, own[j, 2, 2] + more
        d10, d20, d21 = own[j, 1, 0], own[j, 2, 0], own[j, 2, 1]
        if j > 0:
            y00, y10, y20 = beside[j, 0, 0], beside[j, 1, 0], beside[j, 2, 0]
            y01, y11, y21 = beside[j, 0, 1] - y00 * l10, beside[j, 1, 1] - y10 * l10, beside[j, 2, 1] - y20 * l10
            y02 = beside[j, 0, 2] - y00 * l20 - y01 * l21
            y12 = beside[j, 1, 2] - y10 * l20 - y11 * l21
            y22 = beside[j, 2, 2] - y20 * l20 - y21 * l21
            x00, x01, x02 = y00 * i0, y01 * i1, y02 * i2
            x10, x11, x12 = y10 * i0, y11 * i1, y12 * i2
            x20, x21, x22 = y20 * i0, y21 * i1, y22 * i2
            d00 -= y00 * x00 + y01 * x01 + y02 * x02
            d10 -= y10 * x00 + y11 * x01 + y12 * x02
            d20 -= y20 * x00 + y21 * x01 + y22 * x02
            d11 -= y10 * x10 + y11 * x11 + y12 * x12
            d21 -= y20 * x10 + y21 * x11 + y22 * x12
            d22 -= y20 * x20 + y21 * x21 + y22 * x22
            cross[j, 0, 0], cross[j, 0, 1], cross[j, 0, 2] = x00, x01, x02
            cross[j, 1, 0], cross[j, 1, 1], cross[j, 1, 2] = x10, x11, x12
            cross[j, 2, 0], cross[j, 2, 1], cross[j, 2, 2] = x20, x21, x22
        if abs(d00) < TINY:
            d00 = TINY
        i0 = 1.0 / d00
        l10, l20 = d10 * i0, d20 * i0
        d11 -= d10 * l10
        if abs(d11) < TINY:
            d11 = TINY
        i1 = 1.0 / d11
        d21 -= d20 * l10
        l21 = d21 * i1
        d22 -= d20 * l20 + d21 * l21
        if abs(d22) < TINY:
            d22 = TINY
        i2 = 1.0 / d22
        negative += int(d00 < 0.0) + int(d11 < 0.0) + int(d22 < 0.0)
        pivots[j, 0], pivots[j, 1], pivots[j, 2] = i0, i1, i2
        lower[j, 0], lower[j, 1], lower[j, 2] = l10, l20, l21
        for c in range(4):
            z0, z1, z2 = right[j, 0, c], right[j, 1, c], right[j, 2, c]
            if j > 0:
                b0, b1, b2 = swept[j - 1, 0, c], swept[j - 1, 1, c], swept[j - 1, 2, c]
                z0 -= x00 * b0 + x01 * b1 + x02 * b2
                z1 -= x10 * b0 + x11 * b1 + x12 * b2
                z2 -= x20 * b0 + x21 * b1 + x22 * b2
            z1 -= l10 * z0
            z2 -= l20 * z0 + l21 * z1
            swept[j, 0, c], swept[j, 1, c], swept[j, 2, c] = z0, z1, z2
        for r in range(3):
            w0, w1, w2 = swept[j, 0, 1 + r] * i0, swept[j, 1, 1 + r] * i1, swept[j, 2, 1 + r] * i2
            for c in range(4):
                complement[r, c] -= w0 * swept[j, 0, c] + w1 * swept[j, 1, c] + w2 * swept[j, 2, c]
    return negative


@leaf
def sweep_backward(factor, shares, step):
    """Overwrite the turns `step (n, 3)`, and those beside in the `factor`, with what it gives for `shares (2, 4)`.

    Either row says how much of each right-hand side is taken, the first one for the step.
    """
    pivots, lower, cross, swept, beside = factor
    n = pivots.shape[0]
    a0, a1, a2, a3 = shares[0, 0], shares[0, 1], shares[0, 2], shares[0, 3]
    b1, b2, b3 = shares[1, 1], shares[1, 2], shares[1, 3]
    s0 = s1 = s2 = t0 = t1 = t2 = x00 = x10 = x20 = x01 = x11 = x21 = x02 = x12 = x22 = 0.0
    for j in range(n - 1, -1, -1):
        p, q, r, s = swept[j, 0, 0], swept[j, 0, 1], swept[j, 0, 2], swept[j, 0, 3]
        v0, w0 = a0 * p + a1 * q + a2 * r + a3 * s, b1 * q + b2 * r + b3 * s
        p, q, r, s = swept[j, 1, 0], swept[j, 1, 1], swept[j, 1, 2], swept[j, 1, 3]
        v1, w1 = a0 * p + a1 * q + a2 * r + a3 * s, b1 * q + b2 * r + b3 * s
        p, q, r, s = swept[j, 2, 0], swept[j, 2, 1], swept[j, 2, 2], swept[j, 2, 3]
        v2, w2 = a0 * p + a1 * q + a2 * r + a3 * s, b1 * q + b2 * r + b3 * s
        v0 = v0 * pivots[j, 0] - (x00 * s0 + x10 * s1 + x20 * s2)
        v1 = v1 * pivots[j, 1] - (x01 * s0 + x11 * s1 + x21 * s2)
        v2 = v2 * pivots[j, 2] - (x02 * s0 + x12 * s1 + x22 * s2)
        w0 = w0 * pivots[j, 0] - (x00 * t0 + x10 * t1 + x20 * t2)
        w1 = w1 * pivots[j, 1] - (x01 * t0 + x11 * t1 + x21 * t2)
        w2 = w2 * pivots[j, 2] - (x02 * t0 + x12 * t1 + x22 * t2)
        s2, t2 = v2, w2
        s1, t1 = v1 - lower[j, 2] * s2, w1 - lower[j, 2] * t2
        s0, t0 = v0 - lower[j, 0] * s1 - lower[j, 1] * s2, w0 - lower[j, 0] * t1 - lower[j, 1] * t2
        step[j, 0], step[j, 1], step[j, 2] = s0, s1, s2
        beside[j, 0], beside[j, 1], beside[j, 2] = t0, t1, t2
        if j > 0:
            x00, x01, x02 = cross[j, 0, 0], cross[j, 0, 1], cross[j, 0, 2]
            x10, x11, x12 = cross[j, 1, 0], cross[j, 1, 1], cross[j, 1, 2]
            x20, x21, x22 = cross[j, 2, 0], cross[j, 2, 1], cross[j, 2, 2]


@leaf
def solve_border(complement, right):
    """Overwrite `right (3,)` with what the last three columns of `complement (3, 4)` give it; their negative pivots."""
    a, b, c = complement[0, 1], complement[1, 1], complement[2, 1]
    d, e, f = complement[1, 2], complement[2, 2], complement[2, 3]
    if abs(a) < TINY:
        a = TINY
    l10, l20 = b / a, c / a
    d -= b * l10
    if abs(d) < TINY:
        d = TINY
    e -= c * l10
    l21 = e / d
    f -= c * l20 + e * l21
    if abs(f) < TINY:
        f = TINY
    y1 = right[1] - l10 * right[0]
    y2 = right[2] - l20 * right[0] - l21 * y1
    right[2] = y2 / f
    right[1] = y1 / d - l21 * right[2]
    right[0] = right[0] / a - l10 * right[1] - l20 * right[2]
    return int(a < 0.0) + int(d < 0.0) + int(f < 0.0)


@leaf
def advance(rod, frames, turns, step, scale, after, turns_after):
    """Overwrite frames and turns `after` with those that `scale` times the turns `step (n, 3)` lead to.

    Turns are by Cayley's map, which agrees with the exponential to second order and takes no sine. Rotations at the
    vertices are carried along: differences of frames have lost as many digits as there are edges.
    """
    n = rod.edges.size
    half = 0.5 * scale
    b0, b1, b2, b3 = 1.0, 0.0, 0.0, 0.0
    for i in range(n + 1):
        c0, c1, c2, c3 = 1.0, 0.0, 0.0, 0.0
        if i < n:
            w, x, y, z = frames[i, 0], frames[i, 1], frames[i, 2], frames[i, 3]
            s0, s1, s2 = half * step[i, 0], half * step[i, 1], half * step[i, 2]
            m0, m1, m2 = w * w + x * x - y * y - z * z, 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)
            c1 = m0 * s0 + m1 * s1 + m2 * s2
            m0, m1, m2 = 2.0 * (x * y - w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z + w * x)
            c2 = m0 * s0 + m1 * s1 + m2 * s2
            m0, m1, m2 = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), w * w - x * x - y * y + z * z
            c3 = m0 * s0 + m1 * s1 + m2 * s2
            c0, c1, c2, c3 = unit((1.0, c1, c2, c3))
            after[i, 0], after[i, 1], after[i, 2], after[i, 3] = trued(product((w, x, y, z), (c0, c1, c2, c3)))
        q = product((b0, -b1, -b2, -b3), (turns[i, 0], turns[i, 1], turns[i, 2], turns[i, 3]))
        q0, q1, q2, q3 = trued(product(q, (c0, c1, c2, c3)))
        sign = -1.0 if q0 < 0.0 else 1.0
        turns_after[i, 0], turns_after[i, 1], turns_after[i, 2], turns_after[i, 3] = (
            sign * q0,
            sign * q1,
            sign * q2,
            sign * q3,
        )
        b0, b1, b2, b3 = c0, c1, c2, c3


@leaf
def _ends_energy(rod, frames, turns, reaction):
    """Energy of both half cells and of bearings that give, and by what these shorten the chord: x, y."""
    n = rod.edges.size
    total = first = last = x = y = 0.0
    if gives(rod):
        f0, f1 = 0.0, 0.0
        for i in range(n + 1):
            f0, f1 = f0 + rod.forces[i, 0], f1 + rod.forces[i, 1]
        first, _ = link(rod, frames, turns, (f0 + reaction[0], f1 + reaction[1]), 0)
        last, _ = link(rod, frames, turns, (reaction[0], reaction[1]), 1)
        (x, y), (a, b) = mouth_shift(rod, first, 0), mouth_shift(rod, last, 1)
        total = spring_energy(rod.bearings, first) + spring_energy(rod.bearings, last) - f0 * x - f1 * y
        x, y = x + a, y + b
    total += vertex_energy(rod, 0, doubled(seen_from_mouth(rod.frames, turns[0], first, 0)))
    total += vertex_energy(rod, n, doubled(seen_from_mouth(rod.frames, turns[n], last, 1)))
    return total, x, y


@leaf
def lagrangian(rod, frames, turns, reaction, penalty):
    """Energy plus the `reaction (3,)` times how far the last vertex is from its place, plus a `penalty` on that."""
    n = rod.edges.size
    held, stiffness = rod.held[1], stiffnesses(rod)
    total, a0, a1 = _ends_energy(rod, frames, turns, reaction)
    for i in range(1, n):
        q = turns[i, 0], turns[i, 1], turns[i, 2], turns[i, 3]
        total += inner_energy(stiffness, natural_at(rod, i), 0.5 * (rod.edges[i - 1] + rod.edges[i]), q)
    g0, g1, g2 = held * (rod.chord[0] - a0), held * (rod.chord[1] - a1), held * rod.chord[2]
    f0, f1, f2 = reaction[0], reaction[1], reaction[2]
    total += f0 * g0 + f1 * g1 + f2 * g2
    for j in range(n - 1, -1, -1):
        t0, t1, t2 = tangent_of(frames[j])
        f0, f1, f2 = f0 + rod.forces[j + 1, 0], f1 + rod.forces[j + 1, 1], f2 + rod.forces[j + 1, 2]
        axial = t0 * f0 + t1 * f1 + t2 * f2
        strain = axial / rod.stiffness[3]
        total -= rod.edges[j] * axial * (1.0 + 0.5 * strain)
        long = rod.edges[j] * (1.0 + strain)
        g0, g1, g2 = g0 - long * t0, g1 - long * t1, g2 - long * t2
    return total + 0.5 * penalty * held * (g0 * g0 + g1 * g1 + g2 * g2)
