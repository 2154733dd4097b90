"""One figure of a benchmark."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Measurement:
    """`value` in `unit`, the goal it is held against, empty if none, and how it was taken."""

    name: str
    value: float
    unit: str
    goal: str
    how: str
