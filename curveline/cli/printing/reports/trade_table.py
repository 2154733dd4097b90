"""The speed/accuracy trade as people read it: a table of 80 columns for every set of scenes and model."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from curveline.cli.printing import screen
from curveline.cli.printing.progress.progress_bar import Bar

if TYPE_CHECKING:
    from curveline.bench.trade import TradePoint

HEAD = ("", "method", "setting", "vertices", "error mm", "time", "a vertex", "order")
LEFT = frozenset({0, 1})
SCALES = ((1.0, "s"), (1e-3, "ms"), (1e-6, "us"), (1e-9, "ns"))
PEERS_HINT = "pip install 'curveline[peers]'"


def table(points: Sequence[TradePoint]) -> list[str]:
    """Lines for the points of one set and one model; * marks the Pareto front."""
    first = points[0]
    cases = max(point.cases for point in points)
    lines = [f"{first.scenes} ({cases} scenes), {first.model}"]
    lines += screen.table([HEAD, *(_cells(point) for point in points if point.setting is not None)], LEFT)
    for point in points:
        if point.setting is None:
            lines.append(f"   {point.method}: {point.note}; {PEERS_HINT}")
        elif point.note:
            lines.append(f"   {point.method}, {point.setting:g} {point.unit}: {point.note}")
    return lines


def _cells(point: TradePoint) -> tuple[str, ...]:
    return (
        "*" if point.pareto else "",
        point.method,
        f"{point.setting:g} {point.unit}",
        "" if point.vertices is None else str(point.vertices),
        "" if point.error_mm is None else f"{point.error_mm:.2g}",
        _seconds(point.seconds),
        _seconds(point.seconds_per_vertex),
        "" if point.order is None else f"{point.order:.2f}",
    )


def _seconds(value: float | None) -> str:
    """A time with three digits in the unit that suits it."""
    if value is None:
        return ""
    scale, unit = next((each for each in SCALES if value >= 0.9995 * each[0]), SCALES[-1])
    return f"{value / scale:.3g} {unit}"


@contextmanager
def progress(steps: int) -> Iterator[Callable[[str], None]]:
    """A bar on a terminal that moves on at every word of what is measured next; nothing elsewhere."""
    with Bar("measuring", steps) as bar:
        begun = 0

        def told(what: str) -> None:
            nonlocal begun
            bar.detail = what
            bar.reach(begun)
            begun += 1

        yield told
