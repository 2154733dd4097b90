"""A plan proven once more, for a rod that is not as it was when the plan was made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from curveline.errors import Infeasible
from curveline.plan_file import NodeTarget, Plan
from curveline.planning.layout import pose_of
from curveline.planning.moves import DisplayState, Leg, Travel, advance
from curveline.planning.targets import layout_at
from curveline.planning.verification import Refused, Verifier
from curveline.rod.branches.tracking import tracked
from curveline.scene import STRAIGHT, Display

ALTERNATIVES = "|"


def prove_again(plan: Plan, display: Display) -> None:
    """Follow all steps of a plan on a `display` whose rod may have another natural curvature, in uneven progress, too.

    Infeasible, with the step, where one is not safe, or where it ends in another state.
    """
    verifier = Verifier(display, lambda: None)
    travel = _begin(verifier, plan)
    try:
        before: Sequence[str] = plan.granted
        for step in plan.steps:
            pairs = list(enumerate(zip(before, step.states, strict=True)))
            funnels = {segment: new for segment, (old, new) in pairs if _is_one(new) and not _is_one(old)}
            # What the plan itself lets go of need not be kept.
            keeps = all(old == new for _, (old, new) in pairs if _is_one(old))
            travel = replace(travel, stage=replace(travel.stage, keeps=keeps))
            leg = Leg(step.action, layout_at(verifier.drive, _counts(step.targets)), funnels, halvings=0)
            travel = advance(verifier, travel, leg)
            before = step.states
        for segment, (hold, wanted) in enumerate(zip(travel.stage.holds, plan.wanted, strict=True)):
            if hold is None:
                continue
            name = verifier.name_of(pose_of(display, travel.stage.layout, segment), hold)
            if name != wanted:
                raise Refused(f"segment {segment + 1} would end as the {name}")
    except Refused as refusal:
        raise Infeasible(f"{plan.name}: {refusal.message}") from None


def _begin(verifier: Verifier, plan: Plan) -> Travel:
    layout = layout_at(verifier.drive, _counts(plan.start))
    holds = []
    for segment, name in enumerate(plan.granted):
        found = verifier.showable(pose_of(verifier.display, layout, segment)).called(name) if name else None
        holds.append(tracked(found) if found is not None else None)
    return Travel((), DisplayState(layout, tuple(holds)))


def _counts(targets: Sequence[NodeTarget]) -> list[tuple[int, int, int]]:
    return [target.counts for target in targets]


def _is_one(name: str) -> bool:
    """True if a name is that of one curved state, and not of several or of a straight rod."""
    return name not in ("", "none", STRAIGHT) and ALTERNATIVES not in name
