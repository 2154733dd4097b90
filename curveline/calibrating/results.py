"""What a calibration found, as JSON: mm, degrees, percent."""

from __future__ import annotations

import json

from curveline.calibrating.calibrated import RodCalibration
from curveline.system.files import AnyPath


def to_json(found: RodCalibration, path: AnyPath = "", argv: tuple[str, ...] = ()) -> bytes:
    """The document as one line."""
    return (json.dumps(found.document(argv), allow_nan=False) + "\n").encode()
