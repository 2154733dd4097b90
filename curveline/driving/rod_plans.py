"""Plans for the rod of a display as it is now, where its file says what set it takes."""

from __future__ import annotations

import time
from dataclasses import replace

from curveline.driving.known_states import states_after
from curveline.driving.rod_record import RodRecord
from curveline.driving.tours import Tour, Whereabouts, plan_tour
from curveline.errors import Infeasible, InvalidInput
from curveline.listening import Listener
from curveline.plan_file import Plan

SLIGHT = 0.01
"""A set [1/m] that is not worth a word."""


def with_rod_now(tour: Tour, record: RodRecord, listener: Listener) -> Tour:
    """As `as_on_record`; the same tour if the display file does not say what set its rod takes."""
    return tour if tour.display.rod.relaxation is None else as_on_record(tour, record, listener)


def as_on_record(tour: Tour, record: RodRecord, listener: Listener) -> Tour:
    """A tour of shapes whose rod is as the runs on record left it."""
    from curveline.driving.rod_now import rod_now

    rod = rod_now(tour.display, record, time.time())
    for remark in rod.remarks:
        listener.note(remark)
    if rod.past.largest_set >= SLIGHT:
        listener.note(f"the rod has a set of up to {rod.past.largest_set:.2g} 1/m, which the plan counts with")
    display = rod.with_set
    scenes = tuple(replace(scene, display=display, past=rod.past, last=rod.last) for scene in tour.scenes)
    return replace(tour, display=display, scenes=scenes)


def plan_for_later(tour: Tour, begin: Whereabouts, listener: Listener) -> Plan:
    """As `plan_tour`; and if the rod has a set, tell if the plan is not safe once that has faded."""
    plan = plan_tour(tour, begin, listener)
    _tell_of_fading(plan, tour, listener)
    return plan


def _tell_of_fading(plan: Plan, tour: Tour, listener: Listener) -> None:
    scene = next((scene for scene in tour.scenes if scene.past is not None), None)
    if scene is None:
        return
    from curveline.planning.reproof import prove_again
    from curveline.simulation.dwelling import as_made

    try:
        prove_again(plan, as_made(scene))
    except Infeasible as refusal:
        listener.note(
            f"note: this plan is safe while the rod has this set, and not once that has faded: {refusal.message}"
        )


def rest_of(plan: Plan, done: int) -> Plan:
    """What is left of a plan once so many of its steps are done."""
    if done == 0:
        return plan
    last = plan.steps[done - 1]
    return replace(plan, start=last.targets, shows=states_after(plan, done), steps=plan.steps[done:])


def check_for_rod(plan: Plan, record: RodRecord, listener: Listener) -> None:
    """Infeasible for a plan that is not safe for the rod as the runs on record left it; nothing moves for that."""
    from curveline.displays.of_plan import display_of

    try:
        display = display_of(plan)
    except InvalidInput:
        # Whoever sends from where the display file is not knows nothing of its rod.
        return
    if display.rod.relaxation is None:
        return
    from curveline.driving.rod_now import rod_now
    from curveline.planning.reproof import prove_again

    listener.computing()
    rod = rod_now(display, record, time.time())
    try:
        prove_again(plan, rod.with_set)
    except Infeasible as refusal:
        set_now = f"with the set that the rod has now, up to {rod.past.largest_set:.2g} 1/m, this is not safe"
        raise Infeasible(
            f"{set_now}: {refusal.message}", "send the shape: that is planned for the rod as it is; or plan again"
        ) from None
