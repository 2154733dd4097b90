"""What a calibration found: numbers with intervals, what these shapes cannot tell, and what to measure next."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from curveline._version import __version__
from curveline.calibrating.request import CalibrationRequest
from curveline.calibrating.unknowns import ANGLE, ASYMMETRY, FRAME, GIVE, LENGTH, SCALE, SHIFT_X, SHIFT_Y, TURN, WEIGHT
from curveline.notebook import html_of, svg_of
from curveline.scene import Display
from curveline.simulation.results import Document
from curveline.units import deg, to_deg, to_mm, to_nmm, to_nmm2

NEVER = "bending stiffness alone", "natural curvature"
"""What no shape tells: only the stiffness over the weight; and a bend that is alike all along does nothing between
rigid bearings, and between soft ones what turned nodes do."""
STIFFNESS, CLAMPS = "bending_stiffness_Nmm2", "clamp_stiffness_Nmm_per_deg"
KEY_DIGITS, DIGITS = 4, 5
"""Of numbers in a display file, and behind the point of those in documents."""
HEAD = ("shape", "state", "trials", "before mm", "after mm")
NAMES = {
    WEIGHT: "gravity length",
    GIVE: "bearings give",
    ASYMMETRY: "bending asymmetry",
    ANGLE: "angle of node {}",
    LENGTH: "length of segment {}",
    SHIFT_X: "camera, to the right",
    SHIFT_Y: "camera, up",
    TURN: "camera, turned",
    SCALE: "camera, larger",
}
"""What each kind of number is called; nodes and segments count from 1."""
UNITS = {
    WEIGHT: "mm", GIVE: "mm", ASYMMETRY: "%", ANGLE: "deg", LENGTH: "mm",
    SHIFT_X: "mm", SHIFT_Y: "mm", TURN: "deg", SCALE: "%",
}  # fmt: skip


@dataclass(frozen=True)
class Estimate:
    """A number that was fitted, in SI, and between which it lies at 95 %, grouped by shape.

    It `is_told` if that is near enough to be of use. If not, `mixed_with` is what these shapes hardly tell it apart
    from, "" if there is no one such number. The gravity length may have no upper end: infinite.
    """

    kind: str  # such as "give", see `NAMES`
    number: int  # of the node or segment, from 0
    value: float  # [m], [rad] or a part of 1
    low: float  # lower end
    high: float  # upper end
    is_told: bool
    mixed_with: str = ""

    @property
    def name(self) -> str:
        """What it is called in a report."""
        return NAMES[self.kind].format(self.number + 1)

    @property
    def is_of_camera(self) -> bool:
        """True for a number of the camera's frame, which is none of the display."""
        return self.kind in FRAME

    @property
    def unit(self) -> str:
        """In which it is reported."""
        return UNITS[self.kind]

    @property
    def as_given(self) -> tuple[float, float, float]:
        """Value and both ends in that unit."""
        convert = {"mm": to_mm, "deg": to_deg}.get(self.unit, _percent)
        return convert(self.value), convert(self.low), convert(self.high)


@dataclass(frozen=True)
class ShapeRow:
    """What trials of a shape in one state are off, across the curve, by the file as it was and by the one found [m].

    `before` is None if the file's display has no such state.
    """

    name: str  # of the shape
    segment: int  # from 0
    state: str  # in which the trials are
    trials: int  # how many
    before: float | None  # [m]
    after: float  # [m]


@dataclass(frozen=True)
class NextShape:
    """Shapes of which three trials each would tell most of the number that is known least.

    `share` is how large its interval would be expected to be then, over what it is now.
    """

    shapes: tuple[str, ...]  # by name
    about: str  # name of that number
    share: float


@dataclass(frozen=True, eq=False)
class RodCalibration:
    """A display as trials of its shapes have it.

    `display` is as its file has it, `calibrated` with what was found; it has no asymmetry, which simulation does not
    know: where there is one, the `estimates` are those with it and the file has the best numbers without.
    """

    display: Display
    calibrated: Display
    estimates: tuple[Estimate, ...]
    rows: tuple[ShapeRow, ...]  # one per shape and state
    left: tuple[tuple[str, str], ...]  # trials that were not used, and why
    next_shape: NextShape | None  # what to measure next, if anything helps
    request: CalibrationRequest  # as asked for
    rms: float  # [m] across the curves, with the camera's frame as found
    has_asymmetry: bool = False  # among the estimates
    shapes: int = 0  # that were used

    @property
    def before(self) -> float | None:
        """Root mean square of what trials were off [m], over the rows; None if the file misses a state."""
        return _whole([row.before for row in self.rows], [row.trials for row in self.rows])

    @property
    def after(self) -> float:
        """The same by the calibrated display [m], the camera's frame left as it is."""
        whole = _whole([row.after for row in self.rows], [row.trials for row in self.rows])
        return math.nan if whole is None else whole

    @property
    def untold(self) -> tuple[Estimate, ...]:
        """The numbers that these shapes do not tell."""
        return tuple(each for each in self.estimates if not each.is_told)

    def estimate(self, kind: str, number: int = 0) -> Estimate:
        """The number of a kind, of a node or segment from 0; KeyError if it was not fitted."""
        for each in self.estimates:
            if (each.kind, each.number) == (kind, number):
                return each
        raise KeyError(kind)

    def document(self, argv: tuple[str, ...] = ()) -> Document:
        """What `curveline calibrate rod --json` prints, as plain data; `argv` is the command as typed."""
        return _document(self, argv)

    @property
    def keys(self) -> dict[str, Any]:
        """What is to be written into the display file, table by table; of bearings that give nothing, nothing."""
        display = self.calibrated
        offsets = {
            "angle_deg": [_short(to_deg(each)) for each in display.offsets.angles],
            "length_mm": [_short(to_mm(each)) for each in display.offsets.lengths],
        }
        keys: dict[str, Any] = {}
        if math.isfinite(display.clamp_stiffness):
            keys[CLAMPS] = float(f"{to_nmm(display.clamp_stiffness * deg(1.0)):.{KEY_DIGITS}g}")
        if any(each.kind == WEIGHT for each in self.estimates):
            keys["rod"] = {STIFFNESS: float(f"{to_nmm2(display.rod.bending_stiffness):.{KEY_DIGITS}g}")}
        return {**keys, "offsets": offsets}

    def with_next(self, next_shape: NextShape | None) -> RodCalibration:
        """The same, with what to measure next."""
        return replace(self, next_shape=next_shape)

    def _repr_svg_(self) -> str | None:
        return svg_of("curveline.figures.calibrations:draw", self)

    def _repr_html_(self) -> str:
        rows = [
            (row.name, row.state, row.trials, None if row.before is None else to_mm(row.before), to_mm(row.after))
            for row in self.rows
        ]
        remarks = [
            f"{each.name}: {each.as_given[0]:.4g} {each.unit}, {each.as_given[1]:.4g} to {each.as_given[2]:.4g}"
            for each in self.estimates
        ]
        return html_of(f"{self.display.name}, calibrated", [HEAD, *rows], self._repr_svg_(), remarks=remarks)


def _percent(part: float) -> float:
    return 100.0 * part


def _whole(values: list[float | None], counts: list[int]) -> float | None:
    known = [value for value in values if value is not None]
    if not known or len(known) < len(values):
        return None
    total = math.fsum(count * value * value for count, value in zip(counts, known, strict=True))
    return math.sqrt(total / sum(counts))


def _document(found: RodCalibration, argv: tuple[str, ...]) -> Document:
    after = found.next_shape
    return {
        "curveline": __version__,
        "argv": list(argv),
        "display": found.display.name,
        "file": found.display.path or None,
        "shapes": found.shapes,
        "numbers": [_estimate(each) for each in found.estimates],
        "never_told": list(NEVER),
        "has_asymmetry": found.has_asymmetry,
        "rms_mm": {"before": _mm(found.before), "after": _mm(found.after), "with_frame": _mm(found.rms)},
        "rows": [_row(row) for row in found.rows],
        "left_out": [{"trial": source, "reason": reason} for source, reason in found.left],
        "next": None if after is None else {"shapes": list(after.shapes), "about": after.about, "share": after.share},
        "write": found.keys,
    }


def _estimate(found: Estimate) -> Document:
    value, low, high = found.as_given
    return {
        "name": found.name,
        "unit": found.unit,
        "value": _round(value),
        "interval_95": [_round(low), _round(high)],
        "is_told": found.is_told,
        "mixed_with": found.mixed_with or None,
    }


def _row(row: ShapeRow) -> Document:
    return {
        "shape": row.name,
        "segment": row.segment + 1,
        "state": row.state,
        "trials": row.trials,
        "before_mm": _mm(row.before),
        "after_mm": _mm(row.after),
    }


def _mm(length: float | None) -> float | None:
    return None if length is None else _round(to_mm(length))


def _round(value: float) -> float | None:
    """A number with a few digits; None for one that is none, or infinite."""
    return round(value, DIGITS) if math.isfinite(value) else None


def _short(value: float) -> float:
    return float(f"{value:.{KEY_DIGITS}g}")
