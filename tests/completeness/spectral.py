"""Equilibria of the continuous planar elastica by a spectral method, which shares nothing with `curveline.rod`.

In units of the free length and EI the rod minimises

    1/2 int theta'^2 + w int (1 - s) sin(theta)    with    int (cos, sin)(theta) = chord,  theta given at both ends

(Love 1927, section 262). The angle is the line between the clamps plus Lobatto's polynomials, the integrals of
Legendre's, whose slopes are orthogonal, so that the bending energy is half the sum of the squared coefficients. The
integrals are Gauss's. Angles are analytic in s, so the error falls exponentially with the number of polynomials: it is
raised until the last coefficients are below `RESOLVED`. States are met by Newton from many random starts, half of which
are taken downhill first; their stability is the sign of the second variation on the same polynomials.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, null_space

Array = NDArray[np.float64]

MODES = (24, 48, 96, 160, 256)
"""Polynomials, the more where the fewer do not resolve the angle."""
RESOLVED = 1e-8
"""Largest of the last four coefficients, as a part of the largest one (or of 1, if that is less)."""
CLOSE = 1e-10
"""Last Newton step [rad]."""
DOWNHILL = 40
SAME = 1e-5
"""Angles [rad] that differ by less at all points belong to one state."""


class Basis(NamedTuple):
    """Gauss's `places (q,)` and `weights (q,)` on 0 to 1, and the polynomials there (q, n), zero at both ends."""

    places: Array
    weights: Array
    values: Array


@dataclass(frozen=True)
class Elastica:
    """A rod in units of its free length and EI: chord, clamp angles, weight."""

    chord: tuple[float, float]
    ends: tuple[float, float]
    weight: float

    def ramp(self, places: Array) -> Array:
        """The line between the clamps' angles."""
        return self.ends[0] + (self.ends[1] - self.ends[0]) * places


@dataclass(frozen=True)
class State:
    """An equilibrium: coefficients of the polynomials and the force's multipliers, and its lowest eigenvalue."""

    coefficients: Array
    force: Array
    lowest_eigenvalue: float  # of the second variation under the constraints, in EI/L^2

    @property
    def is_stable(self) -> bool:
        """True if the second variation is positive."""
        return self.lowest_eigenvalue > 0.0


@cache
def basis(count: int) -> Basis:
    """The first `count` Lobatto polynomials, normed so that int (phi')^2 = 1."""
    x, w = np.polynomial.legendre.leggauss(2 * count + 24)
    return Basis(0.5 * (x + 1.0), 0.5 * w, polynomials(0.5 * (x + 1.0), count))


def polynomials(places: Array, count: int) -> Array:
    """Values (q, count) of the polynomials at `places (q,)` from 0 to 1."""
    legendre = np.polynomial.legendre.legvander(2.0 * places - 1.0, count + 1)
    degree = np.arange(1, count + 1)
    return np.asarray((legendre[:, 2:] - legendre[:, :-2]) / (2.0 * np.sqrt(2.0 * degree + 1.0)))


def angles(rod: Elastica, state: State, places: Array) -> Array:
    """Tangent angles (q,) at `places (q,)` from 0 to 1."""
    return rod.ramp(places) + polynomials(places, state.coefficients.size) @ state.coefficients


def positions(rod: Elastica, state: State, ticks: Array) -> Array:
    """Positions (count, 2) at the sorted places `ticks (count,)`, from Gauss's integrals from one to the next."""
    ticks = np.concatenate([[0.0], ticks])
    x, w = np.polynomial.legendre.leggauss(8)
    step = np.diff(ticks)
    inner = ticks[:-1, None] + step[:, None] * 0.5 * (x + 1.0)
    theta = angles(rod, state, inner.ravel()).reshape(inner.shape)
    moves = [0.5 * step * (turned @ w) for turned in (np.cos(theta), np.sin(theta))]
    return np.column_stack([np.cumsum(move) for move in moves])


def linearised(rod: Elastica, base: Basis, c: Array, force: Array) -> tuple[Array, Array, Array, Array]:
    """Angles (b, q), what a turning of them costs besides bending, its slope, and the gaps of the chord (b, 2)."""
    theta = rod.ramp(base.places) + c @ base.values.T
    cosine, sine = np.cos(theta), np.sin(theta)
    heavy = rod.weight * (1.0 - base.places)
    turning = heavy * cosine - force[:, :1] * sine + force[:, 1:] * cosine
    slope = -heavy * sine - force[:, :1] * cosine - force[:, 1:] * sine
    gaps = np.stack([cosine @ base.weights, sine @ base.weights], axis=1) - rod.chord
    borders = np.stack([-sine, cosine], axis=1)
    return turning, slope, gaps, borders


def hessian(base: Basis, slope: Array) -> Array:
    """Second derivatives (b, n, n) of the Lagrangian."""
    weighted = base.values[None] * (slope * base.weights)[:, :, None]
    return np.eye(base.values.shape[1]) + base.values.T[None] @ weighted


def step_from(rod: Elastica, base: Basis, c: Array, force: Array, downhill: float) -> tuple[Array, Array, Array]:
    """Newton's steps (b, n) and new forces (b, 2), and the largest turns (b,); `downhill` 1 convexifies, 0 does not."""
    turning, slope, gaps, borders = linearised(rod, base, c, force)
    batch, n = c.shape
    # The least eigenvalue of the potential term in the norm of bending is no less than its least value over pi^2.
    shift = downhill * np.maximum(0.0, -np.min(slope, axis=1) / math.pi**2 - 0.95)
    matrix = np.zeros((batch, n + 2, n + 2))
    matrix[:, :n, :n] = hessian(base, slope) + shift[:, None, None] * np.eye(n)
    rows = (borders * base.weights) @ base.values
    matrix[:, n:, :n] = rows
    matrix[:, :n, n:] = rows.transpose(0, 2, 1)
    right = np.concatenate([-(c + (turning * base.weights) @ base.values), -gaps], axis=1)
    right[:, :n] += np.einsum("bk,bkn->bn", force, rows)
    solved = np.linalg.solve(matrix, right[:, :, None])[:, :, 0]
    change = solved[:, :n]
    turns = np.max(np.abs(change @ base.values.T), axis=1)
    return change, solved[:, n:], turns


def newton(rod: Elastica, c: Array, force: Array, downhill: int = 0, most: int = 60) -> tuple[Array, Array, Array]:
    """Newton from `c (b, n)`, `force (b, 2)`, the first `downhill` steps convexified; which converged (b,)."""
    base = basis(c.shape[1])
    done = np.zeros(c.shape[0], dtype=bool)
    c, force = c.copy(), force.copy()
    for count in range(downhill + most):
        going = np.flatnonzero(~done)
        if going.size == 0:
            break
        try:
            change, new, turns = step_from(rod, base, c[going], force[going], float(count < downhill))
        except np.linalg.LinAlgError:
            break
        change[~np.isfinite(turns)] = 0.0
        scale = np.minimum(1.0, 0.4 / np.maximum(turns, 1e-300))
        c[going] += scale[:, None] * change
        force[going] += scale[:, None] * (new - force[going])
        ended = turns < CLOSE
        done[going[ended]] = True
        lost = ~np.isfinite(turns) | (np.max(np.abs(c[going]), axis=1) > 60.0)
        c[going[lost]] = np.nan
        if count >= downhill + 25 and not np.any(done):
            break
        keep = np.isfinite(c).all(axis=1)
        done |= ~keep
    return c, force, done & np.isfinite(c).all(axis=1)


def lowest(rod: Elastica, c: Array, force: Array) -> float:
    """Smallest eigenvalue of the second variation under the constraints, normed by int (d theta)^2."""
    base = basis(c.size)
    _, slope, _, borders = linearised(rod, base, c[None], force[None])
    stiff = hessian(base, slope)[0]
    mass = base.values.T @ (base.values * base.weights[:, None])
    free = null_space((borders[0] * base.weights) @ base.values)
    return float(eigh(free.T @ stiff @ free, free.T @ mass @ free, eigvals_only=True, subset_by_index=[0, 0])[0])


def settled(rod: Elastica, c: Array, force: Array) -> State | None:
    """The equilibrium that Newton reaches, with as many polynomials as resolve it; None if there is none."""
    before: Array | None = None
    for count in (n for n in MODES if n >= c.size):
        more = np.zeros(count)
        more[: c.size] = c
        met, pulls, done = newton(rod, more[None], force[None], most=30)
        if not done[0]:
            return None
        c, force = met[0], pulls[0]
        if before is not None and np.max(np.abs(c[: before.size] - before)) > 0.3:
            return None
        if np.max(np.abs(c[-4:])) < RESOLVED * max(1.0, float(np.max(np.abs(c)))):
            return State(c, force, lowest(rod, c, force))
        before = c
    return None


def random_starts(rod: Elastica, rng: np.random.Generator, tries: int, count: int) -> tuple[Array, Array]:
    """Coefficients (tries, count) of waves of any size on the line between the clamps, and random forces."""
    base = basis(count)
    waves = np.zeros((tries, base.places.size))
    size = rng.choice([0.3, 1.0, 2.0], tries)
    for k in range(1, 6):
        waves += (size * rng.normal(0.0, 1.0, tries) / math.sqrt(k))[:, None] * np.sin(k * math.pi * base.places)
    mass = base.values.T @ (base.values * base.weights[:, None])
    c = np.linalg.solve(mass, ((waves * base.weights) @ base.values).T).T
    pulls = rng.normal(0.0, 1.0, (tries, 2)) * rng.choice([0.0, 20.0, 60.0], tries)[:, None]
    return c, pulls


def is_new(c: Array, others: list[State]) -> bool:
    """True if none of the `others` has these angles."""
    n = c.size
    for other in others:
        gap = c.copy()
        gap[: other.coefficients.size] -= other.coefficients[:n]
        if np.max(np.abs(basis(n).values @ gap)) < SAME:
            return False
    return True


def multistart(rod: Elastica, rng: np.random.Generator, tries: int = 64) -> list[State]:
    """The stable states met from random starts, by Newton alone and downhill first."""
    slack = 1.0 - math.hypot(*rod.chord)
    count = MODES[0] if slack > 0.02 else MODES[1]
    c, force = random_starts(rod, rng, tries, count)
    states: list[State] = []
    met: list[State] = []
    half = tries // 2
    for part, downhill in ((slice(0, half), 0), (slice(half, tries), DOWNHILL)):
        shapes, pulls, done = newton(rod, c[part], force[part], downhill)
        for i in np.flatnonzero(done):
            if not is_new(shapes[i], met):
                continue
            met.append(State(shapes[i], pulls[i], math.nan))
            if lowest(rod, shapes[i], pulls[i]) < -1.0:
                continue
            state = settled(rod, shapes[i], pulls[i])
            if state is not None and state.is_stable and is_new(state.coefficients, states):
                states.append(state)
    return states


def crosses(rod: Elastica, state: State, tail: float, count: int = 300) -> bool:
    """True if the curve crosses itself or the straight tails, as long as `tail`, behind its clamps."""
    curve = positions(rod, state, np.linspace(0.0, 1.0, count))
    first, last = (np.array([math.cos(end), math.sin(end)]) for end in rod.ends)
    points = np.vstack([curve[0] - tail * first, curve, curve[-1] + tail * last])
    a, b = points[:-1], points[1:]
    edge = b - a

    def side(p: Array) -> Array:
        rel = p[None, :, :] - a[:, None, :]
        return np.asarray(edge[:, None, 0] * rel[:, :, 1] - edge[:, None, 1] * rel[:, :, 0])

    apart = side(a) * side(b) < 0.0
    both = apart & apart.T
    i, j = np.nonzero(both)
    far = np.abs(i - j) > 1
    # The two tails may cross each other: they are no part of the curve.
    tails = ((i == 0) & (j == len(edge) - 1)) | ((j == 0) & (i == len(edge) - 1))
    return bool(np.any(far & ~tails))
