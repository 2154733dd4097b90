"""Proven moves as a plan: in mm, degrees, seconds and encoder counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from curveline._version import __version__
from curveline.plan_file import Plan, Step, sealed
from curveline.planning.layout import Layout, lengths_of, pose_of
from curveline.planning.moves import DisplayState, PlannedMove
from curveline.planning.sequence import HOME
from curveline.planning.targets import seconds_between, targets_of
from curveline.planning.verification import Verifier
from curveline.scene import Display, Scene
from curveline.units import to_mm, to_nmm


@dataclass(frozen=True)
class Trip:
    """What a plan is for: the shapes it goes through, the display, the states it ends in, and whether that is home."""

    scenes: tuple[Scene, ...]
    display: Display
    wanted: tuple[str, ...]
    ends_home: bool = False

    @property
    def name(self) -> str:
        """The names of all shapes, and of home if it ends there."""
        names = [scene.name for scene in self.scenes]
        return ", ".join([*names, HOME] if self.ends_home else names)


def plan_of(verifier: Verifier, begin: DisplayState, moves: Sequence[PlannedMove], trip: Trip) -> Plan:
    """Put proven moves from `begin` on in numbers for the motors, and seal them."""
    display, before = verifier.display, begin.layout
    shows = tuple(
        "" if hold is None else verifier.name_of(pose_of(display, begin.layout, segment), hold)
        for segment, hold in enumerate(begin.holds)
    )
    steps: list[Step] = []
    for number, move in enumerate(moves, start=1):
        steps.append(_step(verifier, number, before, move))
        before = move.end
    return sealed(
        Plan(
            name=trip.name,
            drive=verifier.drive,
            start=targets_of(verifier.drive, begin.layout),
            steps=tuple(steps),
            wanted=trip.wanted,
            lengths_mm=tuple(map(to_mm, lengths_of(display, before))),
            shows=shows if any(shows) else (),
            provenance=_provenance(trip),
        )
    )


def _step(verifier: Verifier, number: int, before: Layout, move: PlannedMove) -> Step:
    """One step in the units of the plan file."""
    display, load = verifier.display, move.load
    return Step(
        number=number,
        action=move.action,
        seconds=seconds_between(verifier.drive, before, move.end),
        targets=targets_of(verifier.drive, move.end),
        lengths_mm=tuple(map(to_mm, lengths_of(display, move.end))),
        states=move.states,
        lowest_eigenvalue=move.lowest_eigenvalue,
        margin=move.margin,
        margin_of=move.margin_of,
        max_strain=display.rod.surface_strain(load.curvature),
        max_force_N=load.force,
        max_moment_Nmm=to_nmm(load.moment),
        corners=move.corners,
        shape=move.shape,
    )


def _provenance(trip: Trip) -> dict[str, str]:
    """Where the plan comes from."""
    display = trip.display
    return {
        "curveline": __version__,
        "shape": ", ".join(scene.path for scene in trip.scenes),
        "shape_sha256": ", ".join(scene.digest for scene in trip.scenes),
        "display": display.path or display.name,
        "display_sha256": display.digest,
    }
