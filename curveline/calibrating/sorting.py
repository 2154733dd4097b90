"""Which state each curve of a trial is in, for numbers of a display that may be far off: those not known are left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from curveline.calibrating.bent_rod import Bent, BentSegment, states_of
from curveline.calibrating.misfit import SeenSegment, as_seen, resampled
from curveline.calibrating.unknowns import Unknowns
from curveline.cameras.outcomes import TrialOutcome
from curveline.comparing.measures import rms_across
from curveline.trial import Array, ShapeTrials

FARTHEST = 0.1
"""Of the span: a curve that is farther than that from every state is of none."""


@dataclass(frozen=True, eq=False)
class Sorted:
    """Segments with the curves of their trials, by states, and those states; and what was left: sources, why."""

    seen: tuple[SeenSegment, ...]
    held: tuple[Bent, ...]
    left: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class _Curve:
    source: str
    points: Array
    state: str


def sorted_by_state(trials: Sequence[ShapeTrials], unknowns: Unknowns, numbers: Array) -> Sorted:
    """All curves of trials by the states that the numbers give, named or nearest."""
    seen: list[SeenSegment] = []
    held: list[Bent] = []
    left = [
        (trial.source, trial.reason or trial.outcome.value)
        for each in trials
        for trial in each.trials
        if trial.outcome is not TrialOutcome.SEEN
    ]
    for number, each in enumerate(trials):
        for index in range(len(each.scene.segments)):
            bent = BentSegment(each.scene, index, unknowns)
            states = states_of(bent, numbers)
            curves = [
                _Curve(trial.source, resampled(trial.curves[index].points), trial.curves[index].state)
                for trial in each.trials
                if trial.outcome is TrialOutcome.SEEN
            ]
            groups: dict[str, list[Array]] = {}
            for curve in curves:
                if name := _state_of(curve, states, (unknowns, numbers, each.scene.display.span)):
                    groups.setdefault(name, []).append(curve.points)
                else:
                    why = "is none of its states" if states else "has no states there"
                    left.append((curve.source, f"segment {index + 1} {why} by what is known of the display"))
            for name, points in groups.items():
                seen.append(SeenSegment(bent, number, name, tuple(points)))
                held.append(states[name])
    return Sorted(tuple(seen), tuple(held), tuple(left))


def _state_of(curve: _Curve, states: dict[str, Bent], seen_by: tuple[Unknowns, Array, float]) -> str:
    """The name of the state that a curve is in; empty for none."""
    unknowns, numbers, span = seen_by
    if curve.state in states:
        return curve.state
    off = {
        name: rms_across(curve.points, as_seen(unknowns, numbers, state.points)[0]) for name, state in states.items()
    }
    nearest = min(off, key=lambda name: off[name], default="")
    return nearest if nearest and off[nearest] <= FARTHEST * span else ""
