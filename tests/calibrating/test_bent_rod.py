"""The curve of a segment for numbers that are sought: as `simulate` has it, and as other solvers do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from curveline.calibrating.bent_rod import Bent, BentSegment, states_of
from curveline.calibrating.calibrate import calibrated_display
from curveline.calibrating.unknowns import STEPS, Unknowns
from curveline.fitting.measured import Gaps
from curveline.scene import PEAK, Scene
from curveline.shapes.files import read_shape
from curveline.simulation.simulate import simulate
from curveline.units import deg, mm
from seen_trials import EIGHT

UNKNOWNS = Unknowns(2)


def numbers(leaning: float = 0.0) -> np.ndarray:
    """A soft display that is a little off."""
    found = np.zeros(UNKNOWNS.size)
    found[:6] = 0.41**-3, mm(9.0), leaning, deg(0.6), deg(-0.4), mm(0.7)
    return found


def bent(name: str, at: np.ndarray) -> tuple[BentSegment, Bent]:
    scene = read_shape(name)
    segment = BentSegment(scene, 0, UNKNOWNS)
    return segment, states_of(segment, at)[scene.segments[0].state]


@pytest.mark.parametrize("name", EIGHT)
def test_curves_are_those_of_a_simulation_with_the_display_that_is_found(name: str) -> None:
    at = numbers()
    _, found = bent(name, at)
    scene = read_shape(name)
    shown = simulate(replace(scene, display=calibrated_display(scene.display, UNKNOWNS, at)), mm(0.001))[0].wanted
    assert shown is not None
    expected = shown.curve(2001) + np.array([0.0, scene.nodes[0].height])
    assert Gaps.between(found.points[1:-1], expected).there.max() < mm(0.03)


@pytest.mark.parametrize("leaning", [0.0, 0.08])
def test_slopes_are_those_of_small_changes(leaning: float) -> None:
    at = numbers(leaning)
    segment, here = bent("staggered-down-valley", at)
    moves = segment.moves(at, here)
    assert moves is not None
    for place, by in zip(UNKNOWNS.places(0), moves, strict=False):
        step = 0.3 * STEPS[UNKNOWNS.all[place].kind]
        ends = []
        for sign in (-1.0, 1.0):
            other = at.copy()
            other[place] += sign * step
            there = segment.bent(other, here[:2])
            assert there is not None
            ends.append(there.points)
        central = (ends[1] - ends[0]) / (2.0 * step)
        assert by == pytest.approx(central, abs=0.05 * np.abs(central).max())


def ode_curve(scene: Scene, at: np.ndarray, guess: Bent) -> np.ndarray:
    """The free rod with M = EI (1 + a sgn(k)) k under its weight, by collocation: points seen from the left pivot."""
    weight, give, leaning, left, right, more = at[:6].tolist()
    display, (first, last) = scene.display, scene.nodes
    half, length = 0.5 * display.clamp, scene.segments[0].length + more - display.clamp
    told = first.angle + left, last.angle + right
    s = np.linspace(0.0, length, guess.curvatures.size)

    def bends(moment: np.ndarray) -> np.ndarray:
        return moment / (1.0 + leaning * np.sign(moment))

    def slopes(s: np.ndarray, y: np.ndarray, p: np.ndarray) -> np.ndarray:
        # The rod beyond s bears on it: its last mouth holds it with the force (p0, p1), its weight hangs on it.
        across, up = p[0], p[1] - weight * (length - s)
        return np.vstack([bends(y[1]), across * np.sin(y[0]) - up * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

    def ends(a: np.ndarray, b: np.ndarray, p: np.ndarray) -> np.ndarray:
        # A bearing tilts about its pivot by the moment there, that of the mouth and of the force on its lever.
        push, lift = p[0], p[1] - weight * length
        moment_left = a[1] - half * (push * np.sin(a[0]) - lift * np.cos(a[0]))
        moment_right = b[1] + half * (p[0] * np.sin(b[0]) - p[1] * np.cos(b[0]))
        begin = half * np.cos(a[0]), half * np.sin(a[0])
        end = display.span - half * np.cos(b[0]), last.height - first.height - half * np.sin(b[0])
        return np.array(
            [
                a[0] - told[0] - give * moment_left,
                b[0] - told[1] + give * moment_right,
                a[2] - begin[0],
                a[3] - begin[1],
                b[2] - end[0],
                b[3] - end[1],
            ]
        )

    points = guess.points[2:-2] - np.array([0.0, first.height])
    angles = np.arctan2(*np.gradient(points, axis=0).T[::-1])
    start = np.vstack([angles, (1.0 + leaning * np.sign(guess.curvatures)) * guess.curvatures, points.T])
    found = solve_bvp(slopes, ends, s, start, p=[0.0, 0.0], tol=1e-5, max_nodes=20000)
    assert found.success, found.message
    return np.asarray(found.sol(np.linspace(0.0, length, 801))[2:].T) + np.array([0.0, first.height])


@pytest.mark.parametrize("leaning", [0.1, -0.1])
@pytest.mark.parametrize("name", ["level-asymmetric-peak", "staggered-down-valley"])
def test_a_rod_that_bends_harder_to_one_side_is_as_collocation_has_it(name: str, leaning: float) -> None:
    at = numbers(leaning)
    segment, found = bent(name, at)
    expected = ode_curve(segment.scene, at, found)
    assert Gaps.between(found.points[2:-2], expected).there.max() < mm(0.05)
    alike = numbers()
    other = segment.bent(alike, found[:2])
    assert other is not None
    assert Gaps.between(other.points[2:-2], expected).there.max() > mm(1.0)


def test_a_segment_without_rod_to_spare_has_no_states() -> None:
    scene = read_shape("level-neutral-peak")
    short = replace(scene, segments=(replace(scene.segments[0], length=scene.display.span),))
    assert states_of(BentSegment(short, 0, UNKNOWNS), np.zeros(UNKNOWNS.size)) == {}
    assert PEAK in states_of(BentSegment(scene, 0, UNKNOWNS), numbers())
