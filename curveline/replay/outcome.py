"""What runs with errors came to: how each ended, how many ended as wanted, and why others did not."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

from curveline.scene import BUCKLED, LOST, STRAIGHT

TAUT = "taut"
"""How a segment ended whose rod was pulled straight between nodes that are out of line."""

CONFIDENCE = 0.95


@dataclass(frozen=True)
class TrialRun:
    """One run: how each segment ended, the name of a state or LOST, STRAIGHT or TAUT.

    `size` is the root mean square of its calibration errors, bows and errors of the display, in units of their standard
    deviations.
    """

    seed: int  # that repeats it
    endings: tuple[str, ...]  # of each segment, left to right
    size: float


@dataclass(frozen=True)
class Reason:
    """How a segment (from 1) ended that should have ended otherwise, and how often."""

    segment: int  # from 1
    ending: str  # name of a state, or taut, lost, straight
    runs: int  # how many

    def __str__(self) -> str:
        fates = {
            TAUT: "is pulled taut between nodes that are out of line",
            BUCKLED: "leaves the plane",
            LOST: "falls into no state that was found",
            STRAIGHT: "ends straight",
        }
        return f"segment {self.segment} {fates.get(self.ending, f'ends as the {self.ending}')}"


@dataclass(frozen=True)
class Share:
    """How many of `runs` ended as wanted."""

    count: int  # ended as wanted
    runs: int

    @property
    def value(self) -> float:
        """The share itself."""
        return self.count / self.runs

    @property
    def interval(self) -> tuple[float, float]:
        """Where the true share lies with a confidence of `CONFIDENCE` (Wilson 1927, J. Am. Stat. Assoc. 22)."""
        z = NormalDist().inv_cdf(0.5 + 0.5 * CONFIDENCE)
        widened = self.runs + z * z
        middle = (self.count + 0.5 * z * z) / widened
        reach = z * math.sqrt(self.count * (self.runs - self.count) / self.runs + 0.25 * z * z) / widened
        # What rounding leaves beyond none and all.
        return max(0.0, middle - reach), min(1.0, middle + reach)


@dataclass(frozen=True)
class MonteCarloOutcome:
    """What many runs came to: how many ended as wanted in all segments, and in each; why others did not, most first.

    `worst` is the run with the smallest errors of those that did not.
    """

    total: Share  # all segments as wanted
    segments: tuple[Share, ...]  # left to right
    reasons: tuple[Reason, ...]  # most frequent first
    worst: TrialRun | None
