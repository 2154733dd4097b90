"""A row of nodes as a search sees it: distances, what is asked, and their slopes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from curveline.fitting.row import EDGES, asked, is_straight, lengths_of, limits_of, parts_of, row_at, within
from curveline.fitting.starts import first_numbers, straightened
from curveline.planning.actuator_loads import clamp_loads_of_state, node_needs
from curveline.rod.branches.continuation import STIFFEST
from curveline.rod.problem import mesh
from curveline.rod.states.slack import is_straight as is_straight_rod
from curveline.scene import Node, Scene, Segment
from curveline.simulation.simulate import clamped_rod, simulate
from tests.fitting.rows import apart, display, first_row, moved, wanted

STEP = 1e-6
"""Of a difference."""
FORMULAS = [
    ("60*sin(pi*x/500)", "single"),
    ("30*sin(pi*x/500) + 20*cos(pi*x/700)", "quad"),
    ("where(x<1000, 0.002*x, 2 + 40*sin(pi*(x-1000)/500))", "quad"),
    ("where(x<1000, 0.05*x, 50 + 40*sin(pi*(x-1000)/500))", "quad"),
]


def row_of(formula: str, name: str):
    asked_for = wanted(formula, name)
    numbers = straightened(asked_for, first_numbers(asked_for))
    return asked_for, first_row(asked_for, numbers)


def smooth_asks(asked_for, row) -> list[int]:
    """All but what straight segments ask by themselves: that is far from its limits, and a sum of large numbers."""
    straight = is_straight(asked_for, row.numbers)
    asks = enumerate(asked(asked_for))
    return [place for place, ask in asks if not ask.segment or not straight[ask.segment - 1]]


@pytest.mark.parametrize(("formula", "name"), FORMULAS)
def test_slopes_are_those_of_differences(formula, name):
    asked_for, row = row_of(formula, name)
    slopes = row.slopes()
    for place in range(row.numbers.size):
        if row.numbers[place] == 0.0 and place >= 2 * asked_for.nodes:
            continue  # the root of a straight segment is held
        after, before = (moved(asked_for, row, place, by) for by in (STEP, -STEP))
        told = (after.off - before.off) / (2.0 * STEP)
        # Where the nearest place of a polyline jumps from one piece to the next, a difference sees both.
        assert np.quantile(np.abs(slopes[:, place] - told), 0.95) < 0.02 * max(np.abs(told).max(), 0.01)
        asks, kept = (after.asks - before.asks) / (2.0 * STEP), smooth_asks(asked_for, row)
        close = np.isclose(row.by_numbers[:, place], asks, rtol=0.02, atol=0.02 * max(1.0, np.abs(asks).max()))
        assert np.all(close[kept])


@pytest.mark.parametrize(("formula", "name"), FORMULAS)
def test_gradient_and_curvature_are_those_of_all_slopes(formula, name):
    _, row = row_of(formula, name)
    assert np.allclose(row.gradient, row.slopes().T @ row.off, atol=1e-15)
    assert np.allclose(row.curvature, row.slopes().T @ row.slopes(), atol=1e-12)


def test_distances_are_those_of_a_brute_force():
    asked_for, row = row_of("60*sin(pi*x/500) + 20*sin(pi*x/125)", "single")
    heights, angles, roots = row.numbers[:2], row.numbers[2:4], row.numbers[4:]
    assert roots.size == 1
    nodes = tuple(Node(float(height), float(angle)) for height, angle in zip(heights, angles, strict=True))
    scene = Scene("one", display(), nodes, (Segment(float(lengths_of(asked_for, row.numbers)[0]), "peak"),))
    best = min(
        math.sqrt(
            0.5 * np.mean(apart(curve, asked_for.fine[0]) ** 2) + 0.5 * np.mean(apart(asked_for.fine[0], curve) ** 2)
        )
        for state in simulate(scene)[0].states
        for curve in [state.curve(601) + np.array([0.0, heights[0]])]
    )
    assert row.rms == pytest.approx(best, rel=0.02)


def test_what_is_asked_is_what_the_states_of_the_shape_ask():
    formula = "30*sin(pi*x/500) + 20*cos(pi*x/700)"
    asked_for, row = row_of(formula, "quad")
    lengths, found = lengths_of(asked_for, row.numbers), []
    for segment in range(4):
        nodes = [Node(float(row.numbers[each]), float(row.numbers[5 + each])) for each in (segment, segment + 1)]
        rod = clamped_rod(display("quad"), (nodes[0], nodes[1]), float(lengths[segment]))
        assert not is_straight_rod(rod)
        scene = Scene("one", display("quad"), tuple(nodes), (Segment(float(lengths[segment]), "peak"),))
        states = [state for state in simulate(scene, model="extensible")[0].states if state.stable]
        edges, angles = mesh(np.zeros(0), EDGES), row.held[segment][0]
        off = [float(np.abs(state.start_on(edges)[0] - angles).max()) for state in states]
        found.append(states[int(np.argmin(off))])
    told = dict(zip(asked(asked_for), row.asks.tolist(), strict=True))
    needs = node_needs(tuple(map(clamp_loads_of_state, found)))
    drive, rod = display("quad").drive, display("quad").rod
    for ask, missed in told.items():
        if ask.kind == "stability":
            assert missed == pytest.approx(0.12 - found[ask.segment - 1].lowest_eigenvalue / STIFFEST, abs=0.01)
        elif ask.kind == "strain":
            assert missed + 0.92 == pytest.approx(found[ask.segment - 1].max_curvature / rod.max_curvature, abs=0.01)
        elif ask.node:
            axis = ["force of extruding", "force of lifting", "moment of biasing"].index(ask.kind)
            gives = (drive.max_force, drive.max_force, drive.max_moment)[axis]
            assert missed + 0.92 == pytest.approx(needs[ask.node - 1, axis] / gives, abs=0.03)


def test_straight_segments_are_as_long_as_their_clamps_leave():
    asked_for = wanted("0.05*x")
    numbers = straightened(asked_for, first_numbers(asked_for))
    assert numbers is not None
    assert is_straight(asked_for, numbers).all()
    numbers[2:4] += np.radians([2.0, -1.5])
    length = float(lengths_of(asked_for, numbers)[0])
    nodes = Node(float(numbers[0]), float(numbers[2])), Node(float(numbers[1]), float(numbers[3]))
    rod = clamped_rod(display(), nodes, length)
    assert is_straight_rod(rod)
    assert rod.free_length == pytest.approx(math.hypot(*rod.free_chord), abs=1e-9)


def test_drawings_that_bend_are_not_tried_straight():
    asked_for = wanted("60*sin(pi*x/500)")
    assert straightened(asked_for, first_numbers(asked_for)) is None


def test_numbers_come_within_the_limits():
    asked_for = wanted("60*sin(pi*x/500)")
    far = within(asked_for, np.array([1.0, -1.0, 3.0, -3.0, 9.0]))
    limits = display().limits
    assert far[:4].tolist() == [limits.height.high, limits.height.low, limits.angle.high, limits.angle.low]
    assert float(lengths_of(asked_for, far)[0]) == pytest.approx(limits.length.high)
    low, high = limits_of(asked_for, far)
    assert np.all(low <= far + 1e-12)
    assert np.all(far <= high + 1e-12)


def test_a_row_without_states_is_none():
    asked_for, row = row_of("60*sin(pi*x/500)", "single")
    numbers = row.numbers.copy()
    numbers[2:4] += math.radians(170.0)
    assert row_at(asked_for, numbers, row.held) is None


def test_parts_make_a_mean():
    asked_for = wanted("60*sin(pi*x/500)", "quad")
    assert float(np.sum(parts_of(asked_for) ** 2)) == pytest.approx(1.0)
