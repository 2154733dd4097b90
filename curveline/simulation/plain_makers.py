"""What is made of many points of a sweep at once, where their states are plain: the same as makers make one by one."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import groupby, pairwise
from typing import Any

import numpy as np

from curveline._version import __version__
from curveline.rod.geometry.decimals import curves_as_json
from curveline.rod.models.choice import largest_bounds, terms_of
from curveline.rod.models.model_error import judge
from curveline.rod.planar.richardson import EIGENVALUE
from curveline.rod.problem import Pose
from curveline.rod.states.equilibrium import PLANAR, Disturbed, Outcome, equilibrium_of
from curveline.rod.states.plain_states import COARSE_LATERAL, VERTICES
from curveline.rod.states.refined import (
    CLEARANCE,
    ENERGY,
    ERROR,
    FINEST,
    HEIGHT,
    ITERATIONS,
    LEFT_MOMENT,
    LEFT_X,
    RIGHT_MOMENT,
    RIGHT_Y,
    SHARPEST,
    SPREAD,
)
from curveline.simulation import sweep_view
from curveline.simulation.batch import Maker, at_point, line_of
from curveline.simulation.plain_points import PlainStates, PlainSweep
from curveline.simulation.results import provenance_of, segment_document, state_document
from curveline.simulation.simulate import SegmentStates
from curveline.simulation.sweep import Digest, digests, kinds_of
from curveline.simulation.sweep_files import NOT_ALWAYS_KNOWN, Row, RowArrays, names_of_columns, rows_and_curves_of
from curveline.simulation.sweep_files import rows_of as rows_of_point
from curveline.simulation.sweep_view import StateValue, SweepView, combination, values_in
from curveline.units import to_mj, to_mm, to_nmm

PlainMaker = Callable[[PlainSweep, PlainStates], list[Any]]
"""Makes of the states at some points what there is to be taken, one after the other; see `batch.Maker`."""

NO_VERTICES = np.empty((0, 6)), np.empty(0)
PLACEHOLDER = "\0"
"""What stands for a curve where JSON is made: no name has it."""
WRITTEN_PLACEHOLDER = json.dumps(PLACEHOLDER)
MOST_TOLD = 3
"""States from which on one more makes no further kind: peak, middle and valley are all there."""


def digests_of(sweep: PlainSweep, states: PlainStates) -> list[tuple[Digest, ...]]:
    """A maker: the digests of points that are alike, in the order in which such points come first."""
    count = len(sweep.rods)
    heads = _heads(states)
    sizes = np.diff([*heads.tolist(), len(states.point)])
    first, wanted = states.name[heads], np.logical_or.reduceat(states.wanted, heads)
    lowest, highest = (each.reduceat(states.facts[:, EIGENVALUE], heads) for each in (np.minimum, np.maximum))
    error = np.maximum.reduceat(states.facts[:, ERROR], heads)
    kinds = np.unique(first, return_inverse=True)[1]
    told = np.column_stack([np.minimum(sizes, MOST_TOLD), kinds, wanted]).reshape(-1, 3 * count)
    _, begins, groups = np.unique(told, axis=0, return_index=True, return_inverse=True)
    found = []
    for group in np.argsort(begins).tolist():
        cells = np.flatnonzero(groups.ravel() == group)[:, None] * count + np.arange(count)
        digest = []
        for cell, column in zip(cells[0].tolist(), cells.T, strict=True):
            words = kinds_of(states.name[heads[cell] : heads[cell] + sizes[cell]].tolist())
            extremes = float(lowest[column].min()), float(highest[column].max()), float(error[column].max())
            digest.append(Digest(words, *extremes, bool(wanted[cell]), frozenset(), len(column)))
        found.append(tuple(digest))
    return found


def arrays_of(sweep: PlainSweep, states: PlainStates) -> list[RowArrays]:
    """A maker: the rows of all states by column, and their curves."""
    columns = _columns(sweep, states)
    keys = [axis.key for axis in sweep.sweep.axes]
    depths = np.zeros(states.curves.shape[:2])
    named = tuple(columns[name] for name in names_of_columns(keys))
    return [RowArrays(named, _clamps(states), states.curves, depths)]


def rows_of(sweep: PlainSweep, states: PlainStates) -> list[list[Row]]:
    """A maker: the rows of all states."""
    columns = _columns(sweep, states)
    keys = [axis.key for axis in sweep.sweep.axes]
    values = [columns[name].tolist() for name in names_of_columns(keys)]
    for place, name in enumerate(names_of_columns(keys)):
        if name in NOT_ALWAYS_KNOWN:
            values[place] = [value if np.isfinite(value) else None for value in values[place]]
    return [list(zip(*values, *_clamps(states).T.tolist(), strict=True))]


def lines_of(sweep: PlainSweep, states: PlainStates) -> list[str]:
    """A maker: the JSON documents of all points, a line each."""
    return ["\n".join(_lines(sweep, states))]


def values_of(view: SweepView, sweep: PlainSweep, states: PlainStates) -> list[tuple[int, list[StateValue]]]:
    """A maker: what a figure over one key shows of each point."""
    (rows,), swept = rows_of(sweep, states), len(sweep.sweep.axes)
    return [values_in(view, own, (number, swept)) for number, own in groupby(rows, key=lambda row: int(row[0]))]


def combinations_of(view: SweepView, sweep: PlainSweep, states: PlainStates) -> list[tuple[int, list[str]]]:
    """A maker: what a figure over two keys shows of each point."""
    count = len(sweep.rods)
    heads = _heads(states).tolist()
    names = states.name.tolist()
    kinds = [kinds_of(names[begin:end]) for begin, end in pairwise([*heads, len(names)])]
    numbers = states.point[heads[::count]].tolist()
    return [combination(view, number, kinds[count * i : count * (i + 1)]) for i, number in enumerate(numbers)]


VIEW_MAKERS: Mapping[Callable[..., Any], Callable[..., list[Any]]] = {
    sweep_view.values_of: values_of,
    sweep_view.combinations_of: combinations_of,
}
"""For makers of what figures show, which are told how, those that make it of many points."""

PLAIN_MAKERS: Mapping[Maker, PlainMaker] = {
    digests: digests_of,
    rows_and_curves_of: arrays_of,
    rows_of_point: rows_of,
    line_of: lines_of,
}
"""For makers of what is to be known of a point, those that make it of many."""


def plain_maker(make: Maker) -> PlainMaker | None:
    """What makes of many points what `make` makes of one; None if there is no such maker."""
    if isinstance(make, partial) and make.func in VIEW_MAKERS:
        return partial(VIEW_MAKERS[make.func], *make.args)
    return PLAIN_MAKERS.get(make)


def _heads(states: PlainStates) -> Any:
    """The first row of every segment at every point."""
    point, segment = states.point, states.segment
    is_next = (point[1:] != point[:-1]) | (segment[1:] != segment[:-1])
    return np.concatenate([[0], 1 + np.flatnonzero(is_next)])


def _columns(sweep: PlainSweep, states: PlainStates) -> dict[str, Any]:
    """The columns of rows (s,) but those of the clamps."""
    facts, count = states.facts, len(states.point)
    swept = sweep.poses.values(states.point - 1).T
    yes, no = np.ones(count, dtype=np.bool_), np.zeros(count, dtype=np.bool_)
    return {
        "point": states.point,
        **{axis.key: values for axis, values in zip(sweep.sweep.axes, swept, strict=True)},
        "segment": states.segment + 1,
        "state": states.name,
        "wanted": states.wanted,
        "stable": yes,
        "simple": yes,
        "outcome": np.full(count, Outcome.CONVERGED.name.lower()),
        "winding": np.zeros(count, dtype=np.int64),
        "crosses_itself": no,
        "wraps_clamp": no,
        "leaves_plane": no,
        "energy_mJ": to_mj(facts[:, ENERGY]),  # type: ignore[arg-type]
        "error_mm": to_mm(facts[:, ERROR]),  # type: ignore[arg-type]
        "vertices": facts[:, FINEST].astype(np.int64) + 1,
        "iterations": facts[:, ITERATIONS].astype(np.int64),
        "lowest_eigenvalue": facts[:, EIGENVALUE],
        "mean_height_mm": to_mm(facts[:, HEIGHT]),  # type: ignore[arg-type]
        "clearance_mm": to_mm(facts[:, CLEARANCE]),  # type: ignore[arg-type]
        "max_curvature_per_m": facts[:, SHARPEST],
        "model": np.full(count, PLANAR),
        "max_depth_mm": np.zeros(count),
    }


def _clamps(states: PlainStates) -> Any:
    """Forces and moments of the clamps in the order of `CLAMPS`, (s, 6)."""
    moments = to_nmm(states.facts[:, LEFT_MOMENT : RIGHT_MOMENT + 1])  # type: ignore[arg-type]
    return np.column_stack([states.facts[:, LEFT_X : RIGHT_Y + 1], moments])


def _lines(sweep: PlainSweep, states: PlainStates) -> Iterator[str]:
    """The document of every point."""
    scene, settings = sweep.sweep.file.scene, sweep.settings
    provenance = json.dumps(provenance_of(scene, settings), allow_nan=False)
    whole: dict[str, Any] = {
        "curveline": __version__,
        "shape": scene.name,
        "tolerance_mm": to_mm(settings.tolerance),
        "seconds": states.seconds,
    }
    count = len(sweep.rods)
    curves = curves_as_json(states.curves)
    ends = [*_heads(states).tolist(), len(states.point)]
    numbers = states.point[ends[:-1:count]]
    keys = [axis.key for axis in sweep.sweep.axes]
    swept = sweep.poses.values(numbers - 1).tolist()
    poses = [sweep.poses.poses(index, numbers - 1).tolist() for index in range(count)]
    for place, number in enumerate(numbers.tolist()):
        documents = []
        for index in range(count):
            rows = range(*ends[place * count + index :][:2])
            documents.append(_segment_document(sweep, states, rows, (index, Pose(*poses[index][place]))))
        point = at_point({**whole, "segments": documents}, number, zip(keys, swept[place], strict=True))
        text = json.dumps(point, allow_nan=False)[:-1]
        parts = text.split(WRITTEN_PLACEHOLDER)
        own = curves[ends[place * count] : ends[(place + 1) * count]]
        filled = [piece for part, curve in zip(parts, own, strict=False) for piece in (part, curve)]
        yield "".join([*filled, parts[-1], ', "provenance": ', provenance, "}"])


def _segment_document(sweep: PlainSweep, states: PlainStates, rows: range, at: tuple[int, Pose]) -> dict[str, Any]:
    """What there is to say of a segment, by its number, at a point where it has a pose; without its curves."""
    index, pose = at
    rod, scene = sweep.rods[index].moved_to(pose), sweep.sweep.file.scene
    found = []
    for row in rows:
        state = equilibrium_of(rod, *NO_VERTICES, states.facts[row], sweep.settings.tolerance)
        coarse, fine, stretched, weighed = states.facts[row, COARSE_LATERAL:VERTICES].tolist()
        disturbed = Disturbed(coarse, fine, stretched, weighed, float(states.facts[row, SPREAD]))
        named = {"name": str(states.name[row]), "wanted": bool(states.wanted[row]), "disturbed": disturbed}
        found.append(state.but(**named))
    segment = SegmentStates(
        length=pose.length,
        wanted_name=scene.segments[index].state,
        origin=(0.0, 0.0),
        terms=terms_of(rod, PLANAR),
        left_out=largest_bounds([judge(state) for state in found]),
        states=tuple(found),
    )
    return segment_document(segment, [state_document(state, PLACEHOLDER) for state in found], {})
