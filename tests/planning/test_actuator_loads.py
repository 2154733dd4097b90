"""What a node does to the rods on both its sides is the slope of their energy, by what its motors move."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from curveline.planning.actuator_loads import ClampLoads, actuator_load_of, clamp_loads_of, node_needs, overload
from curveline.planning.layout import Box, Layout, layout_of, pose_of
from curveline.planning.verification import Verifier
from curveline.rod.branches.continuation import Branch, Weakest
from curveline.rod.branches.tracking import tracked
from curveline.rod.problem import mesh
from curveline.rod.states.equilibrium import refine
from curveline.scene import Scene
from rows import row

STEP = 1e-4
"""Of a difference [m] or [rad]."""


def nobody() -> None:
    pass


def demands_of(scene: Scene) -> tuple[ClampLoads, ...]:
    """What the wanted states of a shape ask while it stands."""
    verifier, layout = Verifier(scene.display, nobody), layout_of(scene)
    segment_loads = []
    for index, segment in enumerate(scene.segments):
        pose = pose_of(scene.display, layout, index)
        state = next(state for state in verifier.states(pose) if state.name == segment.state)
        segment_loads.append(verifier.keep(pose, pose, Box(pose, pose), tracked(state)).clamp_loads)
    return tuple(segment_loads)


def energy_of(scene: Scene, layout: Layout) -> float:
    """Energy [J] of all segments in their wanted states; heights of the rod between bearings count from 0."""
    total, weight = 0.0, scene.display.rod.weight_per_length
    verifier = Verifier(scene.display, nobody)
    for index, segment in enumerate(scene.segments):
        states = verifier.states(pose_of(scene.display, layout, index))
        found = next(state for state in states if state.name == segment.state)
        edges = mesh(found.rod.scaled().at, 400)
        state = refine(found.rod, edges, *found.start_on(edges), 1e-7)
        total += state.energy + weight * found.rod.free_length * (layout.nodes[index].height + found.rod.free_start[1])
    return total


def carried(scene: Scene, node: int) -> float:
    """Energy that rod brings with it per length [N], fed from the end of one segment, or a tail, to the next."""
    here, held = scene.nodes[node], 0.5 * scene.display.clamp
    rise = held * math.sin(here.angle)
    comes, goes = (node > 0) * (here.height - rise), (node < len(scene.segments)) * (here.height + rise)
    return scene.display.rod.weight_per_length * (goes - comes)


def fed(layout: Layout, node: int, by: float) -> Layout:
    return replace(layout, feeds=tuple(f + by * (i == node) for i, f in enumerate(layout.feeds)))


def lifted(layout: Layout, node: int, by: float) -> Layout:
    nodes = (replace(n, height=n.height + by * (i == node)) for i, n in enumerate(layout.nodes))
    return replace(layout, nodes=tuple(nodes))


def turned(layout: Layout, node: int, by: float) -> Layout:
    nodes = (replace(n, angle=n.angle + by * (i == node)) for i, n in enumerate(layout.nodes))
    return replace(layout, nodes=tuple(nodes))


def bent(scene: Scene, curvature: float) -> Scene:
    """The same with a rod that is curved when it is free [1/m]."""
    rod = replace(scene.display.rod, natural_curvature=curvature)
    return replace(scene, display=replace(scene.display, rod=rod))


@pytest.mark.parametrize("natural", [0.0, 4.0])
@pytest.mark.parametrize("node", [0, 1, 2])
@pytest.mark.parametrize(("axis", "moved"), list(enumerate((fed, lifted, turned))), ids=["feed", "height", "angle"])
def test_a_node_gives_the_slope_of_the_energy_of_both_its_segments(
    node: int, axis: int, moved: Callable[[Layout, int, float], Layout], natural: float
) -> None:
    scene, layout = bent(row(2), natural), layout_of(row(2))
    up, down = (energy_of(scene, moved(layout, node, side * STEP)) for side in (1.0, -1.0))
    slope = (up - down) / (2.0 * STEP) - (axis == 0) * carried(scene, node)
    segment_loads = demands_of(scene)
    sides = [segment_loads[i].low[3 * j + axis] for i, j in ((node - 1, 1), (node, 0)) if 0 <= i < 2]
    assert sum(sides) == pytest.approx(slope, rel=3e-3, abs=3e-4)
    assert node_needs(segment_loads)[node, axis] == pytest.approx(abs(slope), rel=3e-3, abs=3e-4)
    assert len(sides) == 1 or min(map(abs, sides)) > 0.01


DISPLAY = row(3).display
FINE = ClampLoads(np.full(6, -0.01), np.full(6, 0.01), 1.0)


def asking(axis: int, low: float, high: float, curvature: float = 1.0) -> ClampLoads:
    """As FINE, but for one of the six."""
    lows, highs = FINE.low.copy(), FINE.high.copy()
    lows[axis], highs[axis] = low, high
    return ClampLoads(lows, highs, curvature)


OVERLOADS = {
    "the height of the first node": ((asking(1, -9.5, 0.0), FINE, FINE), r"at node 1 holding the height takes 9.5 N, "),
    "feeding at the last one": ((FINE, FINE, asking(3, 0.0, 8.3)), r"at node 4 extruding takes 8.3 N, the .* 8.0 N"),
    "both sides of a node": (
        (FINE, asking(5, 0.0, 0.3), asking(2, 0.0, 0.31)),
        r"at node 3 biasing takes 610 N mm, the motor gives 500 N mm",
    ),
    "a bend": (
        (FINE, asking(0, -9.0, 0.0, 40.0), FINE),
        r"in segment 2 the rod would bend to a radius of 25 mm, .* 40 mm",
    ),
}


@pytest.mark.parametrize("what", OVERLOADS)
def test_an_overload_names_the_node_and_the_numbers(what: str) -> None:
    segment_loads, reason = OVERLOADS[what]
    assert re.search(reason, overload(DISPLAY, segment_loads))
    assert actuator_load_of(segment_loads).share(DISPLAY) > 1.0


def test_opposite_needs_of_two_segments_are_borne_together_and_bounds_are_not_mixed() -> None:
    # Pulls on either side cancel at the node between, as far as they are sure.
    sure = asking(3, 7.0, 7.0), asking(0, -7.0, -7.0), FINE
    assert overload(DISPLAY, sure) == ""
    assert node_needs(sure)[1, 0] == pytest.approx(0.0)
    unsure = asking(3, 7.0, 7.0), asking(0, -7.0, 1.5), FINE
    assert "at node 2 extruding takes 8.5 N" in overload(DISPLAY, unsure)
    # Of a straight rod nothing is known, and nothing is asked.
    assert overload(DISPLAY, (ClampLoads(), FINE, ClampLoads())) == ""


def branch_of(sharpest: np.ndarray, wrenches: np.ndarray) -> Branch:
    """A branch of which only this matters."""
    weakest = Weakest(0.0, 1.0, np.zeros(2), np.zeros(2))
    fractions = np.linspace(0.0, 1.0, len(sharpest))
    return Branch(
        fractions, np.ones_like(sharpest), sharpest, wrenches, 1.0, np.zeros(2), np.zeros(2), weakest, weakest, False
    )


def test_a_followed_branch_is_bounded_by_its_poses() -> None:
    source = np.random.default_rng(1)
    sharpest, wrenches = source.normal(size=20), source.normal(size=(20, 6))
    clamp_loads = clamp_loads_of(branch_of(sharpest, wrenches))
    assert np.all(wrenches >= clamp_loads.low)
    assert np.all(wrenches <= clamp_loads.high)
    assert clamp_loads.curvature == sharpest.max()
    both = clamp_loads.joined(FINE)
    np.testing.assert_array_equal(both.low, np.minimum(clamp_loads.low, -0.01))
    assert clamp_loads_of(branch_of(np.zeros(0), np.zeros((0, 6)))).joined(FINE).curvature == 1.0
