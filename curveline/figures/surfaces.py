"""Figures of a surface: its lines in perspective, coloured by how far each place of them is from what was asked for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from curveline.drawings.drawing import Array
from curveline.figures.common import DARK, GREY, THIN, bytes_of, draw_legend, legend_entry, new_figure, within
from curveline.fitting.measured import Gaps
from curveline.phrases import counted
from curveline.surfaces.fit_surface import FittedLine, FittedSurface
from curveline.system.files import AnyPath, printable
from curveline.units import plain, to_mm

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE = 7.6, 4.2  # [inch]
COLOURS = "viridis_r"
"""Light where a line is on the surface, dark where it is off; people with any colour vision see it so."""
COLOURED, STRIDE, DRAWN = 20, 5, 80
"""Pieces of one colour in a segment, from point to point of its curve so far apart; points of what was asked for."""
LEAST_SHOWN = 1e-3  # [mm], the end of the scale of colours at least
DEEP, HIGH = (0.4, 1.2), (0.15, 0.5)
"""Depth and height of what is drawn over its width, at least and at most: others are stretched, which is told."""
AROUND, ABOVE = -0.42, 0.5  # [rad] of who looks at it
FAR = 3.2
"""Widths from where it is looked at."""
ROOM = 0.06
"""Beside all that is drawn, of its width."""
ASKED: Any = {"color": GREY, "linewidth": 0.9, "linestyle": (0, (4, 2)), "zorder": 2}
HUB: Any = {"color": DARK, "marker": "o", "markersize": 3.0, "markerfacecolor": "white", "linestyle": "none"}


@dataclass(frozen=True)
class _View:
    """How places in space are drawn: stretched, and seen in perspective; lengths in widths of the display."""

    width: float  # [mm]
    depth: float  # [mm] from the first line to the last
    low: float  # [mm] of the lowest place
    high: float  # [mm]
    deep: float  # by which depths are stretched
    tall: float  # by which heights are

    @classmethod
    def of(cls, found: FittedSurface) -> _View:
        """All of a surface."""
        points = np.vstack([each for line in found.lines for each in (*line.fit.curves, *line.fit.drawn)])
        display = found.display
        width = to_mm(display.span * (display.node_count - 1))
        depth = to_mm(found.request.laying.depth)
        low, high = (to_mm(float(each)) for each in (points[:, 1].min(), points[:, 1].max()))
        return cls(width, depth, low, high, _stretch(depth / width, DEEP), _stretch((high - low) / width, HIGH))

    def seen(self, x: Any, y: float, z: Any) -> Array:
        """Where places [mm] are drawn (k, 2)."""
        across = np.asarray(x, dtype=np.float64) / self.width - 0.5
        behind = np.full(across.shape, self.deep * (y - 0.5 * self.depth) / self.width)
        up = self.tall * (np.asarray(z, dtype=np.float64) - self.low) / self.width
        right = across * math.cos(AROUND) - behind * math.sin(AROUND)
        away = across * math.sin(AROUND) + behind * math.cos(AROUND)
        size = FAR / (FAR + away * math.cos(ABOVE) - up * math.sin(ABOVE))
        return np.column_stack([size * right, size * (up * math.cos(ABOVE) + away * math.sin(ABOVE))])


def _stretch(share: float, limits: tuple[float, float]) -> float:
    """What a length is stretched by so that it is such a share of the width."""
    if share < 1e-9:
        return 1.0
    wanted = min(max(share, limits[0]), limits[1])
    return float(f"{wanted / share:.2g}") if wanted != share else 1.0


def draw(found: FittedSurface, path: AnyPath = "", argv: tuple[str, ...] = (), *, kind: str) -> bytes:
    """A surface as "svg", "png" or "pdf": lines in perspective, what was asked for dashed.

    MissingExtra without matplotlib.
    """
    with new_figure(*SIZE, kind) as figure:
        panel = figure.subplots()
        view = _View.of(found)
        largest = max(LEAST_SHOWN, to_mm(max(line.fit.max for line in found.lines)))
        colours: Any = None
        _draw_floor(panel, view)
        # What is behind is drawn first.
        for line in reversed(found.lines):
            colours = _draw_line(panel, view, (line, found.request.laying.pitch), largest)
        _frame(panel, view)
        figure.colorbar(colours, ax=panel, shrink=0.7, pad=0.02, label="off the surface [mm]")
        worst = to_mm(max(line.fit.rms for line in found.lines))
        heading = f"{counted(len(found.lines), 'line')}, up to {worst:.3g} mm RMS: {printable(found.name)}"
        panel.set_title(within(heading, SIZE[0] - 1.0))
        draw_legend(figure, [legend_entry("asked for", **ASKED), legend_entry("node", **HUB), *_stretched(view)])
        return bytes_of(figure, kind)


def _stretched(view: _View) -> list[Any]:
    """Entries of a legend for what is not drawn as long as it is."""
    told = [(view.deep, "depths"), (view.tall, "heights")]
    return [legend_entry(f"{what} x {plain(by)}", linestyle="none") for by, what in told if by != 1.0]


def _draw_line(panel: Axes, view: _View, which: tuple[FittedLine, float], largest: float) -> Any:
    """A line in the colours of its distances; what was asked for beside it, its nodes and its number."""
    from matplotlib.collections import LineCollection

    line, pitch = which
    y, pieces, off = to_mm((line.number - 1) * pitch), [], []
    for curve, drawn in zip(line.fit.curves, line.fit.drawn, strict=True):
        seen = view.seen(to_mm(1.0) * curve[:, 0], y, to_mm(1.0) * curve[:, 1])
        away = to_mm(1.0) * Gaps.between(curve, drawn).there
        ends = np.linspace(0, len(curve) - 1, COLOURED + 1).astype(int)
        for begin, end in pairwise(ends.tolist()):
            pieces.append(seen[begin : end + 1 : STRIDE])
            off.append(float(np.mean(away[begin : end + 1])))
        shown = drawn[:: max(1, len(drawn) // DRAWN)]
        asked = to_mm(1.0) * np.vstack([shown, drawn[-1:]])
        panel.plot(*view.seen(asked[:, 0], y, asked[:, 1]).T, **ASKED)
    colours = LineCollection(pieces, cmap=COLOURS, linewidths=2.4, capstyle="round", zorder=3)
    colours.set_array(np.array(off))
    colours.set_clim(0.0, largest)
    panel.add_collection(colours)
    scene = line.fit.scene
    x = [to_mm(scene.display.span) * node for node in range(scene.display.node_count)]
    nodes = view.seen(x, y, [to_mm(node.height) for node in scene.nodes])
    panel.plot(*nodes.T, zorder=4, **HUB)
    panel.annotate(
        str(line.number), nodes[0], xytext=(-6, 0), textcoords="offset points", ha="right", va="center", color=DARK
    )
    return colours


def _draw_floor(panel: Axes, view: _View) -> None:
    """The rectangle below the lines, at their lowest height, with its sizes, and how high the highest place is."""
    corners = np.vstack(
        [view.seen([0.0, view.width], 0.0, [view.low] * 2), view.seen([view.width, 0.0], view.depth, [view.low] * 2)]
    )
    panel.fill(*corners.T, color="#f2f2f2", edgecolor=GREY, linewidth=0.8, zorder=0)
    post = view.seen([view.width] * 2, view.depth, [view.low, view.high])
    panel.plot(*post.T, color=GREY, linewidth=THIN, zorder=1)
    look: Any = {"textcoords": "offset points", "color": DARK}
    below = 0.5 * (corners[0] + corners[1])
    panel.annotate(f"{view.width:.4g} mm", below, xytext=(0, -6), ha="center", va="top", **look)
    beside = 0.5 * (corners[1] + corners[2])
    if view.depth:
        panel.annotate(f"{view.depth:.4g} mm", beside, xytext=(8, -4), ha="left", va="top", **look)
    for place, height in zip(post, (view.low, view.high), strict=True):
        panel.annotate(f"{height:.3g} mm", place, xytext=(5, 0), ha="left", va="center", **look)


def _frame(panel: Axes, view: _View) -> None:
    """Show all of it, true to aspect, and no axes: what is seen in perspective has no scale."""
    ends = [view.seen([0.0, view.width], y, [z] * 2) for y in (0.0, view.depth) for z in (view.low, view.high)]
    low, high = np.vstack(ends).min(axis=0) - ROOM, np.vstack(ends).max(axis=0) + ROOM
    panel.set(xlim=(low[0], high[0] + 2.0 * ROOM), ylim=(low[1], high[1]))
    panel.set_aspect("equal")
    panel.axis("off")
