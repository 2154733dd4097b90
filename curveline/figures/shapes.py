"""Figures of simulated shapes for reports: true to aspect, in mm, the same bytes for the same shape."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from curveline.errors import MissingExtra
from curveline.explanation import deepest
from curveline.results import Array, Report, curve_mm, depth_mm
from curveline.rod.dynamics import time_unit
from curveline.rod.equilibrium import Equilibrium
from curveline.scene import PEAK, VALLEY, Node
from curveline.units import to_mm, to_ms

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from curveline.rod.dynamics import Fall
    from curveline.rod.space import SpatialSegment

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
FLASHES = 16
"""Curves in a strobe picture."""
SLOWER = 5.0
FRAME_MS = 40
FILM_INCHES = 4.8
FILM_PIXELS_PER_INCH = 100
SETTINGS: Any = {
    "text.parse_math": False,
    "svg.hashsalt": "curveline",
    "svg.fonttype": "path",
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
}
METADATA: dict[str, dict[str, Any]] = {"svg": {"Date": None, "Creator": "curveline"}, "png": {"Software": "curveline"}}


@dataclass(frozen=True)
class View:
    """A direction from which a shape is seen: its curves (points, 2) [mm], and pivots and tangents of its nodes."""

    label: str
    title: str
    of: Callable[[Report, int, Equilibrium], Array]
    height: Callable[[Node], float]  # [m]
    tangent: Callable[[Node], tuple[float, float]]


def _from_above(report: Report, index: int, state: Equilibrium) -> Array:
    curve: Array = np.column_stack([curve_mm(report, index, state)[:, 0], depth_mm(report, state)])
    return curve


FRONT = View(
    label="y [mm]",
    title="",
    of=curve_mm,
    height=lambda node: node.height,
    tangent=lambda node: (math.cos(node.yaw) * math.cos(node.angle), math.cos(node.yaw) * math.sin(node.angle)),
)
ABOVE = View(
    label="z [mm]",
    title=", from above",
    of=_from_above,
    height=lambda _: 0.0,
    tangent=lambda node: (math.cos(node.yaw) * math.cos(node.angle), math.sin(node.yaw)),
)
"""The viewer of the front stands below what is seen from above, so that z, which points to the viewer, points down."""


def require_matplotlib() -> None:
    """MissingExtra unless figures can be drawn."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise MissingExtra(
            "drawing figures needs matplotlib, which is not installed", hint="pip install 'curveline[plot]'"
        ) from None


def draw(reports: Sequence[Report], kind: str) -> bytes:
    """A figure of one shape, or a grid of several, as "svg" or "png".

    Shapes are seen from the front and, if the rod of any of them leaves the plane, below that from above.
    """
    require_matplotlib()
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    across = min(max(1, ACROSS // max(len(report.segments) for report in reports)), len(reports))
    down = math.ceil(len(reports) / across)
    width = WIDTH if across == 1 else SMALL_WIDTH
    views = [FRONT, *([ABOVE] if any(map(_is_deep, reports)) else [])]
    heights = [width * max(_steepness(report, view) for report in reports) + HEAD_ROOM for view in views]
    alike = len({report.scene.display.digest for report in reports}) == 1
    with matplotlib.rc_context({**defaults(), **SETTINGS}):
        figure = Figure(figsize=(width * across, sum(heights) * down + LEGEND_ROOM), layout="constrained")
        (FigureCanvasSVG if kind == "svg" else FigureCanvasAgg)(figure)
        rows = figure.subplots(len(views) * down, across, squeeze=False, height_ratios=heights * down)
        for offset, view in enumerate(views):
            panels = list(rows[offset :: len(views)].flatten())
            _draw_view(panels, reports, view, alike=alike)
        _draw_legend(figure)
        return bytes_of(figure, kind)


def draw_fall(film: Fall, segment: SpatialSegment, kind: str) -> bytes:
    """A strobe picture, "svg" or "png", of a motion as seen from the front: flashes at equal times, the last darkest.

    `segment` says how long the rod is and how heavy, hence how fast.
    """
    require_matplotlib()
    times, curves = film.sampled(FLASHES)
    with _panel_of(curves, segment, kind) as (figure, panel):
        for number, curve in enumerate(curves):
            last = number == FLASHES - 1
            panel.plot(
                *_seen(curve, segment).T,
                color=DARK,
                linewidth=THICK if last else THIN,
                alpha=(number + 2) / (FLASHES + 1),
            )
        flash_ms = to_ms((times[1] - times[0]) * time_unit(segment))
        panel.set_title(f"{FLASHES} flashes, one every {flash_ms:.3g} ms: {film.fate.value}", wrap=True)
        return bytes_of(figure, kind)


def animate_fall(film: Fall, segment: SpatialSegment) -> bytes:
    """A motion as seen from the front, a GIF that runs `SLOWER` times slower than the rod, over and over."""
    require_matplotlib()
    from PIL import Image

    seconds = (film.times[-1] - film.times[0]) * time_unit(segment)
    _, curves = film.sampled(max(2, round(to_ms(seconds) * SLOWER / FRAME_MS)))
    images = []
    with _panel_of(curves, segment, "gif") as (figure, panel):
        panel.set_title(f"{SLOWER:g} times slower than the rod")
        (line,) = panel.plot([], [], color=DARK, linewidth=THICK)
        for curve in curves:
            line.set_data(*_seen(curve, segment).T)
            stream = io.BytesIO()
            figure.savefig(stream, format="png", dpi=FILM_PIXELS_PER_INCH, metadata=METADATA["png"])
            images.append(Image.open(stream).convert("P", palette=Image.Palette.ADAPTIVE, colors=16))
    out = io.BytesIO()
    images[0].save(out, "GIF", save_all=True, append_images=images[1:], duration=FRAME_MS, loop=0)
    return out.getvalue()


@contextmanager
def _panel_of(curves: Array, segment: SpatialSegment, kind: str) -> Iterator[tuple[Figure, Axes]]:
    """An empty panel that all `curves (k, n+1, 3)` of a segment fit into."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    seen = np.concatenate([_seen(curve, segment) for curve in curves])
    (left, low), (right, high) = np.min(seen, axis=0), np.max(seen, axis=0)
    room = MARGIN * (right - left)
    width = FILM_INCHES if kind == "gif" else WIDTH
    height = width * min(1.5, (high - low + 2.0 * room) / (right - left + 2.0 * room)) + HEAD_ROOM
    with matplotlib.rc_context({**defaults(), **SETTINGS}):
        figure = Figure(figsize=(width, height), layout="constrained")
        (FigureCanvasSVG if kind == "svg" else FigureCanvasAgg)(figure)
        panel = figure.subplots()
        panel.set(xlim=(left - room, right + room), ylim=(low - room, high + room), aspect="equal")
        _dress(panel, FRONT.label)
        yield figure, panel


def _seen(curve: Array, segment: SpatialSegment) -> Array:
    """Points (n+3, 2) [mm], from pivot to pivot, of a `curve (n+1, 3)` over the free length."""
    rod = segment.rod
    free = np.array(rod.free_start) + rod.free_length * curve[:, :2]
    return to_mm(1.0) * np.vstack([[0.0, 0.0], free, rod.chord])


def _draw_view(panels: Sequence[Axes], reports: Sequence[Report], view: View, *, alike: bool) -> None:
    """Every shape in its panel; those of one display share their scales."""
    across = panels[0].get_gridspec().ncols  # type: ignore[union-attr]
    for number, (panel, report) in enumerate(zip(panels, reports, strict=False)):
        if alike and number:
            panel.sharex(panels[0])
            panel.sharey(panels[0])
        _draw_shape(panel, report, view)
        if view is ABOVE and not panel.yaxis_inverted():
            panel.invert_yaxis()
    for panel in panels[: len(reports)] if alike else ():
        panel.label_outer()
    for panel in panels[max(0, len(reports) - across) : len(reports)]:
        panel.tick_params(labelbottom=True)
        panel.set_xlabel(X_LABEL)
    for panel in panels[len(reports) :]:
        panel.set_axis_off()


def _is_deep(report: Report) -> bool:
    """True if a curve of a shape leaves the plane by more than it is known to."""
    return any(deepest(state) > state.error for segment in report.segments for state in segment.states)


def _least_depth(report: Report) -> float:
    """How far the view from above reaches at least [mm]: a rod that hardly leaves the plane would hide the nodes."""
    return MARGIN * to_mm(report.scene.display.span)


def _steepness(report: Report, view: View) -> float:
    """Height over width of all that is drawn of a shape, at most 1."""
    curves = [view.of(report, index, state) for index, each in enumerate(report.segments) for state in each.states]
    heights = [float(height) for curve in curves for height in curve[:, 1]] or [0.0]
    heights += [to_mm(view.height(node)) for node in report.scene.nodes]
    heights += [-_least_depth(report), _least_depth(report)] if view is ABOVE else []
    return min(1.0, (max(heights) - min(heights)) / to_mm(len(report.segments) * report.scene.display.span))


def defaults() -> dict[Any, Any]:
    """matplotlib's own settings, so that those of the user or the machine do not show; the backend is never used."""
    from matplotlib import rcParamsDefault

    return {name: value for name, value in rcParamsDefault.items() if name not in ("backend", "backend_fallback")}


def bytes_of(figure: Figure, kind: str) -> bytes:
    """A figure as "svg" or "png", without a date."""
    stream = io.BytesIO()
    figure.savefig(stream, format=kind, dpi=PIXELS_PER_INCH, metadata=METADATA[kind])
    return stream.getvalue()


def _draw_shape(panel: Axes, report: Report, view: View) -> None:
    """All states of a shape and the nodes that hold it."""
    for index, segment in enumerate(report.segments):
        # What the display cannot show lies below, what is wanted on top.
        for state in sorted(segment.states, key=lambda state: (state.is_untangled, state.wanted)):
            curve = view.of(report, index, state)
            panel.plot(curve[:, 0], curve[:, 1], **_style(state))
    _draw_nodes(panel, report, view)
    if view is ABOVE:
        panel.update_datalim([(0.0, -_least_depth(report)), (0.0, _least_depth(report))])
    panel.set_aspect("equal")
    panel.margins(MARGIN)
    panel.set_title(f"{report.scene.name}{view.title}")
    _dress(panel, view.label)


def _dress(panel: Axes, label: str) -> None:
    """Labels, a light grid, no box."""
    panel.set_xlabel(X_LABEL)
    panel.set_ylabel(label)
    panel.grid(visible=True, linewidth=0.4, color="#dddddd")
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)


def _style(state: Equilibrium) -> dict[str, Any]:
    if not state.is_untangled:
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


def _draw_nodes(panel: Axes, report: Report, view: View) -> None:
    """Every node as its pivot and the stretch of rod that its bearing holds straight."""
    display = report.scene.display
    # Display files allow point clamps; their direction must show all the same.
    half = to_mm(max(display.clamp, 0.03 * display.span)) / 2.0
    for index, node in enumerate(report.scene.nodes):
        x, y = to_mm(index * display.span), to_mm(view.height(node))
        across, up = (half * part for part in view.tangent(node))
        panel.plot(
            [x - across, x + across], [y - up, y + up], color=DARK, linewidth=6.0, alpha=0.35, solid_capstyle="butt"
        )
        panel.plot(
            [x], [y], marker="o", markersize=4.5, color=DARK, markerfacecolor="white", linestyle="none", zorder=5
        )
