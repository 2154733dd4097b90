"""Results of a simulation as JSON, NPZ and CSV: mm, N, N mm, mJ and degrees, with what they were made from."""

from __future__ import annotations

import csv
import io
import json
import math
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import version
from numbers import Integral, Real
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from curveline._version import __version__
from curveline.errors import InvalidInput
from curveline.notebook import html_of, svg_of
from curveline.rod.geometry.space_curve import SpaceCurve
from curveline.rod.states.equilibrium import Equilibrium, Outcome
from curveline.scene import STRAIGHT, Scene
from curveline.simulation.explanation import deepest, explain
from curveline.simulation.npz import write_npz
from curveline.simulation.simulate import AUTO, DEFAULT_TOLERANCE, STATE_HEAD, SegmentStates
from curveline.system.arguments import expect
from curveline.units import millimetres, to_mj, to_mm, to_nmm

DEFAULT_POINTS = 201
Array = npt.NDArray[np.float64]
Document = dict[str, Any]


@dataclass(frozen=True)
class Settings:
    """What a user asked of a simulation; `argv` is the command as typed."""

    tolerance: float = DEFAULT_TOLERANCE  # [m]
    points: int = DEFAULT_POINTS  # of a curve in files
    windings: tuple[int, ...] = (0,)  # further full turns to look for
    argv: tuple[str, ...] = ()
    model: str = AUTO  # "auto", "planar", "extensible", "spatial"
    explained: bool = False  # files say in words what was modelled and why

    def __post_init__(self) -> None:
        expect(self.tolerance, Real, "a tolerance in m")
        expect(self.points, Integral, "a number of points")
        expect(self.windings, Sequence, "a sequence of windings, such as (0, 1, -1),")
        for turns in self.windings:
            expect(turns, Integral, "a whole number of windings")
        if not 0.0 < self.tolerance < math.inf:
            hint = "choose a length above 0 in m, such as 1e-4 for 0.1 mm"
            raise InvalidInput(f"no curve has a tolerance of {self.tolerance!r}", hint)
        if self.points < 2:
            raise InvalidInput(f"no curve has {self.points} points", "choose 2 or more")


@dataclass(frozen=True)
class ShapeReport:
    """The states of every segment of a scene, how they were asked for, and how long that took."""

    scene: Scene  # what was simulated
    segments: tuple[SegmentStates, ...]  # left to right
    settings: Settings  # as asked for
    seconds: float  # [s]

    @property
    def shortfalls(self) -> tuple[str, ...]:
        """One sentence for every wanted state that does not exist and every state short of the tolerance."""
        return tuple(self._shortfalls())

    @property
    def remarks(self) -> tuple[str, ...]:
        """One sentence for every model that was asked for and leaves out more than the tolerance."""
        return tuple(self._remarks())

    def document(self) -> Document:
        """What `curveline simulate --json` prints of the shape, as plain data."""
        return document(self)

    def with_points(self, points: int | None) -> ShapeReport:
        """The same, with curves of `points` points in its files; unchanged for None."""
        return self if points is None else replace(self, settings=replace(self.settings, points=points))

    def __iter__(self) -> Iterator[SegmentStates]:
        return iter(self.segments)

    def __len__(self) -> int:
        return len(self.segments)

    def __getitem__(self, index: int) -> SegmentStates:
        return self.segments[index]

    def _repr_svg_(self) -> str | None:
        return svg_of("curveline.figures.shapes:draw", [self])

    def _repr_html_(self) -> str:
        rows = [(number, *row) for number, segment in enumerate(self.segments, start=1) for row in segment.rows()]
        return html_of(self.scene.name, [("segment", *STATE_HEAD), *rows], self._repr_svg_())

    def _remarks(self) -> Iterator[str]:
        for number, segment in enumerate(self.segments if self.settings.model != AUTO else (), start=1):
            for name, bound in segment.left_out.items():
                if bound.bound > self.settings.tolerance:
                    effect = f"which may move it by {millimetres(bound.bound)}"
                    yield f"segment {number}: the {segment.model} model leaves out {name}, {effect}"

    def _shortfalls(self) -> Iterator[str]:
        for number, segment in enumerate(self.segments, start=1):
            if segment.wanted is None:
                there = ", ".join(state.name for state in segment.states if state.stable) or "none at all"
                advice = f": {segment.advice}" if segment.advice else ""
                lack = f"has no {segment.wanted_name}" if segment.wanted_name != STRAIGHT else "is not straight"
                yield f"segment {number} {lack}; its stable states: {there}{advice}"
            for state in segment.states:
                # No display shows a loop or a crossing; it is listed whether or not it would stay in its plane.
                is_loop = state.outcome is Outcome.BUCKLES and not state.is_untangled
                if state.outcome is not Outcome.CONVERGED and not is_loop:
                    yield f"segment {number}, {state.name}: {state.outcome.value}"


def document(report: ShapeReport) -> Document:
    """What `curveline simulate --json` prints of one shape; plain Python types only."""
    return {
        "curveline": __version__,
        "shape": report.scene.name,
        "tolerance_mm": to_mm(report.settings.tolerance),
        "seconds": report.seconds,
        **({} if report.scene.past is None else {"after": report.scene.past.document()}),
        "segments": [_segment_document(report, index) for index in range(len(report.segments))],
        "provenance": provenance_of(report.scene, report.settings),
    }


def to_json(reports: Sequence[ShapeReport]) -> bytes:
    """One document per line."""
    return "".join(json.dumps(document(report), allow_nan=False) + "\n" for report in reports).encode()


def to_npz(reports: Sequence[ShapeReport]) -> bytes:
    """Arrays with one row per state, and beside them document, one per shape: its JSON, curves left out.

    Arrays: shape, segment, state, wanted, stable, winding, crosses_itself, wraps_clamp, energy_mJ, error_mm,
    lowest_eigenvalue, mean_height_mm, clamp_force_N (states, 2, 2), clamp_moment_Nmm (states, 2), curve_mm
    (states, points, 2), and model, leaves_plane, max_depth_mm and depth_mm (states, points), zero in the plane; all
    reports have the same number of points. An error or an eigenvalue that is not known is infinite.
    """
    rows = list(_rows(reports))
    points = reports[0].settings.points
    columns: dict[str, Any] = {
        "shape": [row.report.scene.name for row in rows],
        "segment": [row.number for row in rows],
        "state": [row.record["name"] for row in rows],
    }
    columns["model"] = [row.report.segments[row.number - 1].model for row in rows]
    for name in ("wanted", "stable", "crosses_itself", "wraps_clamp", "leaves_plane"):
        columns[name] = np.array([row.record[name] for row in rows], dtype=bool)
    columns["winding"] = np.array([row.record["winding"] for row in rows], dtype=np.int64)
    for name in ("energy_mJ", "error_mm", "lowest_eigenvalue", "mean_height_mm"):
        values = [math.inf if row.record[name] is None else row.record[name] for row in rows]
        columns[name] = np.array(values, dtype=np.float64)
    columns["max_depth_mm"] = np.array([row.record.get("max_depth_mm", 0.0) for row in rows], dtype=np.float64)
    flat = [0.0] * points
    columns["depth_mm"] = np.array([row.record.get("depth_mm", flat) for row in rows]).reshape(len(rows), points)
    for name, size in (("clamp_force_N", (2, 2)), ("clamp_moment_Nmm", (2,)), ("curve_mm", (points, 2))):
        columns[name] = np.array([row.record[name] for row in rows], dtype=np.float64).reshape(len(rows), *size)
    columns["document"] = [json.dumps(_without_curves(document(report)), allow_nan=False) for report in reports]
    stream = io.BytesIO()
    write_npz(stream, columns)
    return stream.getvalue()


def to_csv(reports: Sequence[ShapeReport]) -> bytes:
    """One row per curve point; `point` counts from 0 at the left pivot."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(("shape", "segment", "state", "wanted", "simple", "point", "arc_length_mm", "x_mm", "y_mm", "z_mm"))
    for row in _rows(reports):
        head = (row.report.scene.name, row.number, row.record["name"])
        flags = (str(row.record["wanted"]).lower(), str(row.record["simple"]).lower())
        points = row.record["curve_mm"]
        depth = row.record.get("depth_mm", [0.0] * len(points))
        length = to_mm(row.report.segments[row.number - 1].length)
        for index, ((x, y), z) in enumerate(zip(points, depth, strict=True)):
            place = length * index / (len(points) - 1)
            writer.writerow((*head, *flags, index, repr(place), repr(x), repr(y), repr(z)))
    return stream.getvalue().encode()


def curve_mm(report: ShapeReport, index: int, state: Equilibrium) -> Array:
    """The curve of a state of segment `index`, (points, 2) [mm] in the display's frame, from pivot to pivot."""
    scene, segment = report.scene, report.segments[index]
    curve: Array = to_mm(state.curve(report.settings.points) + np.array(segment.origin))  # type: ignore[assignment]
    # Adding the origin rounds; the ends are the pivots to the last bit.
    span = scene.display.span
    curve[0] = to_mm(index * span), to_mm(scene.nodes[index].height)
    curve[-1] = to_mm((index + 1) * span), to_mm(scene.nodes[index + 1].height)
    return curve


def depth_mm(report: ShapeReport, state: Equilibrium) -> Array:
    """How far the points of `curve_mm` lie in front of the display's plane, (points,) [mm]."""
    depth: Array = to_mm(state.depth(report.settings.points))  # type: ignore[arg-type, assignment]
    return depth


class _Row(NamedTuple):
    """A state as one row of a table: its report, its segment's number from 1, its record."""

    report: ShapeReport
    number: int
    record: Document


def _rows(reports: Sequence[ShapeReport]) -> Iterator[_Row]:
    for report in reports:
        for index, segment in enumerate(report.segments):
            for state in segment.states:
                yield _Row(report, index + 1, _state_document(report, index, state))


def _segment_document(report: ShapeReport, index: int) -> Document:
    segment = report.segments[index]
    explanation = {"explanation": list(explain(segment))} if report.settings.explained else {}
    states = [_state_document(report, index, state) for state in segment.states]
    return segment_document(segment, states, explanation)


def segment_document(segment: SegmentStates, states: Sequence[Any], explanation: Document) -> Document:
    """A segment with what there is to say of its `states`, and an `explanation`, if there is one."""
    bounds = {
        name: {"bound_mm": to_mm(float(bound.bound)), "why": bound.why} for name, bound in segment.left_out.items()
    }
    return {
        "length_mm": to_mm(segment.length),
        "wanted": segment.wanted_name,
        "model": {"kind": segment.model, "terms": list(segment.terms), "left_out": bounds, **explanation},
        "states": states,
    }


def _state_document(report: ShapeReport, index: int, state: Equilibrium) -> Document:
    space = _space_document(report, state, state.space) if state.space is not None else {}
    return {**state_document(state, curve_mm(report, index, state).tolist()), **space}


def state_document(state: Equilibrium, curve: Any) -> Document:
    """A state by what it has in the plane; `curve` are its points [mm], or what stands for them."""
    return {
        "name": state.name,
        "stable": bool(state.stable),
        "wanted": bool(state.wanted),
        "simple": bool(state.simple),
        "outcome": state.outcome.name.lower(),
        "energy_mJ": to_mj(float(state.energy)),
        "error_mm": _known(to_mm(state.error)),
        "vertices": int(state.vertices),
        "iterations": int(state.iterations),
        "lowest_eigenvalue": _known(state.lowest_eigenvalue),
        "winding": int(state.winding),
        "crosses_itself": bool(state.crosses_itself),
        "wraps_clamp": bool(state.wraps_clamp),
        "leaves_plane": bool(state.leaves_plane),
        "mean_height_mm": to_mm(float(state.mean_height)),
        "clearance_mm": _known(to_mm(state.clearance)),
        "max_curvature_per_m": float(state.max_curvature),
        "curve_mm": curve,
        "clamp_force_N": np.asarray(state.clamp_force, dtype=np.float64).tolist(),
        "clamp_moment_Nmm": [to_nmm(float(moment)) for moment in state.clamp_moment],
    }


def _space_document(report: ShapeReport, state: Equilibrium, space: SpaceCurve) -> Document:
    """What a state of the spatial model has besides."""
    return {
        "depth_mm": depth_mm(report, state).tolist(),
        "max_depth_mm": to_mm(deepest(state)),
        "clamp_force_xyz_N": space.forces.tolist(),
        "clamp_moment_xyz_Nmm": [[to_nmm(moment) for moment in each] for each in space.moments.tolist()],
    }


def _known(value: float) -> float | None:
    """A number for JSON, which knows no infinity: None for what is not known."""
    return float(value) if math.isfinite(value) else None


def _without_curves(record: Document) -> Document:
    """The same document for a file whose curves are arrays."""
    for segment in record["segments"]:
        for state in segment["states"]:
            del state["curve_mm"]
            state.pop("depth_mm", None)
    return record


def provenance_of(scene: Scene, settings: Settings) -> Document:
    """Where what was simulated of a scene comes from."""
    asked = {
        "tolerance_mm": to_mm(settings.tolerance),
        "points": settings.points,
        "windings": list(settings.windings),
        "model": settings.model,
    }
    return provenance(scene, asked, settings.argv)


def provenance(scene: Scene, settings: Document, argv: Sequence[str]) -> Document:
    """Where a result comes from: versions, the files it was made from, what was asked for, the command as typed."""
    return {
        "versions": {"curveline": __version__, "python": platform.python_version(), **_versions()},
        "shape": {"path": scene.path, "sha256": scene.digest},
        "display": {"name": scene.display.name, "sha256": scene.display.digest},
        "rod": {"stiffness_from": scene.display.rod.stiffness_key, **scene.display.rod.as_given},
        "settings": settings,
        "argv": list(argv),
    }


@cache
def _versions() -> Mapping[str, str]:
    return {name: version(name) for name in ("numpy", "numba", "scipy")}
