"""States that were found at one pose, by which those of the same rod at poses nearby are known without a search."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from curveline.replay.playback import known_state, name_of
from curveline.rod.branches.continuation import FOLLOW_EDGES
from curveline.rod.branches.control_path import straight_path
from curveline.rod.branches.quasi_static import State
from curveline.rod.branches.strides import led_along
from curveline.rod.branches.tracking import CLOSE, TrackedState, tracked
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.showable import Showable, showable_states
from curveline.rod.problem import Array
from curveline.rod.states.refined import CLEARLY
from curveline.rod.states.slack import is_slack
from curveline.scene import PEAK, VALLEY
from curveline.simulation.simulate import DEFAULT_TOLERANCE

SIDES = {PEAK: 1.0, VALLEY: -1.0}
"""On which side of its chord a state lies that is called so wherever no other lies on that side."""


class Landmarks:
    """The peak and the valley of a flat `rod`, as far as it has them, told again of the same rod at other poses.

    A state that is led to a pose on the straight way has the same name there if it lies clearly on its side of the
    chord, and its curve never leads back, so that it cannot cross anything. What is not told by that is searched for.
    """

    def __init__(self, rod: ClampedRod) -> None:
        self._rod = rod

    def name_of(self, rod: ClampedRod, held: State | None) -> str:
        """As `playback.name_of`: what the state in which the `rod` is held is called."""
        if isinstance(held, TrackedState):
            angles = held.angles.reshape(FOLLOW_EDGES, -1).mean(axis=1)
            for name, there in self._led_to(rod):
                if np.max(np.abs(there.angles - angles)) < CLOSE:
                    return name
        return name_of(rod, held)

    def state(self, rod: ClampedRod, name: str) -> State | None:
        """As `playback.known_state`: the state of a `rod` that is called `name`."""
        return next((there for known, there in self._led_to(rod) if known == name), None) or known_state(rod, name)

    @cached_property
    def _known(self) -> tuple[tuple[str, ...], Array, Array]:
        """Names, angles (c, n) and multipliers (c, 2) of the states; of none where others have other names."""
        shown = showable_states(self._rod, DEFAULT_TOLERANCE) if is_slack(self._rod) else Showable()
        names = tuple(state.name for state in shown.planar)
        if not set(names) <= set(SIDES):
            names = ()
        held = [tracked(state) for state in shown.states if state.name in names]
        return (
            tuple(state.name for state in shown.states if state.name in names),
            np.array([each.angles for each in held]).reshape(-1, FOLLOW_EDGES),
            np.array([each.multipliers for each in held]).reshape(-1, 2),
        )

    def _led_to(self, rod: ClampedRod) -> list[tuple[str, TrackedState]]:
        """The states of a rod nearby that have the same names there, and these."""
        names, shapes, forces = self._known
        if not names:
            return []
        # Of a rod that is alike all along nobody has counted which material is where.
        counted = self._rod.is_unevenly_curved or not rod.is_unevenly_curved
        begin = self._rod.pose if counted else self._rod.pose._replace(begin=rod.pose.begin)
        arrive, shapes, forces = led_along(straight_path(begin, rod.pose), rod.bearing, shapes, forces)
        return [
            (name, TrackedState(angles, pull))
            for name, is_there, angles, pull in zip(names, arrive, shapes, forces, strict=True)
            if is_there and _is_plainly(name, rod, angles)
        ]


def _is_plainly(name: str, rod: ClampedRod, angles: Array) -> bool:
    """True if the curve of a state lies clearly on the side of its `name`, and never leads back."""
    along, up = rod.free_chord
    if np.max(np.abs(angles)) >= 0.5 * math.pi:
        return False
    # Above the chord: its middle heights over the edges, of equal lengths, times those.
    heights = np.cumsum(along * np.sin(angles) - up * np.cos(angles)) / (FOLLOW_EDGES * math.hypot(along, up))
    return float(np.mean(heights)) * SIDES[name] > CLEARLY
