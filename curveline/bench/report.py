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
from curveline.notebook import html_of, svg_of

PACKAGES = ("numpy", "scipy", "numba", "pyelastica", "mujoco")


class BenchReport(NamedTuple):
    """The rows that are held against goals, and the points of the trade."""

    rows: Sequence[Measurement]  # held against goals
    points: Sequence[TradePoint]  # of the trade

    def document(self) -> dict[str, Any]:
        """What was measured, and what on, as plain data."""
        return document(self)

    def _repr_svg_(self) -> str | None:
        return svg_of("curveline.bench.trade_figure:draw", self) if self.points else None

    def _repr_html_(self) -> str:
        missed = sum(row.is_missed for row in self.rows)
        rows = [(row.name, row.value, row.unit, row.goal, row.how) for row in self.rows]
        return html_of(f"{missed} goals missed", [("figure", "value", "unit", "goal", "how"), *rows], self._repr_svg_())


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
