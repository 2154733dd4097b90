"""Figures of a sweep: over one key a value of every state, over two a map of which states exist."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from curveline.figures.common import (
    COLOURS,
    DARK,
    DOES_NOT_STAY,
    GREY,
    THICK,
    THIN,
    UNSHOWN,
    UNSHOWN_LOOK,
    WIDTH,
    by_kind,
    bytes_of,
    colour_of,
    draw_legend,
    kind_of,
    legend_entry,
    look_of,
    new_figure,
    within,
)
from curveline.rod.problem import Array
from curveline.scene import PEAK, VALLEY
from curveline.simulation.results import Settings
from curveline.simulation.sweep import Sweep, SweepAxis
from curveline.simulation.sweep_files import SweepFile
from curveline.simulation.sweep_view import StateCurve, StateMap, ValueCurves, gathering, view_of
from curveline.system.files import NewFile

if TYPE_CHECKING:
    from matplotlib.axes import Axes

UNITS = {"_mm": "mm", "_mJ": "mJ", "_Nmm": "N mm", "_N": "N", "_per_m": "1/m", "_deg": "deg"}
CURVES_HEIGHT = 3.4  # [inch] of a panel of values
MAP_WIDTH, MAP_HEIGHT = 5.2, 4.2  # [inch] of a map
LEGEND_ROOM = 0.4  # [inch]
MOST_DOTS = 41
"""Points of a curve that are marked one by one."""
NO_STATE, REST, FAILED = "none", "other combinations", "not simulated"
PLAIN: Mapping[str, str] = {
    **{kind: colour for kind, colour in COLOURS.items() if kind in (PEAK, VALLEY)},
    f"{PEAK}, {VALLEY}": "#D9D9D9",
    NO_STATE: "#4D4D4D",
    REST: "#F2F2F2",
    FAILED: "#FFFFFF",
}
"""Colours of the combinations of states that mostly come out."""
MIXED = ("#80CDC1", "#CAB2D6", "#FDBF6F", "#B2DF8A", "#F4A9A8", "#A6CEE3", "#F0E442", "#C7B299")
"""Of others, the most frequent first."""


class SweepPicture(SweepFile):
    """A figure, drawn when all points are there."""

    def __init__(self, file: NewFile, sweep: Sweep, settings: Settings, *, kind: str, plot: str = "") -> None:
        super().__init__(file, sweep, settings)
        self._kind = kind
        self._found = gathering(view_of(sweep, plot))
        self.make = self._found.make

    def take(self, product: Any) -> None:
        """A point."""
        self._found.take(product)

    def finish(self) -> None:
        """Draw."""
        self._file.write(draw(self._found, self._kind))


def draw(found: ValueCurves | StateMap, kind: str) -> bytes:
    """A figure of a sweep as "svg", "png" or "pdf"; MissingExtra without matplotlib."""
    return draw_values(found, kind) if isinstance(found, ValueCurves) else draw_map(found, kind)


def draw_values(found: ValueCurves, kind: str) -> bytes:
    """A value of every state over one key: a panel for each segment that the key has to do with."""
    view = found.view
    (axis,) = view.axes
    with new_figure(WIDTH, CURVES_HEIGHT * len(view.segments) + LEGEND_ROOM, kind) as figure:
        panels = figure.subplots(len(view.segments), 1, squeeze=False, sharex=True)[:, 0]
        for panel, index in zip(panels, view.segments, strict=True):
            curves = {name: curve for (segment, name), curve in found.curves.items() if segment == index}
            for name, curve in curves.items():
                alike = [other for each, other in curves.items() if kind_of(each) == kind_of(name)]
                _draw_curve(panel, (name, curve), alike, axis, is_meant=name == view.wanted[index])
            _dress(panel, label_of(axis.key), label_of(view.plot))
            if len(view.wanted) > 1:
                panel.set_title(f"segment {index + 1}")
            panel.label_outer()
        figure.suptitle(within(view.heading, WIDTH))
        draw_legend(figure, _legend(found))
        return bytes_of(figure, kind)


def draw_map(found: StateMap, kind: str) -> bytes:
    """Which states exist over two keys: a panel for each segment that the keys have to do with."""
    view = found.view
    across = min(2, len(view.segments))
    down = -(-len(view.segments) // across)
    names = [FAILED, *found.combinations]
    colours = _colours(found, names)
    with new_figure(MAP_WIDTH * across, MAP_HEIGHT * down + LEGEND_ROOM, kind) as figure:
        panels = figure.subplots(down, across, squeeze=False).flatten()
        for panel, index, cells in zip(panels, view.segments, found.cells, strict=False):
            _draw_cells(panel, cells, [colours[name] for name in names], view.axes)
            _dress(panel, *(label_of(axis.key) for axis in view.axes))
            if len(view.wanted) > 1:
                panel.set_title(f"segment {index + 1}")
        for panel in panels[len(view.segments) :]:
            panel.set_axis_off()
        figure.suptitle(within(view.heading, MAP_WIDTH * across))
        draw_legend(figure, _patches(found, names, colours))
        return bytes_of(figure, kind)


def label_of(key: str) -> str:
    """A key with its unit as figures write it: "mean height [mm]" for mean_height_mm."""
    for suffix, unit in UNITS.items():
        if key.endswith(suffix):
            return f"{key.removesuffix(suffix).replace('_', ' ')} [{unit}]"
    return key.replace("_", " ")


def _dress(panel: Axes, across: str, up: str) -> None:
    panel.set_xlabel(across)
    panel.set_ylabel(up)
    panel.spines[["top", "right"]].set_visible(False)


def _draw_curve(
    panel: Axes, named: tuple[str, StateCurve], alike: Sequence[StateCurve], axis: SweepAxis, *, is_meant: bool
) -> None:
    """A state's values, in pieces where it is not there all along, each solid or dashed.

    Where the number of states `alike`, those of its kind, changes, another one may get its name: the curve ends there.
    """
    name, curve = named
    places = np.array(axis.values())
    points, values = np.array(curve.points), np.array(curve.values)
    stays = np.array(curve.stays, dtype=bool)
    number = np.bincount(np.concatenate([np.array(each.points) for each in alike]), minlength=len(places))
    panel.grid(visible=True, linewidth=0.4, color="#dddddd")
    for begin, end in _pieces(points, stays, number[points]):
        look = look_of(name, is_meant=is_meant, stays=bool(stays[begin])) if curve.can_be_shown else dict(UNSHOWN_LOOK)
        x, y = places[points[begin:end]], values[begin:end]
        panel.plot(x, y, **look)
        if len(places) <= MOST_DOTS or end - begin == 1:
            panel.plot(x, y, color=look["color"], marker=".", markersize=4.0 + look["linewidth"], linestyle="none")


def _pieces(points: Array, stays: Array, number: Array) -> Iterator[tuple[int, int]]:
    """From where to where a curve goes on without a gap and stays, or does not; pieces of which that differs meet."""
    is_apart = (np.diff(points) > 1) | (np.diff(number) != 0)
    ends = [0, *(np.flatnonzero(is_apart | (stays[1:] != stays[:-1])) + 1).tolist(), len(points)]
    for begin, end in pairwise(ends):
        meets = end < len(points) and not is_apart[end - 1]
        yield begin, end + 1 if meets else end


def _legend(found: ValueCurves) -> list[Any]:
    """The kinds of states that are drawn, then what lines mean."""
    curves, wanted = found.curves, found.view.wanted
    shown = {kind_of(name) for (_, name), curve in curves.items() if curve.can_be_shown}
    entries = [legend_entry(kind, **look_of(kind, is_meant=False)) for kind in by_kind(shown)]
    if any(wanted[segment] == name for segment, name in curves):
        entries.append(legend_entry("thick: wanted", linewidth=THICK, color=GREY))
    if not all(all(curve.stays) for curve in curves.values() if curve.can_be_shown):
        entries.append(legend_entry("dashed: does not stay", linewidth=THIN, color=DARK, linestyle=DOES_NOT_STAY))
    if not all(curve.can_be_shown for curve in curves.values()):
        entries.append(legend_entry(UNSHOWN, **UNSHOWN_LOOK))
    return entries


def _draw_cells(panel: Axes, cells: Sequence[int], colours: Sequence[str], axes: tuple[SweepAxis, ...]) -> None:
    """A cell for every point, the first key running to the right and the second up."""
    from matplotlib.colors import to_rgb

    shown = np.array(cells, dtype=np.intp).reshape([axis.count for axis in axes]).T
    extent: list[float] = []
    for number, axis in enumerate(axes):
        low, high = sorted((axis.start, axis.stop))
        half = 0.5 * (high - low) / (axis.count - 1)
        extent += [low - half, high + half]
        if axis.stop < axis.start:
            shown = np.flip(shown, axis=1 - number)
    image = np.array([to_rgb(colour) for colour in colours])[shown]
    box = (extent[0], extent[1], extent[2], extent[3])
    panel.imshow(image, origin="lower", extent=box, interpolation="nearest", aspect="auto")


def _counts(found: StateMap) -> Counter[int]:
    """How many cells of all maps have what, by its number."""
    return sum((Counter(cells) for cells in found.cells), Counter())


def _colours(found: StateMap, names: Sequence[str]) -> dict[str, str]:
    """The colour of every combination of states; all that are rarer than the palette is long share one."""
    often = [names[number] for number, _ in _counts(found).most_common()]
    mixed = [name for name in often if name not in PLAIN and not _is_single(name)]
    single = {name: colour_of(name) for name in names if _is_single(name)}
    return {**dict.fromkeys(mixed, PLAIN[REST]), **single, **dict(zip(mixed, MIXED, strict=False)), **PLAIN}


def _is_single(name: str) -> bool:
    """True for a combination of one kind of state that has a colour of its own."""
    return name in COLOURS


def _patches(found: StateMap, names: Sequence[str], colours: Mapping[str, str]) -> list[Any]:
    """A legend of what is on the maps, the most frequent first."""
    from matplotlib.patches import Patch

    often = [names[number] for number, _ in _counts(found).most_common()]
    labels = dict.fromkeys(REST if colours[name] == PLAIN[REST] else name for name in often)
    look: dict[str, Any] = {"edgecolor": GREY, "linewidth": 0.5}
    return [Patch(facecolor=colours[label], label=label, **look) for label in labels]
