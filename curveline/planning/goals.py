"""Whether a shape can be shown at all, before any way to it is sought."""

from __future__ import annotations

import numpy as np

from curveline.errors import Infeasible, InvalidInput
from curveline.planning.demand import overload
from curveline.planning.layout import Box, describe, layout_of, pose_of
from curveline.planning.proof import Prover, Refused
from curveline.rod.continuation import follow, start_along
from curveline.rod.equilibrium import Equilibrium
from curveline.rod.way import loading
from curveline.scene import Scene


def check_home(scene: Scene) -> None:
    """Raise InvalidInput for what no motor of a node can do, Infeasible where plans have nowhere to begin."""
    display = scene.display
    if scene.beyond_the_plane:
        raise InvalidInput(
            f"{scene.name}: no plan is possible with {' and '.join(scene.beyond_the_plane)}: "
            "the motors of a node work in the plane of an upright display",
            "`curveline simulate` shows where the rod goes; take this out to plan the shape",
        )
    if not (display.limits.height.contains(0.0) and display.limits.angle.contains(0.0)):
        raise Infeasible(
            f"display {display.name}: its limits leave out height 0 or angle 0, through which every plan passes",
            "count heights from where the nodes stand level, and angles from where the rod is horizontal",
        )


def check_goal(prover: Prover, scene: Scene) -> None:
    """Raise Refused unless every wanted state exists, is stable with a margin and asks no more than there is."""
    layout = layout_of(scene)
    demands = []
    for number, segment in enumerate(scene.segments, start=1):
        pose = pose_of(scene.display, layout, number - 1)
        states = prover.states(pose)
        wanted = next((state for state in states if state.name == segment.state), None)
        if wanted is None:
            others = " and ".join(state.name for state in states) or "none that was found and a display can show"
            text = f"segment {number} has no stable {segment.state} at {describe(pose)}; it has: {others}"
            raise Refused(text, number)
        _check_loads(prover, scene, number, wanted)
        try:
            demands.append(prover.keep(pose, pose, Box(pose, pose), prover.hold_of(wanted)).demand)
        except Refused as refusal:
            raise Refused(f"segment {number}, the {segment.state} itself: {refusal.message}", number) from None
    reason = overload(scene.display, tuple(demands))
    if reason:
        raise Refused(f"the shape itself: {reason}")


def _check_loads(prover: Prover, scene: Scene, number: int, state: Equilibrium) -> None:
    """Raise Refused unless a wanted state stays what it is when the loads of its segment are put on."""
    loads = sorted((load.at, *load.force) for load in scene.loads if load.segment == number - 1)
    if not loads:
        return
    table = np.array(loads)
    way = loading(state.rod.pose, table[:, 0].copy(), np.zeros((len(loads), 2)), table[:, 1:].copy())
    branch = follow(way, prover.bearing, *start_along(way, state))
    if branch.reached < 1.0:
        share = 100.0 * branch.reached
        text = f"segment {number}: the {state.name} does not withstand the loads: it snaps at {share:.0f} % of them"
        raise Refused(text, number)
