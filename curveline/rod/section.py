"""The rod's cross-section as the physics sees it: what it has beside its stiffness in bending and twist."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Section:
    """What matters of a rod beside its bending and twist, in SI; `weight` is its own, whether modelled or not."""

    stretching_stiffness: float  # EA [N]; infinite for a rod that cannot stretch
    thickness: float  # [m] in the display's plane
    gyration: float  # [m], polar: about the rod's axis
    weight: float  # [N/m]


LINE = Section(stretching_stiffness=math.inf, thickness=0.0, gyration=0.0, weight=0.0)
"""Of a rod that is no more than a line."""
