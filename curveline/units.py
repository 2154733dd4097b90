"""Conversions between what people write (mm, deg, GPa, g/m) and SI with radians.

The only module with 1e-3 or pi/180 in it. Names say the direction: `mm(x)` reads "x millimetres, in metres";
`to_mm(x)` reads "x metres, in millimetres".
"""

from __future__ import annotations

import math

STANDARD_GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s^2]."""
GAS_CONSTANT = 8.314462618
"""Molar gas constant [J/(mol K)]."""
TAUT = 5e-5
"""Rod that may be missing between two nodes [m], by rounding and encoder counts. A rod of the built-in displays that
stretches by that pulls as hard as their motors."""
MINUTE, HOUR, DAY, WEEK = 60.0, 3600.0, 86_400.0, 604_800.0
"""In seconds."""


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


def kelvin(value: float) -> float:
    """Temperature in degrees Celsius to kelvin."""
    return value + 273.15


def decimals_of(size: float, digits: int) -> int:
    """Decimals with which a number as large as `size` shows `digits` of its digits; 0 for a size that is none."""
    if not 0.0 < abs(size) < math.inf:
        return 0
    return max(0, digits - 1 - math.floor(math.log10(abs(size))))


MOST_DIGITS = 17
"""With which any two floats can be told apart."""


def told_apart(one: float, other: float, digits: int, kind: str = "g") -> tuple[str, str]:
    """Two numbers that a sentence compares, with so many digits, or as many more as they take to read differently.

    The digits are significant ones, or decimals if the kind is "f", as in a format. Equal numbers read alike; one that
    is not 0 does not read so beside another.
    """
    texts = f"{one:.{digits}{kind}}", f"{other:.{digits}{kind}}"
    if one == other:
        return texts
    for more in range(digits, MOST_DIGITS + 1):
        texts = f"{one:.{more}{kind}}", f"{other:.{more}{kind}}"
        if texts[0] != texts[1] and all(map(_is_shown, texts, (one, other))):
            return texts
    return repr(float(one)), repr(float(other))


def beyond(value: float, low: float, high: float, digits: int = 6) -> tuple[str, str, str]:
    """A value outside an interval and the ends of that, the value told apart from the end that it is beyond."""
    if value > high:
        there, end = told_apart(value, high, digits)
        return there, f"{low:.{digits}g}", end
    there, end = told_apart(value, low, digits)
    return there, end, f"{high:.{digits}g}"


def plain(value: float) -> str:
    """A number as people write it: without an exponent, unless it has many zeros."""
    from decimal import Decimal

    return f"{Decimal(repr(value)).normalize():f}" if 1e-7 <= abs(value) < 1e16 else f"{value:g}"


def _is_shown(text: str, value: float) -> bool:
    """False if a number reads as 0 and is not."""
    return value == 0.0 or float(text) != 0.0


def millimetres(length: float) -> str:
    """A length in metres as words in mm, as short as its size needs."""
    value = to_mm(length)
    if not math.isfinite(value):
        return "an unknown distance"
    return f"{value:.2g} mm" if value < 100.0 else f"{value:.0f} mm"


def between(low: float, high: float, digits: int) -> tuple[float, float]:
    """The least and the largest number with so many significant digits that lie between two others, and not on them."""
    return rounded_up(math.nextafter(low, math.inf), digits), rounded_down(math.nextafter(high, -math.inf), digits)


def rounded_up(value: float, digits: int) -> float:
    """The least number with so many significant digits that is not below `value`: to advise a lower bound."""
    return _rounded(value, digits, "ROUND_CEILING")


def rounded_down(value: float, digits: int) -> float:
    """The largest number with so many significant digits that is not above `value`: to advise an upper bound."""
    return _rounded(value, digits, "ROUND_FLOOR")


def _rounded(value: float, digits: int, rounding: str) -> float:
    # Every command imports this module, and few advise numbers.
    from decimal import Context, Decimal

    return float(Context(prec=digits, rounding=rounding).create_decimal(Decimal(value)))
