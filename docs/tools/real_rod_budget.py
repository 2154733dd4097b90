"""By how much causes move the paper's 16 shapes, and what of them may make up its 6.68 mm.

For `docs/tools/real_rod.py`. Curves are compared with those of the planar model with the rod of the display file.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cache
from typing import NamedTuple

import numpy as np
from real_rod_rods import (
    OTHER,
    ROUNDS,
    SHAPES,
    Change,
    after,
    as_it_is,
    clamp_stiffness,
    giving,
    heavier,
    keeping,
    longer,
    loose,
    of_display,
    of_rod,
    read,
    session,
    state_of,
    stiffer,
    together,
    turned,
    wider,
)

from curveline.rod.problem import Array
from curveline.rod.states.equilibrium import EXTENSIBLE, PLANAR
from curveline.scene import Scene
from curveline.units import deg, mm, to_mm, to_nmm

NOT_HELD = ("level-asymmetric-peak", "staggered-asymmetric-peak")
"""The two that its mean leaves out."""
PAPER_MM = 6.68
"""Its mean, over the other 14, of the root mean square difference in height."""
POINTS = 1001
"""Of a curve."""


class Moved(NamedTuple):
    """By how much shapes are moved [mm], and which of them are gone.

    `along` is the root mean square distance of points at the same part of the rod: the root mean square of all shapes,
    the mean, and that of the shape that is moved most. `height` is the paper's: the root mean square difference in
    height over the width that both curves have, mean of the 14 shapes.
    """

    along: float
    mean: float
    worst: float
    height: float
    gone: tuple[str, ...]


@cache
def plain(name: str) -> Array:
    """The curve (n, 2) of a shape of the project [m]."""
    return curve_of(read(name), PLANAR)


def curve_of(scene: Scene, model: str = PLANAR) -> Array | None:
    """The curve (n, 2) that a shape asks for [m]; None if there is none."""
    state = state_of(scene, model=model)
    return None if state is None else state.curve(POINTS)


def in_height(one: Array, other: Array) -> float:
    """The root mean square difference in height of two curves that never turn back, where both of them are [m]."""
    across = np.linspace(max(one[0, 0], other[0, 0]), min(one[-1, 0], other[-1, 0]), POINTS)
    apart = np.interp(across, *one.T) - np.interp(across, *other.T)
    return math.sqrt(np.mean(apart**2))


def moved(curves: dict[str, Array | None]) -> Moved:
    """By how much curves are away from those of the project, by the names of their shapes."""
    there = {name: curve for name, curve in curves.items() if curve is not None}
    along = np.array([math.sqrt(np.mean(np.sum((curve - plain(name)) ** 2, axis=1))) for name, curve in there.items()])
    heights = [in_height(curve, plain(name)) for name, curve in there.items() if name not in NOT_HELD]
    sizes = (math.sqrt(np.mean(along**2)), along.mean(), along.max(), np.mean(heights))
    return Moved(*(to_mm(float(each)) for each in sizes), tuple(name for name in curves if name not in there))


def by(change: Change, model: str = PLANAR) -> Moved:
    """What a change does to the shapes."""
    return moved({name: curve_of(change(read(name)), model) for name in SHAPES})


def kept_of_other(share: float) -> Change:
    """A rod that has kept a share of the curvature of the other state between the same nodes."""
    return lambda scene: keeping(share, OTHER[scene.segments[0].state])(scene)


def in_a_session(minutes: int) -> Moved:
    """What the shapes shown before do, see `session`."""
    return moved({name: curve_of(scene) for name, scene in session(minutes).items()})


def causes() -> Iterator[tuple[str, Callable[[], Moved]]]:
    """Every cause alone, in words."""
    for words, change in sets():
        yield words, lambda change=change: by(change)
    for minutes in (5, 60):
        yield f"a session, {ROUNDS} x {minutes}min each", lambda minutes=minutes: in_a_session(minutes)
    for words, change in (*clamps(), *errors()):
        yield words, lambda change=change: by(change)
    yield "stretch", lambda: by(as_it_is, EXTENSIBLE)


def sets() -> Iterator[tuple[str, Change]]:
    """What the rod was held in."""
    yield "set: 10 % of the other state", kept_of_other(0.1)
    yield "set: 20 % of the other state", kept_of_other(0.2)
    yield "set: 20 % of the same state", lambda scene: keeping(0.2, scene.segments[0].state)(scene)
    for time in ("1min", "10min", "1h", "8h"):
        yield f"{time} in the other state", after(f"other@{time}")
    yield "8h in the other state, 8h at home", after("other@8h,home@8h")
    yield "8h in the same state", after("itself@8h")


def clamps() -> Iterator[tuple[str, Change]]:
    """How the rod is held."""
    for give in (5.0, 10.0, 20.0):
        stiffness = to_nmm(clamp_stiffness(read(SHAPES[0]), give)) * deg(1.0)
        yield f"clamps give {give:.0f} mm: {stiffness:.0f} N mm/deg", giving(give)
    yield "play of 1 deg", loose(1.0)
    yield "clamp length 20 -> 0 mm", of_display(clamp=0.0)
    yield "clamp length 20 -> 15 mm", of_display(clamp=mm(15.0))


def errors() -> Iterator[tuple[str, Change]]:
    """What nodes and file have wrong."""
    yield "both angles + 1 deg", turned(1.0, 1.0)
    yield "left + 1 deg, right - 1 deg", turned(1.0, -1.0)
    yield "span + 2 mm", wider(2.0)
    yield "length + 1 mm", longer(1.0)
    yield "E - 15 %", stiffer(0.85)
    yield "mass + 20 %", heavier(1.2)
    yield "uniform natural curvature of 1 1/m", of_rod(natural_curvature=1.0)


OFF = together(turned(1.0, 1.0), wider(2.0), longer(1.0))
"""What a builder may be off by."""
MIXTURES: dict[str, tuple[float, float, Callable[[float], Change]]] = {
    "clamps give {:.1f} mm": (1.0, 20.0, giving),
    "clamps give {:.1f} mm, clamp length 15 mm": (
        1.0,
        20.0,
        lambda give: together(giving(give), of_display(clamp=mm(15.0))),
    ),
    "clamps give {:.1f} mm, 1h in the other state": (
        1.0,
        20.0,
        lambda give: together(giving(give), after("other@1h")),
    ),
    "clamps give {:.1f} mm, 10min in it, angles, span, length": (
        1.0,
        20.0,
        lambda give: together(giving(give), OFF, after("other@10min")),
    ),
    "{:.0f} min in it, angles, span, length": (
        10.0,
        240.0,
        lambda minutes: together(OFF, after(f"other@{minutes}min")),
    ),
}
"""What may make up the paper's mean: in words with a number, least and most of that number, the change."""


def fitted(low: float, high: float, change: Callable[[float], Change]) -> tuple[float, Moved]:
    """The number between two with which a change makes the paper's mean, and all it does then."""
    for _ in range(12):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if by(change(middle)).height < PAPER_MM else (low, middle)
    return low, by(change(low))


def mixtures() -> Iterator[tuple[str, Moved]]:
    """What makes up the paper's mean, in words."""
    for words, (low, high, change) in MIXTURES.items():
        size, does = fitted(low, high, change)
        yield words.format(size), does


def report() -> Iterator[str]:
    """The table, line by line."""
    yield f"{'moves the 16 shapes by [mm]':58}  rms   mean  worst  height"
    for words, does in causes():
        yield from _lines(words, does())
    yield ""
    yield f"{f'what makes a height of {PAPER_MM} mm':58}  rms   mean  worst  height"
    for words, does in mixtures():
        yield from _lines(words, does)


def _lines(words: str, does: Moved) -> Iterator[str]:
    yield f"{words:57}{does.along:6.2f}{does.mean:7.2f}{does.worst:7.2f}{does.height:8.2f}"
    if does.gone:
        yield f"  gone: {', '.join(does.gone)}"
