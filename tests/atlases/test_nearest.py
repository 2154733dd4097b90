"""Stable curves near a drawn one, and fits that begin there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import curveline
from curveline.atlases.curves import StableCurves
from curveline.atlases.entries import POINTS, share_of
from curveline.atlases.nearest import nearest_curves
from curveline.fitting import search
from curveline.fitting.cutting import cut_at_rails
from curveline.fitting.descent import descended
from curveline.fitting.fit import EFFORTS
from curveline.fitting.row import Reserve, Wanted
from curveline.fitting.starts import level_rod, nearest_starts
from curveline.rod.branches.continuation import STIFFEST
from curveline.scene import Range

SINGLE = curveline.read_display("single")
ROOM = Reserve(margin=0.12, part=0.92)


@pytest.fixture(scope="module")
def curves() -> StableCurves:
    return curveline.stable_curves(SINGLE)


def has_room(curves: StableCurves) -> np.ndarray:
    return (curves.entries["lowest_eigenvalue"] >= ROOM.margin * STIFFEST) & (
        share_of(curves.entries, SINGLE) <= ROOM.part
    )


def test_a_curve_is_nearest_to_itself_wherever_it_is_on_the_rails(curves: StableCurves) -> None:
    places = np.flatnonzero(has_room(curves))[::400]
    assert len(places) > 5
    for place in places.tolist():
        row = curves.entries[place]
        near = nearest_curves(SINGLE, row["curve"] + np.array([0.0, 0.07]), 3, *ROOM)
        assert near[0].height == pytest.approx(0.07, abs=1e-12)
        assert near[0].pose == tuple(curves.where[place].tolist())
        assert near[0].angles.tobytes() == row["angles"].tobytes()


def test_the_nearest_are_those_of_all_with_room_and_differ(curves: StableCurves) -> None:
    x = np.linspace(0.0, 0.5, POINTS)
    drawn = np.column_stack([x, 0.05 * np.sin(2.0 * np.pi * x / 0.5) + 0.02])
    near = nearest_curves(SINGLE, drawn, 6, *ROOM)
    shapes = curves.entries["curve"] - curves.entries["curve"].mean(axis=1, keepdims=True) * [0.0, 1.0]
    gaps = np.sqrt(np.mean(np.sum((shapes - (drawn - [0.0, drawn[:, 1].mean()])) ** 2, axis=2), axis=1))
    best = gaps[has_room(curves)].min()
    found = [np.flatnonzero((curves.where == each.pose).all(axis=1)) for each in near]
    places = [min(each, key=lambda place: gaps[place]) for each in found]
    assert gaps[places[0]] == best
    assert (np.diff(gaps[places]) >= 0.0).all()
    for number, place in enumerate(places):
        for other in places[:number]:
            assert np.sqrt(np.mean(np.sum((shapes[place] - shapes[other]) ** 2, axis=1))) > best


def test_there_are_none_without_room_or_without_an_atlas() -> None:
    drawn = np.column_stack([np.linspace(0.0, 0.5, POINTS), np.zeros(POINTS)])
    assert nearest_curves(SINGLE, drawn, 6, 1e6, 0.92) == []
    straight = replace(SINGLE, limits=replace(SINGLE.limits, length=Range(0.5, 0.5)))
    assert nearest_curves(straight, drawn, 6, *ROOM) == []


def test_fits_begin_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """A wave of a whole length: most starts around the ends of the drawing, which is level there, lead elsewhere."""
    x = np.linspace(0.0, 0.5, 200)
    drawing = curveline.Drawing(np.column_stack([x, 0.08 * np.sin(2.0 * np.pi * x / 0.5)]), "wave")
    rod = level_rod(SINGLE)
    wanted = Wanted(SINGLE, rod.extensible().bearing, *cut_at_rails(drawing, SINGLE), ROOM)
    starts = nearest_starts(wanted, search.NEAREST)
    assert len(starts) == search.NEAREST
    rows = [row for start in starts if (row := descended(wanted, *start)) is not None]
    met = search.search(wanted, rod, EFFORTS["quick"], 1)
    assert len(rows) >= 4
    assert min(row.rms for row in rows) == pytest.approx(met.rows[0].rms, rel=search.SAME)
    taken = []
    monkeypatch.setattr(search, "descended", lambda wanted, numbers, held: taken.append(numbers.tolist()))
    search.search(wanted, rod, EFFORTS["quick"], 1)
    assert all(start.numbers.tolist() in taken for start in starts)
