"""What a rod went through before a shape, and what it remembers of that."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from curveline.material.history import Dwell
from curveline.material.memory import RodMemory, seconds_until_flat
from curveline.units import mm, to_mm

FLAT = mm(1.0)
"""How near to straight a rod lies that is called flat."""
ASSUMED = (
    "before the first shape the rod remembered nothing",
    "every shape was held with tails of equal length, and moves between shapes took no time",
    "the law is linear, and that of bends in the plane",
)


@dataclass(frozen=True, eq=False)
class Past:
    """The dwells of a rod, and the memory that they left.

    `error` is the largest difference of the set from that of half as many `steps`, in which the shapes were followed.
    """

    history: tuple[Dwell, ...]  # the first one first
    memory: RodMemory  # that they left
    span: float  # [m] over which the rod is to lie flat
    error: float  # [1/m] of the set
    steps: int  # in which shapes were computed anew
    is_estimate: bool  # the display file says nothing of the set, and that of acetal was taken
    made: tuple[tuple[float, ...], tuple[float, ...]] | None = None  # places [m] and natural curvatures [1/m] as made

    @property
    def largest_set(self) -> float:
        """The largest set along the rod [1/m], whichever way."""
        return float(np.max(np.abs(self.memory.set_curvature)))

    @property
    def flat_after(self) -> float:
        """How long the rod must be held straight until, let go, it lies flat over the span [s]; infinite for ever."""
        return seconds_until_flat(self.memory, FLAT, self.span)

    @property
    def assumed(self) -> tuple[str, ...]:
        """What was taken for granted, in sentences."""
        estimate = ("the display file does not say what set the rod takes: that of acetal is taken, an estimate",)
        return (*(estimate if self.is_estimate else ()), *ASSUMED)

    def document(self) -> dict[str, Any]:
        """All of it as plain data, the set along the rod, too."""
        law, flat_after = self.memory.law, self.flat_after
        return {
            "history": [
                {
                    "shape": each.shape,
                    "held_s": each.seconds,
                    "temperature_C": law.temperature if each.temperature is None else each.temperature,
                }
                for each in self.history
            ],
            "law": {"times_s": list(law.times), "fractions": list(law.fractions), "is_estimate": self.is_estimate},
            "set": {
                "place_mm": [to_mm(each) for each in self.memory.places.tolist()],
                "curvature_per_m": self.memory.set_curvature.tolist(),
                "largest_per_m": self.largest_set,
                "error_per_m": self.error,
                "steps": self.steps,
            },
            "flat": {
                "within_mm": to_mm(FLAT),
                "over_mm": to_mm(self.span),
                "after_s": flat_after if np.isfinite(flat_after) else None,
            },
            "assumed": list(self.assumed),
        }
