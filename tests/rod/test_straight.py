"""The one state of a rod without any to spare: against beam theory, alone where it must be, called straight."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from clamped_rods import changed
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.choice import EXTENSIBLE, PLANAR, SPATIAL, SearchRequest, model_states
from curveline.rod.models.no_state_reason import why_not
from curveline.rod.models.straight import is_too_short_to_buckle
from curveline.rod.planar.newton import Effort, descend
from curveline.rod.problem import Array, make_problem, mesh
from curveline.rod.states.equilibrium import Equilibrium, Outcome
from curveline.rod.states.slack import STRAIGHT, are_straight, is_slack, is_straight
from curveline.scene import Display, Node
from curveline.shapes.files import read_display
from curveline.simulation.simulate import clamped_rod
from curveline.units import TAUT, deg, mm

SINGLE = read_display("single")
LIGHT = replace(SINGLE, gravity=False)
TOLERANCE = 1e-6
RELAX = Effort(turn=0.5, close=1e-9, iterations=400)
EDGES = 48
POINTS = 2001


def rod_of(display: Display, spare: float, turns: tuple[float, float] = (0.0, 0.0), rise: float = 0.0) -> ClampedRod:
    """A rod with `spare` [m] beyond the way between its mouths, its clamps turned so far [deg] from the line of its
    pivots, its right node `rise` [mm] above the left."""
    line = math.atan2(mm(rise), display.span)
    nodes = Node(0.0, line + deg(turns[0])), Node(mm(rise), line + deg(turns[1]))
    way = math.hypot(*clamped_rod(display, nodes, display.span).free_chord)
    return clamped_rod(display, nodes, display.clamp + way + spare)


def states_of(rod: ClampedRod, model: str = "auto") -> tuple[Equilibrium, ...]:
    return model_states(rod, SearchRequest(TOLERANCE, (0,), model)).states


def random_rods(count: int, seed: int) -> Iterator[ClampedRod]:
    """Straight rods, stiff and soft ones, light and heavy ones, between bearings of every kind."""
    chance = np.random.default_rng(seed)
    while count:
        factor, mass = 10.0 ** chance.uniform(-2.0, 2.0), chance.choice([1.0, 1.0, 10.0, 100.0])
        rod = replace(
            SINGLE.rod,
            youngs_modulus=factor * SINGLE.rod.youngs_modulus,
            mass_per_length=mass * SINGLE.rod.mass_per_length,
            natural_curvature=float(chance.choice([0.0, 0.5, -0.3])),
        )
        display = replace(SINGLE, rod=rod, gravity=bool(chance.random() < 0.6), clamp=float(chance.choice([0.0, 0.05])))
        if chance.random() < 0.2:
            play = float(chance.choice([0.0, deg(1.0)]))
            display = replace(display, clamp_stiffness=10.0 ** chance.uniform(-1.0, 2.0), clamp_play=play)
        turns = tuple(chance.uniform(-4.9, 4.9, 2).tolist())
        made = rod_of(display, 0.48 * chance.uniform(-1e-4, STRAIGHT), turns, chance.uniform(-200.0, 200.0))
        if is_straight(made):
            count -= 1
            yield made


def beam(rod: ClampedRod, tension: float, places: Array) -> tuple[Array, float]:
    """Heights of a beam between its clamps by EI y'''' - T y'' = -w, and the rod that it takes beyond the chord [m].

    Of small slopes, with a tension that is not zero; nothing of it is a discrete rod.
    """
    span, line = math.hypot(*rod.free_chord), math.atan2(rod.free_chord[1], rod.free_chord[0])
    k = np.sqrt(complex(tension / rod.stiffness))
    load = rod.weight * math.cos(line)

    def basis(x: Array) -> Array:
        flat = np.ones_like(x)
        heights = [flat, x, np.cosh(k * x), np.sinh(k * x)]
        return np.stack([heights, [0.0 * flat, flat, k * np.sinh(k * x), k * np.cosh(k * x)]])

    slopes = math.tan(rod.start - line), math.tan(rod.end - line)
    ends = basis(np.array([0.0, span]))
    # The weight itself bends it to a parabola, and adds to both at the right end.
    own = np.array([0.0, 0.5 * load / tension * span**2, 0.0, load / tension * span])
    numbers = np.linalg.solve(ends.transpose(0, 2, 1).reshape(4, 4), np.array([0.0, 0.0, *slopes]) - own)
    x = np.linspace(0.0, span, POINTS)
    slope = (numbers @ basis(x)[1]).real + load * x / tension
    height = (numbers @ basis(places)[0]).real + 0.5 * load / tension * places**2
    return height, float(np.trapezoid(0.5 * slope**2, x))


def tension_of(rod: ClampedRod) -> float:
    """The tension [N] at which what a beam takes beyond the chord, less what it stretches, is the rod there is."""
    stiffness, length = rod.section.stretching_stiffness, rod.free_length
    spare = length - math.hypot(*rod.free_chord)

    def excess(tension: float) -> float:
        return beam(rod, tension, np.zeros(1))[1] - tension * length / stiffness - spare

    euler = 4.0 * math.pi**2 * rod.stiffness / length**2
    low, high = -0.97 * euler, 40.0 * euler
    for _ in range(60):
        middle = 0.5 * (low + high) or 1e-6 * euler
        low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
    return 0.5 * (low + high)


@pytest.mark.parametrize("rise", [0.0, 30.0])
@pytest.mark.parametrize("turns", [(0.0, 0.0), (0.9, -0.9), (-0.7, 0.4), (0.5, 0.5)])
@pytest.mark.parametrize("spare", [mm(-0.03), 0.0, mm(0.02), mm(0.06)])
def test_its_curve_and_force_are_those_of_a_beam_that_stretches(
    spare: float, turns: tuple[float, float], rise: float
) -> None:
    rod = rod_of(SINGLE, spare, turns, rise)
    (state,) = states_of(rod)
    assert (state.name, state.outcome, state.model) == ("straight", Outcome.CONVERGED, EXTENSIBLE)
    tension, (x, y) = tension_of(rod), rod.free_chord
    # Slopes of two degrees are no more than 0.1 % off a beam's.
    assert state.clamp_force[1] @ (x, y) / math.hypot(x, y) == pytest.approx(tension, rel=0.01, abs=0.03)
    places = np.linspace(0.1, 0.9, 9)
    expected, _ = beam(rod, tension, places * math.hypot(x, y))
    points = state.curve(4001) - np.array(rod.free_start)
    height = (x * points[:, 1] - y * points[:, 0]) / math.hypot(x, y)
    along = (x * points[:, 0] + y * points[:, 1]) / math.hypot(x, y)
    found = np.interp(places * math.hypot(x, y), along, height)
    np.testing.assert_allclose(found, expected, atol=mm(0.02))


def test_a_rod_that_is_too_short_to_buckle_has_one_state_whatever_it_starts_from() -> None:
    chance = np.random.default_rng(3)
    alone = [rod for rod in random_rods(40, 8) if is_too_short_to_buckle(rod)]
    assert len(alone) > 5
    for rod in alone:
        (state,) = states_of(rod)
        assert state.name == "straight"
        scaled = rod.extensible().scaled()
        problem = make_problem(scaled, mesh(scaled.at, EDGES))
        known, _ = state.start_on(problem.edges)
        places = np.cumsum(problem.edges) - 0.5 * problem.edges
        for _ in range(4):
            waves = chance.normal(0.0, 0.15, 3) @ np.sin(math.pi * np.outer([1, 2, 3], places))
            phi, multipliers = known + waves, np.zeros(2)
            if descend(problem, phi, multipliers, RELAX) > 0:
                assert np.max(np.abs(phi - known)) < 0.02


def test_every_straight_rod_has_one_state_or_two() -> None:
    kinds = {tuple(state.name for state in states_of(rod)) for rod in random_rods(100, 5)}
    assert kinds == {("straight",), ("peak", "valley")}


def test_it_buckles_where_euler_says() -> None:
    rod = rod_of(LIGHT, 0.0)
    euler = 4.0 * math.pi**2 * rod.stretching_compliance / rod.free_length
    (before,) = states_of(rod_of(LIGHT, 0.9 * euler))
    assert before.name == "straight"
    # The eigenvalue of a clamped rod under a thrust falls with that from 4 pi^2 to 0.
    assert before.lowest_eigenvalue == pytest.approx(4.0 * math.pi**2 * 0.1, rel=0.05)
    assert [state.name for state in states_of(rod_of(LIGHT, 1.1 * euler))] == ["peak", "valley"]
    assert not is_too_short_to_buckle(rod_of(LIGHT, euler))
    assert is_too_short_to_buckle(rod_of(LIGHT, 0.8 * euler))
    assert not is_too_short_to_buckle(changed(rod_of(LIGHT, 0.0), loads=[(0.5, -5.0, 0.0)]))
    assert is_too_short_to_buckle(changed(rod_of(LIGHT, 0.0), loads=[(0.5, -4.0, -5.0)]))
    soft = replace(LIGHT, clamp_stiffness=1.0)
    assert not is_too_short_to_buckle(rod_of(soft, 0.8 * euler))


def test_what_is_straight_is_told_by_its_numbers() -> None:
    for rod, is_one in (
        (rod_of(SINGLE, -0.99 * TAUT), True),
        (rod_of(SINGLE, -1.01 * TAUT), False),
        (rod_of(SINGLE, 0.99 * 0.48 * STRAIGHT), True),
        (rod_of(SINGLE, 1.01 * 0.48 * STRAIGHT), False),
        (rod_of(SINGLE, 0.0, (4.7, 0.0)), True),
        (rod_of(SINGLE, 0.0, (5.2, 0.0)), False),
        (replace(rod_of(SINGLE, 0.0), yaw=(0.1, 0.0)), False),
    ):
        assert is_straight(rod) is is_one
        if not any(rod.yaw):
            assert are_straight(np.array([rod.pose]), rod.bearing).tolist() == [is_one]
    for rod in random_rods(40, 2):
        assert not is_slack(rod)
        assert are_straight(np.array([rod.pose, rod.pose._replace(length=0.6)]), rod.bearing).tolist() == [True, False]


def test_the_spatial_model_has_the_same_curve_and_the_planar_one_none() -> None:
    rod = rod_of(SINGLE, mm(-0.02), (0.5, -0.2))
    (state,), (spatial,) = states_of(rod), states_of(rod, SPATIAL)
    assert spatial.name == "straight"
    assert np.max(np.abs(spatial.curve(101) - state.curve(101))) < 2.0 * TOLERANCE
    assert states_of(rod, PLANAR) == ()
    rolled = replace(rod, roll=(0.0, 0.7))
    (turned,) = states_of(rolled)
    assert (turned.name, turned.model) == ("straight", SPATIAL)


def test_weight_and_loads_bend_it() -> None:
    rod = rod_of(LIGHT, 0.0)
    (flat,) = states_of(rod)
    assert abs(flat.mean_height) < 1e-12
    (sagging,) = states_of(rod_of(SINGLE, 0.0))
    assert mm(-1.0) < sagging.mean_height < mm(-0.8)
    (pushed,) = states_of(changed(rod, loads=[(0.5, 0.0, -1.0)]))
    assert pushed.name == "straight"
    assert pushed.mean_height < mm(-1.5)


def test_it_is_found_on_either_side_of_where_it_buckles() -> None:
    chance = np.random.default_rng(4)
    for display in (LIGHT, SINGLE):
        flat = rod_of(display, 0.0)
        euler = 4.0 * math.pi**2 * flat.stretching_compliance / flat.free_length
        for _ in range(60):
            turns = tuple((chance.choice([0.0, 1e-3, 0.1, 1.0]) * chance.uniform(-1.0, 1.0, 2)).tolist())
            states = states_of(rod_of(display, euler * chance.uniform(0.85, 1.3), turns))
            assert [state.name for state in states] in (["straight"], ["peak", "valley"])
            assert all(state.outcome is Outcome.CONVERGED for state in states)


@pytest.mark.parametrize(
    ("rod", "wanted", "words"),
    [
        (rod_of(SINGLE, 0.0), "peak", 'write state = "straight", or give it more than 500.24 mm of rod to bend'),
        (rod_of(SINGLE, mm(8.0)), "straight", "the 8 mm of rod that it has to spare bend it: give it the 500 mm"),
        (rod_of(SINGLE, mm(0.2)), "straight", "the 0.2 mm of rod that it has to spare let it lie on either side"),
        (rod_of(SINGLE, mm(-1.0)), "straight", "it is 1 mm too short: give it the 500 mm that lead straight"),
        (rod_of(SINGLE, 0.0, (6.0, 2.0)), "straight", "its nodes point 6"),
        (rod_of(SINGLE, mm(8.0)), "peak", ""),
    ],
)
def test_why_a_wanted_state_is_not_there(rod: ClampedRod, wanted: str, words: str) -> None:
    said = why_not(rod, wanted)
    assert words in said
    assert bool(said) == bool(words)
