"""Conversions between what people write (mm, deg, GPa, g/m) and SI with radians.

The only module with 1e-3 or pi/180 in it. Names say the direction: `mm(x)` reads "x millimetres, in metres";
`to_mm(x)` reads "x metres, in millimetres".
"""

from __future__ import annotations

import math

STANDARD_GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s^2]."""


def mm(value: float) -> float:
    """Length in mm (or speed in mm/s, ...) to metres."""
    return value * 1e-3


def to_mm(value: float) -> float:
    """Length in metres to mm."""
    return value * 1e3


def deg(value: float) -> float:
    """Angle in degrees to radians."""
    return math.radians(value)


def to_deg(value: float) -> float:
    """Angle in radians to degrees."""
    return math.degrees(value)


def gpa(value: float) -> float:
    """Modulus in GPa to Pa."""
    return value * 1e9


def to_gpa(value: float) -> float:
    """Modulus in Pa to GPa."""
    return value * 1e-9


def g_per_m(value: float) -> float:
    """Mass per length in g/m to kg/m."""
    return value * 1e-3


def nmm(value: float) -> float:
    """Moment in N mm to N m."""
    return value * 1e-3


def nmm2(value: float) -> float:
    """Bending stiffness in N mm^2 to N m^2."""
    return value * 1e-6


def to_nmm2(value: float) -> float:
    """Bending stiffness in N m^2 to N mm^2."""
    return value * 1e6


def to_nmm(value: float) -> float:
    """Moment in N m to N mm."""
    return value * 1e3


def to_n_per_mm(value: float) -> float:
    """Stiffness in N/m to N/mm."""
    return value * 1e-3


def to_mj(value: float) -> float:
    """Energy in J to mJ."""
    return value * 1e3


def ms(value: float) -> float:
    """Time in ms to seconds."""
    return value * 1e-3


def to_ms(value: float) -> float:
    """Time in seconds to ms."""
    return value * 1e3


MOST_DECIMALS = 15


def decimals_of(size: float, digits: int) -> int:
    """Decimals with which a number as large as `size` shows `digits` of its digits; 0 for a size that is none."""
    if not 0.0 < abs(size) < math.inf:
        return 0
    return max(0, digits - 1 - math.floor(math.log10(abs(size))))


def told_apart(one: float, other: float, decimals: int = 0) -> tuple[str, str]:
    """Two numbers that a sentence compares, with as many more decimals as it takes for them to read differently.

    Equal ones read alike. None that differs from 0 reads 0.
    """
    for more in range(decimals, MOST_DECIMALS + 1):
        texts = f"{one:.{more}f}", f"{other:.{more}f}"
        if texts[0] != texts[1] and all(
            float(text) or not value for text, value in zip(texts, (one, other), strict=True)
        ):
            return texts
    if one == other:
        return f"{one:.{decimals}f}", f"{other:.{decimals}f}"
    return repr(float(one)), repr(float(other))


def millimetres(length: float) -> str:
    """A length in metres as words in mm, as short as its size needs."""
    value = to_mm(length)
    if not math.isfinite(value):
        return "an unknown distance"
    return f"{value:.2g} mm" if value < 100.0 else f"{value:.0f} mm"
