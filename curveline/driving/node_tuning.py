"""A motor of one node is given some of its duty at once: what it is like, and which gains suit it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from curveline.calibrating.step_response import Tuning, fitted_response, tuning_of
from curveline.driving.node_errands import NodePlace
from curveline.errors import LinkError
from curveline.radio.protocol.codes import TRACE_MS
from curveline.radio.protocol.service_frames import ServiceFrame

DUTIES = (200, -200, 340, -340)
"""Thousandths of full duty, in the order of the turns: there and back again."""
SPAN_MS = 250
MOST_COUNTS = 900
LEAST_COUNTS = 40
"""A turn with fewer tells no speed."""


def tune(place: NodePlace, name: str, told: Callable[[float], None] = lambda duty: None) -> Tuning:
    """Turn a motor at two duties, both ways, and say what gains suit it; `told` hears each duty before it is given.

    LinkError if the motor does not turn.
    """
    number = place.axis(name)
    responses = []
    with place.tried() as errand:
        for duty in DUTIES:
            told(duty / 1000.0)
            wish = ServiceFrame(0, 0, 0, axis=number, amount=duty, rate=MOST_COUNTS, span=SPAN_MS, at_once=True)
            samples = errand.turn(wish).samples
            if not samples or max(map(abs, samples)) < LEAST_COUNTS or samples[-1] * duty < 0:
                hint = f"`curveline node check {place.number} {name}` finds out why"
                raise LinkError(
                    f"the {name} motor of node {place.number} does not turn as it is told", hint, place.number
                )
            responses.append(fitted_response(duty / 1000.0, _driven(samples)))
            errand.rest(0.2)
    return tuning_of(place.number, name, responses)


def _driven(samples: Sequence[int]) -> tuple[int, ...]:
    """Those samples that were taken while the duty was given."""
    return tuple(samples[: SPAN_MS // TRACE_MS])
