"""One figure of a benchmark."""

from __future__ import annotations

import operator
from dataclasses import dataclass

RELATIONS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}


@dataclass(frozen=True)
class Measurement:
    """`value` in `unit`, the goal it is held against, such as `< 100`, empty if none, and how it was taken."""

    name: str  # of what is measured
    value: float
    unit: str
    goal: str  # a relation and a number, empty if there is none
    how: str  # it was taken

    @property
    def is_missed(self) -> bool:
        """True if there is a goal, and this is not within it."""
        relation, _, bound = self.goal.partition(" ")
        return bool(bound) and not RELATIONS[relation](self.value, float(bound))
