"""What all figures share: colours, sizes, matplotlib kept apart from the user's settings, bytes without a date."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from curveline.errors import MissingExtra
from curveline.scene import PEAK, VALLEY, Display
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
Y_LABEL = "y [mm]"
THIN, THICK = 1.2, 2.6
WIDTH = 6.4  # [inch] of a panel that has a row for itself
HEAD_ROOM = 0.75  # [inch] of a panel's height for its title and labels
PIXELS_PER_INCH = 150
MARGIN = 0.06
"""Room around a curve, as a part of the display's width."""
SETTINGS: Any = {
    "text.parse_math": False,
    "svg.hashsalt": "curveline",
    "svg.fonttype": "none",  # text stays text
    "pdf.fonttype": 42,
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
}
METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": "curveline"},
    "png": {"Software": "curveline"},
    "pdf": {"CreationDate": None, "Creator": "curveline", "Producer": None},
}


def require_matplotlib() -> None:
    """MissingExtra unless figures can be drawn."""
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise MissingExtra(
            "drawing figures needs matplotlib, which is not installed", hint="pip install 'curveline[plot]'"
        ) from None


@contextmanager
def new_figure(width: float, height: float, kind: str) -> Iterator[Figure]:
    """An empty figure of `width` x `height` [inch], to be filled and written as a `kind` of figure or as frames.

    Inside, matplotlib's own settings hold, not those of the user; MissingExtra without matplotlib.
    """
    require_matplotlib()
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_pdf import FigureCanvasPdf
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    with matplotlib.rc_context({**_defaults(), **SETTINGS}):
        figure = Figure(figsize=(width, height), layout="constrained")
        {"svg": FigureCanvasSVG, "pdf": FigureCanvasPdf}.get(kind, FigureCanvasAgg)(figure)
        yield figure


def _defaults() -> dict[Any, Any]:
    """matplotlib's own settings, so that those of the user or the machine do not show; the backend is never used."""
    from matplotlib import rcParamsDefault

    return {name: value for name, value in rcParamsDefault.items() if name not in ("backend", "backend_fallback")}


def bytes_of(figure: Figure, kind: str) -> bytes:
    """A figure as "svg", "pdf" or "png", without a date."""
    stream = io.BytesIO()
    figure.savefig(stream, format=kind, dpi=PIXELS_PER_INCH, metadata=METADATA[kind])
    return stream.getvalue()


def dress(panel: Axes, label: str) -> None:
    """Labels, a light grid, no box."""
    panel.set_xlabel(X_LABEL)
    panel.set_ylabel(label)
    panel.grid(visible=True, linewidth=0.4, color="#dddddd")
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)


def clamp_shown(display: Display) -> float:
    """Length [m] of bearing to draw: display files allow point clamps, whose direction must show all the same."""
    return max(display.clamp, 0.03 * display.span)


def draw_node(panel: Axes, pivot: tuple[float, float], tangent: tuple[float, float], clamp: float) -> None:
    """A node as its `pivot` [m] and the stretch of rod, `clamp` [m] long, that its bearing holds along `tangent`."""
    x, y = (to_mm(part) for part in pivot)
    across, up = (0.5 * to_mm(clamp) * part for part in tangent)
    bearing: dict[str, Any] = {"linewidth": 6.0, "alpha": 0.35, "solid_capstyle": "butt"}
    panel.plot([x - across, x + across], [y - up, y + up], color=DARK, **bearing)
    hub: dict[str, Any] = {"marker": "o", "markersize": 4.5, "markerfacecolor": "white", "linestyle": "none"}
    panel.plot([x], [y], color=DARK, **hub, zorder=5)
