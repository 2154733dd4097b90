"""Which states a planar display can show: without crossings and further turns, stable in the plane and out of it."""

from __future__ import annotations

from typing import NamedTuple

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.model_error import lateral
from curveline.rod.states.equilibrium import Equilibrium
from curveline.rod.states.planar_states import find_states


class Showable(NamedTuple):
    """The states that a display can show, the highest first, and those `leaving` that would not stay in the plane.

    All of them have the names that they have among each other: one that leaves gives its name to no other. `outside`
    are the lowest eigenvalues out of the plane of the former [EI/L^2].
    """

    states: tuple[Equilibrium, ...] = ()
    leaving: tuple[Equilibrium, ...] = ()
    outside: tuple[float, ...] = ()

    @property
    def planar(self) -> tuple[Equilibrium, ...]:
        """All of them."""
        return (*self.states, *self.leaving)

    def called(self, name: str) -> Equilibrium | None:
        """The state of a name, if it can be shown."""
        return next((state for state in self.states if state.name == name), None)


def showable_states(rod: ClampedRod, tolerance: float) -> Showable:
    """Every state of `rod` that a display can show, refined to `tolerance` [m], named as `simulate` does."""
    found = [state for state in find_states(rod, tolerance) if state.simple]
    judged = [(state, lateral(state)) for state in found]
    return Showable(
        tuple(state for state, sideways in judged if sideways.stays),
        tuple(state for state, sideways in judged if not sideways.stays),
        tuple(sideways.eigenvalue for _, sideways in judged if sideways.stays),
    )
