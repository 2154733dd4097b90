"""How far an axis goes per turn of its gear: a way by its counts, the same by a ruler, several times."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from math import copysign, isfinite, sqrt
from typing import Any

from curveline.drive_settings import AXES, UNITS
from curveline.driving.node_check import Finding
from curveline.driving.node_errands import Jogged, NodePlace, jog, unhomed_most
from curveline.errors import InvalidInput
from curveline.system.files import AnyPath, write_file

USUAL_WAY = {"mm": 50.0, "deg": 30.0}
"""How far an axis goes, by unit."""
REPEATS = 3
MOST_REPEATS = 50
TOLERANCE = 0.05
"""A ratio that is further from 1 is no matter of tolerances of parts."""
SHIPPED_GEAR = 298
GEARS = (30, 50, 75, 100, 150, 210, 250, 380, 1000)
"""Ratios that gear motors of this kind are sold with, besides ours."""
GEAR_MATCH = 0.03
DIGITS = 6


@dataclass(frozen=True)
class Calibration:
    """Ways by counts and by a ruler, and what the display file should say; `unit` is mm or deg."""

    axis: str  # its name
    unit: str  # mm or deg
    key: str  # of the display file's [drive]
    ways: tuple[float, ...]  # by its counts and the display file as it is
    measured: tuple[float, ...]  # by a ruler
    old: float  # what the file says per turn
    new: float  # what it should say
    error: float | None  # standard error of `new`, None of a single measurement
    findings: tuple[Finding, ...]  # what the ratio says of the parts

    @property
    def ratio(self) -> float:
        """The way that the axis makes, by that which it should make."""
        return self.new / self.old

    def document(self) -> dict[str, Any]:
        """The same as plain data."""
        return {**asdict(self), "ratio": self.ratio}


Ruler = Callable[[int, Jogged], float]
"""Asked, with the number of the try from 1 and what the counts say, for the way by a ruler [mm or degrees]."""


def calibrate(
    place: NodePlace, name: str, ruler: Ruler, *, way: float | None = None, repeats: int = REPEATS
) -> Calibration:
    """Move an axis there and back again several times, and ask `ruler` each time how far it went.

    `way` is in mm or degrees; without one it is 50 mm or 30 degrees, or what an axis is allowed that is not homed.
    """
    number = place.axis(name)
    if not 1 <= repeats <= MOST_REPEATS:
        raise InvalidInput(f"an axis cannot be measured {repeats} times", f"say 1 to {MOST_REPEATS}")
    unit = UNITS[number - 1]
    is_homed = place.report().axes[number - 1] == 0
    wanted = way if way is not None else _usual(place, number, is_homed=is_homed)
    ways, measured = [], []
    for attempt in range(1, repeats + 1):
        gone = jog(place, name, wanted, unhomed=not is_homed)
        said = ruler(attempt, gone)
        if not isfinite(said) or said * gone.way <= 0.0:
            raise InvalidInput(
                f"an axis that went {gone.way:.6g} {unit} cannot have gone {said:g}", f"measure it in {unit}"
            )
        ways.append(gone.way)
        measured.append(said)
        jog(place, name, -copysign(min(abs(gone.way), abs(wanted)), gone.way), unhomed=not is_homed)
    return _calibration(place, number, tuple(ways), tuple(measured))


def mock_ruler(place: NodePlace) -> Callable[[Jogged], float] | None:
    """A ruler laid to a mock display; None for a real one, which somebody has to measure."""
    lay: Callable[[int, int, float], float] | None = getattr(place.radio, "ruler", None)
    if lay is None:
        return None
    return lambda gone: lay(place.number, place.axis(gone.axis), gone.way)


def written(calibration: Calibration, display: AnyPath) -> str:
    """The text of a display file with what was found in it, comments kept; InvalidInput for a built-in display."""
    from curveline.shapes.changed_display import changed_text, text_of
    from curveline.shapes.files import given_display

    named = os.fspath(display)
    given = given_display(named)
    if not given.path:
        hint = "`curveline new display` makes a file to be changed; measure with that"
        raise InvalidInput(f"{named} is a built-in display, and stays as it is", hint)
    return changed_text(text_of(given), {("drive", calibration.key): calibration.new}, named)


def write_calibration(calibration: Calibration, display: AnyPath) -> None:
    """Put what was found into a display file, and leave the rest of it as it is; else as `written`."""
    write_file(display, written(calibration, display).encode(), force=True)


def counts_per_turn(display: AnyPath) -> float:
    """What a display file says."""
    from curveline.shapes.changed_display import text_of
    from curveline.shapes.files import given_display

    return float(tomllib.loads(text_of(given_display(os.fspath(display))))["drive"]["counts_per_turn"])


def in_turns(calibration: Calibration, per_turn: float) -> Calibration:
    """A calibration of one unit per turn, with what the file says of a turn."""
    error = None if calibration.error is None else calibration.error * per_turn
    return replace(calibration, old=per_turn, new=_round(calibration.new * per_turn), error=error)


def _usual(place: NodePlace, number: int, *, is_homed: bool) -> float:
    usual = USUAL_WAY[UNITS[number - 1]]
    return usual if is_homed else min(usual, unhomed_most(place, number))


def _calibration(place: NodePlace, number: int, ways: tuple[float, ...], measured: tuple[float, ...]) -> Calibration:
    ratios = [said / way for said, way in zip(measured, ways, strict=True)]
    mean = sum(ratios) / len(ratios)
    error = None
    if len(ratios) > 1:
        error = sqrt(sum((each - mean) ** 2 for each in ratios) / (len(ratios) - 1) / len(ratios))
    name, unit = AXES[number - 1], UNITS[number - 1]
    return Calibration(
        name, unit, f"{name}_{unit}_per_turn", ways, measured, 1.0, mean, error, tuple(_findings(name, mean))
    )


def _findings(name: str, ratio: float) -> list[Finding]:
    if abs(ratio - 1.0) <= TOLERANCE:
        return []
    text = f"{name} goes {ratio:.3g} times as far as the display file says"
    fitting = [gear for gear in GEARS if abs(ratio * gear / SHIPPED_GEAR - 1.0) <= GEAR_MATCH]
    as_if = f", as a gear of {fitting[0]}:1 in place of {SHIPPED_GEAR}:1 would" if fitting else ""
    hint = "look at the motor's gear and at the pinion; if they are meant so, write down what was measured"
    return [Finding("gear", text + as_if, hint)]


def _round(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
