"""How far the right node of the paper's two asymmetric shapes may turn before their peaks cease to exist.

For `docs/tools/real_rod.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

from real_rod_leaning import leaning_limit
from real_rod_rods import (
    Change,
    after,
    as_it_is,
    clamp_stiffness,
    giving,
    gravity_length,
    keeping,
    longer,
    loose,
    of_rod,
    read,
    session,
    together,
    turned,
    wider,
)

from curveline.rod.branches.continuation import follow, start_along
from curveline.rod.branches.control_path import straight_path
from curveline.rod.states.planar_states import find_states
from curveline.scene import PEAK, VALLEY, Scene
from curveline.simulation.simulate import scene_rod
from curveline.units import deg, mm, to_nmm

LEVEL, STAGGERED = "level-asymmetric-peak", "staggered-asymmetric-peak"
FROM, TO = -60.0, 89.0
"""Between which angles of the right node the peak is followed [deg]."""
EDGES = 384
"""Of the rod that is followed: limits are 0.003 deg off."""
FARTHEST = 75.0
"""To which the display can turn its nodes [deg]."""
BEYOND = 3.0
"""How far from the limit of the rod as it is times are sought [deg]."""
WIDTH = 44
"""Of the words of a row."""
TIMES = ("1min", "10min", "1h", "8h", "1d", "1w")
SHARES = (0.05, 0.1, 0.2)
GIVES = (5.0, 10.0, 20.0, 40.0)
GRAVITY_LENGTHS = (200.0, 250.0, 300.0, 350.0, 450.0, float("inf"))


class Row(NamedTuple):
    """What is changed, and the limits [deg] of the level and of the staggered shape then."""

    cause: str
    level: float
    staggered: float


def limit(scene: Scene, edges: int = EDGES) -> float:
    """How far [deg] the right node of a shape of one segment may turn before its peak ceases to exist."""
    left, right = scene.nodes
    rod = scene_rod(replace(scene, nodes=(left, replace(right, angle=deg(FROM)))), 0)
    peak = next(state for state in find_states(rod, mm(0.01)) if state.name == PEAK)
    path = straight_path(rod.pose, rod.pose._replace(end=deg(TO)))
    return FROM + (TO - FROM) * follow(path, rod.bearing, *start_along(path, peak, edges)).reached


def changes() -> Iterator[tuple[str, Change]]:
    """All that is changed, in words."""
    yield "the rod of the display file", as_it_is
    for whose in (PEAK, VALLEY):
        for share in SHARES:
            yield f"set: {share:.0%} of its own {whose}".replace("%", " %"), keeping(share, whose)
    for whose in (PEAK, VALLEY):
        for time in TIMES:
            yield f"{time} in the {whose}", after(f"{whose}@{time}")
    for strength, words in ((2 / 3, "two thirds"), (4 / 3, "four thirds")):
        yield f"10min in the peak, set of {words}", after("peak@10min", strength)
    for whose in (PEAK, VALLEY):
        for time in TIMES[1:]:
            yield f"8h in the {whose}, {time} at home", after(f"{whose}@8h,home@{time}")
    for give in GIVES:
        stiffness = to_nmm(clamp_stiffness(read(LEVEL), give)) * deg(1.0)
        yield f"clamps give {give:g} mm: {stiffness:.0f} N mm/deg", giving(give)
    yield "free rod bent by -1 /m, rigid clamps", of_rod(natural_curvature=-1.0)
    for bent in (-1.0, 1.0):
        both = together(giving(20.0), of_rod(natural_curvature=bent))
        yield f"free rod bent by {bent:+.0f} /m, clamps give 20 mm", both
    yield "play of 1 deg", loose(1.0)
    yield "third time in a session of 5min each", lambda scene: session(5)[scene.name]
    yield "clamps give 10 mm, 10min in the peak", together(giving(10.0), after("peak@10min"))
    for length in GRAVITY_LENGTHS:
        yield ("no gravity" if length == float("inf") else f"gravity length {length:.0f} mm"), gravity_length(length)
    for by in (1.0, -1.0):
        yield f"left node {by:+.0f} deg", turned(by, 0.0)
    for by in (3.0, -3.0):
        yield f"rod {by:+.0f} mm", longer(by)
    for by in (2.0, -2.0):
        yield f"span {by:+.0f} mm", wider(by)


def leanings() -> Iterator[tuple[str, float]]:
    """By what part the rod is stiffer where it bends counter-clockwise, in words."""
    for share in (0.1, -0.1):
        yield f"{abs(share):.0%} harder to bend {'left' if share > 0.0 else 'right'}".replace("%", " %"), share


def rows() -> list[Row]:
    """The limits of both shapes under all changes."""
    shapes = (read(LEVEL), read(STAGGERED))
    found = [Row(cause, *(limit(change(shape)) for shape in shapes)) for cause, change in changes()]
    return found + [Row(cause, *(leaning_limit(shape, share) for shape in shapes)) for cause, share in leanings()]


def shortest(holds: Callable[[float], bool]) -> float:
    """The time [s] from 1 s to a week from which on something holds that does in the end, to 1 %."""
    short, long = 1.0, 604_800.0
    while long > 1.01 * short:
        middle = (short * long) ** 0.5
        short, long = (short, middle) if holds(middle) else (middle, long)
    return long


def times(name: str) -> tuple[float, float]:
    """How long [s] in the peak moves a limit out by `BEYOND`, and how long in the valley moves it in by as much."""
    scene = read(name)
    fresh = limit(scene)

    def moved(whose: str) -> Callable[[float], bool]:
        return lambda seconds: abs(limit(after(f"{whose}@{seconds}s")(scene)) - fresh) >= BEYOND

    return shortest(moved(PEAK)), shortest(moved(VALLEY))


def report() -> Iterator[str]:
    """The table, line by line."""
    found = rows()
    first = found[0]
    yield f"{'the peak exists up to [deg]':{WIDTH}} level        staggered"
    for row in found:
        level, staggered = (_cells(here, fresh) for here, fresh in zip(row[1:], first[1:], strict=True))
        yield f"{row.cause:{WIDTH}}{level}    {staggered}".rstrip()
    yield ""
    yield f"{f'seconds until it moves by {BEYOND:.0f} deg':{WIDTH}} level        staggered"
    for whose, level, staggered in zip((PEAK, VALLEY), times(LEVEL), times(STAGGERED), strict=True):
        yield f"{f'in the {whose}':{WIDTH}}{level:6.0f}{'':11}{staggered:6.0f}"


def _cells(here: float, fresh: float) -> str:
    if here > FARTHEST:
        return f"{f'>{FARTHEST:.0f}':>6}{'':>7}"
    return f"{here:6.1f}" + (f"{here - fresh:+7.1f}" if here != fresh else f"{'':>7}")
