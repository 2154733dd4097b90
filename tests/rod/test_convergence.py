"""The discrete rod converges with the square of the edge length, and its extrapolation with the fourth power."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from curveline.rod.branches.continuation import coarse_start
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.elastica import clamped_arch, rectangular
from curveline.rod.planar.richardson import LOAD_POTENTIAL, STRAIN_ENERGY
from curveline.rod.states.equilibrium import Equilibrium
from curveline.rod.states.planar_states import find_states

from .rods import REFERENCE, Level, reference_rod, solve_level
from .test_elastica import guess_of, rod_of

EDGES = [32, 64, 128, 256]


@dataclass(frozen=True)
class Exact:
    """Positions at equal steps of the free rod and the numbers of `level_scalars`, in units of its length and EI."""

    rod: ClampedRod
    start: Callable[[int], tuple[np.ndarray, np.ndarray]]
    positions: Callable[[int], np.ndarray]
    scalars: np.ndarray


def closed(name: str) -> Exact:
    exact = clamped_arch(0.8, 1.0, 1.0) if name == "arch" else rectangular(1.0, 1.0)
    moments = exact.clamp_moment * [-1.0, 1.0]
    scalars = np.array([*-exact.clamp_force[1], *moments, exact.energy])
    return Exact(
        rod_of(exact), lambda n: guess_of(exact, n), lambda n: exact.positions(np.linspace(0.0, 1.0, n + 1)), scalars
    )


def refined(rod: ClampedRod, name: str) -> Exact:
    """The truth for a rod without a closed form: the same equations, to ten digits."""
    (state,) = (state for state in find_states(rod, 1e-10 * rod.length) if state.name == name)
    unit = rod.stiffness / rod.free_length
    scalars = np.array(
        [*-state.clamp_force[1] * rod.free_length / unit, *state.clamp_moment * [-1.0, 1.0] / unit, state.energy / unit]
    )
    return Exact(rod, lambda n: coarse_start(state, n), lambda n: free_curve(state, n), scalars)


def free_curve(state: Equilibrium, n: int) -> np.ndarray:
    """n + 1 positions of a rod without bearings, in units of its length."""
    assert state.rod.clamp == 0.0
    return state.curve(n + 1) / state.rod.length


CASES = {
    "arch": lambda: closed("arch"),
    "rectangular": lambda: closed("rectangular"),
    "asymmetric": lambda: refined(reference_rod(REFERENCE["public"][7]), "valley"),
    "heavy": lambda: refined(reference_rod(REFERENCE["gravity"][1]), "valley"),
}


def errors(exact: Exact, table: np.ndarray, scalars: np.ndarray) -> list[float]:
    """Of shape, end force, end moments and energy."""
    ours = np.array([*scalars[:4], scalars[STRAIN_ENERGY] + scalars[LOAD_POTENTIAL]])
    off = abs(ours - exact.scalars)
    n = len(table) - 1
    shape = np.max(np.linalg.norm(table[:, :2] - exact.positions(n), axis=1))
    return [float(shape), float(off[:2].max()), float(off[2:4].max()), float(off[4])]


@pytest.mark.parametrize("name", CASES)
def test_slopes_are_two_and_four(name: str) -> None:
    exact = CASES[name]()
    levels: list[Level] = [solve_level(exact.rod, n, *exact.start(n)) for n in EDGES]
    plain = [errors(exact, level.table, level.scalars) for level in levels]
    better = [
        errors(
            exact,
            coarse.table + (fine.table[::2] - coarse.table) * (4.0 / 3.0),
            coarse.scalars + (fine.scalars - coarse.scalars) * (4.0 / 3.0),
        )
        for coarse, fine in itertools.pairwise(levels)
    ]
    assert slopes(plain) == pytest.approx([2.0] * 4, abs=0.1)
    assert slopes(better) == pytest.approx([4.0] * 4, abs=0.3)


def slopes(rows: list[list[float]]) -> list[float]:
    """Fitted orders of convergence, one per column."""
    table = np.array(rows)
    assert np.all(table > 0.0)
    steps = np.log(EDGES[: len(rows)])
    return [float(-np.polyfit(steps, np.log(column), 1)[0]) for column in table.T]
