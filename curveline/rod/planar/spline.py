"""The paper's initial guess: the circular C2 spline whose middle point is placed by a two-variable optimisation.

    phi = np.empty(n); spline.guess(chord, ends, side, phi); newton.descend(problem, phi, multipliers, effort)

leads to the state on that side. The search for all states begins with an `arch` instead, which is far faster; the
benchmarks begin with this one, as the paper does.

Paper, section IV-B. The spline interpolates five control points (Yuksel 2020): two at each end that fall together and
fix the clamp's tangent, and one in the middle, p. In that limit each half of the curve runs from a clamp to p and
blends, by cos^2 and sin^2, two circular arcs over the same chord: the one that leaves the clamp tangentially, and the
one through both clamps and p. An arc from A to B whose tangent at A makes the angle b with the chord is, in the complex
plane, A + (B - A) g with g(u, b) = (exp(2iub) - 1) / (exp(2ib) - 1), u in [0, 1]; so only the angles b depend on p, and
first and second derivatives with respect to p follow by the chain rule.

The paper gives no unit for its weight alpha = 10 between squared curvature [1/length^2] and squared length; curves are
scaled here to a chord of `CHORD` units: fewer let the curve shrink, more make the valley of the objective so stiff that
Newton needs more steps (`tests/rod/test_spline.py` has the figures).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from curveline.kernels.kernel import njit

ALPHA = 10.0
CHORD = 7.0
SAMPLES = 16
LEAST_CHORD = 1e-3
"""Chord, in units of the length, that clamps in one place are taken to have."""


class Guide(NamedTuple):
    """What a spline must meet: `x`, `y` of the right clamp seen from the left one, their angles, the length."""

    x: float
    y: float
    start: float
    end: float
    length: float


@njit
def _wrap(angle):
    """The same direction in (-pi, pi]."""
    return angle - 2.0 * np.pi * np.ceil((angle - np.pi) / (2.0 * np.pi))


@njit
def arc_weight(u, bend):
    """g(u, b), the arc's position along its chord, with first and second derivative by the angle b [rad]."""
    if abs(bend) < 1e-3:
        first = u * (u - 1.0)
        second = u * (u - 1.0) * (2.0 * u - 1.0)
        return (
            complex(u - second * bend * bend / 3.0, first * bend),
            complex(-2.0 * second * bend / 3.0, first),
            complex(-2.0 * second / 3.0, 0.0),
        )
    over = np.exp(2j * u * bend)
    under = np.exp(2j * bend)
    value = (over - 1.0) / (under - 1.0)
    slope = (2j * u * over - value * 2j * under) / (under - 1.0)
    return value, slope, (-4.0 * u * u * over - slope * 4j * under + value * 4.0 * under) / (under - 1.0)


@njit
def _angle_jet(z):
    """arg(z) and its derivatives by x, y, xx, xy, yy of z = x + iy."""
    q = 1.0 / z
    return np.angle(z), q.imag, q.real, -(q * q).imag, -(q * q).real, (q * q).imag


@njit
def _arc_jet(u, weight, bend):
    """Jet of `weight` g(u, b), from the jet of the bend angle b."""
    value, slope, curve = arc_weight(u, bend[0])
    return (
        weight * value,
        weight * slope * bend[1],
        weight * slope * bend[2],
        weight * (curve * bend[1] * bend[1] + slope * bend[3]),
        weight * (curve * bend[1] * bend[2] + slope * bend[4]),
        weight * (curve * bend[2] * bend[2] + slope * bend[5]),
    )


@njit
def _sum(a, b):
    """Jet of a sum."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]


@njit
def sample(guide, p, points):
    """Fill `points (6, 2k + 1)` with the spline's positions (complex) and their derivatives by p.

    Rows: value, d/dx, d/dy, d2/dx2, d2/dxdy, d2/dy2. Both halves are the same curve seen from their own clamp: the
    right one is walked backwards, so its clamp's tangent is turned round. Sample k is p.
    """
    last = points.shape[1] - 1
    per_half = last // 2
    far_end = complex(guide.x, guide.y)
    for half in range(2):
        clamp = far_end if half == 1 else complex(0.0, 0.0)
        other = complex(0.0, 0.0) if half == 1 else far_end
        tangent = guide.end + np.pi if half == 1 else guide.start
        near = _angle_jet(p - clamp)
        far = _angle_jet(p - other)
        clamp_bend = (_wrap(near[0] - tangent), near[1], near[2], near[3], near[4], near[5])
        circle_bend = (_wrap(far[0] - np.angle(clamp - other)), far[1], far[2], far[3], far[4], far[5])
        chord = p - clamp
        for i in range(per_half + 1):
            u = i / per_half
            ratio = np.sin(0.5 * np.pi * u) ** 2
            blend = _sum(_arc_jet(u, 1.0 - ratio, clamp_bend), _arc_jet(u, ratio, circle_bend))
            index = last - i if half == 1 else i
            points[0, index] = clamp + chord * blend[0]
            points[1, index] = blend[0] + chord * blend[1]
            points[2, index] = 1j * blend[0] + chord * blend[2]
            points[3, index] = 2.0 * blend[1] + chord * blend[3]
            points[4, index] = blend[2] + 1j * blend[1] + chord * blend[4]
            points[5, index] = 2j * blend[2] + chord * blend[5]


@njit
def _edge(points, i):
    """Jet of the edge from sample i to the next one."""
    return (
        points[0, i + 1] - points[0, i],
        points[1, i + 1] - points[1, i],
        points[2, i + 1] - points[2, i],
        points[3, i + 1] - points[3, i],
        points[4, i + 1] - points[4, i],
        points[5, i + 1] - points[5, i],
    )


@njit
def _dot(e, f):
    """Inner product of two vectors given as complex numbers."""
    return e.real * f.real + e.imag * f.imag


@njit
def _inner(e, f):
    """Jet of the inner product of two vectors given as complex jets."""
    return (
        _dot(e[0], f[0]),
        _dot(e[1], f[0]) + _dot(e[0], f[1]),
        _dot(e[2], f[0]) + _dot(e[0], f[2]),
        _dot(e[3], f[0]) + 2.0 * _dot(e[1], f[1]) + _dot(e[0], f[3]),
        _dot(e[4], f[0]) + _dot(e[1], f[2]) + _dot(e[2], f[1]) + _dot(e[0], f[4]),
        _dot(e[5], f[0]) + 2.0 * _dot(e[2], f[2]) + _dot(e[0], f[5]),
    )


@njit
def _compose(jet, value, slope, curve):
    """Jet of f(a) from the jet of a and f, f', f'' there."""
    return (
        value,
        slope * jet[1],
        slope * jet[2],
        slope * jet[3] + curve * jet[1] * jet[1],
        slope * jet[4] + curve * jet[1] * jet[2],
        slope * jet[5] + curve * jet[2] * jet[2],
    )


@njit
def _product(a, b):
    """Jet of a product."""
    return (
        a[0] * b[0],
        a[1] * b[0] + a[0] * b[1],
        a[2] * b[0] + a[0] * b[2],
        a[3] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[3],
        a[4] * b[0] + a[1] * b[2] + a[2] * b[1] + a[0] * b[4],
        a[5] * b[0] + 2.0 * a[2] * b[2] + a[0] * b[5],
    )


@njit
def _scaled(jet, factor):
    """Jet of a multiple."""
    return factor * jet[0], factor * jet[1], factor * jet[2], factor * jet[3], factor * jet[4], factor * jet[5]


@njit
def objective(guide, p, points):
    """Jet (value, gradient, Hessian) of kappa^2 + alpha (l - l0)^2, paper eq. 6 to 8, at the middle point p.

    `points (6, 2k + 1)` is overwritten with the samples.
    """
    sample(guide, p, points)
    total = (-guide.length, 0.0, 0.0, 0.0, 0.0, 0.0)
    bending = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    before = _edge(points, 0)
    before_length = bending
    for i in range(points.shape[1] - 1):
        edge = _edge(points, i)
        square = _inner(edge, edge)
        root = np.sqrt(square[0])
        length = _compose(square, root, 0.5 / root, -0.25 / (root * square[0]))
        total = _sum(total, length)
        if i > 0:
            # (1 - cos) / mean length = 2 (l l' - e.e') / (l l' (l + l'))
            lengths = _product(before_length, length)
            under = _product(lengths, _sum(before_length, length))
            inverse = _compose(under, 1.0 / under[0], -1.0 / under[0] ** 2, 2.0 / under[0] ** 3)
            above = _sum(lengths, _scaled(_inner(before, edge), -1.0))
            bending = _sum(bending, _scaled(_product(above, inverse), 2.0))
        before = edge
        before_length = length
    return _sum(_product(bending, bending), _scaled(_product(total, total), ALPHA))


@njit
def place_middle(guide, p, points, iterations):
    """Minimise `objective` from p by Newton with a line search; returns p and the iterations used.

    Where the Hessian is not positive definite its eigenvalues are taken by magnitude, which turns saddles into ways
    down. The number of iterations is negative if they ran out.
    """
    jet = objective(guide, p, points)
    for iteration in range(1, iterations + 1):
        mean = 0.5 * (jet[3] + jet[5])
        half = 0.5 * (jet[3] - jet[5])
        radius = np.sqrt(half * half + jet[4] * jet[4])
        angle = 0.5 * np.arctan2(jet[4], half)
        axis = complex(np.cos(angle), np.sin(angle))
        local = complex(jet[1], jet[2]) * np.conj(axis)
        floor = 1e-9 * (abs(mean) + radius)
        step = -axis * complex(local.real / max(abs(mean + radius), floor), local.imag / max(abs(mean - radius), floor))
        slope = jet[1] * step.real + jet[2] * step.imag
        if abs(step) < 1e-6 * guide.length:
            return p, iteration
        scale = min(1.0, 0.5 * guide.length / abs(step))
        start = jet[0]
        for _ in range(20):
            jet = objective(guide, p + scale * step, points)
            if jet[0] <= start + 1e-4 * scale * slope:
                break
            scale *= 0.5
        p = p + scale * step
    return p, -iterations


@njit
def tangent_angles(points, phi):
    """Tangent angles `phi (n,)` of a rod laid along the samples `points (6, m)`, at its edges' midpoints."""
    m = points.shape[1]
    n = phi.size
    place = np.empty(m - 1)
    angle = np.empty(m - 1)
    run = 0.0
    for i in range(m - 1):
        edge = points[0, i + 1] - points[0, i]
        place[i] = run + 0.5 * abs(edge)
        run += abs(edge)
        angle[i] = np.angle(edge)
        if i > 0:
            angle[i] = angle[i - 1] + _wrap(angle[i] - angle[i - 1])
    i = 0
    for j in range(n):
        at = (j + 0.5) * run / n
        while i < m - 3 and place[i + 1] < at:
            i += 1
        phi[j] = angle[i] + (angle[i + 1] - angle[i]) * (at - place[i]) / (place[i + 1] - place[i])


@njit
def guess(chord, ends, side, phi):
    """Lay a rod of unit length between clamps as the paper does: `phi (n,)` is overwritten.

    `chord (2,)` leads from clamp to clamp, `ends (2,)` are their angles [rad]. The chord's midpoint, moved to its left
    by `side` times half the reach of the excess length, starts the optimisation. Returns the iterations used, negative
    if they ran out.
    """
    across = complex(chord[0], chord[1])
    # The spline's middle point must not fall on a clamp.
    if abs(across) < LEAST_CHORD:
        across = complex(LEAST_CHORD, 0.0)
    span = abs(across)
    unit = CHORD / span
    guide = Guide(unit * across.real, unit * across.imag, ends[0], ends[1], unit)
    points = np.empty((6, SAMPLES + 1), dtype=np.complex128)
    reach = 0.5 * np.sqrt(max(1.0 - span * span, 1e-6))
    p = unit * (0.5 * across + side * reach * 1j * across / span)
    p, iterations = place_middle(guide, p, points, 40)
    sample(guide, p, points)
    tangent_angles(points, phi)
    return iterations
