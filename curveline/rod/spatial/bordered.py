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

from curveline.kernels.kernel import njit
from curveline.rod.geometry.rotations import between, matrix_of, multiply, normalise
from curveline.rod.spatial.energy import vertex_energy, vertex_slopes

TINY = 1e-290


@njit
def bend_of(turns, i, n, q):
    """Overwrite `q (4,)` with what vertex `i` of n + 1 bends and twists by: its rotation, at an end twice that."""
    if i == 0 or i == n:
        multiply(turns[i], turns[i], q)
    else:
        for r in range(4):
            q[r] = turns[i, r]


@njit
def add_edges(rod, frames, forces, system, gap, give):
    """Add the edges' part of the bordered `system`, see `balance`; `gap (3,)` and `give (3, 3)` are the border's."""
    own, _, right = system
    t, u = np.empty(3), np.empty(3)
    for axis in range(3):
        gap[axis] = rod.chord[axis] * rod.held[1]
        for other in range(3):
            give[axis, other] = 0.0
    for j in range(rod.edges.size):
        w, x, y, z = frames[j]
        t[0], t[1], t[2] = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), w * w - x * x - y * y + z * z
        f0, f1, f2 = forces[j]
        axial = t[0] * f0 + t[1] * f1 + t[2] * f2
        soft = rod.edges[j] / rod.stiffness[3]
        long = rod.edges[j] + soft * axial
        u[0], u[1], u[2] = t[1] * f2 - t[2] * f1, t[2] * f0 - t[0] * f2, t[0] * f1 - t[1] * f0
        for r in range(3):
            right[j, r, 0] += long * u[r]
            gap[r] -= long * t[r]
            for c in range(3):
                give[r, c] -= soft * t[r] * t[c]
                own[j, r, c] -= soft * u[r] * u[c] + 0.5 * long * (forces[j, r] * t[c] + t[r] * forces[j, c])
                right[j, r, 1 + c] = -soft * u[r] * t[c]
            own[j, r, r] += long * axial
        right[j, 0, 2] += long * t[2]
        right[j, 0, 3] -= long * t[1]
        right[j, 1, 1] -= long * t[2]
        right[j, 1, 3] += long * t[0]
        right[j, 2, 1] += long * t[1]
        right[j, 2, 2] -= long * t[0]


@njit
def add_symmetric(matrix, k00, k10, k11, k20, k21, k22):
    """Add a symmetric matrix, its lower triangle by rows, to `matrix (3, 3)`."""
    matrix[0, 0] += k00
    matrix[0, 1] += k10
    matrix[0, 2] += k20
    matrix[1, 0] += k10
    matrix[1, 1] += k11
    matrix[1, 2] += k21
    matrix[2, 0] += k20
    matrix[2, 1] += k21
    matrix[2, 2] += k22


@njit
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


@njit
def balance(rod, frames, turns, forces, system, gap, give):
    """Overwrite the bordered system of Newton's method.

    `system` holds the blocks `own (n, 3, 3)` of the edges, `beside (n, 3, 3)` of each and the one before it, and
    `right (n, 3, 4)`: minus the slope, then the border's three columns. The gap is the last vertex's, `give` its slope.
    """
    own, beside, right = system
    n = rod.edges.size
    q = np.empty(4)
    for j in range(n):
        for r in range(3):
            right[j, r, 0] = 0.0
            for c in range(3):
                own[j, r, c] = 0.0
    for i in range(n + 1):
        bend_of(turns, i, n, q)
        before = frames[i - 1] if i > 0 else rod.frames[0]
        (m0, m1, m2), (k00, k10, k11, k20, k21, k22) = in_space(before, vertex_slopes(rod, i, turns[i], q))
        if i > 0:
            right[i - 1, 0, 0] += m0
            right[i - 1, 1, 0] += m1
            right[i - 1, 2, 0] += m2
            add_symmetric(own[i - 1], k00, k10, k11, k20, k21, k22)
        if i < n:
            right[i, 0, 0] -= m0
            right[i, 1, 0] -= m1
            right[i, 2, 0] -= m2
            add_symmetric(own[i], k00, k10, k11, k20, k21, k22)
            m0, m1, m2 = 0.5 * m0, 0.5 * m1, 0.5 * m2
            beside[i, 0, 0], beside[i, 0, 1], beside[i, 0, 2] = -k00, m2 - k10, -m1 - k20
            beside[i, 1, 0], beside[i, 1, 1], beside[i, 1, 2] = -m2 - k10, -k11, m0 - k21
            beside[i, 2, 0], beside[i, 2, 1], beside[i, 2, 2] = m1 - k20, -m0 - k21, -k22
    add_edges(rod, frames, forces, system, gap, give)


@njit
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


@njit
def sweep_forward(system, edges, shift, factor, complement):
    """Factor the blocks of `system`, with `shift` times the metric, carry its right-hand sides along.

    `factor` holds what `sweep_backward` needs: pivots (n, 3), the lower triangles (n, 3) of the diagonal blocks, the
    blocks (n, 3, 3) below them, and the right-hand sides (n, 3, 4). `complement (3, 4)`, which holds the border's part,
    becomes Schur's, and in its first column what is asked of the border. Returns the number of negative pivots.
    """
    own, beside, right = system
    pivots, lower, cross, swept = factor
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


@njit
def sweep_backward(factor, change, step):
    """Overwrite the turns `step (n, 3)` with those that `factor` gives for the share (4,) `change` of its sides."""
    pivots, lower, cross, swept = factor
    n = pivots.shape[0]
    s0 = s1 = s2 = 0.0
    for j in range(n - 1, -1, -1):
        v0 = v1 = v2 = 0.0
        for c in range(4):
            v0 += change[c] * swept[j, 0, c]
            v1 += change[c] * swept[j, 1, c]
            v2 += change[c] * swept[j, 2, c]
        v0 *= pivots[j, 0]
        v1 *= pivots[j, 1]
        v2 *= pivots[j, 2]
        if j < n - 1:
            v0 -= cross[j + 1, 0, 0] * s0 + cross[j + 1, 1, 0] * s1 + cross[j + 1, 2, 0] * s2
            v1 -= cross[j + 1, 0, 1] * s0 + cross[j + 1, 1, 1] * s1 + cross[j + 1, 2, 1] * s2
            v2 -= cross[j + 1, 0, 2] * s0 + cross[j + 1, 1, 2] * s1 + cross[j + 1, 2, 2] * s2
        s2 = v2
        s1 = v1 - lower[j, 2] * s2
        s0 = v0 - lower[j, 0] * s1 - lower[j, 1] * s2
        step[j, 0], step[j, 1], step[j, 2] = s0, s1, s2


@njit
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


@njit
def advance(rod, frames, turns, step, scale, after, turns_after):
    """Overwrite frames and turns `after` with those that `scale` times the turns `step (n, 3)` lead to.

    Turns are by Cayley's map, which agrees with the exponential to second order and takes no sine. Rotations at the
    vertices are carried along: differences of frames have lost as many digits as there are edges.
    """
    n = rod.edges.size
    turn, before, half, q = np.empty(4), np.empty(4), np.empty(4), np.empty(4)
    matrix = np.empty((3, 3))
    before[0] = 1.0
    before[1] = before[2] = before[3] = 0.0
    for i in range(n + 1):
        if i < n:
            matrix_of(frames[i], matrix)
            turn[0] = 1.0
            for r in range(3):
                turn[1 + r] = (
                    0.5 * scale * (matrix[0, r] * step[i, 0] + matrix[1, r] * step[i, 1] + matrix[2, r] * step[i, 2])
                )
            normalise(turn)
            multiply(frames[i], turn, after[i])
            normalise(after[i])
        else:
            turn[0] = 1.0
            turn[1] = turn[2] = turn[3] = 0.0
        between(before, turns[i], half)
        multiply(half, turn, q)
        normalise(q)
        sign = -1.0 if q[0] < 0.0 else 1.0
        for r in range(4):
            turns_after[i, r] = sign * q[r]
            before[r] = turn[r]


@njit
def lagrangian(rod, frames, turns, reaction, penalty):
    """Energy plus the `reaction (3,)` times how far the last vertex is from its place, plus a `penalty` on that."""
    n = rod.edges.size
    q, gap, force = np.empty(4), np.zeros(3), np.empty(3)
    total = 0.0
    for i in range(n + 1):
        bend_of(turns, i, n, q)
        total += vertex_energy(rod, i, q)
    for axis in range(3):
        gap[axis] = rod.chord[axis] * rod.held[1]
        force[axis] = reaction[axis]
        total += reaction[axis] * gap[axis]
    for j in range(n - 1, -1, -1):
        w, x, y, z = frames[j]
        t0, t1, t2 = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), w * w - x * x - y * y + z * z
        for axis in range(3):
            force[axis] += rod.forces[j + 1, axis]
        axial = t0 * force[0] + t1 * force[1] + t2 * force[2]
        strain = axial / rod.stiffness[3]
        total -= rod.edges[j] * axial * (1.0 + 0.5 * strain)
        long = rod.edges[j] * (1.0 + strain)
        gap[0] -= long * t0
        gap[1] -= long * t1
        gap[2] -= long * t2
    for axis in range(3):
        total += 0.5 * penalty * rod.held[1] * gap[axis] ** 2
    return total
