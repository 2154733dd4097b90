"""What trials of a display show beside the model: which state they are in, how alike they are, how far off.

It follows *A Multi-Stable Curved Line Shape Display*, V-A: the mean standard deviation (MSD) between trials and the
root mean square error (RMSE) of the model, both of heights over the width that all have.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean

from curveline._version import __version__
from curveline.cameras.outcomes import TrialOutcome
from curveline.comparing.naming import ModelCurve
from curveline.errors import InvalidInput
from curveline.notebook import html_of, svg_of
from curveline.scene import Scene
from curveline.simulation.results import Document, provenance
from curveline.trial import Array, Trial
from curveline.units import to_mm

DIGITS = 4
"""Behind the point, of lengths in mm."""
HEAD = ("shape", "trials", "state", "MSD mm", "RMSE mm", "across mm", "as wanted")


@dataclass(frozen=True)
class CompareRequest:
    """How trials are compared.

    `ddof` is 1 for the standard deviation of what the trials are a sample of, 0 for that of the trials themselves.
    `vertical_range` [m] is what percentages are of; None for the way that a node can go up and down.
    """

    ddof: int = 1
    vertical_range: float | None = None
    max_rmse: float | None = None  # [m], beyond which a shape does not agree

    def __post_init__(self) -> None:
        if self.ddof not in (0, 1):
            raise InvalidInput(f"there is no ddof {self.ddof}", "choose 0 or 1")
        for name, value in (("vertical range", self.vertical_range), ("RMSE", self.max_rmse)):
            if value is not None and not 0.0 < value < float("inf"):
                raise InvalidInput(f"no {name} is {value!r} m", "choose a length above 0")


@dataclass(frozen=True)
class StateMisfit:
    """How far trials are from a stable state of a segment [m]; `rmse` is None where a curve overhangs."""

    name: str  # of the state
    rmse: float | None  # of heights
    across: float  # root mean square distance across the curve


@dataclass(frozen=True, eq=False)
class SegmentAgreement:
    """What the trials that count show of a segment; curves are in the display's frame [m].

    `mean` and `deviation (k,)` are those of heights over `x (k,)`, NaN where a trial does not tell; all three are empty
    where one overhangs.
    """

    wanted: str  # the state that the shape asks for
    state: str  # the one that the trials are in; "" if they are in none
    misfits: tuple[StateMisfit, ...]  # to every stable state, the nearest first
    msd: float | None  # [m], None of one trial, or where one overhangs
    x: Array
    mean: Array
    deviation: Array
    curves: tuple[ModelCurve, ...]  # every stable state of the model

    @property
    def nearest(self) -> StateMisfit | None:
        """That of the state which the trials are in; None if they are in none."""
        return next((each for each in self.misfits if each.name == self.state), None)


@dataclass(frozen=True)
class NamedTrial:
    """A trial with the state of each segment; `counts` if it goes into the numbers of its shape."""

    trial: Trial  # what came of it
    states: tuple[str, ...]  # left to right, none if it cannot be used
    counts: bool


@dataclass(frozen=True, eq=False)
class ShapeAgreement:
    """What all trials of a shape show."""

    scene: Scene  # what the display was sent
    trials: tuple[NamedTrial, ...]  # with what each shows
    segments: tuple[SegmentAgreement, ...]  # left to right; none if no trial could be used
    request: CompareRequest  # as asked for

    @property
    def vertical_range(self) -> float:
        """What percentages are of [m]."""
        heights = self.scene.display.limits.height
        return self.request.vertical_range or heights.high - heights.low

    @property
    def states(self) -> tuple[str, ...]:
        """The states that the trials which count are in; "" where in none."""
        return tuple(each.state for each in self.segments)

    @property
    def msd(self) -> float | None:
        """Mean of that of the segments [m]."""
        return _mean([each.msd for each in self.segments])

    @property
    def rmse(self) -> float | None:
        """Mean of that of the segments [m], each to the state that the trials are in."""
        return _mean([each.nearest.rmse if each.nearest else None for each in self.segments])

    @property
    def across(self) -> float | None:
        """As `rmse`, across the curve."""
        return _mean([each.nearest.across if each.nearest else None for each in self.segments])

    @property
    def is_wanted(self) -> bool:
        """True if all trials that could be used are in the states that the shape asks for, and there are any."""
        wanted = tuple(segment.state for segment in self.scene.segments)
        seen = [each.states for each in self.trials if each.trial.outcome is TrialOutcome.SEEN]
        return bool(seen) and all(states == wanted for states in seen)

    @property
    def is_near(self) -> bool:
        """True unless it is farther off than was asked for."""
        most, off = self.request.max_rmse, self.across if self.rmse is None else self.rmse
        return most is None or (off is not None and off <= most)


@dataclass(frozen=True, eq=False)
class Comparison:
    """Several shapes, each with its trials, beside the model."""

    shapes: tuple[ShapeAgreement, ...]  # in the order of their names

    @property
    def agreeing(self) -> tuple[ShapeAgreement, ...]:
        """The shapes of which all trials are in the wanted states: those that means are of."""
        return tuple(each for each in self.shapes if each.is_wanted)

    @property
    def is_good(self) -> bool:
        """True if every shape is in the wanted states, and as near as was asked for."""
        return all(each.is_wanted and each.is_near for each in self.shapes)

    @property
    def msd(self) -> float | None:
        """Mean over the shapes in the wanted states [m]."""
        return _mean([each.msd for each in self.agreeing])

    @property
    def rmse(self) -> float | None:
        """Mean over the shapes in the wanted states [m]."""
        return _mean([each.rmse for each in self.agreeing])

    def document(self, argv: tuple[str, ...] = ()) -> Document:
        """What `curveline compare --json` prints, as plain data; `argv` is the command as typed."""
        return _document(self, argv)

    def rows(self) -> list[tuple[object, ...]]:
        """A row of plain values per shape, as `HEAD` names them."""
        return [
            (
                each.scene.name,
                sum(trial.counts for trial in each.trials),
                ", ".join(each.states),
                *(None if value is None else to_mm(value) for value in (each.msd, each.rmse, each.across)),
                each.is_wanted,
            )
            for each in self.shapes
        ]

    def _repr_svg_(self) -> str | None:
        return svg_of("curveline.figures.comparisons:draw", self)

    def _repr_html_(self) -> str:
        return html_of(f"{len(self.shapes)} shapes beside the model", [HEAD, *self.rows()], self._repr_svg_())


def _mean(values: Sequence[float | None]) -> float | None:
    known = [each for each in values if each is not None]
    return fmean(known) if known and len(known) == len(values) else None


def _document(found: Comparison, argv: tuple[str, ...]) -> Document:
    return {
        "curveline": __version__,
        "agrees": found.is_good,
        "agreeing": [each.scene.name for each in found.agreeing],
        "msd_mm": in_mm(found.msd),
        "rmse_mm": in_mm(found.rmse),
        "shapes": [_shape(each, argv) for each in found.shapes],
    }


def _shape(found: ShapeAgreement, argv: tuple[str, ...]) -> Document:
    request = found.request
    asked = {"ddof": request.ddof, "max_rmse_mm": in_mm(request.max_rmse)}
    numbers = {"msd": found.msd, "rmse": found.rmse, "across": found.across}
    return {
        "shape": found.scene.name,
        "wanted": [segment.state for segment in found.scene.segments],
        "states": list(found.states),
        "is_wanted": found.is_wanted,
        "is_near": found.is_near,
        **{f"{name}_mm": in_mm(value) for name, value in numbers.items()},
        **{f"{name}_percent": percent(value, found.vertical_range) for name, value in numbers.items()},
        "vertical_range_mm": to_mm(found.vertical_range),
        "ddof": request.ddof,
        "trials": [_trial(each) for each in found.trials],
        "segments": [_segment(each) for each in found.segments],
        "provenance": provenance(found.scene, asked, argv),
    }


def percent(length: float | None, whole: float) -> float | None:
    """A length as percentage of a whole."""
    return None if length is None else 100.0 * length / whole


def _trial(found: NamedTrial) -> Document:
    trial = found.trial
    return {
        "source": trial.source,
        "outcome": trial.outcome.value,
        "reason": trial.reason or None,
        "states": list(found.states),
        "counts": found.counts,
        "sigma_mm": [in_mm(curve.sigma) if curve.sigma else None for curve in trial.curves],
    }


def _segment(found: SegmentAgreement) -> Document:
    return {
        "wanted": found.wanted,
        "state": found.state,
        "msd_mm": in_mm(found.msd),
        "misfits": [_misfit(each) for each in found.misfits],
    }


def _misfit(found: StateMisfit) -> Document:
    return {"state": found.name, "rmse_mm": in_mm(found.rmse), "across_mm": in_mm(found.across)}


def in_mm(length: float | None) -> float | None:
    """A length as documents have it; None if it is not known."""
    return None if length is None or not math.isfinite(length) else round(to_mm(length), DIGITS)
