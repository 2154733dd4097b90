"""With which number of its file a display would let plans leave home: the least one, tried as it is printed.

remedy(verifier, shut)        # drive.max_force_N = 4.9
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from curveline.errors import Infeasible
from curveline.planning.reachability import nearest_shape
from curveline.planning.verification import Verifier
from curveline.scene import Display, Range
from curveline.sections import Rectangle
from curveline.units import deg, mm, nmm, rounded_up, to_deg, to_mm, to_nmm

DIGITS = 2
"""Significant digits of a number that is advised."""
CLOSE = 1.05
"""Factors between which nothing is sought any more: 2 digits are off by as much."""
FUNNELS = 2
"""Funnels that are tried with every number: more would find a smaller one, and take longer."""


@dataclass(frozen=True)
class Dial:
    """A number of a display file under its `key` that may be raised, in its own unit: read, put back and written down.

    `most` is the largest factor, or the largest value, of which the smaller is tried; where more may be too much, on
    the way there so many `probes` are.
    """

    key: str
    of: Callable[[Display], float]
    put: Callable[[Display, float], Display]
    most: tuple[float, float]
    written: Callable[[Display], str]
    probes: int = 1


def _drive(display: Display, force: float, moment: float) -> Display:
    return replace(display, drive=replace(display.drive, max_force=force, max_moment=moment))


def _strained(display: Display, value: float) -> Display:
    return replace(display, rod=replace(display.rod, max_strain=value))


def _cut(display: Display, value: float) -> Display:
    return replace(display, rod=replace(display.rod, total_length=mm(value)))


def _thicker(display: Display, value: float) -> Display:
    """Another size in the plane; a stiffness that was measured is the file's, whatever the size."""
    rod = display.rod
    old = rod.section
    section = replace(old, thickness=mm(value)) if isinstance(old, Rectangle) else replace(old, diameter=mm(value))
    stiffness = rod.bending_stiffness
    modulus = stiffness / section.second_moment if rod.is_stiffness_measured else rod.youngs_modulus
    return replace(display, rod=replace(rod, section=section, youngs_modulus=modulus))


def _steeper(display: Display, value: float) -> Display:
    old = display.limits.angle
    angle = Range(min(old.low, -deg(value)), max(old.high, deg(value)))
    return replace(display, limits=replace(display.limits, angle=angle))


def _longer(display: Display, value: float) -> Display:
    length = Range(min(display.limits.length.low, display.span), mm(value))
    return replace(display, limits=replace(display.limits, length=length))


def _ends(limits: Range, unit: Callable[[float], float]) -> str:
    return f"[{unit(limits.low):.10g}, {unit(limits.high):.10g}]"


FORCE = Dial(
    "drive.max_force_N",
    lambda display: display.drive.max_force,
    lambda display, value: _drive(display, value, display.drive.max_moment),
    (16.0, math.inf),
    lambda display: f"{display.drive.max_force:.10g}",
)
MOMENT = Dial(
    "drive.max_moment_Nmm",
    lambda display: to_nmm(display.drive.max_moment),
    lambda display, value: _drive(display, display.drive.max_force, nmm(value)),
    (16.0, math.inf),
    lambda display: f"{to_nmm(display.drive.max_moment):.10g}",
)
STRAIN = Dial(
    "rod.max_strain",
    lambda display: display.rod.max_strain,
    _strained,
    (16.0, 0.1),
    lambda display: f"{display.rod.max_strain:.10g}",
)
ANGLE = Dial(
    "limits.angle_deg",
    lambda display: to_deg(min(display.limits.angle.high, -display.limits.angle.low)),
    _steeper,
    (math.inf, 75.0),
    lambda display: _ends(display.limits.angle, to_deg),
)
LENGTH = Dial(
    "limits.length_mm",
    lambda display: to_mm(max(display.limits.length.high, display.span)),
    _longer,
    (1.6, math.inf),
    lambda display: _ends(display.limits.length, to_mm),
)
TOTAL = Dial(
    "rod.total_length_mm",
    lambda display: to_mm(display.rod.total_length),
    _cut,
    (4.0, math.inf),
    lambda display: f"{to_mm(display.rod.total_length):.10g}",
)


def _size(key: str) -> Dial:
    """The size in the plane, under the key that a file has for it."""
    return Dial(
        key,
        lambda display: to_mm(display.rod.thickness),
        _thicker,
        (4.0, math.inf),
        lambda display: f"{to_mm(display.rod.thickness):.10g}",
        probes=6,
    )


STRONGER = (
    *((FORCE,), (MOMENT,), (STRAIN,)),
    *((FORCE, MOMENT), (FORCE, STRAIN), (MOMENT, STRAIN), (FORCE, MOMENT, STRAIN)),
)
WIDER = ((LENGTH,), (ANGLE,), (ANGLE, LENGTH), (TOTAL,))
"""What is raised together, by one factor; nobody needs to know the last of `STRONGER` where even that does not help."""


def remedy(verifier: Verifier, shut: tuple[tuple[str, ...], ...]) -> str:
    """The first numbers with which plans lead from home into each of some states, as a file has them; empty if none.

    They have been tried as they are printed.
    """
    stronger = STRONGER if _DialSearch(verifier, shut, STRONGER[-1]).bracket() else ()
    size = _size("rod.thickness_mm" if isinstance(verifier.display.rod.section, Rectangle) else "rod.diameter_mm")
    for dials in (*stronger, *WIDER, (size,)):
        search = _DialSearch(verifier, shut, dials)
        if (bracket := search.bracket()) is not None:
            display = search.display(search.least(*bracket))
            return " and ".join(f"{dial.key} = {dial.written(display)}" for dial in dials)
    return ""


class _DialSearch:
    """The least factor by which some dials must be turned up."""

    def __init__(self, verifier: Verifier, shut: tuple[tuple[str, ...], ...], dials: tuple[Dial, ...]) -> None:
        self._prover = verifier
        self._shut = shut
        self._dials = dials
        self._known: dict[tuple[float, ...], bool] = {}

    def bracket(self) -> tuple[float, float] | None:
        """A factor that does not open all entries and a larger one that does; None if none does that is tried."""
        most, probes = max(self._most()), max(dial.probes for dial in self._dials)
        factors = [most ** (number / probes) for number in range(probes + 1)]
        return next((pair for pair in itertools.pairwise(factors) if self._opens(pair[1])), None)

    def least(self, low: float, high: float) -> float:
        """The least factor between two that opens all entries; rounding alone may, or what comes with a limit."""
        if self._opens(low):
            return low
        while high > CLOSE * low:
            middle = math.sqrt(low * high)
            low, high = (low, middle) if self._opens(middle) else (middle, high)
        return high

    def display(self, factor: float) -> Display:
        """The display with every dial turned up."""
        display = self._prover.display
        for dial, value in zip(self._dials, self._values(factor), strict=True):
            display = dial.put(display, value)
        return display

    def _most(self) -> Iterator[float]:
        for dial in self._dials:
            value, (factor, most) = dial.of(self._prover.display), dial.most
            yield max(1.0, min(factor, most / max(value, 1e-9)))

    def _values(self, factor: float) -> tuple[float, ...]:
        """Values with few digits, never less than the factor says."""
        limits = zip(self._dials, self._most(), strict=True)
        return tuple(rounded_up(dial.of(self._prover.display) * min(factor, most), DIGITS) for dial, most in limits)

    def _opens(self, factor: float) -> bool:
        values = self._values(factor)
        if values not in self._known:
            verifier = self._prover_of(self.display(factor))
            self._known[values] = all(_is_open(verifier, wanted) for wanted in self._shut)
        return self._known[values]

    def _prover_of(self, display: Display) -> Verifier:
        is_same_rod = self._prover.has_rod_of(display)
        return self._prover.like(display) if is_same_rod else Verifier(display, self._prover.tell)


def _is_open(verifier: Verifier, wanted: tuple[str, ...]) -> bool:
    try:
        nearest_shape(verifier, wanted, FUNNELS)
    except Infeasible:
        return False
    return True
