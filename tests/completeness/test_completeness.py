"""A part of the campaign `python -m tests.completeness.planar`, and the yardstick itself held against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.planar.elastica import clamped_arch
from curveline.rod.problem import Bearing, Pose
from curveline.rod.states.equilibrium import Equilibrium
from curveline.rod.states.planar_states import find_states
from tests.extremes.rows import ONE_END

from .planar import Result, compared, judged, table, wilson
from .scenes import FOLD, PITCHFORK, RANDOM, Scene, elastica, scene, truth
from .spectral import Elastica, angles, crosses, multistart

SEED = 20250112
SCENES = 24
CAMPAIGN = 400


@pytest.fixture(scope="module", params=[SCENES, pytest.param(CAMPAIGN, marks=pytest.mark.campaign)])
def results(request: pytest.FixtureRequest) -> list[Result]:
    return [judged(SEED, number) for number in range(request.param)]


def test_no_state_is_missed_and_none_invented(results: list[Result]) -> None:
    print(table(results))
    assert [(each.number, each.missed) for each in results if each.missed] == []
    assert [(each.number, each.invented) for each in results if each.invented] == []


def test_the_scenes_are_what_they_are_said_to_be(results: list[Result]) -> None:
    kinds = [each.scene.kind for each in results]
    assert kinds.count(RANDOM) == len(results) // 2
    assert kinds.count(FOLD) >= len(results) // 6
    assert kinds.count(PITCHFORK) >= len(results) // 30
    assert sum(each.states for each in results) >= 1.2 * len(results)
    assert scene(SEED, 7).rod == scene(SEED, 7).rod != scene(SEED + 1, 7).rod


def test_random_starts_lead_to_the_arches_of_eulers_elastica() -> None:
    arch = clamped_arch(0.8, 1.0, 1.0)
    places = np.linspace(0.0, 1.0, 101)
    rod = Elastica((0.8, 0.0), (0.0, 0.0), 0.0)
    states = [state for state in multistart(rod, np.random.default_rng(1)) if not crosses(rod, state, 0.2)]
    assert len(states) == 2
    for sign in (1.0, -1.0):
        gaps = [np.max(np.abs(angles(rod, state, places) - sign * arch.angles(places))) for state in states]
        assert min(gaps) < 1e-9


@pytest.mark.parametrize(("share", "count"), [(0.9999, 2), (1.0001, 1)])
def test_the_yardstick_knows_a_published_fold(share: float, count: int) -> None:
    # Reference C: a rod of 1.2 spans snaps when one of its clamps is turned by 41.81572612 deg.
    rod = elastica(ClampedRod(Pose(1.0, 0.0, share * ONE_END, 0.0, 1.2), Bearing(0.0, 1.0, 0.0)))
    states = multistart(rod, np.random.default_rng(2))
    assert sum(not crosses(rod, state, 0.2) for state in states) == count


def test_a_search_that_drops_or_invents_is_caught() -> None:
    number = next(n for n in range(0, 40, 2) if len(find_states(scene(SEED, n).rod, 1e-4)) == 2)
    drawn = scene(SEED, number)
    true_states = truth(SEED, number, drawn)

    def dropping(rod: ClampedRod, tolerance: float) -> list[Equilibrium]:
        return find_states(rod, tolerance)[:1]

    def moving(rod: ClampedRod, tolerance: float) -> list[Equilibrium]:
        states = find_states(rod, tolerance)
        table = states[0].vertices_table.copy()
        table[:, 1] += 1e-4
        return [states[0].but(vertices_table=table), *states[1:]]

    assert compared(number, drawn, true_states, find_states)[3:] == ((), (), 0)
    assert len(compared(number, drawn, true_states, dropping).missed) == 1
    assert len(compared(number, drawn, true_states, moving).invented) == 1
    lacking = compared(number, Scene(drawn.rod, RANDOM, math.nan), true_states[:1], find_states)
    assert (lacking.states, lacking.unmet) == (2, 1)


def test_intervals_are_wilsons() -> None:
    assert wilson(0, 2000) == pytest.approx((0.0, 0.001917), abs=1e-6)
    assert wilson(5, 10) == pytest.approx((0.2366, 0.7634), abs=1e-4)
