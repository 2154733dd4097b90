"""What the numbers of a shape alone tell is refused before any state is searched for, with the words for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from curveline.drive_settings import drive_settings
from curveline.errors import CurvelineError, Infeasible, InvalidInput
from curveline.planning import reachability, tours, verification
from curveline.planning.layout import layout_of
from curveline.planning.targets import extremes_of, targets_of
from curveline.planning.tours import make_plan, make_round_trip, make_tour, start_at
from curveline.planning.verification import Refused, Verifier
from curveline.radio.protocol.codes import POSITION_LIMIT
from curveline.scene import Range, Scene
from curveline.units import deg, mm
from playing import scene
from rows import row

LONE, ROOFLINE = scene("level-neutral-peak"), scene("roofline")
Make = Callable[[], object]


@pytest.fixture
def searchless(monkeypatch: pytest.MonkeyPatch) -> None:
    """No state may be searched for."""

    def search(*_: object) -> None:
        raise AssertionError("a state was searched for")

    for searching in ("showable_states", "model_states"):
        monkeypatch.setattr(verification, searching, search)


@pytest.fixture
def adviceless(monkeypatch: pytest.MonkeyPatch) -> None:
    """A refusal gives no advice, for which states are searched."""

    def bare(_: Verifier, __: object, shape: Scene, refusal: Refused) -> Infeasible:
        return Infeasible(f"{shape.name}: {refusal.message}", "")

    monkeypatch.setattr(tours, "_refusal", bare)
    monkeypatch.setattr(tours, "_begin", lambda *_: None)


def limited(shape: Scene, **limits: Range) -> Scene:
    display = shape.display
    return replace(shape, display=replace(display, limits=replace(display.limits, **limits)))


def with_rod(shape: Scene, total_mm: float) -> Scene:
    display = shape.display
    return replace(shape, display=replace(display, rod=replace(display.rod, total_length=mm(total_mm))))


def telling(shape: Scene, farthest_mm: float) -> Scene:
    """The shape on a display whose nodes can tell only so much fed rod; finer counts come no faster than before."""
    own, counts = shape.display.drive.extrude, POSITION_LIMIT / mm(farthest_mm)
    extrude = replace(own, counts_per_unit=counts, speed=own.speed * own.counts_per_unit / counts)
    return replace(shape, display=replace(shape.display, drive=replace(shape.display.drive, extrude=extrude)))


def shortened(shape: Scene, number: int, length_mm: float) -> Scene:
    segments = list(shape.segments)
    segments[number - 1] = replace(segments[number - 1], length=mm(length_mm))
    return replace(shape, segments=tuple(segments))


def refusal_of(make: Make) -> str:
    with pytest.raises(CurvelineError) as caught:
        make()
    return caught.value.message


@pytest.mark.usefixtures("searchless")
@pytest.mark.parametrize(("segments", "fed"), [(80, 1381), (256, 4349), (1024, 17577)])
def test_more_feed_than_the_radio_tells_is_refused_at_once_with_advice(segments: int, fed: int) -> None:
    with pytest.raises(Infeasible) as caught:
        make_plan(row(segments))
    assert caught.value.message == (
        f"row-{segments}: node 1 would have to feed {fed} mm, more than it can tell by radio"
    )
    assert caught.value.hint.startswith("from home no row of valleys and peaks can be planned on this display")


@pytest.mark.usefixtures("searchless")
def test_what_no_display_of_these_limits_can_is_refused_at_once() -> None:
    narrow = limited(LONE, angle=Range(-deg(10.0), deg(10.0)))
    assert refusal_of(lambda: make_plan(narrow)) == f"{LONE.name}: the display's limits leave no room for a funnel"
    away = limited(LONE, angle=Range(deg(1.0), deg(60.0)))
    for start in ((), start_at(LONE)):
        assert "leave out height 0 or angle 0" in refusal_of(lambda start=start: make_plan(away, *start))  # type: ignore[misc]
    with pytest.raises(InvalidInput, match="the extrude axis would move at"):
        make_plan(telling(LONE, 8.0))


@pytest.mark.usefixtures("searchless", "adviceless")
@pytest.mark.parametrize(
    ("shape", "words"),
    [
        (
            shortened(LONE, 1, 480.0),
            "segment 1 has no stable peak at length 480.0 mm, angles 0.0 and 0.0 deg, right node 0.0 mm above the "
            "left; it has: none that was found and a display can show",
        ),
        (telling(ROOFLINE, 40.0), "node 1 would have to feed 88 mm, more than it can tell by radio"),
        (with_rod(LONE, 520.0), "the rod is too short: its left tail would be 40 mm inside the last node"),
        (with_rod(ROOFLINE, 2010.0), "the rod is too short: its left tail would be 83 mm inside the last node"),
    ],
)
def test_a_shape_that_takes_too_much_is_refused_before_any_search(shape: Scene, words: str) -> None:
    assert refusal_of(lambda: make_plan(shape)) == f"{shape.name}: {words}"
    assert refusal_of(lambda: make_plan(shape, *start_at(shape))) == f"{shape.name}: {words}"


@pytest.mark.usefixtures("searchless", "adviceless")
def test_so_is_any_shape_of_a_tour() -> None:
    short = replace(shortened(LONE, 1, 480.0), name="short")
    for make in (make_tour, make_round_trip):
        assert refusal_of(lambda make=make: make([LONE, LONE, short])).startswith("short: segment 1 has no")  # type: ignore[misc]


def test_what_is_out_of_reach_by_numbers_is_out_of_reach_when_it_is_tried() -> None:
    shape = telling(row(3), 55.0)
    verifier = Verifier(shape.display, lambda: None)
    wanted = tuple(segment.state for segment in shape.segments)
    assert reachability._out_of_reach(verifier, wanted)
    assert "more than it can tell by radio" in reachability._why_shut(verifier, wanted)
    assert not reachability._out_of_reach(Verifier(row(3).display, lambda: None), wanted)


def test_the_extremes_are_those_of_all_nodes() -> None:
    for shape in (ROOFLINE, row(7)):
        drive, layout = drive_settings(shape.display), layout_of(shape)
        counts = [target.counts for target in targets_of(drive, layout)]
        assert extremes_of(drive, layout) == tuple(tuple(map(most, zip(*counts, strict=True))) for most in (min, max))
