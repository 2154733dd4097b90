"""Of a shape that cannot be planned: which number is at fault, and its nearest value that works."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import pytest

from curveline.errors import CurvelineError, Infeasible
from curveline.planning.advice import TRIES, Advice, nearest
from curveline.planning.feasibility import check_goal
from curveline.planning.tours import make_plan
from curveline.planning.verification import Verifier
from curveline.scene import Load, Node, Scene, Segment
from curveline.shapes.files import read_display
from curveline.simulation.changes import ANGLE, Quantity
from curveline.units import deg, mm, nmm, to_deg
from playing import scene

SINGLE = scene("level-up-peak").display


def shape(length_mm: float, angles_deg: tuple[float, float], height_mm: float, state: str) -> Scene:
    """A scene on the display `single`, the left node at height 0."""
    nodes = (Node(0.0, deg(angles_deg[0])), Node(mm(height_mm), deg(angles_deg[1])))
    return Scene("shape", SINGLE, nodes, (Segment(mm(length_mm), state),))


NO_PEAK = shape(550.0, (-65.0, 35.0), 40.0, "peak")
TOO_SHORT = shape(520.0, (30.0, -30.0), 100.0, "peak")
TOO_TIGHT = shape(505.0, (30.0, -30.0), 0.0, "peak")
TWISTED = shape(515.0, (-75.0, 75.0), 0.0, "peak")
WEAK = replace(
    shape(560.0, (60.0, -60.0), 0.0, "peak"),
    display=replace(SINGLE, drive=replace(SINGLE.drive, max_moment=nmm(220.0))),
)


def works(tried: Scene) -> str:
    """The whole proof."""
    try:
        make_plan(tried)
    except CurvelineError as error:
        return error.message
    return ""


def exists(tried: Scene) -> bool:
    """Whether the shape itself is possible, seen without the module under test."""
    try:
        check_goal(Verifier(tried.display, lambda: None), tried)
    except Infeasible:
        return False
    return True


def applied(found: Advice, to: Scene) -> Scene:
    for change in found.changes:
        to = change.quantity.put(to, change.nearest)
    return to


@pytest.mark.parametrize(
    ("refused", "reason"),
    [
        (NO_PEAK, "no stable peak"),
        (TOO_SHORT, "extruding takes"),
        (TOO_TIGHT, "bend to a radius"),
        (WEAK, "biasing takes"),
    ],
    ids=["no-peak", "too-short", "too-tight", "weak-motor"],
)
def test_what_is_advised_can_be_planned(refused: Scene, reason: str) -> None:
    assert works(refused)
    found = nearest(refused, range(1), works)
    assert found is not None
    assert reason in found.reason
    (change,) = found.changes
    assert change.asked == change.quantity.of(refused)
    assert works(applied(found, refused)) == ""
    # One tick nearer to what was asked for, it does not even exist.
    nearer = change.nearest + math.copysign(change.quantity.tick, change.asked - change.nearest)
    assert not exists(change.quantity.put(refused, nearer))


def test_no_other_quantity_needs_a_smaller_change() -> None:
    found = nearest(NO_PEAK, range(1), lambda _: "")
    assert found is not None
    assert found.sentence == "angle of node 1 is at fault: with -27.5 deg instead of -65 deg it works"
    part = (deg(-27.5) - deg(-65.0)) / deg(150.0)
    for change in (sign * step / 16 * part for step in range(1, 16) for sign in (1, -1)):
        assert not any(map(exists, varied(NO_PEAK, change)))


def varied(asked: Scene, change: float) -> Iterator[Scene]:
    """Scenes in which one number differs by a part of what the display allows of it, as far as it does."""
    limits, (left, right), (segment,) = asked.display.limits, asked.nodes, asked.segments
    length = segment.length + change * (limits.length.high - limits.length.low)
    if limits.length.contains(length):
        yield replace(asked, segments=(replace(segment, length=length),))
    for node in (left, right):
        angle = node.angle + change * (limits.angle.high - limits.angle.low)
        height = node.height + change * (limits.height.high - limits.height.low)
        if limits.angle.contains(angle):
            turned = replace(node, angle=angle)
            yield replace(asked, nodes=(turned, right) if node is left else (left, turned))
        if limits.height.contains(height):
            raised = replace(node, height=height)
            yield replace(asked, nodes=(raised, right) if node is left else (left, raised))


def test_values_that_work_only_between_others_are_found() -> None:
    refused = shape(550.0, (-65.0, 35.0), 0.0, "peak")
    turned = [Quantity(ANGLE, 0).put(refused, deg(angle)) for angle in range(-65, 75, 2)]
    there = [to_deg(each.nodes[0].angle) for each in turned if exists(each)]
    assert 36.0 < min(there) < max(there) < 75.0
    found = nearest(refused, range(1), lambda _: "")
    assert found is not None
    (change,) = found.changes
    assert change.quantity == Quantity(ANGLE, 0)
    assert min(there) - 2.0 < to_deg(change.nearest) <= min(there)


def test_where_no_single_number_helps_two_are_changed() -> None:
    found = nearest(TWISTED, range(1), works)
    assert found is not None
    assert found.sentence.startswith("no single number is at fault: with angle of node 1 of ")
    assert len(found.changes) == 2
    assert works(applied(found, TWISTED)) == ""


def test_what_never_works_gives_no_advice_and_costs_few_plans() -> None:
    seen = []

    def never(tried: Scene) -> str:
        seen.append(tried)
        return "no"

    assert nearest(NO_PEAK, range(1), never) is None
    assert 1 < len(seen) <= TRIES
    assert len(set(seen)) == len(seen)


def test_a_shape_that_exists_but_cannot_be_reached_is_changed_until_it_can() -> None:
    reachable = mm(700.0)

    def by_length(tried: Scene) -> str:
        return "" if tried.segments[0].length >= reachable else "the way there is not safe"

    found = nearest(scene("level-up-peak"), range(1), by_length, tries=60)
    assert found is not None
    assert found.reason == ""
    assert found.sentence == "length of segment 1 is at fault: with 700 mm instead of 660 mm it works"


def row(*segments: Segment, angles_deg: tuple[float, ...], loads: tuple[Load, ...] = ()) -> Scene:
    """A scene on the display `quad`, all nodes level."""
    nodes = tuple(Node(0.0, deg(angle)) for angle in angles_deg)
    return Scene("row", read_display("quad"), nodes, segments, loads)


PEAK_620, VALLEY_620 = Segment(mm(620.0), "peak"), Segment(mm(620.0), "valley")


def test_a_node_is_shared_by_its_neighbours() -> None:
    short = Segment(mm(570.0), "peak")
    free = row(VALLEY_620, PEAK_620, short, VALLEY_620, angles_deg=(0.0, 0.0, -65.0, 35.0, 0.0))
    assert not exists(free)
    found = nearest(free, range(2, 3), lambda _: "")
    assert found is not None
    assert {change.quantity.place for change in found.changes} <= {2, 3}
    assert exists(applied(found, free))
    # What would help this segment by itself would cost its left neighbour the peak.
    held = row(VALLEY_620, Segment(mm(560.0), "peak"), short, VALLEY_620, angles_deg=(0.0, -50.0, -65.0, 35.0, 0.0))
    other = nearest(held, range(2, 3), lambda _: "")
    assert other is None or exists(applied(other, held))
    assert other is None or [each.quantity for each in other.changes] != [each.quantity for each in found.changes]


def test_loads_stay_on_their_segments() -> None:
    pushed = row(
        *(VALLEY_620, PEAK_620, VALLEY_620, PEAK_620),
        angles_deg=(-20.0, 20.0, -20.0, 20.0, -20.0),
        loads=(Load(3, 0.5, (0.0, -5.2)),),
    )
    assert not exists(pushed)
    found = nearest(pushed, range(3, 4), lambda _: "")
    assert found is not None
    assert "of its loads" in found.reason
    assert exists(applied(found, pushed))
