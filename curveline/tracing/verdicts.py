"""What is said of a segment: which state its rod is in, or why that cannot be told.

The thresholds were chosen on synthetic photographs with seeds below 10,000: see tests/completeness/photographs.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from curveline.cameras.outcomes import TrialOutcome
from curveline.phrases import counted
from curveline.tracing.following import FollowedState
from curveline.units import mm, to_mm

COVER = 0.5
"""Part of the visible rod that must be seen."""
NOTHING = 0.25
"""If less of what is near a state is like the rod, none is seen."""
ALIKE = 0.7
"""A state whose support is that of the best one by such a part fits as well."""
SAME = mm(5.0)
"""Curves that are no farther apart are the same."""
FARTHEST = mm(30.0)
"""No display differs by more from its model, root of the mean square."""
SUREST = mm(0.8)
"""A standard error that is larger is of no use."""


@dataclass(frozen=True)
class SegmentVerdict:
    """What is said of a segment."""

    outcome: TrialOutcome
    reason: str = ""  # in a sentence, empty if it was seen
    sigma: float = 0.0  # [m] standard error of its points


def verdict_on(found: Sequence[FollowedState]) -> SegmentVerdict:
    """What is said of a segment whose states were followed, the likeliest first."""
    if not found:
        return SegmentVerdict(TrialOutcome.ROD_NOT_SEEN, "no state of the shape is in sight between the nodes")
    best = found[0]
    refusal = _refusal(best) or _other(found)
    if refusal is not None:
        return refusal
    sigma = best.sigma
    if sigma > SUREST:
        said = (
            f"the rod is told to {to_mm(sigma):.2f} mm only, by what is seen of {best.state.name}: too little contrast"
        )
        return SegmentVerdict(TrialOutcome.BLURRED, f"{said}, or too blurred")
    return SegmentVerdict(TrialOutcome.SEEN, "", sigma)


def _refusal(best: FollowedState) -> SegmentVerdict | None:
    """Why the rod that was followed best is none."""
    seen, name = best.cover, best.state.name
    if seen < COVER:
        if best.rodlike < NOTHING:
            said = f"nothing like the rod is near any of its states: {seen:.0%} of it would be seen as {name}"
            return SegmentVerdict(TrialOutcome.ROD_NOT_SEEN, said)
        if best.rodlike > 1.5 * seen:
            said = f"what is seen follows no elastic curve: the nearest, of {name}, has {seen:.0%} of it"
            return SegmentVerdict(TrialOutcome.NOT_ELASTIC, said)
        return SegmentVerdict(
            TrialOutcome.TOO_LITTLE_SEEN, f"only {seen:.0%} of the rod is seen, as {name}; {COVER:.0%} are needed"
        )
    if best.from_model > FARTHEST:
        said = f"the rod is {to_mm(best.from_model):.0f} mm off {name}, the nearest state: no display differs so much"
        return SegmentVerdict(TrialOutcome.NOT_ELASTIC, said)
    return None


def _other(found: Sequence[FollowedState]) -> SegmentVerdict | None:
    """That another state fits as well."""
    best = found[0]
    alike = [each for each in found[1:] if each.support > ALIKE * best.support and _apart(best, each) > SAME]
    if not alike:
        return None
    names = " and ".join(each.state.name for each in (best, *alike))
    said = f"{counted(1 + len(alike), 'state')} fit alike: {names}"
    return SegmentVerdict(TrialOutcome.AMBIGUOUS, said)


def _apart(one: FollowedState, other: FollowedState) -> float:
    """How far apart two elastic curves are at most [m]."""
    return float(np.max(np.hypot(*(one.elastic.points - other.elastic.points).T)))
