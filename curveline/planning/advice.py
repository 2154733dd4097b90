"""Of a shape that cannot be planned, the single number that is at fault, and its nearest value that would work.

    found = nearest(scene, culprits, works)
    found.sentence          # angle of node 2 is at fault: with -48.3 deg instead of -60 deg it works

The search has two sieves. The coarse one asks of hundreds of values only whether the wanted states exist, with their
margins, within what rod and motors give; the fine one is the caller's and may cost a whole plan, so that few see it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from curveline.errors import Infeasible
from curveline.planning.feasibility import check_goal
from curveline.planning.verification import Verifier
from curveline.scene import STRAIGHT, Scene
from curveline.simulation.changes import (
    ANGLE,
    HEIGHT,
    LENGTH,
    Change,
    Counted,
    Hunt,
    Quantity,
    Ray,
    double_rays,
    part_of,
    single_rays,
)
from curveline.simulation.simulate import scene_rod
from curveline.units import mm, to_mm

Reason = Callable[[Scene], str]
"""Why a scene does not work; empty if it does."""

BEYOND = 1.0 / 32.0
"""The first change that is tried where nothing is wrong with the shape itself, only with the way to it."""
TRIES = 6
DIGITS = 2
"""Of a length in mm that is straight."""
LOOKS = 500
"""Values that the coarse sieve sees of one quantity, and as many of two at once: together a second, mostly."""


@dataclass(frozen=True)
class Advice:
    """What to change: one quantity, or two where no single one helps; `reason` says what is wrong without it."""

    changes: tuple[Change, ...]
    reason: str

    @property
    def sentence(self) -> str:
        """The advice in words."""
        if len(self.changes) == 1:
            (change,) = self.changes
            return f"{change.quantity} is at fault: with {change} it works"
        both = " and ".join(f"{change.quantity} of {change}" for change in self.changes)
        return f"no single number is at fault: with {both} it works"


def nearest(scene: Scene, culprits: range, works: Reason, tries: int = TRIES) -> Advice | None:
    """The smallest change to `scene`, refused for the segments `culprits` (from 0), that makes it work.

    Small in relation to what the display's limits allow; in one quantity that these segments have a part in, in two at
    once only where no single one helps; None where neither does. What is advised has been tried: `works`, which may
    cost a plan, sees at most so many scenes.
    """
    coarse, fine = _Sieve(scene, culprits), Counted(lambda tried: not works(tried), tries)
    reason = coarse.reason(scene)
    if (straight := _straightened(scene, culprits)) is not None:
        changed = straight.quantity.put(scene, straight.nearest)
        if coarse.passes(changed) and fine(changed):
            return Advice((straight,), reason)
    begin = 0.0 if reason else BEYOND
    for rays in (single_rays, double_rays):
        hunt = Hunt(rays(scene, _quantities(culprits)), Counted(coarse.passes, LOOKS), begin)
        found = _first(hunt, fine, 0.0 if not reason else None)
        if found is not None:
            ray, change = found
            return Advice(ray.changes(change), reason)
    return None


def _quantities(segments: range) -> tuple[Quantity, ...]:
    nodes = range(segments.start, segments.stop + 1)
    lengths = [Quantity(LENGTH, segment) for segment in segments]
    return (*lengths, *(Quantity(kind, node) for kind in (ANGLE, HEIGHT) for node in nodes))


def _straightened(scene: Scene, culprits: range) -> Change | None:
    """The length of the one segment at fault with which it leads straight from node to node, if it is to be straight.

    What may be straight is less than half a millimetre, which a search would step over.
    """
    if len(culprits) != 1 or scene.segments[culprits.start].state != STRAIGHT:
        return None
    rod, length = scene_rod(scene, culprits.start), Quantity(LENGTH, culprits.start)
    line = mm(round(to_mm(math.hypot(*rod.free_chord) + rod.clamp), DIGITS))
    limits = length.limits(scene.display)
    return Change(length, rod.length, min(max(line, limits.low), limits.high))


def _first(hunt: Hunt, fine: Counted, refused: float | None) -> tuple[Ray, float] | None:
    """The ray with the smallest change that passes both sieves, and the change; None if none was found.

    `refused` is a change that the fine sieve is known not to let pass, if there is any: where the scene itself passes
    the coarse one, only the fine one tells how far to go. So it does where it has refused a smaller change of a ray.
    """
    last: dict[Ray, float] = {}
    while fine.tries > 0 and (found := hunt.next()) is not None:
        ray, change = found
        if fine(ray.at(change)):
            low = last.get(ray, refused)
            return ray, change if low is None else ray.closest(fine, low, change)
        last[ray] = change
    return None


class _Sieve:
    """Whether the wanted states of some segments and their neighbours exist, within what rod and motors give.

    Of two neighbours on either side: a change reaches the first, whose far node bears the second, too.
    """

    def __init__(self, scene: Scene, culprits: range) -> None:
        self._prover = Verifier(scene.display, lambda: None)
        self._segments = range(culprits.start - 2, culprits.stop + 2)

    def passes(self, scene: Scene) -> bool:
        """True if nothing is wrong."""
        return not self.reason(scene)

    def reason(self, scene: Scene) -> str:
        """What is wrong; empty if nothing."""
        try:
            check_goal(self._prover, part_of(scene, self._segments))
        except Infeasible as refusal:
            return refusal.message
        return ""
