"""The trade as a picture: error against time on logarithmic scales, a panel per set of cases, Pareto fronts drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from curveline.bench.report import BenchReport
from curveline.bench.trade import TradePoint
from curveline.figures.common import DARK, bytes_of, draw_legend, legend_entry, new_figure
from curveline.rod.states.equilibrium import EXTENSIBLE, PLANAR, SPATIAL

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = {PLANAR: "#0072B2", EXTENSIBLE: "#009E73", SPATIAL: "#D55E00"}
MARKERS = {"one level": "o", "one state": "s", "simulate": "D", "solve_bvp": "^", "PyElastica": "X", "MuJoCo": "P"}
OTHER_MARKER = "v"
PANEL = (4.2, 3.9)  # [inch]
LEGEND_ROOM = 0.8  # [inch]


def draw(report: BenchReport, kind: str) -> bytes:
    """A figure of the points that were measured, as "svg", "png" or "pdf"; MissingExtra without matplotlib."""
    measured = [point for point in report.points if point.error_mm and point.seconds]
    sets = list(dict.fromkeys(point.scenes for point in measured)) or [""]
    with new_figure(PANEL[0] * len(sets), PANEL[1] + LEGEND_ROOM, kind) as figure:
        panels = figure.subplots(1, len(sets), squeeze=False, sharex=True, sharey=True).flatten()
        for panel, name in zip(panels, sets, strict=True):
            _draw_set(panel, [point for point in measured if point.scenes == name])
            panel.set_title(name)
            panel.set_xlabel("time of a scene [ms]")
            panel.label_outer()
        panels[0].set_ylabel("largest true error [mm]")
        draw_legend(figure, _legend(measured))
        return bytes_of(figure, kind)


def _draw_set(panel: Axes, points: Sequence[TradePoint]) -> None:
    """Every method as a series, and for each model a stairway along its front."""
    for model, colour in COLOURS.items():
        some = [point for point in points if point.model == model]
        for method in dict.fromkeys(point.method for point in some):
            _draw_series(panel, [point for point in some if point.method == method], colour)
        front = sorted((_at(point) for point in some if point.pareto), key=lambda at: at[0])
        if front:
            times, errors = zip(*front, strict=True)
            panel.step(times, errors, where="post", color=colour, linewidth=5.0, alpha=0.18, zorder=1)
    panel.set_xscale("log")
    panel.set_yscale("log")
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_formatter(lambda value, _: f"{value:g}")
        axis.set_minor_formatter(lambda value, _: "")
    panel.grid(visible=True, linewidth=0.4, color="#dddddd")
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)


def _draw_series(panel: Axes, points: Sequence[TradePoint], colour: str) -> None:
    """Markers that are full on the front and hollow elsewhere, joined from coarse to fine."""
    times, errors = zip(*map(_at, points), strict=True)
    panel.plot(times, errors, color=colour, linewidth=0.8, alpha=0.6)
    for point in points:
        style: dict[str, Any] = {
            "marker": _marker(point.method),
            "color": colour,
            "linestyle": "none",
            "markersize": 5.5,
        }
        panel.plot(*_at(point), **style, markerfacecolor=colour if point.pareto else "white")


def _at(point: TradePoint) -> tuple[float, float]:
    """Time [ms] and error [mm]."""
    return 1e3 * (point.seconds or 0.0), point.error_mm or 0.0


def _marker(method: str) -> str:
    return MARKERS.get(method, OTHER_MARKER)


def _legend(points: Sequence[TradePoint]) -> list[Any]:
    """An entry for each method and each model, in one legend."""
    look: dict[str, Any] = {"color": DARK, "markerfacecolor": "white", "linestyle": "none"}
    methods = dict.fromkeys(point.method for point in points)
    models = dict.fromkeys(point.model for point in points)
    return [
        *(legend_entry(method, marker=_marker(method), **look) for method in methods),
        *(legend_entry(model, color=COLOURS[model], linewidth=3.0) for model in models),
        legend_entry("front (full markers)", color=DARK, linewidth=5.0, alpha=0.18),
    ]
