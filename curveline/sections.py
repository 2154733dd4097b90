"""Cross-sections of rods, solid and of one material: areas, moments, and what a display file calls their sizes.

A section bends in the display's plane about its axis across it, and out of the plane about the other one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from curveline.units import to_mm

POISSON = 0.35
"""Poisson's ratio of acetal: an estimate, since makers state 0.35 and measurements give up to 0.44."""


@dataclass(frozen=True)
class Rectangle:
    """A strip that bends flat: `thickness` lies in the display's plane, `width` across it."""

    width: float  # [m]
    thickness: float  # [m]

    @property
    def area(self) -> float:
        """Area [m^2]."""
        return self.width * self.thickness

    @property
    def second_moment(self) -> float:
        """Second moment of area [m^4] for bending in the display's plane."""
        return self.width * self.thickness**3 / 12.0

    @property
    def lateral_second_moment(self) -> float:
        """Second moment of area [m^4] for bending out of the display's plane."""
        return self.thickness * self.width**3 / 12.0

    @cached_property
    def torsion_constant(self) -> float:
        """J [m^4] (Timoshenko and Goodier 1970, section 109: Saint-Venant's series)."""
        low, high = sorted((self.thickness, self.width))
        # The term after the last is below 1e-9 of the whole.
        series = math.fsum(math.tanh(k * math.pi * high / (2.0 * low)) / k**5 for k in range(1, 60, 2))
        return high * low**3 * (1.0 / 3.0 - 64.0 / math.pi**5 * low / high * series)

    def softening(self, curvature: float) -> float:
        """Fraction of its bending stiffness that it loses by changing its shape; none, as it does not."""
        return 0.0 * curvature

    @property
    def sizes_mm(self) -> dict[str, float]:
        """What a display file calls its sizes, in mm."""
        return {"width_mm": to_mm(self.width), "thickness_mm": to_mm(self.thickness)}

    def __str__(self) -> str:
        return f"rectangle of {to_mm(self.width):g} x {to_mm(self.thickness):g} mm"


@dataclass(frozen=True)
class Round:
    """A round rod, or a tube: a circle of `diameter` with a concentric hole of `inner_diameter`."""

    diameter: float  # [m]
    inner_diameter: float = 0.0  # [m], below `diameter`

    @property
    def width(self) -> float:
        """Size across the display's plane [m]."""
        return self.diameter

    @property
    def thickness(self) -> float:
        """Size in the display's plane [m]."""
        return self.diameter

    @property
    def area(self) -> float:
        """Area [m^2]."""
        # As a product: of a thin tube the difference of squares would lose digits.
        return 0.25 * math.pi * (self.diameter - self.inner_diameter) * (self.diameter + self.inner_diameter)

    @property
    def second_moment(self) -> float:
        """Second moment of area [m^4], the same in every direction: pi/64 (D^4 - d^4)."""
        return self.area * (self.diameter**2 + self.inner_diameter**2) / 16.0

    @property
    def lateral_second_moment(self) -> float:
        """Second moment of area [m^4] for bending out of the display's plane."""
        return self.second_moment

    @property
    def torsion_constant(self) -> float:
        """J [m^4], which is exact for circles: pi/32 (D^4 - d^4)."""
        return 2.0 * self.second_moment

    def softening(self, curvature: float) -> float:
        """Fraction of its bending stiffness that a thin tube loses at a `curvature` [1/m], which flattens it.

        To first order, Brazier (1927): 3/2 (1 - nu^2) (c r^2 / t)^2 with mean radius r and wall t; none if solid.
        """
        if self.inner_diameter == 0.0:
            return 0.0
        radius, wall = 0.25 * (self.diameter + self.inner_diameter), 0.5 * (self.diameter - self.inner_diameter)
        return 1.5 * (1.0 - POISSON**2) * (curvature * radius**2 / wall) ** 2

    @property
    def sizes_mm(self) -> dict[str, float]:
        """What a display file calls its sizes, in mm."""
        inner = {"inner_diameter_mm": to_mm(self.inner_diameter)} if self.inner_diameter > 0.0 else {}
        return {"diameter_mm": to_mm(self.diameter), **inner}

    def __str__(self) -> str:
        if self.inner_diameter > 0.0:
            return f"tube of {to_mm(self.diameter):g} mm, {to_mm(self.inner_diameter):g} mm inside"
        return f"round rod of {to_mm(self.diameter):g} mm"


CrossSection = Rectangle | Round
