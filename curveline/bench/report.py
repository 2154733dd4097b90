"""What a run of the benchmark leaves: one JSON document for trends."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from curveline.bench.machine import Conditions, conditions
from curveline.bench.measurement import Measurement, missed
from curveline.bench.trade import TradePoint
from curveline.notebook import html_of, svg_of

MARKER = "curveline_bench"
FORMAT = 1
"""Of the document; whoever changes what a key means, or takes one away, counts on."""
ROD, LINK = "rod", "link"
"""What figures are of: the rod and its states, or the radio link."""


@dataclass(frozen=True)
class BenchReport:
    """What a run of the benchmark measured, and under which conditions."""

    rows: Sequence[Measurement]  # held against goals
    points: Sequence[TradePoint] = ()  # of the trade
    conditions: Conditions = field(default_factory=conditions)  # machine, load, versions
    kind: str = ROD  # "rod" or "link"
    shapes: Sequence[str] = ()  # names of those that were measured

    @property
    def missed(self) -> list[str]:
        """The names of figures that miss their goals."""
        return missed(self.rows)

    def document(self) -> dict[str, Any]:
        """What was measured, and what on, as plain data."""
        return document(self)

    def _repr_svg_(self) -> str | None:
        return svg_of("curveline.bench.trade_figure:draw", self) if self.points else None

    def _repr_html_(self) -> str:
        head = ("figure", "value", "unit", "goal", "over bare Newton", "over solve_bvp", "how")
        rows = [
            (row.name, row.value, row.unit, row.goal, row.over_bare_newton, row.over_solve_bvp, row.how)
            for row in self.rows
        ]
        remarks = ["the machine was busy: distrust these figures"] if self.conditions.is_busy else []
        return html_of(f"{len(self.missed)} goals missed", [head, *rows], self._repr_svg_(), remarks=remarks)


def document(report: BenchReport) -> dict[str, Any]:
    """What was measured, and what on; plain Python types only."""
    return {
        MARKER: FORMAT,
        "kind": report.kind,
        **asdict(report.conditions),
        "shapes": list(report.shapes),
        "rows": [asdict(row) for row in report.rows],
        "missed": report.missed,
        "trade": [asdict(point) for point in report.points],
    }


def to_json(report: BenchReport) -> bytes:
    """The document as one line."""
    return (json.dumps(document(report), allow_nan=False) + "\n").encode()
