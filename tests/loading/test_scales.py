"""Pushing knows no size of its own: from a micrometre to a kilometre the same shape gives the same answer."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import curveline
from curveline.cli.printing.reports import load_report
from curveline.figures import loads
from curveline.loading.load_map import load_map
from curveline.loading.pushes import Push, most_on, stand_of
from curveline.loading.results import document, map_document
from curveline.loading.snap_through import load
from curveline.scene import Load, Scene
from curveline.sections import Rectangle

SHAPES = Path(__file__).parents[2] / "shapes"
SCALES = (1e-6, 1e-3, 1e3)
"""Of half a metre, so that rods are from a micrometre to a kilometre long."""
FORCES = ("most_N", "snap_through_N", "snap_through_error_N", "leaves_plane_N")


def scaled(size: float, name: str = "level-up-peak") -> Scene:
    """A shape whose sizes are so many times those of the file, of the same material; forces go with the square.

    Its weight per length is made to go with the size, too.
    """
    scene = curveline.read_shape(SHAPES / f"{name}.toml")
    display, rod = scene.display, scene.display.rod
    section = Rectangle(size * rod.width, size * rod.thickness)
    rod = replace(
        rod, section=section, mass_per_length=size * rod.mass_per_length, total_length=size * rod.total_length
    )
    return replace(
        scene,
        display=replace(display, span=size * display.span, clamp=size * display.clamp, rod=rod),
        nodes=tuple(replace(node, height=size * node.height) for node in scene.nodes),
        segments=tuple(replace(segment, length=size * segment.length) for segment in scene.segments),
        loads=(Load(0, 0.7, (0.1 * size**2, 0.0)),),
    )


def numbers(found: dict[str, Any], size: float) -> Iterator[tuple[str, Any]]:
    """What was found of a push, in sizes of the rod and forces of its stiffness, by name."""
    for key in FORCES:
        if key in found:
            yield key, None if found[key] is None else found[key] / size**2
    if "curve" in found:
        yield "stiffness", found["stiffness_N_per_mm"] / size
        yield "place", [part / size for part in found["place_mm"]]
        for key in ("curve", "branch"):
            yield key, [[row[0] / size**2, row[1] / size, *row[2:]] for row in found[key]]
        for key in ("unloaded_mm", "loaded_mm"):
            yield key, [[part / size for part in place] for place in found[key]]


def same(found: Any, expected: Any) -> None:
    """Equal to nine digits or so; an error to two, and what is rounding nowhere beside a newton or a millimetre."""
    if isinstance(found, list):
        assert len(found) == len(expected)
        for one, other in zip(found, expected, strict=True):
            same(one, other)
    else:
        assert found == expected if found is None else found == pytest.approx(expected, rel=1e-7, abs=1e-7)


@pytest.mark.parametrize("size", SCALES)
@pytest.mark.parametrize(("name", "direction"), [("level-up-peak", "down"), ("staggered-down-valley", "0,1")])
def test_a_push_gives_the_same_answer_at_every_size(size: float, name: str, direction: str) -> None:
    found = document(load(scaled(size, name), Push(at=0.4, direction=direction, step=0.5 * size**2)))
    expected = document(load(scaled(1.0, name), Push(at=0.4, direction=direction, step=0.5)))
    assert found["stiffness_N_per_mm"] is not None
    assert found["snap_through_N"] is not None
    for (key, value), (_, other) in zip(numbers(found, size), numbers(expected, 1.0), strict=True):
        if key != "most_N":
            same(value, other)
    for key in ("kind", "lands_in", "released_in", "ways", "model", "state"):
        assert found[key] == expected[key]
    assert found["curve_error_mm"] / size == pytest.approx(expected["curve_error_mm"], rel=0.01)


@pytest.mark.parametrize("size", [*SCALES, 1.0])
def test_loads_and_steps_suit_the_rod_unless_they_are_given(size: float) -> None:
    scene = scaled(size)
    rod = stand_of(scene, Push()).rod
    assert 150.0 <= most_on(rod) * rod.free_length**2 / rod.stiffness < 1500.0
    loading = load(scene, Push(at=0.4))
    assert loading.snap is not None
    assert len(loading.rows) >= 3
    # A way a million times as long ends in the same snap, just as well known, in steps that suit this one.
    far = load(scene, Push(at=0.4, most=1e6 * loading.push.most))
    assert far.snap is not None
    assert far.snap.force == loading.snap.force
    assert far.snap.error == loading.snap.error
    assert far.rows == loading.rows
    assert far.branch == loading.branch


@pytest.mark.parametrize("size", SCALES)
def test_a_map_gives_the_same_answer_at_every_size(size: float) -> None:
    most = 20.0 * max(size**2, 1.0)
    small = map_document(load_map(scaled(size), Push(most=most), 3))
    plain = map_document(load_map(scaled(1.0), Push(most=20.0), 3))
    pairs = [*zip(small["points"], plain["points"], strict=True), (small["weakest"], plain["weakest"])]
    for found, expected in pairs:
        assert found["kind"] == expected["kind"]
        for (_, value), (_, other) in zip(numbers(found, size), numbers(expected, 1.0), strict=True):
            same(value, other)


def test_small_numbers_are_printed_with_digits_and_drawn() -> None:
    scene = scaled(1e-3)
    loading, over_all = load(scene, Push(at=0.4)), load_map(scene, Push(), 3)
    lines = list(load_report.describe(loading))
    rows = [line.split() for line in lines if re.fullmatch(r" *[\d.e-]+ +[\d.]+", line)]
    assert len({deflection for _, deflection in rows}) == len(rows) >= 5
    assert float(rows[-1][1]) == pytest.approx(1e3 * loading.rows[-1][1], rel=2e-3)
    assert "not known" not in "\n".join(lines)
    table = [line.split() for line in load_report.describe(over_all) if re.match(r"0\.\d{4} ", line)]
    for cells, point in zip(table, over_all.points, strict=True):
        assert float(cells[1]) == pytest.approx(1e3 * point.x, rel=1e-3)
        if point.force is not None:
            assert float(cells[3]) == pytest.approx(point.force, rel=2e-2)
    for drawn in (loads.draw_loading(loading, "svg"), loads.draw_map(over_all, "svg")):
        assert drawn.startswith(b"<?xml")
