"""Figure of an atlas: which states there are, the folds between, and the force of motors that each state takes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from curveline.atlases.atlas import NONE, Atlas
from curveline.atlases.folds import FOLD
from curveline.atlases.grid import AtlasAxis
from curveline.figures.common import (
    COLOURS,
    DARK,
    FORCE,
    GREY,
    THICK,
    THIN,
    bytes_of,
    draw_legend,
    legend_entry,
    new_figure,
    within,
)
from curveline.figures.sweeps import LEGEND_ROOM, MAP_HEIGHT, MAP_WIDTH, MIXED, PLAIN, label_of
from curveline.rod.problem import Array
from curveline.scene import PEAK, VALLEY

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHOWN = (PEAK, VALLEY)
"""States whose force has a panel."""
SERIES = (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 5.0, 7.0), tuple(np.arange(4, 40) / 4.0)
"""Of which, times powers of ten, contours are drawn; the first that has enough."""
FEWEST = 4
ABSENT, EMPTY = "#F2F2F2", "#FFFFFF"
FOLD_LABEL, END_LABEL = "thick: a state folds", "thin: it bifurcates, or the rod is taut"


def draw(found: Atlas, kind: str) -> bytes:
    """The figure as "svg", "png" or "pdf"; MissingExtra without matplotlib."""
    names = [name for name in SHOWN if (found.entries["name"] == name).any()]
    width = MAP_WIDTH * (1 + len(names))
    with new_figure(width, MAP_HEIGHT + LEGEND_ROOM, kind) as figure:
        first, *others = figure.subplots(1, 1 + len(names), squeeze=False)[0]
        colours = _colours(found)
        _draw_kinds(first, found, colours)
        for panel, name in zip(others, names, strict=True):
            _draw_force(panel, found, name)
        for panel in (first, *others):
            _draw_folds(panel, found)
            _dress(panel, found.axes)
        fixed = ", ".join(f"{key} = {value:g}" for key, value in found.fixed.items())
        figure.suptitle(within(f"{found.display.name}, {fixed}", width))
        draw_legend(figure, _legend(found, colours, has_forces=bool(names)))
        return bytes_of(figure, kind)


def _colours(found: Atlas) -> dict[str, str]:
    """The colour of every combination of kinds, the most frequent first."""
    mixed = iter(MIXED)
    colours: dict[str, str] = {}
    for kinds in (each.kinds for each in found.tallies()):
        known = EMPTY if kinds == NONE else COLOURS.get(kinds) or PLAIN.get(kinds)
        colours[kinds] = known or next(mixed, MIXED[-1])
    return colours


def _draw_kinds(panel: Axes, found: Atlas, colours: dict[str, str]) -> None:
    """A cell for every point of the grid."""
    from matplotlib.colors import to_rgb

    names = list(colours)
    cells = np.array([names.index(each) for each in found.kinds.ravel().tolist()]).reshape(found.shape)
    image = np.array([to_rgb(colours[name]) for name in names])[cells.T]
    box = _box(found.axes)
    panel.imshow(image, origin="lower", extent=box, interpolation="nearest", aspect="auto", alpha=0.75)
    panel.set_title("stable states")


def _box(axes: tuple[AtlasAxis, AtlasAxis]) -> tuple[float, float, float, float]:
    """What the cells of a grid cover: half a cell beyond its points."""
    ends = [axis.start + share * (axis.stop - axis.start) for axis in axes for share in _beyond(axis.count)]
    return ends[0], ends[1], ends[2], ends[3]


def _beyond(count: int) -> tuple[float, float]:
    half = 0.5 / (count - 1)
    return -half, 1.0 + half


def _draw_force(panel: Axes, found: Atlas, name: str) -> None:
    """Contours of the largest force that a state asks of a motor, and where it asks for too much."""
    force, share = found.over_grid(name, found.force), found.over_grid(name, found.share)
    across, up = (axis.values() for axis in found.axes)
    panel.set_title(f"{name}: force of a motor [N]")
    if _has_contours(share):
        panel.contourf(across, up, share.T, levels=[1.0, np.inf], colors=[GREY], alpha=0.35)
    if _has_contours(force):
        lines = panel.contour(across, up, force.T, levels=_levels(force), colors=[FORCE], linewidths=THIN)
        panel.clabel(lines, fmt="%g", fontsize=8.0, colors=[DARK])
    panel.set_facecolor(ABSENT)
    there = np.where(np.isnan(force.T), np.nan, 1.0)
    panel.imshow(
        there, origin="lower", extent=_box(found.axes), interpolation="nearest", aspect="auto", cmap="gray", vmin=0,
        vmax=1, zorder=0,
    )  # fmt: skip


def _has_contours(values: Array) -> bool:
    """True if there is a cell of which all corners have a value."""
    there = ~np.isnan(values)
    return bool((there[1:, 1:] & there[:-1, 1:] & there[1:, :-1] & there[:-1, :-1]).any())


def _levels(force: Array) -> list[float]:
    """Round forces [N] for contours, in even ratios: near taut rods they are many times those elsewhere."""
    low, high = (float(each) for each in np.nanquantile(force, (0.02, 0.98)))
    tens = 10.0 ** np.arange(-4.0, 5.0)
    for steps in SERIES:
        series = np.sort(np.outer(tens, steps).ravel())
        levels = series[(series >= low) & (series <= high)]
        if levels.size >= FEWEST:
            break
    return [float(f"{each:.6g}") for each in levels.tolist()] or [0.5 * (low + high)]


def _draw_folds(panel: Axes, found: Atlas) -> None:
    """Lines on which states end: thick where one folds, thin else."""
    from matplotlib.collections import LineCollection

    folds = found.folds
    segments = folds.places[folds.lines]
    is_fold = (folds.kinds[folds.lines] == FOLD).all(axis=1)
    for those, width in ((is_fold, THICK), (~is_fold, THIN)):
        panel.add_collection(LineCollection(list(segments[those]), colors=DARK, linewidths=width, capstyle="round"))


def _dress(panel: Axes, axes: tuple[AtlasAxis, AtlasAxis]) -> None:
    left, right, low, high = _box(axes)
    panel.set(xlim=(left, right), ylim=(low, high), xlabel=label_of(axes[0].key), ylabel=label_of(axes[1].key))
    panel.spines[["top", "right"]].set_visible(False)


def _legend(found: Atlas, colours: dict[str, str], *, has_forces: bool) -> list[Any]:
    from matplotlib.patches import Patch

    look: dict[str, Any] = {"edgecolor": GREY, "linewidth": 0.5}
    entries: list[Any] = [Patch(facecolor=colour, label=name, alpha=0.75, **look) for name, colour in colours.items()]
    is_fold = found.folds.kinds == FOLD
    if is_fold.any():
        entries.append(legend_entry(FOLD_LABEL, color=DARK, linewidth=THICK))
    if not is_fold.all():
        entries.append(legend_entry(END_LABEL, color=DARK, linewidth=THIN))
    if has_forces and (found.share > 1.0).any():
        entries.append(Patch(facecolor=GREY, alpha=0.35, label="beyond motors or rod", **look))
    return entries
