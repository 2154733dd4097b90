"""One rod between two clamps: what of it the plane takes, and how one rod is made from another."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from clamped_rods import Stock, changed, made_of, rod_between
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.problem import Pose
from curveline.rod.states.equilibrium import EXTENSIBLE, PLANAR, refine
from curveline.rod.states.planar_states import find_states

from .rods import STIFFNESS, WEIGHT

STRIP = Stock(58_800.0, 2.4e-3, 2.97e-3, WEIGHT, lateral_stiffness=0.49, twisting_stiffness=0.0355)
LINE = rod_between((0.5, 0.03), 0.4, -0.6, 0.64, 0.02, STIFFNESS, WEIGHT, loads=((0.3, 0.1, -0.2),))
ROD = made_of(STRIP, LINE)


def numbers(rod: ClampedRod) -> list[list[float]]:
    """What kernels in the plane take from a rod."""
    return [np.ravel(part).tolist() for part in rod.scaled()]


def test_what_points_out_of_the_plane_is_nothing_in_it() -> None:
    turned = changed(ROD, yaw=(0.3, -0.2), roll=(0.1, 2.0), weight_x=0.2, weight_z=0.1, lateral_curvature=1.0)
    pushed = replace(turned, loads=tuple(load._replace(z=0.3) for load in turned.loads))
    assert not pushed.is_flat
    assert numbers(pushed) == numbers(ROD) == numbers(LINE)
    flat = pushed.part(0.0)
    assert flat.is_flat
    assert (flat.weight_x, flat.weight_z) == (0.2, 0.0)
    assert flat.weighing(WEIGHT) == ROD


def test_a_rod_that_was_moved_is_scaled_anew() -> None:
    before = numbers(ROD)
    moved = ROD.moved_to(Pose(0.5, -0.1, 0.2, 0.1, 0.7))
    assert numbers(moved) != before
    assert numbers(moved.moved_to(ROD.pose)) == before
    assert moved.bearing == ROD.bearing


def test_a_further_turn_is_made_by_the_last_clamp() -> None:
    wound = replace(ROD, winding=1)
    assert wound.end == ROD.end
    assert wound.turn == ROD.turn + 2.0 * math.pi
    assert wound.scaled().ends.tolist() == [ROD.start, ROD.end + 2.0 * math.pi]


def test_a_rod_stretches_in_the_plane_as_its_section_lets_it() -> None:
    stretched = ROD.extensible()
    assert stretched.bearing.compliance == STIFFNESS / STRIP.stretching_stiffness
    assert stretched.inextensible() == ROD
    assert not LINE.extensible().is_extensible, "a line has no section that could give way"
    edges = np.full(48, 1.0 / 48)
    state = find_states(changed(ROD, loads=()), 1e-5)[0]
    for rod, model in ((ROD, PLANAR), (stretched, EXTENSIBLE)):
        assert refine(changed(rod, loads=()), edges, *state.start_on(edges), 1e-5).model == model


def test_a_bearing_that_holds_a_rod_in_its_plane_keeps_the_rest() -> None:
    held = ROD.bearing.held_in_plane()
    assert (held.lateral, held.twisting) == (0.0, 0.0)
    assert held == LINE.bearing
