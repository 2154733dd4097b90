"""One figure of a benchmark."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import dataclass

RELATIONS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "=": operator.eq}
TIMES = ("s", "ms", "us")
RATE = "/s"


@dataclass(frozen=True)
class Measurement:
    """`value` in `unit`, the goal it is held against, such as `< 100`, empty if none, and how it was taken.

    `spread` is the noise: by what part of the best of some rounds their median is off; None if there was one round. A
    figure of a rod's solution is also held, for one rod, against Newton's method alone and scipy's solve_bvp, which
    were timed beside it.
    """

    name: str  # of what is measured
    value: float | None  # None if it could not be measured
    unit: str  # empty for a number
    goal: str  # a relation and a number, empty if there is none
    how: str  # it was taken, or why it was not
    spread: float | None = None  # of repeats, as a part of the value
    over_bare_newton: float | None = None  # time of a rod, over that of Newton's method alone
    over_solve_bvp: float | None = None  # time of a rod, over that of scipy.integrate.solve_bvp

    @property
    def is_missed(self) -> bool:
        """True if there is a goal, and this is not within it, or could not be measured."""
        relation, _, bound = self.goal.partition(" ")
        return bool(bound) and (self.value is None or not RELATIONS[relation](self.value, float(bound)))

    @property
    def worse_side(self) -> int:
        """1 if a larger value is worse, -1 if a smaller one is, 0 if it is neither good nor bad."""
        if self.goal.startswith(">") or self.unit == RATE:
            return -1
        return 1 if self.goal or self.unit in TIMES else 0


def missed(rows: Sequence[Measurement]) -> list[str]:
    """The names of figures that miss their goals."""
    return [row.name for row in rows if row.is_missed]
