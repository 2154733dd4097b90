"""What the rod of a mock display did in a run: at every shape that was complete on the way, and in the end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from curveline.plan_file import Plan, Step
from curveline.radio.host.preflight import START_TOLERANCE
from curveline.replay.playback import Counts, Motion, Playback, replay
from curveline.scene import BUCKLED, LOST, STRAIGHT, UNNAMED, Display


@dataclass(frozen=True)
class ShapeCheck:
    """The states of all segments when the step had been done that completes a shape, and those that were wanted."""

    step: int  # from 1
    shape: str  # by name
    wanted: tuple[str, ...]  # left to right
    states: tuple[str, ...]  # left to right

    def line(self) -> str:
        """The stop as text: of several segments only those that were in another state than the wanted one."""
        several = len(self.states) > 1
        wrong = [
            f"{f'segment {number}' if several else 'the rod'} was {posture(state)}, not the wanted {wanted}"
            for number, (state, wanted) in enumerate(zip(self.states, self.wanted, strict=True), start=1)
            if state != wanted
        ]
        right = f"all {len(self.states)} segments were" if several else f"the rod was {posture(self.states[0])},"
        return f"{self.shape}: {'; '.join(wrong) or f'{right} as wanted'}"


@dataclass(frozen=True)
class CarriedOut:
    """A plan, the display that carried it out, and its first step (from 1) that was done meanwhile."""

    plan: Plan
    display: Display
    first: int = 1


def posture(state: str) -> str:
    """A state as part of a sentence."""
    if state == BUCKLED:
        return "buckled out of the plane"
    return state if state in (STRAIGHT, LOST) else f"in the {state}"


def play_back(job: CarriedOut, motion: Motion, rod: Sequence[str]) -> tuple[Playback, tuple[ShapeCheck, ...]]:
    """Play the nodes' motion, from where the step before the first one ends; `rod` names the states known there."""
    pieces: list[Playback] = []
    stops: list[ShapeCheck] = []
    begin, states = 0, _begin(job, motion[0][1], rod)
    for end, step in _completed(job, motion):
        pieces.append(replay(job.display, motion[begin : end + 1], states))
        begin, states = end, pieces[-1].states
        stops.append(ShapeCheck(step.number, step.shape, step.states, states))
    pieces.append(replay(job.display, motion[begin:], states))
    snaps = tuple(snap for piece in pieces for snap in piece.snaps)
    return Playback(pieces[0].start, pieces[-1].states, snaps), tuple(stops)


def _begin(job: CarriedOut, counts: Sequence[Counts], rod: Sequence[str]) -> tuple[str, ...]:
    """The states as known; where they are not, and the plan starts here, those that it takes for granted."""
    off = [
        abs(a - b)
        for node, at in zip(job.plan.start, counts, strict=True)
        for a, b in zip(node.counts, at, strict=True)
    ]
    if job.first > 1 or max(off) > START_TOLERANCE:
        return tuple(rod)
    known = (*rod, *job.plan.granted[len(rod) :])
    return tuple(
        granted if name in ("", *UNNAMED) else name for name, granted in zip(known, job.plan.granted, strict=False)
    )


def _completed(job: CarriedOut, motion: Motion) -> Iterator[tuple[int, Step]]:
    """Where in the motion a shape was complete, and after which step."""
    at = 0
    for step in job.plan.steps[job.first - 1 :]:
        # Nodes go straight from one end of a step to the next, so that the first time there is when the step was done.
        ends = tuple(target.counts for target in step.targets)
        while at < len(motion) and motion[at][1] != ends:
            at += 1
        if at == len(motion):
            return
        if step.shape:
            yield at, step
