"""Where a funnel can be: a bias and a length at which only the wanted state exists, with reserves.

For a nearly straight rod of length L with an excess dL the other state ceases to exist at alpha sqrt(L / dL) = 2 if
both ends are biased by alpha (Radisson and Kanso 2023), at 1.7818 if one is (Gomez, Moulton and Vella 2017); those are
limits without weight, so the real threshold is computed. A lone segment is biased at both ends, as in the paper. In a
row a node bears two segments, so there only one end is biased, which takes three quarters of the force, and every other
segment waits for a second round.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

from curveline.planning.actuator_loads import actuator_load_of
from curveline.planning.verification import LEAST_PAST_FOLD, Refused, Verifier
from curveline.rod.branches.control_path import between
from curveline.rod.problem import Pose
from curveline.scene import PEAK
from curveline.units import deg

ANGLES = tuple(deg(float(angle)) for angle in range(15, 65, 5))
RATIOS = (2.45, 2.8, 3.2)
"""alpha sqrt(L / dL) in the funnel; at sqrt(6) = 2.45 a rod biased at both ends lies in a circular arc."""

LONE = (1.0, -1.0)
IN_A_ROW = (0.0, -1.0)
"""Share of the bias that the left and the right node of a segment take to make it a peak."""


JUST_BEFORE = 0.98
NEARLY = 0.75


@dataclass(frozen=True)
class Funnel:
    """A funnel between level nodes: their biases for a peak [rad], length of the rod [m], the smallest reserve."""

    biases: tuple[float, float]
    length: float
    headroom: float

    def angles(self, wanted: tuple[str, ...], members: range, before: tuple[float, ...]) -> tuple[float, ...]:
        """Angle of every node that takes the `members` of a row into their wanted states [rad]."""
        angles = list(before)
        for segment in members:
            angles[segment : segment + 2] = _tilted(self.biases, wanted[segment])
        return tuple(angles)


def rounds_of(count: int) -> tuple[range, ...]:
    """Which of `count` segments go through a funnel together: neighbours never do."""
    return tuple(members for members in (range(0, count, 2), range(1, count, 2)) if members)


def funnels_for(verifier: Verifier, wanted: tuple[str, ...], refusals: list[Refused]) -> list[Funnel]:
    """Funnels into all `wanted` states, the best first; why others do not do goes to `refusals`.

    The best has most headroom. In a row, where neighbours feel the bias, too, and wait with the more rod the larger it
    is, it is the smallest bias that has nearly as much.
    """
    shares = LONE if len(wanted) == 1 else IN_A_ROW
    funnels = []
    for biases, length in _candidates(verifier, shares):
        try:
            headroom = min(_headroom(verifier, state, biases, length) for state in set(wanted))
        except Refused as refusal:
            refusals.append(Refused(f"step 2 (bias): {refusal.message}", step=2))
        else:
            funnels.append(Funnel(biases, length, headroom))
    funnels.sort(key=lambda funnel: -funnel.headroom)
    if len(wanted) > 1:
        enough = NEARLY * funnels[0].headroom if funnels else 0.0
        funnels.sort(key=lambda funnel: (funnel.headroom < enough, abs(funnel.biases[1]), -funnel.headroom))
    return funnels


def _candidates(verifier: Verifier, shares: tuple[float, float]) -> Iterator[tuple[tuple[float, float], float]]:
    """Biases and lengths within the display's limits."""
    limits, span = verifier.display.limits, verifier.display.span
    for angle, ratio in itertools.product(ANGLES, RATIOS):
        length = span * (1.0 + (angle / ratio) ** 2)
        if limits.angle.contains(angle) and limits.angle.contains(-angle) and limits.length.contains(length):
            yield (shares[0] * angle, shares[1] * angle), length


def _tilted(biases: tuple[float, float], wanted: str) -> tuple[float, float]:
    sign = 1.0 if wanted == PEAK else -1.0
    return sign * biases[0], sign * biases[1]


def _headroom(verifier: Verifier, wanted: str, biases: tuple[float, float], length: float) -> float:
    """The smaller of what motors and rod have left and what the bias goes past the fold; Refused if not enough."""
    level = Pose(verifier.display.span, 0.0, 0.0, 0.0, length)
    start, end = _tilted(biases, wanted)
    biased = level._replace(start=start, end=end)
    margin = verifier.past_fold(biased, wanted)
    if margin < LEAST_PAST_FOLD:
        raise Refused(f"the other state ceases to exist only {100 * margin:.0f} % before the end of the bias")
    # The most is asked for where the other state is about to go.
    clamp_loads = verifier.weigh(level).joined(verifier.weigh(biased))
    just_before = between(level, biased, JUST_BEFORE / (1.0 + margin))
    clamp_loads = clamp_loads.joined(verifier.weigh_on_the_way(level, just_before))
    # In a row the node between two segments bears both.
    segment_loads = (clamp_loads, clamp_loads) if 0.0 in biases else (clamp_loads,)
    return min(1.0 - actuator_load_of(segment_loads).share(verifier.display), margin)
