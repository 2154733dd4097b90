"""One figure of a benchmark."""

from __future__ import annotations

import operator
from dataclasses import dataclass

RELATIONS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}


@dataclass(frozen=True)
class Measurement:
    """`value` in `unit`, the goal it is held against, such as `< 100`, empty if none, and how it was taken."""

    name: str
    value: float
    unit: str
    goal: str
    how: str

    @property
    def is_missed(self) -> bool:
        """True if there is a goal, and this is not within it."""
        relation, _, bound = self.goal.partition(" ")
        return bool(bound) and not RELATIONS[relation](self.value, float(bound))
