"""The exact curve of a clamped rod by shooting: an answer that shares nothing with a discrete rod.

The rod as a differential equation (Antman 2005, Nonlinear Problems of Elasticity, chapter 4) in position, tangent angle
and curvature, with the force in the cross-section known but for its value at the start:

    x' = (1 + e) cos theta, y' = (1 + e) sin theta, theta' = kappa, EI kappa' = (1 + e) (p_x sin theta - p_y cos theta)

e = pull / EA, p' = the weight, with jumps where dead loads act. An integrator of eighth order carries it to the other
clamp, to twelve digits; curvature and force at the start are found such that it arrives there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.geometry.vertex_table import CURVATURE
from curveline.rod.problem import Array
from curveline.rod.states.equilibrium import Equilibrium

PRECISION = 1e-12
ARRIVED = 1e-9
"""Largest gap at the far clamp, in units of the length, with which a curve counts as exact."""


@dataclass(frozen=True)
class Exact:
    """The curve of a rod in pieces between dead loads, each a function of the arc length of the free rod."""

    rod: ClampedRod
    starts: tuple[float, ...]  # [m]
    pieces: tuple[Callable[[Array], Array], ...]

    def positions(self, places: Array) -> Array:
        """Positions (n, 2) [m] at the arc lengths `places (n,)` [m] from the left pivot; beyond a clamp it runs on."""
        rod = self.rod
        free = np.asarray(places, dtype=float) - 0.5 * rod.clamp
        within = np.clip(free, 0.0, rod.free_length)
        piece = np.searchsorted(self.starts, within, side="right") - 1
        out = np.empty((free.size, 2))
        for index, curve in enumerate(self.pieces):
            here = piece == index
            out[here] = curve(within[here])[:2].T
        beyond = (free - within)[:, None]
        angles = np.where(free < 0.0, rod.start, rod.end)
        return np.asarray(out + beyond * np.column_stack([np.cos(angles), np.sin(angles)]))


def exact(state: Equilibrium, stretching: float) -> Exact | None:
    """The exact curve next to `state` of a rod of stretching stiffness `stretching` [N]; None if shooting misses."""
    from scipy.optimize import fsolve

    rod = state.rod
    length, unit = rod.free_length, rod.stiffness / rod.free_length**2
    shot = _Shot(rod, stretching)
    force = -np.asarray(state.clamp_force[0], dtype=float)
    start = np.array([state.vertices_table[0, CURVATURE] * length, *(force / unit)])

    def miss(unknowns: Array) -> Array:
        end = shot.fly(unknowns[0] / length, unknowns[1:] * unit)
        gap = (end[:2] - rod.free_start - np.array(rod.free_chord)) / length
        return np.array([*gap, end[2] - rod.start - rod.turn])

    found, _, _, _ = fsolve(miss, start, xtol=1e-13, full_output=True)
    if not float(np.abs(miss(found)).max()) < ARRIVED:
        return None
    return Exact(rod, tuple(shot.starts), tuple(shot.pieces))


class _Shot:
    """The rod's equation from the left clamp on; keeps the pieces of the last flight."""

    def __init__(self, rod: ClampedRod, stretching: float) -> None:
        self.rod = rod
        self.stretching = stretching
        self.starts: list[float] = []
        self.pieces: list[Callable[[Array], Array]] = []

    def fly(self, curvature: float, force: Array) -> Array:
        """State at the right clamp for the `curvature` [1/m] and the cross-section's `force (2,)` [N] at the left."""
        from scipy.integrate import solve_ivp

        rod, half = self.rod, 0.5 * self.rod.clamp
        self.starts, self.pieces = [], []
        state = np.array([*rod.free_start, rod.start, curvature])
        loads = [(load.at * rod.length - half, load.x, load.y) for load in rod.loads]
        begin, (px, py) = 0.0, force
        for end, x, y in [*loads, (rod.free_length, 0.0, 0.0)]:
            flight: Any = solve_ivp(
                self._slopes,
                (begin, end),
                state,
                "DOP853",
                dense_output=True,
                args=(px, py),
                rtol=PRECISION,
                atol=1e-13,
            )
            self.starts.append(begin)
            self.pieces.append(flight.sol)
            state, begin, px, py = flight.y[:, -1], end, px - x, py - y
        return np.asarray(state)

    def _slopes(self, place: float, state: Array, px: float, py: float) -> tuple[float, float, float, float]:
        rod = self.rod
        py += rod.weight * place
        cosine, sine = math.cos(state[2]), math.sin(state[2])
        speed = 1.0 + (px * cosine + py * sine) / self.stretching
        return speed * cosine, speed * sine, state[3], speed * (px * sine - py * cosine) / rod.stiffness
