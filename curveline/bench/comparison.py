"""Two runs of the benchmark, row by row: what became slower, or faster, by more than the noise.

Seconds of two runs can be compared if they were taken on one machine with the same versions. Else only ratios within a
run can: times of a rod over that of Newton's method alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from typing import Any

from curveline.bench.machine import Conditions
from curveline.bench.measurement import RATE, TIMES, Measurement
from curveline.bench.report import BenchReport
from curveline.notebook import html_of
from curveline.phrases import counted, local_time

LEAST_NOISE = 0.1
"""By what part a figure differs between runs even if its repeats agree."""
UNKNOWN_NOISE = 0.25
"""The same for figures that were taken once."""
REPEATS = 2.0
"""How many times the spread of its repeats a figure may be off besides."""
MOST_OTHERS = 0.9
"""Part of the processors that others are taken to use at most."""
BARE = "x bare"
"""The unit of times over that of Newton's method alone."""
SHOWN = 60
"""Characters of a text of a record that are shown."""


@dataclass(frozen=True)
class ComparedRow:
    """A figure now and then; None stands for what was not measured, or cannot be compared."""

    name: str  # of what was measured
    now: float | None  # its value
    then: float | None  # its value in the older run
    unit: str  # of both; "x bare" if both are over the time of Newton's method alone
    ratio: float | None  # of now to then
    noise: float  # by what part the ratio may differ from 1 without a reason
    verdict: str  # "slower", "faster", "worse" or "better" by more than the noise, else empty


@dataclass(frozen=True)
class BenchComparison:
    """A run of the benchmark against an older one."""

    then: Conditions  # of the older one
    differences: tuple[str, ...]  # sentences: why only ratios can be compared; none if seconds can
    remarks: tuple[str, ...]  # sentences: what else to keep in mind
    rows: tuple[ComparedRow, ...]  # figures that both have
    only_now: tuple[str, ...]  # names of figures that the older one does not have
    only_then: tuple[str, ...]  # names of figures that only the older one has

    @property
    def slower(self) -> list[str]:
        """The names of figures that became slower or worse by more than the noise."""
        return [row.name for row in self.rows if row.verdict in ("slower", "worse")]

    @property
    def faster(self) -> list[str]:
        """The names of figures that became faster or better by more than the noise."""
        return [row.name for row in self.rows if row.verdict in ("faster", "better")]

    def document(self) -> dict[str, Any]:
        """The same as plain data."""
        return {
            "then": asdict(self.then),
            "by": "ratios" if self.differences else "values",
            "differences": list(self.differences),
            "remarks": list(self.remarks),
            "rows": [asdict(row) for row in self.rows],
            "slower": self.slower,
            "faster": self.faster,
            "only_now": list(self.only_now),
            "only_then": list(self.only_then),
        }

    def _repr_html_(self) -> str:
        head = ("figure", "now", "then", "unit", "ratio", "noise", "")
        rows = [(row.name, row.now, row.then, row.unit, row.ratio, row.noise, row.verdict) for row in self.rows]
        title = f"against {local_time(self.then.at)}: {len(self.slower)} slower, {len(self.faster)} faster"
        return html_of(title, [head, *rows], remarks=[*self.differences, *self.remarks])


def compare_bench(now: BenchReport, then: BenchReport) -> BenchComparison:
    """A run of the benchmark held against an older one, as `read_bench` gives it."""
    differences = tuple(_differences(now.conditions, then.conditions))
    busy = max(_waiting(now.conditions), _waiting(then.conditions))
    old = {row.name: row for row in then.rows}
    names = {row.name for row in now.rows}
    return BenchComparison(
        then.conditions,
        differences,
        tuple(_remarks(now, then)),
        tuple(_compared(row, old[row.name], busy, by_ratio=bool(differences)) for row in now.rows if row.name in old),
        tuple(row.name for row in now.rows if row.name not in old),
        tuple(row.name for row in then.rows if row.name not in names),
    )


def _differences(now: Conditions, then: Conditions) -> Iterator[str]:
    """What of machine and versions is not the same, as sentences; load and curveline itself don't count."""
    for what, one, other in (
        ("the machines", now.machine, then.machine),
        ("the versions", now.versions, then.versions),
    ):
        for field in fields(one):
            new, old = getattr(one, field.name), getattr(other, field.name)
            if new != old:
                yield f"{what} differ in {field.name}: {_shown(old)} then, {_shown(new)} now"


def _shown(value: object) -> str:
    return "none" if value is None else str(value)[:SHOWN]


def _remarks(now: BenchReport, then: BenchReport) -> Iterator[str]:
    if now.conditions.kernels != then.conditions.kernels:
        yield f"other kernels ran: {then.conditions.kernels[:SHOWN]} then, {now.conditions.kernels} now"
    if tuple(now.shapes) != tuple(then.shapes):
        yield f"other shapes were measured: {counted(len(then.shapes), 'shape')} then, {len(now.shapes)} now"
    busy = [when for when, each in (("then", then), ("now", now)) if each.conditions.is_busy]
    if busy:
        yield f"the machine was busy {' and '.join(busy)}: distrust what became slower or faster"


def _compared(new: Measurement, old: Measurement, busy: float, *, by_ratio: bool) -> ComparedRow:
    """Two figures of one name; where only ratios count, those that are times are taken over Newton alone."""
    noise = _noise(new, old, busy)
    if by_ratio and new.unit in (*TIMES, RATE):
        now, then, unit, worse = new.over_bare_newton, old.over_bare_newton, BARE, 1
    elif new.unit == old.unit:
        now, then, unit, worse = new.value, old.value, new.unit, new.worse_side
    else:
        now, then, unit, worse = None, None, "", 0
    if now is None or then is None:
        return ComparedRow(new.name, now, then, unit, None, noise, "")
    side = _side(now, then, noise) * worse
    words = ("faster", "slower") if unit in (*TIMES, RATE, "x", BARE) else ("better", "worse")
    verdict = words[side > 0] if side else ""
    return ComparedRow(new.name, now, then, unit, now / then if then else None, noise, verdict)


def _waiting(conditions: Conditions) -> float:
    """By what part others may have drawn out times: who has the rest of the processors takes so much longer."""
    others = min(conditions.load.during or 0.0, MOST_OTHERS) if conditions.is_busy else 0.0
    return others / (1.0 - others)


def _noise(new: Measurement, old: Measurement, busy: float) -> float:
    """By what part two figures may differ without a reason: more than their repeats do, within either run.

    Where repeats do not tell, times may be off by what others took of the processors.
    """
    if new.goal.startswith("="):
        return 0.0
    if new.spread is None or old.spread is None:
        return UNKNOWN_NOISE + (busy if new.unit in (*TIMES, RATE) else 0.0)
    return LEAST_NOISE + REPEATS * (new.spread + old.spread)


def _side(now: float, then: float, noise: float) -> int:
    """1 if a figure grew by more than the noise, -1 if it shrank by more, else 0."""
    if now > then * (1.0 + noise):
        return 1
    return -1 if now * (1.0 + noise) < then else 0
