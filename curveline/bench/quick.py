"""The figures that are held against goals, in groups: `curveline bench --quick`.

Compare the ratios, which are taken in the same run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

from curveline.bench import commands, fits, in_space, link, one_rod, plans, search, sweeps
from curveline.bench.measurement import Measurement
from curveline.shapes.files import read_shape


class FigureGroup(NamedTuple):
    """Figures that are measured one after the other, and what is said while they are."""

    name: str
    rows: Callable[[], Iterator[Measurement]]


def quick(shapes: Sequence[str]) -> list[FigureGroup]:
    """The figures of `bench --quick` over the given shape files; InvalidInput for a file that can't be read."""
    scenes = [read_shape(path) for path in shapes]
    return [
        FigureGroup("one rod", one_rod.rows),
        FigureGroup("long rods", one_rod.linear_cost),
        FigureGroup("rods in space", in_space.rows),
        FigureGroup("all states", partial(search.all_states, scenes)),
        FigureGroup("random scenes", search.random_scenes),
        FigureGroup("plans", plans.rows),
        FigureGroup("fits", fits.rows),
        FigureGroup("sweeps", sweeps.rows),
        FigureGroup("whole commands", partial(commands.rows, [scene.path for scene in scenes])),
    ]


def radio_link() -> list[FigureGroup]:
    """The figures of `bench --link`."""
    return [FigureGroup("the radio link", lambda: iter(link.rows()))]
