"""The search between clamps that give, in small; see `giving` for the campaign."""

from __future__ import annotations

import numpy as np

from .giving import descended, drawn, missed


def test_no_state_between_giving_clamps_is_missed() -> None:
    rng = np.random.default_rng(99)
    assert [(rod, others) for rod in drawn(60, 99) if (others := missed(rod, rng)[1])] == []


def test_descents_find_what_there_is_to_miss() -> None:
    rod = next(drawn(1, 99))
    assert len(list(descended(rod, np.random.default_rng(1)))) >= 1
