"""Plans stay where nodes can tell their place: a status saturates at 262,136 counts of fed rod."""

from __future__ import annotations

from dataclasses import replace

import pytest

from curveline.errors import Infeasible
from curveline.plan_file import Plan
from curveline.planning.tours import make_plan
from curveline.radio.host.preflight import check_targets
from curveline.radio.protocol.codes import POSITION_LIMIT
from curveline.scene import Scene
from curveline.units import mm
from rows import row

SHAPE = row(3)


def reaching(limit_mm: float) -> Scene:
    """The shape on a display whose encoders count so finely that nodes can tell only so much fed rod."""
    display = SHAPE.display
    extrude = replace(display.drive.extrude, counts_per_unit=POSITION_LIMIT / mm(limit_mm))
    return replace(SHAPE, display=replace(display, drive=replace(display.drive, extrude=extrude)))


def farthest_mm(plan: Plan) -> float:
    return max(abs(target.extrude_mm) for step in plan.steps for target in step.targets)


def test_a_plan_that_would_feed_too_much_on_the_way_goes_another_way() -> None:
    plain = make_plan(SHAPE)
    goal, way = max(abs(target.extrude_mm) for target in plain.steps[-1].targets), farthest_mm(plain)
    assert goal + 5.0 < way, "in the funnel there is more rod between the nodes than in the end"
    limit = 0.5 * (goal + way)
    made = make_plan(reaching(limit))
    check_targets(made)
    assert goal <= farthest_mm(made) <= limit
    assert made.wanted == plain.wanted


def test_a_shape_with_too_much_rod_is_refused_with_the_reason() -> None:
    with pytest.raises(Infeasible, match=r"node \d would have to feed -?\d+ mm, more than it can tell by radio"):
        make_plan(reaching(55.0))
