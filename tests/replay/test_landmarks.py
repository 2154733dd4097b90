"""States known at one pose have, at others, the names that a search there would give them."""

from __future__ import annotations

import numpy as np
import pytest

from curveline.replay import landmarks, playback
from curveline.replay.landmarks import Landmarks
from curveline.rod.branches.tracking import tracked
from curveline.rod.clamped_rod import ClampedRod
from curveline.rod.models.showable import showable_states
from curveline.rod.problem import Pose
from curveline.simulation.simulate import scene_rod
from playing import scene

SEGMENTS = [(name, 0) for name in ("level-up-peak", "level-neutral-valley", "staggered-asymmetric-peak")]
SEGMENTS += [("roofline", segment) for segment in range(4)]


def moved(rod: ClampedRod, chance: np.random.Generator, size: float) -> ClampedRod:
    """The rod with its nodes and its length somewhere else."""
    sizes = size * np.array([0.0, 0.03, 0.3, 0.3, 0.03])
    return rod.moved_to(Pose(*(np.array(rod.pose[:5]) + sizes * chance.uniform(-1.0, 1.0, 5)).tolist()))


@pytest.mark.parametrize(("name", "segment"), SEGMENTS)
@pytest.mark.parametrize("size", [0.1, 0.5, 2.0])
def test_names_are_those_of_a_search(name: str, segment: int, size: float) -> None:
    rod, chance = scene_rod(scene(name), segment), np.random.default_rng(segment)
    known = Landmarks(rod)
    told = 0
    for _ in range(12):
        there = moved(rod, chance, size)
        for state in showable_states(there, 1e-5).states:
            held = tracked(state)
            assert known.name_of(there, held) == playback.name_of(there, held) == state.name
        for wanted in ("peak", "valley"):
            found, expected = known.state(there, wanted), playback.known_state(there, wanted)
            assert (found is None) == (expected is None)
            told += found is not None
            assert found is None or expected is None or found.gap(expected) < 0.02  # type: ignore[union-attr, arg-type]
    assert told


def test_what_is_known_is_searched_for_once(monkeypatch: pytest.MonkeyPatch) -> None:
    rod, chance = scene_rod(scene("level-up-peak"), 0), np.random.default_rng(1)
    known = Landmarks(rod)
    peak = tracked(showable_states(rod, 1e-5).states[0])
    assert known.name_of(rod, peak) == "peak"

    def search(*_: object) -> None:
        raise AssertionError("a state was searched for")

    for module in (landmarks, playback):
        monkeypatch.setattr(module, "showable_states", search)
    for _ in range(5):
        there = moved(rod, chance, 0.1)
        state = known.state(there, "peak")
        assert state is not None
        assert known.name_of(there, state) == "peak"
    with pytest.raises(AssertionError, match="searched for"):
        known.name_of(rod.moved_to(rod.pose._replace(length=0.9)), peak)
