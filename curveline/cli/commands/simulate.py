"""`curveline simulate`: every stable state of every segment of shape files."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from curveline.cli.options import RESULTS, BriefOption, ForceOption

if TYPE_CHECKING:
    from curveline.material.history import Dwell

COMPUTED = "What is computed"
MOST_JOBS = 256
SMALLEST_TOLERANCE_MM = 1e-6
LARGEST_TOLERANCE_MM = 10.0


class ModelOption(StrEnum):
    """What `--model` takes: `MODELS` of the physics, which would cost numpy to look at."""

    AUTO = "auto"
    PLANAR = "planar"
    EXTENSIBLE = "extensible"
    SPATIAL = "spatial"


def simulate(
    shapes: Annotated[list[str], typer.Argument(metavar="SHAPE", help="Shape files (.toml).")],
    tolerance_mm: Annotated[
        float,
        typer.Option(
            "-t",
            "--tolerance-mm",
            min=SMALLEST_TOLERANCE_MM,
            max=LARGEST_TOLERANCE_MM,
            metavar="MM",
            rich_help_panel=COMPUTED,
            help="Largest error of a curve.",
        ),
    ] = 0.1,
    points: Annotated[
        int,
        typer.Option(
            "-p",
            "--points",
            min=2,
            max=100_001,
            metavar="N",
            rich_help_panel=RESULTS,
            help="Points of a curve in files and JSON.",
        ),
    ] = 201,
    turns: Annotated[
        int,
        typer.Option(
            min=0, max=3, metavar="N", rich_help_panel=COMPUTED, help="Look for loops of up to N further turns."
        ),
    ] = 0,
    model: Annotated[
        ModelOption,
        typer.Option(
            "-m",
            "--model",
            metavar="MODEL",
            rich_help_panel=COMPUTED,
            help="What of the rod is computed; with auto the scene decides, segment by segment.",
        ),
    ] = ModelOption.AUTO,
    output: Annotated[
        list[str] | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            rich_help_panel=RESULTS,
            help="Write .json, .npz, .csv, .svg, .png or .pdf; - is JSON on stdout.",
        ),
    ] = None,
    force: ForceOption = False,
    json: Annotated[
        bool,
        typer.Option(
            "--json",
            rich_help_panel=RESULTS,
            help="JSON on stdout: a document, or an error, per shape and line.",
        ),
    ] = False,
    brief: BriefOption = False,
    no_drawing: Annotated[bool, typer.Option("--no-drawing", rich_help_panel=RESULTS, help="Tables only.")] = False,
    explain: Annotated[
        bool,
        typer.Option("-e", "--explain", rich_help_panel=RESULTS, help="Say in words what was modelled and why."),
    ] = False,
    after: Annotated[
        str | None,
        typer.Option(
            metavar="SHAPE@TIME,...",
            rich_help_panel=COMPUTED,
            help="What the rod went through: shapes and how long it was in each, such as other.toml@8h,home@30min.",
        ),
    ] = None,
    sweep: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=START:STOP:COUNT",
            rich_help_panel=COMPUTED,
            help="Run a number of the shape through a range, such as nodes.1.angle_deg=-60:60:41, counted from 1. Of "
            "several, every combination is simulated.",
        ),
    ] = None,
    plot: Annotated[
        str | None,
        typer.Option(
            metavar="KEY",
            help="What the figure of a sweep over one key shows, such as energy_mJ.  [default: mean_height_mm]",
        ),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            "-j",
            "--jobs",
            min=0,
            max=MOST_JOBS,
            metavar="N",
            help="Threads or processes to take; 0 is one per core, the default for many hundred shapes or points.",
        ),
    ] = None,
) -> None:
    """Find every stable state of every segment.

    Each comes with an error bar, and what the model leaves out with a bound in mm. The table gives the height of the
    curve over its chord, on average and in the middle (in space: how far it comes out of the plane), energy, error,
    stability, which is the lowest eigenvalue of the second variation in EI/L^2, and force and moment at the left and
    the right clamp; * marks what the shape asks for.

    The planar model bends in the display's plane, the extensible one also stretches, the spatial one also bends out of
    the plane and twists. A model that was asked for is used whatever it leaves out, which is then said.

    With --after the rod is as it comes out of other shapes, or of itself straight, at home: plastic keeps part of a
    curve that it was held in. TIME is a number and s, min, h, d or w; SHAPE@TIME@40C says how warm it was.

    With --sweep one shape is simulated at every point of a grid. Its table counts the points at which each combination
    of states is stable; --json is a document per point, .csv a row and .npz a row and a curve per state. A figure shows
    a value of every state over one key, a map of which states exist over two.
    """
    from curveline.cli.batch import BatchRequest, run_batch
    from curveline.outputs import SIMULATION, SWEEP, check_output
    from curveline.simulation.results import Settings
    from curveline.units import mm

    files = [path for path in output or () if path != "-"]
    as_json = json or len(files) < len(output or ())
    for path in files:
        check_output(SWEEP if sweep else SIMULATION, path, force=force)
    if plot is not None:
        _check_plot(plot, files if sweep else ())
    windings = (0, *(sign * turn for turn in range(1, turns + 1) for sign in (1, -1)))
    settings = Settings(mm(tolerance_mm), points, windings, tuple(sys.argv[1:]), model.value, explain)
    history = _history(after, sweep)
    request = BatchRequest(settings, tuple(files), force, as_json, not no_drawing, jobs, history)
    if sweep:
        from curveline.cli.sweep import run_sweep

        raise typer.Exit(run_sweep(shapes, sweep, request, plot or ""))
    raise typer.Exit(run_batch(shapes, request))


def _history(after: str | None, sweep: Sequence[str] | None) -> tuple[Dwell, ...]:
    """The dwells of --after; InvalidInput for what cannot be read, and beside --sweep."""
    from curveline.errors import InvalidInput
    from curveline.material.history import parse_history

    if after is not None and sweep:
        raise InvalidInput("--after is for shapes, and not for a sweep", "leave one of the two out")
    return () if after is None else parse_history(after)


def _check_plot(plot: str, files: Sequence[str]) -> None:
    """InvalidInput unless there is a figure of a sweep among the files, and this can be plotted."""
    from curveline.errors import InvalidInput
    from curveline.outputs import PICTURES, SWEEP
    from curveline.simulation.sweep_view import check_plot

    if not any(SWEEP.suffix_of(path) in PICTURES for path in files):
        raise InvalidInput("--plot is for the figure of a sweep", "add --sweep KEY=START:STOP:COUNT -o FILE.svg")
    check_plot(plot)
