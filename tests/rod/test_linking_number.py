"""Turns in a rod: twist and writhe add up to what the clamps put in, or the rod has passed through itself."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.spatial.lifting import lift, relax_in_space
from curveline.rod.spatial.linking_number import turns, twist, writhe
from curveline.rod.spatial.relax import RelaxEnding
from curveline.rod.spatial.richardson import refine_in_space
from curveline.rod.states.equilibrium import Outcome
from curveline.rod.states.planar_states import find_states
from curveline.scene import Node, Scene, Segment
from curveline.shapes.files import read_display
from curveline.simulation.simulate import scene_rod
from curveline.units import deg


def segment(roll: float, tilt: float = 0.0, yaw: float = 0.0) -> ClampedRod:
    """A rod of 600 mm on the built-in display, rolled by `roll` turns, with clamps that look up and out, in degrees."""
    nodes = (Node(0.0, deg(tilt), deg(yaw)), Node(0.0, deg(-tilt), deg(-yaw), 2.0 * math.pi * roll))
    return scene_rod(Scene("turned", read_display("single"), nodes, (Segment(0.62, "peak"),)), 0)


@pytest.mark.parametrize("roll", [-0.5, 1.0, 3.0])
def test_what_twist_loses_writhe_gains(roll: float) -> None:
    turned = segment(roll)
    for state in find_states(turned, 1e-4):
        flat = lift(turned.part(0.0), state)
        assert turns(*flat) == pytest.approx(0.0, abs=1e-6)
        rod, relaxed = relax_in_space(turned, state)
        assert relaxed.ending is RelaxEnding.SETTLED
        assert abs(twist(rod, relaxed.shape) - roll) > 0.001
        assert turns(rod, relaxed.shape) == pytest.approx(roll, abs=1e-6)


def test_clamps_out_of_the_plane_add_less_than_half_a_turn() -> None:
    for yaw in (-60.0, 30.0, 60.0):
        turned = segment(0.5, tilt=25.0, yaw=yaw)
        for state in find_states(turned, 1e-4):
            rod, relaxed = relax_in_space(turned, state)
            assert abs(turns(rod, relaxed.shape) - 0.5) < 0.5


def test_a_rod_that_lost_turns_by_passing_through_itself_is_no_answer() -> None:
    turned = segment(5.0)
    for state in find_states(turned, 1e-4):
        found = refine_in_space(turned, state, 1e-4)
        assert found.outcome is Outcome.UNWOUND
        assert not found.stable
    few = segment(2.0)
    assert all(refine_in_space(few, state, 1e-4).stable for state in find_states(few, 1e-4))


def test_both_clamps_rolled_alike_put_no_turns_in() -> None:
    turned = replace(segment(0.0), roll=(8.0 * math.pi, 8.0 * math.pi))
    for state in find_states(turned, 1e-4):
        rod, relaxed = relax_in_space(turned, state)
        assert turns(rod, relaxed.shape) == pytest.approx(0.0, abs=1e-6)


def test_writhe_of_known_curves() -> None:
    angle = np.linspace(0.0, 2.0 * math.pi, 160, endpoint=False)
    ellipse = np.column_stack([2.0 * np.cos(angle), np.sin(angle), 0.3 * np.cos(angle)])
    assert writhe(ellipse) == pytest.approx(0.0, abs=1e-6)
    # Nearly flat, a figure of eight has the writhe of its one crossing, and its mirror image the opposite.
    eight = np.column_stack([np.sin(angle), np.sin(2.0 * angle), 1e-3 * np.cos(angle)])
    assert abs(writhe(eight)) == pytest.approx(1.0, abs=0.01)
    assert writhe(eight * [1.0, 1.0, -1.0]) == pytest.approx(-writhe(eight), abs=1e-6)
    trefoil = np.column_stack(
        [np.sin(angle) + 2 * np.sin(2 * angle), np.cos(angle) - 2 * np.cos(2 * angle), -1e-3 * np.sin(3 * angle)]
    )
    assert abs(writhe(trefoil)) == pytest.approx(3.0, abs=0.01)
