"""Curves that cross themselves or their own tails, and how near they come to themselves."""

from __future__ import annotations

import math

import numpy as np
import pytest

from curveline.rod.geometry.closest_approach import nearest_parts
from curveline.rod.geometry.crossings import clearance, crosses_itself, crosses_tails


def table(points: list[tuple[float, float]], start: float = 0.0, end: float = 0.0) -> np.ndarray:
    """Vertices with the tangent angles of both ends."""
    out = np.zeros((len(points), 4))
    out[:, :2] = points
    out[0, 2], out[-1, 2] = start, end
    return out


def arc(turn: float, n: int = 60) -> np.ndarray:
    """A circle of radius 1 / turn, walked by `turn` radians."""
    places = np.linspace(0.0, turn, n + 1)
    return table([(math.sin(a) / turn, (1.0 - math.cos(a)) / turn) for a in places], 0.0, turn)


SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]


@pytest.mark.parametrize(
    ("points", "crosses"),
    [
        (SQUARE, False),
        ([*SQUARE, (0.0, 0.5)], False),
        ([*SQUARE, (0.5, -0.5)], True),
        ([(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)], True),
        ([(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)], False),
    ],
)
def test_polygons_that_cross_themselves(points: list[tuple[float, float]], crosses: bool) -> None:
    for size in (1e-3, 1.0, 1e3):
        for corners in (points, points[::-1]):
            assert crosses_itself(table(corners) * size) is crosses


@pytest.mark.parametrize("turn", [3.0, 5.0, 6.2])
def test_an_open_ring_does_not_cross_itself(turn: float) -> None:
    assert not crosses_itself(arc(turn))


def test_a_loop_on_a_taut_rod_crosses_itself() -> None:
    loop = [
        (-1.0, 0.0),
        *((math.sin(a), 1.0 - math.cos(a)) for a in np.linspace(-0.3, 2.0 * math.pi + 0.3, 40)),
        (1.0, 0.0),
    ]
    assert crosses_itself(table(loop))


@pytest.mark.parametrize(("tail", "crosses"), [(0.0, False), (0.1, False), (0.6, True)])
@pytest.mark.parametrize("backwards", [False, True])
def test_a_curve_that_comes_round_behind_its_clamp(tail: float, crosses: bool, backwards: bool) -> None:
    points = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (-0.5, 1.0), (-0.5, -1.0)]
    # Walked the other way round the same clamp is the end, whose tangent points the other way.
    shape = table(points[::-1], math.pi / 2, math.pi) if backwards else table(points, 0.0, -math.pi / 2)
    assert crosses_tails(shape, tail) is crosses


def test_a_plain_arch_is_clear_of_its_tails() -> None:
    assert not crosses_tails(table([(0.0, 0.0), (0.3, 0.2), (0.7, 0.2), (1.0, 0.0)], 0.5, -0.5), 1.0)


def test_clearance_is_the_gap_of_an_open_ring() -> None:
    turn = 2.0 * math.pi - 0.2
    ring = arc(turn, 400)
    assert clearance(ring) == pytest.approx(2.0 * math.sin(0.1) / turn, rel=1e-6)


def test_neighbours_are_not_in_contact() -> None:
    straight = table([(x, 0.0) for x in np.linspace(0.0, 1.0, 101)])
    assert clearance(straight) == pytest.approx(0.2)


@pytest.mark.parametrize("seed", range(20))
def test_the_nearest_parts_are_those_of_all_pairs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    at = np.linspace(0.0, 1.0, 301)[:, None]
    points = sum(rng.normal(size=3) / k * np.sin(2.0 * np.pi * k * at + rng.uniform(0.0, 6.0, 3)) for k in range(1, 5))
    apart, enough = int(rng.integers(5, 60)), float(rng.uniform(0.05, 1.0))
    distances = np.linalg.norm(points[:, None] - points[None, :], axis=2)
    expected = min(enough, float(np.min(distances[np.triu_indices(len(points), apart)])))
    assert nearest_parts(points, apart, enough) == pytest.approx(expected, rel=1e-12)
