"""What a calibration found, in text for terminals of 80 columns."""

from __future__ import annotations

import sys
from collections.abc import Iterator

from curveline.calibrating.calibrated import Estimate, RodCalibration, ShapeRow
from curveline.cli.printing import screen
from curveline.cli.printing.manner import MANNER
from curveline.cli.printing.tables import fitting
from curveline.phrases import counted, wrapped
from curveline.system.files import printable
from curveline.units import decimals_of, to_mm

NUMBER_HEAD = ("number", "value", "from", "to", "unit", "told")
SHAPE_HEAD = ("shape", "state", "trials", "before mm", "after mm")
NEVER = (
    "no shape tells EI alone, only the gravity length; nor a bend of the free rod that is alike all along: with rigid "
    "bearings it moves nothing, with soft ones it is an angle of the nodes"
)


def describe(found: RodCalibration) -> Iterator[str]:
    """Lines of text on what was found."""
    if MANNER.is_brief:
        yield _briefly(found)
        return
    yield screen.paint(printable(found.display.name), screen.BOLD, sys.stdout)
    rows = [_number(each) for each in found.estimates]
    yield from screen.headed(fitting([NUMBER_HEAD, *rows], frozenset({0, 4})), NUMBER_HEAD, rows)
    yield f"intervals at 95 %, by how much {counted(found.shapes, 'shape')} disagree"
    yield from _untold(found)
    if found.has_asymmetry:
        yield from wrapped(
            "the rod bends harder to one side; simulation knows nothing of that, and the display file has it in a "
            "comment only"
        )
    yield from wrapped(NEVER)
    shapes = [_row(row) for row in found.rows]
    yield from screen.headed(fitting([SHAPE_HEAD, *shapes], frozenset({0, 1})), SHAPE_HEAD, shapes)
    yield from wrapped(_rms(found))
    for source, reason in found.left:
        yield from wrapped(f"left out: {printable(source)}: {printable(reason)}")
    if found.next_shape is not None:
        yield from wrapped(_next(found))


def _briefly(found: RodCalibration) -> str:
    told = [
        f"{each.name} {_shown(each)[0]} {each.unit}"
        for each in found.estimates
        if each.is_told and not each.is_of_camera
    ]
    return f"{printable(found.display.name)}: {', '.join(told) or 'nothing is told'}; {_rms(found)}"


def _number(found: Estimate) -> tuple[str, ...]:
    value, low, high = _shown(found)
    return found.name, value, low, high, found.unit, "yes" if found.is_told else "no"


def _shown(found: Estimate) -> tuple[str, str, str]:
    """Value and ends with as many decimals as the interval has any use for."""
    value, low, high = found.as_given
    width = high - low
    decimals = min(decimals_of(width, 2), 4) if width < float("inf") else 0
    shown = [screen.decimal(each, decimals) if abs(each) < float("inf") else "any" for each in (value, low, high)]
    return shown[0], shown[1], shown[2]


def _untold(found: RodCalibration) -> Iterator[str]:
    for each in found.untold:
        apart = f", hardly apart from: {each.mixed_with}" if each.mixed_with else ""
        yield from wrapped(f"these shapes do not tell: {each.name}{apart}")


def _row(row: ShapeRow) -> tuple[str, ...]:
    state = row.state if row.segment == 0 else f"{row.segment + 1}: {row.state}"
    before = "no such state" if row.before is None else f"{to_mm(row.before):.2f}"
    return printable(row.name), state, str(row.trials), before, f"{to_mm(row.after):.2f}"


def _rms(found: RodCalibration) -> str:
    before = "" if found.before is None else f", {to_mm(found.before):.2f} mm before"
    return f"off the trials by {to_mm(found.after):.2f} mm RMS across the curves{before}"


def _next(found: RodCalibration) -> str:
    after = found.next_shape
    assert after is not None, "asked only if there is one"
    less = round(100.0 * (1.0 - after.share))
    if less < 1:
        return f"what is known least, {after.about}, no further shape would tell much better"
    what = " and ".join(after.shapes)
    return f"measure {what} next: the interval of {after.about}, known least, would become {less} % shorter"
