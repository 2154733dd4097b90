"""What becomes of the rod between level nodes as they are biased, roughly and soon: which funnels are worth a proof.

States are followed from one length to the next and into the bias; none is searched for.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from curveline.planning.actuator_loads import ClampLoads
from curveline.rod.branches.continuation import coarse_start, travel
from curveline.rod.branches.control_path import straight_path
from curveline.rod.branches.rough_ends import rough_end
from curveline.rod.problem import Array, Bearing, Pose
from curveline.rod.states.equilibrium import Equilibrium

Held = tuple[Array, Array]
"""Angles (n,) [rad] and multipliers (2,) of a state."""


class Glance(NamedTuple):
    """The fraction of a bias at which the last state that it ends is `gone`, 0 if it ends none; what the rod asks."""

    gone: float
    clamp_loads: ClampLoads


def past(gone: float) -> float:
    """By how much, as a fraction, a bias exceeds the one at which a state is `gone`, a fraction of it; 1 for none."""
    return 1.0 / gone - 1.0 if gone > 0.0 else 1.0


class Glances:
    """Remembers what was glanced at, of a rod with a `bearing` whose `states` at a pose can be found."""

    def __init__(self, bearing: Bearing, states: Callable[[Pose], Sequence[Equilibrium]]) -> None:
        self._bearing = bearing
        self._states = states
        self._level: dict[Pose, list[Held]] = {}
        self._seen: dict[tuple[Pose, Pose], Glance] = {}

    def glance(self, level: Pose, biased: Pose, share: float) -> Glance:
        """What becomes of the states at `level` on the way to `biased`; what one asks that is lost, at `share` of its
        way."""
        if (level, biased) not in self._seen:
            gone, clamp_loads = 0.0, ClampLoads()
            for held in self._held_at(level):
                reached, rows = rough_end(straight_path(level, biased), self._bearing, *held, share)
                clamp_loads = clamp_loads.joined(
                    ClampLoads(rows[:, 1:].min(axis=0), rows[:, 1:].max(axis=0), float(rows[:, 0].max()))
                )
                gone = max(gone, reached) if reached < 1.0 else gone
            self._seen[level, biased] = Glance(gone, clamp_loads)
        return self._seen[level, biased]

    def _held_at(self, level: Pose) -> list[Held]:
        """The states between level nodes, followed from the nearest length at which they are known."""
        if level not in self._level:
            if self._level:
                nearest = min(self._level, key=lambda pose: abs(pose.length - level.length))
                way = straight_path(nearest, level)
                ends = [travel(way, self._bearing, *held) for held in self._level[nearest]]
                held = [(angles, forces) for reached, angles, forces, _ in ends if reached == 1.0]
            else:
                held = [coarse_start(state) for state in self._states(level)]
            self._level[level] = held
        return self._level[level]
