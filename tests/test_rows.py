"""Rows of many segments, as the tests use them: complete, different from each other, and possible on a display."""

from __future__ import annotations

import math

import pytest

from curveline.drive_settings import drive_settings
from curveline.simulation.simulate import simulate
from curveline.units import mm
from rows import PATTERN, row

STIFFEST = 4.0 * math.pi**2


@pytest.mark.parametrize("count", [1, 4, 64])
def test_every_segment_of_a_row_shows_what_it_should(count: int) -> None:
    scene = row(count)
    segments = simulate(scene)
    assert len(segments) == len(scene.segments) == count
    for index, segment in enumerate(segments):
        assert segment.wanted is not None
        assert segment.wanted.name == PATTERN[index % len(PATTERN)]
        assert segment.wanted.lowest_eigenvalue > 0.3 * STIFFEST
        assert [state.name for state in segment.states] == ["peak", "valley"]
        assert segment.wanted.max_curvature < 0.5 * scene.display.rod.max_curvature


def test_no_two_segments_of_a_row_are_alike() -> None:
    scene = row(64)
    rods = {(segment.wanted.rod.chord, segment.length) for segment in simulate(scene) if segment.wanted}
    assert len(rods) == 64
    assert len({segment.length for segment in scene.segments}) == 64
    assert len(set(scene.nodes)) == 65
    assert row(64, seed=6).nodes != scene.nodes
    assert row(3, pattern=("valley",)).segments[1].state == "valley"


def test_a_row_fits_its_display_and_its_feeds_what_a_node_can_tell() -> None:
    scene = row(64)
    display = scene.display
    assert len(set(display.radio.addresses)) == display.node_count == len(scene.nodes)
    assert drive_settings(display).node_count == 65
    assert math.fsum(segment.length for segment in scene.segments) < display.rod.total_length
    assert all(display.limits.length.contains(segment.length) for segment in scene.segments)
    excess = math.fsum(segment.length - display.span for segment in scene.segments)
    assert 0.5 * excess < mm(1184.0)
