"""What a comparison found, as JSON and CSV: mm, and percentages of the vertical range."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator

from curveline._version import __version__
from curveline.comparing.agreement import Comparison, NamedTrial, SegmentAgreement, ShapeAgreement, StateMisfit
from curveline.simulation.results import Document, provenance
from curveline.units import to_mm

DIGITS = 4
"""Behind the point, of lengths in mm."""
COLUMNS = ("shape", "segment", "wanted", "state", "x_mm", "mean_mm", "deviation_mm")


def document(found: Comparison, argv: tuple[str, ...] = ()) -> Document:
    """What `curveline compare --json` prints; plain Python types only."""
    return {
        "curveline": __version__,
        "agrees": found.is_good,
        "agreeing": [each.scene.name for each in found.agreeing],
        "msd_mm": _mm(found.msd),
        "rmse_mm": _mm(found.rmse),
        "shapes": [_shape(each, argv) for each in found.shapes],
    }


def _shape(found: ShapeAgreement, argv: tuple[str, ...]) -> Document:
    request = found.request
    asked = {"ddof": request.ddof, "max_rmse_mm": _mm(request.max_rmse)}
    numbers = {"msd": found.msd, "rmse": found.rmse, "across": found.across}
    return {
        "shape": found.scene.name,
        "wanted": [segment.state for segment in found.scene.segments],
        "states": list(found.states),
        "is_wanted": found.is_wanted,
        "is_near": found.is_near,
        **{f"{name}_mm": _mm(value) for name, value in numbers.items()},
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
        "sigma_mm": [_mm(curve.sigma) if curve.sigma else None for curve in trial.curves],
    }


def _segment(found: SegmentAgreement) -> Document:
    return {
        "wanted": found.wanted,
        "state": found.state,
        "msd_mm": _mm(found.msd),
        "misfits": [_misfit(each) for each in found.misfits],
    }


def _misfit(found: StateMisfit) -> Document:
    return {"state": found.name, "rmse_mm": _mm(found.rmse), "across_mm": _mm(found.across)}


def _mm(length: float | None) -> float | None:
    return None if length is None else round(to_mm(length), DIGITS)


def to_json(found: Comparison, argv: tuple[str, ...] = ()) -> bytes:
    """The document as one line."""
    return (json.dumps(document(found, argv), allow_nan=False) + "\n").encode()


def to_csv(found: Comparison, argv: tuple[str, ...] = ()) -> bytes:
    """A row per place of a mean curve: its height, the standard deviation between trials, and every stable state's."""
    names = list(dict.fromkeys(each.name for shape in found.shapes for part in shape.segments for each in part.curves))
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow((*COLUMNS, *(f"{name}_mm" for name in names)))
    for shape in found.shapes:
        for number, part in enumerate(shape.segments, start=1):
            writer.writerows(_rows((shape.scene.name, number, part.wanted, part.state), part, names))
    return stream.getvalue().encode()


def _rows(head: tuple[object, ...], part: SegmentAgreement, names: list[str]) -> Iterator[tuple[object, ...]]:
    from curveline.comparing.measures import heights_at

    by_name = {each.name: heights_at(each.points, part.x) for each in part.curves} if part.x.size else {}
    for place, x in enumerate(part.x.tolist()):
        deviation = _mm(float(part.deviation[place])) if part.deviation.size else None
        heights = [by_name.get(name) for name in names]
        told = [None if each is None else _mm(float(each[place])) for each in heights]
        yield *head, _mm(x), _mm(float(part.mean[place])), deviation, *told
