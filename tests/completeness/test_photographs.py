"""Photographs traced against a known truth, in small; see `photographs` for the campaign."""

from __future__ import annotations

import pytest

from curveline.cameras.outcomes import TrialOutcome
from curveline.cameras.synthetic.faults import CLEAN, HARD, LAB
from curveline.units import mm

from .photographed import NONE_OF_THEM, looked_at, pictured, tier_of

FEW = range(50_000, 50_016)
MANY = range(50_000, 50_200)


def small(seeds: range, count: int) -> list[int]:
    """Some seeds whose pictures are small, which are quick."""
    from curveline.cameras.synthetic.standpoints import standpoint_of
    from curveline.shapes.files import read_display

    display = read_display("single")
    return [seed for seed in seeds if standpoint_of(display, seed).lens.size[0] == 1920][:count]


@pytest.mark.parametrize("tier", [CLEAN, LAB, HARD])
def test_photographs_are_named_and_measured(tier: str) -> None:
    for seed in small(FEW, 2 if tier == LAB else 1):
        looked = looked_at(pictured(seed, tier))
        assert looked.outcome is TrialOutcome.SEEN or tier == HARD
        if looked.outcome is TrialOutcome.SEEN:
            assert looked.state == looked.wanted, seed
            assert looked.rms < mm(0.5), seed


@pytest.mark.parametrize("kind", NONE_OF_THEM)
def test_what_is_none_of_the_states_is_refused(kind: str) -> None:
    (seed,) = small(FEW, 1)
    assert looked_at(pictured(seed, LAB, kind)).outcome is not TrialOutcome.SEEN


@pytest.mark.campaign
@pytest.mark.parametrize(("tier", "most", "worst"), [(CLEAN, 0.35, 0.6), (LAB, 0.35, 0.6), (HARD, 0.5, 5.0)])
def test_many_photographs_are_named_and_measured(tier: str, most: float, worst: float) -> None:
    looked = [looked_at(pictured(seed, tier)) for seed in MANY]
    seen = [each for each in looked if each.outcome is TrialOutcome.SEEN]
    assert len(seen) == len(looked) or tier == HARD
    assert all(each.state == each.wanted for each in seen)
    off = sorted(each.rms for each in seen)
    assert off[int(0.95 * len(off))] <= mm(most)
    assert off[-1] <= mm(worst)
    assert sum(each.inside for each in seen) / len(seen) > 0.9


@pytest.mark.campaign
@pytest.mark.parametrize("kind", NONE_OF_THEM)
def test_nothing_that_is_none_of_the_states_is_accepted(kind: str) -> None:
    accepted = [seed for seed in MANY if looked_at(pictured(seed, tier_of(seed), kind)).outcome is TrialOutcome.SEEN]
    assert accepted == []
