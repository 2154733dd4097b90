"""Units of length in which people draw."""

from __future__ import annotations

from collections.abc import Mapping

from curveline.errors import InvalidInput
from curveline.units import mm, plain, to_mm

INCH = mm(25.4)
UNITS: Mapping[str, float] = {
    "mm": mm(1.0),
    "cm": mm(10.0),
    "m": 1.0,
    "in": INCH,
    "ft": 12.0 * INCH,
    "pt": INCH / 72.0,
    "px": INCH / 96.0,
}
"""What a unit of a drawing is in metres; px is that of CSS."""


def metres_of(unit: str) -> float:
    """What a unit is in metres; InvalidInput for one that nobody knows."""
    if unit not in UNITS:
        raise InvalidInput(f"there is no unit {unit!r} of a drawing", f"choose one of {', '.join(UNITS)}")
    return UNITS[unit]


def is_physical(unit: str) -> bool:
    """False for pixels, of which an inch has 72, 90 or 96, by who wrote them."""
    return unit not in ("", "px")


def in_mm(metres: float) -> str:
    """A scale as people read it, such as 0.264583."""
    return plain(float(f"{to_mm(metres):.6g}"))


def size_in_mm(wide: float, high: float) -> str:
    """A width and a height [m], such as 480 x 60.2 mm."""
    return f"{plain(float(f'{to_mm(wide):.5g}'))} x {plain(float(f'{to_mm(high):.5g}'))} mm"
