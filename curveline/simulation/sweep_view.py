"""What a figure shows of a sweep, gathered point by point: values of states over one key, which exist over two."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

from curveline.errors import InvalidInput
from curveline.scene import PEAK, VALLEY
from curveline.shapes.toml_document import nearest
from curveline.simulation.batch import Maker, Task
from curveline.simulation.results import ShapeReport
from curveline.simulation.sweep import Sweep, SweepAxis, digests
from curveline.simulation.sweep_files import CLAMPS, COLUMNS, Row, rows_of

USUAL = "mean_height_mm"
"""What is shown over one key, unless something else is asked for."""
PLOTTED = (
    USUAL,
    "energy_mJ",
    "lowest_eigenvalue",
    "max_curvature_per_m",
    "clearance_mm",
    "max_depth_mm",
    "error_mm",
    "vertices",
    "iterations",
    "winding",
    *CLAMPS,
)
"""What of a state's row is a number that can be shown."""
MOST_KEYS = 2
JOINT = ", "
"""Between the kinds of states that are there together."""


class SweepView(NamedTuple):
    """What a figure shows of a sweep: the keys that take several values, at most two, and over one key what.

    `plot` is one of `PLOTTED`; `segments`, from 0, are those that the keys have to do with.
    """

    name: str
    axes: tuple[SweepAxis, ...]
    fixed: tuple[SweepAxis, ...]
    wanted: tuple[str, ...]
    segments: tuple[int, ...]
    plot: str

    @property
    def heading(self) -> str:
        """The shape, and the values of the keys that take but one."""
        fixed = ", ".join(f"{axis.key} = {axis.start:g}" for axis in self.fixed)
        return f"{self.name}{fixed and f', {fixed}'}"


def view_of(sweep: Sweep, plot: str = "") -> SweepView:
    """How a sweep is shown; InvalidInput for more than two keys, or for something that cannot be plotted."""
    moving = tuple(axis for axis in sweep.axes if axis.count > 1) or sweep.axes[:1]
    if len(moving) > MOST_KEYS:
        keys = ", ".join(axis.key for axis in moving)
        hint = "give all but two of them one value, KEY=VALUE:VALUE:1, or write .csv or .npz"
        raise InvalidInput(f"a figure shows a sweep over one key or two, not {len(moving)}: {keys}", hint)
    if plot and len(moving) > 1:
        hint = "leave --plot out, or give one of the keys one value, KEY=VALUE:VALUE:1"
        raise InvalidInput(f"--plot {plot}: over two keys the figure is a map of which states exist", hint)
    scene = sweep.file.scene
    fixed = tuple(axis for axis in sweep.axes if axis not in moving)
    wanted = tuple(segment.state for segment in scene.segments)
    touched = {index for axis in moving for index in _touched(sweep, axis)}
    return SweepView(scene.name, moving, fixed, wanted, tuple(sorted(touched)), check_plot(plot) or USUAL)


def check_plot(plot: str) -> str:
    """What is to be plotted, if it can be; empty for the usual; InvalidInput else."""
    if plot and plot not in PLOTTED:
        hint = f"{nearest(plot, list(PLOTTED))}choose one of {', '.join(PLOTTED)}"
        raise InvalidInput(f"--plot {plot}: states have no such number", hint)
    return plot


def _touched(sweep: Sweep, axis: SweepAxis) -> Iterator[int]:
    """The segments that a key has to do with: both of a node, the one of a load."""
    table, index = axis.path[0], int(axis.path[1])
    count = len(sweep.file.scene.segments)
    if table == "nodes":
        yield from (each for each in (index - 1, index) if 0 <= each < count)
    else:
        yield sweep.file.scene.loads[index].segment if table == "loads" else index


class StateValue(NamedTuple):
    """A state at a point: its segment from 0, name, value (NaN if not known), and what tells how it is drawn."""

    segment: int
    name: str
    value: float
    stays: bool
    can_be_shown: bool


def values_of(view: SweepView, task: Task, report: ShapeReport) -> tuple[int, list[StateValue]]:
    """A maker: the number of the point, from 0, and the value of every state of the segments that are shown."""
    return values_in(view, rows_of(task, report), (task.number, len(task.swept)))


def values_in(view: SweepView, rows: Iterable[Row], point: tuple[int, int]) -> tuple[int, list[StateValue]]:
    """What `values_of` makes of the rows of a point, which has a number from 1, and how many values were swept."""
    number, swept = point
    found = []
    for row in rows:
        cells = dict(zip(COLUMNS, row[1 + swept :], strict=True))
        index = cells["segment"] - 1
        if index in view.segments:
            value = math.nan if cells[view.plot] is None else float(cells[view.plot])
            shown = not (cells["winding"] or cells["crosses_itself"] or cells["wraps_clamp"])
            found.append(StateValue(index, cells["state"], value, bool(cells["stable"]), shown))
    return number - 1, found


@dataclass
class StateCurve:
    """The values of one state over the points at which it is there, by their numbers from 0, and whether it stays."""

    can_be_shown: bool
    points: array[int] = field(default_factory=lambda: array("l"))
    values: array[float] = field(default_factory=lambda: array("d"))
    stays: array[int] = field(default_factory=lambda: array("b"))


class ValueCurves:
    """What a sweep over one key showed: curves by segment and state; filled point by point."""

    def __init__(self, view: SweepView) -> None:
        self.view = view
        self.make: Maker = partial(values_of, view)
        self.curves: dict[tuple[int, str], StateCurve] = {}

    def take(self, product: tuple[int, list[StateValue]]) -> None:
        """What `make` made of a point."""
        number, states = product
        for state in states:
            curve = self.curves.setdefault((state.segment, state.name), StateCurve(state.can_be_shown))
            curve.points.append(number)
            curve.values.append(state.value)
            curve.stays.append(state.stays)


def combinations_of(view: SweepView, task: Task, report: ShapeReport) -> tuple[int, list[str]]:
    """A maker: the number of the point, from 0, and the kinds of states of the segments that are shown."""
    return combination(view, task.number, [digest.states for digest in digests(task, report)])


def combination(view: SweepView, number: int, kinds: Sequence[str]) -> tuple[int, list[str]]:
    """What `combinations_of` makes of the kinds of states of every segment at the point of a number from 1."""
    return number - 1, [_sorted(kinds[index]) for index in view.segments]


def _sorted(states: str) -> str:
    """Kinds of states in an order that does not hang on which is the higher one: peak, valley, others."""
    return JOINT.join(sorted(states.split(JOINT), key=lambda kind: (kind not in (PEAK, VALLEY), kind)))


class StateMap:
    """What a sweep over two keys showed: a byte for every point and segment; filled point by point."""

    def __init__(self, view: SweepView) -> None:
        self.view = view
        self.make: Maker = partial(combinations_of, view)
        self.combinations: dict[str, int] = {}
        """Numbers, from 1, of what there is: 0 is a point that could not be simulated."""
        count = math.prod(axis.count for axis in view.axes)
        self.cells = [array("H", bytes(2 * count)) for _ in view.segments]

    def take(self, product: tuple[int, list[str]]) -> None:
        """What `make` made of a point."""
        number, found = product
        for cells, states in zip(self.cells, found, strict=True):
            cells[number] = self.combinations.setdefault(states, len(self.combinations) + 1)


def gathering(view: SweepView) -> ValueCurves | StateMap:
    """What takes the points of a sweep for a figure: `take` what `make` made of each."""
    return ValueCurves(view) if len(view.axes) == 1 else StateMap(view)
