"""Figures of simulated shapes for reports: true to aspect, in mm, the same bytes for the same shape."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from curveline.errors import MissingExtra
from curveline.results import Report, curve_mm
from curveline.rod.equilibrium import Equilibrium
from curveline.scene import PEAK, VALLEY
from curveline.units import to_mm

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Blue and vermilion of Okabe and Ito's palette, which people with any colour vision tell apart.
COLOURS = {PEAK: "#0072B2", VALLEY: "#D55E00"}
STYLES = {PEAK: "-", VALLEY: (0, (5, 2))}
OTHER = "#009E73"
GREY = "#999999"
DARK = "#333333"
X_LABEL = "x [mm]"
UNSHOWN = "not for a planar display"
THIN, THICK = 1.2, 2.6
ACROSS = 3
"""Segments side by side in a row of a grid."""
WIDTH = 6.4  # [inch] of a panel that has a row for itself
SMALL_WIDTH = 3.6  # [inch] of one among others
HEAD_ROOM = 0.75  # [inch] of a panel's height for its title and labels
LEGEND_ROOM = 0.4  # [inch] below all panels
PIXELS_PER_INCH = 150
MARGIN = 0.06
"""Room around a curve, as a part of the display's width."""
SETTINGS: Any = {
    "text.parse_math": False,
    "svg.hashsalt": "curveline",
    "svg.fonttype": "path",
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
}
METADATA: dict[str, dict[str, Any]] = {"svg": {"Date": None, "Creator": "curveline"}, "png": {"Software": "curveline"}}


def require_matplotlib() -> None:
    """MissingExtra unless figures can be drawn."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise MissingExtra(
            "drawing figures needs matplotlib, which is not installed", hint="pip install 'curveline[plot]'"
        ) from None


def draw(reports: Sequence[Report], kind: str) -> bytes:
    """A figure of one shape, or a grid of several, as "svg" or "png"."""
    require_matplotlib()
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    across = min(max(1, ACROSS // max(len(report.segments) for report in reports)), len(reports))
    down = math.ceil(len(reports) / across)
    width = WIDTH if across == 1 else SMALL_WIDTH
    height = width * max(map(_steepness, reports)) + HEAD_ROOM
    alike = len({report.scene.display.digest for report in reports}) == 1
    with matplotlib.rc_context({**_defaults(), **SETTINGS}):
        figure = Figure(figsize=(width * across, height * down + LEGEND_ROOM), layout="constrained")
        (FigureCanvasSVG if kind == "svg" else FigureCanvasAgg)(figure)
        panels = figure.subplots(down, across, squeeze=False, sharex=alike, sharey=alike).flatten()
        for panel, report in zip(panels, reports, strict=False):
            _draw_shape(panel, report)
            if alike:
                panel.label_outer()
        for panel in panels[max(0, len(reports) - across) : len(reports)]:
            panel.tick_params(labelbottom=True)
            panel.set_xlabel(X_LABEL)
        for panel in panels[len(reports) :]:
            panel.set_axis_off()
        _draw_legend(figure)
        return _bytes_of(figure, kind)


def _steepness(report: Report) -> float:
    """Height over width of all that is drawn of a shape, at most 1."""
    curves = [curve_mm(report, index, state) for index, each in enumerate(report.segments) for state in each.states]
    heights = [float(height) for curve in curves for height in curve[:, 1]] or [0.0]
    heights += [to_mm(node.height) for node in report.scene.nodes]
    return min(1.0, (max(heights) - min(heights)) / to_mm(len(report.segments) * report.scene.display.span))


def _defaults() -> dict[Any, Any]:
    """matplotlib's own settings, so that those of the user or the machine do not show; the backend is never used."""
    from matplotlib import rcParamsDefault

    return {name: value for name, value in rcParamsDefault.items() if name not in ("backend", "backend_fallback")}


def _bytes_of(figure: Figure, kind: str) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format=kind, dpi=PIXELS_PER_INCH, metadata=METADATA[kind])
    return stream.getvalue()


def _draw_shape(panel: Axes, report: Report) -> None:
    """All states of a shape and the nodes that hold it."""
    for index, segment in enumerate(report.segments):
        # What the display cannot show lies below, what is wanted on top.
        for state in sorted(segment.states, key=lambda state: (state.simple, state.wanted)):
            curve = curve_mm(report, index, state)
            panel.plot(curve[:, 0], curve[:, 1], **_style(state))
    _draw_nodes(panel, report)
    panel.set_aspect("equal")
    panel.margins(MARGIN)
    panel.set_title(report.scene.name)
    panel.set_xlabel(X_LABEL)
    panel.set_ylabel("y [mm]")
    panel.grid(visible=True, linewidth=0.4, color="#dddddd")
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)


def _style(state: Equilibrium) -> dict[str, Any]:
    if not state.simple:
        return {"label": UNSHOWN, "color": GREY, "linewidth": 0.6, "linestyle": ":"}
    look = {"color": COLOURS.get(state.name, OTHER), "linestyle": STYLES.get(state.name, "-.")}
    return {"label": state.name, **look, "linewidth": THICK if state.wanted else THIN}


def _draw_legend(figure: Figure) -> None:
    """One legend for all panels, below them where no curve can be."""
    from matplotlib.lines import Line2D

    drawn = {str(line.get_label()): line for panel in figure.axes for line in panel.lines}
    handles = []
    for name in sorted((name for name in drawn if not name.startswith("_")), key=lambda name: (name == UNSHOWN, name)):
        line = drawn[name]
        look: dict[str, Any] = {"color": line.get_color(), "linestyle": STYLES.get(name, line.get_linestyle())}
        handles.append(Line2D([], [], label=name, linewidth=0.6 if name == UNSHOWN else THIN, **look))
    if any(line.get_linewidth() == THICK for panel in figure.axes for line in panel.lines):
        handles.append(Line2D([], [], label="thick: wanted", linewidth=THICK, color=GREY))
    if handles:
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False)


def _draw_nodes(panel: Axes, report: Report) -> None:
    """Every node as its pivot and the stretch of rod that its bearing holds straight."""
    display = report.scene.display
    # Display files allow point clamps; their direction must show all the same.
    half = to_mm(max(display.clamp, 0.03 * display.span)) / 2.0
    for index, node in enumerate(report.scene.nodes):
        x, y = to_mm(index * display.span), to_mm(node.height)
        across, up = half * math.cos(node.angle), half * math.sin(node.angle)
        panel.plot(
            [x - across, x + across], [y - up, y + up], color=DARK, linewidth=6.0, alpha=0.35, solid_capstyle="butt"
        )
        panel.plot(
            [x], [y], marker="o", markersize=4.5, color=DARK, markerfacecolor="white", linestyle="none", zorder=5
        )
