"""What a ranking of errors found: as tables for people, the most important error first, and as plain data."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from curveline.phrases import counted
from curveline.replay.error_sizes import key_of, name_of
from curveline.replay.ranking import Ranking
from curveline.replay.sensitivity import CONFIDENCE, Effects, Estimates
from curveline.rod.problem import Array
from curveline.units import to_mm

HEAD = ("error", "alone %", "95 %", "in all %", "95 %")

FOREMOST = 3
"""Errors that a sentence names."""

Rows = list[Sequence[object]]


def ranking_tables(ranking: Ranking) -> Iterator[tuple[str, Rows]]:
    """A title and a table with its heading of what decides whether runs are good, then of what moves the curve."""
    played = counted(ranking.plays, "run")
    if ranking.share is None:
        yield f"good runs: of {played} all end alike, whatever is drawn", []
    else:
        turned = [f"{100.0 * share:.1f}" for share in ranking.turned]
        rows = _rows(ranking, ranking.share, turned)
        yield f"what decides whether a run is good, from {played}", [(*HEAD, "turns %"), *rows]
    if ranking.curve is None:
        yield "the curve: there is none in the wanted states, or nothing moves it", []
    else:
        moves = [f"{to_mm(move):.2f}" for move in moves_of(ranking.curve, ranking.spread)]
        title = f"what moves the curve: {to_mm(ranking.spread):.2f} mm about its mean, {to_mm(ranking.off):.2f} mm off"
        some = (
            "" if ranking.rows == ranking.samples else f", where it exists: {ranking.rows} of {ranking.samples} samples"
        )
        yield f"{title} the plan, RMS{some}", [(*HEAD, "in all mm"), *_rows(ranking, ranking.curve, moves)]


def ranking_sentences(ranking: Ranking) -> Iterator[str]:
    """The errors that matter most, in a sentence for each outcome that varies."""
    if ranking.share is not None:
        yield f"good runs: {_foremost(ranking, ranking.share)}"
    if ranking.curve is not None:
        yield f"curve, {to_mm(ranking.spread):.2f} mm about its mean: {_foremost(ranking, ranking.curve)}"


def _foremost(ranking: Ranking, effects: Effects) -> str:
    first = _order(effects)[:FOREMOST]
    return ", ".join(f"{name_of(ranking.inputs[i])} {100.0 * effects.total.value[i]:.0f} %" for i in first)


def moves_of(effects: Effects, spread: float) -> list[float]:
    """How far each input moves the curve whatever the others are [m], the root mean square over the rod."""
    return [spread * math.sqrt(max(0.0, share)) for share in effects.total.value.tolist()]


def ranking_document(ranking: Ranking) -> dict[str, Any]:
    """The same as plain data, the most important error first; null where an outcome does not vary."""
    share: dict[str, Any] | None = None
    if ranking.share is not None:
        shares = [{"turned": turned} for turned in ranking.turned.tolist()]
        share = {"variance": ranking.share.variance, "inputs": _records(ranking, ranking.share, shares)}
    curve: dict[str, Any] | None = None
    if ranking.curve is not None:
        moves = [{"moves_mm": to_mm(move)} for move in moves_of(ranking.curve, ranking.spread)]
        curve = {
            "samples": ranking.rows,
            "spread_mm": to_mm(ranking.spread),
            "off_plan_mm": to_mm(ranking.off),
            "inputs": _records(ranking, ranking.curve, moves),
        }
    return {"plays": ranking.plays, "confidence": CONFIDENCE, "share": share, "curve": curve}


def _order(effects: Effects) -> list[int]:
    """The numbers of the inputs, the one with the largest total effect first."""
    totals: Array = effects.total.value
    return sorted(range(totals.size), key=lambda number: -float(totals[number]))


def _rows(ranking: Ranking, effects: Effects, last: Sequence[str]) -> Rows:
    return [
        (name_of(ranking.inputs[i]), *_cells(effects.first, i), *_cells(effects.total, i), last[i])
        for i in _order(effects)
    ]


def _cells(estimates: Estimates, number: int) -> tuple[str, str]:
    value, low, high = (100.0 * float(each[number]) for each in estimates)
    # No share is below nothing, although an estimate may be.
    return f"{max(0.0, value):.1f}", f"{max(0.0, low):.1f} to {max(0.0, high):.1f}"


def _records(ranking: Ranking, effects: Effects, more: Sequence[dict[str, float]]) -> list[dict[str, Any]]:
    return [
        {
            "input": key_of(ranking.inputs[i]),
            "first": _record(effects.first, i),
            "total": _record(effects.total, i),
            **more[i],
        }
        for i in _order(effects)
    ]


def _record(estimates: Estimates, number: int) -> dict[str, float]:
    return {key: float(each[number]) for key, each in zip(("share", "low", "high"), estimates, strict=True)}
