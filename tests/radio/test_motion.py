"""Trapezoids: exact ends, limits of speed and acceleration, holds, and integers that fit the firmware."""

from __future__ import annotations

import math
from dataclasses import replace
from math import sqrt

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from curveline.drive_settings import MAX_EDGES_PER_S, AxisDrive
from curveline.errors import InvalidInput
from curveline.radio.protocol.codes import POSITION_LIMIT
from curveline.radio.protocol.motion import (
    LEAST_RATE,
    MOST_RATE,
    AxisLimits,
    NodeMove,
    axes_of,
    config_hash,
    outside,
    plan_move,
    rest_ms,
)
from curveline.radio.protocol.node_settings import SETTINGS_BYTES, node_settings

from .bench import drive_table

AXES = axes_of(drive_table())

counts = st.integers(-POSITION_LIMIT, POSITION_LIMIT)
places = st.tuples(counts, counts, counts)
limits = st.builds(
    AxisLimits,
    low=st.just(-POSITION_LIMIT),
    high=st.just(POSITION_LIMIT),
    speed=st.integers(50, 20_000),
    acceleration=st.integers(200, 100_000),
)
axes_sets = st.tuples(limits, limits, limits)
least = st.integers(0, 65535)


def assert_within_limits(move: NodeMove, axes: tuple[AxisLimits, AxisLimits, AxisLimits], span_ms: int) -> None:
    """Finite differences over `span_ms` at places spread over the move, with the half count that rounding costs."""
    last = max(move.end_ms, 1)
    for part in range(65):
        at_ms = last * part // 64
        a, b, c = (move.at(at_ms + shift * span_ms) for shift in (-1, 0, 1))
        for axis, before, here, after in zip(axes, a, b, c, strict=True):
            assert 1000 * abs(after - here) <= axis.speed * span_ms + 1000
            assert abs(after - 2 * here + before) <= axis.acceleration * span_ms**2 / 1e6 + 2


@settings(max_examples=300)
@given(places, places, axes_sets, least, st.sampled_from((1, 7, 50, 400)))
def test_moves_keep_the_limits_and_end_exactly(start, target, axes, least_ms, span_ms) -> None:
    move = plan_move(start, target, axes, least_ms)
    assert move.at(0) == start
    assert move.at(move.duration_ms) == target == move.at(move.duration_ms + 12345)
    assert move.end_ms == move.duration_ms >= least_ms
    assert_within_limits(move, axes, span_ms)


@given(places, places, axes_sets)
def test_moves_waste_no_time(start, target, axes) -> None:
    move = plan_move(start, target, axes, 0)
    quickest = 0.0
    for a, b, axis in zip(start, target, axes, strict=True):
        way, v, acc = abs(b - a), axis.speed, axis.acceleration
        quickest = max(quickest, way / v + v / acc if way * acc > v * v else 2 * sqrt(way / acc))
    # the shared ramp of the slowest constraint may cost other axes a little; alone they would need `quickest`
    alone = [
        plan_move((a, 0, 0), (b, 0, 0), (axis, axis, axis), 0) for a, b, axis in zip(start, target, axes, strict=True)
    ]
    assert max(each.duration_ms for each in alone) <= 1000 * quickest + 4
    assert move.duration_ms >= 1000 * quickest - 1


@settings(max_examples=300)
@given(places, places, axes_sets, least, st.floats(0, 1), st.sampled_from((1, 7, 50, 400)))
def test_a_hold_slows_down_within_the_limits_and_the_rest_ends_exactly(
    start, target, axes, least_ms, part, span_ms
) -> None:
    move = plan_move(start, target, axes, least_ms)
    at_ms = round(part * move.duration_ms)
    held = move.braked(at_ms)
    for before in (0, at_ms // 2, at_ms):
        assert held.at(before) == move.at(before)
    assert at_ms <= held.end_ms <= move.duration_ms
    assert held.at(held.end_ms) == held.at(held.end_ms + 1000)
    assert_within_limits(held, axes, span_ms)
    assert held.braked(0) == held
    rest = plan_move(held.at(held.end_ms), target, axes, rest_ms(held))
    assert rest.at(rest.duration_ms) == target


def test_a_hold_during_the_last_ramp_changes_nothing() -> None:
    move = plan_move((0, 0, 0), (5000, 100, -300), AXES, 0)
    for at_ms in range(move.duration_ms - move.ramp_ms, move.duration_ms + 1):
        held = move.braked(at_ms)
        assert held.end_ms == move.duration_ms
        assert [held.at(t) for t in range(at_ms, move.duration_ms + 1)] == [
            move.at(t) for t in range(at_ms, move.duration_ms + 1)
        ]
        assert rest_ms(held) == 0


def test_axes_leave_and_arrive_together() -> None:
    move = plan_move((0, 0, 0), (40000, 4000, -400), AXES, 0)
    for at_ms in range(0, move.duration_ms + 1, 10):
        x, y, z = move.at(at_ms)
        assert abs(x - 10 * y) <= 6
        assert abs(y + 10 * z) <= 6


@given(places, places, axes_sets, least, st.integers(0, 10**6))
def test_motion_is_monotone(start, target, axes, least_ms, at_ms) -> None:
    move = plan_move(start, target, axes, least_ms)
    for a, b, begin, end in zip(move.at(at_ms), move.at(at_ms + 1), start, target, strict=True):
        assert (begin <= a <= b <= end) or (begin >= a >= b >= end)


def test_numbers_fit_64_bits_at_the_extremes() -> None:
    distance = 2 * POSITION_LIMIT
    for speed in (LEAST_RATE, MOST_RATE):
        for acceleration in (LEAST_RATE, MOST_RATE):
            axis = AxisLimits(-POSITION_LIMIT, POSITION_LIMIT, speed, acceleration)
            move = plan_move((-POSITION_LIMIT,) * 3, (POSITION_LIMIT,) * 3, (axis, axis, axis), 65535)
            assert 2 * distance * move.length + move.length < 2**63
            assert 1_000_000 * distance < 2**63
            assert move.duration_ms * move.length < 2**63


@pytest.mark.parametrize("change", [{"speed": 0.4}, {"acceleration": 0.4}, {"speed": 1e5}, {"acceleration": 1e5}])
def test_axes_beyond_the_arithmetic_are_refused(change: dict[str, float]) -> None:
    table = drive_table()
    axes = (replace(table.axes[0], **change), *table.axes[1:])
    with pytest.raises(InvalidInput, match="extrude"):
        axes_of(replace(table, axes=axes))


def test_set_points_are_these() -> None:
    """Values for the firmware to repeat."""
    move = plan_move((0, 0, 0), (2213, -695, 100), AXES, 0)
    assert (move.duration_ms, move.ramp_ms) == GOLDEN_TIMES
    assert [move.at(t) for t in (1, 50, 200, 316, 500, 632)] == GOLDEN_POINTS
    held = move.braked(200)
    assert [held.at(t) for t in (200, 250, 300, 400, 500)] == GOLDEN_HELD


GOLDEN_TIMES = (700, 200)
GOLDEN_POINTS = [(0, 0, 0), (28, -9, 1), (443, -139, 20), (956, -300, 43), (1770, -556, 80), (2162, -679, 98)]
GOLDEN_HELD = [(443, -139, 20), (636, -200, 29), (775, -243, 35), (885, -278, 40), (885, -278, 40)]


def test_limits_come_from_the_drive_table() -> None:
    extrude, bias, translate = AXES
    assert (extrude.low, extrude.high) == (-221326, 221326)
    assert (bias.low, bias.high, bias.speed, bias.acceleration) == (-5215, 5215, 3128, 13906)
    assert (translate.speed, translate.acceleration) == (2213, 11066)
    assert outside(AXES, (0, 0, 0)) == 0
    assert outside(AXES, (221326, -5215, 48692)) == 0
    assert [outside(AXES, each) for each in ((221327, 0, 0), (0, -5216, 0), (0, 0, 48693))] == [1, 2, 3]


@pytest.mark.parametrize("field", ["low", "high", "speed", "acceleration"])
def test_the_configuration_hash_notices_every_limit(field: str) -> None:
    changed = AxisLimits(**{**vars(AXES[1]), field: getattr(AXES[1], field) + 1})
    assert config_hash((AXES[0], changed, AXES[2])) != config_hash(AXES)
    assert config_hash((AXES[1], AXES[0], AXES[2])) != config_hash(AXES)


@pytest.mark.parametrize("index", range(3))
@pytest.mark.parametrize("key", ["counts_per_unit", "speed", "acceleration", "low", "high"])
@pytest.mark.parametrize("value", [1e308, -1e308, 1e-308, 1e15, -1e15, math.inf, -math.inf, math.nan, 0.0])
def test_absurd_drives_are_refused_or_fit_their_frames(index: int, key: str, value: float) -> None:
    drive = drive_table()
    axes = list(drive.axes)
    axes[index] = replace(axes[index], **{key: value})
    table = replace(drive, axes=(axes[0], axes[1], axes[2]))
    try:
        axis = axes_of(table)[index]
    except InvalidInput as error:
        refusal = error
    else:
        assert -POSITION_LIMIT <= axis.low <= POSITION_LIMIT
        assert -POSITION_LIMIT <= axis.high <= POSITION_LIMIT
        assert 0 <= config_hash(axes_of(table)) < 1 << 16
        assert len(node_settings(bytes(16), table, 1).record()) == SETTINGS_BYTES
        assert key in ("low", "high")
        return
    assert "correct the [" in refusal.hint


@pytest.mark.parametrize(("counts_per_unit", "speed"), [(100.0, 10.0), (1e12, 1e-6)])
def test_travel_where_no_node_can_tell_its_position_is_refused(counts_per_unit: float, speed: float) -> None:
    """What a display file may say: both ends beyond what fits a status, and the settings of a node."""
    drive = drive_table()
    for low, high in ((5e8, 1e9), (-1e9, -5e8)):
        far = AxisDrive(counts_per_unit, speed, speed, low, high)
        with pytest.raises(InvalidInput, match="translate axis would stay between") as caught:
            axes_of(replace(drive, axes=(*drive.axes[:2], far)))
        assert "[limits]" in caught.value.hint


def test_edges_of_all_axes_together_are_no_more_than_a_node_can_count() -> None:
    drive = drive_table()
    third = MAX_EDGES_PER_S // 3
    for rate, is_fine in ((third, True), (third + 1, False)):
        axes = tuple(replace(axis, speed=rate / axis.counts_per_unit * (1.0 + 1e-9)) for axis in drive.axes)
        asked = replace(drive, axes=(axes[0], axes[1], axes[2]))
        if is_fine:
            assert sum(axis.speed for axis in axes_of(asked)) == 3 * third
        else:
            with pytest.raises(InvalidInput, match=r"bring 115,110 edges/s, and a node can count 115,107"):
                axes_of(asked)
