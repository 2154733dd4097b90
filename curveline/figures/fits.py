"""Figures of a fit: the drawing and the curve that is nearest to it, where they are apart, and why."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from curveline.figures.common import (
    DARK,
    FORCE,
    GREY,
    THIN,
    WIDTH,
    Y_LABEL,
    PanelFrame,
    by_kind,
    bytes_of,
    clamp_shown,
    draw_legend,
    draw_node,
    dress,
    fit_height,
    kind_of,
    legend_entry,
    look_of,
    new_figure,
    within,
)
from curveline.fitting.fit import Fit
from curveline.fitting.measured import Gaps
from curveline.phrases import wrapped
from curveline.system.files import AnyPath
from curveline.units import to_mm

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PER_SEGMENT, WIDEST = 1.8, 12.0  # [inch] of width for each segment of a row, and at most
START_HEIGHT = 6.0  # [inch] of a figure before its panels are measured
LEAST_SHOWN = 1e-3  # [mm] at the top of the panel of the distances
GAPS_HEIGHT = 1.2  # [inch] of the panel of the distances
MARKED = 3
"""Places that are marked, with the reasons why."""
LETTERS_OF_REASON = 70
"""In a line of the legend."""
LEAST_SHARE = 0.5
"""Of the largest distance, that a place has to be marked."""
ROOM = 0.08
"""Beside and above all that is drawn, as a part of the span between nodes."""
TARGET: Any = {"color": DARK, "linewidth": THIN, "linestyle": (0, (4, 2)), "zorder": 4}


def draw(found: Fit, path: AnyPath = "", argv: tuple[str, ...] = (), *, kind: str) -> bytes:
    """A fit as "svg", "png" or "pdf": above the drawing and the curve, below how far the drawing is from the curve.

    MissingExtra without matplotlib.
    """
    width = min(WIDEST, max(WIDTH, PER_SEGMENT * len(found.curves)))
    with new_figure(width, START_HEIGHT, kind) as figure:
        above, below = figure.subplots(2, 1)
        _draw_curves(above, found, width)
        highest = _draw_gaps(below, found)
        below.set(xlim=above.get_xlim(), ylim=(0.0, GAPS_HEIGHT / width * float(np.ptp(above.get_xlim()))))
        entries = [
            legend_entry("drawn", **TARGET),
            *(legend_entry(each, **look_of(each, is_meant=True)) for each in by_kind(_kinds(found))),
            *(_reason(number, found) for number in range(1, len(_marked(found)) + 1)),
        ]
        draw_legend(figure, entries)
        fit_height(figure, [[above], [below]])
        # It was made as high as it is to be as if it were true to aspect.
        below.set_aspect("auto")
        below.set_ylim(0.0, 1.1 * max(highest, LEAST_SHOWN))
        return bytes_of(figure, kind)


def _kinds(found: Fit) -> set[str]:
    return {kind_of(segment.state) for segment in found.scene.segments}


def _marked(found: Fit) -> list[int]:
    """Which of the worst places are marked."""
    worst = found.worst[:MARKED]
    return [place for place, miss in enumerate(worst) if miss.off >= LEAST_SHARE * worst[0].off]


def _reason(number: int, found: Fit) -> Any:
    """An entry of the legend that says how far a marked place is off, and why."""
    miss = found.worst[number - 1]
    label = "\n".join(wrapped(f"{number}: {to_mm(miss.off):.3g} mm, {miss.why}", width=LETTERS_OF_REASON, hang=0))
    return legend_entry(label, color=FORCE, marker="o", linestyle="none")


def _draw_curves(panel: Axes, found: Fit, width: float) -> None:
    """The drawing, the curve and the nodes that hold it, with the places where they are farthest apart."""
    for segment, curve in zip(found.scene.segments, found.curves, strict=True):
        panel.plot(*(to_mm(1.0) * curve).T, **look_of(segment.state, is_meant=True))
    for piece in found.drawn:
        panel.plot(*(to_mm(1.0) * piece).T, **TARGET)
    display = found.scene.display
    for index, node in enumerate(found.scene.nodes):
        tangent = math.cos(node.angle), math.sin(node.angle)
        draw_node(panel, (index * display.span, node.height), tangent, clamp_shown(display))
    for place in _marked(found):
        miss = found.worst[place]
        _mark(panel, place + 1, (to_mm(miss.x), to_mm(miss.y)))
    heading = f"{found.scene.name}: {to_mm(found.rms):.3g} mm RMS, {to_mm(found.max):.3g} mm at most"
    panel.set_title(within(heading, width))
    dress(panel, Y_LABEL)
    panel.set_xlabel("")
    everything = [to_mm(1.0) * points for points in (*found.curves, *found.drawn)]
    PanelFrame.around(np.vstack(everything).tolist(), ROOM * to_mm(display.span)).show_in(panel)


def _mark(panel: Axes, number: int, place: tuple[float, float]) -> None:
    panel.plot(*place, color=FORCE, marker="o", markersize=5.0, zorder=6)
    panel.annotate(str(number), place, xytext=(4, 4), textcoords="offset points", color=DARK, zorder=6)


def _draw_gaps(panel: Axes, found: Fit) -> float:
    """How far every place of the drawing is from the curve; the largest of it [mm]."""
    highest = 0.0
    for curve, piece in zip(found.curves, found.drawn, strict=True):
        off = to_mm(1.0) * Gaps.between(curve, piece).back
        highest = max(highest, float(off.max()))
        panel.plot(to_mm(1.0) * piece[:, 0], off, color=FORCE, linewidth=THIN)
        panel.fill_between(to_mm(1.0) * piece[:, 0], off, color=FORCE, alpha=0.25, linewidth=0.0)
    panel.axhline(to_mm(found.rms), color=GREY, linewidth=THIN)
    panel.annotate("RMS", (0.0, to_mm(found.rms)), xytext=(2, 2), textcoords="offset points", color=DARK)
    dress(panel, "apart [mm]")
    return highest
