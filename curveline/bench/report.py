"""What a run of the benchmark leaves: one JSON document for trends."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from typing import Any, NamedTuple

from curveline._version import __version__
from curveline.bench.measurement import Measurement
from curveline.bench.trade import TradePoint

PACKAGES = ("numpy", "scipy", "numba", "pyelastica", "mujoco")


class BenchReport(NamedTuple):
    """The rows that are held against goals, and the points of the trade."""

    rows: Sequence[Measurement]
    points: Sequence[TradePoint]


def document(report: BenchReport) -> dict[str, Any]:
    """What was measured, and what on; plain Python types only."""
    return {
        "curveline": __version__,
        "versions": {"python": platform.python_version(), **{name: _version(name) for name in PACKAGES}},
        "machine": {"cores": os.cpu_count(), "processor": platform.machine(), "system": platform.system()},
        "rows": [asdict(row) for row in report.rows],
        "trade": [asdict(point) for point in report.points],
    }


def to_json(report: BenchReport) -> bytes:
    """The document as one line."""
    return (json.dumps(document(report), allow_nan=False) + "\n").encode()


def _version(package: str) -> str | None:
    """Of an installed package."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None
