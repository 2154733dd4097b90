"""A plan proven once more, for a rod that is not as it was when the plan was made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from curveline.errors import Infeasible
from curveline.plan_file import NodeTarget, Plan, Step
from curveline.planning.layout import pose_of
from curveline.planning.moves import DisplayState, Leg, Travel, advance
from curveline.planning.targets import layout_at
from curveline.planning.verification import Refused, Verifier
from curveline.rod.branches.tracking import tracked
from curveline.rod.problem import Pose
from curveline.scene import STRAIGHT, Display
from curveline.units import TAUT

ALTERNATIVES = "|"


def prove_again(plan: Plan, display: Display) -> None:
    """Follow all steps of a plan on a `display` whose rod may have another natural curvature, in uneven progress, too.

    Infeasible, with the step, where one is not safe, or where it ends in another state.
    """
    verifier = Verifier(display, lambda: None)
    travel = _begin(verifier, plan)
    lost: dict[int, Refused] = {}
    try:
        before: Sequence[str] = plan.granted
        for step in plan.steps:
            travel, refusals = _again(verifier, travel, before, step)
            lost |= refusals
            before = step.states
            for shown in enumerate(before if step.shape or step is plan.steps[-1] else ()):
                _check_shown(verifier, travel.stage, shown, lost)
    except Refused as refusal:
        raise Infeasible(f"{plan.name}: {refusal.message}") from None


def _again(
    verifier: Verifier, travel: Travel, before: Sequence[str], step: Step
) -> tuple[Travel, Mapping[int, Refused]]:
    """Follow a step that begins in the states `before`; of segments that it is no funnel for any more, why it is not.

    What it takes from one state to another, or from any to one, it may not take there any more: what comes of that is
    seen when the shape is to be there, since a name alone may also be that of the only state that there is for a while.
    """
    pairs = list(enumerate(zip(before, step.states, strict=True)))
    funnels = {segment: new for segment, (old, new) in pairs if _is_one(new) and new != old}
    # What the plan itself lets go of need not be kept.
    keeps = all(old == new for _, (old, new) in pairs if _is_one(old))
    kept = zip(travel.stage.holds, before, strict=True)
    holds = tuple(hold if _is_one(old) else None for hold, old in kept)
    travel = replace(travel, stage=replace(travel.stage, keeps=keeps, holds=holds))
    leg = Leg(step.action, layout_at(verifier.drive, _counts(step.targets)), funnels, halvings=0)
    try:
        return advance(verifier, travel, leg), {}
    except Refused as refusal:
        if not funnels:
            raise
        return advance(verifier, travel, replace(leg, funnels={})), dict.fromkeys(funnels, refusal)


def _check_shown(verifier: Verifier, stage: DisplayState, which: tuple[int, str], lost: Mapping[int, Refused]) -> None:
    """Refused unless a segment, from 0, is sure to be in the state of that name; `lost` is what may have been why."""
    segment, wanted = which
    hold, pose = stage.holds[segment], pose_of(verifier.display, stage.layout, segment)
    if wanted == STRAIGHT:
        if verifier.straight(pose) is None and not _is_home(pose):
            raise Refused(f"segment {segment + 1} need not be straight")
        return
    if hold is not None:
        name = verifier.name_of(pose, hold)
    elif _is_one(wanted):
        if segment in lost:
            raise lost[segment]
        name = "|".join(state.name for state in verifier.states(pose)) or STRAIGHT
    else:
        return
    if name != wanted or hold is None:
        raise Refused(f"segment {segment + 1} would end as the {name}")


def _begin(verifier: Verifier, plan: Plan) -> Travel:
    layout = layout_at(verifier.drive, _counts(plan.start))
    holds = []
    for segment, name in enumerate(plan.granted):
        found = verifier.showable(pose_of(verifier.display, layout, segment)).called(name) if name else None
        holds.append(tracked(found) if found is not None else None)
    return Travel((), DisplayState(layout, tuple(holds)))


def _counts(targets: Sequence[NodeTarget]) -> list[tuple[int, int, int]]:
    return [target.counts for target in targets]


def _is_home(pose: Pose) -> bool:
    """True between nodes that are at home, where the rod lies as it can."""
    return pose[:4] == (pose.x, 0.0, 0.0, 0.0) and abs(pose.length - pose.x) <= TAUT


def _is_one(name: str) -> bool:
    """True if a name is that of one curved state, and not of several or of a straight rod."""
    return name not in ("", "none", STRAIGHT) and ALTERNATIVES not in name
