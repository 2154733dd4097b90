"""Trials of shapes held against the model."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from curveline.comparing.agreement import (
    CompareRequest,
    Comparison,
    NamedTrial,
    SegmentAgreement,
    ShapeAgreement,
    StateMisfit,
)
from curveline.comparing.measures import common_span, heights_at, mean_deviation, rms_across, rms_over
from curveline.comparing.naming import ModelCurve, model_curves, named
from curveline.listening import SILENT, Listener
from curveline.trial import Array, ShapeTrials

NOWHERE = np.zeros(0)


def compare(
    trials: Sequence[ShapeTrials], request: CompareRequest | None = None, listener: Listener = SILENT
) -> Comparison:
    """Hold the trials of some shapes against the model.

    A trial that shows none of a segment's states, or not clearly which, has an outcome that says so and counts for
    nothing. Trials in other states than most are named, and left out of the numbers of their shape.
    """
    listener.computing()
    asked = request or CompareRequest()
    return Comparison(tuple(_agreement(each, asked) for each in trials))


def _agreement(given: ShapeTrials, request: CompareRequest) -> ShapeAgreement:
    scene = given.scene
    known = model_curves(scene)
    trials = [named(trial, known, scene.display.span) for trial in given.trials]
    shown = [tuple(curve.state for curve in trial.curves) for trial in trials]
    usual = _usual(shown, tuple(segment.state for segment in scene.segments))
    verdicts = tuple(
        NamedTrial(each, states, counts=states == usual) for each, states in zip(trials, shown, strict=True)
    )
    counted = [each.trial for each in verdicts if each.counts]
    segments = tuple(
        _segment((segment.state, state), known[place], [trial.curves[place].points for trial in counted], request.ddof)
        for place, (segment, state) in enumerate(zip(scene.segments, usual, strict=True))
    )
    return ShapeAgreement(scene, verdicts, segments if counted else (), request)


def _usual(shown: Sequence[tuple[str, ...]], wanted: tuple[str, ...]) -> tuple[str, ...]:
    """The states that count: the wanted ones if any trial is in them, else those of most trials."""
    seen = Counter(states for states in shown if states)
    return wanted if wanted in seen or not seen else seen.most_common(1)[0][0]


def _segment(
    states: tuple[str, str], known: tuple[ModelCurve, ...], trials: Sequence[Array], ddof: int
) -> SegmentAgreement:
    """The wanted state of a segment, and the one that some `trials`, polylines, are in; what they show beside it."""
    wanted, state = states
    x = common_span([*trials, *(each.points for each in known)]) if trials else NOWHERE
    rows = [heights_at(points, x) for points in trials]
    heights = np.array(rows) if x.size and all(row is not None for row in rows) else None
    # What one trial does not tell, counts of none.
    told = np.zeros(0, dtype=bool) if heights is None else np.isfinite(heights).all(axis=0)
    if heights is not None:
        heights = np.where(told, heights, np.nan) if told.sum() > 1 else None
    misfits = [_misfit(each, trials, x, heights) for each in known] if trials else []
    return SegmentAgreement(
        wanted,
        state,
        tuple(sorted(misfits, key=lambda each: each.across)),
        None if heights is None else mean_deviation(heights[:, told], ddof),
        NOWHERE if heights is None else x,
        NOWHERE if heights is None else heights.mean(axis=0),
        NOWHERE if heights is None or len(heights) <= ddof else heights.std(axis=0, ddof=ddof),
        tuple(known),
    )


def _misfit(curve: ModelCurve, trials: Sequence[Array], x: Array, heights: Array | None) -> StateMisfit:
    expected = None if heights is None else heights_at(curve.points, x)
    over = None if heights is None or expected is None else rms_over(heights, expected)
    across = float(np.sqrt(np.mean([rms_across(points, curve.points) ** 2 for points in trials])))
    return StateMisfit(curve.name, over, across)
