"""Figures of trials beside the model: a panel per set of boundary conditions, with the shapes that have them.

After Fig. 6 of *A Multi-Stable Curved Line Shape Display*.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from curveline.comparing.agreement import Comparison, SegmentAgreement, ShapeAgreement
from curveline.figures.common import (
    DARK,
    GREY,
    HUB,
    X_LABEL,
    Y_LABEL,
    PanelFrame,
    by_kind,
    bytes_of,
    colour_of,
    draw_legend,
    fit_height,
    kind_of,
    legend_entry,
    new_figure,
    within,
)
from curveline.system.files import printable
from curveline.units import to_mm

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANEL = 3.1, 3.0  # [inch] width of one of several panels in a row, height before it is fitted
ALONE = 6.4  # [inch]
FEW, MANY = 2, 4
"""Panels in a row of up to four panels, and of more."""
DRAWN = 4
"""Of that many points of a curve one is drawn; the first and the last are."""
ROOM = 20.0  # [mm] around the curves
STEEPEST = 1.3
MODEL: Any = {"color": DARK, "linewidth": 1.0, "linestyle": (0, (4, 3)), "zorder": 3}
OTHERS: Any = {"color": GREY, "linewidth": 0.8, "linestyle": ":", "zorder": 1}
TRIALS: Any = {"linewidth": 2.6, "alpha": 0.6, "zorder": 2}
BAND: Any = {"alpha": 0.3, "linewidth": 0.0, "zorder": 2}
TITLE: Any = {"fontsize": 8.0, "loc": "left"}


def draw(found: Comparison, argv: tuple[str, ...] = (), *, kind: str) -> bytes:
    """Mean curves of trials with their band, the model dashed, MSD and RMSE in each panel: "svg", "png" or "pdf".

    MissingExtra without matplotlib.
    """
    panels = _panels(found.shapes)
    columns = 1 if len(panels) == 1 else FEW if len(panels) <= 2 * FEW else MANY
    rows = -(-len(panels) // columns)
    width = ALONE if columns == 1 else columns * PANEL[0]
    with new_figure(width, rows * PANEL[1], kind) as figure:
        axes = figure.subplots(rows, columns, squeeze=False)
        frame = _frame(found.shapes)
        for axis, shapes in zip(axes.flat, panels, strict=False):
            _draw_panel(axis, shapes, width / columns)
        for axis in axes.flat:
            frame.show_in(axis)
        for axis in axes.flat[len(panels) :]:
            axis.axis("off")
        for axis in axes[-1]:
            axis.set_xlabel(X_LABEL)
        for axis in axes[:, 0]:
            axis.set_ylabel(Y_LABEL)
        _draw_legend(figure, found)
        fit_height(figure, [list(row) for row in axes])
        return bytes_of(figure, kind)


def _panels(shapes: Sequence[ShapeAgreement]) -> list[list[ShapeAgreement]]:
    """Shapes with the same nodes and lengths together, in the order in which they come."""
    found: dict[Any, list[ShapeAgreement]] = {}
    for shape in shapes:
        scene = shape.scene
        key = scene.display.digest, scene.nodes, tuple(each.length for each in scene.segments)
        found.setdefault(key, []).append(shape)
    return list(found.values())


def _frame(shapes: Sequence[ShapeAgreement]) -> PanelFrame:
    """One frame for all panels, so that heights can be compared."""
    points = [to_mm(1.0) * each.points for shape in shapes for part in shape.segments for each in part.curves]
    pivots = [
        np.array([[to_mm(place * shape.scene.display.span), to_mm(node.height)]])
        for shape in shapes
        for place, node in enumerate(shape.scene.nodes)
    ]
    return PanelFrame.around(np.vstack([*points, *pivots]), ROOM).within(0.2, STEEPEST)


def _draw_panel(axis: Axes, shapes: Sequence[ShapeAgreement], width: float) -> None:
    """The shapes of one set of boundary conditions."""
    told = []
    for shape in shapes:
        for part in shape.segments:
            _draw_segment(axis, part)
        told.append(_numbers(shape))
        for place, node in enumerate(shape.scene.nodes):
            axis.plot(to_mm(place * shape.scene.display.span), to_mm(node.height), **HUB)
    axis.set_title("\n".join([within(_title(shapes), width - 0.4), *told]), **TITLE)
    axis.grid(visible=True, linewidth=0.4, color="#dddddd")
    axis.spines[["top", "right"]].set_visible(False)


def _title(shapes: Sequence[ShapeAgreement]) -> str:
    """What the names of some shapes have in common, but for their states."""
    names = [printable(each.scene.name) for each in shapes]
    first, *others = [re.split("[-_ ]+", name) for name in names]
    kept = [word for word in first if all(word in other for other in others)]
    return " ".join(kept) or ", ".join(names)


def _draw_segment(axis: Axes, part: SegmentAgreement) -> None:
    for state in part.curves:
        points = to_mm(1.0) * state.points[::DRAWN]
        axis.plot(*points.T, **(MODEL if state.name == part.state else OTHERS))
    if not part.x.size:
        return
    x, mean = to_mm(1.0) * part.x[::DRAWN], to_mm(1.0) * part.mean[::DRAWN]
    axis.plot(x, mean, color=colour_of(part.state), **TRIALS)
    if part.deviation.size:
        band = to_mm(1.0) * part.deviation[::DRAWN]
        axis.fill_between(x, mean - band, mean + band, color=colour_of(part.state), **BAND)


def _numbers(shape: ShapeAgreement) -> str:
    """MSD and RMSE of a shape, or why there are none."""
    if not shape.segments:
        return "no trial could be used"
    state = ", ".join(dict.fromkeys(shape.states))
    used = sum(each.counts for each in shape.trials)
    if used < len(shape.trials):
        state += f" in {used} of {len(shape.trials)} trials"
    elif not shape.is_wanted:
        state += " (not wanted)"
    parts = [f"{name} {to_mm(value):.2f}" for name, value in (("MSD", shape.msd), ("RMSE", shape.rmse)) if value]
    return f"{state}: {', '.join(parts)} mm" if parts else f"{state}: it overhangs"


def _draw_legend(figure: Any, found: Comparison) -> None:
    kinds = {kind_of(part.state) for shape in found.shapes for part in shape.segments if part.state}
    entries = [legend_entry(f"{name}, mean of trials", color=colour_of(name), **TRIALS) for name in by_kind(kinds)]
    entries.append(legend_entry("model", **MODEL))
    if any(each.name != part.state for shape in found.shapes for part in shape.segments for each in part.curves):
        entries.append(legend_entry("its other states", **OTHERS))
    draw_legend(figure, entries)
