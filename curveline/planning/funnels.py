"""Where a funnel can be: a bias and a length at which only the wanted state exists, with reserves.

For a nearly straight rod of length L with an excess dL the other state ceases to exist at alpha sqrt(L / dL) = 2 if
both ends are biased by alpha (Radisson and Kanso 2023), at 1.7818 if one is (Gomez, Moulton and Vella 2017); those are
limits without weight, so the real threshold is computed. A lone segment is biased at both ends, as in the paper. In a
row a node bears two segments, so there only one end is biased, which takes three quarters of the force, and every other
segment waits for a second round.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from curveline.planning.actuator_loads import ClampLoads, actuator_load_of
from curveline.planning.glances import past
from curveline.planning.layout import middle_begin, rounded_pose
from curveline.planning.verification import LEAST_PAST_FOLD, Refused, Verifier
from curveline.rod.branches.control_path import between
from curveline.rod.problem import Pose
from curveline.scene import PEAK, STRAIGHT
from curveline.units import deg

ANGLES = tuple(deg(float(angle)) for angle in range(15, 65, 5))
RATIOS = (2.45, 2.8, 3.2)
"""alpha sqrt(L / dL) in the funnel; at sqrt(6) = 2.45 a rod biased at both ends lies in a circular arc."""

LONE = (1.0, -1.0)
IN_A_ROW = (0.0, -1.0)
"""Share of the bias that the left and the right node of a segment take to make it a peak."""


JUST_BEFORE = 0.98
NEARLY = 0.75
ROUGHLY = 0.005
"""How far a headroom may be off that was only glanced at."""

Candidate = tuple[tuple[float, float], float]
"""Biases for a peak [rad], length of the rod [m]."""


@dataclass(frozen=True)
class Funnel:
    """A funnel between level nodes: their biases for a peak [rad], length of the rod [m], the smallest reserve."""

    biases: tuple[float, float]
    length: float
    headroom: float

    def angles(self, wanted: tuple[str, ...], members: Sequence[int], before: tuple[float, ...]) -> tuple[float, ...]:
        """Angle of every node that takes the `members` of a row into their wanted states [rad]."""
        angles = list(before)
        for segment in members:
            angles[segment : segment + 2] = _tilted(self.biases, wanted[segment])
        return tuple(angles)


def rounds_of(wanted: Sequence[str]) -> tuple[tuple[int, ...], ...]:
    """Which segments go through a funnel into their `wanted` states together: never neighbours, nor straight ones."""
    curved = [segment for segment, state in enumerate(wanted) if state != STRAIGHT]
    rounds = (tuple(segment for segment in curved if segment % 2 == side) for side in range(2))
    return tuple(members for members in rounds if members)


class FunnelSearch:
    """Funnels into all `wanted` states but straight ones, the best first; each is proven when it is its turn.

    The best has most headroom. In a row, where neighbours feel the bias, too, and wait with the more rod the larger it
    is, it is the smallest bias that has nearly as much. Most candidates are only glanced at: what that shows of their
    headroom is close, and decides nothing but which of them is proven next.
    """

    def __init__(self, verifier: Verifier, wanted: tuple[str, ...]) -> None:
        self._verifier = verifier
        self._states = tuple(state for state in dict.fromkeys(wanted) if state != STRAIGHT)
        self._is_row = len(wanted) > 1
        self._candidates = candidates(verifier, len(wanted))
        self._proven: dict[int, Funnel | Refused] = {}
        self._found = self._in_order()

    def __iter__(self) -> Iterator[Funnel]:
        return self._found

    def is_empty(self) -> bool:
        """True if the limits of the display leave room for none."""
        return not self._candidates

    def is_proven(self, place: int) -> bool:
        """True if the candidate at a place was more than glanced at."""
        return place in self._proven

    def refusals(self) -> list[Refused]:
        """Why the others do not do; all are proven for that."""
        proven = (self._prove(place) for place in range(len(self._candidates)))
        return [each for each in proven if isinstance(each, Refused)]

    def _in_order(self) -> Iterator[Funnel]:
        most = [self._at_most(place) for place in range(len(self._candidates))]
        pending = set(range(len(most)))

        def first(rank: Callable[[int, float], tuple[float, ...]]) -> int | None:
            while pending:
                place = min(pending, key=lambda place: (rank(place, most[place]), place))
                if place in self._proven:
                    return place
                found = self._prove(place)
                if isinstance(found, Refused):
                    pending.discard(place)
                else:
                    most[place] = found.headroom
            return None

        best = first(lambda _, headroom: (-headroom,))
        enough = NEARLY * most[best] if best is not None and self._is_row else -math.inf

        def rank(place: int, headroom: float) -> tuple[float, ...]:
            bias = abs(self._candidates[place][0][1]) if self._is_row else 0.0
            return headroom < enough, bias, -headroom

        while (place := first(rank)) is not None:
            pending.discard(place)
            found = self._proven[place]
            assert isinstance(found, Funnel)
            yield found

    def _prove(self, place: int) -> Funnel | Refused:
        """The funnel of a candidate, or why it is none."""
        if place not in self._proven:
            biases, length = self._candidates[place]
            try:
                headroom = min(_headroom(self._verifier, state, biases, length) for state in self._states)
            except Refused as refusal:
                self._proven[place] = Refused(f"step 2 (bias): {refusal.message}", step=2)
            else:
                self._proven[place] = Funnel(biases, length, headroom)
        return self._proven[place]

    def _at_most(self, place: int) -> float:
        """What a glance says that the headroom of a candidate is at most."""
        biases, length = self._candidates[place]
        return min(_glanced(self._verifier, state, biases, length) for state in self._states) + ROUGHLY


def candidates(verifier: Verifier, segments: int) -> list[Candidate]:
    """Biases and lengths within the display's limits, for so many segments."""
    limits, span = verifier.display.limits, verifier.display.span
    left, right = IN_A_ROW if segments > 1 else LONE
    pairs = ((angle, span * (1.0 + (angle / ratio) ** 2)) for angle, ratio in itertools.product(ANGLES, RATIOS))
    return [
        ((left * angle, right * angle), length)
        for angle, length in pairs
        if limits.angle.contains(angle) and limits.angle.contains(-angle) and limits.length.contains(length)
    ]


def _tilted(biases: tuple[float, float], wanted: str) -> tuple[float, float]:
    sign = 1.0 if wanted == PEAK else -1.0
    return sign * biases[0], sign * biases[1]


def _poses(verifier: Verifier, wanted: str, biases: tuple[float, float], length: float) -> tuple[Pose, Pose]:
    """Where a funnel begins and ends."""
    start, end = _tilted(biases, wanted)
    display = verifier.display
    span, begin = display.span, middle_begin(display, length)
    return rounded_pose(span, 0.0, 0.0, 0.0, length, begin), rounded_pose(span, 0.0, start, end, length, begin)


def _headroom(verifier: Verifier, wanted: str, biases: tuple[float, float], length: float) -> float:
    """The smaller of what motors and rod have left and what the bias goes past the fold; Refused if not enough."""
    level, biased = _poses(verifier, wanted, biases, length)
    margin = verifier.past_fold(biased, wanted)
    if margin < LEAST_PAST_FOLD:
        raise Refused(f"the other state ceases to exist only {100 * margin:.0f} % before the end of the bias")
    # The most is asked for where the other state is about to go.
    clamp_loads = verifier.weigh(level).joined(verifier.weigh(biased))
    just_before = between(level, biased, JUST_BEFORE / (1.0 + margin))
    clamp_loads = clamp_loads.joined(verifier.weigh_on_the_way(level, just_before))
    return min(1.0 - _share(verifier, biases, clamp_loads), margin)


def _glanced(verifier: Verifier, wanted: str, biases: tuple[float, float], length: float) -> float:
    """The headroom, of the states that were followed to the bias roughly; there may be others."""
    gone, clamp_loads = verifier.glance(*_poses(verifier, wanted, biases, length), JUST_BEFORE)
    return min(1.0 - _share(verifier, biases, clamp_loads), past(gone))


def _share(verifier: Verifier, biases: tuple[float, float], clamp_loads: ClampLoads) -> float:
    """What a funnel asks of rod and motors as a share of what they give; in a row a node bears two segments."""
    segment_loads = (clamp_loads, clamp_loads) if 0.0 in biases else (clamp_loads,)
    return actuator_load_of(segment_loads).share(verifier.display)
