"""Files of a sweep: a row per state, or a document per point, written while the points come in."""

from __future__ import annotations

import csv
import io
import json
import math
from array import array
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from curveline.simulation.batch import Maker, Task, line_of
from curveline.simulation.npz import Pieces, write_npz
from curveline.simulation.results import Settings, ShapeReport, curve_mm, depth_mm, document
from curveline.simulation.sweep import Sweep
from curveline.system.files import NewFile
from curveline.units import to_mm

Row = tuple[Any, ...]
Array = npt.NDArray[Any]

SCALARS = (
    "wanted",
    "stable",
    "simple",
    "outcome",
    "winding",
    "crosses_itself",
    "wraps_clamp",
    "leaves_plane",
    "energy_mJ",
    "error_mm",
    "vertices",
    "iterations",
    "lowest_eigenvalue",
    "mean_height_mm",
    "clearance_mm",
    "max_curvature_per_m",
)
SPACE = ("model", "max_depth_mm")
NOT_ALWAYS_KNOWN = ("error_mm", "lowest_eigenvalue", "clearance_mm")
CLAMPS = (
    "left_force_x_N",
    "left_force_y_N",
    "right_force_x_N",
    "right_force_y_N",
    "left_moment_Nmm",
    "right_moment_Nmm",
)
COLUMNS = ("segment", "state", *SCALARS, *SPACE, *CLAMPS)
"""Of a row, after its point and the swept values."""


class SweepFile:
    """A file that takes what its `make` made of every point, in order; whole or not at all."""

    make: Maker

    def __init__(self, file: NewFile, sweep: Sweep, settings: Settings) -> None:
        self._file = file
        self._keys = tuple(axis.key for axis in sweep.axes)
        self._settings = settings
        self._begin()

    def _begin(self) -> None:
        """What precedes the first point."""

    def take(self, product: Any) -> None:
        """One point."""
        raise NotImplementedError

    def finish(self) -> None:
        """What follows the last point."""


class JsonFile(SweepFile):
    """One document per point and line, the same as on stdout."""

    make = staticmethod(line_of)

    def take(self, product: str) -> None:
        """A document."""
        self._file.write(f"{product}\n".encode())


def rows_of(task: Task, report: ShapeReport) -> list[Row]:
    """A maker: point, swept values, segment, state, scalars and clamps of every state."""
    # Curves are not wanted here, and two points are the fewest that can be asked for.
    short = document(replace(report, settings=replace(report.settings, points=2)))
    values = tuple(value for _, value in task.swept)
    return [
        (
            task.number,
            *values,
            number,
            state["name"],
            *(state[key] for key in SCALARS),
            *_space(segment, state),
            *_clamps(state),
        )
        for number, segment in enumerate(short["segments"], start=1)
        for state in segment["states"]
    ]


def _space(segment: Mapping[str, Any], state: Mapping[str, Any]) -> Row:
    return segment["model"]["kind"], state.get("max_depth_mm", 0.0)


def _clamps(state: Mapping[str, Any]) -> Row:
    left, right = state["clamp_force_N"]
    return (*left, *right, *state["clamp_moment_Nmm"])


class RowArrays(NamedTuple):
    """Rows by column, and the curves (states, points, 2) and depths (states, points) [mm] of the same states."""

    columns: tuple[Array, ...]  # (states,) each, of what `names_of_columns` names
    clamps: Array  # (states, len(CLAMPS))
    curves: Array
    depths: Array


def rows_and_curves_of(task: Task, report: ShapeReport) -> tuple[list[Row], bytes, bytes]:
    """A maker: the rows, and the curves (states, points, 2) and depths (states, points) [mm] of the states as bytes."""
    states = [(index, state) for index, segment in enumerate(report.segments) for state in segment.states]
    curves = [curve_mm(report, index, state).tobytes() for index, state in states]
    depths = [depth_mm(report, state).tobytes() for _, state in states]
    return rows_of(task, report), b"".join(curves), b"".join(depths)


def names_of_columns(keys: Sequence[str]) -> tuple[str, ...]:
    """The columns of a row but those of its clamps; `keys` are swept."""
    return ("point", *keys, "segment", "state", *SCALARS, *SPACE)


class CsvFile(SweepFile):
    """One row per state; truth values are `true` and `false`, and what is not there is empty."""

    make = staticmethod(rows_of)

    def _begin(self) -> None:
        self._write([("point", *self._keys, *COLUMNS)])

    def take(self, product: list[Row]) -> None:
        """The rows of a point."""
        self._write([tuple(map(_cell, row)) for row in product])

    def _write(self, rows: list[Row]) -> None:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows(rows)
        self._file.write(text.getvalue().encode())


def _cell(value: Any) -> Any:
    return str(value).lower() if isinstance(value, bool) else value


class NpzFile(SweepFile):
    """Arrays with one row per state, named as the columns of CSV.

    Curves are curve_mm (states, points, 2) and depth_mm (states, points), clamps are clamp_force_N (states, 2, 2) and
    clamp_moment_Nmm (states, 2); what is not known is infinite. `swept_keys` names the arrays of swept values, and
    `settings` is JSON: tolerance, points, windings, command, model.
    """

    make = staticmethod(rows_and_curves_of)

    def _begin(self) -> None:
        self._parts: list[RowArrays] = []
        self._forget()

    def _forget(self) -> None:
        """No rows wait to become arrays."""
        self._rows: list[Row] = []
        self._curves, self._depths = array("d"), array("d")

    def take(self, product: tuple[list[Row], bytes, bytes] | RowArrays) -> None:
        """The rows, curves and depths of a point, or of several as arrays."""
        if isinstance(product, RowArrays):
            self._gather()
            self._parts.append(product)
            return
        rows, curves, depths = product
        self._rows.extend(rows)
        self._curves.frombytes(curves)
        self._depths.frombytes(depths)

    def _gather(self) -> None:
        """Make arrays of the rows that wait for that."""
        if not self._rows:
            return
        points, names = self._settings.points, names_of_columns(self._keys)
        columns = [
            np.array([math.inf if row[index] is None else row[index] for row in self._rows])
            for index in range(len(names))
        ]
        clamps = np.array([row[len(names) :] for row in self._rows], dtype=np.float64)
        curves = np.frombuffer(self._curves, dtype=np.float64).reshape(-1, points, 2)
        depths = np.frombuffer(self._depths, dtype=np.float64).reshape(-1, points)
        self._parts.append(RowArrays(tuple(columns), clamps, curves, depths))
        self._forget()

    def finish(self) -> None:
        """Write all arrays."""
        self._gather()
        names, points = names_of_columns(self._keys), self._settings.points
        columns: dict[str, Any] = {
            name: self._joined(part.columns[index] for part in self._parts) for index, name in enumerate(names)
        }
        clamps = self._joined(part.clamps for part in self._parts).reshape(-1, len(CLAMPS))
        columns["clamp_force_N"], columns["clamp_moment_Nmm"] = clamps[:, :4].reshape(-1, 2, 2), clamps[:, 4:]
        columns["curve_mm"] = Pieces([part.curves for part in self._parts] or [np.empty((0, points, 2))])
        columns["depth_mm"] = Pieces([part.depths for part in self._parts] or [np.empty((0, points))])
        columns["swept_keys"] = np.array(self._keys)
        columns["settings"] = np.array(json.dumps(self._asked_for()))
        with self._file.stream() as stream:
            write_npz(stream, columns)

    @staticmethod
    def _joined(parts: Iterable[Array]) -> Array:
        whole = np.concatenate([*parts] or [np.array([])])
        # Words are as long as the longest that is there.
        return np.array(whole.tolist()) if whole.dtype.kind == "U" else whole

    def _asked_for(self) -> Mapping[str, Any]:
        given = self._settings
        return {
            "tolerance_mm": to_mm(given.tolerance),
            "points": given.points,
            "windings": given.windings,
            "argv": given.argv,
            "model": given.model,
        }
