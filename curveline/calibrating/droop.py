"""The droop test: a rod that is clamped level at an edge and hangs over it tells its gravity length.

While it sags by less than a tenth of its length, its tip does by w L^4 / (8 EI); beyond, the rod is followed along
itself (the heavy elastica), EI k' = -w (L - s) cos(angle), so that any sag will do.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from curveline.errors import InvalidInput
from curveline.units import mm, to_mm

STEPS = 100
"""Along the rod, by Runge and Kutta's method of fourth order."""
STEEPEST = 0.8
"""A sag beyond that part of the length tells more of the length than of the rod."""
PART = 0.02
"""Of the sag, by which it may be off if nobody says: as read with a ruler, twice, the rod turned over."""
EXACT, TRIES, PARTS = 1e-10, 60, 16
"""Of a root: how exact, and after how many tries at most; into how many parts it is looked for."""


@dataclass(frozen=True)
class Droop:
    """A rod that was hung over an edge, `length` [m] of it, and by how much its tip sagged; InvalidInput for others."""

    length: float  # [m] from the edge
    sag: float  # [m] of the tip, below the edge
    error: float = 0.0  # [m] standard deviation of the sag; 0 for one of 2 % and a half of a millimetre

    def __post_init__(self) -> None:
        if not all(math.isfinite(each) for each in (self.length, self.sag, self.error)) or self.length <= 0.0:
            raise InvalidInput(f"no rod droops over a length of {to_mm(self.length):g} mm", "give length and sag in mm")
        if not 0.0 < self.sag < STEEPEST * self.length or self.error < 0.0:
            hint = f"a level rod sags by something between 0 and {STEEPEST:g} of its length: hang out less of it"
            raise InvalidInput(f"{to_mm(self.length):g} mm of rod do not sag by {to_mm(self.sag):g} mm", hint)

    @property
    def weight(self) -> float:
        """Weight over bending stiffness [1/m^3] by which it sags so."""
        part, high = self.sag / self.length, 1.0
        while sag_of(high) < part:
            high *= 2.0
        return _root(lambda load: sag_of(load) - part, 0.0, high) / self.length**3

    @property
    def sigma(self) -> float:
        """Standard deviation of the weight over bending stiffness [1/m^3]."""
        error = self.error or math.hypot(PART * self.sag, mm(0.5))
        least = max(self.sag - 0.5 * error, 1e-3 * self.sag)
        most = min(self.sag + 0.5 * error, 0.999 * STEEPEST * self.length)
        slope = (Droop(self.length, most).weight - Droop(self.length, least).weight) / (most - least)
        return slope * error


def sag_of(load: float) -> float:
    """The sag of the tip of a level cantilever as a part of its length, for w L^3 / EI.

    The curvature at the clamp is sought for which there is none at the tip.
    """
    if load == 0.0:
        return 0.0
    # The clamp bears half of the load at most, were the rod straight; the least curvature is that without a loop.
    ends = [0.55 * load * part / PARTS for part in range(PARTS + 1)]
    place = next(place for place in range(1, PARTS + 1) if place == PARTS or _hung(load, ends[place])[0] >= 0.0)
    return _hung(load, _root(lambda clamped: _hung(load, clamped)[0], ends[place - 1], ends[place]))[1]


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    """Where a function passes 0 between two ends, upwards: by secants that keep it between them (Illinois)."""
    below, above = function(low), function(high)
    middle, last = high, 0
    for _ in range(TRIES):
        if high - low <= EXACT * high:
            break
        middle = (low * above - high * below) / (above - below)
        value = function(middle)
        if abs(value) < EXACT:
            break
        side = -1 if value < 0.0 else 1
        if side < 0:
            low, below, above = middle, value, above * (0.5 if side == last else 1.0)
        else:
            high, above, below = middle, value, below * (0.5 if side == last else 1.0)
        last = side
    return middle


def _hung(load: float, clamped: float) -> tuple[float, float]:
    """Curvature and sag at the tip of a rod that turns down by `clamped` at its clamp."""
    h = 1.0 / STEPS
    angle, curvature, sag = 0.0, clamped, 0.0

    def slopes(place: float, angle: float, curvature: float) -> tuple[float, float, float]:
        return curvature, -load * (1.0 - place) * math.cos(angle), math.sin(angle)

    for step in range(STEPS):
        s = step * h
        a = slopes(s, angle, curvature)
        b = slopes(s + 0.5 * h, angle + 0.5 * h * a[0], curvature + 0.5 * h * a[1])
        c = slopes(s + 0.5 * h, angle + 0.5 * h * b[0], curvature + 0.5 * h * b[1])
        d = slopes(s + h, angle + h * c[0], curvature + h * c[1])
        angle, curvature, sag = (
            value + h / 6.0 * (one + 2.0 * two + 2.0 * three + four)
            for value, one, two, three, four in zip((angle, curvature, sag), a, b, c, d, strict=True)
        )
    return curvature, sag
