"""The paper's initial guess: what the spline meets, its derivatives, and the place of its middle point."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
import scipy.optimize

from curveline.rod.planar import spline
from curveline.rod.planar.spline import ALPHA, CHORD, SAMPLES, Guide, arc_weight, guess, objective, place_middle, sample
from curveline.rod.problem import Array

from .rods import random_rods

GUIDES = [
    Guide(7.0, 0.0, 0.0, 0.0, 8.4),
    Guide(7.0, 1.4, 0.6, -0.4, 9.0),
    Guide(6.8, -1.6, -0.7, 0.3, 8.6),
    Guide(7.0, 0.5, 0.8, 0.9, 9.5),
]
MIDDLES = [3.4 + 2.1j, 3.0 - 1.8j, 4.4 + 0.9j]
PAIRS = [(guide, p) for guide in GUIDES for p in MIDDLES]


def samples(guide: Guide, p: complex, count: int = SAMPLES) -> Array:
    points = np.empty((6, count + 1), dtype=np.complex128)
    sample(guide, p, points)
    return points


def value(guide: Guide, p: complex, count: int = SAMPLES) -> float:
    return float(objective(guide, p, np.empty((6, count + 1), dtype=np.complex128))[0])


@pytest.mark.parametrize("u", [0.0, 0.2, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("bend", [-2.5, -0.5, -2e-3, -1e-4, 0.0, 1e-5, 9.99e-4, 1.01e-3, 0.3, 1.5, 3.0])
def test_arc_weight_and_its_derivatives(u: float, bend: float) -> None:
    # An arc's position along its chord, to second order in the angle near zero.
    got, slope, curve = arc_weight(u, bend)
    exact = u if bend == 0.0 else u * cmath.exp(1j * (u - 1.0) * bend) * sinc(u * bend) / sinc(bend)
    assert got == pytest.approx(exact, abs=2e-9)
    step = 1e-4
    ahead, behind = arc_weight(u, bend + step), arc_weight(u, bend - step)
    if abs(abs(bend) - 1e-3) > 2 * step:
        assert slope == pytest.approx((ahead[0] - behind[0]) / (2 * step), rel=1e-6, abs=2e-6)
        assert curve == pytest.approx((ahead[1] - behind[1]) / (2 * step), rel=1e-5, abs=2e-5)


def sinc(x: float) -> float:
    return math.sin(x) / x if x else 1.0


@pytest.mark.parametrize(("guide", "p"), PAIRS)
def test_spline_meets_its_points_and_the_clamps_tangents(guide: Guide, p: complex) -> None:
    points = samples(guide, p, 4000)[0]
    assert points[0] == 0.0
    assert points[2000] == pytest.approx(p)
    assert points[-1] == pytest.approx(complex(guide.x, guide.y))
    for tangent, angle in ((points[1] - points[0], guide.start), (points[-1] - points[-2], guide.end)):
        assert cmath.phase(tangent * cmath.exp(-1j * angle)) == pytest.approx(0.0, abs=2e-3)


def curvature(points: Array, at: int) -> float:
    """Of the circle through a sample and its neighbours."""
    a, b, c = points[at - 1], points[at], points[at + 1]
    area = ((b - a).conjugate() * (c - a)).imag
    return float(2.0 * area / (abs(b - a) * abs(c - b) * abs(c - a)))


@pytest.mark.parametrize(("guide", "p"), PAIRS)
def test_curvature_is_continuous_in_the_middle_and_the_circles_at_the_ends(guide: Guide, p: complex) -> None:
    count = 4000
    points = samples(guide, p, count)[0]
    middle = count // 2
    # Three samples on each side of the middle point, none across it.
    left = 2.0 * curvature(points, middle - 2) - curvature(points, middle - 4)
    right = 2.0 * curvature(points, middle + 2) - curvature(points, middle + 4)
    assert left == pytest.approx(right, abs=2e-4 * max(1.0, abs(left)))
    far = complex(guide.x, guide.y)
    through = np.array([0.0, p, far])
    assert left == pytest.approx(curvature(through, 1), abs=2e-3)
    # At a clamp: the circle that leaves it tangentially and passes through the middle point.
    for end, angle, clamp in ((1, guide.start, 0.0), (count - 1, guide.end + math.pi, far)):
        chord = (p - clamp) * cmath.exp(-1j * angle)
        circle = 2.0 * chord.imag / abs(chord) ** 2 * (1.0 if clamp == 0.0 else -1.0)
        assert curvature(points, end) == pytest.approx(circle, abs=5e-3)


@pytest.mark.parametrize(("guide", "p"), PAIRS)
def test_gradient_and_hessian_of_the_objective_are_exact(guide: Guide, p: complex) -> None:
    points = np.empty((6, SAMPLES + 1), dtype=np.complex128)
    jet = objective(guide, p, points)
    step = 1e-5

    def near(offset: complex) -> tuple[float, ...]:
        return tuple(objective(guide, p + offset, points))

    right, left, up, down = near(step), near(-step), near(1j * step), near(-1j * step)
    wanted = [
        (right[0] - left[0]) / (2 * step),
        (up[0] - down[0]) / (2 * step),
        (right[1] - left[1]) / (2 * step),
        (up[1] - down[1]) / (2 * step),
        (up[2] - down[2]) / (2 * step),
    ]
    assert min(abs(jet[1]) + abs(jet[2]), abs(jet[3]), abs(jet[5])) > 1e-2
    scale = max(abs(entry) for entry in wanted)
    assert jet[1:] == pytest.approx(wanted, rel=1e-6, abs=1e-7 * scale)


@pytest.mark.parametrize(("guide", "p"), PAIRS)
def test_objective_is_curvature_squared_plus_ten_times_the_missing_length_squared(guide: Guide, p: complex) -> None:
    points = samples(guide, p)[0]
    edges = np.diff(points)
    lengths = abs(edges)
    turn = 1.0 - (edges[1:] * edges[:-1].conjugate()).real / (lengths[1:] * lengths[:-1])
    bending = np.sum(2.0 * turn / (lengths[1:] + lengths[:-1]))
    assert ALPHA == 10.0
    assert value(guide, p) == pytest.approx(bending**2 + ALPHA * (lengths.sum() - guide.length) ** 2)


def guides(count: int) -> list[Guide]:
    """Random scenes in the units of the optimisation."""
    made = []
    for rod in random_rods(150, count):
        scaled = rod.scaled()
        unit = CHORD / math.hypot(*scaled.chord)
        x, y = (float(unit * value) for value in scaled.chord)
        made.append(Guide(x, y, float(scaled.ends[0]), float(scaled.ends[1]), unit))
    return made


def first_middle(guide: Guide, side: float) -> complex:
    chord = complex(guide.x, guide.y)
    reach = 0.5 * math.sqrt(guide.length**2 - CHORD**2)
    return 0.5 * chord + side * reach * 1j * chord / abs(chord)


def test_placing_takes_few_iterations_and_meets_the_length() -> None:
    used, missed = [], []
    for guide in guides(150):
        for side in (1.0, -1.0):
            points = np.empty((6, SAMPLES + 1), dtype=np.complex128)
            p, iterations = place_middle(guide, first_middle(guide, side), points, 40)
            assert iterations > 0
            used.append(iterations)
            missed.append(abs(np.abs(np.diff(samples(guide, p)[0])).sum() / guide.length - 1.0))
    spread = np.percentile(used, [0, 50, 90, 100])
    print(f"iterations: least, median, 90 %, most {spread}; length missed by at most {100 * max(missed):.2f} %")
    assert np.median(used) <= 10
    assert max(missed) < 0.02


@pytest.mark.parametrize("number", range(8))
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_middle_point_is_a_minimum_and_none_on_its_side_is_lower(number: int, side: float) -> None:
    guide = guides(8)[number]
    points = np.empty((6, SAMPLES + 1), dtype=np.complex128)
    p, _ = place_middle(guide, first_middle(guide, side), points, 40)
    here = value(guide, p)
    chord = complex(guide.x, guide.y)
    tries = []
    for along in np.linspace(0.15, 0.85, 29):
        for across in np.linspace(0.02, 0.5, 25):
            place = chord * complex(along, side * across)
            tries.append((value(guide, place), place))
    _, best = min(tries, key=lambda pair: pair[0])
    polished = scipy.optimize.minimize(
        lambda at: value(guide, complex(*at)), [best.real, best.imag], method="Nelder-Mead",
        options={"xatol": 1e-9, "fatol": 1e-12, "maxiter": 2000},
    )  # fmt: skip
    assert here <= polished.fun * (1.0 + 1e-6)
    if (p / chord).imag * side > 0.02:
        assert abs(p - complex(*polished.x)) < 1e-3 * CHORD


def test_guess_lays_a_smooth_rod_from_clamp_to_clamp() -> None:
    for rod in random_rods(5, 40):
        scaled = rod.scaled()
        heights = []
        for side in (1.0, -1.0):
            phi = np.empty(48)
            assert guess(scaled.chord, scaled.ends, side, phi) > 0
            assert np.max(abs(np.diff(phi))) < 0.5
            end = np.array([np.cos(phi).sum(), np.sin(phi).sum()]) / 48
            assert np.linalg.norm(end - scaled.chord) < 0.03
            run = np.cumsum(np.exp(1j * phi)) / 48
            heights.append(float((run * np.conj(complex(*scaled.chord))).imag.mean()))
        assert heights[0] >= heights[1]


def test_a_taut_rod_still_gets_a_finite_guess() -> None:
    phi = np.empty(24)
    spline.guess(np.array([0.9999, 0.0]), np.array([0.0, 0.0]), 1.0, phi)
    assert np.all(np.isfinite(phi))
