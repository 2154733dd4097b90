"""Rods in space at the extremes: twisted past instability, hardly or very stretchable, of few or many vertices."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
import pytest

from clamped_rods import Stock, changed, made_of, rod_between
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.spatial.energy import Shape, SpatialRod, energy, moved, positions
from curveline.rod.spatial.lifting import frame, lift
from curveline.rod.spatial.relax import Relaxed, RelaxEnding, descend, lowest_mode, newton
from curveline.rod.spatial.richardson import refine_in_space
from curveline.rod.states.equilibrium import Equilibrium, Outcome, refine
from curveline.rod.states.planar_states import find_states

from .verify_space import check_in_space

GREENHILL = 8.986818916
"""Torque M L / EI at which a straight rod between clamps writhes without tension: references, D."""
MICHELL = 2.0 * math.pi * math.sqrt(3.0)
"""Twist times GJ / EI at which a ring does: references, D."""
GJ = 0.8
HANG = 2.0

STIFFNESS = 0.028224
ROUND = Stock(1e5, 2.4e-3, 0.98e-3, 0.0, lateral_stiffness=STIFFNESS, twisting_stiffness=GJ * STIFFNESS)
STRIP = Stock(58_800.0, 2.4e-3, 2.97e-3, 0.0, lateral_stiffness=0.49, twisting_stiffness=0.0354887)


def twisted(turns: np.ndarray, angles: np.ndarray, chord: float) -> tuple[SpatialRod, Shape]:
    """A rod whose edges have `angles` in the plane and are turned by `turns` about themselves, clamp to clamp."""
    n = turns.size - 2
    rod = SpatialRod(
        edges=np.full(n, 1.0 / n),
        stiffness=np.array([1.0, 1.0, GJ, 1e7]),
        natural=np.zeros((n + 1, 3)),
        forces=np.zeros((n + 1, 3)),
        chord=np.array([chord, 0.0, 0.0]),
        frames=np.array([frame(angles[0], 0.0, turns[0]), frame(angles[-1], 0.0, turns[-1])]),
        held=np.ones(3),
    )
    inner = [frame(angle, 0.0, turn) for angle, turn in zip(angles[1:-1], turns[1:-1], strict=True)]
    return rod, Shape(np.zeros(n), np.array(inner))


def places(n: int) -> np.ndarray:
    """Where the clamps and the middles of n edges lie."""
    return np.concatenate([[0.0], (np.arange(n) + 0.5) / n, [1.0]])


def straight(torque: float, n: int = 120) -> tuple[SpatialRod, Shape]:
    return twisted(torque / GJ * places(n), np.zeros(n + 2), 1.0)


def ring(twist: float, n: int = 120) -> tuple[SpatialRod, Shape]:
    return twisted(twist * places(n), 2.0 * math.pi * places(n), 0.0)


def sound(rod: SpatialRod, relaxed: Relaxed) -> None:
    """What holds of any relaxation: no NaN, ends met, and stable if it is said to be settled."""
    assert np.all(np.isfinite(relaxed.shape.frames))
    assert np.all(np.isfinite(relaxed.shape.strain))
    if relaxed.ending is RelaxEnding.SETTLED:
        assert lowest_mode(rod, relaxed.shape)[0] > -1e-6
        np.testing.assert_allclose(positions(rod, relaxed.shape)[-1], rod.chord, atol=1e-8)
    else:
        assert "scene" in relaxed.ending.value


@pytest.fixture(scope="module", autouse=True)
def compiled() -> None:
    for state in find_states(ARCH, 1e-5):
        refine_in_space(made_of(ROUND, ARCH, roll=(0.0, 0.1)), state, 1e-5)


def timed(rod: SpatialRod, shape: Shape) -> Relaxed:
    begin = time.process_time()
    relaxed = descend(rod, shape)
    assert time.process_time() - begin < HANG
    return relaxed


@pytest.mark.parametrize(("share", "stable"), [(0.1, True), (0.99, True), (1.01, False), (1.5, False)])
@pytest.mark.parametrize(("make", "critical"), [(straight, GREENHILL), (ring, MICHELL / GJ)], ids=["rod", "ring"])
def test_twist_up_to_and_past_its_instability(make, critical: float, share: float, stable: bool) -> None:  # type: ignore[no-untyped-def]
    rod, start = make(share * critical)
    here = newton(rod, start)
    assert here.ending is RelaxEnding.SETTLED
    value, mode = lowest_mode(rod, here.shape)
    # A ring of a round section may spin about its clamp's tangent for nothing: rounding decides on that mode's sign.
    assert (value > -1e-6) == stable
    # Pushed along its weakest mode, a stable rod comes back and an unstable one finds a lower, stable state.
    _, turn = moved(rod, here.shape, mode, 1.0)
    pushed, _ = moved(rod, here.shape, mode, 0.02 / turn)
    after = timed(rod, pushed)
    sound(rod, after)
    gained = energy(rod, here.shape) - energy(rod, after.shape)
    if stable:
        assert abs(gained) < 1e-6 * energy(rod, here.shape)
    else:
        assert gained > 0.0


@pytest.mark.parametrize("share", [2.0, 4.0, 10.0])
def test_twist_far_past_its_instability_ends_in_a_state_or_a_sentence(share: float) -> None:
    rod, shape = straight(share * GREENHILL)
    _, mode = lowest_mode(rod, shape)
    _, turn = moved(rod, shape, mode, 1.0)
    sound(rod, timed(rod, moved(rod, shape, mode, 0.02 / turn)[0]))


def in_space(segment: ClampedRod, tolerance: float = 1e-5) -> list[Equilibrium]:
    """The states in space that the planar ones lead to; each a verified one, or with a sentence that says why not."""
    states = []
    for state in find_states(segment, tolerance):
        begin = time.process_time()
        found = refine_in_space(segment, state, tolerance)
        assert time.process_time() - begin < HANG
        states.append(found)
        if found.outcome in (Outcome.CONVERGED, Outcome.COARSE):
            assert found.stable
            true = check_in_space(found, segment)
            assert true.conjugate == 0
            assert true.error <= found.error + 1e-9
        else:
            assert not found.stable
            assert len(found.outcome.value) > 20
    return states


ARCH = rod_between((0.5, 0.0), 0.2, -0.2, 0.56, 0.02, STIFFNESS, 0.0)


@pytest.mark.parametrize("turn_deg", [0.0, 90.0, 180.0, 360.0, 540.0])
def test_an_arch_whose_end_is_rolled(turn_deg: float) -> None:
    segment = made_of(ROUND, ARCH, roll=(0.0, math.radians(turn_deg)))
    states = in_space(segment)
    assert states
    if turn_deg <= 90.0:
        assert any(state.outcome is Outcome.CONVERGED for state in states)


@pytest.mark.parametrize("ratio", [1e2, 1e3, 1e4, 1e6, 1e8, 1e10])
def test_stretch_to_bend_ratios(ratio: float) -> None:
    stretching = ratio * STIFFNESS / ARCH.free_length**2
    segment = made_of(replace(STRIP, stretching_stiffness=stretching), ARCH, loads=((0.4, 0.0, 0.0, 0.05),))
    states = in_space(segment, 1e-4)
    assert len(states) == 2
    if ratio >= 1e4:
        assert all(state.outcome is Outcome.CONVERGED for state in states)


@pytest.mark.parametrize("ratio", [1e2, 1e3, 1e4, 1e6, 1e8, 1e10])
def test_stretch_to_bend_ratios_in_the_plane(ratio: float) -> None:
    rod = changed(ARCH, stretching=ratio * STIFFNESS / ARCH.free_length**2)
    for state in find_states(ARCH, 1e-6):
        stretched = refine(rod, np.full(48, 1.0 / 48), *state.start_on(np.full(48, 1.0 / 48)), 1e-6)
        assert stretched.stable == (stretched.outcome is Outcome.CONVERGED)
        assert len(stretched.outcome.value) > 20
        assert not np.any(np.isnan(stretched.vertices_table))
        if ratio >= 1e8:
            assert stretched.outcome is Outcome.CONVERGED
            assert np.max(np.abs(stretched.curve(101) - state.curve(101))) < 1e-5


@pytest.mark.parametrize("n", [3, 10, 100, 1000, 10_000])
def test_few_and_many_vertices(n: int) -> None:
    segment = made_of(STRIP, ARCH)
    stretching = changed(ARCH, stretching=STRIP.stretching_stiffness)
    edges = np.full(48, 1.0 / 48)
    state = refine(stretching, edges, *find_states(ARCH, 1e-6)[0].start_on(edges), 1e-7)
    rod, shape = lift(segment, state, n)
    relaxed = timed(rod, shape)
    sound(rod, relaxed)
    assert relaxed.ending is RelaxEnding.SETTLED
    # The work per vertex does not grow with their number.
    assert relaxed.iterations <= 12
    if n >= 100:
        ends = positions(rod, relaxed.shape)[:: n // 10, :2] * ARCH.free_length + ARCH.free_start
        at = 0.01 + np.linspace(0.0, ARCH.free_length, ends.shape[0])
        fine = state.curve(2801)
        ours = [np.interp(at, np.linspace(0.0, ARCH.length, 2801), fine[:, axis]) for axis in (0, 1)]
        assert np.max(np.abs(ends.T - ours)) < 0.5 / n**2 + 1e-5
