"""What pushing a shape showed, in text for terminals of 80 columns."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import TypeVar

from curveline.cli.printing import screen
from curveline.cli.printing.manner import MANNER
from curveline.cli.printing.progress.progress_bar import Bar
from curveline.cli.printing.tables import fitting
from curveline.loading.load_map import LoadMap, MapPoint, Verdict, load_map
from curveline.loading.pushes import Push, Stand
from curveline.loading.results import EITHER, either
from curveline.loading.snap_through import LOST, Loading, load
from curveline.phrases import wrapped
from curveline.scene import Scene
from curveline.units import decimals_of, to_mm, to_n_per_mm

MAP_POINTS = 41
ROWS = 21
"""Of a table, so that it fits a screen with what is said around it."""
Row = TypeVar("Row")
TASKS = {1.0: "searching for a target", 2.0: "following a contour, lightly", 5.0: "following a contour, firmly"}
"""What fingers do with the forces of a map [N]."""


def found(scene: Scene, push: Push, points: int | None) -> Loading | LoadMap:
    """Push one point, or so many, under a bar: in percent of the largest load, or in points."""
    with Bar("pushing", points or 100) as bar:
        return load(scene, push, bar.reach) if points is None else load_map(scene, push, points, bar.reach)


def is_lost(found: Loading | LoadMap) -> bool:
    """True if somewhere a branch was lost before it came to a special point."""
    kinds = [point.kind for point in found.points] if isinstance(found, LoadMap) else [found.snap and found.snap.kind]
    return LOST in kinds


def describe(found: Loading | LoadMap) -> Iterator[str]:
    """Lines of text on what was found."""
    if MANNER.is_brief:
        yield _briefly(found)
        return
    head = _of_loading(found) if isinstance(found, Loading) else _of_map(found)
    yield screen.paint(found.scene.name, screen.BOLD, sys.stdout)
    yield from head


def _briefly(found: Loading | LoadMap) -> str:
    """What is pushed, and what it takes to make it snap."""
    push, name = found.push, found.stand.state.name
    what = f"{found.scene.name}, segment {push.segment + 1}, {name}"
    if isinstance(found, LoadMap):
        weakest = found.weakest
        return f"{what}, weakest: " + (
            _withstood(push) if weakest is None else f"{weakest.force:.4g} N at {weakest.at:.4g}"
        )
    snap, where = found.snap, f"{what} at {push.at:g}:"
    if snap is None:
        return f"{where} {_withstood(push)}"
    if snap.kind == LOST:
        return f"{where} followed to {snap.force:.4g} N, and lost there"
    return f"{where} snaps through at {snap.force:.4g} N, lands in {_or(either(snap.landings, 'name'))}"


def _withstood(push: Push) -> str:
    return f"no snap-through up to {push.most:g} N"


def _of_loading(loading: Loading) -> Iterator[str]:
    stand, snap = loading.stand, loading.snap
    place = _where(stand, stand.seen(stand.place(stand.state)))
    yield _what(loading.push, stand)
    yield f"at {loading.push.at:g} of its length: {place}"
    decimals = _decimals(3, *(to_mm(deflection) for _, deflection in loading.rows))
    rows = ((f"{force:.4g}", f"{to_mm(deflection):.{decimals}f}") for force, deflection in thinned(loading.rows))
    head, shown = ("force N", "deflection mm"), list(rows)
    yield from screen.headed(fitting([head, *shown], frozenset()), head, shown)
    stiffness = "not known" if loading.stiffness is None else f"{to_n_per_mm(loading.stiffness):.4g} N/mm"
    yield f"stiffness without load: {stiffness}"
    if snap is None:
        yield _withstood(loading.push)
    elif snap.kind == LOST:
        yield f"followed to {snap.force:.4g} N, and lost there"
    else:
        sentence = f"snaps through at {snap.force:.4g} N ({snap.kind}), lands in {_or(either(snap.landings, 'name'))}"
        yield from wrapped(f"{sentence}; released it is in {_or(either(snap.landings, 'released'))}")
    if loading.leaves_plane is not None:
        yield f"from {loading.leaves_plane:.4g} N on the rod would leave its plane, which is not modelled"
    yield f"curves known to {to_mm(loading.error):.1g} mm, {1e3 * loading.seconds:.0f} ms"


def _of_map(found: LoadMap) -> Iterator[str]:
    yield f"{_what(found.push, found.stand)}, at {len(found.points)} points"
    head = ("at", "x mm", "y mm", "snaps at N", "how")
    decimals = _decimals(3, *(point.force or 0.0 for point in found.points))
    rows = [_cells(found.stand, point, decimals) for point in thinned(found.points)]
    yield from screen.headed(fitting([head, *rows], frozenset({4})), head, rows)
    if found.weakest is None:
        yield f"weakest point: none, all of them withstand {found.push.most:g} N"
    else:
        place = _where(found.stand, (found.weakest.x, found.weakest.y))
        yield f"weakest point: {found.weakest.force:.4g} N ({found.weakest.kind}) at {found.weakest.at:.4g}: {place}"
    if leaving := [point for point in found.points if point.leaves_plane is not None]:
        least = min(point.leaves_plane for point in leaving if point.leaves_plane is not None)
        points = f"{len(leaving)} point{'s' if len(leaving) > 1 else ''}"
        text = f"pushed at {points} the rod would leave its plane before it snaps, at {least:.4g} N or more"
        yield from wrapped(f"{text}: that is not modelled")
    for verdict in found.verdicts:
        yield from wrapped(_verdict(verdict))
    yield f"{found.seconds:.1f} s"


def thinned(rows: Sequence[Row]) -> Sequence[Row]:
    """As many rows, about evenly chosen, as fit a screen; the first and the last among them."""
    if len(rows) <= ROWS:
        return rows
    return [rows[round(number * (len(rows) - 1) / (ROWS - 1))] for number in range(ROWS)]


def _what(push: Push, stand: Stand) -> str:
    way = {"down": "down", "normal": "across the curve"}.get(push.direction, f"towards {push.direction}")
    return f"segment {push.segment + 1}, {stand.state.name} pushed {way}, {stand.state.model} model"


def _where(stand: Stand, place: tuple[float, float]) -> str:
    x, y = _coordinates(stand, place)
    return f"x {x}, y {y} mm"


def _coordinates(stand: Stand, place: tuple[float, float]) -> tuple[str, str]:
    """In mm, to about a ten-thousandth of the rod's length and at least to a hundredth."""
    decimals = max(2, decimals_of(to_mm(stand.rod.length), 5))
    return screen.decimal(to_mm(place[0]), decimals), screen.decimal(to_mm(place[1]), decimals)


def _decimals(least: int, *values: float) -> int:
    """Decimals of a column, at least so many, with which its largest value has four digits."""
    return max(least, decimals_of(max(map(abs, values)), 4))


def _cells(stand: Stand, point: MapPoint, decimals: int) -> tuple[str, ...]:
    force = "-" if point.force is None else f"{point.force:.{decimals}f}"
    return f"{point.at:.4f}", *_coordinates(stand, (point.x, point.y)), force, point.kind


def _verdict(verdict: Verdict) -> str:
    what = f"{verdict.force:g} N ({TASKS[verdict.force]})"
    if verdict.everywhere:
        return f"withstands {what} everywhere"
    return f"does not withstand {what} between {', '.join(f'{a:.3f} and {b:.3f}' for a, b in verdict.stretches)}"


def _or(names: str) -> str:
    return names.replace(EITHER, " or ")
