"""The search in space: its starts meet their clamps, what it finds is at rest, and costless motions are one state."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from clamped_rods import Stock, made_of, rod_between
from curveline.rod.clamped_rod import ClampedRod, DeadLoad
from curveline.rod.models.choice import SearchRequest, model_states
from curveline.rod.planar.approach import fitting_mesh
from curveline.rod.problem import Bearing, Pose
from curveline.rod.section import Section
from curveline.rod.spatial.energy import Shape, SpatialRod, positions
from curveline.rod.spatial.lifting import spatial_rod
from curveline.rod.spatial.linking_number import turns
from curveline.rod.spatial.relax import descend, is_stable, lowest_mode, newton
from curveline.rod.spatial.search import search_in_space
from curveline.rod.spatial.starts import ALL_SIDES, Curve, started_frames, starts
from curveline.scene import Rod
from curveline.sections import Rectangle

from .rods import STIFFNESS
from .spatial_rods import matrix

SECTION = Stock(58_800.0, 2.4e-3, 2.97e-3, 0.0, lateral_stiffness=0.49, twisting_stiffness=0.0354887)
TWISTED = made_of(SECTION, rod_between((0.5, 0.0), 0.0, 0.0, 0.6, 0.0, STIFFNESS, 0.0), roll=(0.0, math.radians(290.0)))


def rod_of(segment: ClampedRod, n: int = 48) -> SpatialRod:
    return spatial_rod(segment, fitting_mesh(segment.scaled(), n))


def started(segment: ClampedRod, rod: SpatialRod, curve: Curve) -> Shape:
    return Shape(np.zeros(rod.edges.size), started_frames(rod, segment.roll[1] - segment.roll[0], curve))


@pytest.mark.parametrize("roll", [0.0, 0.7, 9.0])
def test_starts_begin_and_end_in_their_clamps_with_the_turns_asked_for(roll: float) -> None:
    segment = replace(TWISTED, yaw=(0.3, -0.2), roll=(0.2, 0.2 + roll))
    rod = rod_of(segment, 400)
    for curve in starts(rod, ALL_SIDES):
        shape = started(segment, rod, curve)
        for clamp, edge in ((0, 0), (1, -1)):
            assert np.max(np.abs(matrix(shape.frames[edge]) - matrix(rod.frames[clamp]))) < 0.06
        between = np.abs(np.sum(shape.frames[1:] * shape.frames[:-1], axis=1))
        assert np.max(2.0 * np.arccos(np.minimum(between, 1.0))) < 0.1
        plain = started(segment, rod, Curve(curve.direction, 0.0, 0.0))
        assert turns(rod, shape) - turns(rod, plain) == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize("direction", np.arange(0.1, 6.2, 0.8))
def test_arches_lean_to_where_they_are_sent(direction: float) -> None:
    segment = replace(TWISTED, roll=(0.0, 0.0))
    rod = rod_of(segment)
    middle = np.asarray(positions(rod, started(segment, rod, Curve(direction, 0.8, 0.0))))[24]
    leaning = math.atan2(middle[2], middle[1]) - direction
    assert abs(math.remainder(leaning, 2.0 * math.pi)) < 0.05


def test_all_of_a_twisted_strip_are_at_rest_and_none_is_a_seed() -> None:
    found = search_in_space(TWISTED, [])
    assert len(found) == 6
    for rod, shape in found:
        assert descend(rod, shape).iterations == 1
        assert is_stable(rod, shape)
        assert turns(rod, shape) == pytest.approx(290.0 / 360.0, abs=1e-6)
    others = search_in_space(TWISTED, found[:2])
    assert len(others) == 4


def test_of_a_motion_that_costs_nothing_one_state_is_listed() -> None:
    round_ = replace(SECTION, lateral_stiffness=STIFFNESS, twisting_stiffness=0.7 * STIFFNESS)
    for roll in (0.0, 1.0):
        segment = made_of(round_, TWISTED, roll=(0.0, roll))
        found = search_in_space(segment, [])
        neutral = [shape for rod, shape in found if lowest_mode(rod, shape)[0] < 1e-6]
        assert len(neutral) == 1
        assert len(found) < 4


def strip(pose: tuple[float, ...], size: tuple[float, float], clamp: float, load: tuple[float, ...]) -> ClampedRod:
    """A strip of `size`, width and thickness [m], that is 2.45 GPa stiff, under one load."""
    material = Rod(2.45e9, Rectangle(*size), 0.048, 0.03, 0.0, 2.0, 2.45e9 / 2.7)
    bearing = Bearing(
        clamp,
        material.bending_stiffness,
        0.0,
        lateral=material.lateral_bending_stiffness,
        twisting=material.twisting_stiffness,
    )
    section = Section(material.stretching_stiffness, material.thickness, material.polar_gyration, 0.0)
    return ClampedRod(Pose(*pose), bearing, (DeadLoad(*load),), section=section)


def weighed(segment: ClampedRod, down: tuple[float, float, float], **changes: tuple[float, float]) -> ClampedRod:
    """The same rod with a weight [N/m] that points anywhere, and clamps that are turned."""
    bearing = segment.bearing._replace(weight=-down[1])
    return replace(segment, bearing=bearing, weight_x=down[0], weight_z=down[2], **changes)


BEFORE_FOLDS = {
    "0.2 % of the way": (
        weighed(
            strip(
                (0.5, 0.12677130596130698, -0.10976476176391231, -0.34819473127995715, 0.6052942804667156),
                (0.01, 0.0015282570427017745),
                0.0,
                (0.6996119815316518, -0.03136046975416206, 0.06483139371587945, 0.0711407292986259),
            ),
            (-0.018439063762345845, -0.5522397549444167, 0.04736725959492818),
            yaw=(-0.07534834829174189, 0.08761811992739826),
            roll=(-0.1864867786996191, 2.673218856655542),
        ),
        (230.51, 234.29, 239.65),
    ),
    "0.3 % of the way": (
        weighed(
            strip(
                (0.5, -0.04836621922002987, -0.6928681757469705, -0.4919485614856333, 0.6499743927271875),
                (0.004947820512684904, 0.001331042828546554),
                0.02,
                (0.6288111784034791, 0.09404079052293203, -0.008703234414373137, -0.025060211496506432),
            ),
            (-0.024716545477785123, -0.4907230749700048, 0.009854411478451978),
            yaw=(-0.11270697153306361, -0.5022609753536608),
            roll=(-1.0666825468679324, 4.310194918309678),
        ),
        (55.20, 91.41),
    ),
}
"""Scenes in which a state is so near to its fold that few edges have lost it, with the energies of all [mJ]."""


@pytest.mark.parametrize("scene", BEFORE_FOLDS)
def test_what_a_descent_passes_is_asked_of_finer_edges(scene: str) -> None:
    segment, energies = BEFORE_FOLDS[scene]
    states = model_states(segment, SearchRequest(1e-4, (0,), "auto")).states
    assert all(state.stable for state in states)
    assert sorted(1e3 * state.energy for state in states) == pytest.approx(energies, abs=0.01)


def test_all_that_is_found_is_at_rest() -> None:
    """What the roll led to was followed with some force left over: levels of finer edges begin from less."""
    for rod, shape in search_in_space(TWISTED, []):
        assert newton(rod, shape, 1).residual < 1e-9
