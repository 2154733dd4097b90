"""The rod's cross-section as the physics sees it: stiffnesses beside that of bending in the plane, and its size."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Section:
    """What matters of a rod beside its bending in the plane, in SI; `weight` is its own, whether modelled or not."""

    stretching_stiffness: float  # EA [N]
    thickness: float  # [m] in the display's plane
    gyration: float  # [m], polar: about the rod's axis
    weight: float  # [N/m]
    lateral_stiffness: float  # EI out of the plane [N m^2]
    twisting_stiffness: float  # GJ [N m^2]
