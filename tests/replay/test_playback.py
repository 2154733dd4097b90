"""Played through the rod's physics, plans end in the wanted curve whatever the rod showed before; short cuts do not."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import pytest

from curveline.plan_file import Plan
from curveline.replay.playback import replay
from curveline.scene import LOST, STRAIGHT, Profile
from curveline.shapes.files import read_display
from curveline.units import deg, mm
from playing import SHAPES, Counts, Frame, counts_of, motion, next_plan, plan, scene

NAMES = list(SHAPES)
CHAIN = list(itertools.pairwise(NAMES))
STAGGERED = [name for name in NAMES if name.startswith("staggered")]
DISPLAY = scene(NAMES[0]).display


@pytest.mark.parametrize("name", NAMES)
def test_from_home_every_plan_ends_in_the_wanted_curve(name: str) -> None:
    played = replay(DISPLAY, motion(plan(name)))
    wanted = plan(name).wanted
    assert played.start == (STRAIGHT,)
    assert played.states == wanted
    # A straight rod sags into the valley first; on the way to a peak the funnel snaps it over, once.
    names = [(snap.segment, snap.before, snap.after) for snap in played.snaps]
    assert names == ([(1, "valley", "peak")] if wanted == ("peak",) else [])


@pytest.mark.parametrize(("before", "after"), CHAIN)
def test_from_the_last_shape_every_plan_ends_in_the_wanted_curve(before: str, after: str) -> None:
    shown = plan(before).wanted
    made = next_plan(after, before)
    played = replay(DISPLAY, motion(made), shown)
    assert played.start == shown
    assert played.states == made.wanted
    expected = [] if shown == made.wanted else [(*shown, *made.wanted)]
    assert [(snap.before, snap.after) for snap in played.snaps] == expected


@pytest.mark.parametrize(("before", "after"), CHAIN[:3])
def test_the_funnel_works_whatever_the_rod_showed_before(before: str, after: str) -> None:
    made = next_plan(after, before)
    for shown in ("peak", "valley"):
        assert replay(DISPLAY, motion(made), (shown,)).states == made.wanted


def short_cut(of: Plan) -> Plan:
    """The same plan without its funnel: extrude to length between level nodes, then bias, then translate."""
    length, bias, lift = of.steps[2:]
    neutral = tuple(replace(target, bias_deg=0.0, counts=(target.counts[0], 0, 0)) for target in length.targets)
    return replace(of, steps=(replace(length, targets=neutral), bias, lift))


@pytest.mark.parametrize("name", ["level-neutral-peak", "level-down-peak", "staggered-neutral-peak", "level-up-peak"])
def test_without_the_funnel_the_display_shows_the_wrong_curve(name: str) -> None:
    assert replay(DISPLAY, motion(short_cut(plan(name)))).states == ("valley",)
    assert replay(DISPLAY, motion(plan(name))).states == ("peak",)


@pytest.mark.parametrize("name", STAGGERED)
def test_a_node_that_lags_behind_does_no_harm(name: str) -> None:
    assert replay(DISPLAY, motion(plan(name), lag=0.5)).states == plan(name).wanted


def test_a_snap_is_reported_when_it_happens() -> None:
    made = plan("level-neutral-peak")
    (snap,) = replay(DISPLAY, motion(made)).snaps
    begin = made.steps[0].seconds
    assert begin < snap.seconds < begin + made.steps[1].seconds


def test_a_display_at_home_is_straight_and_stays_so() -> None:
    frames: list[Frame] = [(0.0, ((0, 0, 0), (0, 0, 0))), (1.0, ((0, 0, 0), (0, 0, 0)))]
    played = replay(DISPLAY, frames)
    assert (played.start, played.states, played.snaps) == ((STRAIGHT,), (STRAIGHT,), ())


def test_drawn_in_again_the_rod_is_straight() -> None:
    there = motion(plan("level-neutral-valley"))
    back = [(20.0 + (there[-1][0] - seconds), counts) for seconds, counts in reversed(there)]
    assert replay(DISPLAY, [*there, *back]).states == (STRAIGHT,)


@pytest.mark.parametrize("known", ["", "nonsense", LOST, STRAIGHT, "middle-1"])
def test_a_name_that_says_nothing_lets_the_rod_sag(known: str) -> None:
    end = counts_of(plan("level-neutral-peak").steps[-1].targets)
    played = replay(DISPLAY, [(0.0, end), (1.0, end)], (known,))
    assert played.start == played.states == ("valley",)


@pytest.mark.parametrize("known", ["peak", "valley"])
def test_a_name_that_is_known_is_believed(known: str) -> None:
    end = counts_of(plan("level-neutral-peak").steps[-1].targets)
    played = replay(DISPLAY, [(0.0, end), (1.0, end)], (known,))
    assert played.start == played.states == (known,)
    assert played.snaps == ()


def test_segments_of_a_row_are_played_on_their_own() -> None:
    quad = read_display("quad")
    feed = round(0.1 * quad.drive.extrude.counts_per_unit)
    # Three segments get 100 mm to spare, the last one none.
    counts = tuple((max(-3, -node) * feed, 0, 0) for node in range(5))
    played = replay(quad, [(0.0, counts), (1.0, counts)], ("peak", "valley", "nonsense"))
    assert played.states == ("peak", "valley", "valley", STRAIGHT)


QUAD = read_display("quad")


def row_of(feeds_mm: Sequence[float], tilt_deg: float = 0.0) -> tuple[Counts, ...]:
    """Five nodes with these feeds, the one in the middle tilted."""
    feed, tilt = QUAD.drive.extrude.counts_per_unit, QUAD.drive.bias.counts_per_unit
    counts = [(round(mm(each) * feed), 0, 0) for each in feeds_mm]
    counts[2] = (counts[2][0], round(deg(tilt_deg) * tilt), 0)
    return tuple(counts)


def moved(begin: tuple[Counts, ...], end: tuple[Counts, ...]) -> list[Frame]:
    """All axes of a row in step from one place to the other in a second."""
    frames = []
    for part in range(51):
        pairs = [zip(old, new, strict=True) for old, new in zip(begin, end, strict=True)]
        counts = [tuple(round(a + part / 50 * (b - a)) for a, b in pair) for pair in pairs]
        frames.append((part / 50, tuple((c[0], c[1], c[2]) for c in counts)))
    return frames


FED = (80.0, 40.0, 0.0, -40.0, -80.0)
"""Feeds that give every segment of the row 40 mm to spare."""


@pytest.mark.parametrize("tilt_deg", [45.0, -45.0])
def test_the_node_between_two_segments_tilts_the_rod_of_both(tilt_deg: float) -> None:
    # Up at its left end the third segment keeps its peak, and the second cannot, whose right end it is; and vice versa.
    played = replay(QUAD, moved(row_of(FED), row_of(FED, tilt_deg)), ("peak",) * 4)
    lost = 2 if tilt_deg > 0.0 else 3
    assert played.states == tuple("valley" if segment == lost else "peak" for segment in (1, 2, 3, 4))
    assert [(snap.segment, snap.before, snap.after) for snap in played.snaps] == [(lost, "peak", "valley")]


@pytest.mark.parametrize(("fed_mm", "straight"), [(40.0, 2), (-40.0, 3)])
def test_the_node_between_two_segments_feeds_from_one_to_the_other(fed_mm: float, straight: int) -> None:
    there = row_of((80.0, 40.0, fed_mm, -40.0, -80.0))
    played = replay(QUAD, moved(row_of(FED), there), ("valley", "peak", "peak", "valley"))
    expected = ["valley", "peak", "peak", "valley"]
    expected[straight - 1] = STRAIGHT
    assert played.states == tuple(expected)


@pytest.mark.parametrize("frames", [1, 2, 3, 10])
def test_a_state_near_its_end_is_kept_however_few_frames_tell_of_a_long_way(frames: int) -> None:
    # The left node turns by 56 degrees, to where a peak has a twentieth of its stability left.
    bent = replace(
        DISPLAY, rod=replace(DISPLAY.rod, profile=Profile((0.1, 0.81, 1.0, 1.1), (-0.085, 0.67, 0.04, -0.1)))
    )
    right = (-26252, -825, 0)
    way = [(float(k), ((26252, 265 - round(3907 * k / frames), 0), right)) for k in range(frames + 1)]
    played = replay(bent, way, ("peak",))
    assert (played.states, played.snaps) == (("peak",), ())
