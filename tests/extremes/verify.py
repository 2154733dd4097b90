"""Checks a planar equilibrium by means that share nothing with the solver: an ODE, and a second variation of its own.

The elastica is integrated with DOP853 in pieces (multiple shooting): a single run from the left clamp would lose all
digits on a taut rod, where errors grow by exp(L sqrt(T / EI)). The pieces start where the returned curve says, with
the force and moment that it says; Newton on the pieces' joints then gives the exact solution beside it. The curve must
lie within its stated error of that solution, whose own second variation, on quadratic finite elements, must agree with
the verdict on stability.

Units inside: the free length and EI. N is the force that the rod beyond s puts on the rod before s, so that
N' = (0, w), kappa' = sin(theta) N_x - cos(theta) N_y (Love 1927, section 262).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import eigh, qr
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

from curveline.rod.states.equilibrium import Equilibrium

Array = NDArray[np.float64]

GROWTH = 2.5
"""Most that a piece may let errors grow, as an exponent."""
LONGEST = 1.0 / 16.0
MOST_PIECES = 3000
SAMPLES = 17
MOST_ELEMENTS = 260


class Check(NamedTuple):
    """What is true of a state: its curve's largest error [m], and the lowest eigenvalue in EI/L^2 of the free rod."""

    error: float
    lowest_eigenvalue: float
    corrected: float  # what Newton changed of the force, relative to it


class Scaled(NamedTuple):
    """A state in units of its free length and EI: places, x, y, angle, curvature of its vertices, and its loads."""

    places: Array
    table: Array
    force: Array  # N at the left clamp
    weight: float
    loads: Array  # (m, 3): place, force
    chord: Array
    ends: tuple[float, float]


class Exact(NamedTuple):
    """The exact solution: its pieces' samples (m, SAMPLES), each a row of x, y, angle and curvature, and N there."""

    places: Array
    table: Array
    force: Array  # (m, SAMPLES, 2)


def check(state: Equilibrium) -> Check:
    """Compare a state with the exact solution beside it; AssertionError with what is wrong."""
    numbers = [state.energy, state.error, state.lowest_eigenvalue, state.clearance, state.max_curvature]
    for values in (numbers[:3], state.vertices_table, state.clamp_force, state.clamp_moment, state.edges):
        assert np.all(np.isfinite(values)), "a number is not finite"
    assert not any(math.isnan(value) for value in numbers)
    check_ends_and_length(state)
    scaled = in_own_units(state)
    exact, corrected = (None if state.winding else closed_form(scaled)) or shoot(scaled)
    lowest = lowest_mode(exact)
    assert (lowest > 0.0) == state.stable, f"stable is {state.stable}, but the lowest eigenvalue is {lowest}"
    return Check(largest_error(state, exact), lowest, corrected)


def check_ends_and_length(state: Equilibrium) -> None:
    """The curve begins and ends at the pivots, lies straight in the bearings, and is as long as its rod."""
    rod = state.rod
    slack = state.error + 1e-11 * rod.length
    curve = state.curve(4001)
    assert np.max(np.abs(curve[0])) <= slack, "the curve does not begin at the left pivot"
    assert np.max(np.abs(curve[-1] - rod.chord)) <= slack, "the curve does not end at the right pivot"
    table, edges = state.vertices_table, state.edges
    assert math.isclose(edges.sum(), rod.free_length, rel_tol=1e-9)
    assert table[0, 2] == rod.start
    assert math.isclose(table[-1, 2], rod.start + rod.turn, rel_tol=1e-12, abs_tol=1e-12), (
        "the tangent misses the clamp"
    )
    chords = np.hypot(*np.diff(table[:, :2], axis=0).T)
    assert np.max(chords - edges) <= 2.0 * slack, "an edge is stretched"
    # An arc is longer than its chord by the cube of its length times the square of its curvature over 24.
    steps = np.hypot(*np.diff(curve, axis=0).T)
    step = rod.length / 4000
    bend = min(1.0, state.max_curvature * step)
    assert np.max(np.abs(steps - step)) <= 2.0 * slack + step * bend**2, "the curve is not as long as its rod"


def in_own_units(state: Equilibrium) -> Scaled:
    """The state with the free length and EI as units, the free rod beginning at the origin."""
    rod = state.rod
    length = rod.free_length
    unit = length * length / rod.stiffness
    table = state.vertices_table.copy()
    table[:, :2] = (table[:, :2] - rod.free_start) / length
    # The moment at the left clamp rather than the table's curvature: it is what the state claims.
    table[:, 3] *= length
    natural = rod.natural_curvature * length
    table[0, 3] = natural - state.clamp_moment[0] * length / rod.stiffness
    table[-1, 3] = natural + state.clamp_moment[1] * length / rod.stiffness
    at, forces = rod.dead_loads()
    loads = np.column_stack([(at * rod.length - 0.5 * rod.clamp) / length, forces * unit])
    places = np.concatenate([[0.0], np.cumsum(state.edges) / length])
    return Scaled(
        places,
        table,
        -state.clamp_force[0] * unit,
        rod.weight * length * unit,
        loads,
        np.array(rod.free_chord) / length,
        (rod.start, rod.start + rod.turn),
    )


def force_at(scaled: Scaled, force: Array, places: Array) -> Array:
    """N just after each of the `places (k,)`: (2, k)."""
    out = np.repeat(force[:, None], places.size, axis=1)
    out[1] += scaled.weight * places
    for place, x, y in scaled.loads:
        out -= np.outer([x, y], places >= place - 1e-9)
    return out


def pieces(scaled: Scaled) -> Array:
    """Places between which to integrate: near each other where the rod is taut or curved, and one at every load."""
    force = force_at(scaled, scaled.force, scaled.places)
    rate = np.sqrt(np.hypot(*force)) + np.abs(scaled.table[:, 3])
    steps = np.diff(scaled.places)
    growth = np.concatenate(
        [[0.0], np.cumsum(np.maximum(0.5 * (rate[1:] + rate[:-1]) / GROWTH, 1.0 / LONGEST) * steps)]
    )
    count = min(MOST_PIECES, max(1, math.ceil(growth[-1])))
    chosen = np.interp(np.linspace(0.0, growth[-1], count + 1)[1:-1], growth, scaled.places)
    far = np.min(np.abs(chosen[:, None] - scaled.loads[:, 0]), axis=1, initial=1.0) > 1e-7
    return np.unique(np.concatenate([[0.0], chosen[far], scaled.loads[:, 0], [1.0]]))


def march(scaled: Scaled, begin: Array, start: Array, force: Array) -> Array:
    """Integrate all pieces side by side over their own length, 0 to 1; samples (SAMPLES, 5, 4, pieces).

    `begin (m+1,)` places, `start (2, m)` angle and curvature times the piece's length. Rows: dx, dy, angle, curvature
    times length; columns: the value, and its derivatives by the angle, the curvature and N at the piece's start.
    """
    size = np.diff(begin)
    m = size.size
    base = force_at(scaled, force, begin[:-1])
    rise = scaled.weight * size

    def slope(t: float, flat: Array) -> Array:
        y = flat.reshape(5, 4, m)
        out = np.empty_like(y)
        cosine, sine = np.cos(y[0, 2]), np.sin(y[0, 2])
        x_force, y_force = base[0], base[1] + t * rise
        out[0, 0], out[0, 1], out[0, 2] = cosine, sine, y[0, 3]
        out[0, 3] = size**2 * (sine * x_force - cosine * y_force)
        turned = y[1:, 2]
        out[1:, 0], out[1:, 1], out[1:, 2] = -sine * turned, cosine * turned, y[1:, 3]
        out[1:, 3] = size**2 * (cosine * x_force + sine * y_force) * turned
        out[3, 3] += size**2 * sine
        out[4, 3] -= size**2 * cosine
        return out.ravel()

    first = np.zeros((5, 4, m))
    first[0, 2], first[0, 3] = start
    first[1, 2] = 1.0
    first[2, 3] = 1.0
    ticks = np.linspace(0.0, 1.0, SAMPLES)
    run = solve_ivp(slope, (0.0, 1.0), first.ravel(), "DOP853", ticks, rtol=1e-11, atol=1e-12)
    assert run.success, "the pieces could not be integrated"
    return np.asarray(run.y.T.reshape(SAMPLES, 5, 4, m))


def shoot(scaled: Scaled) -> tuple[Exact, float]:
    """Newton on the joints of the pieces, from the state as it is; the exact solution, and the force's change."""
    begin = pieces(scaled)
    size = np.diff(begin)
    assert np.max(size * np.sqrt(np.hypot(*scaled.force))) < 12.0, "the rod is too taut for this method"
    start = np.vstack([np.interp(begin[:-1], scaled.places, scaled.table[:, 2 + k]) for k in (0, 1)])
    start[1] *= size
    force = scaled.force.copy()
    for _ in range(12):
        samples = march(scaled, begin, start, force)
        change, moved = newton_step(scaled, size, start, samples[-1])
        assert np.max(np.abs(change)) < 3.0, "there is no exact equilibrium near this state"
        start = start + change
        force = force + moved
        if np.max(np.abs(change)) < 1e-7:
            break
    else:
        raise AssertionError("there is no exact equilibrium near this state")
    samples = march(scaled, begin, start, force)
    scale = max(float(np.max(np.abs(scaled.force))), 1.0)
    return assemble(scaled, begin, samples, force), float(np.max(np.abs(force - scaled.force))) / scale


def closed_form(scaled: Scaled) -> tuple[Exact, float] | None:
    """The solution of a rod without weight and loads so taut that its two clamps do not feel each other, else None.

    With p the angle to the line of the pull, tan(p / 4) falls as exp(-s / d) from each clamp, and the rod loses
    2 d (1 - cos(p / 2)) along that line and wins 2 d sin(p / 2) across it (Love 1927, section 263).
    """
    if scaled.weight or scaled.loads.size or np.hypot(*scaled.force) < 2e4:
        return None
    middle = float(scaled.table[np.searchsorted(scaled.places, 0.5), 2])
    span, direction = float(np.hypot(*scaled.chord)), math.atan2(scaled.chord[1], scaled.chord[0])
    direction += 2.0 * math.pi * round((middle - direction) / (2.0 * math.pi))
    line = direction
    for _ in range(60):
        first, last = (end - line for end in scaled.ends)
        lost = 2.0 * (2.0 - math.cos(0.5 * first) - math.cos(0.5 * last))
        won = 2.0 * (math.sin(0.5 * first) + math.sin(0.5 * last))
        # Of (1 - lost d)^2 + (won d)^2 = span^2 the smaller root.
        square = lost * lost + won * won
        d = (
            (1.0 - span)
            * (1.0 + span)
            / (lost + math.sqrt(max(lost * lost - square * (1.0 - span) * (1.0 + span), 0.0)))
        )
        line = direction - math.atan2(won * d, 1.0 - lost * d)
    if d > 0.01:
        return None
    begin = np.concatenate([[0.0], 0.5 * d * 2.0 ** np.arange(0.0, max(1.0, math.log2(0.5 / d)), 0.25), [0.5]])
    begin = np.concatenate([begin, 1.0 - begin[-2::-1]])
    places = begin[:-1, None] + np.diff(begin)[:, None] * np.linspace(0.0, 1.0, SAMPLES)
    table = np.empty((*places.shape, 4))
    along, across = places.copy(), np.zeros_like(places)
    for begin_angle, distance, sign in ((first, places, 1.0), (last, 1.0 - places, -1.0)):
        angle = 4.0 * np.arctan(math.tan(0.25 * begin_angle) * np.exp(-distance / d))
        here = 2.0 * d * (np.cos(0.5 * angle) - math.cos(0.5 * begin_angle))
        aside = 2.0 * d * (math.sin(0.5 * begin_angle) - np.sin(0.5 * angle))
        if sign > 0.0:
            table[:, :, 2], table[:, :, 3] = angle, -2.0 / d * np.sin(0.5 * angle)
            along -= here
            across += aside
        else:
            table[:, :, 2] += angle
            table[:, :, 3] += 2.0 / d * np.sin(0.5 * angle)
            along -= 2.0 * d * (1.0 - math.cos(0.5 * begin_angle)) - here
            across += 2.0 * d * math.sin(0.5 * begin_angle) - aside
    table[:, :, 0] = math.cos(line) * along - math.sin(line) * across
    table[:, :, 1] = math.sin(line) * along + math.cos(line) * across
    table[:, :, 2] += line
    force = np.array([math.cos(line), math.sin(line)]) / d**2
    changed = float(np.max(np.abs(force - scaled.force)) * d**2)
    return Exact(places, table, np.broadcast_to(force, (*places.shape, 2))), changed


def newton_step(scaled: Scaled, size: Array, start: Array, last: Array) -> tuple[Array, Array]:
    """Change of `start (2, m)` and of the force (2,) that joins the pieces, whose ends are `last (5, 4, m)`."""
    m = size.size
    ratio = np.concatenate([size[1:] / size[:-1], [1.0]])
    rows, columns, values, wrong = [], [], [], np.zeros(2 * m + 2)

    def put(row: Array | int, column: Array | int, value: Array | float) -> None:
        row, column, value = np.broadcast_arrays(row, column, value)
        rows.append(row.ravel())
        columns.append(column.ravel())
        values.append(value.ravel())

    joints = np.arange(m)
    for part in range(2):
        own = last[:, 2 + part] * (ratio if part else 1.0)
        following = np.concatenate([start[part, 1:], [scaled.ends[1] if part == 0 else 0.0]])
        keep = joints if part == 0 else joints[:-1]
        row = (2 * keep + 1) + part
        wrong[row] = (own[0] - following)[keep]
        for by in range(2):
            put(row, 2 * keep + by, own[1 + by][keep])
            put(row, 2 * m + by, own[3 + by][keep])
        put(row[: m - 1], 2 * joints[1:] + part, -1.0)
    wrong[0] = start[0, 0] - scaled.ends[0]
    put(0, 0, 1.0)
    for axis in range(2):
        row = 2 * m + axis
        wrong[row] = float(last[0, axis] @ size) - scaled.chord[axis]
        for by in range(2):
            put(row, 2 * joints + by, last[1 + by, axis] * size)
            put(row, 2 * m + by, float(last[3 + by, axis] @ size))
    shape = (2 * m + 2, 2 * m + 2)
    matrix = coo_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape).tocsc()
    step = -spsolve(matrix, wrong)
    return step[: 2 * m].reshape(m, 2).T, step[2 * m :]


def assemble(scaled: Scaled, begin: Array, samples: Array, force: Array) -> Exact:
    """The pieces laid end to end; the end of one is the begin of the next and comes once."""
    size = np.diff(begin)
    ticks = np.linspace(0.0, 1.0, SAMPLES)
    offsets = np.concatenate([[[0.0, 0.0]], np.cumsum((samples[-1, 0, :2] * size).T, axis=0)])
    table = np.empty((SAMPLES, size.size, 4))
    table[:, :, 0] = offsets[:-1, 0] + samples[:, 0, 0] * size
    table[:, :, 1] = offsets[:-1, 1] + samples[:, 0, 1] * size
    table[:, :, 2] = samples[:, 0, 2]
    table[:, :, 3] = samples[:, 0, 3] / size
    places = begin[:-1] + ticks[:, None] * size
    # N jumps at a load: what counts is its value inside the piece, after the load at its begin.
    base = force_at(scaled, force, begin[:-1])
    inside = base[:, None, :] + np.array([0.0, scaled.weight])[:, None, None] * (ticks[:, None] * size)
    return Exact(places.T, table.transpose(1, 0, 2), inside.transpose(2, 1, 0))


def largest_error(state: Equilibrium, exact: Exact) -> float:
    """Largest distance [m] of the state's curve from the exact one, where the exact one was sampled."""
    rod = state.rod
    points = 2001
    curve = (state.curve(points) - rod.free_start) / rod.free_length
    places = (np.linspace(0.0, rod.length, points) - 0.5 * rod.clamp) / rod.free_length
    inside = (places >= 0.0) & (places <= 1.0)
    truth = positions(exact, places[inside])
    return float(np.max(np.hypot(*(curve[inside] - truth).T))) * rod.free_length


def positions(exact: Exact, places: Array) -> Array:
    """Positions (k, 2) on the exact curve, by quintic Hermite polynomials between its samples."""
    s, table = exact.places.ravel(), exact.table.reshape(-1, 4)
    right = np.clip(np.searchsorted(s, places, side="right"), 1, s.size - 1)
    # Neighbouring pieces share a sample; never take an interval of no length.
    right = np.where(s[right] - s[right - 1] > 0.0, right, np.minimum(right + 1, s.size - 1))
    left = right - 1
    h = s[right] - s[left]
    t = np.clip((places - s[left]) / h, 0.0, 1.0)
    out = np.empty((places.size, 2))
    for axis in range(2):
        total = np.zeros(places.size)
        for node, u, side in ((left, t, 1.0), (right, 1.0 - t, -1.0)):
            angle, bend = table[node, 2], table[node, 3]
            tangent = np.cos(angle) if axis == 0 else np.sin(angle)
            normal = -np.sin(angle) if axis == 0 else np.cos(angle)
            blend = (1.0 - u) ** 3
            total += table[node, axis] * blend * (1.0 + 3.0 * u + 6.0 * u * u)
            total += side * h * tangent * blend * u * (1.0 + 3.0 * u)
            total += h * h * bend * normal * blend * 0.5 * u * u
        out[:, axis] = total
    return out


def lowest_mode(exact: Exact) -> float:
    """Smallest eigenvalue of the second variation, with both ends of the rod held, on quadratic elements."""
    stiffness, mass, border = second_variation(exact)
    basis, _ = qr(border.T)
    free = basis[:, border.shape[0] :]
    return float(eigh(free.T @ stiffness @ free, free.T @ mass @ free, eigvals_only=True, subset_by_index=[0, 0])[0])


def second_variation(exact: Exact) -> tuple[Array, Array, Array]:
    """Stiffness, mass (k, k) and constraints (2, k): integrals of h'^2 + N.t h^2, of h^2, and of h along the normal.

    An element spans one, two or more intervals of a piece; its basis is quadratic, its integrals are Gauss's with
    three points, the integrand there being interpolated from the exact samples.
    """
    per_piece = max(1, min(4, MOST_ELEMENTS // exact.places.shape[0]))
    every = (SAMPLES - 1) // per_piece
    pulls = np.cos(exact.table[:, :, 2]) * exact.force[:, :, 0] + np.sin(exact.table[:, :, 2]) * exact.force[:, :, 1]
    step = max(1, math.ceil(exact.places.shape[0] * per_piece / MOST_ELEMENTS)) if per_piece == 1 else 1
    borders = np.concatenate([exact.places[:, :-1:every].ravel()[::step], [exact.places[-1, -1]]])
    s = exact.places.ravel()
    count = 2 * (borders.size - 1) - 1
    stiffness, mass, border = np.zeros((count + 2,) * 2), np.zeros((count + 2,) * 2), np.zeros((2, count + 2))
    size = np.diff(borders)
    fine = 4 * step
    nodes, weights = np.polynomial.legendre.leggauss(3)
    for part in range(fine):
        for node, weight in zip(nodes, weights, strict=True):
            u = (part + 0.5 * (node + 1.0)) / fine
            at = borders[:-1] + u * size
            pull = np.interp(at, s, pulls.ravel())
            angle = np.interp(at, s, exact.table[:, :, 2].ravel())
            shape = np.array([(1 - u) * (1 - 2 * u), 4 * u * (1 - u), u * (2 * u - 1)])
            slope = np.array([4 * u - 3, 4 - 8 * u, 4 * u - 1])
            share = 0.5 * weight / fine * size
            first = 2 * np.arange(size.size)
            for i in range(3):
                np.add.at(border[0], first + i, share * shape[i] * np.sin(angle))
                np.add.at(border[1], first + i, share * shape[i] * np.cos(angle))
                for j in range(3):
                    value = share * (slope[i] * slope[j] / size**2 + pull * shape[i] * shape[j])
                    np.add.at(stiffness, (first + i, first + j), value)
                    np.add.at(mass, (first + i, first + j), share * shape[i] * shape[j])
    return stiffness[1:-1, 1:-1], mass[1:-1, 1:-1], border[:, 1:-1]
