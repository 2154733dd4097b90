"""The bordered system of a spatial rod against differences of its energy and dense matrices; shapes rolled on."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from curveline.rod.problem import Array
from curveline.rod.spatial.bordered import advance, balance, lagrangian
from curveline.rod.spatial.descent import factored, newton_step, room_for
from curveline.rod.spatial.energy import Shape, SpatialRod, assemble
from curveline.rod.spatial.reaction import clamp_forces, passed_on, turns_of
from curveline.rod.spatial.relax import RelaxEnding, descend, is_stable, largest_turn
from curveline.rod.spatial.rolling import roll_on
from curveline.rod.spatial.stability import lowest_eigenvalue
from curveline.rod.spatial.twisting import spun

from .spatial_rods import arch, random_rod, turned

SEEDS = (1, 2, 3)
BEARINGS = {
    "rigid": (0.0, 0.0, 0.0),
    "soft": (0.05, 0.0, 0.1),
    "in line": (0.3, 0.0, 0.0),
    "loose": (0.05, 0.1, 0.1),
    "within its play": (0.05, 2.0, 0.1),
    "against its stop": (0.0, 0.05, 0.1),
}
"""Give, play and reach."""
REACTION = np.array([30.0, -20.0, 50.0])


def system_of(rod: SpatialRod, shape: Shape, reaction: Array) -> tuple[Any, Any, Array, Array]:
    """The bordered system, room for its factor, the gap and what the border gives."""
    system, factor = room_for(rod.edges.size)
    forces, gap, give = np.empty((rod.edges.size, 3)), np.empty(3), np.empty((3, 3))
    passed_on(rod, reaction, forces)
    balance(rod, shape.frames, turns_of(rod, shape), forces, system, gap, give)
    return system, factor, gap, give


def whole_of(system: Any, give: Array) -> Array:
    """The dense matrix (3n+3, 3n+3) of a bordered system."""
    own, beside, right = system
    n = len(own)
    out = np.zeros((3 * n + 3, 3 * n + 3))
    for j in range(n):
        rows = slice(3 * j, 3 * j + 3)
        out[rows, rows] = own[j]
        if j > 0:
            out[rows, 3 * j - 3 : 3 * j] = beside[j]
            out[3 * j - 3 : 3 * j, rows] = beside[j].T
        out[rows, 3 * n :] = right[j, :, 1:]
        out[3 * n :, rows] = right[j, :, 1:].T
    out[3 * n :, 3 * n :] = give
    return out


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("bearings", BEARINGS)
def test_slopes_and_curvatures_are_those_of_the_lagrangian(seed: int, bearings: str) -> None:
    rod, shape = random_rod(seed)
    rod = rod._replace(bearings=BEARINGS[bearings])
    turns, n = turns_of(rod, shape), rod.edges.size
    system, _, gap, give = system_of(rod, shape, REACTION)
    slope = np.append(-system[2][:, :, 0].ravel(), gap)
    whole, rng = whole_of(system, give), np.random.default_rng(seed)

    def value(step: Array, size: float) -> float:
        frames, after = np.empty((n, 4)), np.empty((n + 1, 4))
        advance(rod, shape.frames, turns, step[:-3].reshape(n, 3), size, frames, after)
        return float(lagrangian(rod, frames, after, REACTION + size * step[-3:], 0.0))

    for k in range(3 * n + 3 + 20):
        step = rng.normal(0.0, 0.3, 3 * n + 3) if k >= slope.size else np.eye(slope.size)[k]
        ahead, here, behind = (value(step, size) for size in (1e-3, 0.0, -1e-3))
        far, back = value(step, 2e-3), value(step, -2e-3)
        first = (8.0 * (ahead - behind) - (far - back)) / 12e-3
        second = (16.0 * (ahead + behind) - (far + back) - 30.0 * here) / 12e-6
        size = np.max(np.abs(slope))
        assert first == pytest.approx(slope @ step, rel=1e-6, abs=1e-6 * size)
        assert second == pytest.approx(step @ whole @ step, rel=1e-5, abs=1e-5 * np.max(np.abs(whole)))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("shift", [0.0, 30.0, 3e4])
def test_a_newton_step_is_that_of_the_dense_matrix_and_so_is_the_inertia(seed: int, shift: float) -> None:
    rod, shape = random_rod(seed, 9)
    system, factor, gap, give = system_of(rod, shape, REACTION)
    n, complement = rod.edges.size, np.empty((3, 4))
    whole = whole_of(system, give)
    whole[np.arange(3 * n), np.arange(3 * n)] += shift * np.repeat(rod.edges, 3)
    is_definite = factored(rod, system, shift, factor, give, complement)
    assert is_definite == (np.sum(np.linalg.eigvalsh(whole) < 0.0) == 3)
    step, change = np.empty((n, 3)), np.empty(3)
    newton_step(rod, factor, complement, 1e-3 * gap, step, change)
    expected = np.linalg.solve(whole, np.append(system[2][:, :, 0].ravel(), -1e-3 * gap))
    assert np.append(step.ravel(), change) == pytest.approx(expected, rel=1e-8, abs=1e-9 * np.max(np.abs(expected)))


@pytest.mark.parametrize("held", [1.0, 0.0])
def test_forces_of_the_clamps_are_the_slopes_of_the_energy(held: float) -> None:
    rod, start = arch(40, 0.6, 0.85)
    rod.forces[10:] = [0.1, -0.3, 0.2]
    rod = rod._replace(held=np.array([1.0, held, held]))
    shape = descend(rod, start).shape
    gradient, _ = assemble(rod, shape)
    expected = np.array([gradient[:3], gradient[-3:]])
    assert np.max(np.abs(expected)) > 1.0
    assert clamp_forces(rod, shape) == pytest.approx(expected, abs=1e-8 * np.max(np.abs(expected)))


def rested(stiffness: tuple[float, ...] = (17.0, 1.0, 0.9, 1e6)) -> tuple[SpatialRod, Shape]:
    rod, start = arch(32, 0.3, 0.85, stiffness)
    relaxed = descend(rod, start)
    assert relaxed.ending is RelaxEnding.SETTLED
    return rod, relaxed.shape


@pytest.mark.parametrize("bearings", ["rigid", "soft", "loose"])
@pytest.mark.parametrize("angle", [0.4, -1.5, 3.0])
def test_a_shape_that_is_rolled_on_is_at_rest_where_small_steps_lead_it(angle: float, bearings: str) -> None:
    rod, shape = rested()
    rod = rod._replace(bearings=BEARINGS[bearings])
    shape = descend(rod, shape).shape
    ahead, done, work = roll_on(rod, shape, angle)
    assert done == angle
    assert work < 30 * abs(angle) + 10
    small = shape
    for share in np.linspace(0.0, 1.0, 41)[1:]:
        there = rod._replace(frames=np.array([rod.frames[0], spun(rod.frames[1], share * angle)]))
        small = descend(there, small).shape
    assert largest_turn(ahead, small) < 1e-5
    assert descend(there, ahead).iterations <= 2
    assert roll_on(there, ahead, -angle)[0].frames == pytest.approx(shape.frames, abs=1e-5)


def test_where_a_fold_is_at_hand_the_shape_before_it_is_given() -> None:
    rod, shape = rested((17.0, 1.0, 0.9, 1e6))
    ahead, done, _ = roll_on(rod, shape, 40.0)
    assert 1.0 < done < 40.0
    there = rod._replace(frames=np.array([rod.frames[0], spun(rod.frames[1], done)]))
    assert is_stable(there, ahead)
    # The lowest eigenvalue goes to zero as the root of what is left to the fold.
    assert lowest_eigenvalue(there, ahead) < 0.3 * lowest_eigenvalue(rod, shape)
    assert descend(there, ahead).iterations <= 4


def test_a_shape_that_is_not_stable_is_not_followed() -> None:
    rod, shape = rested()
    kinked = Shape(
        shape.strain, np.array([turned(q, np.array([0.0, 0.3 * (-1) ** j, 0.0])) for j, q in enumerate(shape.frames)])
    )
    assert roll_on(rod, kinked, 1.0)[1] == 0.0
