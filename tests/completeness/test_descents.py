"""The search for states of unusual rods, in small; see `descents` for the campaign."""

from __future__ import annotations

import numpy as np
import pytest

from .descents import DRAWS, descended, missed


@pytest.mark.parametrize("rods", DRAWS)
def test_no_state_is_missed(rods: str) -> None:
    rng = np.random.default_rng(99)
    assert [(rod, others) for rod in DRAWS[rods](60, 99) if (others := missed(rod, rng)[1])] == []


@pytest.mark.parametrize("rods", DRAWS)
def test_descents_find_what_there_is_to_miss(rods: str) -> None:
    rod = next(DRAWS[rods](1, 99))
    assert len(list(descended(rod, np.random.default_rng(1)))) >= 1
