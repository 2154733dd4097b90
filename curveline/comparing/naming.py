"""Which stable state of the model a trial is in, if it is clearly one of them."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from curveline.cameras.outcomes import TrialOutcome
from curveline.comparing.measures import rms_across
from curveline.scene import Scene
from curveline.simulation.simulate import simulate
from curveline.trial import Array, Trial
from curveline.units import millimetres, mm

TOLERANCE = mm(0.02)
"""Of the curves that trials are held against."""
POINTS = 801
"""Of such a curve."""
CLEARLY = 0.5
"""The nearest state is at most this part as far from a trial as the next one; else it is ambiguous which it is."""
FARTHEST = 0.08
"""Of the span: a trial that is farther than that from every state shows none of them."""
LEAST_SEEN = 0.5
"""Of the span: points over less do not tell which state they are of."""


class ModelCurve(NamedTuple):
    """A stable state of a segment: its name, and its curve (POINTS, 2) [m] in the display's frame."""

    name: str  # such as peak
    points: Array  # from pivot to pivot


def model_curves(scene: Scene) -> list[tuple[ModelCurve, ...]]:
    """The stable states of every segment that a display can show, the highest first."""
    return [
        tuple(
            ModelCurve(state.name, state.curve(POINTS) + np.array([place * scene.display.span, node.height]))
            for state in found.states
            if state.stable and state.simple
        )
        for place, (found, node) in enumerate(zip(simulate(scene, TOLERANCE), scene.nodes, strict=False))
    ]


def named(trial: Trial, known: list[tuple[ModelCurve, ...]], span: float) -> Trial:
    """A trial with the state of each of its curves, among those `known` of its segment; else why it shows none.

    What a photograph was found to show stays: more was looked at than its points.
    """
    if trial.outcome is not TrialOutcome.SEEN:
        return trial
    curves = []
    for number, (curve, states) in enumerate(zip(trial.curves, known, strict=True), start=1):
        if not curve.state:
            found = _state_of(curve.points, states, span)
            if isinstance(found, _Doubt):
                where = f"segment {number}: " if len(known) > 1 else ""
                return replace(trial, outcome=found.outcome, reason=f"{where}{found.reason}", curves=())
            curve = replace(curve, state=found)
        curves.append(curve)
    return replace(trial, curves=tuple(curves))


class _Doubt(NamedTuple):
    """Why a curve is in no state."""

    outcome: TrialOutcome
    reason: str


def _state_of(points: Array, states: tuple[ModelCurve, ...], span: float) -> str | _Doubt:
    """The state that a polyline is in."""
    if (width := float(np.ptp(points[:, 0]))) < LEAST_SEEN * span:
        return _Doubt(TrialOutcome.TOO_LITTLE_SEEN, f"its points go over {millimetres(width)} of {millimetres(span)}")
    off = sorted((rms_across(points, state.points), state.name) for state in states)
    if not off:
        return _Doubt(TrialOutcome.NO_STATE, "the model has no stable state here")
    (nearest, name), *others = off
    if nearest > FARTHEST * span:
        return _Doubt(TrialOutcome.NO_STATE, f"the nearest state, the {name}, is {millimetres(nearest)} off")
    if others and nearest > CLEARLY * others[0][0]:
        next_off, other = others[0]
        told = f"the {name} is {millimetres(nearest)} off, the {other} {millimetres(next_off)}"
        return _Doubt(TrialOutcome.AMBIGUOUS, told)
    return name
