"""What a calibration found, as JSON: mm, degrees, percent."""

from __future__ import annotations

import json
import math

from curveline._version import __version__
from curveline.calibrating.calibrated import Estimate, RodCalibration, ShapeRow
from curveline.calibrating.display_file import found_keys
from curveline.simulation.results import Document
from curveline.system.files import AnyPath
from curveline.units import to_mm

DIGITS = 5


def document(found: RodCalibration, argv: tuple[str, ...] = ()) -> Document:
    """What `curveline calibrate rod --json` prints; plain Python types only."""
    after = found.next_shape
    return {
        "curveline": __version__,
        "argv": list(argv),
        "display": found.display.name,
        "file": found.display.path or None,
        "shapes": found.shapes,
        "numbers": [_estimate(each) for each in found.estimates],
        "has_asymmetry": found.has_asymmetry,
        "rms_mm": {"before": _mm(found.before), "after": _mm(found.after), "with_frame": _mm(found.rms)},
        "rows": [_row(row) for row in found.rows],
        "left_out": [{"trial": source, "reason": reason} for source, reason in found.left],
        "next": None if after is None else {"shapes": list(after.shapes), "about": after.about, "share": after.share},
        "write": found_keys(found),
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


def to_json(found: RodCalibration, path: AnyPath = "", argv: tuple[str, ...] = ()) -> bytes:
    """The document as one line."""
    return (json.dumps(document(found, argv), allow_nan=False) + "\n").encode()
