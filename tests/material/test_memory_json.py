"""A memory survives JSON, and what is no memory of the rod is refused with what to do."""

from __future__ import annotations

import copy
import json
import math
from typing import Any

import numpy as np
import pytest

from curveline.errors import InvalidInput
from curveline.material.memory import RodMemory
from curveline.material.memory_json import MOST_BENDS, memory_document, memory_from
from curveline.material.relaxation import Relaxation, power_law

LAW = power_law()


@pytest.fixture
def memory() -> RodMemory:
    return RodMemory.new(LAW, 2.0).held(np.linspace(-5.0, 7.0, 401), 3600.0)


def test_a_memory_is_the_same_after_a_journey_through_json(memory: RodMemory) -> None:
    text = json.dumps(memory_document(memory))
    assert len(text) < 70_000
    back = memory_from(json.loads(text), LAW, 2.0)
    np.testing.assert_allclose(back.bends, memory.bends, rtol=1e-8)
    assert (back.total_length, back.law) == (2.0, LAW)


def test_a_law_of_other_strength_takes_over_what_was_remembered(memory: RodMemory) -> None:
    measured = power_law(1.3, 0.31)
    back = memory_from(memory_document(memory), measured, 2.0)
    assert back.law == measured


def changed(document: dict[str, Any], **keys: Any) -> dict[str, Any]:
    return {**copy.deepcopy(document), **keys}


@pytest.mark.parametrize("document", [None, 3, "memory", [], {}, {"version": 1}, {"version": "1"}])
def test_what_is_no_memory_is_refused(document: Any) -> None:
    with pytest.raises(InvalidInput, match="no memory of the rod") as refusal:
        memory_from(document, LAW, 2.0)
    assert refusal.value.hint


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"version": 2}, "version 2"),
        ({"version": True}, "whole number"),
        ({"total_length_mm": 1990.0}, "1990 mm"),
        ({"total_length_mm": math.nan}, "finite"),
        ({"total_length_mm": "2000"}, "number"),
        ({"times_s": [1.0]}, "times"),
        ({"times_s": [math.nan] * 9}, "finite"),
        ({"bends_per_m": []}, "9 rows"),
        ({"bends_per_m": [[0.0, 0.0]] * 8}, "9 rows"),
        ({"bends_per_m": [[0.0, 0.0]] * 8 + [[0.0]]}, "same length"),
        ({"bends_per_m": [[0.0]] * 9}, "9 rows"),
        ({"bends_per_m": [[0.0, math.nan]] * 9}, "finite"),
        ({"bends_per_m": [[0.0, math.inf]] * 9}, "finite"),
        ({"bends_per_m": [[0.0, 1e7]] * 9}, "no rod has"),
        ({"bends_per_m": [[0.0, "1"]] * 9}, "number"),
        ({"bends_per_m": [3.0] * 9}, "array"),
        ({"bends_per_m": {"0": 1}}, "array"),
        ({"bends_per_m": [[]] * 100_000}, "more than"),
        ({"bends_per_m": [[0.0] * MOST_BENDS] * 9}, "more than"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_a_memory_that_was_damaged_is_refused_with_what_is_wrong(memory: RodMemory, keys, told: str) -> None:
    document = changed(memory_document(memory), **keys)
    with pytest.raises(InvalidInput, match=told) as refusal:
        memory_from(document, LAW, 2.0)
    assert refusal.value.hint


def test_a_memory_of_another_law_is_refused(memory: RodMemory) -> None:
    with pytest.raises(InvalidInput, match="not those of the rod's law"):
        memory_from(memory_document(memory), Relaxation((1.0, 10.0), (0.1, 0.1)), 2.0)
