"""One rod through all nodes: lengths, feeds and tails are one budget, and no uneven progress leaves the box."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from curveline.errors import Infeasible
from curveline.planning.layout import (
    Box,
    Layout,
    box_of,
    centred,
    home,
    layout_of,
    lengths_of,
    pose_of,
    tails_of,
)
from curveline.planning.tours import make_plan
from curveline.rod.problem import Pose
from curveline.scene import Node
from curveline.shapes.files import read_display
from rows import row

from .boxes import mixed

QUAD = read_display("quad")
ROUNDED = 1.1e-9
"""Poses are rounded to the nanometre."""

few = settings(max_examples=40, derandomize=True, deadline=None, database=None)


@st.composite
def layouts(draw: st.DrawFn) -> Layout:
    """Anything that five nodes can be told; some axes stand at home."""
    numbers = st.one_of(st.just(0.0), st.floats(-0.2, 0.2))
    nodes = tuple(Node(draw(numbers), 5.0 * draw(numbers)) for _ in range(5))
    return Layout(nodes, tuple(draw(numbers) for _ in range(5)))


@few
@given(layouts(), layouts(), st.integers(0, 2**32 - 1))
def test_no_uneven_progress_leaves_the_box(before: Layout, after: Layout, seed: int) -> None:
    chance = np.random.default_rng(seed)
    for segment in before.segments:
        box = box_of(QUAD, before, after, segment)
        assert box == box_of(QUAD, after, before, segment)
        for _ in range(8):
            shares = chance.random((5, 3))
            # Half of the axes have not begun, or are there.
            shares = np.where(chance.random((5, 3)) < 0.5, np.round(shares), shares)
            pose = pose_of(QUAD, mixed(before, after, shares), segment)
            assert np.all(np.subtract(pose, box.low) >= -ROUNDED)
            assert np.all(np.subtract(box.high, pose) >= -ROUNDED)


@few
@given(layouts(), layouts())
def test_every_corner_of_the_box_is_met_by_some_uneven_progress(before: Layout, after: Layout) -> None:
    for segment in (0, 3):
        met = []
        for ends in itertools.product((0.0, 1.0), repeat=6):
            shares = np.zeros((5, 3))
            shares[segment : segment + 2] = np.reshape(ends, (2, 3))
            met.append(pose_of(QUAD, mixed(before, after, shares), segment))
        poses = np.array(met)
        for corner in box_of(QUAD, before, after, segment).corners():
            assert np.min(np.max(np.abs(poses - corner), axis=1)) <= ROUNDED


def test_a_box_without_extent_is_one_pose() -> None:
    here = layout_of(row(4))
    box = box_of(row(4).display, here, here, 1)
    pose = pose_of(row(4).display, here, 1)
    assert list(box.corners()) == [pose]
    assert list(box.edges(pose, pose)) == []


LOW, HIGH = Pose(0.5, -0.1, -0.2, 0.3, 0.6), Pose(0.5, 0.1, 0.2, 0.3, 0.7)


@pytest.mark.parametrize("inside", [False, True])
def test_edges_lead_from_where_a_step_begins_to_every_corner_and_to_its_end(inside: bool) -> None:
    before, after = (Pose(0.5, 0.04, -0.2, 0.3, 0.63), HIGH) if inside else (LOW, HIGH)
    box = Box(LOW, HIGH)
    corners = list(box.corners())
    assert len(corners) == len(set(corners)) == 8
    reached = {before}
    edges = list(box.edges(before, after))
    for here, there in edges:
        assert here in reached
        reached.add(there)
    assert reached == {before, *corners}
    between = [(here, there) for here, there in edges if here != before or not inside]
    assert len({frozenset(pair) for pair in between}) == len(between) == 12
    assert all(sum(a != b for a, b in zip(here, there, strict=True)) == 1 for here, there in between)
    back = list(box.edges(after, before))
    assert (back[-1][1] == before) or not inside
    assert len(back) == len(edges)


@few
@given(st.lists(st.floats(0.5, 0.9), min_size=4, max_size=4))
def test_a_centred_rod_has_equal_tails_and_the_lengths_asked_for(lengths: list[float]) -> None:
    layout = centred(QUAD, home(QUAD).nodes, lengths)
    left, right = tails_of(QUAD, layout)
    assert left == pytest.approx(right, abs=1e-12)
    assert left + right == pytest.approx(QUAD.rod.total_length - math.fsum(lengths))
    assert lengths_of(QUAD, layout) == pytest.approx(lengths)
    assert tails_of(QUAD, home(QUAD)) == pytest.approx([0.5 * (QUAD.rod.total_length - 4 * QUAD.span)] * 2)


def test_what_a_node_feeds_leaves_one_side_and_arrives_on_the_other() -> None:
    whole = home(QUAD)
    for node in range(5):
        fed = Layout(whole.nodes, tuple(0.03 if each == node else 0.0 for each in range(5)))
        rods = (tails_of(QUAD, whole)[0], *lengths_of(QUAD, whole), tails_of(QUAD, whole)[1])
        moved = (tails_of(QUAD, fed)[0], *lengths_of(QUAD, fed), tails_of(QUAD, fed)[1])
        expected = [0.0] * 6
        expected[node], expected[node + 1] = -0.03, 0.03
        assert np.subtract(moved, rods) == pytest.approx(expected, abs=1e-12)


def test_a_rod_too_short_for_its_tails_is_refused() -> None:
    scene = row(3)
    need = math.fsum(segment.length for segment in scene.segments)
    short = replace(scene.display, rod=replace(scene.display.rod, total_length=need - 0.02))
    with pytest.raises(Infeasible, match=r"the rod is too short: its left tail would be \d+ mm inside") as caught:
        make_plan(replace(scene, display=short))
    assert caught.value.hint
