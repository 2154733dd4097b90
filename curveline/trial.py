"""A trial: the curve that a real display showed once, told by points, or why it cannot be told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from curveline.cameras.outcomes import TrialOutcome
from curveline.scene import Scene

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class TrialCurve:
    """The rod of one segment in a trial, by points along it from left to right in the display's frame.

    `state` names the stable state of the model that it is, "" if that is not known.
    """

    points: Array  # (n, 2) [m]
    state: str = ""
    sigma: float = 0.0  # [m] standard error of a point across the rod; 0 if nobody told


@dataclass(frozen=True)
class Trial:
    """One trial of a shape: a file of points, or a photograph that was traced."""

    source: str  # as the user named it
    outcome: TrialOutcome  # `seen` if it can be used
    reason: str = ""  # in a sentence, why it cannot be used; "" if it can
    curves: tuple[TrialCurve, ...] = ()  # one per segment, left to right; none unless it was seen


@dataclass(frozen=True)
class ShapeTrials:
    """All trials of one shape."""

    scene: Scene  # what the display was sent
    trials: tuple[Trial, ...]  # in the order of their files' names
