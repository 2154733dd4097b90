"""What was modelled of a segment and why, in sentences for people."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from curveline.rod.states.equilibrium import Equilibrium, Outcome
from curveline.simulation.simulate import SegmentStates
from curveline.units import millimetres


def explain(segment: SegmentStates) -> tuple[str, ...]:
    """What the model of a segment holds and leaves out, why, and how well its states are known: sentences."""
    return tuple(f"{text[:1].upper()}{text[1:].rstrip('.')}." for text in (*segment.reasons, *_accuracy(segment)))


def _accuracy(segment: SegmentStates) -> Iterator[str]:
    settled = [state for state in segment.states if state.outcome is Outcome.CONVERGED]
    if settled:
        names = joined([state.name for state in settled])
        worst, most = max(state.error for state in settled), max(state.vertices for state in settled)
        verb = "are" if len(settled) > 1 else "is"
        yield f"within this model {names} {verb} known to {millimetres(worst)}, estimated from up to {most} vertices"


def deepest(state: Equilibrium) -> float:
    """How far a state comes out of the display's plane [m]."""
    return 0.0 if state.space is None else state.space.depth


def joined(names: Sequence[str]) -> str:
    """Names as a sentence lists them."""
    *rest, last = names
    return f"{', '.join(rest)} and {last}" if rest else last
