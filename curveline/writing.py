"""Results in files: of what kind a result is, and what its encoders take."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

from curveline.errors import InvalidInput, MissingExtra

if TYPE_CHECKING:
    from curveline.outputs import ResultKind
    from curveline.surfaces.fit_surface import FittedSurface

SURFACE_FIGURE = "surface.svg"
KEPT = {
    "atlases.atlas:Atlas": "ATLAS",
    "bench.report:BenchReport": "TRADE",
    "calibrating.calibrated:RodCalibration": "CALIBRATION",
    "calibrating.step_response:Tuning": "TUNING",
    "comparing.agreement:Comparison": "COMPARISON",
    "fitting.fit:Fit": "FIT",
    "loading.falling:SnapFall": "FALL",
    "loading.load_map:LoadMap": "LOADING",
    "loading.snap_through:Loading": "LOADING",
    "radio.measuring.channels:ChannelScan": "CHANNELS",
    "radio.measuring.reach:RangeTest": "RANGE",
    "surfaces.fit_surface:FittedSurface": "SURFACE",
}
"""Module and class of a result -> the name of its kind in `outputs`; none of them is loaded for another's sake."""
TOLD_WHERE = {"calibrating.calibrated:RodCalibration", "fitting.fit:Fit", "surfaces.fit_surface:FittedSurface"}
"""Those whose encoders are told the path of the file."""


def write(
    result: object,
    path: str | os.PathLike[str],
    *,
    force: bool = False,
    points: int | None = None,
    plot: str = "",
) -> None:
    """Keep a result in a file whose suffix says how: data, a figure or a film.

    | result | suffixes |
    |---|---|
    | `ShapeReport`, a sequence of them, `ShapeBatch` | .json, .npz, .csv, .svg, .png, .pdf |
    | `Plan` | .json, to be sent or played; .svg, .png, .pdf, .gif |
    | `Fit` | .toml, the shape; .json, .svg, .png, .pdf |
    | `FittedSurface` | .json, .svg, .png, .pdf; its folder is written by `write_surface` |
    | `Comparison` | .json, .csv, .svg, .png, .pdf |
    | `RodCalibration` | .toml, the display; .json, .svg, .png, .pdf |
    | `Loading`, `LoadMap` | .json, .svg, .png, .pdf |
    | `Atlas` | .npz, .json, .svg, .png, .pdf |
    | `SnapFall` | .gif, .svg, .png, .pdf |
    | `BenchReport` | .json, .svg, .png, .pdf |
    | `Tuning` | .json, .svg, .png, .pdf |
    | `ChannelScan`, `RangeTest` | .json, .csv, .svg, .png, .pdf |
    | `SweepReport` | .json, .npz, .csv; .svg, .png and .pdf over one key or two |

    Curves of shapes and sweeps have `points` points, as many as their settings say (201) if it is None. `plot` is what
    the figure of a sweep over one key shows: a number of the rows such as "energy_mJ", "mean_height_mm" if it is empty.
    Raises InvalidInput for a suffix that does not suit the result, or a file that exists, unless `force` is given;
    MissingExtra for a figure without matplotlib.
    """
    from curveline.outputs import write_output, write_sweep
    from curveline.simulation.sweep_report import SweepReport

    if isinstance(result, SweepReport):
        write_sweep(path, result, points=points, plot=plot, force=force)
        return
    if plot:
        raise InvalidInput(f"{plot}: what is plotted is chosen for the figure of a sweep only", "leave plot out")
    kind, content = _kept(result, path, points)
    write_output(kind, path, content, force=force)


def _kept(result: object, path: str | os.PathLike[str], points: int | None) -> tuple[ResultKind, Sequence[object]]:
    """The kind of a result, and what its encoders take."""
    from curveline import outputs
    from curveline.displays.of_plan import display_of
    from curveline.plan_file import Plan
    from curveline.simulation.results import ShapeReport
    from curveline.simulation.shape_batch import ShapeBatch

    if isinstance(result, Plan):
        is_plan = outputs.PLAN.suffix_of(path) == outputs.PLAN_FILE
        return outputs.PLAN, (result,) if is_plan else (result, display_of(result), lambda done: None)
    of = f"{type(result).__module__}:{type(result).__name__}".removeprefix("curveline.")
    if of in KEPT:
        kind: ResultKind = getattr(outputs, KEPT[of])
        return kind, (result, path) if of in TOLD_WHERE else (result,)
    if isinstance(result, ShapeBatch):
        result = result.reports
    reports = [result] if isinstance(result, ShapeReport) else result
    if isinstance(reports, Sequence) and reports and all(isinstance(each, ShapeReport) for each in reports):
        return outputs.SIMULATION, ([each.with_points(points) for each in reports],)
    hint = "write its `document()` as JSON yourself" if hasattr(result, "document") else "pass what a function returned"
    raise InvalidInput(f"a {type(result).__name__} is kept in no file", hint)


def write_surface(found: FittedSurface, folder: str | os.PathLike[str], *, force: bool = False) -> tuple[str, ...]:
    """Put a surface into a folder for `curveline send`: a shape, a plan and a display per line, and what joins them.

    With matplotlib there is a figure, too. The folder appears whole or not at all; the names of the files in it.
    Raises InvalidInput for a folder that is not empty; with `force` one is replaced that has nothing but what this
    function wrote.
    """
    from curveline.outputs import SURFACE
    from curveline.surfaces.folder import check_folder, write_folder

    check_folder(folder, force=force)
    figures = {}
    with suppress(MissingExtra):
        figures[SURFACE_FIGURE] = SURFACE.encoder(SURFACE.suffix_of(SURFACE_FIGURE))(found)
    return write_folder(folder, found, figures, force=force)
